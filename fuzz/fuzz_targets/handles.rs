//! See `overcoat_fuzz::handles`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| overcoat_fuzz::handles(bytes));
