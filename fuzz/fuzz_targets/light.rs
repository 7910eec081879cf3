//! See `overcoat_fuzz::light`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| overcoat_fuzz::light(bytes));
