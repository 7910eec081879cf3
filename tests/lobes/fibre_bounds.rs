//! The bounds of the lobes that follow a thread, at random directions: with all parameters known, and with tables that
//! were baked without knowing some.
#![cfg(feature = "cloth")]

use crate::common::{Stack, alone};
use overcoat::albedo::Precision;
use overcoat::audit::{Side, Tolerance, albedo};
use overcoat::lobes::LobeKind;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::FRAC_PI_2;

/// In turn: anywhere, close to the horizon, close to the thread's pole, close to the other family's pole.
fn place(k: usize, rng: &mut Pcg64Mcg) -> [f32; 3] {
    let [a, b] = [(); 2].map(|_| rng.random::<f64>());
    let tiny = 10f64.powf(-4.0 * b);
    let w = match k % 4 {
        0 => {
            let r = (1.0 - b * b).sqrt();
            let (s, c) = (a * std::f64::consts::TAU).sin_cos();
            [r * c, r * s, b]
        }
        1 => {
            let (s, c) = (a * std::f64::consts::TAU).sin_cos();
            [c, s, tiny]
        }
        2 => [if a < 0.5 { 1.0 } else { -1.0 }, tiny * (6.0 * a).sin(), tiny * (6.0 * a).cos().abs()],
        _ => [tiny * (6.0 * a).sin(), if a < 0.5 { 1.0 } else { -1.0 }, tiny * (6.0 * a).cos().abs()],
    };
    let norm = (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]).sqrt();
    w.map(|x| (x / norm) as f32)
}

fn stack(kind: LobeKind, set: &[(&str, f32)], unknown: &[&str]) -> Stack<f32> {
    Stack::varying(alone(kind, set), Precision::STANDARD, unknown)
}

/// Measures the albedo from both sides and holds it against 1 and against the bound; returns the largest. These lobes
/// are reciprocal, which `laws` holds exactly: from the light's side, dear to measure, a coarser rule would still tell.
fn hold(kind: LobeKind, set: &[(&str, f32)], varying: &[&str], count: usize, rng: &mut Pcg64Mcg) -> f64 {
    let stack = stack(kind, set, varying);
    let mut largest = 0.0f64;
    for k in 0..count {
        let w = place(k, rng);
        let bound = stack.bsdf(w).albedo_bound(w);
        for side in [Side::View, Side::Light] {
            let tolerance = match side {
                Side::View => Tolerance { error: 1e-5, evaluations: 60_000 },
                Side::Light => Tolerance { error: 1e-4, evaluations: 6_000 },
            };
            let e = albedo(&|w| stack.bsdf(w), side, w, tolerance);
            let place = format!("{kind:?} {set:?}, unknown {varying:?}, {side:?} at {w:?}: {e:?}, bound {bound:?}");
            let known = if side == Side::View { e.max() } else { e.max() - e.error };
            assert!(known <= 1.0001, "{place}");
            assert!((0..3).all(|c| e.value[c] - e.error <= bound[c] as f64 + 1e-4), "{place}");
            largest = largest.max(known);
        }
    }
    largest
}

/// Blocks of a thread, from sharp to dull.
const THREADS: [&[(&str, f32)]; 5] = [
    &[("A", 1.0), ("gamma_s", 1.7), ("gamma_v", 1.4), ("kd", 0.0), ("eta", 1.05)],
    &[("A", 1.0), ("gamma_s", 5.0), ("gamma_v", 10.0), ("eta", 1.34)],
    &[("A", 1.0), ("gamma_s", 2.5), ("gamma_v", 7.3), ("eta", 2.9)],
    &[("A", 1.0), ("kd", 1.0), ("gamma_s", 23.0), ("gamma_v", 41.0), ("eta", 1.7)],
    &[("A", 1.0), ("gamma_s", 88.0), ("gamma_v", 71.0), ("eta", 1.02)],
];

#[test]
fn a_thread_with_a_varying_parameter_never_gains() {
    let mut rng = Pcg64Mcg::seed_from_u64(21);
    for name in ["eta", "gamma_s", "gamma_v", "kd", "A"] {
        for set in THREADS {
            println!("{name} {set:?}: {:.5}", hold(LobeKind::Thread, set, &[name], 40, &mut rng));
        }
    }
    for set in THREADS {
        hold(LobeKind::Thread, set, &["eta", "gamma_s"], 40, &mut rng);
    }
}

/// What a fabric of exponent n reflects toward `w`: over θh, so that no ridge is missed.
fn fabric_albedo(n: f64, w: [f64; 3]) -> f64 {
    let theta = w[0].atan2(w[1].hypot(w[2]));
    let (lo, hi) = (0.5 * (theta - FRAC_PI_2), 0.5 * (theta + FRAC_PI_2));
    // 4/I_c · ∫ (1 − |sin θh|)ⁿ cos² (2 θh − θ) dθh, each side of the ridge, graded toward it.
    let side = |end: f64| {
        let count = 4000;
        let term = |k: usize| {
            let u = (k as f64 + 0.5) / count as f64;
            let h = end * u.powi(3);
            3.0 * u * u * end.abs() * (1.0 - h.sin().abs()).powf(n) * (2.0 * h - theta).cos().powi(2)
        };
        (0..count).map(term).sum::<f64>() / count as f64
    };
    4.0 * (side(lo) + side(hi)) / overcoat::lobes::fabric::normalization(n)
}

