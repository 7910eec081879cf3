//! Values of expressions, one script a line: `statements | expression | numbers`, with lines of `! …` before the shader.
//!
//! `zero` stands for a number that is 0: once known early, once read at the point, so that folding and running are held
//! to the same values.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use overcoat::closure::{ClosureTree, Node};
use overcoat::{Engine, Globals};
use std::path::Path;

/// The first lobe's first three numbers.
fn value(script: &str) -> Result<[f32; 3], String> {
    let shader = Engine::new().compile("value.osl", script).map_err(|e| e.to_string())?;
    let material = shader.material(&[]).map_err(|e| e.to_string())?;
    let tree: ClosureTree = material.tree(&Globals::default()).map_err(|e| e.to_string())?;
    match tree.node(tree.root()) {
        Node::Lobe { kind, slots, .. } => {
            let values = tree.values(kind, slots);
            Ok([values[0], values[1], values[2]])
        }
        _ => Err("no lobe".to_owned()),
    }
}

fn check(name: &str, text: &str, failures: &mut Vec<String>) -> usize {
    let mut preamble = String::new();
    let mut count = 0;
    for line in text.lines().filter(|l| !l.trim().is_empty()) {
        if let Some(rest) = line.strip_prefix("! ") {
            preamble.push_str(rest);
            preamble.push('\n');
            continue;
        }
        let Some((rest, want)) = line.rsplit_once(" | ") else { panic!("{name}: {line}") };
        // Nothing before the first bar: no statements.
        let (code, expression) = rest.split_once(" | ").unwrap_or(("", rest.trim_start_matches("| ")));
        let want: Vec<f32> = want.split_whitespace().map(|x| x.parse().expect("a number")).collect();
        let result = match want.len() {
            1 => format!("float result = {expression}; Ci = diffuse(vector(result, 0, 0));"),
            _ => format!("Ci = diffuse((vector)({expression}));"),
        };
        for zero in ["0.0", "time"] {
            let body = format!("{code} {result}").replace("zero", zero);
            let script = format!("{preamble}surface s() {{ {body} }}");
            match value(&script) {
                Err(message) => failures.push(format!("{name}: {body}\n{message}")),
                Ok(found) => {
                    let close = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-6 * b.abs().max(1e-2) || a == b;
                    if !found.iter().zip(&want).all(close) {
                        failures.push(format!("{name}: {body}\n  want {want:?}, found {found:?}"));
                    }
                }
            }
        }
        count += 1;
    }
    count
}

#[test]
fn expressions_have_their_values() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/values");
    let mut failures = Vec::new();
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let text = std::fs::read_to_string(entry.path()).expect("text");
        count += check(&entry.file_name().to_string_lossy(), &text, &mut failures);
    }
    assert!(count >= 300, "{count} scripts");
    assert!(failures.is_empty(), "{} of {count}\n{}", failures.len(), failures.join("\n"));
}
