//! See `overcoat_fuzz::studio`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| overcoat_fuzz::studio(bytes));
