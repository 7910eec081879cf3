//! Rough surfaces: nothing is lost at any roughness, from either medium, and smooth ones are the limit.
#![cfg(feature = "microfacet")]

use crate::common::{Stack, block, single_with, turned};
use overcoat::albedo::Precision;
use overcoat::audit::{Side, Tolerance, albedo, chi2};
use overcoat::closure::ClosureTree;
use overcoat::lobes::LobeKind;
use overcoat::optics::fresnel;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// What 40 000 samples carry on average: an estimate of the albedo that needs no grid, to about 0.004.
fn sampled(stack: &Stack<f64>, cos: f64) -> f64 {
    let mut rng = Pcg64Mcg::seed_from_u64(32);
    let bsdf = stack.bsdf(turned(cos).map(f64::from));
    let weight = |_| bsdf.sample(rng.random()).map_or(0.0, |s| s.weight[0]);
    (0..40_000).map(weight).sum::<f64>() / 40_000.0
}

const COSINES: [f64; 5] = [1.0, 0.7, 0.3, 0.05, 0.004];
const TOLERANCE: Tolerance = Tolerance { error: 2e-5, evaluations: 60_000 };

#[test]
fn a_white_surface_stays_white() {
    let mut worst = (1.0f64, 1.0f64);
    for shape in [0.0, 1.0] {
        for alpha in [(1e-4, 1e-4), (0.01, 0.01), (0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.05, 0.4)] {
            let set = [("distribution", shape), ("xalpha", alpha.0), ("yalpha", alpha.1), ("eta", 0.0)];
            let stack = single_with::<f64>(LobeKind::Microfacet, &set);
            for cos in COSINES {
                for side in [Side::View, Side::Light] {
                    let e = albedo(&|w| stack.bsdf(w), side, turned(cos).map(f64::from), TOLERANCE);
                    worst = (worst.0.min(e.max()), worst.1.max(e.max()));
                    assert!((0.99..1.0001).contains(&e.max()), "{shape} {alpha:?} {side:?} cos {cos}: {e:?}");
                }
            }
        }
    }
    println!("white surfaces reflect {:.5} to {:.6}", worst.0, worst.1);
}

#[test]
fn glass_divides_all_light_between_reflection_and_refraction() {
    let mut worst = (1.0f64, 1.0f64);
    let surfaces = [(1e-4, 1.5), (0.05, 1.5), (0.3, 1.33), (0.3, 2.4), (1.0, 1.5), (0.5, 0.7), (0.3, 0.5)];
    for (k, (alpha, ior)) in surfaces.into_iter().enumerate() {
        let set = [("roughness_x", alpha), ("roughness_y", alpha), ("ior", ior), ("distribution", (k % 2) as f32)];
        let stack = single_with::<f64>(LobeKind::Dielectric, &set);
        for cos in [1.0, 0.6, 0.2, 0.02, -0.02, -0.5, -0.8, -1.0] {
            for side in [Side::View, Side::Light] {
                let e = albedo(&|w| stack.bsdf(w), side, turned(cos).map(f64::from), TOLERANCE);
                worst = (worst.0.min(e.max()), worst.1.max(e.max()));
                assert!((0.999..1.0001).contains(&e.max()), "α {alpha} ior {ior} {side:?} cos {cos}: {e:?}");
            }
        }
    }
    println!("glass scatters {:.5} to {:.6}", worst.0, worst.1);
}

#[test]
fn thin_walls_divide_all_light() {
    let mut worst = (1.0f64, 1.0f64);
    for (k, (alpha, ior)) in
        [((1e-4, 1e-4), 1.5), ((0.1, 0.1), 1.5), ((0.05, 0.4), 1.33), ((1.0, 1.0), 2.4)].into_iter().enumerate()
    {
        let shape = (k % 2) as f32;
        let set = [
            ("roughness_x", alpha.0),
            ("roughness_y", alpha.1),
            ("ior", ior),
            ("thin_walled", 1.0),
            ("distribution", shape),
        ];
        let stack = single_with::<f64>(LobeKind::Dielectric, &set);
        for cos in [1.0, 0.6, 0.2, 0.02, -0.02, -0.5, -1.0] {
            for side in [Side::View, Side::Light] {
                let e = albedo(&|w| stack.bsdf(w), side, turned(cos).map(f64::from), TOLERANCE);
                worst = (worst.0.min(e.max()), worst.1.max(e.max()));
                assert!((0.999..1.0001).contains(&e.max()), "α {alpha:?} ior {ior} {side:?} cos {cos}: {e:?}");
            }
        }
    }
    println!("thin walls scatter {:.5} to {:.6}", worst.0, worst.1);
}

