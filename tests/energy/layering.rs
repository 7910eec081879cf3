//! The layering rule: hand-made trees where other engines gain energy. Random ones are in tests/energy/audit.rs.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::common::{Stack, at, lobe};
use overcoat::albedo::Precision;
use overcoat::audit::campaign::{LIMIT, promises};
use overcoat::audit::{Side, Tolerance, albedo, albedo_until, reciprocity_error};
use overcoat::closure::{ClosureTree, Layering, LayeringRule, NodeId, TintRule};
use overcoat::lobes::LobeKind;
use overcoat::optics::Scalar;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

const TOLERANCE: Tolerance = Tolerance { error: 5e-5, evaluations: 8_000 };

fn sheen(tree: &mut ClosureTree, r: f32) -> NodeId {
    lobe(tree, LobeKind::Sheen, &[("roughness", r)])
}

fn diffuse(tree: &mut ClosureTree) -> NodeId {
    lobe(tree, LobeKind::Diffuse, &[])
}

fn built(build: impl FnOnce(&mut ClosureTree) -> NodeId) -> ClosureTree {
    let mut tree = ClosureTree::new();
    let root = build(&mut tree);
    tree.set_root(root);
    tree
}

/// The largest E of one side at a spread of angles, above and below; exact only where it is more than it may be.
fn furnace<S: Scalar>(stack: &Stack<S>, side: Side, cosines: &[f64]) -> (f64, f64) {
    let tolerance = Tolerance { error: 1e-5, evaluations: 60_000 };
    let measure = |cos: &f64| {
        let e = albedo_until(&|w| stack.bsdf(w), side, at(*cos), tolerance, |e| e.max() + e.error <= LIMIT);
        (e.max(), *cos)
    };
    cosines.iter().map(measure).fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
}

fn assert_tier_keeps<S: Scalar>(name: &str, tree: &ClosureTree, precision: Precision, cosines: &[f64]) {
    let mut stack = Stack::<S>::new(tree.clone(), precision);
    for tint in [TintRule::Largest, TintRule::Channel] {
        for (rule, side) in LayeringRule::ALL.iter().flat_map(|r| [(*r, Side::View), (*r, Side::Light)]) {
            stack.layered(Layering { rule, tint });
            if promises(rule, side) {
                let (e, cos) = furnace(&stack, side, cosines);
                assert!(e <= LIMIT, "{name} {precision:?} {rule:?} {tint:?} {side:?} cos {cos}: {e}");
            }
        }
    }
}

fn assert_no_gain(name: &str, tree: ClosureTree) {
    assert_tier_keeps::<f32>(name, &tree, Precision::STANDARD, &[1.0, 0.5, 0.15, 0.01, -0.05, -0.7]);
    assert_tier_keeps::<f32>(name, &tree, Precision::FAST, &[0.8, 0.2, 0.003, -0.4]);
    assert_tier_keeps::<f64>(name, &tree, Precision::REFERENCE, &[0.3, 0.03, -0.2]);
}

#[test]
fn trees_that_gain_elsewhere() {
    assert_no_gain(
        "sum as top",
        built(|t| {
            let (a, b) = (sheen(t, 0.9), sheen(t, 0.3));
            let (a, b) = (t.mul([0.5; 3], a), t.mul([0.5; 3], b));
            let (top, base) = (t.add(a, b), diffuse(t));
            t.layer(top, base)
        }),
    );
    assert_no_gain(
        "layer as top",
        built(|t| {
            let (a, b, base) = (sheen(t, 0.5), sheen(t, 1.0), diffuse(t));
            let top = t.layer(a, b);
            t.layer(top, base)
        }),
    );
    assert_no_gain(
        "weighted layers",
        built(|t| {
            let (a, b) = (sheen(t, 0.5), diffuse(t));
            let layer = t.layer(a, b);
            let half = t.mul([0.5, 0.2, 0.9], layer);
            let (c, d) = (sheen(t, 1.0), diffuse(t));
            let other = t.layer(c, d);
            let rest = t.mul([0.5, 0.8, 0.1], other);
            t.add(half, rest)
        }),
    );
    assert_no_gain(
        "tinted tops",
        built(|t| {
            let (a, b, base) = (sheen(t, 1.0), sheen(t, 0.2), diffuse(t));
            let (a, b) = (t.mul([1.0, 0.0, 0.0], a), t.mul([0.0, 0.3, 1.0], b));
            let inner = t.layer(b, base);
            t.layer(a, inner)
        }),
    );
    assert_no_gain(
        "translucent base",
        built(|t| {
            let (top, base) = (sheen(t, 0.6), lobe(t, LobeKind::Translucent, &[]));
            t.layer(top, base)
        }),
    );
    assert_no_gain(
        "twenty nested layers",
        built(|t| {
            let base = diffuse(t);
            (0..20).fold(base, |base, k| {
                let top = sheen(t, 0.1 + 0.2 * (k % 5) as f32);
                t.layer(top, base)
            })
        }),
    );
    assert_no_gain(
        "a sum of forty, leaning left",
        built(|t| {
            let sum = (0..40).fold(t.zero(), |sum, k| {
                let l = if k % 2 == 0 { sheen(t, 0.1 + 0.2 * (k / 2 % 5) as f32) } else { diffuse(t) };
                let l = t.mul([0.025; 3], l);
                t.add(sum, l)
            });
            let base = diffuse(t);
            t.layer(sum, base)
        }),
    );
}

