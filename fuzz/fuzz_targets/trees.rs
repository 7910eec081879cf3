//! See `overcoat_fuzz::trees`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| overcoat_fuzz::trees(bytes));
