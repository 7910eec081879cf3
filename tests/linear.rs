//! The grammar's work grows in proportion to the text.
//!
//! pest's call limit is one setting for the whole process, which a library must not touch; this test, a process of its
//! own, does, and so holds the grammar to a number of steps per byte: on good scripts, and on bad ones, where a grammar
//! that tries things twice would show it.

use std::num::NonZeroUsize;

/// Parser calls per byte of script.
const CALLS_PER_BYTE: usize = 60;

fn within_limit(text: &str) {
    pest::set_call_limit(NonZeroUsize::new(2000 + CALLS_PER_BYTE * text.len()));
    if let Err(diagnostics) = overcoat::syntax::parse(text) {
        let limit = diagnostics.iter().find(|d| d.message.contains("limit"));
        assert!(limit.is_none(), "{} bytes: {limit:?}", text.len());
    }
}

#[test]
fn parsing_takes_a_bounded_number_of_steps_per_byte() {
    let nest = |open: &str, close: &str, n| format!("{}1{}", open.repeat(n), close.repeat(n));
    for n in [10, 60, 120] {
        for end in [";", "", " 1;", ")"] {
            within_limit(&format!("float x = {}{end}", nest("(", ")", n)));
            within_limit(&format!("float x = {}{end}", nest("f(1, ", ")", n)));
            within_limit(&format!("float x = {}{end}", nest("color(", ")", n)));
            within_limit(&format!("float x = {}{end}", nest("color(", " 2)", n)));
            within_limit(&format!("float x = {}{end}", nest("c[", "]", n)));
            within_limit(&format!("float x = {}{end}", nest("-(", ")", n)));
            within_limit(&format!("{}{end}", nest("if (1) {", "}", n)));
            within_limit(&format!("{}{end}", nest("if (1) ", ";", n)));
            within_limit(&format!("surface s(float x = {}{end}) {{ }}", nest("(", ")", n)));
        }
    }
    for directory in ["ok", "osl", "err"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(directory);
        for entry in std::fs::read_dir(path).unwrap() {
            within_limit(&std::fs::read_to_string(entry.unwrap().path()).unwrap());
        }
    }
    within_limit(&"x += 1;".repeat(10_000));
    within_limit(&"x".repeat(100_000));
}