#[test]
fn a_colored_boundary_divides_all_light() {
    let mut worst = (1.0f64, 1.0f64);
    for (k, (alpha, f0, f90, exponent)) in
        [(1e-4, 0.04, 1.0, 5.0), (0.1, 0.04, 1.0, 5.0), (0.4, 0.2, 0.6, 2.0), (1.0, 0.04, 1.0, 5.0)]
            .into_iter()
            .enumerate()
    {
        let set = [
            ("roughness_x", alpha),
            ("roughness_y", alpha),
            ("f0", f0),
            ("f90", f90),
            ("exponent", exponent),
            ("transmission_tint", 1.0),
            ("distribution", (k % 2) as f32),
        ];
        let stack = single_with::<f64>(LobeKind::GeneralizedSchlick, &set);
        for cos in [1.0, 0.6, 0.2, 0.02, -0.02, -0.5, -0.8, -1.0] {
            for side in [Side::View, Side::Light] {
                let e = albedo(&|w| stack.bsdf(w), side, turned(cos).map(f64::from), TOLERANCE);
                worst = (worst.0.min(e.max()), worst.1.max(e.max()));
                assert!((0.999..1.0001).contains(&e.max()), "α {alpha} f0 {f0} {side:?} cos {cos}: {e:?}");
            }
        }
    }
    println!("colored boundaries scatter {:.5} to {:.6}", worst.0, worst.1);
}

/// What bounces between facets is given back as the channel that loses least has it.
#[test]
fn a_film_on_glass_divides_nearly_all_light() {
    let mut worst = (1.0f64, 1.0f64);
    for (alpha, thickness, film, distribution) in
        [(1e-4, 120.0, 2.2, 0.0), (0.1, 500.0, 1.33, 1.0), (0.4, 1800.0, 1.8, 0.0)]
    {
        let set = [
            ("roughness_x", alpha),
            ("roughness_y", alpha),
            ("thinfilm_thickness", thickness),
            ("thinfilm_ior", film),
            ("distribution", distribution),
        ];
        let stack = single_with::<f64>(LobeKind::Dielectric, &set);
        for cos in [1.0, 0.6, 0.2, 0.02, -0.02, -0.5, -0.8, -1.0] {
            for side in [Side::View, Side::Light] {
                let e = albedo(&|w| stack.bsdf(w), side, turned(cos).map(f64::from), TOLERANCE);
                worst = e.value.iter().fold(worst, |(lo, hi), e| (lo.min(*e), hi.max(*e)));
                let all = e.max() > 0.999 && e.value.iter().all(|e| (0.997..1.0001).contains(e));
                assert!(all, "α {alpha} {thickness} nm {side:?} cos {cos}: {e:?}");
            }
        }
    }
    println!("glass under films scatters {:.5} to {:.6}", worst.0, worst.1);
}

#[test]
fn a_colored_boundary_reflects_one_color_and_passes_the_rest() {
    let mut tree = ClosureTree::new();
    let mut values = block(LobeKind::GeneralizedSchlick, |p| p.name.starts_with("roughness").then_some(1e-4));
    let slot = |name: &str| LobeKind::GeneralizedSchlick.spec().slot_of(name).expect("there");
    values[slot("transmission_tint")..][..3].fill(1.0);
    values[slot("f0")..][..3].copy_from_slice(&[0.3, 0.1, 0.02]);
    let root = tree.lobe(LobeKind::GeneralizedSchlick, 0, &values);
    tree.set_root(root);
    let stack = Stack::<f64>::new(tree, Precision::STANDARD);
    for cos in [0.9f64, 0.4, -0.95] {
        let bsdf = stack.bsdf(turned(cos).map(f64::from));
        let mut rng = Pcg64Mcg::seed_from_u64(33);
        let (mut back, mut on) = ([0.0; 3], [0.0; 3]);
        let count = 20_000;
        for _ in 0..count {
            let Some(s) = bsdf.sample(rng.random()) else { continue };
            let sum = if s.flags.transmit { &mut on } else { &mut back };
            for c in 0..3 {
                sum[c] += s.weight[c] / f64::from(count);
            }
        }
        for (c, f0) in [0.3, 0.1, 0.02].into_iter().enumerate() {
            // From inside the curve is that of the cosine outside.
            let root: f64 = (0.42f64 / 3.0).sqrt();
            let eta = (1.0 + root) / (1.0 - root);
            let outside = if cos > 0.0 { cos } else { (1.0 - eta * eta * (1.0 - cos * cos)).sqrt() };
            let f = f0 + (1.0 - f0) * (1.0 - outside).powi(5);
            assert!((back[c] - f).abs() < 0.02 && (on[c] - (1.0 - f)).abs() < 0.02, "{cos}: {back:?} {on:?} for {f}");
        }
    }
}