#[test]
fn a_layers_weight_reaches_top_and_base_alike() {
    let stack = |weight: f32| {
        Stack::<f64>::new(
            built(|t| {
                let (a, b) = (sheen(t, 0.5), diffuse(t));
                let layer = t.layer(a, b);
                t.mul([weight; 3], layer)
            }),
            Precision::STANDARD,
        )
    };
    let (whole, half) = (stack(1.0), stack(0.5));
    for cos in [0.9, 0.3, 0.05] {
        let (a, b) = (whole.bsdf(at(0.6)).f(at(cos)), half.bsdf(at(0.6)).f(at(cos)));
        approx::assert_relative_eq!(0.5 * a[0], b[0], max_relative = 1e-12);
    }
}

#[test]
fn a_weak_top_dims_little() {
    // Coverage: 0.5·top passes 1 − 0.5·Ē.
    let dimmed = |weight: f32| {
        let stack = Stack::<f64>::new(
            built(|t| {
                let (top, base) = (sheen(t, 1.0), diffuse(t));
                let top = t.mul([weight; 3], top);
                t.layer(top, base)
            }),
            Precision::REFERENCE,
        );
        let only_top = Stack::<f64>::new(
            built(|t| {
                let top = sheen(t, 1.0);
                t.mul([weight; 3], top)
            }),
            Precision::REFERENCE,
        );
        let (wo, wi) = (at(0.3), at(0.3));
        (stack.bsdf(wo).f(wi)[0] - only_top.bsdf(wo).f(wi)[0]) * std::f64::consts::PI
    };
    let (whole, half) = (dimmed(1.0), dimmed(0.5));
    approx::assert_abs_diff_eq!(1.0 - half, 0.5 * (1.0 - whole), epsilon = 1e-5);
}

#[test]
fn light_from_below_still_passes_a_one_sided_top() {
    let stack = Stack::<f64>::new(
        built(|t| {
            let (top, base) = (sheen(t, 0.5), lobe(t, LobeKind::Translucent, &[]));
            t.layer(top, base)
        }),
        Precision::STANDARD,
    );
    let (above, below) = (at::<f64>(0.5), at::<f64>(-0.5));
    let alpha = 1.0 - stack.bsdf(above).albedo_bound(above)[0];
    let f = stack.bsdf(above).f(below)[0] * std::f64::consts::PI;
    assert!(f > 0.3 && f < 1.0, "{f} {alpha}");
    approx::assert_relative_eq!(f, stack.bsdf(below).f(above)[0] * std::f64::consts::PI, max_relative = 1e-12);
}

#[test]
fn emission_is_dimmed_in_a_base_and_not_in_a_top() {
    let emissive_base = Stack::<f64>::new(
        built(|t| {
            let (top, base) = (sheen(t, 1.0), lobe(t, LobeKind::Emission, &[]));
            t.layer(top, base)
        }),
        Precision::STANDARD,
    );
    let emissive_top = Stack::<f64>::new(
        built(|t| {
            let (base, glow, top) = (diffuse(t), lobe(t, LobeKind::Emission, &[]), sheen(t, 1.0));
            let top = t.add(glow, top);
            t.layer(top, base)
        }),
        Precision::STANDARD,
    );
    let w = at::<f64>(0.2);
    let e = albedo(&|w| emissive_top.bsdf(w), Side::View, w, TOLERANCE);
    assert!(e.max() <= 1.0001 && e.max() > 0.5, "{e:?}");
    assert_eq!(emissive_top.bsdf(w).emission(), [1.0; 3]);
    let dimmed = emissive_base.bsdf(w).emission()[0];
    assert!(dimmed > 0.3 && dimmed < 0.7, "{dimmed}");
    assert_eq!(emissive_base.bsdf(at(-0.2)).emission(), [0.0; 3]);
}

