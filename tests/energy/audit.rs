//! The audit's own tests: are its random trees what it says, does it measure right, does it find what gains?
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::common::{Stack, at, lobe};
use overcoat::albedo::Precision;
use overcoat::audit::campaign::{BLOCK, Campaign, Tally};
use overcoat::audit::trees::{MAX_DEPTH, Pool, Recipe};
use overcoat::audit::{Side, Tolerance, albedo, breakdown, estimate, ledger, script};
use overcoat::closure::{Bsdf, ClosureTree, LayeringRule, TintRule, flatten};
use overcoat::engine::Tier;
use overcoat::lobes::LobeKind;
use overcoat::optics::V3;
use overcoat::{Engine, Globals};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

#[test]
fn random_budgeted_trees_never_gain() {
    for (tier, trees) in [(Tier::Fast, 500), (Tier::Standard, 500)] {
        let campaign = Campaign { trees, seed: 3, tiers: vec![tier] };
        let block = campaign.block(0);
        let mut tally = Tally::default();
        for tree in campaign.trees_of(0) {
            tally.add(block.measure(tree), || block.script(tree));
        }
        assert_eq!((tally.trees, tally.violations, tally.unresolved), (trees, 0, 0), "{tier:?}: {tally:#?}");
        // The trees are worth measuring: many come close to one.
        assert!(tally.integrated > trees / 20 && tally.above[1] > trees / 10, "{tally:?}");
        assert!(tally.lobes > 4 * trees, "{tally:?}");
    }
}

#[test]
fn a_tree_depends_on_seed_and_number_alone() {
    let campaign = |trees, seed| Campaign { trees, seed, tiers: vec![Tier::Fast] };
    let (small, large, other) = (campaign(20, 5), campaign(3 * BLOCK, 5), campaign(20, 6));
    let (a, b, c) = (small.block(0), large.block(0), other.block(0));
    let mut forward = Tally::default();
    let mut parts = [Tally::default(), Tally::default()];
    for tree in small.trees_of(0) {
        let case = a.measure(tree);
        assert_eq!(case, b.measure(tree));
        assert_eq!(a.script(tree), b.script(tree));
        assert_ne!(a.script(tree), c.script(tree));
        forward.add(case.clone(), || a.script(tree));
        parts[tree as usize % 2].add(case, || a.script(tree));
    }
    let [mut merged, odd] = parts;
    merged.merge(odd);
    assert_eq!(forward, merged);
    assert_eq!((large.blocks(), large.trees_of(2)), (3, 2 * BLOCK..3 * BLOCK));
}

fn visit(recipe: &Recipe, each: &mut impl FnMut(&Recipe)) {
    each(recipe);
    match recipe {
        Recipe::Lobe { .. } => {}
        Recipe::Weighted(_, closure) => visit(closure, each),
        Recipe::Sum { terms, .. } => terms.iter().for_each(|t| visit(t, each)),
        Recipe::Layer(top, base) => {
            visit(top, each);
            visit(base, each);
        }
    }
}

#[test]
fn random_trees_are_budgeted_and_varied() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (mut kinds, mut full, mut longest) = (vec![0; LobeKind::ALL.len()], 0, 0);
    let (mut sum_tops, mut layer_tops, mut weighted_layers, mut deepest) = (0, 0, 0, 0);
    let within = |r: &Recipe| r.budget().iter().all(|b| *b <= 1.0 + 1e-5);
    for _ in 0..20 {
        let pool = Pool::random(&mut rng);
        for _ in 0..200 {
            let recipe = pool.tree(&mut rng);
            let tree = recipe.tree();
            assert!(within(&recipe), "{recipe:?}");
            let size = tree.size(tree.root());
            assert!(u32::from(size.layers) <= MAX_DEPTH && tree.within_budget().is_ok());
            deepest = deepest.max(size.layers);
            full += u32::from(recipe.budget().iter().all(|b| *b > 1.0 - 1e-5));
            visit(&recipe, &mut |part| match part {
                Recipe::Lobe { kind, values, .. } => {
                    kinds[LobeKind::ALL.iter().position(|k| k == kind).expect("a built-in lobe")] += 1;
                    if let Some(s) = kind.spec().normal_slot() {
                        assert!(values[s + 2] >= 0.4999, "a normal more than 60° from Ng: {values:?}");
                    }
                }
                Recipe::Layer(top, base) => {
                    assert!(within(top) && within(base), "{part:?}");
                    sum_tops += u32::from(matches!(**top, Recipe::Sum { .. }));
                    layer_tops += u32::from(matches!(**top, Recipe::Layer(..)));
                }
                Recipe::Weighted(_, c) => weighted_layers += u32::from(matches!(**c, Recipe::Layer(..))),
                Recipe::Sum { terms, leans_right: false } => longest = longest.max(terms.len()),
                Recipe::Sum { .. } => {}
            });
        }
    }
    assert!(kinds.iter().all(|n| *n > 100), "{kinds:?}");
    assert!(full > 1000 && longest >= 20 && deepest >= 7, "{full} {longest} {deepest}");
    assert!(sum_tops > 100 && layer_tops > 100 && weighted_layers > 100, "{sum_tops} {layer_tops} {weighted_layers}");
}

