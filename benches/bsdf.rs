//! What a shading point costs: building the BSDF, evaluating it one direction at a time and many at once, sampling it.

mod stacks;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use overcoat::{Engine, Globals, Scratch};
use stacks::{WO, directions, material, names};

#[divan::bench(args = names())]
fn shade_and_flatten(bencher: Bencher, name: &str) {
    let material = material(&Engine::new(), name);
    let globals = Globals::default();
    bencher
        .bench_local(|| black_box(material.shade(black_box(&globals), black_box(WO.into()))).map(|b| b.lobe_count()));
}

/// [`shade_and_flatten`] into memory that is used again, as a renderer would.
#[divan::bench(args = names())]
fn shade_in(bencher: Bencher, name: &str) {
    let material = material(&Engine::new(), name);
    let (globals, mut scratch) = (Globals::default(), Scratch::new());
    bencher.bench_local(|| {
        let bsdf = material.shade_in(black_box(&globals), black_box(WO.into()), &mut scratch);
        bsdf.map(|b| black_box(b).lobe_count())
    });
}

#[divan::bench(args = names())]
fn eval(bencher: Bencher, name: &str) {
    let (material, globals, wi) = (material(&Engine::new(), name), Globals::default(), directions());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    bencher.counter(ItemsCount::new(wi.len())).bench_local(|| {
        for w in &wi {
            black_box(bsdf.eval(black_box(*w)));
        }
    });
}

#[divan::bench(args = names())]
fn eval_batch(bencher: Bencher, name: &str) {
    let (material, globals, wi) = (material(&Engine::new(), name), Globals::default(), directions());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    let mut out = vec![bsdf.eval(wi[0]); wi.len()];
    bencher.counter(ItemsCount::new(wi.len())).bench_local(|| bsdf.eval_batch(black_box(&wi), black_box(&mut out)));
}

#[divan::bench(args = names())]
fn sample(bencher: Bencher, name: &str) {
    let (material, globals, wi) = (material(&Engine::new(), name), Globals::default(), directions());
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