#[test]
fn a_transmitting_top_leaves_nothing() {
    let stack = Stack::<f32>::new(
        built(|t| {
            let (top, base) = (lobe(t, LobeKind::Transparent, &[]), diffuse(t));
            t.layer(top, base)
        }),
        Precision::STANDARD,
    );
    let bsdf = stack.bsdf(at(0.5));
    assert_eq!(bsdf.eval(at::<f32>(0.7)).f_cos, [0.0; 3]);
    assert_eq!(bsdf.delta_albedo(), [1.0; 3]);
}

#[test]
fn a_delta_base_is_dimmed_at_its_own_direction() {
    let stack = Stack::<f64>::new(
        built(|t| {
            let (top, base) = (sheen(t, 1.0), lobe(t, LobeKind::Transparent, &[]));
            t.layer(top, base)
        }),
        Precision::STANDARD,
    );
    let w = at::<f64>(0.4);
    let bsdf = stack.bsdf(w);
    let (direction, part) = bsdf.delta_parts().next().expect("a delta lobe");
    assert!((direction[2] + 0.4).abs() < 1e-12);
    // One-sided fuzz: below it α is 1, so α(ωo) decides.
    let top_bound = bsdf.albedo_bound(w)[0] - part[0];
    approx::assert_abs_diff_eq!(part[0], 1.0 - top_bound, epsilon = 1e-12);
    for side in [Side::View, Side::Light] {
        assert!(albedo(&|w| stack.bsdf(w), side, w, TOLERANCE).max() <= 1.0001);
    }
}

#[test]
fn min_keeps_reciprocity() {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let tree = built(|t| {
        let rough = lobe(t, LobeKind::Sheen, &[("roughness", 0.4), ("softening", 0.0)]);
        let other = lobe(t, LobeKind::Sheen, &[("roughness", 1.0), ("softening", 0.0)]);
        let (base, through) = (diffuse(t), lobe(t, LobeKind::Translucent, &[]));
        let through = t.mul([0.5, 0.4, 0.3], through);
        let base = t.mul([0.5; 3], base);
        let base = t.add(base, through);
        let inner = t.layer(rough, base);
        t.layer(other, inner)
    });
    let mut stack = Stack::<f64>::new(tree, Precision::STANDARD);
    assert!(reciprocity_error(&|w| stack.bsdf(w), 2000, &mut rng).0 < 1e-9);
    stack.layering.rule = LayeringRule::View;
    assert!(reciprocity_error(&|w| stack.bsdf(w), 2000, &mut rng).0 > 0.1);
}

#[test]
fn a_hundred_thousand_terms_and_a_doubling_chain() {
    let tree = built(|t| {
        (0..100_000).fold(t.zero(), |sum, _| {
            let l = diffuse(t);
            let l = t.mul([1e-5; 3], l);
            t.add(sum, l)
        })
    });
    let stack = Stack::<f32>::new(tree, Precision::STANDARD);
    let f = stack.bsdf(at(0.5)).f(at(0.5))[0] * std::f32::consts::PI;
    assert!((f - 1.0).abs() < 1e-3, "{f}");

    let doubled = built(|t| {
        let mut sum = diffuse(t);
        for _ in 0..60 {
            sum = t.add(sum, sum);
        }
        sum
    });
    let message = overcoat::closure::flatten::<f32>(
        &doubled,
        &overcoat::Globals::default(),
        overcoat::optics::V3::new(0.0, 0.0, 1.0),
        Default::default(),
        &Default::default(),
    )
    .expect_err("2^60 lobes")
    .to_string();
    assert!(message.contains("1048576 lobes"), "{message}");

    let deep = built(|t| {
        let base = diffuse(t);
        (0..256).fold(base, |base, _| {
            let top = lobe(t, LobeKind::Sheen, &[]);
            let top = t.mul([0.01; 3], top);
            t.layer(top, base)
        })
    });
    let stack = Stack::<f32>::new(deep, Precision::STANDARD);
    let coarse = Tolerance { error: 1e-3, evaluations: 4000 };
    for side in [Side::View, Side::Light] {
        assert!(albedo(&|w| stack.bsdf(w), side, at(0.3), coarse).max() <= 1.0001, "256 layers, {side:?}");
    }
}