/// Lobe by lobe as a walk meets them: its kind, its parameters and its weight.
fn written_out(tree: &ClosureTree) -> Vec<String> {
    let wo = V3::new(0.36f64, 0.48, 0.8);
    let curves = Default::default();
    let bsdf = flatten::<f64>(tree, &Globals::default(), wo, Default::default(), &curves).expect("a small tree");
    let mut lobes: Vec<String> = tree.lobes().map(|(_, kind, values)| format!("{kind:?} {values:?}")).collect();
    lobes.sort();
    lobes.push(format!("{:?} {:?}", bsdf.lobe_count(), bsdf.emission()));
    lobes
}

#[test]
fn a_tree_is_what_its_script_builds() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let mut varying = 0;
    for round in 0..300 {
        let pool = Pool::random(&mut rng);
        let tree = pool.tree(&mut rng).tree();
        let text = script(&tree, |site, slot| round % 2 == 0 && pool.varies(site, slot));
        varying += u32::from(text.contains(" + u"));
        let (checked, warnings) = overcoat::ir::compile("tree", &text).unwrap_or_else(|e| panic!("{e:?}\n{text}"));
        // Lobes that stand in for what the renderer is to do say so.
        assert!(warnings.iter().all(|w| w.code == "W0507"), "{warnings:?}\n{text}");
        let program = checked.specialise(&[]).expect("no parameters");
        let mut again = ClosureTree::new();
        program.shade(&Globals::default(), &mut again).expect("a small tree");
        // Dead closures are gone from the program; a weight of zero makes them so.
        let alive = |t: &ClosureTree| t.size(t.root());
        assert_eq!(alive(&tree).lobes, alive(&again).lobes, "{text}");
        assert_eq!(alive(&tree).layers, alive(&again).layers, "{text}");
        if tree.lobes().count() as u32 == alive(&tree).lobes {
            assert_eq!(written_out(&tree), written_out(&again), "{text}");
        }
    }
    assert!(varying > 50, "{varying}");
}

fn white_stack() -> Stack<f32> {
    let mut tree = ClosureTree::new();
    let (top, base) =
        (lobe(&mut tree, LobeKind::Sheen, &[("roughness", 0.5)]), lobe(&mut tree, LobeKind::Diffuse, &[]));
    let through = lobe(&mut tree, LobeKind::Transparent, &[]);
    let (base, through) = (tree.mul([0.7, 0.5, 0.2], base), tree.mul([0.3; 3], through));
    let base = tree.add(base, through);
    let root = tree.layer(top, base);
    tree.set_root(root);
    Stack::new(tree, Precision::STANDARD)
}

#[test]
fn estimates_agree_with_quadrature() {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let stack = white_stack();
    let mut off = 0.0f64;
    for side in [Side::View, Side::Light] {
        for cos in [1.0, 0.6, 0.2, 0.03, -0.5] {
            let exact = albedo(&|w| stack.bsdf(w), side, at(cos), Tolerance::default());
            for _ in 0..20 {
                let e = estimate(&|w| stack.bsdf(w), side, at(cos), 1, &mut rng);
                assert!(e.agrees(exact.value, 1e-4, 5.0), "{side:?} {cos}: {e:?} {exact:?}");
                assert!(e.sigma[0] < 0.03, "{side:?} {cos}: {e:?}");
                off = off.max((e.value[0] - exact.value[0]).abs() / (e.sigma[0] + 1e-6));
            }
        }
    }
    // The deviations are not merely large.
    assert!(off > 1.0, "{off}");
}

#[test]
fn what_gains_is_found() {
    // Under `view`, a sheen over white gains toward the light; measured as a campaign would.
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut tree = ClosureTree::new();
    let (top, base) = (
        lobe(&mut tree, LobeKind::Sheen, &[("roughness", 1.0), ("softening", 0.0)]),
        lobe(&mut tree, LobeKind::Diffuse, &[]),
    );
    let root = tree.layer(top, base);
    tree.set_root(root);
    let mut stack = Stack::<f32>::new(tree, Precision::STANDARD);
    stack.layering.rule = LayeringRule::View;
    let rough = estimate(&|w| stack.bsdf(w), Side::Light, at(0.05), 1, &mut rng);
    assert!(rough.may_reach_one(4.0), "{rough:?}");
    let e = albedo(&|w| stack.bsdf(w), Side::Light, at(0.05), Tolerance::default());
    assert!(e.max() > 1.1 && rough.agrees(e.value, e.error, 5.0), "{e:?} {rough:?}");
}

