//! What is computed once per material: tables, solved scales, and the list of a constant tree.

use crate::Globals;
use crate::albedo::Precision;
use crate::closure::balance::Construction;
use crate::closure::plan::{self, Axes, Direction, Plan};
use crate::closure::{Balance, Balancer, ClosureTree, Curves, Layering, LayeringRule, TableCache, TintRule, flatten};
use crate::ir::{GlobalVar, Program};
use crate::lobes::registry::LobeClass;
use crate::optics::{Scalar, V3};
use glam::Vec3;

/// What is computed once per material.
#[derive(Debug)]
pub(super) struct Baked<S: Scalar> {
    pub curves: Curves<S>,
    pub balance: Option<Balance<S>>,
    /// Of a constant tree.
    pub plan: Option<Plan<S>>,
    pub precision: Precision,
}

impl<S: Scalar> Baked<S> {
    pub fn new(program: &Program, layering: Layering, precision: Precision, cache: &TableCache<S>) -> Self {
        let mut curves = Curves::default();
        for (index, site) in program.sites().iter().enumerate() {
            curves.prepare(index as u32, site.kind, &site.values, precision, cache);
        }
        let balanced = layering.rule == LayeringRule::Balanced;
        let balance = balanced.then(|| balance(program, layering.tint, &curves, precision));
        let plan = planned(program, layering, &curves);
        Baked { curves, balance, plan, precision }
    }

    pub fn bytes(&self) -> usize {
        self.curves.bytes() + self.balance.as_ref().map_or(0, Balance::bytes)
    }
}

/// The plan of a constant program, if its tree has one.
fn planned<S: Scalar>(program: &Program, layering: Layering, curves: &Curves<S>) -> Option<Plan<S>> {
    let kept = program.kept()?.as_ref().ok()?;
    let emits = kept.tree().lobes().any(|(_, kind, _)| kind.class() == LobeClass::Emission);
    if emits || !plan::plans(layering) {
        return None;
    }
    // Seen from the back, lobes between media turn N: they share a frame with others only where they always do.
    let globals = Globals { backfacing: true, ..Globals::apart() };
    let mut tree = ClosureTree::new();
    kept.give(&globals, &mut tree);
    let bsdf = flatten(&tree, &globals, V3::from_f32(globals.n.to_array()), layering, curves).ok()?;
    Plan::of(&bsdf, curves, |site| {
        let (_, kind, values) = kept.tree().lobes().find(|l| l.0 == site)?;
        let direction = |slot: Option<usize>, default: Direction| {
            let Some(slot) = slot else { return Some(default) };
            match kept.source(site, slot) {
                Some(GlobalVar::P) => Some(Direction::Position),
                Some(GlobalVar::N) => Some(Direction::Normal),
                Some(GlobalVar::Ng) => Some(Direction::Geometric),
                Some(GlobalVar::DPdu) => Some(Direction::AlongU),
                Some(GlobalVar::DPdv) => Some(Direction::AlongV),
                // What depends on the viewer.
                Some(_) => None,
                None => Some(Direction::Fixed(Vec3::from_slice(values.get(slot..slot + 3)?))),
            }
        };
        let spec = kind.spec();
        Some(Axes {
            normal: direction(spec.normal_slot(), Direction::Normal)?,
            tangent: direction(spec.tangent_slot(), Direction::AlongU)?,
            between_media: kind.between_media(values),
        })
    })
}

/// Solves for the scales of the `balanced` rule.
fn balance<S: Scalar>(program: &Program, tint: TintRule, curves: &Curves<S>, precision: Precision) -> Balance<S> {
    let balancer = Balancer::new(precision);
    if program.is_constant() {
        let globals = Globals::apart();
        let mut tree = ClosureTree::new();
        // A tree beyond a budget is black here, and an error wherever it is shaded.
        let _ = program.shade(&globals, &mut tree);
        return balancer.solve(&tree, &globals, tint, curves);
    }
    // Where the view changes the tree no scale is symmetric.
    let pairs = if program.globals().contains(&GlobalVar::I) { &[] } else { program.layer_pairs() };
    let sites = program.sites();
    let sites: Vec<_> = sites.iter().map(|s| Construction { kind: s.kind, values: &s.values }).collect();
    balancer.solve_pairs(&sites, pairs, tint, curves)
}

