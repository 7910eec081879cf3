//! Scripts in, closure trees or messages out.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use overcoat::Globals;
use overcoat::closure::{ClosureTree, Node, NodeId};
use overcoat::diag::{self, Diagnostic};
use overcoat::ir::{self, Program};
use overcoat::span::Source;
use proptest::prelude::*;
use std::path::{Path, PathBuf};

/// A tree as compact text. Recursive: for small trees.
fn print(tree: &ClosureTree, id: NodeId) -> String {
    let triple = |v: &[f32]| v.iter().map(|x| format!("{x}")).collect::<Vec<_>>().join(" ");
    match tree.node(id) {
        Node::Zero => "zero".to_owned(),
        Node::Add(a, b) => format!("add({}, {})", print(tree, a), print(tree, b)),
        Node::Mul(w, c) => format!("mul({}, {})", triple(&w), print(tree, c)),
        Node::Layer { top, base } => format!("layer({}, {})", print(tree, top), print(tree, base)),
        Node::Lobe { kind, slots, .. } => {
            let values = tree.values(kind, slots);
            let mut at = 0;
            let params = kind.spec().params.iter().map(|p| {
                let slots = &values[at..at + p.ty.slots()];
                at += p.ty.slots();
                format!("{}={}", p.name, triple(slots))
            });
            format!("{}({})", kind.spec().name, params.collect::<Vec<_>>().join(", "))
        }
    }
}

fn program(source: &str) -> Program {
    let (shader, _) = ir::compile("test.osl", source).unwrap_or_else(|e| panic!("{}", rendered(source, &e)));
    shader.specialise(&[]).unwrap_or_else(|e| panic!("{}", rendered(source, &e)))
}

fn shade(program: &Program) -> String {
    let mut tree = ClosureTree::new();
    program.shade(&Globals::default(), &mut tree).unwrap();
    print(&tree, tree.root())
}

fn rendered(source: &str, diagnostics: &[Diagnostic]) -> String {
    diag::render_all(diagnostics, &Source::new("test.osl", source), false)
}

fn corpus(directory: &str) -> Vec<(PathBuf, String)> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(directory);
    let mut files: Vec<_> = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

