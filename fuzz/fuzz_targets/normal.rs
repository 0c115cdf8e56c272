//! Any words are symbols of a Gaussian.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::normal(bytes));
