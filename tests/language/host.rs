//! What the language asks for beyond the script: included files, budgets, answers of the host, codes of messages.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use overcoat::closure::{ClosureTree, Node};
use overcoat::diag::CODES;
use overcoat::ir::{Host, Lookup, Speech, Subject, Ty, Value};
use overcoat::syntax::{Includes, Limits};
use overcoat::{Engine, Globals};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Files by name.
struct Files(&'static [(&'static str, &'static str)]);

impl Includes for Files {
    fn load(&self, name: &str, _: &str) -> Option<(String, String)> {
        let found = self.0.iter().find(|(n, _)| *n == name)?;
        Some((format!("include/{name}"), found.1.to_owned()))
    }
}

fn message(engine: &Engine, script: &str) -> String {
    engine.compile("main.osl", script).expect_err("an error").to_string()
}

#[test]
fn places_point_into_included_files_and_at_uses_of_macros() {
    let files = Files(&[
        ("wrong.h", "float half(float x)\n{\n    return x * hlaf;\n}\n"),
        ("loop.h", "#include \"loop.h\"\n"),
        ("once.h", "#pragma once\n#define TWICE 2\nfloat two() { return TWICE; }\n"),
        ("syntax.h", "float x = ;\n"),
    ]);
    let engine = Engine::new().includes(files).define("SCALE", "0.5");
    insta::assert_snapshot!(message(&engine, "// A comment.\n#include \"wrong.h\"\nCi = half(1) * diffuse(N);"), @r"
error[E0201]: unknown name `hlaf`
 --> include/wrong.h:3:16
  |
3 |     return x * hlaf;
  |                ^^^^ not declared here
");
    insta::assert_snapshot!(message(&engine, "#define SCALED(x) (SCALE * x * missing)\n\nCi = SCALED(2) * diffuse(N);"), @r"
error[E0201]: unknown name `missing`
 --> main.osl:3:6
  |
3 | Ci = SCALED(2) * diffuse(N);
  |      ^^^^^^^^^ not declared here
");
    assert!(message(&engine, "#include \"loop.h\"\n").contains("E0112"));
    assert!(message(&engine, "#include \"syntax.h\"\n").contains("include/syntax.h:1:11"));
    let script = "#include \"once.h\"\n#include \"once.h\"\nCi = SCALE * two() * diffuse(N);";
    let tree = engine.compile("main.osl", script).expect("compiles").material(&[]).expect("specialises");
    assert_eq!(tree.tree(&Globals::default()).expect("shades").len(), 2, "half of two is one: no weight");
}

#[test]
fn budgets_are_errors_that_name_them() {
    let limits = |change: fn(&mut Limits)| {
        let mut limits = Limits::default();
        change(&mut limits);
        Engine::new().limits(limits)
    };
    let calls = "float a(float x) { return x; } float b(float x) { return a(x) + a(x); }
        float c(float x) { return b(x) + b(x); } Ci = (c(1) + c(2)) * diffuse(N);";
    assert!(message(&limits(|l| l.calls = 10), calls).contains("`Limits::calls`"));
    assert!(Engine::new().compile("a", calls).is_ok());
    assert!(message(&limits(|l| l.expressions = 10), calls).contains("`Limits::expressions`"));
    assert!(message(&limits(|l| l.script_bytes = 10), calls).contains("`Limits::script_bytes`"));
    let doubling: String = (0..40).map(|i| format!("#define M{} M{i} + M{i}\n", i + 1)).collect();
    assert!(
        message(&Engine::new(), &format!("#define M0 1\n{doubling}float x = M40;"))
            .contains("`Limits::expanded_bytes`")
    );
    let doubled: String =
        (0..40).map(|i| format!("float f{}(float x) {{ return f{i}(x) + f{i}(x); }}\n", i + 1)).collect();
    let script = format!("float f0(float x) {{ return x; }}\n{doubled}Ci = f40(u) * diffuse(N);");
    assert!(message(&Engine::new(), &script).contains("E0212"));
    let chain: String = (0..400).map(|i| format!("float f{}(float x) {{ return f{i}(x); }}\n", i + 1)).collect();
    let script = format!("float f0(float x) {{ return x; }}\n{chain}Ci = f400(u) * diffuse(N);");
    assert!(message(&Engine::new(), &script).contains("E0212"));
    for endless in ["while (1) i++;", "for (;;) i += 2;", "do i--; while (u == 0);", "while (i < 2) { while (1) i++; }"]
    {
        let script = format!("int i = 0; {endless} Ci = i * diffuse(N);");
        let engine = limits(|l| l.iterations = 1000);
        let material = engine.compile("a", &script).expect("compiles").material(&[]).expect("specialises");
        let e = material.tree(&Globals::default()).expect_err("never ends").to_string();
        assert!(e.contains("1000") && e.contains("`Limits::iterations`"), "{e}");
    }
}

/// Answers everything, and hears what is said.
#[derive(Clone, Default)]
struct Answering(Arc<Mutex<Vec<String>>>);

impl Host for Answering {
    fn matrix(&self, space: &str, globals: &Globals) -> Option<[f32; 16]> {
        let t = globals.time;
        (space == "object").then_some([2., 0., 0., 0., 0., 2., 0., 0., 0., 0., 2., 0., t, 0., 0., 1.])
    }
    fn attribute(&self, object: &str, name: &str, ty: Ty, _: &Globals) -> Option<Value> {
        match (object, name, ty) {
            ("", "wear", Ty::Float) => Some(Value::Float(0.25)),
            ("door", "kind", Ty::String) => Some(Value::String("oak".to_owned())),
            _ => None,
        }
    }
    fn attribute_element(&self, _: &str, name: &str, index: usize, ty: Ty, _: &Globals) -> Option<Value> {
        match (name, ty) {
            ("weights", Ty::Float) if index < 16 => Some(Value::Float(index as f32)),
            ("names", Ty::String) if index < 2 => Some(Value::String(["a", "b"][index].to_owned())),
            _ => None,
        }
    }
    fn texture_info(&self, name: &str, what: &str, index: usize, ty: Ty) -> Option<Value> {
        match (name, what, ty) {
            ("a.png", "resolution", Ty::Int) if index < 2 => Some(Value::Int([640, 480][index])),
            _ => None,
        }
    }
    fn is_ray(&self, kind: &str, _: &Globals) -> bool {
        kind == "shadow"
    }
    fn is_connected(&self, param: &str) -> bool {
        param == "tint"
    }
    fn texture(&self, lookup: &Lookup, _: &Globals) -> Option<[f32; 4]> {
        (lookup.name == "a.png").then_some([lookup.s, lookup.t, 0.5, 0.75])
    }
    fn say(&self, speech: Speech, text: &str) {
        self.0.lock().expect("unpoisoned").push(format!("{speech:?} {text}"));
    }
}

/// The normal of the one lobe.
fn normal(engine: &Engine, script: &str, globals: &Globals) -> [f32; 3] {
    let shader = engine.compile("a.osl", script).unwrap_or_else(|e| panic!("{e}"));
    let tree: ClosureTree = shader.material(&[]).expect("specialises").tree(globals).expect("shades");
    match tree.node(tree.root()) {
        Node::Lobe { kind, slots, .. } => {
            let values = tree.values(kind, slots);
            [values[0], values[1], values[2]]
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn hosts_answer() {
    let host = Answering::default();
    let engine = Engine::new().host(host.clone());
    let globals = Globals { time: 3.0, u: 0.25, ..Globals::default() };
    let v = |code: &str| normal(&engine, &format!("surface s(color tint = 1) {{ {code} Ci = diffuse(r); }}"), &globals);
    assert_eq!(v("vector r = (vector) transform(\"object\", \"common\", point(1, 2, 3));"), [5.0, 4.0, 6.0]);
    assert_eq!(v("vector r = (vector) transform(\"object\", point(5, 4, 6));"), [1.0, 2.0, 3.0]);
    assert_eq!(v("vector r = vector(\"object\", 1, 2, 3);"), [2.0, 4.0, 6.0]);
    assert_eq!(v("matrix m; vector r = getmatrix(\"object\", m) * m[3][0];"), [3.0; 3]);
    assert_eq!(v("float a = 9; vector r = vector(getattribute(\"wear\", a), a, 0);"), [1.0, 0.25, 0.0]);
    assert_eq!(v("float a = 9; vector r = vector(getattribute(\"none\", a), a, 0);"), [0.0, 9.0, 0.0]);
    assert_eq!(v("string a; int f = getattribute(\"door\", \"kind\", a); vector r = f + (a == \"oak\");"), [2.0; 3]);
    assert_eq!(v("vector r = vector(raytype(\"shadow\"), raytype(\"camera\"), isconnected(tint));"), [1.0, 0.0, 1.0]);
    assert_eq!(v("vector r = (vector)(color) texture(\"a.png\", u, v);"), [0.25, 0.0, 0.5]);
    assert_eq!(v("float a; color c = texture(\"a.png\", u, v, \"alpha\", a); vector r = a;"), [0.75; 3]);
    assert_eq!(
        v("color c = texture(\"b.png\", u, v, \"missingcolor\", color(1, 2, 3)); vector r = (vector) c;"),
        [1.0, 2.0, 3.0]
    );
    assert_eq!(v("float c = texture(\"a.png\", u, v); vector r = c;"), [0.25; 3]);
    v(
        "printf(\"%g %s\\n\", u, \"x\"); for (int i = 0; i < 2; i++) warning(\"w%d\", i); if (u > 1) error(\"e\"); vector r = 1;",
    );
    assert_eq!(*host.0.lock().expect("unpoisoned"), ["Print 0.25 x\n", "Warning w0", "Warning w1"]);
}

#[test]
fn hosts_answer_in_parts() {
    let engine = Engine::new().host(Answering::default());
    let globals = Globals::default();
    let v = |code: &str| normal(&engine, &format!("surface s() {{ {code} Ci = diffuse(r); }}"), &globals);
    assert_eq!(v("float a = 9; int f = getattribute(\"weights\", 3, a); vector r = vector(f, a, 0);"), [1.0, 3.0, 0.0]);
    assert_eq!(
        v("float a = 9; int f = getattribute(\"x\", \"weights\", 16, a); vector r = vector(f, a, 0);"),
        [0.0, 9.0, 0.0]
    );
    assert_eq!(
        v("float a[3]; int f = getattribute(\"weights\", a); vector r = vector(f, a[1], a[2]);"),
        [1.0, 1.0, 2.0]
    );
    assert_eq!(
        v("matrix m; int f = getattribute(\"weights\", m); vector r = vector(f, m[1][0], m[3][3]);"),
        [1.0, 4.0, 15.0]
    );
    assert_eq!(
        v("string a[2]; int f = getattribute(\"names\", a); vector r = vector(f, a[1] == \"b\", 0);"),
        [1.0, 1.0, 0.0]
    );
    assert_eq!(
        v("string a[3]; int f = getattribute(\"names\", a); vector r = vector(f, a[1] == \"\", 0);"),
        [0.0, 1.0, 0.0]
    );
    assert_eq!(
        v("int a[2]; int f = gettextureinfo(\"a.png\", \"resolution\", a); vector r = vector(f, a[0], a[1]);"),
        [1.0, 640.0, 480.0]
    );
    assert_eq!(
        v("int a = 7; int f = gettextureinfo(\"b.png\", \"channels\", a); vector r = vector(f, a, 0);"),
        [0.0, 7.0, 0.0]
    );
}

/// What a host says nothing about is settled before shading.
#[test]
fn unanswered_questions_cost_nothing() {
    struct Silent;
    impl Host for Silent {
        fn answers(&self, subject: Subject) -> bool {
            subject == Subject::Textures
        }
    }
    for engine in [Engine::new(), Engine::new().host(Silent)] {
        let script = "float k = 1; printf(\"x\"); Ci = (raytype(\"shadow\") + getattribute(\"a\", k) + k) * diffuse(transform(\"world\", N));";
        let material = engine.compile("a", script).expect("compiles").material(&[]).expect("specialises");
        assert!(material.program().is_constant());
    }
}

#[test]
fn every_code_that_is_used_is_explained() {
    let mut used = BTreeSet::new();
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            if entry.path().is_dir() {
                folders.push(entry.path());
                continue;
            }
            let text = std::fs::read_to_string(entry.path()).expect("text");
            if entry.path().ends_with("diag/codes.rs") {
                continue;
            }
            for word in text.split('"').filter(|w| w.len() == 5 && w.starts_with(['E', 'W'])) {
                if word[1..].bytes().all(|b| b.is_ascii_digit()) {
                    used.insert(word.to_owned());
                }
            }
        }
    }
    let explained: BTreeSet<String> = CODES.iter().map(|c| c.code.to_owned()).collect();
    assert_eq!(used, explained);
    assert!(CODES.iter().all(|c| !c.title.is_empty() && c.text.len() > 20));
}
