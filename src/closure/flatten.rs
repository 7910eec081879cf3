//! From a tree and one ωo to the list a `Bsdf` walks.
//!
//! One pass, top before base, over an explicit stack. Every lobe is prepared once; lobes that share a normal and a
//! tangent share a frame.

use super::balance::{Balance, Chain};
use super::bsdf::{Bsdf, FlatLobe, LayerAlpha, Op};
use super::layer::{LayerStack, LayeringRule, TintRule};
use super::tree::{ClosureTree, MAX_LAYERS, TreeError};
use super::walk::{self, LobeVisit, Visitor, Weights, directions, walk};
use crate::albedo::{AlbedoCurve, Precision, TableSpec};
use crate::globals::Globals;
use crate::lobes::registry::LobeClass;
use crate::lobes::signals::SignalKind;
use crate::lobes::{AnyLobe, LobeKind, Rgb};
use crate::optics::{Scalar, V3, frame};
use glam::Vec3;
use smallvec::SmallVec;

/// The albedo curves of a material, found by the site that constructs the lobe.
#[derive(Clone, Debug, Default)]
pub struct Curves<S: Scalar> {
    baked: Vec<(TableSpec, AlbedoCurve<S>)>,
    /// Index into `baked` per site.
    sites: Vec<Option<u32>>,
    none: AlbedoCurve<S>,
}

impl<S: Scalar> Curves<S> {
    /// Bakes what the lobes of `tree` need, for a tree that is built in code and does not change.
    pub fn for_tree(tree: &ClosureTree, precision: Precision) -> Self {
        let mut curves = Curves::default();
        for (site, kind, values) in tree.lobes() {
            let known: Vec<Option<f32>> = values.iter().map(|v| Some(*v)).collect();
            curves.set(site, kind.table(&known), precision);
        }
        curves
    }

    /// The same tables in double precision.
    pub fn in_double(&self) -> Curves<f64> {
        Curves {
            baked: self.baked.iter().map(|(spec, curve)| (*spec, curve.in_double())).collect(),
            sites: self.sites.clone(),
            none: AlbedoCurve::default(),
        }
    }

    /// Bakes the curve of one construction site; sites that ask for the same curve share it.
    pub fn set(&mut self, site: u32, spec: Option<TableSpec>, precision: Precision) {
        let Some(spec) = spec else { return };
        let index = match self.baked.iter().position(|(s, _)| *s == spec) {
            Some(i) => i,
            None => {
                self.baked.push((spec, spec.bake(precision)));
                self.baked.len() - 1
            }
        };
        if self.sites.len() <= site as usize {
            self.sites.resize(site as usize + 1, None);
        }
        self.sites[site as usize] = Some(index as u32);
    }

    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        self.baked.iter().map(|(_, c)| c.bytes()).sum()
    }

    pub(super) fn of(&self, site: u32) -> &AlbedoCurve<S> {
        match self.sites.get(site as usize) {
            Some(Some(index)) => &self.baked[*index as usize].1,
            _ => &self.none,
        }
    }
}

/// How layers scale: chosen per material, not per shading point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Layering {
    /// How a layer scales its base.
    pub rule: LayeringRule,
    /// Which channels of a top's albedo it answers to.
    pub tint: TintRule,
}

/// The tables of a material that flattening reads.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'m, S: Scalar> {
    /// Albedos by site.
    pub curves: &'m Curves<S>,
    /// Solved scales for [`LayeringRule::Balanced`]; without them that rule is [`LayeringRule::Min`].
    pub balance: Option<&'m Balance<S>>,
}

impl<'m, S: Scalar> From<&'m Curves<S>> for Tables<'m, S> {
    fn from(curves: &'m Curves<S>) -> Self {
        Tables { curves, balance: None }
    }
}

/// Builds the BSDF of `tree` for the direction `wo` (world space; any length).
///
/// # Errors
/// If the tree is beyond [`MAX_LAYERS`] or [`super::tree::MAX_LOBES`].
pub fn flatten<'m, S: Scalar>(
    tree: &ClosureTree,
    globals: &Globals,
    wo: V3<S>,
    layering: Layering,
    tables: impl Into<Tables<'m, S>>,
) -> Result<Bsdf<'m, S>, TreeError> {
    tree.within_budget()?;
    let layers = tree.size(tree.root()).layers;
    let zero = V3::new(S::zero(), S::zero(), S::zero());
    let ng = frame::normalize(V3::from_f32(globals.ng.to_array()));
    // Written in place: a BSDF with room for eight lobes is too large to pass around.
    let mut bsdf = Bsdf::empty(frame::normalize(wo).unwrap_or(zero), ng.unwrap_or(zero), layering, layers);
    let tables = tables.into();
    match layers {
        0..=4 => walk(tree, &mut Flattener::<S, 4>::new(globals, tables, &mut bsdf)),
        _ => walk(tree, &mut Flattener::<S, { MAX_LAYERS as usize }>::new(globals, tables, &mut bsdf)),
    }
    bsdf.finish();
    Ok(bsdf)
}