#[test]
fn a_smooth_thin_wall_is_a_window() {
    for cos in [1.0f64, 0.5, 0.1, -0.7] {
        let set = |tint| [("roughness_x", 1e-4), ("roughness_y", 1e-4), ("thin_walled", 1.0), tint];
        let w = turned(cos).map(f64::from);
        let back = single_with::<f64>(LobeKind::Dielectric, &set(("transmission_tint", 0.0))).bsdf(w).albedo()[0];
        let on = single_with::<f64>(LobeKind::Dielectric, &set(("reflection_tint", 0.0)));
        let r = fresnel::dielectric(1.25, cos.abs());
        assert!((back - 2.0 * r / (1.0 + r)).abs() < 1e-3, "cos {cos}: {back} for {r}");
        // Light goes through unbent, into the same medium.
        let sample = on.bsdf(w).sample([0.3, 0.5, 0.5]).expect("a direction");
        let near: f64 = (0..3).map(|c| (sample.wi[c] + w[c]).powi(2)).sum();
        assert!(near.sqrt() < 3e-3 && sample.eta == 1.0 && sample.flags.transmit, "{sample:?}");
    }
}

#[test]
fn samples_carry_what_the_tables_say() {
    for shape in [0.0, 1.0] {
        for alpha in [1e-4, 0.02, 0.5] {
            let ior = if alpha > 0.1 { 0.7 } else { 1.5 };
            let set = [("distribution", shape), ("roughness_x", alpha), ("roughness_y", alpha), ("ior", ior)];
            let stack = single_with::<f64>(LobeKind::Dielectric, &set);
            for cos in [1.0, 0.6, 0.3, -0.8] {
                let mean = sampled(&stack, cos);
                println!("{set:?} cos {cos}: samples carry {mean:.4}");
                assert!((mean - 1.0).abs() < 0.01, "{set:?} cos {cos}: {mean}");
            }
        }
    }
}

#[test]
fn smooth_surfaces_are_the_limit_of_rough_ones() {
    for cos in [1.0f64, 0.6, 0.2, -0.3, -0.9] {
        let w = turned(cos).map(f64::from);
        for refract in [0.0, 1.0] {
            let set = [("xalpha", 1e-4), ("yalpha", 1e-4), ("refract", refract)];
            let rough = single_with::<f64>(LobeKind::Microfacet, &set);
            let kind = if refract > 0.0 { LobeKind::Refraction } else { LobeKind::Reflection };
            let smooth = single_with::<f64>(kind, &[]);
            let (a, b) = (rough.bsdf(w).albedo()[0], smooth.bsdf(w).albedo()[0]);
            assert!((a - b).abs() < 1e-3, "cos {cos} refract {refract}: {a} for {b}");
            // The peak lies where the delta lobe points.
            let Some((direction, _)) = smooth.bsdf(w).delta_parts().next().filter(|p| p.1[0] > 0.0) else { continue };
            let sample = rough.bsdf(w).sample([0.3, 0.5, 0.5]).expect("a direction");
            let near: f64 = (0..3).map(|c| (sample.wi[c] - direction[c]).powi(2)).sum();
            assert!(near.sqrt() < 3e-3, "cos {cos} refract {refract}: {sample:?} for {direction:?}");
            let relative: f64 = if refract > 0.0 { if cos > 0.0 { 1.5 } else { 1.0 / 1.5 } } else { 1.0 };
            assert!((sample.eta - relative).abs() < 1e-6);
        }
    }
}

#[test]
fn narrow_lobes_are_sampled_as_they_say() {
    let mut rng = Pcg64Mcg::seed_from_u64(31);
    for (kind, set) in [
        (LobeKind::Microfacet, vec![("xalpha", 0.01), ("yalpha", 0.05), ("eta", 0.0)]),
        (LobeKind::Dielectric, vec![("roughness_x", 0.02), ("roughness_y", 0.02)]),
        (LobeKind::Dielectric, vec![("roughness_x", 0.6), ("roughness_y", 0.2), ("distribution", 1.0)]),
        (LobeKind::Dielectric, vec![("roughness_x", 0.1), ("thin_walled", 1.0)]),
        (LobeKind::Conductor, vec![("roughness_x", 0.2)]),
    ] {
        let stack = single_with::<f32>(kind, &set);
        for cos in [0.9, 0.2, -0.6] {
            let result = chi2(&|w| stack.bsdf(w), turned(cos), 40_000, &mut rng);
            assert!(result.passes(1e-5), "{kind:?} {set:?} cos {cos}: {result:?}");
        }
    }
}

#[test]
fn a_rough_metal_is_more_saturated_than_its_mirror() {
    let set = |alpha| [("roughness_x", alpha), ("roughness_y", alpha)];
    let color = |alpha: f32| single_with::<f32>(LobeKind::Conductor, &set(alpha)).bsdf([0.0, 0.0, 1.0]).albedo();
    let (smooth, rough) = (color(0.001), color(1.0));
    let mirror = fresnel::conductor(0.183f32, 3.424, 1.0);
    assert!((smooth[0] - mirror).abs() < 2e-3, "{smooth:?}");
    assert!(rough[2] / rough[0] < smooth[2] / smooth[0], "{rough:?} {smooth:?}");
}
