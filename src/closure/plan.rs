//! What of a BSDF does not depend on ωo, made once for a tree that is the same at every point.
//!
//! Where a program always makes the same tree, only directions among its parameters differ. Its walk is then the same
//! too: lobes, weights, layers, which lobes share a frame. All that is looked at once, on a BSDF that was flattened as any
//! other, and [`Plan::turn`] does what is left to do at a point, giving the same bits. For trees that [`FlatStack`] walks, with
//! nothing solved for.

use super::bsdf::{Bsdf, FlatLobe, LayerAlpha, Op};
use super::flatten::{Curves, Layering};
use super::layer::{FlatStack, LayeringRule, TintRule, step};
use crate::globals::Globals;
use crate::lobes::{AnyLobe, LobeKind, Rgb};
use crate::optics::{Frame, Scalar, V3, frame};
use glam::Vec3;

/// Where a direction comes from.
#[derive(Clone, Copy, Debug)]
pub enum Direction {
    /// It is always this.
    Fixed(Vec3),
    /// [`Globals::n`].
    Normal,
    /// [`Globals::ng`].
    Geometric,
    /// [`Globals::dpdu`].
    AlongU,
    /// [`Globals::dpdv`].
    AlongV,
    /// [`Globals::p`].
    Position,
}

impl Direction {
    #[inline(always)]
    fn at(self, globals: &Globals) -> Vec3 {
        match self {
            Direction::Fixed(v) => v,
            Direction::Normal => globals.n,
            Direction::Geometric => globals.ng,
            Direction::AlongU => globals.dpdu,
            Direction::AlongV => globals.dpdv,
            Direction::Position => globals.p,
        }
    }
}

/// What a frame is made of.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    /// The normal.
    pub normal: Direction,
    /// The tangent.
    pub tangent: Direction,
    /// Whether N is turned to the outside: see [`LobeKind::between_media`].
    pub between_media: bool,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Plan<S> {
    layering: Layering,
    depth: u16,
    /// In the order in which lobes first ask for them.
    frames: Vec<Axes>,
    lobes: Vec<Planned<S>>,
    /// Weights of the layers, relative to the tops they stand in.
    layers: Vec<Rgb<S>>,
    ops: Vec<Op>,
}

/// A lobe of a [`Plan`].
#[derive(Clone, Copy, Debug)]
struct Planned<S> {
    kind: LobeKind,
    site: u32,
    frame: u32,
    steps: u8,
    /// It stands in a top.
    inside: bool,
    delta: bool,
    /// From the root; the fourth is idle.
    weight: [S; 4],
    weight_in_top: [S; 4],
}

impl<S: Scalar> Plan<S> {
    /// The plan of a tree that was flattened to `bsdf` where no two directions coincide by chance; `axes` knows where those of
    /// a site come from. `None` if it is not of the kind this is for.
    pub(crate) fn of(bsdf: &Bsdf<'_, S>, curves: &Curves<S>, axes: impl Fn(u32) -> Option<Axes>) -> Option<Plan<S>> {
        let dark = bsdf.emission.iter().all(|e| *e <= S::zero()) && bsdf.signals.is_empty();
        let middles = bsdf.lobes.iter().filter(|l| l.steps & step::MIDDLE != 0).count();
        if !bsdf.is_flat() || !dark || middles != bsdf.layers.len() {
            return None;
        }
        let mut frames = Vec::new();
        let mut planned = |l: &FlatLobe<'_, S>| {
            let axes = axes(l.site)?;
            if l.frame as usize == frames.len() {
                frames.push(axes);
            }
            // Turned from what is known of its site: all its parameters but directions.
            curves.at(l.site).1?;
            let kind = l.lobe.kind();
            let (weight, weight_in_top) = (l.share, l.weight_in_top);
            let (inside, delta) = (l.inside, l.delta);
            Some(Planned { kind, site: l.site, frame: l.frame, steps: l.steps, inside, delta, weight, weight_in_top })
        };
        let lobes = bsdf.lobes.iter().map(&mut planned).collect::<Option<Vec<_>>>()?;
        let layers = bsdf.layers.iter().map(|l| l.weight).collect();
        let (layering, depth, ops) = (bsdf.layering, bsdf.depth, bsdf.ops().to_vec());
        (frames.len() == bsdf.frames.len()).then_some(Plan { layering, depth, frames, lobes, layers, ops })
    }

    /// The BSDF at a point, seen from `wo` (world space, any length), into memory that is used again.
    pub(crate) fn turn<'m>(&'m self, globals: &Globals, wo: V3<S>, curves: &'m Curves<S>, bsdf: &mut Bsdf<'m, S>) {
        let zero = V3::new(S::zero(), S::zero(), S::zero());
        let vector = |v: Vec3| V3::from_f32(v.to_array());
        let wo = frame::normalize(wo).unwrap_or(zero);
        let ng = frame::normalize(vector(globals.ng)).unwrap_or(zero);
        bsdf.reset(wo, ng, self.layering, self.depth);
        bsdf.planned_ops = &self.ops;
        for axes in &self.frames {
            let n = axes.normal.at(globals);
            let n = if globals.backfacing && axes.between_media { -n } else { n };
            let t = axes.tangent.at(globals);
            bsdf.frames.push(Frame::new(vector(n), vector(globals.ng), vector(t), vector(globals.dpdu)));
        }
        let view = self.layering.rule == LayeringRule::View;
        let mut layers = self.layers.iter();
        let mut stack = FlatStack::<S>::default();
        let (mut frame, mut local, mut alpha_o) = (u32::MAX, wo, S::one());
        for p in &self.lobes {
            if p.frame != frame {
                frame = p.frame;
                local = bsdf.frames[frame as usize].to_local(wo);
            }
            if p.steps & step::MIDDLE != 0
                && let Some(weight) = layers.next()
            {
                alpha_o = stack.alpha();
                bsdf.layers.push(LayerAlpha { alpha_o: [alpha_o; 3], weight: *weight });
            }
            let scale = stack.step(p.steps, self.layering.rule, alpha_o);
            let (curve, site) = curves.at(p.site);
            bsdf.lobes.push(FlatLobe {
                share: p.weight,
                lobe: AnyLobe::nothing(),
                curve,
                site: p.site,
                frame,
                weight_in_top: p.weight_in_top,
                alpha_o,
                steps: p.steps,
                inside: p.inside,
                in_top: p.inside && !view,
                delta: p.delta,
                albedo: [S::zero(); 3],
            });
            let (Some(l), Some(site)) = (bsdf.lobes.last_mut(), site) else { return };
            // Made where it stays, because there is room for the largest.
            if !site.turn(local, curve, &mut l.lobe) {
                l.lobe = AnyLobe::new(p.kind, site.values(), local, curve);
            }
            let bound = l.weigh(local, [scale; 3]);
            if p.inside {
                stack.lobe(p.weight_in_top, bound);
            }
        }
        bsdf.finish();
    }
}

/// Whether a layering is one that plans are for.
pub(crate) fn plans(layering: Layering) -> bool {
    layering.tint == TintRule::Largest && layering.rule != LayeringRule::Balanced
}
