//! A million random parameters and directions per lobe: finite, not negative, and single precision follows double.
//! The tables are those for parameters that are not known before shading, the hardest case.

use crate::common::rounding;
use overcoat::albedo::{AlbedoCurve, Precision};
use overcoat::audit::chi2::direction;
use overcoat::lobes::registry::{LobeClass, ParamSpec, ParamTy};
use overcoat::lobes::{AnyLobe, LobeKind};
use overcoat::optics::{Scalar, V3};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The table for switches as in `block` and numbers that are not known.
fn unknown<S: Scalar>(kind: LobeKind, block: &[f32]) -> AlbedoCurve<S> {
    let mut known = Vec::new();
    for p in kind.spec().params {
        let slots = known.len()..known.len() + p.ty.slots();
        let switch = matches!(p.ty, ParamTy::Int | ParamTy::String);
        known.extend(block[slots].iter().map(|v| switch.then_some(*v)));
    }
    kind.table(&known).map_or_else(AlbedoCurve::default, |t| t.bake(Precision::FAST))
}

/// A value in the declared range: anywhere, near an end, or at one.
fn value(p: &ParamSpec, rng: &mut impl Rng) -> f32 {
    let (lo, hi) = (p.min.max(-10.0), p.max.min(1e3));
    let t = match rng.random_range(0..6) {
        0 => 0.0,
        1 => 1.0,
        2 => rng.random::<f32>().powi(8),
        _ => rng.random(),
    };
    p.clamp(0, lo + (hi - lo) * t)
}

/// Anywhere on the sphere, or close to the horizon.
fn any_direction(rng: &mut impl Rng) -> [f32; 3] {
    let w = direction::<f32>(rng);
    if rng.random::<f32>() < 0.7 {
        return w;
    }
    let z = w[2].signum() * 10f32.powf(-7.0 * rng.random::<f32>());
    let flat = ((1.0 - z * z) / (w[0] * w[0] + w[1] * w[1]).max(1e-12)).sqrt();
    [w[0] * flat, w[1] * flat, z]
}

/// A block with the switches of `like`, if there is one, and random numbers.
fn values(kind: LobeKind, like: Option<&[f32]>, rng: &mut impl Rng) -> Vec<f32> {
    let mut block = Vec::new();
    for p in kind.spec().params {
        match p.ty {
            ParamTy::Normal => block.extend([0.0, 0.0, 1.0]),
            ParamTy::Vector => block.extend([1.0, 0.0, 0.0]),
            ParamTy::Int | ParamTy::String => block.push(like.map_or_else(|| value(p, rng), |l| l[block.len()])),
            _ => block.extend((0..p.ty.slots()).map(|_| value(p, rng))),
        }
    }
    block
}

/// Choices of switches per lobe.
const GROUPS: usize = 5;

fn scattering() -> impl Iterator<Item = LobeKind> {
    LobeKind::ALL.iter().copied().filter(|k| k.class() == LobeClass::Scatter)
}

#[test]
fn a_million_evaluations_of_each_lobe_are_finite() {
    let mut rng = Pcg64Mcg::seed_from_u64(21);
    for (kind, _) in scattering().flat_map(|k| (0..GROUPS).map(move |g| (k, g))) {
        let like = values(kind, None, &mut rng);
        let curve = unknown::<f32>(kind, &like);
        for _ in 0..1_000_000 / 20 / GROUPS {
            let block = values(kind, Some(&like), &mut rng);
            let wo = any_direction(&mut rng);
            let lobe = AnyLobe::new(kind, &block, V3::from_f32(wo), &curve);
            for _ in 0..20 {
                let wi = any_direction(&mut rng);
                let w = V3::<f32>::from_f32(wi);
                let (f, pdf, bound) = (lobe.f(w, &curve), lobe.pdf(w), lobe.albedo_bound(w, &curve));
                let fine = |x: &f32| x.is_finite() && *x >= 0.0;
                let all = f.iter().chain(&bound).chain([&pdf]).all(fine) && bound.iter().all(|b| *b <= 1.01);
                assert!(all, "{kind:?} {block:?} {wo:?} {wi:?}: f {f:?} pdf {pdf} bound {bound:?}");
            }
        }
    }
}

#[test]
fn single_precision_follows_double_everywhere() {
    let mut rng = Pcg64Mcg::seed_from_u64(22);
    for (kind, _) in scattering().flat_map(|k| (0..GROUPS).map(move |g| (k, g))) {
        // The same table in both, so that what is compared is the arithmetic.
        let like = values(kind, None, &mut rng);
        let (fast, exact) = (unknown::<f32>(kind, &like), unknown::<f64>(kind, &like));
        let mut worst = 0.0f64;
        for _ in 0..400 / GROUPS {
            let block = values(kind, Some(&like), &mut rng);
            let mut pairs = Vec::new();
            for _ in 0..40 {
                let wo = direction::<f32>(&mut rng);
                let a = AnyLobe::new(kind, &block, V3::from_f32(wo), &fast);
                let b = AnyLobe::new(kind, &block, V3::<f64>::from_f32(wo), &exact);
                // What reflects less than a thousandth is black.
                let count = if b.albedo(V3::<f64>::from_f32(wo), &exact).iter().any(|a| *a > 1e-3) { 10 } else { 0 };
                for _ in 0..count {
                    let wi = direction::<f32>(&mut rng);
                    let (f, truth) = (a.f(V3::<f32>::from_f32(wi), &fast), b.f(V3::<f64>::from_f32(wi), &exact));
                    // A dark channel is compared with the brightest: next to it an error is not seen.
                    let bright = truth[0].max(truth[1]).max(truth[2]);
                    pairs.extend((0..3).map(|c| (f64::from(f[c]), truth[c], bright, c, wo, wi)));
                }
            }
            let peak = pairs.iter().map(|p| p.1).fold(0.0, f64::max);
            for (f, truth, bright, c, wo, wi) in pairs {
                if bright > 1e-6 * peak {
                    let error = (f - truth).abs() / bright;
                    worst = worst.max(error);
                    if error >= 1e-4 {
                        let [a, b] = [wo, wi].map(|w| w.map(f64::from));
                        let of = |a: [f64; 3], b: [f64; 3]| {
                            let [a, b] = [a, b].map(|w| V3::new(w[0], w[1], w[2]));
                            AnyLobe::new(kind, &block, a, &exact).f(b, &exact)[c]
                        };
                        let unavoidable = rounding(of, a, b);
                        let far = (f - truth).abs() - unavoidable;
                        assert!(
                            far < 1e-4 * bright,
                            "{kind:?} {block:?}: {f} for {truth} ± {unavoidable} at {wo:?}, {wi:?}"
                        );
                    }
                }
            }
        }
        println!("{kind:?}: worst relative error {worst:.1e}");
    }
}
