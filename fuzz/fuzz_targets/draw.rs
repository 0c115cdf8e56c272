//! Any bytes with right checksums draw or are refused.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::draw(bytes));
