//! The lobes that follow a thread: against reference values, at the thread's poles, and how well they are sampled.
#![cfg(feature = "cloth")]

use crate::common::{Stack, block, single_with, table};
use overcoat::albedo::Precision;
use overcoat::audit::{Side, Tolerance, albedo, chi2};
use overcoat::lobes::{LobeKind, cylinder, fabric};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The direction at angle `theta` along the thread and `phi` around it, in degrees.
fn around(theta: f64, phi: f64) -> [f32; 3] {
    let ((s, c), (y, z)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    [s as f32, (c * y) as f32, (c * z) as f32]
}

/// Along the thread, across it, and near its poles.
const PLACES: [(f64, f64); 9] = [
    (0.0, 0.0),
    (30.0, 0.0),
    (60.0, 20.0),
    (0.0, 85.0),
    (85.0, 0.0),
    (-89.5, 5.0),
    (0.0, 89.5),
    (45.0, 89.99),
    (89.99, 40.0),
];

#[test]
fn fabric_constants_match_the_table() {
    let (_, rows) = table("fabric_norm.csv");
    let mut worst = 0.0f64;
    for row in &rows {
        worst = worst.max((fabric::normalization(row[0]) as f32 as f64 / row[2] - 1.0).abs());
    }
    println!("{} constants in single precision, worst relative difference {worst:.1e}", rows.len());
    assert!(rows.len() == 30 && worst < 3e-7);
}

#[test]
fn fabric_constants_hold_for_any_exponent() {
    // The midpoint rule with many points, in s = sin x.
    let slow = |n: f64| {
        let (count, end) = (400_000, std::f64::consts::FRAC_PI_4.min(60.0 / (n + 1.0)));
        let term = |k: usize| {
            let x = end * (k as f64 + 0.5) / count as f64;
            (1.0 - x.sin()).powf(n) * (1.0 - 2.0 * x.sin().powi(2)).powi(2)
        };
        8.0 * end * (0..count).map(term).sum::<f64>() / count as f64
    };
    for n in [0.0, 0.3, 1.5, 7.77, 17.5, 18.5, 29.99, 100.0, 333.3, 1000.0] {
        let (fast, truth) = (fabric::normalization(n), slow(n));
        assert!((fast / truth - 1.0).abs() < 3e-8, "n {n}: {fast} for {truth}");
    }
}

fn never_gains(kind: LobeKind, set: &[(&str, f32)]) -> f64 {
    let stack = single_with::<f32>(kind, set);
    let mut largest = 0.0f64;
    for (theta, phi) in PLACES {
        let w = around(theta, phi);
        let bound = stack.bsdf(w).albedo_bound(w);
        for side in [Side::View, Side::Light] {
            let e = albedo(&|w| stack.bsdf(w), side, w, Tolerance { error: 1e-5, evaluations: 60_000 });
            assert!(e.max() <= 1.0001, "{kind:?} {set:?} at {theta}, {phi}: {e:?}");
            let below = |c: usize| e.value[c] - e.error.min(1e-4) <= bound[c] as f64 + 1e-6;
            assert!((0..3).all(below), "{kind:?} {set:?} at {theta}, {phi}: {e:?}, {bound:?}");
            largest = largest.max(e.max());
        }
    }
    largest
}

/// ∫ pdf over the upper hemisphere, by the midpoint rule around the thread.
fn pdf_integral(stack: &Stack<f32>, wo: [f32; 3]) -> f64 {
    let bsdf = stack.bsdf(wo);
    let (rows, columns) = (4000, 100);
    let mut sum = 0.0;
    for row in 0..rows {
        let theta = ((row as f64 + 0.5) / rows as f64 - 0.5) * 180.0;
        for column in 0..columns {
            let phi = ((column as f64 + 0.5) / columns as f64 - 0.5) * 180.0;
            sum += bsdf.pdf(around(theta, phi)) as f64 * theta.to_radians().cos();
        }
    }
    sum * (std::f64::consts::PI / rows as f64) * (std::f64::consts::PI / columns as f64)
}

fn samples_well(kind: LobeKind, set: &[(&str, f32)], rng: &mut Pcg64Mcg) {
    let stack = single_with::<f32>(kind, set);
    for (theta, phi) in PLACES {
        let result = chi2(&|w| stack.bsdf(w), around(theta, phi), 60_000, rng);
        let whole = pdf_integral(&stack, around(theta, phi));
        let fine = result.passes(1e-5) && result.lost < 1e-3;
        assert!(fine && (whole - 1.0).abs() < 1e-3, "{kind:?} {set:?} at {theta}, {phi}: {whole}, {result:?}");
    }
}

/// Variance of f·cos/pdf: uniform over the hemisphere, and by the lobe's own sampling.
fn variances(kind: LobeKind, set: &[(&str, f32)], wo: [f32; 3], rng: &mut Pcg64Mcg) -> (f64, f64) {
    let stack = single_with::<f32>(kind, set);
    let bsdf = stack.bsdf(wo);
    let count = 200_000;
    let (mut own, mut uniform) = ([0.0f64; 2], [0.0f64; 2]);
    for _ in 0..count {
        let u = std::array::from_fn(|_| rng.random::<f32>());
        let x = bsdf.sample(u).map_or(0.0, |s| s.weight[0] as f64);
        let z = u[0] as f64;
        let (s, c) = (u[1] as f64 * std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let y = bsdf.eval([(r * c) as f32, (r * s) as f32, z as f32]).f_cos[0] as f64 * std::f64::consts::TAU;
        for (sums, x) in [(&mut own, x), (&mut uniform, y)] {
            sums[0] += x;
            sums[1] += x * x;
        }
    }
    let n = count as f64;
    let variance = |s: [f64; 2]| s[1] / n - (s[0] / n).powi(2);
    (variance(uniform), variance(own))
}

#[test]
fn fabric_never_gains() {
    for r in [0.0, 0.3, 0.5, 0.8, 1.0] {
        let largest = never_gains(LobeKind::Fabric, &[("roughness", r)]);
        println!("roughness {r}: largest albedo {largest:.5}");
        assert!(largest > 0.999, "the constant is tight at normal incidence");
    }
    never_gains(LobeKind::Fabric, &[("exponent", 200.0)]);
    never_gains(LobeKind::Fabric, &[("exponent", 1000.0)]);
}

#[test]
fn fabric_samples_follow_the_pdf_at_the_poles() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    for r in [0.0, 0.3, 0.5, 0.8, 1.0] {
        samples_well(LobeKind::Fabric, &[("roughness", r)], &mut rng);
    }
}

#[test]
fn fabric_is_sampled_better_than_uniformly() {
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    for (r, least) in [(0.0, 30.0), (0.2, 20.0), (0.5, 6.0), (1.0, 2.0)] {
        for (theta, phi) in [(0.0, 0.0), (30.0, 30.0), (60.0, 0.0)] {
            let (uniform, own) = variances(LobeKind::Fabric, &[("roughness", r)], around(theta, phi), &mut rng);
            println!("roughness {r} at {theta}, {phi}: {uniform:.4} / {own:.5} = {:.1}", uniform / own);
            assert!(uniform > least * own);
        }
    }
}

#[test]
fn total_reflectance_matches_the_table() {
    let (_, rows) = table("thread_total_reflectance.csv");
    let mut worst = 0.0f64;
    for row in &rows {
        let r = 2.0 * cylinder::total_reflectance(row[0].to_radians(), row[1].to_radians());
        worst = worst.max((r - row[2]).abs()).max((4.0 * r - row[3]).abs());
    }
    println!("{} values, worst difference {worst:.1e}", rows.len());
    assert!(rows.len() > 150 && worst < 1e-6, "{worst}");
    let smooth = cylinder::total_reflectance(1e-3, 0.3);
    assert!((smooth - 1.0).abs() < 1e-5, "a smooth thread reflects {smooth}");
}

/// A ray into a smooth dielectric cylinder along x and out again keeps its angle to the axis.
#[test]
fn refraction_keeps_the_angle_along_the_thread() {
    let mut rng = Pcg64Mcg::seed_from_u64(13);
    let (mut worst, mut count) = (0.0f64, 0);
    while count < 200_000 {
        let [x, h, a, eta] = [(); 4].map(|_| rng.random::<f64>());
        let (x, turn) = (1.98 * x - 0.99, a * std::f64::consts::TAU);
        let across = (1.0 - x * x).sqrt();
        let way = [x, across * turn.cos(), across * turn.sin()];
        let Some(leaving) = cylinder::through_smooth_cylinder(way, 1.998 * h - 0.999, 1.1 + eta) else { continue };
        worst = worst.max((leaving[0] - x).abs());
        count += 1;
    }
    println!("{count} rays, largest change of sin θ {worst:.1e}");
    assert!(worst < 1e-12);
}

const THREADS: [&[(&str, f32)]; 6] = [
    &[("A", 1.0)],
    &[("A", 1.0), ("gamma_s", 1.0), ("gamma_v", 1.0), ("kd", 0.0)],
    &[("A", 1.0), ("gamma_s", 5.0), ("gamma_v", 10.0)],
    &[("A", 0.3), ("gamma_s", 2.5), ("gamma_v", 5.0), ("eta", 3.0)],
    &[("A", 1.0), ("kd", 1.0)],
    &[("A", 0.5), ("gamma_s", 90.0), ("gamma_v", 90.0)],
];

#[test]
fn threads_never_gain() {
    for set in THREADS {
        println!("{set:?}: largest albedo {:.5}", never_gains(LobeKind::Thread, set));
    }
}

#[test]
fn thread_samples_follow_the_pdf_at_the_poles() {
    let mut rng = Pcg64Mcg::seed_from_u64(14);
    for set in THREADS {
        samples_well(LobeKind::Thread, set, &mut rng);
    }
}

#[test]
fn threads_are_sampled_better_than_uniformly() {
    let mut rng = Pcg64Mcg::seed_from_u64(15);
    for set in THREADS {
        for (theta, phi) in [(0.0, 0.0), (30.0, 30.0), (60.0, 0.0)] {
            let (uniform, own) = variances(LobeKind::Thread, set, around(theta, phi), &mut rng);
            println!("{set:?} at {theta}, {phi}: {uniform:.4} / {own:.5} = {:.1}", uniform / own);
            assert!(uniform > 1.2 * own);
        }
    }
}

#[test]
fn cloths_never_gain() {
    for preset in 0..5 {
        let set = [("preset", preset as f32)];
        println!("{set:?}: largest albedo {:.5}", never_gains(LobeKind::Microcylinder, &set));
    }
}

#[test]
fn cloth_samples_follow_the_pdf_at_the_poles() {
    let mut rng = Pcg64Mcg::seed_from_u64(16);
    for preset in 0..5 {
        samples_well(LobeKind::Microcylinder, &[("preset", preset as f32)], &mut rng);
    }
}

#[test]
fn cloths_are_sampled_better_than_uniformly() {
    let mut rng = Pcg64Mcg::seed_from_u64(17);
    for preset in 0..5 {
        for (theta, phi) in [(0.0, 0.0), (30.0, 30.0), (60.0, 0.0)] {
            let set = [("preset", preset as f32)];
            let (uniform, own) = variances(LobeKind::Microcylinder, &set, around(theta, phi), &mut rng);
            println!("{set:?} at {theta}, {phi}: {uniform:.5} / {own:.6} = {:.1}", uniform / own);
        }
    }
}

/// Baking is part of compiling a material.
#[test]
fn tables_are_small_and_quick() {
    let known = |kind: LobeKind| block(kind, |_| None).into_iter().map(Some).collect::<Vec<_>>();
    let mut cases = vec![
        ("fabric", LobeKind::Fabric, known(LobeKind::Fabric)),
        ("thread", LobeKind::Thread, known(LobeKind::Thread)),
    ];
    for (name, kind, slot) in
        [("fabric, roughness varies", LobeKind::Fabric, 6), ("thread, gamma_s varies", LobeKind::Thread, 11)]
    {
        let mut values = known(kind);
        values[slot] = None;
        cases.push((name, kind, values));
    }
    for preset in 0..5 {
        let mut values = known(LobeKind::Microcylinder);
        values[6] = Some(preset as f32);
        cases.push(("microcylinder", LobeKind::Microcylinder, values));
    }
    for (name, kind, values) in cases {
        let start = std::time::Instant::now();
        let curve = kind.table(&values).expect("a table").bake::<f32>(Precision::STANDARD);
        println!("{name}: {:.0} ms, {} bytes", start.elapsed().as_secs_f64() * 1e3, curve.bytes());
        assert!(curve.bytes() <= 64 << 10);
    }
}