#[cfg(all(test, feature = "cloth", feature = "microfacet", feature = "legacy"))]
mod tests {
    use super::*;
    use crate::engine::{Engine, Material};
    use crate::optics::{Frame, frame};

    /// What the plan of a material turns to, and the same tree flattened as any other.
    fn both_ways(material: &Material, globals: &Globals, wo: Vec3) {
        let at = Globals { i: -wo, ..*globals };
        let tree = material.tree(&at).expect("small");
        let (turned, flattened) =
            (material.shade(globals, wo).expect("small"), material.bsdf(&tree, &at).expect("small"));
        let up = frame::normalize(V3::from_f32(globals.n.to_array())).unwrap_or(V3::new(0.0, 0.0, 1.0));
        let around = Frame::new(up, up, V3::new(1.0f32, 0.0, 0.0), V3::new(0.0, 1.0, 0.0));
        assert_eq!(turned.albedo(), flattened.albedo(), "{} from {wo}", material.name());
        assert_eq!(turned.lobe_count(), flattened.lobe_count());
        for (k, cos) in [0.95f32, 0.4, 0.02, -0.6].into_iter().enumerate() {
            let w = around.to_world(V3::polar(cos, 2.0 * k as f32));
            let w = [w.x, w.y, w.z];
            assert_eq!(turned.eval(w), flattened.eval(w), "{} from {wo}", material.name());
            assert_eq!(turned.albedo_bound(w), flattened.albedo_bound(w), "{} from {wo}", material.name());
            assert_eq!(turned.eval_adjoint(w), flattened.eval_adjoint(w), "{} from {wo}", material.name());
            let u = [0.1 + 0.2 * k as f32, 0.7, 0.9 - 0.3 * k as f32];
            assert_eq!(turned.sample(u), flattened.sample(u), "{} from {wo}", material.name());
        }
    }

    #[test]
    fn a_planned_tree_is_what_flattening_makes_of_it() {
        let scripts = [
            ("Ci = 0.7 * diffuse(N); Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.4);", true),
            (
                "Ci = sheen(0.2 * diffuse(N) + 0.3 * translucent(N) + 0 * phong(N, 20), N, 0.4, 0.3) + 0.1 * velvet(N, 0.4);",
                true,
            ),
            (
                "Ci = layer(dielectric_bsdf(N, dPdu, 1, 0, 0.3, 0.3, 1.5, \"ggx\"), oren_nayar(N, 0.2)); Ci = sheen(Ci, N, 0.7, 0.5);",
                true,
            ),
            ("Ci = 0.5 * diffuse(Ng) + 0.5 * fabric(normal(0, 0.6, 0.8), dPdv, 0.3);", true),
            ("Ci = dielectric_bsdf(N, dPdu, 1, 1, 0.2, 0.2, 1.5, \"ggx\");", true),
            ("Ci = layer(reflection(N, 1.5), diffuse(N));", true),
            ("Ci = 0;", true),
            ("Ci = emission() + diffuse(N);", false),
            ("Ci = layer(layer(sheen(N, 0.3), 0.5 * diffuse(N)), diffuse(N));", false),
            ("Ci = u * diffuse(N);", false),
        ];
        for (script, planned) in scripts {
            for rule in [LayeringRule::Min, LayeringRule::View] {
                let engine = Engine::new().layering(rule);
                let material = engine.material(script, script).expect(script);
                assert_eq!(material.inner.tables.plan.is_some(), planned, "{script}");
                for (n, backfacing) in [(Vec3::Z, false), (Vec3::new(0.3, -0.4, 0.5), true), (Vec3::ZERO, false)] {
                    let globals = Globals { n, ng: Vec3::new(0.1, 0.0, 1.0), backfacing, u: 0.4, ..Globals::default() };
                    for wo in
                        [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 3.0, 0.1), Vec3::new(0.2, 0.3, -0.9), Vec3::ZERO]
                    {
                        both_ways(&material, &globals, wo);
                    }
                }
            }
        }
    }
}
