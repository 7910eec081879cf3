//! What must hold for every registered lobe. Driven by the registry: a new lobe is covered by being listed.

use crate::common::{Stack, at, block, blocks, rounding, single, turned};
use overcoat::albedo::{AlbedoCurve, Precision};
use overcoat::audit::{Side, Tolerance, albedo, chi2, reciprocity_error};
use overcoat::closure::ClosureTree;
use overcoat::lobes::registry::{LobeClass, ParamTy};
use overcoat::lobes::{AnyLobe, LobeKind, forms};
use overcoat::optics::{F32x8, V3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Every lobe, or the one that OVERCOAT_LOBE names, with a spread of parameter blocks.
fn instances() -> impl Iterator<Item = (LobeKind, Vec<f32>)> {
    let only = std::env::var("OVERCOAT_LOBE").ok();
    let chosen = move |k: &&LobeKind| only.as_ref().is_none_or(|name| k.spec().name == name);
    LobeKind::ALL.iter().filter(chosen).flat_map(|k| blocks(*k).into_iter().map(move |b| (*k, b)))
}

/// For what holds whatever the tables say: they are read alike at any size, and baking them takes longer than the tests.
const COARSE: Precision = Precision { cos_nodes: 16, axis_nodes: 8, polar: 16, azimuth: 8, ..Precision::FAST };

#[test]
fn samples_follow_the_pdf() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for (kind, values) in instances() {
        let stack = single::<f32>(kind, &values);
        for cos in [1.0, 0.6, 0.0872, 0.0087, -0.4] {
            let result = chi2(&|w| stack.bsdf(w), turned(cos), 60_000, &mut rng);
            assert!(result.passes(1e-5), "{kind:?} {values:?} cos {cos}: {result:?}");
        }
    }
}

#[test]
fn reciprocal_lobes_are_reciprocal() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    for (kind, values) in instances() {
        let stack = single::<f64>(kind, &values);
        let (error, a, b) = reciprocity_error(&|w| stack.bsdf(w), 2000, &mut rng);
        if kind.reciprocal(&values) {
            assert!(error < 1e-9, "{kind:?} {values:?}: {error} at {a:?}, {b:?}");
        } else {
            assert!(error > 1e-6, "{kind:?} {values:?} calls itself non-reciprocal and is not");
        }
    }
}

#[test]
fn no_lobe_gains_and_every_bound_holds() {
    let tolerance = Tolerance { error: 1e-5, evaluations: 60_000 };
    // The longest of these tests: on every core.
    let instances: Vec<_> = instances().collect();
    instances.into_par_iter().for_each(|(kind, values)| {
        let stack = single::<f32>(kind, &values);
        for cos in [1.0, 0.8, 0.4, 0.1, 0.02, 1e-3, 1e-5, -0.3, -1.0] {
            let w = turned(cos);
            let bsdf = stack.bsdf(w);
            let bound = bsdf.albedo_bound(w).map(f64::from);
            for side in [Side::View, Side::Light] {
                let mut e = albedo(&|w| stack.bsdf(w), side, w, tolerance);
                if e.error > 1e-4 {
                    // Toward the narrowest peaks at grazing angles single precision leaves no digits to integrate, and
                    // long ridges take many cells.
                    let (exact, more) = (single::<f64>(kind, &values), Tolerance { evaluations: 400_000, ..tolerance });
                    e = albedo(&|w| exact.bsdf(w), side, w.map(f64::from), more);
                }
                let place = format!("{kind:?} {values:?} {side:?} cos {cos}: {e:?}, bound {bound:?}");
                assert!(e.max() <= 1.0001, "{place}");
                assert!((0..3).all(|c| e.value[c] - e.error.min(1e-4) <= bound[c] + 1e-6), "{place}");
                if side == Side::View && kind.class() != LobeClass::Emission {
                    let estimate = bsdf.albedo().map(f64::from);
                    assert!((0..3).all(|c| (e.value[c] - estimate[c]).abs() < 2e-3), "{place}, estimate {estimate:?}");
                }
            }
        }
    });
}