#[test]
fn good_scripts_give_their_trees() {
    let mut failures = Vec::new();
    for (path, text) in corpus("ok").into_iter().chain(corpus("osl")) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let want = text.lines().find_map(|l| l.strip_prefix("// tree: ")).expect("a `// tree:` line");
        let constant = text.lines().any(|l| l == "// constant");
        match ir::compile(&name, &text).map_err(|e| rendered(&text, &e)) {
            Err(messages) => failures.push(format!("{name}:\n{messages}")),
            Ok((shader, _)) => {
                let program = shader.specialise(&[]).unwrap();
                let found = shade(&program);
                if found != want.trim() {
                    failures.push(format!("{name}:\n  want {want}\n found {found}"));
                }
                if program.is_constant() != constant {
                    failures.push(format!("{name}: constant is {}", program.is_constant()));
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

/// Each line of a bad script names the codes expected on it, in a comment.
#[test]
fn bad_scripts_give_their_messages() {
    let mut failures = Vec::new();
    for (path, text) in corpus("err") {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let mut want = Vec::new();
        for (i, line) in text.lines().enumerate() {
            let comment = line.split_once("//").map_or("", |(_, c)| c);
            let words = comment.split_whitespace().filter(|w| w.len() == 5 && w.starts_with(['E', 'W']));
            want.extend(words.filter(|w| w[1..].bytes().all(|b| b.is_ascii_digit())).map(|w| format!("{}:{w}", i + 1)));
        }
        let source = Source::new(name.as_str(), text.as_str());
        let diagnostics = match ir::compile(&name, &text) {
            Ok((shader, warnings)) => {
                warnings.into_iter().chain(shader.specialise(&[]).err().unwrap_or_default()).collect()
            }
            Err(diagnostics) => diagnostics,
        };
        let line = |d: &Diagnostic| format!("{}:{}", source.line_column(d.span.start as usize).line, d.code);
        let mut found: Vec<_> = diagnostics.iter().map(line).collect();
        found.sort();
        want.sort();
        if want != found {
            failures.push(format!("{name}: want {want:?}, found {found:?}\n{}", rendered(&text, &diagnostics)));
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

/// Compiles (and, where that works, specialises and shades) on a thread with the stack of a test thread.
fn digest(source: String) -> String {
    let run = move || {
        let start = std::time::Instant::now();
        let outcome = match ir::compile("test.osl", &source) {
            Err(diagnostics) => {
                let text = rendered(&source, &diagnostics);
                assert!(text.len() < 40_000, "{} bytes of messages", text.len());
                diagnostics.iter().map(|d| d.code).collect::<Vec<_>>().join(" ")
            }
            Ok((shader, _)) => match shader.specialise(&[]) {
                Err(diagnostics) => diagnostics.iter().map(|d| d.code).collect::<Vec<_>>().join(" "),
                Ok(program) => {
                    let mut tree = ClosureTree::new();
                    match program.shade(&Globals::default(), &mut tree) {
                        Err(error) => error.to_string(),
                        Ok(()) => format!("{} nodes", tree.len()),
                    }
                }
            },
        };
        eprintln!("{outcome} after {:?}", start.elapsed());
        outcome
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(run).unwrap().join().unwrap()
}

#[test]
fn extremes_are_answered_quickly() {
    let many = |n, s: &str| s.repeat(n);
    let nested = |n| format!("Ci = {}diffuse(N){};", many(n, "("), many(n, ")"));
    assert_eq!(digest(nested(200)), "2 nodes");
    assert_eq!(digest(nested(10_000)), "E0105");
    assert_eq!(digest(format!("float x = {}1;", many(10_000, "-"))), "E0105");
    assert_eq!(digest(format!("float x = {}1;", many(10_000, "- "))), "E0105");
    assert_eq!(digest(format!("float x = {}1;", many(10_000, "(float)"))), "E0105");
    assert_eq!(digest(format!("if (u) v; {}", many(10_000, "else if (u) v; "))), "E0105");
    assert_eq!(digest(many(10_000, "if (u) ")), "E0105");
    assert_eq!(digest(format!("float x = {}{};", many(10_000, "u ? 1 : "), "1")), "E0105");
    assert_eq!(digest(format!("{}{}", many(10_000, "{"), many(10_000, "}"))), "E0105");
    assert_eq!(digest(format!("Ci = diffuse(N){};", many(99_999, "+diffuse(N)"))), "200000 nodes");
    assert_eq!(digest(format!("Ci = diffuse(N){};", many(50_000, "*2+diffuse(N)"))), "150002 nodes");
    assert_eq!(digest(many(20_000, "Ci += diffuse(N);")), "40000 nodes");
    assert_eq!(digest(format!("float a, b; b{};", many(10_000, "= a "))), "1 nodes");
    assert_eq!(
        digest(format!("{}Ci = diffuse(N);", many(20_000, "if (u) { float a = u; Ci += diffuse(N); } "))),
        "2 nodes"
    );
    assert_eq!(digest(String::new()), "1 nodes");
    assert_eq!(digest("\0\0Ci\0 = diffuse(N);".to_owned()), "E0106 E0106 E0106");
    assert_eq!(digest("Ci = diffuse(N); /* ".to_owned()), "E0101");
    assert_eq!(digest("string s = \"abc".to_owned()), "E0101");
    assert_eq!(digest(many(1 << 20, "x")), "E0107");
    assert_eq!(digest(many(1 << 20, "(")), "E0105");
    assert_eq!(digest(many(1 << 16, "{}")), "1 nodes");
    assert_eq!(digest(many(1 << 20, "]")), "E0102");
    assert_eq!(digest(many(1 << 17, "x = ")), "E0107");
    assert_eq!(digest(format!("{};", many(1 << 18, "x+"))), "E0107");
    assert_eq!(digest(format!("float f = 1{};", many(1 << 17, "+1.5"))), "1 nodes");
    assert_eq!(digest(format!("Ci = {}diffuse(N){};", many(250, "layer(diffuse(N), "), many(250, ")"))), "502 nodes");
}

#[test]
fn shared_closures_stay_within_the_budget() {
    let doubled = |n| format!("closure color a = diffuse(N); {} Ci = a;", "a = a + a; ".repeat(n));
    assert_eq!(digest(doubled(20)), "22 nodes");
    assert_eq!(digest(doubled(21)), "the closure comes to more than 1048576 lobes");
    assert_eq!(digest(doubled(60)), "the closure comes to more than 1048576 lobes");
    let layered = |n| format!("Ci = diffuse(N); {}", "Ci = layer(diffuse(N), Ci); ".repeat(n));
    assert_eq!(digest(layered(256)), "514 nodes");
    assert_eq!(digest(layered(257)), "layers are nested deeper than 256");
}

/// A script that uses every construct.
const EVERYTHING: &str = r#"/* é */ #
#include <stdosl.h>
shader all [[ string help = "a\"b" ]] (
    output closure color out = 0, // an output
    color tint = color(1, .5, 1e-1) [[ string label = "Tint", float min = 0 ]],
    int mode = 0x1f, string model = "a",
    normal Nn = N, float r = M_PI / 4,
) {
    float a = -r * 2 + mode % 3, b;
    color c = (color) a + tint * tint.g - tint[mode & 1];
    c.r = c[2] *= 2;
    if (a > 1 && !(b == 0) || mode) { float a = 3; b += a; } else if (u < 0.5) b -= 1; else { ; }
    b = a = b > 1 ? sin(u) : mode >> 1;
    vector w = normalize((vector) P + dPdu) * (1 ^ 1);
    Ci = c * diffuse(Nn) + mix(translucent(N), diffuse(-Nn), b);
    Ci = sheen(Ci, N, tint, r, "softening", backfacing());
    Ci += layer(sheen_bsdf(N, c, clamp(r, 0, 1)), oren_nayar(N, 0.3)) + emission();
}
"#;

#[test]
fn the_script_that_uses_everything_is_a_script() {
    program(EVERYTHING);
}

fn messages(source: &str) -> String {
    match ir::compile("velvet.osl", source) {
        Ok((_, warnings)) => diag::render_all(&warnings, &Source::new("velvet.osl", source), false),
        Err(errors) => diag::render_all(&errors, &Source::new("velvet.osl", source), false),
    }
}

#[test]
fn messages_show_the_place_and_what_to_do() {
    insta::assert_snapshot!(messages("surface s(float roughness = 0.3) {\n    Ci = sheen(diffuse(N), N, 1, roughnes);\n}\n"), @r##"
error[E0201]: unknown name `roughnes`
 --> velvet.osl:2:34
  |
2 |     Ci = sheen(diffuse(N), N, 1, roughnes);
  |                                  ^^^^^^^^ not declared here
  |
  = help: did you mean `roughness`?
"##);
    insta::assert_snapshot!(messages("Ci = diffuse(N) * translucent(N);"), @r##"
error[E0301]: closures cannot be multiplied with each other
 --> velvet.osl:1:6
  |
1 | Ci = diffuse(N) * translucent(N);
  |      ----------^^^--------------
  |      |            |
  |      |            closure color
  |      closure color
  |
  = help: scale a closure by a color or float, or put one over the other with `layer(top, base)`
"##);
    insta::assert_snapshot!(messages("color c = 1;\nfloat f = c;\nf = f % 2.0;"), @r##"
error[E0203]: expected float, found color
 --> velvet.osl:2:11
  |
2 | float f = c;
  |           ^ this is color
  |
  = help: take one component, `c[0]`, or `luminance(c)`

error[E0204]: `%` does not apply to float and float
 --> velvet.osl:3:5
  |
3 | f = f % 2.0;
  |     -^^^---
  |     |   |
  |     |   float
  |     float
  |
  = help: `%` is for ints; for floats call `mod(a, b)` or `fmod(a, b)`

warning[W0501]: `Ci` is never assigned: the material is black
 --> velvet.osl:1:1
  |
1 | color c = 1;
  | ^
  |
  = help: assign a closure, for example `Ci = diffuse(N);`
"##);
    insta::assert_snapshot!(messages("Ci = layer(diffuse(N), 0.5);"), @r##"
error[E0205]: `base` of `layer` is closure color, not float
 --> velvet.osl:1:24
  |
1 | Ci = layer(diffuse(N), 0.5);
  |                        ^^^ expected closure color, found float
  |
  = help: declared as `layer(closure color top, closure color base)`
"##);
    insta::assert_snapshot!(messages(&format!("Ci = {}glass(N){};", "diffuse(N) + ".repeat(99), " + diffuse(N)".repeat(99))), @r##"
error[E0206]: unknown function `glass`
 --> velvet.osl:1:1293
  |
 ::: 
1 | ...+ diffuse(N) + diffuse(N) + diffuse(N) + diffuse(N) + diffuse(N) + diffuse(N) + glass(N) + diffuse(N) + diffuse(N) + diffuse(N) + ...
  |                                                                                    ^^^^^
"##);
}

#[test]
fn messages_say_what_cannot_be_read_or_does_nothing() {
    insta::assert_snapshot!(messages("float x = 1\nCi = x * diffuse(N);\nfor (x = 0; x < 2) { }"), @r##"
error[E0107]: a `;` is missing after this
 --> velvet.osl:1:11
  |
1 | float x = 1
  |           ^ expected `;` here

error[E0107]: `)` was not expected here
 --> velvet.osl:3:18
  |
3 | for (x = 0; x < 2) { }
  |                  ^ expected `;`, `,` or an operator
"##);
    insta::assert_snapshot!(messages("Ci = (diffuse(N) + [1);"), @r##"
error[E0102]: expected `]` before this `)`
 --> velvet.osl:1:22
  |
1 | Ci = (diffuse(N) + [1);
  |                    - ^
  |                    |
  |                    this `[` is still open
"##);
    insta::assert_snapshot!(messages("#include \"my.h\"\nfloat x = 1;"), @r##"
error[E0103]: unknown header `my.h`
 --> velvet.osl:1:1
  |
1 | #include "my.h"
  | ^^^^^^^^^^^^^^^
  |
  = help: these are built in: stdosl.h, oslutil.h, stdcycles.h, mx_funcs.h, overcoat.h, vector2.h, vector4.h, color2.h, color4.h, matrix33.h
  = help: others are looked for in the include directories: `-I DIR`
"##);
    insta::assert_snapshot!(messages("surface s() { diffuse(N); }"), @r##"
warning[W0502]: this statement has no effect
 --> velvet.osl:1:15
  |
1 | surface s() { diffuse(N); }
  |               ^^^^^^^^^^
  |
  = help: to make it part of the material write `Ci = …` or `Ci += …`

warning[W0501]: `Ci` is never assigned: the material is black
 --> velvet.osl:1:9
  |
1 | surface s() { diffuse(N); }
  |         ^
  |
  = help: assign a closure, for example `Ci = diffuse(N);`
"##);
}

#[test]
fn messages_have_a_plain_form() {
    let source = Source::new("a.osl", "float x = 1;\nCi = y * diffuse(N);");
    let errors = ir::compile(&source.name, &source.text).unwrap_err();
    assert_eq!(errors[0].line(&source), "a.osl:2:6: error[E0201]: unknown name `y`");
}

const PARAMETERS: &str = r#"surface cloth [[ string help = "woven" ]] (
    color tint = color(1, 0.5, 0) [[ string label = "Tint", color max = color(1, 1, 1) ]],
    float r = 0.3 [[ float min = 0.07, float max = 1 ]],
    float r2 = r * r, int n = 2, normal Nn = N, string word = "a"
) { Ci = tint * oren_nayar(Nn, r2) + (n == 3 && word == "b") * translucent(N); }"#;

#[test]
fn parameters_are_declared_and_set() {
    use ir::Value;
    let (shader, warnings) = ir::compile("x.osl", PARAMETERS).unwrap();
    assert!(warnings.is_empty());
    assert_eq!((shader.name(), shader.metadata().len()), ("cloth", 1));
    let defaults: Vec<_> = shader.params().iter().map(|p| p.default.clone()).collect();
    assert_eq!(defaults[0], Some(Value::Color([1.0, 0.5, 0.0])));
    assert_eq!(defaults[2], Some(Value::Float(0.3f32 * 0.3)));
    assert_eq!(defaults[4], None, "depends on the point");
    assert_eq!(shader.params()[1].meta("max"), Some(&Value::Float(1.0)));
    let set = |set: &[(&str, Value)]| {
        let set: Vec<_> = set.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
        shader.specialise(&set)
    };
    let tree = |values: &[(&str, Value)]| shade(&set(values).unwrap());
    assert_eq!(tree(&[]), "mul(1 0.5 0, oren_nayar(N=0 0 1, sigma=0.09))");
    assert_eq!(tree(&[("r", Value::Int(2)), ("tint", Value::Int(1))]), "oren_nayar(N=0 0 1, sigma=4)");
    let both = [("n", Value::Float(3.0)), ("word", Value::String("b".into())), ("tint", Value::Float(0.0))];
    assert_eq!(tree(&both), "translucent(N=0 0 1)");
    assert_eq!(set(&[("r", Value::Float(2.0))]).unwrap().warnings[0].code, "W0503");
    assert_eq!(set(&[("r", Value::Float(f32::NAN))]).unwrap().warnings[0].code, "W0503");
    let unknown = set(&[("tnt", Value::Int(1)), ("n", Value::Float(0.5))]).unwrap_err();
    assert_eq!(unknown.iter().map(|d| d.code).collect::<Vec<_>>(), ["E0401", "E0402"]);
    assert_eq!(unknown[0].help, ["did you mean `tint`?"]);
}

#[test]
fn a_top_that_transmits_is_pointed_out() {
    let codes = |source: &str| -> Vec<_> { program(source).warnings.iter().map(|w| w.code).collect() };
    assert_eq!(codes("Ci = layer(velvet(N, 0.3), 0.5 * translucent(N) + transparent());"), [""; 0]);
    let nested = "closure color t = layer(velvet(N, 0.3), 0.5 * transparent()); Ci = layer(0.5 * t, diffuse(N));";
    assert_eq!(codes(nested), ["W0504"]);
    assert_eq!(codes("Ci = layer(0.1 * translucent(N) + transparent(), diffuse(N));"), ["W0504"; 2]);
}

#[test]
fn only_what_is_needed_is_kept() {
    let needs = |source: &str| {
        let program = program(source);
        let globals: Vec<_> = program.globals().iter().map(|g| g.name()).collect();
        (program.is_constant(), globals.join(" "), program.sites().len())
    };
    assert_eq!(needs("float x = u; Ci = diffuse(N);"), (true, "N".to_owned(), 1));
    assert_eq!(needs("normal n = N; vector t = dPdu; Ci = diffuse(n);"), (true, "N".to_owned(), 1));
    assert_eq!(needs("Ci = diffuse(-N);"), (false, "N".to_owned(), 1));
    assert_eq!(needs("Ci = u * diffuse(N);"), (false, "N u".to_owned(), 1));
    assert_eq!(needs("Ci = diffuse(N); Ci = translucent(Ng);"), (true, "Ng".to_owned(), 1));
    assert_eq!(needs("Ci = 0 * translucent(N) + diffuse(N) * color(0, -1, 0);"), (true, String::new(), 0));
    assert_eq!(needs("if (0) Ci = diffuse(N); else if (u > 2) ; "), (true, String::new(), 0));
    let program = program("Ci = oren_nayar(N, 0.5) + oren_nayar(N, u);");
    assert_eq!(program.sites()[0].values, [None, None, None, Some(0.5)]);
    assert_eq!(program.sites()[1].values, [None; 4]);
}

fn survives(text: &str) {
    match ir::compile("test.osl", text) {
        Err(diagnostics) => {
            assert!(diagnostics.iter().any(Diagnostic::is_error));
            rendered(text, &diagnostics);
            let source = Source::new("test.osl", text);
            diagnostics.iter().for_each(|d| drop(d.line(&source)));
        }
        Ok((shader, warnings)) => {
            rendered(text, &warnings);
            if let Ok(program) = shader.specialise(&[]) {
                let mut tree = ClosureTree::new();
                let _ = program.shade(&Globals::default(), &mut tree);
            }
        }
    }
}

#[test]
fn every_prefix_and_every_deletion_is_survived() {
    for (at, c) in EVERYTHING.char_indices() {
        survives(&EVERYTHING[..at]);
        survives(&format!("{}{}", &EVERYTHING[..at], &EVERYTHING[at + c.len_utf8()..]));
    }
    let tokens: Vec<&str> = EVERYTHING.split_inclusive([' ', '(', ')', ';']).collect();
    for at in 0..tokens.len() {
        survives(&[&tokens[..at], &tokens[at..=at], &tokens[at..]].concat().concat());
    }
}

const SOUP: &[&str] = &[
    "surface",
    "s",
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    "[[",
    "]]",
    "float",
    "color",
    "closure color",
    "int",
    "string",
    "normal",
    "x",
    "y",
    "Ci",
    "N",
    "u",
    "=",
    "+=",
    "+",
    "-",
    "*",
    "/",
    "%",
    "!",
    "~",
    "&&",
    "<",
    "==",
    "?",
    ":",
    ",",
    ";",
    ".",
    "r",
    "1",
    "0.5",
    "0",
    "\"a\"",
    "diffuse",
    "sheen",
    "layer",
    "mix",
    "sin",
    "dot",
    "if",
    "else",
    "(float)",
    "#include",
    "//",
    "/*",
    "*/",
    "\n",
    "\"",
    "é",
    "\"softening\"",
    "output",
    "for",
    "-1",
    ">>",
    "diffuse(N)",
    "Ci =",
    "float x = 1;",
];

/// A float expression; `X` stands for a number known early or late.
fn float_text() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("X".to_owned()),
        Just("v".to_owned()),
        Just("f".to_owned()),
        Just("(int)(X*9)".to_owned()),
        (-4i32..5).prop_map(|i| i.to_string()),
        (-4i32..5).prop_map(|i| format!("{}", i as f32 * 0.75)),
    ];
    leaf.prop_recursive(5, 40, 3, |inner| {
        let op = prop::sample::select(vec!["+", "-", "*", "/", "<", "==", "&&", "||"]);
        let one = prop::sample::select(vec!["-", "!", "sin", "sqrt", "abs", "floor", "exp", "log"]);
        let two = prop::sample::select(vec!["pow", "min", "max", "mod", "fmod", "step", "atan2"]);
        prop_oneof![
            (inner.clone(), op, inner.clone()).prop_map(|(a, op, b)| format!("({a} {op} {b})")),
            (one, inner.clone()).prop_map(|(f, a)| format!("{f}({a})")),
            (two, inner.clone(), inner.clone()).prop_map(|(f, a, b)| format!("{f}({a}, {b})")),
            (inner.clone(), inner.clone(), inner.clone()).prop_map(|(a, b, c)| format!("({a} ? {b} : {c})")),
            (inner.clone(), inner.clone(), 0..3).prop_map(|(a, b, i)| format!("color({a}, {b}, c[1])[{i}]")),
            (inner.clone(), inner).prop_map(|(a, b)| format!("dot(vector({a}, {b}, 1), normalize(vector(1, {b}, X)))")),
        ]
    })
}

fn statement_text() -> impl Strategy<Value = String> {
    let name = || prop::sample::select(vec!["f", "g", "c[1]", "c.r", "c"]);
    let simple = prop_oneof![
        (name(), prop::sample::select(vec!["=", "+=", "*="]), float_text())
            .prop_map(|(n, op, e)| format!("{n} {op} {e};")),
        float_text().prop_map(|e| format!("Ci += ({e}) * diffuse(N);")),
        float_text().prop_map(|e| format!("Ci = ({e}) > 0 ? sheen(Ci, N, c, {e}) : mix(Ci, translucent(N), g);")),
        Just("f = g = X;".to_owned()),
    ];
    simple.prop_recursive(3, 12, 3, |inner| {
        (float_text(), prop::collection::vec(inner.clone(), 0..3), prop::collection::vec(inner, 0..3))
            .prop_map(|(e, a, b)| format!("if ({e}) {{ float g = f; {} }} else {{ {} }}", a.concat(), b.concat()))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn token_soup_is_survived(words in prop::collection::vec(prop::sample::select(SOUP), 0..40)) {
        survives(&words.join(" "));
        survives(&words.concat());
    }

    /// What is known early and what is known late give the same tree.
    #[test]
    fn folding_changes_nothing(body in prop::collection::vec(statement_text(), 1..5)) {
        let script = |known: &str| {
            format!("float f = X, g = 0.5; color c = color(v, X, 1); {} Ci += c * diffuse(N) + f * translucent(N) \
                     + g * emission();", body.concat()).replace('X', known)
        };
        let globals = Globals { u: 0.375, v: 0.625, ..Globals::default() };
        let mut trees = Vec::new();
        for known in ["u", "0.375"] {
            let program = program(&script(known));
            let mut tree = ClosureTree::new();
            program.shade(&globals, &mut tree).unwrap();
            trees.push(print(&tree, tree.root()));
        }
        prop_assert_eq!(&trees[0], &trees[1]);
        // The same once more with nothing known but through parameters that are set.
        let shader = format!("surface s(float x = 7, float w = 9) {{ {} }}", script("x").replace("(v,", "(w,"));
        let (shader, _) = ir::compile("s", &shader).unwrap();
        let set = [("x".to_owned(), ir::Value::Float(0.375)), ("w".to_owned(), ir::Value::Float(0.625))];
        let program = shader.specialise(&set).unwrap();
        let mut tree = ClosureTree::new();
        program.shade(&globals, &mut tree).unwrap();
        prop_assert_eq!(&trees[0], &print(&tree, tree.root()));
    }
}
