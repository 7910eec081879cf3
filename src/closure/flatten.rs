//! From a tree and one ωo to the list a `Bsdf` walks.
//!
//! One pass, top before base, over an explicit stack. Every lobe is prepared once; lobes that share a normal and a
//! tangent share a frame.

use super::bsdf::{Bsdf, FlatLobe, LayerAlpha, Op};
use super::layer::{LayerStack, LayeringRule, TintRule};
use super::tree::{ClosureTree, MAX_LAYERS, Node, NodeId, TreeError};
use crate::albedo::{AlbedoCurve, Precision, TableSpec};
use crate::globals::Globals;
use crate::lobes::registry::LobeClass;
use crate::lobes::{AnyLobe, LobeKind, Rgb};
use crate::optics::{Frame, Scalar, V3, frame};
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

    fn of(&self, site: u32) -> &AlbedoCurve<S> {
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

/// Weights along the way from the root to a node.
#[derive(Clone, Copy)]
struct Weights<S> {
    /// From the root.
    total: Rgb<S>,
    /// From the root of the innermost top the node stands in.
    in_top: Rgb<S>,
    /// Whether it stands in a top at all.
    inside: bool,
}

enum Step<S> {
    Visit(NodeId, Weights<S>),
    Middle(Weights<S>),
    End,
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
    curves: &'m Curves<S>,
) -> Result<Bsdf<'m, S>, TreeError> {
    tree.within_budget()?;
    let layers = tree.size(tree.root()).layers;
    let zero = V3::new(S::zero(), S::zero(), S::zero());
    let ng = frame::normalize(V3::from_f32(globals.ng.to_array()));
    // Written in place: a BSDF with room for eight lobes is too large to pass around.
    let mut bsdf = Bsdf::empty(frame::normalize(wo).unwrap_or(zero), ng.unwrap_or(zero), layering, layers);
    match layers {
        0..=4 => Flattener::<S, 4>::new(tree, globals, curves, &mut bsdf).walk(),
        _ => Flattener::<S, { MAX_LAYERS as usize }>::new(tree, globals, curves, &mut bsdf).walk(),
    }
    bsdf.finish();
    Ok(bsdf)
}

struct Flattener<'t, 'b, 'm, S: Scalar, const D: usize> {
    tree: &'t ClosureTree,
    globals: &'t Globals,
    curves: &'m Curves<S>,
    bsdf: &'b mut Bsdf<'m, S>,
    /// The walk for ωo, made while flattening.
    stack: LayerStack<S, D>,
    /// Normal and tangent as the tree gave them, per frame.
    frame_keys: SmallVec<[(Vec3, Vec3); 8]>,
}

impl<'t, 'b, 'm, S: Scalar, const D: usize> Flattener<'t, 'b, 'm, S, D> {
    fn new(tree: &'t ClosureTree, globals: &'t Globals, curves: &'m Curves<S>, bsdf: &'b mut Bsdf<'m, S>) -> Self {
        Flattener { tree, globals, curves, bsdf, stack: LayerStack::default(), frame_keys: SmallVec::new() }
    }

    fn walk(&mut self) {
        let one = [S::one(); 3];
        let mut steps: SmallVec<[Step<S>; 24]> = SmallVec::new();
        steps.push(Step::Visit(self.tree.root(), Weights { total: one, in_top: one, inside: false }));
        while let Some(step) = steps.pop() {
            match step {
                Step::Visit(id, w) => match self.tree.node(id) {
                    Node::Zero => {}
                    Node::Add(a, b) => {
                        steps.push(Step::Visit(b, w));
                        steps.push(Step::Visit(a, w));
                    }
                    Node::Mul(weight, c) => steps.push(Step::Visit(c, w.times(weight.map(S::from_f32)))),
                    Node::Layer { top, base } => {
                        steps.push(Step::End);
                        steps.push(Step::Visit(base, w));
                        steps.push(Step::Middle(w));
                        steps.push(Step::Visit(top, Weights { in_top: one, inside: true, ..w }));
                        self.stack.begin();
                        self.bsdf.ops.push(Op::Begin);
                    }
                    Node::Lobe { kind, site, slots } => self.lobe(kind, site, slots, w),
                },
                Step::Middle(w) => {
                    let Layering { rule, tint } = self.bsdf.layering;
                    let alpha = self.stack.middle(w.in_top, rule, tint, None::<Rgb<S>>);
                    self.bsdf.layers.push(LayerAlpha { alpha_o: alpha, weight: w.in_top });
                    self.bsdf.ops.push(Op::Middle);
                }
                Step::End => {
                    self.stack.end();
                    self.bsdf.ops.push(Op::End);
                }
            }
        }
    }

    fn lobe(&mut self, kind: LobeKind, site: u32, slots: u32, w: Weights<S>) {
        let values = self.tree.values(kind, slots);
        let w = w.times(kind.weight(values).map(S::from_f32));
        if w.total.iter().all(|w| *w <= S::zero()) && !w.inside {
            return;
        }
        let frame = self.frame(kind, values);
        let curve = self.curves.of(site);
        let wo = self.bsdf.frames[frame as usize].to_local(self.bsdf.wo);
        let lobe = AnyLobe::new(kind, values, wo, curve);
        let scale = self.stack.scale();
        if let AnyLobe::Emission(emission) = lobe {
            for c in 0..3 {
                self.bsdf.emission[c] += w.total[c] * scale[c] * emission.radiance();
            }
            return;
        }
        let albedo = lobe.albedo(wo, curve);
        let share: Rgb<S> = std::array::from_fn(|c| w.total[c] * scale[c] * albedo[c]);
        // Under `view` α is 1 − E_view(ωo), so the walk for ωo sums bounds on that side alone.
        match self.bsdf.layering.rule {
            LayeringRule::View => self.stack.lobe(w.in_top, lobe.view_bound(wo, curve)),
            LayeringRule::Min => self.stack.lobe(w.in_top, lobe.albedo_bound(wo, curve)),
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
            in_top: w.inside && self.bsdf.layering.rule == LayeringRule::Min,
            delta: kind.class() == LobeClass::Delta,
            albedo: share,
            probability: S::zero(),
        });
        self.bsdf.ops.push(Op::Lobe);
    }

    /// The frame of a lobe: its own normal and tangent, or the shading point's.
    fn frame(&mut self, kind: LobeKind, values: &[f32]) -> u32 {
        let spec = kind.spec();
        let vector = |slot: Option<usize>, default: Vec3| {
            slot.and_then(|s| values.get(s..s + 3)).map_or(default, Vec3::from_slice)
        };
        let g = self.globals;
        let (n, t) = (vector(spec.normal_slot(), g.n), vector(spec.tangent_slot(), g.dpdu));
        let same = |a: Vec3, b: Vec3| a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits);
        if let Some(i) = self.frame_keys.iter().position(|k| same(k.0, n) && same(k.1, t)) {
            return i as u32;
        }
        let v = |v: Vec3| V3::from_f32(v.to_array());
        self.frame_keys.push((n, t));
        self.bsdf.frames.push(Frame::new(v(n), v(g.ng), v(t), v(g.dpdu)));
        self.frame_keys.len() as u32 - 1
    }
}

impl<S: Scalar> Weights<S> {
    /// Products of weights stay below the largest weight, as each of them does.
    fn times(self, weight: Rgb<S>) -> Self {
        let limit = S::c(super::tree::MAX_WEIGHT as f64);
        let product = |a: Rgb<S>| std::array::from_fn(|c| (a[c] * weight[c]).min(limit));
        Weights { total: product(self.total), in_top: product(self.in_top), inside: self.inside }
    }
}