#[test]
fn narrow_threads_are_integrated_to_five_digits() {
    // The most reflecting direction, across the thread: the constant is chosen so that E = 1.
    for n in [1.0, 30.0, 400.0, 1000.0] {
        let mut tree = ClosureTree::new();
        let root = lobe(&mut tree, LobeKind::Fabric, &[("exponent", n)]);
        tree.set_root(root);
        let stack = Stack::<f64>::new(tree, Precision::STANDARD);
        for side in [Side::View, Side::Light] {
            let e = albedo(&|w| stack.bsdf(w), side, [0.0, 0.6, 0.8], Tolerance::default());
            assert!((e.max() - 1.0).abs() < 2e-5 && e.error <= 1e-5, "n {n} {side:?}: {e:?}");
        }
    }
}

#[test]
fn light_is_accounted_for() {
    let mut tree = white_stack().tree;
    let inner = tree.root();
    let outer = lobe(&mut tree, LobeKind::Velvet, &[("roughness", 0.4)]);
    let outer = tree.mul([0.9, 0.3, 0.0], outer);
    let layered = tree.layer(outer, inner);
    let (half, rest) = (tree.mul([0.5, 0.25, 0.5], layered), lobe(&mut tree, LobeKind::Eon, &[("albedo", 0.6)]));
    let rest = tree.mul([0.3; 3], rest);
    let root = tree.add(half, rest);
    tree.set_root(root);
    let mut stack = Stack::<f64>::new(tree, Precision::STANDARD);
    for (tint, rule) in [
        (TintRule::Largest, LayeringRule::Min),
        (TintRule::Channel, LayeringRule::Min),
        (TintRule::Largest, LayeringRule::View),
    ] {
        stack.layering.tint = tint;
        stack.layering.rule = rule;
        for cos in [0.9, 0.3, 0.04, -0.4] {
            let wo = at::<f64>(cos);
            let part = |tree: &ClosureTree| {
                let w = V3::new(wo[0], wo[1], wo[2]);
                let bsdf = |_| -> Bsdf<'_, f64> {
                    flatten(tree, &Globals::default(), w, stack.layering, &stack.curves).expect("a small tree")
                };
                albedo(&bsdf, Side::View, wo, Tolerance::default()).value
            };
            let shares = breakdown(&|w| stack.bsdf(w), wo, Tolerance::default());
            let ledger = ledger(&stack.tree, part, stack.layering);
            let place = format!("{tint:?} {rule:?} {cos}: {ledger:?}");
            assert_eq!(ledger.layers.len(), 2, "{place}");
            for c in 0..3 {
                let scattered: f64 = shares.iter().map(|s| s.scattered.value[c]).sum();
                let withheld: f64 = ledger.layers.iter().map(|l| l.tint[c] + l.lost[c]).sum();
                let absorbed = ledger.absorbed_by_weights[c] + ledger.absorbed_by_lobes[c];
                let sum = scattered + withheld + absorbed;
                assert!((sum - 1.0).abs() < 1e-4, "{sum} {place}");
                for l in &ledger.layers {
                    assert!(l.lost[c] > -2e-5 && l.tint[c] > -1e-9 && l.taken[c] <= l.offered[c] + 1e-6, "{place}");
                    assert!(tint == TintRule::Largest || l.tint[c].abs() < 1e-9, "{place}");
                    // `view` passes all of 1 − E, up to the slack of its bound.
                    assert!(rule == LayeringRule::Min || l.lost[c] < 2e-3, "{place}");
                }
            }
            // White outside the layers, 0.5 and 0.3 of it spent.
            assert!(ledger.absorbed_by_weights[0] >= 0.2 - 1e-6, "{place}");
        }
    }
}

#[test]
fn a_gain_names_what_was_set() {
    let source = "surface gain(float u_part = 0, string note = \"x\")
        { Ci = (0.5 + u * u_part) * diffuse(N) + 0.4 * sheen(N, 0.5); }";
    let shader = Engine::new().compile("gain", source).expect("compiles");
    let material = |part: f32| {
        let set = [("u_part".to_owned(), overcoat::ir::Value::Float(part))];
        shader.material(&set).expect("specialises")
    };
    overcoat::audit::assert_no_gain(&material(0.0)).expect("keeps to 0.9");
    let gain = overcoat::audit::assert_no_gain(&material(0.9)).expect_err("gains where u is large");
    let text = gain.to_string();
    assert!(text.contains("`gain` with u_part=0.9 gains energy on the view side"), "{text}");
    assert!(gain.globals.u > 0.1 && gain.albedo.max() > 1.0001 && text.contains("at u "), "{text}");
    for tier in [Tier::Fast, Tier::Reference] {
        let engine = Engine::new().tier(tier).layering(LayeringRule::View);
        let material = engine.compile("s", "Ci = sheen(diffuse(N), N, 1, 0.6);").expect("compiles").material(&[]);
        overcoat::audit::assert_no_gain(&material.expect("specialises")).expect("view keeps its side");
    }
}
