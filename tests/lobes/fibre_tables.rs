//! The tables of the lobes that follow a thread: the standard tier's against the reference tier's, and both against the
//! albedo as the audit measures it.
#![cfg(feature = "cloth")]

use crate::common::{Stack, alone};
use overcoat::albedo::Precision;
use overcoat::audit::{Side, Tolerance, albedo};
use overcoat::lobes::LobeKind;

fn stack(kind: LobeKind, set: &[(&str, f32)], precision: Precision) -> Stack<f64> {
    Stack::new(alone(kind, set), precision)
}

/// The largest difference of the standard tables from the reference tables, and of each from the measured albedo; away
/// from the threads' poles, where f may be divided.
fn differences(kind: LobeKind, set: &[(&str, f32)]) -> [f64; 3] {
    let [standard, reference] = [Precision::STANDARD, Precision::REFERENCE].map(|p| stack(kind, set, p));
    let mut worst = [0.0f64; 3];
    let mut count = 0;
    for k in 0..21 {
        let (z, turn) = ([0.97f64, 0.7, 0.4, 0.15, 0.03, 1e-3, 1e-5][k % 7], 0.35 + 0.41 * k as f64);
        let r = (1.0 - z * z).sqrt();
        let w = [r * turn.cos(), r * turn.sin(), z];
        if w[0].abs().max(w[1].abs()) > 0.99 {
            continue;
        }
        let (a, b) = (standard.bsdf(w), reference.bsdf(w));
        let e = albedo(&|w| reference.bsdf(w), Side::View, w, Tolerance { error: 2e-5, evaluations: 20_000 });
        for c in (0..3).filter(|c| b.albedo_bound(w)[*c] < 1.0) {
            let (s, r, m) = (a.albedo()[c], b.albedo()[c], e.value[c]);
            let here = [(s - r).abs(), (s - m).abs() - e.error, (r - m).abs() - e.error];
            for (worst, d) in worst.iter_mut().zip(here) {
                *worst = worst.max(d);
            }
            count += 1;
        }
    }
    println!("{kind:?} {set:?}: standard − reference, − measured, reference − measured: {worst:.5?}");
    assert!(count > 30, "{kind:?} {set:?}: only {count} albedos");
    worst
}

const THREADS: [&[(&str, f32)]; 3] =
    [&[], &[("gamma_s", 2.0), ("gamma_v", 4.0), ("A", 0.2)], &[("gamma_s", 30.0), ("gamma_v", 60.0), ("eta", 1.3)]];

/// From flat and sharp to steep.
const CLOTHS: [&[(&str, f32)]; 2] = [
    &[("offset1", 0.0), ("offset2", 0.0), ("gamma_s1", 2.0), ("gamma_v1", 3.0), ("a1", 0.7)],
    &[("offset1", 60.0), ("offset2", 60.0), ("gamma_v2", 50.0)],
];

fn within_a_thousandth(kind: LobeKind, set: &[(&str, f32)]) {
    let worst = differences(kind, set);
    assert!(worst.iter().all(|d| *d < 1e-3), "{kind:?} {set:?}: {worst:?}");
}

#[test]
fn fabrics_and_threads_are_within_a_thousandth() {
    for r in [0.0, 0.5, 1.0] {
        within_a_thousandth(LobeKind::Fabric, &[("roughness", r)]);
    }
    for set in THREADS {
        within_a_thousandth(LobeKind::Thread, set);
    }
}

#[test]
fn cloths_are_within_a_thousandth() {
    within_a_thousandth(LobeKind::Microcylinder, &[("preset", 0.0)]);
    for set in CLOTHS {
        within_a_thousandth(LobeKind::MicrocylinderThreads, set);
    }
}
