//! Scripts: any text is one, or an error.

use overcoat::closure::ClosureTree;
use overcoat::ir::{Batch, Host, Subject, compile_with};
use overcoat::syntax::{Limits, Options};
use overcoat::{Differentials, Globals};
use std::sync::Arc;

/// Any text is a script or an error.
pub fn parse(bytes: &[u8]) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = overcoat::syntax::parse(text);
    }
}

/// Says that it answers everything, derivatives too.
struct Answering;

impl Host for Answering {
    fn answers(&self, _: Subject) -> bool {
        true
    }
}

/// Any text is compiled, specialised and shaded, alone and side by side with the same result, or an error.
pub fn front_end(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    // Small budgets: what takes long is an error soon.
    let limits = Limits {
        expanded_bytes: 1 << 16,
        calls: 1 << 8,
        expressions: 1 << 14,
        iterations: 1 << 10,
        ..Limits::default()
    };
    let options = Options { limits, ..Options::default() };
    let Ok((shader, _)) = compile_with("fuzz.osl", text, &[], &options, Some(Arc::new(Answering))) else { return };
    let Ok(program) = shader.specialise(&[]) else { return };
    let at = |u: f32| Globals {
        u,
        v: 0.3,
        differentials: Differentials { dudx: 0.1, dvdy: 0.2, ..Differentials::default() },
        ..Globals::default()
    };
    let points = [at(0.0), at(0.7), at(-3.0)];
    let mut batch = Batch::new();
    program.shade_batch(&points, &mut batch);
    for (point, found) in points.iter().zip(batch.trees()) {
        let mut tree = ClosureTree::new();
        if program.shade(point, &mut tree).is_ok() {
            assert_eq!(format!("{found:?}"), format!("{tree:?}"));
        }
    }
}
