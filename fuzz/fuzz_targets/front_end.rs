//! Any text is compiled, specialised and shaded, or an error: `cargo +nightly fuzz run front_end ../tests/corpus/osl`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use overcoat::syntax::Limits;
use overcoat::{Engine, Globals};

fuzz_target!(|text: &str| {
    // Small budgets: what takes long is an error soon.
    let limits = Limits {
        expanded_bytes: 1 << 16,
        calls: 1 << 8,
        expressions: 1 << 14,
        iterations: 1 << 10,
        ..Limits::default()
    };
    match Engine::new().limits(limits).compile("fuzz.osl", text) {
        Err(e) => drop(e.to_string()),
        Ok(shader) => {
            if let Ok(program) = shader.material(&[]) {
                let _ = program.tree(&Globals::default());
            }
        }
    }
});
