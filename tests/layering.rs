//! The layering rule: hand-made trees where other engines gain energy, and random ones.

mod common;

use common::{Stack, at, lobe};
use overcoat::albedo::Precision;
use overcoat::audit::{Side, Tolerance, albedo, reciprocity_error};
use overcoat::closure::{ClosureTree, LayeringRule, NodeId, TintRule};
use overcoat::lobes::LobeKind;
use overcoat::lobes::registry::ParamTy;
use overcoat::optics::Scalar;
use rand::{Rng, RngExt, SeedableRng};
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

/// E from both sides at a spread of angles, above and below.
fn furnace<S: Scalar>(stack: &Stack<S>) -> Vec<(Side, f64, [f64; 3])> {
    let mut rows = Vec::new();
    for cos in [1.0, 0.5, 0.15, 0.01, -0.05, -0.7] {
        for side in [Side::View, Side::Light] {
            rows.push((side, cos, albedo(&|w| stack.bsdf(w), side, at(cos), TOLERANCE).value));
        }
    }
    rows
}

fn assert_no_gain(name: &str, tree: ClosureTree) {
    for tint in [TintRule::Largest, TintRule::Channel] {
        for rule in [LayeringRule::Min, LayeringRule::View] {
            let mut stack = Stack::<f32>::new(tree.clone(), Precision::STANDARD);
            stack.layering.tint = tint;
            stack.layering.rule = rule;
            for (side, cos, e) in furnace(&stack) {
                if rule == LayeringRule::View && side == Side::Light {
                    continue;
                }
                assert!(e.iter().all(|x| *x <= 1.0001), "{name} {rule:?} {tint:?} {side:?} cos {cos}: {e:?}");
            }
        }
    }
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
                let top = sheen(t, 0.1 + 0.04 * k as f32);
                t.layer(top, base)
            })
        }),
    );
    assert_no_gain(
        "a sum of forty, leaning left",
        built(|t| {
            let sum = (0..40).fold(t.zero(), |sum, k| {
                let l = if k % 2 == 0 { sheen(t, 0.1 + 0.02 * k as f32) } else { diffuse(t) };
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

/// A random budgeted tree: weights are split so that no sum, top or base exceeds one.
fn random_tree(t: &mut ClosureTree, rng: &mut impl Rng, depth: u32, budget: f32) -> NodeId {
    let pick = if depth == 0 { 0 } else { rng.random_range(0..4) };
    match pick {
        1 => {
            let share = rng.random::<f32>();
            let (a, b) = (random_tree(t, rng, depth - 1, share), random_tree(t, rng, depth - 1, 1.0 - share));
            let sum = t.add(a, b);
            t.mul([budget; 3], sum)
        }
        2 | 3 => {
            let (top, base) = (random_tree(t, rng, depth - 1, 1.0), random_tree(t, rng, depth - 1, 1.0));
            let layer = t.layer(top, base);
            t.mul([budget; 3], layer)
        }
        _ => {
            let kind = LobeKind::ALL[rng.random_range(0..LobeKind::ALL.len())];
            let tilt = |rng: &mut dyn FnMut() -> f32| [0.8 * rng() - 0.4, 0.8 * rng() - 0.4, 1.0];
            let mut values = Vec::new();
            for p in kind.spec().params {
                match p.ty {
                    ParamTy::Normal | ParamTy::Vector => values.extend(tilt(&mut || rng.random())),
                    _ => {
                        let (lo, hi) = (p.min.max(0.0), p.max.min(1.6));
                        values.extend((0..p.ty.slots()).map(|_| lo + (hi - lo) * rng.random::<f32>()));
                    }
                }
            }
            let site = t.len() as u32;
            let l = t.lobe(kind, site, &values);
            let weight = std::array::from_fn(|_| if rng.random() { budget } else { budget * rng.random::<f32>() });
            t.mul(weight, l)
        }
    }
}

#[test]
fn random_budgeted_trees_never_gain() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let coarse = Precision { cos_nodes: 48, polar: 24, azimuth: 16, ..Precision::STANDARD };
    for round in 0..60 {
        let tree = built(|t| random_tree(t, &mut rng, 4, 1.0));
        let mut stack = Stack::<f32>::new(tree, coarse);
        stack.layering.tint = if round % 2 == 0 { TintRule::Largest } else { TintRule::Channel };
        for _ in 0..3 {
            let w = overcoat::audit::chi2::direction::<f32>(&mut rng);
            for side in [Side::View, Side::Light] {
                let e = albedo(&|w| stack.bsdf(w), side, w, Tolerance { error: 1e-4, evaluations: 30_000 });
                assert!(e.max() - e.error.min(2e-3) <= 1.0001, "round {round} {side:?} {w:?}: {e:?} {:?}", stack.tree);
            }
        }
    }
}
