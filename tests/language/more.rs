//! Corners of the language that need more than a value: parameters in parts, loops that the proof follows, loops that
//! run at the point, random programs of loops and functions, and a replay of the corpus cut and joined.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::programs::{LIBRARY, statement};
use overcoat::closure::ClosureTree;
use overcoat::ir::{self, ShadeError, Value};
use overcoat::{Engine, Globals};
use proptest::prelude::*;

fn weight(script: &str, set: &[(&str, Value)], u: f32) -> f32 {
    let shader = Engine::new().compile("a.osl", script).unwrap_or_else(|e| panic!("{e}"));
    let set: Vec<_> = set.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    let material = shader.material(&set).unwrap_or_else(|e| panic!("{e}"));
    let mut tree = ClosureTree::new();
    material.program().shade(&Globals { u, ..Globals::default() }, &mut tree).expect("within budget");
    match tree.node(tree.root()) {
        overcoat::closure::Node::Mul(w, _) => w[0],
        overcoat::closure::Node::Lobe { .. } => 1.0,
        other => panic!("{other:?}"),
    }
}

#[test]
fn parts_of_parameters_are_set_by_name() {
    let script = "struct pair { float x; float y; };
        surface s(pair p = {0.1, 0.2}, float a[2] = {0.3, 0.4}, matrix m = 0.5, pair q[2] = {{1, 2}, {3, 4}}) {
            Ci = (p.x + 10 * p.y + a[0] + 10 * a[1] + m[1][1] + q[1].y) * diffuse(N);
        }";
    assert_eq!(weight(script, &[], 0.0), 0.1 + 2.0 + 0.3 + 4.0 + 0.5 + 4.0);
    let set = [("p.y", Value::Float(0.0)), ("a[1]", Value::Float(0.0)), ("m[1][1]", Value::Float(0.0))];
    assert_eq!(weight(script, &[&set[..], &[("q[1].y", Value::Float(1.0))]].concat(), 0.0), 0.1 + 0.3 + 1.0);
    let shader = Engine::new().compile("a.osl", script).expect("compiles");
    assert!(shader.material(&[("p".to_owned(), Value::Float(1.0))]).is_err());
    let names: Vec<_> = shader.params().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(&names[..4], ["p.x", "p.y", "a[0]", "a[1]"]);
}

#[test]
fn an_unknown_noise_is_refused() {
    let e = Engine::new().compile("a", "float x = noise(\"gabor\", u); Ci = x * diffuse(N);").expect_err("refused");
    assert_eq!(e.diagnostics[0].code, "E0303");
}

#[test]
fn exit_is_refused() {
    let e = Engine::new().compile("a", "Ci = diffuse(N); exit();").expect_err("refused");
    assert_eq!(e.diagnostics[0].code, "E0109");
}

#[test]
fn early_returns_leave_the_shader() {
    let script = "surface s(float k = 1) { Ci = 0.5 * diffuse(N); if (u > 0.5) return; Ci = 0.25 * diffuse(N);
        for (int i = 0; i < 9; i++) { if (u > 0.1 * i) continue; if (i > 2) return; Ci = 0.125 * diffuse(N); } }";
    assert_eq!((weight(script, &[], 0.7), weight(script, &[], 0.3), weight(script, &[], 0.1)), (0.5, 0.25, 0.125));
}

