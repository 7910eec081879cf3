//! What each lobe costs in each tier: preparing it for ωo, f and pdf, a sample, what a layer asks of it. The lobes are
//! those of `docs/lobes`, at the defaults of their scripts.
//!
//!     cargo bench --bench lobes -- sheen

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use overcoat::closure::Bsdf;
use overcoat::engine::Tier;
use overcoat::optics::Scalar;
use overcoat::{Engine, Globals, Material};
use std::fmt;
use std::path::Path;
use std::sync::Mutex;

/// A lobe in a tier.
#[derive(Clone, Debug, PartialEq)]
struct Case {
    lobe: String,
    tier: Tier,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", self.lobe, self.tier)
    }
}

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/lobes"))
}

fn cases() -> Vec<Case> {
    let files = std::fs::read_dir(folder()).expect("the lobes").map(|e| e.expect("an entry").path());
    let scripts = files.filter(|f| f.extension().is_some_and(|e| e == "osl"));
    let mut lobes: Vec<_> = scripts.filter_map(|f| Some(f.file_stem()?.to_str()?.to_owned())).collect();
    lobes.sort();
    let tiers = [Tier::Fast, Tier::Standard, Tier::Reference];
    lobes.iter().flat_map(|lobe| tiers.map(|tier| Case { lobe: lobe.clone(), tier })).collect()
}

/// A lobe's material; its tables are baked once.
fn material(case: &Case) -> &'static Material {
    static BAKED: Mutex<Vec<(Case, &'static Material)>> = Mutex::new(Vec::new());
    let mut baked = BAKED.lock().expect("no bench panics");
    if let Some((_, material)) = baked.iter().find(|(known, _)| known == case) {
        return material;
    }
    let text = std::fs::read_to_string(folder().join(&case.lobe).with_extension("osl")).expect("a script");
    let material = Engine::new().tier(case.tier).material(&case.lobe, &text).expect("compiles");
    baked.push((case.clone(), Box::leak(Box::new(material))));
    baked[baked.len() - 1].1
}

const WO: [f64; 3] = [0.6, 0.0, 0.8];

fn directions<S: Scalar>() -> Vec<[S; 3]> {
    let direction = |i: u32| {
        let z = (f64::from(i) + 0.5) / 1024.0;
        let (r, a) = ((1.0 - z * z).sqrt(), f64::from(i) * 2.399_963);
        [r * a.cos(), r * a.sin(), z].map(S::c)
    };
    (0..1024).map(|i| direction(i * 389 % 1024)).collect()
}

/// The same for every direction, in the numbers that the tier computes with.
fn each<A, B>(
    bencher: Bencher,
    case: &Case,
    single: impl Fn(&Bsdf<'_, f32>, [f32; 3]) -> A,
    double: impl Fn(&Bsdf<'_, f64>, [f64; 3]) -> B,
) {
    let (material, globals) = (material(case), Globals::default());
    if case.tier == Tier::Reference {
        let (bsdf, wi) = (material.shade_reference(&globals, WO).expect("shades"), directions());
        bencher.counter(ItemsCount::new(wi.len())).bench_local(|| {
            for w in &wi {
                black_box(double(&bsdf, *black_box(w)));
            }
        });
    } else {
        let wo = WO.map(|x| x as f32).into();
        let (bsdf, wi) = (material.shade(&globals, wo).expect("shades"), directions());
        bencher.counter(ItemsCount::new(wi.len())).bench_local(|| {
            for w in &wi {
                black_box(single(&bsdf, *black_box(w)));
            }
        });
    }
}

#[divan::bench(args = cases())]
fn shade(bencher: Bencher, case: &Case) {
    let (material, globals) = (material(case), Globals::default());
    if case.tier == Tier::Reference {
        bencher.bench_local(|| black_box(material.shade_reference(&globals, *black_box(&WO))).map(|b| b.lobe_count()));
    } else {
        let wo = WO.map(|x| x as f32);
        bencher.bench_local(|| black_box(material.shade(&globals, (*black_box(&wo)).into())).map(|b| b.lobe_count()));
    }
}

#[divan::bench(args = cases())]
fn eval(bencher: Bencher, case: &Case) {
    each(bencher, case, |b, w| b.eval(w), |b, w| b.eval(w));
}

#[divan::bench(args = cases())]
fn pdf(bencher: Bencher, case: &Case) {
    each(bencher, case, |b, w| b.pdf(w), |b, w| b.pdf(w));
}

#[divan::bench(args = cases())]
fn sample(bencher: Bencher, case: &Case) {
    each(bencher, case, |b, w| b.sample(w.map(|x| 0.5 * x + 0.5)), |b, w| b.sample(w.map(|x| 0.5 * x + 0.5)));
}

#[divan::bench(args = cases())]
fn albedo_bound(bencher: Bencher, case: &Case) {
    each(bencher, case, |b, w| b.albedo_bound(w), |b, w| b.albedo_bound(w));
}

fn main() {
    divan::main();
}
