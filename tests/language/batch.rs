//! Many points shaded with one call get, bit for bit, the trees they get one by one.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::programs::{LIBRARY, statement};
use overcoat::Globals;
use overcoat::closure::ClosureTree;
use overcoat::ir::{self, Batch, Host, Lookup, Program};
use overcoat::syntax::{Limits, Options};
use proptest::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// Points that differ in everything a script can read.
fn points(count: usize) -> Vec<Globals> {
    let wave = |k: usize, speed: f32| (k as f32 * speed).sin();
    let vector = |k: usize, speed: f32| glam::vec3(wave(k, speed), wave(k, speed * 1.7), wave(k, speed * 2.3));
    let point = |k: usize| Globals {
        p: vector(k, 0.9) * 3.0,
        n: vector(k, 0.3).normalize_or(glam::Vec3::Z),
        i: vector(k, 0.5).normalize_or(glam::Vec3::NEG_Z),
        u: 0.5 + 0.5 * wave(k, 0.7),
        v: 0.5 + 0.5 * wave(k, 1.1),
        time: wave(k, 1.3),
        backfacing: k.is_multiple_of(3),
        ..Globals::default()
    };
    (0..count).map(point).collect()
}

/// What shading left, digit for digit: numbers are printed so that they read back the same.
fn seen(tree: &ClosureTree) -> String {
    format!("{tree:?}")
}

fn compare(program: &Program, points: &[Globals], batch: &mut Batch) {
    program.shade_batch(points, batch);
    assert_eq!(batch.trees().len(), points.len());
    let mut tree = ClosureTree::new();
    for (k, point) in points.iter().enumerate() {
        let error = program.shade(point, &mut tree).err();
        let found = batch.errors().iter().find(|(i, _)| *i == k).map(|(_, e)| *e);
        assert_eq!(found, error, "point {k}");
        match error {
            None => assert_eq!(seen(&batch.trees()[k]), seen(&tree), "point {k}"),
            Some(_) => assert!(batch.trees()[k].is_empty(), "point {k}"),
        }
    }
}

/// Answers by the point.
struct ByPoint;

impl Host for ByPoint {
    fn is_ray(&self, _: &str, globals: &Globals) -> bool {
        globals.u > 0.5
    }
    fn texture(&self, lookup: &Lookup, globals: &Globals) -> Option<[f32; 4]> {
        Some([lookup.s, lookup.t, globals.time, 1.0])
    }
}

fn program(script: &str) -> Option<Program> {
    let options = Options { limits: Limits { iterations: 60, ..Limits::default() }, ..Options::default() };
    let (shader, _) = ir::compile_with("batch.osl", script, &[], &options, Some(Arc::new(ByPoint))).ok()?;
    shader.specialise(&[]).ok()
}

#[test]
fn ways_part_and_meet() {
    let scripts = [
        // Nested branches and loops with breaks, whose lengths differ from point to point.
        "float x = 0; for (int i = 0; i < 20; i++) { if (i > 12 * u) break; if (v > 0.5) { x += u; if (time > 0) continue; }
         x += noise(P * i); } Ci = x * diffuse(N);",
        // Beyond the budget at some points, and then at all of those that are left.
        "int i = 0; while (i < 100 * u) i++; Ci = i * 0.01 * diffuse(N);",
        "int i = 0; while (u < 2) i++; Ci = i * diffuse(N);",
        "float a[5] = {1, 2, 3, 4, u}; a[(int)(u * 7)] = v; closure color c[2] = {diffuse(N), translucent(N)};
         c[u > v] = 0.5 * c[v > 0.3]; Ci = a[(int)(v * 5)] * c[time > 0] + c[1];",
        "string s = u > 0.5 ? \"a\" : \"b\"; s = concat(s, format(\"%d\", (int)(v * 3)));
         Ci = (color) texture(s, u, v) * diffuse(N) + raytype(\"camera\") * hash(s) * 1e-9 * translucent(N);",
        "vector t = transform(matrix(2), N); color c = mix(color(u, v, 1), color(0.5), smoothstep(0.2, 0.8, v));
         c = pow(c, 2.2) + fmod(time, 0.3) + atan2(u, v); Ci = c * oren_nayar(normalize(t), u) + u * sheen(diffuse(N), N, v, 0.3);",
        "color n = noise(P * 4) + cellnoise(u * 9, v) + noise(\"simplex\", P) + pnoise(u * 9, 3); Ci = n * diffuse(N);",
    ];
    let mut batch = Batch::new();
    for script in scripts {
        let program = program(script).expect("compiles");
        for count in [1, 7, 8, 9, 100, 0] {
            compare(&program, &points(count), &mut batch);
        }
    }
}

#[test]
fn the_corpus_is_the_same_in_batches() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut batch = Batch::new();
    let mut count = 0;
    for folder in ["examples", "tests/corpus/ok", "tests/corpus/osl", "tests/corpus/energy"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("a folder").flatten() {
            if entry.path().extension().is_some_and(|e| e == "osl") {
                let text = std::fs::read_to_string(entry.path()).expect("text");
                let Ok((shader, _)) = ir::compile("batch.osl", &text) else { continue };
                let Ok(program) = shader.specialise(&[]) else { continue };
                compare(&program, &points(19), &mut batch);
                count += 1;
            }
        }
    }
    assert!(count > 150, "{count}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    #[test]
    fn any_program_is_the_same_in_batches(body in prop::collection::vec(statement(), 1..5), count in 1usize..20) {
        let body = format!("for (int once = 0; once < 1; once++) {{ {} }}", body.concat()).replace('X', "(3 * u)");
        let script = format!("{LIBRARY} surface s() {{ float a = v, b = 0.5; int n = (int)(u * 5); float t[3] = {{v, 2, 3}};
            pair p = {{1, u}}; {body} float all = a + 3 * b + 5 * n + 7 * t[0] + 11 * t[1] + 13 * t[2] + 17 * p.x + 19 * p.y;
            Ci = all * diffuse(N) + u * translucent(N); }}");
        let program = program(&script).expect("compiles");
        compare(&program, &points(count), &mut Batch::new());
    }
}
