//! Any bytes with right checksums decode or are refused.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::symbols(bytes));
