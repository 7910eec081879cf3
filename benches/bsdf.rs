//! What a shading point costs: building the BSDF, evaluating it one direction at a time and many at once, sampling it.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use overcoat::{Engine, Globals, Material, Scratch};

/// Stacks by name, lightest first.
const STACKS: &[(&str, &str)] = &[
    ("diffuse", "surface s() { Ci = diffuse(N); }"),
    ("sheen", "surface s() { Ci = sheen_bsdf(N, color(0.8, 0.3, 0.2), 0.4); }"),
    ("sheen_diffuse", "surface s() { Ci = 0.7 * diffuse(N); Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.4); }"),
    (
        "sheen_oren",
        "surface s() { Ci = color(0.7, 0.5, 0.2) * oren_nayar(N, 0.4); Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.4); }",
    ),
    ("sheen_u", "surface s() { Ci = 0.7 * diffuse(N); Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.1 + 0.8 * u); }"),
    (
        "sheen_dielectric_oren",
        "surface s() { Ci = 0.7 * oren_nayar(N, 0.4); Ci = layer(dielectric_bsdf(N, dPdu, 1, 0, 0.3, 0.3, 1.5, \"ggx\"), Ci);
            Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.4); }",
    ),
    ("velvet_eon", "surface s() { Ci = layer(0.4 * velvet(N, 0.3), 0.8 * eon(N, color(0.8), 0.5)); }"),
];

fn names() -> impl Iterator<Item = &'static str> {
    STACKS.iter().map(|s| s.0)
}

fn material(name: &str) -> Material {
    let text = STACKS.iter().find(|s| s.0 == name).expect("a stack").1;
    let shader = Engine::new().compile(name, text).expect("compiles");
    shader.material(&[]).expect("specialises")
}

const WO: [f32; 3] = [0.6, 0.0, 0.8];

fn directions() -> Vec<[f32; 3]> {
    let direction = |i: u32| {
        let z = (i as f32 + 0.5) / 1024.0;
        let (r, a) = ((1.0 - z * z).sqrt(), i as f32 * 2.399_963);
        [r * a.cos(), r * a.sin(), z]
    };
    (0..1024).map(|i| direction(i * 389 % 1024)).collect()
}

#[divan::bench(args = names())]
fn shade_and_flatten(bencher: Bencher, name: &str) {
    let material = material(name);
    let globals = Globals::default();
    bencher
        .bench_local(|| black_box(material.shade(black_box(&globals), black_box(WO.into()))).map(|b| b.lobe_count()));
}

/// [`shade_and_flatten`] into memory that is used again, as a renderer would.
#[divan::bench(args = names())]
fn shade_in(bencher: Bencher, name: &str) {
    let material = material(name);
    let (globals, mut scratch) = (Globals::default(), Scratch::new());
    bencher.bench_local(|| {
        let bsdf = material.shade_in(black_box(&globals), black_box(WO.into()), &mut scratch);
        bsdf.map(|b| black_box(b).lobe_count())
    });
}

#[divan::bench(args = names())]
fn eval(bencher: Bencher, name: &str) {
    let (material, globals, wi) = (material(name), Globals::default(), directions());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    bencher.counter(ItemsCount::new(wi.len())).bench_local(|| {
        for w in &wi {
            black_box(bsdf.eval(black_box(*w)));
        }
    });
}

#[divan::bench(args = names())]
fn eval_batch(bencher: Bencher, name: &str) {
    let (material, globals, wi) = (material(name), Globals::default(), directions());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    let mut out = vec![bsdf.eval(wi[0]); wi.len()];
    bencher.counter(ItemsCount::new(wi.len())).bench_local(|| bsdf.eval_batch(black_box(&wi), black_box(&mut out)));
}

#[divan::bench(args = names())]
fn sample(bencher: Bencher, name: &str) {
    let (material, globals, wi) = (material(name), Globals::default(), directions());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    bencher.counter(ItemsCount::new(wi.len())).bench_local(|| {
        for w in &wi {
            black_box(bsdf.sample(black_box(w.map(|x| 0.5 * x + 0.5))));
        }
    });
}

fn main() {
    divan::main();
}
