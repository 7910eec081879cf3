//! What a shading point costs: building the BSDF, evaluating it one direction at a time and many at once, sampling it;
//! and the same for many points at once.

mod stacks;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use overcoat::closure::Eval;
use overcoat::{Bsdfs, Engine, Globals, Scratch};
use stacks::{WO, directions, material, names, numbers};

#[divan::bench(args = names())]
fn shade_and_flatten(bencher: Bencher, name: &str) {
    let material = material(&Engine::new(), name);
    let globals = Globals::default();
    bencher.bench_local(|| {
        black_box(material.shade(black_box(&globals), (*black_box(&WO)).into())).map(|b| b.lobe_count())
    });
}

/// [`shade_and_flatten`] into memory that is used again, as a renderer would.
#[divan::bench(args = names())]
fn shade_in(bencher: Bencher, name: &str) {
    let material = material(&Engine::new(), name);
    let (globals, mut scratch) = (Globals::default(), Scratch::new());
    bencher.bench_local(|| {
        let bsdf = material.shade_in(black_box(&globals), (*black_box(&WO)).into(), &mut scratch);
        bsdf.map(|b| black_box(b).lobe_count())
    });
}

#[divan::bench(args = names())]
fn eval(bencher: Bencher, name: &str) {
    let (material, globals, wi) = (material(&Engine::new(), name), Globals::default(), directions());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    bencher.counter(ItemsCount::new(wi.len())).bench_local(|| {
        for w in &wi {
            black_box(&bsdf.eval(*black_box(w)));
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
    let (material, globals, u) = (material(&Engine::new(), name), Globals::default(), numbers());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    bencher.counter(ItemsCount::new(u.len())).bench_local(|| {
        for u in &u {
            black_box(&bsdf.sample(*black_box(u)));
        }
    });
}

/// A thousand points of one material, prepared together.
#[divan::bench(args = names())]
fn shade_many(bencher: Bencher, name: &str) {
    let (material, wo) = (material(&Engine::new(), name), directions());
    let (points, mut bsdfs) = (vec![Globals::default(); wo.len()], Bsdfs::new());
    bencher
        .counter(ItemsCount::new(wo.len()))
        .bench_local(|| material.shade_many(black_box(&points), black_box(&wo), &mut bsdfs).is_ok());
}

/// One direction at each of them.
#[divan::bench(args = names())]
fn eval_many(bencher: Bencher, name: &str) {
    let (material, wi) = (material(&Engine::new(), name), directions());
    let (points, mut bsdfs) = (vec![Globals::default(); wi.len()], Bsdfs::new());
    material.shade_many(&points, &wi, &mut bsdfs).expect("shades");
    let mut out = vec![Eval::default(); wi.len()];
    bencher.counter(ItemsCount::new(wi.len())).bench_local(|| bsdfs.eval(black_box(&wi), black_box(&mut out)));
}

fn main() {
    divan::main();
}