struct Flattener<'b, 'm, S: Scalar, const D: usize> {
    globals: &'b Globals,
    curves: &'m Curves<S>,
    balance: Option<&'m Balance<S>>,
    bsdf: &'b mut Bsdf<'m, S>,
    /// The walk for ωo, made while flattening.
    stack: LayerStack<S, D>,
    /// What lies above, for balancing.
    chain: Chain<S>,
    /// Lobes met so far, whether they count or not.
    met: usize,
    /// Normal and tangent as the tree gave them, per frame.
    frame_keys: SmallVec<[(Vec3, Vec3); 8]>,
}

impl<'b, 'm, S: Scalar, const D: usize> Flattener<'b, 'm, S, D> {
    fn new(globals: &'b Globals, tables: Tables<'m, S>, bsdf: &'b mut Bsdf<'m, S>) -> Self {
        let balance = tables.balance.filter(|_| bsdf.layering.rule == LayeringRule::Balanced);
        let (stack, chain) = (LayerStack::default(), Chain::default());
        let frame_keys = SmallVec::new();
        Flattener { globals, curves: tables.curves, balance, bsdf, stack, chain, met: 0, frame_keys }
    }

    fn chained(&mut self, f: impl FnOnce(&mut Chain<S>)) {
        if self.balance.is_some_and(Balance::needs_chain) {
            f(&mut self.chain);
        }
    }

    /// The frame of a lobe.
    fn frame(&mut self, kind: LobeKind, values: &[f32]) -> u32 {
        let (n, t) = directions(kind, values, self.globals);
        let same = |a: Vec3, b: Vec3| a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits);
        if let Some(i) = self.frame_keys.iter().position(|k| same(k.0, n) && same(k.1, t)) {
            return i as u32;
        }
        self.frame_keys.push((n, t));
        self.bsdf.frames.push(walk::frame((n, t), self.globals));
        self.frame_keys.len() as u32 - 1
    }
}

impl<S: Scalar, const D: usize> Visitor<S> for Flattener<'_, '_, S, D> {
    fn begin(&mut self) {
        self.stack.begin();
        self.chained(Chain::begin);
        self.bsdf.ops.push(Op::Begin);
    }

    fn middle(&mut self, w: Weights<S>) {
        let Layering { rule, tint } = self.bsdf.layering;
        let alpha = self.stack.middle(w.in_top, rule, tint, None::<Rgb<S>>);
        self.chained(Chain::middle);
        self.bsdf.layers.push(LayerAlpha { alpha_o: alpha, weight: w.in_top });
        self.bsdf.ops.push(Op::Middle);
    }

    fn end(&mut self) {
        self.stack.end();
        self.chained(Chain::end);
        self.bsdf.ops.push(Op::End);
    }

    fn lobe(&mut self, visit: LobeVisit<'_, S>) {
        let LobeVisit { kind, site, values, weights: w } = visit;
        let met = self.met;
        self.met += 1;
        if w.total.iter().all(|w| *w <= S::zero()) && !w.inside {
            return;
        }
        let frame = self.frame(kind, values);
        let curve = self.curves.of(site);
        let normal = self.bsdf.frames[frame as usize].n;
        let wo = self.bsdf.frames[frame as usize].to_local(self.bsdf.wo);
        let lobe = AnyLobe::new(kind, values, wo, curve);
        let scale = self.stack.scale();
        if let AnyLobe::Emission(emission) = lobe {
            for c in 0..3 {
                self.bsdf.emission[c] += w.total[c] * scale[c] * emission.radiance();
            }
            return;
        }
        if let Some(kind) = SignalKind::of(&lobe) {
            self.bsdf.signal(kind, std::array::from_fn(|c| w.total[c] * scale[c]));
            return;
        }
        let albedo = lobe.albedo(wo, curve);
        let share: Rgb<S> = std::array::from_fn(|c| w.total[c] * scale[c] * albedo[c]);
        // Under `view` α is 1 − E_view(ωo), so the walk for ωo sums bounds on that side alone.
        let view = self.bsdf.layering.rule == LayeringRule::View;
        let bound = if view { lobe.view_bound(wo, curve) } else { lobe.albedo_bound(wo, curve) };
        self.stack.lobe(w.in_top, bound);
        let balanced = self.balance.and_then(|b| b.find(met, site, normal, &self.chain, wo.z));
        if let Some(param) = self.balance.map(|b| b.parameter(site, values)) {
            self.chained(|chain| chain.lobe(&visit, normal, param));
        }
        self.bsdf.lobes.push(FlatLobe {
            lobe,
            curve,
            kind,
            site,
            frame,
            cos_o: wo.z.abs().min(S::one()),
            weight: w.total,
            weight_in_top: w.in_top,
            in_top: w.inside && !view,
            delta: kind.class() == LobeClass::Delta,
            albedo: share,
            balanced,
            probability: S::zero(),
        });
        self.bsdf.ops.push(Op::Lobe);
    }
}
