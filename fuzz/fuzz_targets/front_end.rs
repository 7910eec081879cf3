//! See `overcoat_fuzz::front_end`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| overcoat_fuzz::front_end(bytes));