#[test]
fn single_precision_follows_double() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    for (kind, values) in instances() {
        let (fast, exact) = (single::<f32>(kind, &values), single::<f64>(kind, &values));
        let mut pairs = Vec::new();
        for _ in 0..3000 {
            let [a, b] = [(); 2].map(|_| overcoat::audit::chi2::direction::<f32>(&mut rng));
            let f = fast.bsdf(a).f(b)[0] as f64;
            let truth = exact.bsdf(a.map(f64::from)).f(b.map(f64::from))[0];
            pairs.push((f, truth, a, b));
        }
        let peak = pairs.iter().map(|p| p.1).fold(0.0, f64::max);
        for (f, truth, a, b) in pairs {
            if truth > 1e-6 * peak && (f / truth - 1.0).abs() >= 1e-4 {
                let [a, b] = [a, b].map(|w| w.map(f64::from));
                let unavoidable = rounding(|a, b| exact.bsdf(a).f(b)[0], a, b);
                let far = (f - truth).abs() - unavoidable;
                assert!(far < 1e-4 * truth, "{kind:?} {values:?}: {f} for {truth} ± {unavoidable} at {a:?}, {b:?}");
            }
        }
    }
}

#[test]
fn lanes_give_what_scalars_give() {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    for (kind, values) in instances() {
        let known: Vec<Option<f32>> = values.iter().map(|v| Some(*v)).collect();
        let curve = kind.table(&known).map_or_else(AlbedoCurve::default, |c| c.bake::<f32>(COARSE));
        let wo = overcoat::audit::chi2::direction::<f32>(&mut rng);
        let lobe = AnyLobe::new(kind, &values, V3::from_f32(wo), &curve);
        for _ in 0..100 {
            let wi: [[f32; 3]; 8] = std::array::from_fn(|_| overcoat::audit::chi2::direction(&mut rng));
            let lanes = V3::new(0, 1, 2).map(|c: usize| F32x8(wi.map(|w| w[c])));
            let (f, pdf) = (lobe.f(lanes, &curve), lobe.pdf(lanes));
            let bound = lobe.albedo_bound(lanes, &curve);
            for (i, w) in wi.iter().enumerate() {
                let one = V3::<f32>::from_f32(*w);
                let place = format!("{kind:?} {values:?} {wo:?} {w:?}");
                for c in 0..3 {
                    assert_eq!(f[c].0[i].to_bits(), lobe.f(one, &curve)[c].to_bits(), "f {place}");
                    assert_eq!(bound[c].0[i].to_bits(), lobe.albedo_bound(one, &curve)[c].to_bits(), "bound {place}");
                }
                assert_eq!(pdf.0[i].to_bits(), lobe.pdf(one).to_bits(), "pdf {place}");
            }
        }
    }
}

#[test]
fn a_batch_gives_what_single_calls_give() {
    let shader =
        overcoat::Engine::new().compile("s", "Ci = sheen(0.5*diffuse(N) + 0.4*oren_nayar(N, u), N, 1, 0.2 + u);");
    let material = shader.expect("compiles").material(&[]).expect("specialises");
    let globals = overcoat::Globals { u: 0.4, ..Default::default() };
    let bsdf = material.shade(&globals, turned(0.4).into()).expect("within budget");
    let mut rng = Pcg64Mcg::seed_from_u64(6);
    for count in [0, 1, 7, 8, 9, 100] {
        let wi: Vec<[f32; 3]> = (0..count).map(|_| overcoat::audit::chi2::direction(&mut rng)).collect();
        let mut out = vec![bsdf.eval([0.0, 0.0, 1.0]); count];
        bsdf.eval_batch(&wi, &mut out);
        for (wi, out) in wi.iter().zip(&out) {
            let one = bsdf.eval(*wi);
            assert_eq!(one.f_cos.map(f32::to_bits), out.f_cos.map(f32::to_bits));
            assert_eq!(one.pdf.to_bits(), out.pdf.to_bits());
        }
    }
}

