//! How well lobes are sampled: chi-square over roughness and angle, and the variance of f·cos/pdf beside that of
//! uniform directions. Run with `--nocapture` for the tables.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::common::{Stack, at, block, lobe, single_with};
use overcoat::albedo::Precision;
use overcoat::albedo::quadrature::Rule;
use overcoat::audit::chi2;
use overcoat::closure::ClosureTree;
use overcoat::lobes::LobeKind;
use overcoat::lobes::registry::LobeClass;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::PI;
use std::sync::Arc;

const ROUGHNESS: [f64; 5] = [0.07, 0.15, 0.3, 0.6, 1.0];
/// The normal, 37°, 60°, 78°, 85°, 89.5°.
const COSINES: [f64; 6] = [1.0, 0.8, 0.5, 0.2, 0.087_156, 0.008_727];

/// Every lobe whose proposal is more than a cosine: name, kind, switches, and the share of the variance of uniform
/// sampling it may have on average.
type Subject = (&'static str, LobeKind, &'static [(&'static str, f32)], f64);
const SUBJECTS: [Subject; 8] = [
    ("conty_kulla", LobeKind::Sheen, &[("model", 1.0)], 0.25),
    ("conty_kulla, softening 0", LobeKind::Sheen, &[("model", 1.0), ("softening", 0.0)], 0.35),
    ("refit", LobeKind::Sheen, &[("model", 2.0)], 0.25),
    ("exact", LobeKind::Sheen, &[("model", 3.0)], 0.35),
    ("charlie_v", LobeKind::Sheen, &[("model", 4.0)], 0.35),
    ("zeltner", LobeKind::Sheen, &[("model", 5.0)], 0.05),
    ("velvet", LobeKind::Velvet, &[], 0.35),
    ("eon", LobeKind::Eon, &[], 0.2),
];

fn stack(kind: LobeKind, set: &[(&str, f32)], r: f64) -> Arc<Stack<f32>> {
    single_with(kind, &[set, &[("roughness", r as f32)]].concat())
}

/// Relative variances of f·cos/pdf for ωo at `cos`: with the lobe's own samples, and with uniform ones.
fn variances(stack: &Stack<f32>, cos: f64) -> [f64; 2] {
    let (polar, azimuth) = (Rule::gauss_legendre(64), Rule::gauss_legendre(48));
    let bsdf = stack.bsdf(at(cos));
    let (mut first, mut own, mut uniform) = (0.0, 0.0, 0.0);
    for (u, wu) in polar.nodes.iter().zip(&polar.weights) {
        for (v, wv) in azimuth.nodes.iter().zip(&azimuth.weights) {
            let (z, phi) = (u * u * u, PI * (1.0 - v * v));
            let weight = wu * 3.0 * u * u * wv * 4.0 * PI * v;
            let s = (1.0 - z * z).sqrt();
            let eval = bsdf.eval([s * phi.cos(), s * phi.sin(), z].map(|x| x as f32));
            let (f, pdf) = (eval.f_cos[0] as f64, eval.pdf as f64);
            first += f * weight;
            own += f * f / pdf.max(1e-30) * weight;
            uniform += f * f * 2.0 * PI * weight;
        }
    }
    [own, uniform].map(|second| second / (first * first) - 1.0)
}

#[test]
fn proposals_beat_uniform_sampling() {
    for (name, kind, set, limit) in SUBJECTS {
        println!("\n{name}: relative variance (share of uniform sampling's)\n");
        println!("| r | {} |", COSINES.map(|c| format!("{:.1}°", c.acos().to_degrees())).join(" | "));
        println!("|---{}|", "|---".repeat(COSINES.len()));
        let (mut sum, mut own_sum, mut uniform_sum) = (0.0, 0.0, 0.0);
        for r in ROUGHNESS {
            let stack = stack(kind, set, r);
            let cells = COSINES.map(|cos| {
                let [own, uniform] = variances(&stack, cos);
                sum += own / uniform;
                own_sum += own;
                uniform_sum += uniform;
                format!("{own:.3} ({:.2})", own / uniform)
            });
            println!("| {r} | {} |", cells.join(" | "));
        }
        let n = (ROUGHNESS.len() * COSINES.len()) as f64;
        println!("\nmean variance {:.3}, uniform {:.3}; mean share {:.2}", own_sum / n, uniform_sum / n, sum / n);
        assert!(own_sum < limit * uniform_sum && sum / n < 1.0, "{name}: {} {}", own_sum / uniform_sum, sum / n);
    }
}

#[test]
fn samples_follow_the_pdf_at_every_roughness_and_angle() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    for (name, kind, set, _) in SUBJECTS {
        for r in ROUGHNESS {
            let stack = stack(kind, set, r);
            for cos in COSINES.into_iter().chain([0.0]) {
                let result = chi2(&|w| stack.bsdf(w), at(cos), 40_000, &mut rng);
                assert!(result.passes(1e-5), "{name} r {r} cos {cos}: {result:?}");
                assert!((result.pdf_integral - 1.0).abs() < 1e-3, "{name} r {r} cos {cos}: {result:?}");
            }
        }
    }
}

#[test]
fn what_one_lobe_loses_is_not_counted_as_anothers() {
    // Facets send part of their samples below the horizon, where another lobe scatters.
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    let scattering = LobeKind::ALL.iter().copied().filter(|k| k.class() == LobeClass::Scatter);
    // In an upright frame the horizon is exact; in a tilted one it is rounded. Thin walls keep a part of their own.
    let thin: &[(&str, f32)] = &[("thin_walled", 1.0)];
    let widest: &[(&str, f32)] = &[("roughness_x", 1.0), ("roughness_y", 1.0), ("thin_walled", 1.0)];
    let walls = [(LobeKind::Dielectric, thin), (LobeKind::Dielectric, widest)];
    for (kind, set) in scattering.map(|kind| (kind, &[][..])).chain(walls) {
        for normal in [[0.0, 0.0, 1.0], [-0.065, -0.664, 0.745]] {
            let mut tree = ClosureTree::new();
            let mut values = block(kind, |p| set.iter().find(|s| s.0 == p.name).map(|s| s.1));
            if let Some(slot) = kind.spec().normal_slot() {
                values[slot..slot + 3].copy_from_slice(&normal);
            }
            let (a, b) = (tree.lobe(kind, 0, &values), lobe(&mut tree, LobeKind::Translucent, &[]));
            let (a, b) = (tree.mul([0.5; 3], a), tree.mul([0.5; 3], b));
            let root = tree.add(a, b);
            tree.set_root(root);
            let stack = Stack::<f32>::new(tree, Precision::FAST);
            for cos in [0.6, 0.05] {
                let result = chi2(&|w| stack.bsdf(w), at(cos), 40_000, &mut rng);
                assert!(result.passes(1e-5), "{kind:?} {set:?} normal {normal:?} cos {cos}: {result:?}");
            }
        }
    }
}
