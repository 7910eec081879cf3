//! Any text is a script or an error: `cargo +nightly fuzz run parse ../tests/corpus/osl`.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = overcoat::syntax::parse(text);
});