/// Numbers a host or a script may hand over by mistake.
const ODD: [f32; 17] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-45,
    -1e-45,
    1e-38,
    1e-20,
    -1e-7,
    1e-7,
    0.999_999_94,
    1.000_000_1,
    1e30,
    f32::MAX,
];

#[test]
fn odd_numbers_give_finite_results() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    for &kind in LobeKind::ALL {
        // Rough surfaces bake for long.
        let count = if kind.spec().params.iter().any(|p| p.name == "distribution") { 10 } else { 40 };
        for _ in 0..count {
            let values = block(kind, |_| Some(ODD[rng.random_range(0..ODD.len())]));
            let mut tree = ClosureTree::new();
            let lobe = tree.lobe(kind, 0, &values);
            tree.set_root(lobe);
            let stack = Stack::<f32>::new(tree, COARSE);
            for _ in 0..400 {
                let mut odd = || ODD[rng.random_range(0..ODD.len())];
                let mut direction = || [odd(), odd(), odd()];
                let (wo, wi) = (direction(), direction());
                let bsdf = stack.bsdf(wo);
                let eval = bsdf.eval(wi);
                let place = format!("{kind:?} {values:?} wo {wo:?} wi {wi:?}: {eval:?}");
                assert!(eval.f_cos.iter().all(|f| f.is_finite() && *f >= 0.0), "{place}");
                assert!(eval.pdf.is_finite() && eval.pdf >= 0.0, "{place}");
                let bounds = [bsdf.albedo(), bsdf.albedo_bound(wi), bsdf.emission()];
                assert!(bounds.iter().flatten().all(|b| b.is_finite() && *b >= 0.0), "{place} {bounds:?}");
                let u = [rng.random(), rng.random(), rng.random()];
                if let Some(s) = bsdf.sample(u) {
                    let numbers = [s.wi, s.f_cos, s.weight].concat();
                    assert!(numbers.iter().all(|x| x.is_finite()) && s.pdf > 0.0, "{place} {s:?}");
                }
            }
        }
    }
}

#[test]
fn directions_in_the_surface_scatter_nothing() {
    for (kind, values) in instances().filter(|(k, _)| k.class() == LobeClass::Scatter) {
        let stack = single::<f32>(kind, &values);
        let up = turned(0.5);
        assert_eq!(stack.bsdf(at(0.0)).eval(up).f_cos, [0.0; 3], "{kind:?} {values:?}");
        assert_eq!(stack.bsdf(up).eval(at::<f32>(0.0)).f_cos, [0.0; 3], "{kind:?} {values:?}");
    }
}

#[test]
fn the_registry_is_complete_and_documented() {
    for kind in LobeKind::ALL {
        let spec = kind.spec();
        assert_eq!(LobeKind::by_name(spec.name), Some(*kind), "two lobes called {}", spec.name);
        assert!(forms().any(|f| f.name == spec.name), "{} cannot be called", spec.name);
    }
    for form in forms() {
        assert!(!form.doc.trim().is_empty() && !form.source.is_empty(), "{}", form.name);
        for p in form.params {
            assert!(!p.doc.trim().is_empty(), "{}: {}", form.name, p.name);
            let ok = match p.ty {
                ParamTy::Closure | ParamTy::Normal | ParamTy::Vector => p.default.is_empty(),
                _ => p.default.len() == p.ty.slots() && p.default.iter().all(|d| (p.min..=p.max).contains(d)),
            };
            assert!(ok, "{}: default of {}", form.name, p.name);
        }
        let keywords_last = form.params.is_sorted_by_key(|p| p.keyword);
        assert!(keywords_last, "{}: keywords come after positional parameters", form.name);
    }
}