#[test]
fn fabric_bounds_hold_for_any_exponent() {
    let mut rng = Pcg64Mcg::seed_from_u64(25);
    for unknown in [&[][..], &["exponent"], &["roughness", "exponent"]] {
        let mut most = 0.0f64;
        for n in [1.0, 1.7, 5.0, 17.0, 29.5, 77.7, 400.0, 770.0, 1000.0] {
            let stack = stack(LobeKind::Fabric, &[("exponent", n)], unknown);
            for k in 0..200 {
                let w = place(k, &mut rng);
                let (e, bound) = (fabric_albedo(n as f64, w.map(f64::from)), stack.bsdf(w).albedo_bound(w)[0] as f64);
                assert!(e <= bound + 1e-6, "n {n}, unknown {unknown:?} at {w:?}: {e} above {bound}");
                most = most.max(bound - e);
            }
        }
        println!("unknown {unknown:?}: at most {most:.4} above the albedo");
    }
}

#[test]
fn a_fabric_with_a_varying_parameter_never_gains() {
    let mut rng = Pcg64Mcg::seed_from_u64(22);
    for set in [("roughness", 0.03), ("roughness", 0.47), ("roughness", 0.98), ("exponent", 3.3)] {
        let unknown = if set.0 == "roughness" { "roughness" } else { "exponent" };
        for unknown in [&[unknown][..], &["roughness", "exponent"]] {
            hold(LobeKind::Fabric, &[set], unknown, 40, &mut rng);
        }
    }
}

#[test]
fn a_cloth_with_a_varying_preset_never_gains() {
    let mut rng = Pcg64Mcg::seed_from_u64(23);
    for preset in 0..5 {
        hold(LobeKind::Microcylinder, &[("preset", preset as f32)], &["preset"], 40, &mut rng);
    }
}

/// Cloths from sharp, flat and pale to steep, dull and glassy.
const CLOTHS: [&[(&str, f32)]; 5] = [
    &[("A1", 1.0), ("A2", 1.0), ("offset1", 0.0), ("offset2", 0.0), ("gamma_s1", 2.0), ("gamma_v1", 2.0), ("kd1", 0.0)],
    &[("A1", 1.0), ("A2", 1.0), ("eta1", 1.0), ("eta2", 3.0), ("a1", 1.0), ("a2", 1.0), ("gamma_v2", 2.0)],
    &[("A1", 1.0), ("A2", 0.3), ("offset1", 60.0), ("offset2", 7.0), ("gamma_s1", 2.0), ("gamma_v1", 90.0)],
    &[("A1", 1.0), ("A2", 1.0), ("offset1", 60.0), ("offset2", 60.0), ("eta1", 1.05), ("eta2", 1.05), ("a1", 0.9)],
    &[("A1", 1.0), ("a1", 1.0), ("a2", 0.0), ("offset1", 3.0), ("gamma_s1", 4.0), ("gamma_v1", 8.0), ("kd1", 1.0)],
];

#[test]
fn cloths_of_any_threads_never_gain() {
    let mut rng = Pcg64Mcg::seed_from_u64(26);
    for (set, unknown) in CLOTHS.iter().zip(["offset1", "eta1", "gamma_v1", "a1", "kd1"]) {
        for unknown in [&[][..], &[unknown], &["A1", "A2"]] {
            let largest = hold(LobeKind::MicrocylinderThreads, set, unknown, 6, &mut rng);
            println!("{set:?}, unknown {unknown:?}: {largest:.5}");
        }
    }
}

/// Any values within their ranges, and the table or the closed forms.
#[test]
fn cloths_of_random_threads_never_gain() {
    let mut rng = Pcg64Mcg::seed_from_u64(27);
    for k in 0..6 {
        let params = LobeKind::MicrocylinderThreads.spec().params.iter().skip(2);
        // Ends as often as what lies between.
        let mut pick = |lo: f32, hi: f32| match rng.random_range(0..4) {
            0 => lo,
            1 => hi,
            _ => lo + (hi - lo) * rng.random::<f32>().powi(2),
        };
        let set: Vec<(&str, f32)> = params.map(|p| (p.name, pick(p.min, p.max))).collect();
        hold(LobeKind::MicrocylinderThreads, &set, if k % 2 == 0 { &["gamma_s2"] } else { &[] }, 6, &mut rng);
    }
}

#[test]
fn known_parameters_never_gain_anywhere() {
    let mut rng = Pcg64Mcg::seed_from_u64(24);
    for preset in 0..5 {
        let largest = hold(LobeKind::Microcylinder, &[("preset", preset as f32)], &[], 60, &mut rng);
        println!("preset {preset}: largest albedo {largest:.5}");
    }
    for set in THREADS {
        hold(LobeKind::Thread, set, &[], 60, &mut rng);
    }
    for n in [1.0, 2.6, 17.0] {
        hold(LobeKind::Fabric, &[("exponent", n)], &[], 60, &mut rng);
    }
}
