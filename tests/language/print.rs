//! Printed and parsed again, a script is the same script: operators climb as they should, and nothing written is lost.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::printer::print;
use crate::programs::{LIBRARY, statement};
use overcoat::syntax::{self, ast::Ast};
use proptest::prelude::*;
use std::path::Path;

fn parse(text: &str) -> Ast {
    syntax::parse(text).unwrap_or_else(|e| panic!("{e:?}\n{text}"))
}

/// Every operation in parentheses: if they say what the parser understood, they change nothing.
fn same_again(text: &str) {
    let once = print(&parse(text));
    let twice = print(&parse(&once));
    assert!(once == twice, "{text}\n{once}\n{twice}");
}

#[test]
fn printing_shows_how_operators_climb() {
    let printed = |text: &str| print(&parse(text));
    let expected = "float a=((1+(2*3))-(-4));(a=(a+=(b?c:(d?e:f))));(x=((a<<1)<(b&(c==d))));\n";
    assert_eq!(printed("float a = 1 + 2*3 - - 4; a = a += b ? c : d ? e : f; x = a<<1 < (b & c==d);"), expected);
    assert_eq!(printed("if (!a.b[1]) { x++; } else --x;"), "if((!a.b[1])){(x++);}else {(--x);}\n");
}

#[test]
fn the_corpus_is_the_same_again() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for folder in ["tests/corpus/osl", "tests/corpus/energy", "examples"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("a folder").flatten() {
            let text = std::fs::read_to_string(entry.path()).unwrap_or_default();
            if entry.path().extension().is_some_and(|e| e == "osl") && syntax::parse(&text).is_ok() {
                same_again(&text);
                count += 1;
            }
        }
    }
    assert!(count > 50, "{count}");
}

/// An expression with as few parentheses as its writer liked.
fn expression() -> impl Strategy<Value = String> {
    let leaf = prop::sample::select(vec!["a", "b", "1", "2.5", "1e-3", "\"t\\n\\\"\"", "f()", "t[a]", "p.x", "Ci"]);
    leaf.prop_map(str::to_owned).prop_recursive(5, 48, 3, |inner| {
        let ops = "|| && | ^ & == != < <= > >= << >> + - * / %".split(' ').collect::<Vec<_>>();
        prop_oneof![
            6 => (inner.clone(), prop::sample::select(ops), inner.clone()).prop_map(|(a, op, b)| format!("{a} {op} {b}")),
            2 => (prop::sample::select(vec!["-", "!", "~", "+"]), inner.clone()).prop_map(|(op, a)| format!("{op} {a}")),
            2 => (inner.clone(), inner.clone(), inner.clone()).prop_map(|(a, b, c)| format!("{a} ? {b} : {c}")),
            1 => (prop::sample::select(vec!["=", "+=", "*="]), inner.clone()).prop_map(|(op, a)| format!("(x {op} {a})")),
            1 => inner.clone().prop_map(|a| format!("(int) {a}")),
            1 => (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("color({a}, {b}, 1)")),
            1 => (inner.clone(), inner).prop_map(|(a, b)| format!("g(({a}), {b})[1]")),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn expressions_are_the_same_again(text in expression()) {
        same_again(&format!("x = {text};"));
    }

    #[test]
    fn programs_are_the_same_again(body in prop::collection::vec(statement(), 1..5)) {
        let body = body.concat().replace('X', "0.375");
        same_again(&format!("{LIBRARY} surface s(float k = 0.5 [[ float min = 0, string label = \"K\" ]], output color c = 1)
            {{ float a = k, b = 0.5; int n = 1; float t[3] = {{1, 2, 3}}; pair p = {{1, k}}; {body} Ci = a * diffuse(N); }}"));
    }
}