/// Compiles, and where that works shades, on a stack as small as a test thread's; within a time that no blow-up takes.
fn digest(script: String) -> String {
    let run = move || {
        let start = std::time::Instant::now();
        let outcome = match ir::compile("test.osl", &script) {
            Err(errors) => errors[0].code.to_owned(),
            Ok((shader, _)) => match shader.specialise(&[]) {
                Err(errors) => errors[0].code.to_owned(),
                Ok(program) => match program.shade(&Globals::default(), &mut ClosureTree::new()) {
                    Ok(()) => "fine".to_owned(),
                    Err(e) => e.to_string(),
                },
            },
        };
        assert!(start.elapsed().as_secs() < 120, "{outcome} after {:?}", start.elapsed());
        outcome
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(run).expect("a thread").join().expect("no panic")
}

#[test]
fn extremes_of_the_language_come_to_an_end() {
    let many = |n: usize, s: &str| s.repeat(n);
    let chain = |n: usize, body: &dyn Fn(usize) -> String| -> String {
        let mut text = "float f0(float x) { return x; }\n".to_owned();
        (0..n).for_each(|i| text += &format!("float f{}(float x) {{ {} }}\n", i + 1, body(i)));
        text + &format!("Ci = f{n}(u) * diffuse(N);")
    };
    // Calls within blocks within calls.
    let deep = |i: usize| format!("{} return f{i}(x); {} return 0;", many(20, "if (x >= 0) { "), many(20, "}"));
    assert_eq!(digest(chain(10, &deep)), "fine");
    assert_eq!(digest(chain(40, &deep)), "E0212");
    let returns = |i: usize| format!("{} return f{i}(x);", many(100, "if (x > 2) return x; "));
    assert_eq!(digest(chain(20, &returns)), "fine");
    assert_eq!(
        digest(format!(
            "float f(float x) {{ {} return x; }} Ci = f(u) * diffuse(N);",
            many(5000, "if (x > 2) return 3; ")
        )),
        "fine"
    );
    // Loops within loops, none of a known length, and chains of assignments within one.
    let nested =
        |head: &str, n: usize| format!("float x; {}x += 1;{} Ci = x * diffuse(N);", many(n, head), many(n, "}"));
    assert_eq!(digest(nested("while (x < u) { ", 100)), "fine");
    assert_eq!(digest(nested("for (int i = 0; i < 1; i++) { ", 100)), "fine");
    assert_eq!(digest(nested("do { ", 100).replace("}", "} while (x < u);")), "fine");
    let assigned: String = (0..3000).map(|i| format!("a[{}] = a[{i}] + u; ", i + 1)).collect();
    let backward: String = (0..3000).rev().map(|i| format!("a[{}] = a[{i}] + u; ", i + 1)).collect();
    for body in [assigned, backward] {
        let script =
            format!("float a[3001]; for (float x = 0; x < u + 1; x += 1) {{ {body} }} Ci = a[3000] * diffuse(N);");
        assert_eq!(digest(script), "fine");
    }
    // Many uses of macros, nested uses, large arrays, wide calls.
    assert_eq!(
        digest(format!("#define A(x) (x)\nfloat y = {}1;\nCi = y * diffuse(N);", many(50_000, "A(1) +\n"))),
        "fine"
    );
    assert_eq!(digest(format!("#define A(x) (x)\nfloat y = {}1{};", many(10_000, "A("), many(10_000, ")"))), "E0111");
    assert_eq!(
        digest("float a[60000]; int i = (int) u; a[i] = 1; Ci = (1 + a[i + 1]) * diffuse(N);".to_owned()),
        "fine"
    );
    assert_eq!(
        digest(
            format!("float x = {}u{}; Ci = x * diffuse(N);", many(60, "f(f("), many(60, "))"))
                .replace("float x", "float f(float x) { return x; } float x")
        ),
        "fine"
    );
    assert_eq!(digest(format!("#if {}1{}\n#endif\nCi = diffuse(N);", many(50_000, "("), many(50_000, ")"))), "E0104");
    assert_eq!(digest(many(100_000, "#if 1\n")), "E0104");
    assert_eq!(digest(format!("{}Ci = diffuse(N);", many(20_000, "{ int i = 0; i++; }"))), "fine");
    let ternaries =
        format!("float f(float x) {{ return x; }} float y = {}3; Ci = y * diffuse(N);", many(120, "u > 1 ? f(2) : "));
    assert_eq!(digest(ternaries), "fine");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(80) })]

    /// What is known early and what is known late give the same value, whatever the loops do.
    #[test]
    fn folding_loops_and_functions_changes_nothing(body in prop::collection::vec(statement(), 1..5)) {
        let body = format!("for (int once = 0; once < 1; once++) {{ {} }}", body.concat());
        let script = |known: &str| {
            format!("{LIBRARY} surface s(float k = 0.375) {{ float a = X, b = 0.5; int n = 1; float t[3] = {{X, 2, 3}};
                pair p = {{1, X}}; {body} float all = a + 3 * b + 5 * n + 7 * t[0] + 11 * t[1] + 13 * t[2] + 17 * p.x + 19 * p.y;
                Ci = (1 + abs(mod(all, 1000))) * diffuse(N); }}").replace('X', known)
        };
        // `None` beyond the budget for rounds: a loop that matters to nothing is dropped where that is seen, endless or
        // not, and what is known decides where it is.
        let within = |shaded: Result<(), ShadeError>| match shaded {
            Ok(()) => true,
            Err(ShadeError::Iterations(_)) => false,
            Err(other) => panic!("{other}"),
        };
        let run = |known: &str| {
            let (shader, _) = ir::compile("s", &script(known)).unwrap_or_else(|e| panic!("{e:?}"));
            let (mut tree, mut open) = (ClosureTree::new(), ClosureTree::new());
            let globals = Globals { u: 0.375, ..Globals::default() };
            let shaded = within(shader.specialise(&[]).expect("specialises").shade(&globals, &mut tree));
            let opened = within(shader.unspecialised().shade(&globals, &mut open));
            let weight = |tree: &ClosureTree| match tree.node(tree.root()) {
                overcoat::closure::Node::Mul(w, _) => w,
                _ => [0.0; 3],
            };
            [shaded.then(|| weight(&tree)), opened.then(|| weight(&open))]
        };
        let all: Vec<[f32; 3]> = ["0.375", "u", "k"].into_iter().flat_map(run).flatten().collect();
        prop_assert!(all.iter().all(|w| *w == all[0]), "{all:?}");
    }
}

/// The corpus cut anywhere, and pieces of it joined: what fuzzing does, in small.
#[test]
fn the_corpus_is_survived_in_pieces() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut texts = Vec::new();
    for folder in ["osl", "err", "ok"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("a folder").flatten() {
            texts.push(std::fs::read_to_string(entry.path()).expect("text"));
        }
    }
    texts.sort();
    let survive = |text: &str| {
        if let Ok((shader, _)) = ir::compile("test.osl", text)
            && let Ok(program) = shader.specialise(&[])
        {
            let _ = program.shade(&Globals::default(), &mut ClosureTree::new());
        }
    };
    let mut rounds = 0u64;
    for (i, text) in texts.iter().enumerate() {
        let pieces: Vec<&str> = text.split_inclusive([';', '{', '}', '\n']).collect();
        for k in (0..pieces.len()).step_by(pieces.len() / 12 + 1) {
            let other: Vec<&str> = texts[(i * 7 + k) % texts.len()].split_inclusive([';', '\n']).collect();
            survive(&pieces[..k].concat());
            survive(&[&pieces[..k], &pieces[k + 1..]].concat().concat());
            survive(&[&pieces[..k], &other[other.len() / 2..], &pieces[k..]].concat().concat());
            rounds += 3;
        }
    }
    assert!(rounds > 500, "{rounds}");
}
