//! For long, and from many threads: random materials give no bad number and take no more memory, and threads that share
//! an engine and a material get what one gets.
//!
//! `OVERCOAT_SOAK=100000000 cargo test --release --test soak` evaluates that many directions.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use overcoat::albedo::Precision;
use overcoat::audit::chi2::direction;
use overcoat::audit::trees::Pool;
use overcoat::closure::{Bsdf, Curves, Eval, Layering, LayeringRule, flatten};
use overcoat::engine::Tier;
use overcoat::optics::V3;
use overcoat::{Engine, Globals, Material};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::sync::Barrier;

/// Resident memory in bytes, where the system tells.
fn resident() -> Option<u64> {
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(statm.split(' ').nth(1)?.parse::<u64>().ok()? * 4096)
}

fn fine(eval: &Eval) -> bool {
    eval.f_cos.iter().chain([&eval.pdf]).all(|x| x.is_finite() && *x >= 0.0)
}

/// Directions that are evaluated at once.
const AT_ONCE: usize = 256;
/// Evaluations before new lobes are drawn.
const BLOCK: u64 = 20_000_000;

#[test]
fn many_evaluations_of_random_materials_stay_sane_and_memory_flat() {
    let total: u64 = std::env::var("OVERCOAT_SOAK").map_or(200_000, |n| n.parse().expect("a number of evaluations"));
    // A short run is not to spend its time on tables.
    let coarse = Precision { cos_nodes: 16, axis_nodes: 8, polar: 12, azimuth: 8, ..Precision::FAST };
    let precision = if total < BLOCK { coarse } else { Precision::FAST };
    let mut rng = Pcg64Mcg::seed_from_u64(31);
    let (mut done, mut trees, mut settled) = (0, 0, None);
    while done < total {
        let pool = Pool::random(&mut rng);
        let mut curves = Curves::<f32>::default();
        for (site, entry) in pool.entries().iter().enumerate() {
            curves.set(site as u32, entry.kind.table(&entry.known), precision);
        }
        let end = total.min(done + BLOCK);
        while done < end {
            let recipe = pool.tree(&mut rng);
            let layering = Layering { rule: LayeringRule::ALL[trees % LayeringRule::ALL.len()], ..Layering::default() };
            let wo = direction::<f32>(&mut rng);
            let bsdf = flatten(&recipe.tree(), &Globals::default(), V3::<f32>::from_f32(wo), layering, &curves);
            let bsdf = bsdf.expect("a small tree");
            let wi: [[f32; 3]; AT_ONCE] = std::array::from_fn(|_| direction(&mut rng));
            let mut found = [Eval { f_cos: [0.0; 3], pdf: 0.0 }; AT_ONCE];
            bsdf.eval_batch(&wi, &mut found);
            let bad = found.iter().position(|e| !fine(e));
            assert!(bad.is_none(), "{recipe:?} at {wo:?}, {:?}: {:?}", wi[bad.unwrap_or(0)], found[bad.unwrap_or(0)]);
            done += AT_ONCE as u64;
            trees += 1;
            // Memory that is used again has been asked for by then.
            if done > total / 4 && settled.is_none() {
                settled = resident();
            }
        }
    }
    let grown = resident().zip(settled).map_or(0, |(now, then)| now.saturating_sub(then)) >> 20;
    println!("{done} evaluations of {trees} trees; {grown} MiB more in use at the end than after a quarter");
    assert!(grown < 48, "{grown} MiB");
}

const SCRIPT: &str = "surface cloth(color tint = color(0.7, 0.2, 0.1), float r = 0.4) {
    Ci = tint * diffuse(N) + 0.1 * transparent();
    Ci = sheen(Ci, N, color(0.5 + 0.5 * noise(8 * u, 8 * v)), r);
    Ci = layer(0.5 * dielectric_bsdf(N, vector(1, 0, 0), 1, 0, 0.2, 0.2, 1.5, \"ggx\"), Ci);
}";

/// Every bit that a material gives at some points.
fn answers(material: &Material) -> Vec<u32> {
    let mut rng = Pcg64Mcg::seed_from_u64(32);
    let mut bits = Vec::new();
    for _ in 0..60 {
        let globals = Globals { u: rng.random(), v: rng.random(), ..Globals::default() };
        let wo = direction::<f32>(&mut rng);
        let bsdf: Bsdf<'_> = material.shade(&globals, wo.into()).expect("a small tree");
        for _ in 0..8 {
            let wi = direction::<f32>(&mut rng);
            let Eval { f_cos, pdf } = bsdf.eval(wi);
            bits.extend(f_cos.iter().chain([&pdf]).chain(&bsdf.albedo()).map(|x| x.to_bits()));
            let sample = bsdf.sample([rng.random(), rng.random(), rng.random()]);
            bits.extend(sample.iter().flat_map(|s| s.wi.into_iter().chain([s.pdf])).map(f32::to_bits));
        }
    }
    bits
}

#[test]
fn sixteen_threads_that_share_a_material_get_what_one_gets() {
    for (tier, rule) in [(Tier::Fast, LayeringRule::Min), (Tier::Standard, LayeringRule::Balanced)] {
        let engine = Engine::new().tier(tier).layering(rule);
        let material = engine.material("cloth", SCRIPT).expect("compiles");
        let alone = answers(&material);
        assert!(alone.iter().collect::<std::collections::HashSet<_>>().len() > 1000);
        let start = Barrier::new(16);
        std::thread::scope(|scope| {
            for k in 0..16 {
                let (engine, material, alone, start) = (&engine, &material, &alone, &start);
                scope.spawn(move || {
                    start.wait();
                    assert!(answers(material) == *alone, "thread {k}, the material all share");
                    // And one of its own, from the engine that all share.
                    let own = engine.material("cloth", SCRIPT).expect("compiles");
                    assert!(answers(&own) == *alone, "thread {k}, a material of its own");
                });
            }
        });
    }
}
