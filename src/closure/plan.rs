//! What of a BSDF does not depend on ωo, made once for a tree that is the same at every point.
//!
//! Where a program always makes the same tree, only directions among its parameters differ. Its walk is then the same
//! too: lobes, weights, layers, which lobes share a frame. All that is looked at once, on a BSDF that was flattened as any
//! other, and [`Plan::turn`] does what is left to do at a point, giving the same bits. For trees that [`FlatStack`] walks, with
//! nothing solved for.

use super::bsdf::{Bsdf, Op};
use super::flatten::{Curves, Layering};
use super::layer::{FlatStack, LayeringRule, TintRule, step};
use super::met::{FlatLobe, Place};
use super::sites::Site;
use crate::albedo::AlbedoCurve;
use crate::globals::Globals;
use crate::lobes::{AimedLobe, AnyLobe, LobeKind, Rgb};
use crate::optics::{F32x8, Frame, Over, Scalar, V3, frame, lifted};
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

impl Axes {
    #[inline(always)]
    fn at<S: Scalar>(&self, globals: &Globals) -> Frame<S> {
        // As most are: without asking for each.
        let usual =
            matches!(self, Axes { normal: Direction::Normal, tangent: Direction::AlongU, between_media: false });
        let (n, t) = if usual { (globals.n, globals.dpdu) } else { self.given(globals) };
        Frame::new(vector(n), vector(globals.ng), vector(t), vector(globals.dpdu))
    }

    /// Normal and tangent, as the tree gives them.
    #[inline(always)]
    fn given(&self, globals: &Globals) -> (Vec3, Vec3) {
        let n = self.normal.at(globals);
        (if globals.backfacing && self.between_media { -n } else { n }, self.tangent.at(globals))
    }
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Plan<S> {
    layering: Layering,
    depth: u16,
    /// In the order in which lobes first ask for them.
    frames: Vec<Axes>,
    /// What each lobe is, and its weight from the root; the fourth is idle.
    lobes: Vec<(LobeKind, [S; 4])>,
    places: Vec<Place<S>>,
    /// Weights of the layers, relative to the tops they stand in.
    layers: Vec<Rgb<S>>,
    ops: Vec<Op>,
}

impl<S: Scalar> Plan<S> {
    /// The tree written out.
    #[inline(always)]
    pub(super) fn ops(&self) -> &[Op] {
        &self.ops
    }

    /// Where each lobe stands.
    #[inline(always)]
    pub(super) fn places(&self) -> &[Place<S>] {
        &self.places
    }

    /// The weight of a layer, relative to the top it stands in.
    pub(super) fn layer_weight(&self, index: usize) -> Rgb<S> {
        self.layers[index]
    }

    /// The plan of a tree that was flattened to `bsdf` where no two directions coincide by chance; `axes` knows where those of
    /// a site come from. `None` if it is not of the kind this is for.
    pub(crate) fn of(bsdf: &Bsdf<'_, S>, curves: &Curves<S>, axes: impl Fn(u32) -> Option<Axes>) -> Option<Plan<S>> {
        let signals = !bsdf.signals.is_empty() || bsdf.emission.iter().any(|e| *e > S::zero());
        let middles = bsdf.places.iter().filter(|p| p.steps & step::MIDDLE != 0).count();
        if !bsdf.is_flat() || signals || middles != bsdf.layers.len() {
            return None;
        }
        let mut frames = Vec::new();
        for p in &bsdf.places {
            let axes = axes(p.site)?;
            if p.frame as usize == frames.len() {
                frames.push(axes);
            }
            // Turned from what is known of its site: all its parameters but directions.
            curves.at(p.site).site.as_ref()?;
        }
        let lobes = bsdf.lobes.iter().map(|l| (l.lobe.kind(), l.share)).collect();
        let (places, layers) = (bsdf.places.to_vec(), bsdf.layers.iter().map(|l| l.weight).collect());
        let (layering, depth, ops) = (bsdf.layering, bsdf.depth, bsdf.ops().to_vec());
        (frames.len() == bsdf.frames.len()).then_some(Plan { layering, depth, frames, lobes, places, layers, ops })
    }

    /// The BSDF at a point, seen from `wo` (world space, any length), into memory that is used again.
    #[inline(always)]
    pub(crate) fn turn<'m>(&'m self, globals: &Globals, wo: V3<S>, curves: &'m Curves<S>, bsdf: &mut Bsdf<'m, S>) {
        // In registers: three numbers a caller has just put down one by one cannot be picked up as two.
        self.turn_toward(globals, wo.x, wo.y, wo.z, curves, bsdf);
    }

    fn turn_toward<'m>(&'m self, globals: &Globals, x: S, y: S, z: S, curves: &'m Curves<S>, bsdf: &mut Bsdf<'m, S>) {
        let wo = frame::normalize_or_zero(V3::new(x, y, z));
        bsdf.reset(wo, vector(globals.ng), self.layering, self.depth);
        bsdf.plan = Some(self);
        // The first frame's is at hand: what has just been stored in parts would have to be waited for.
        let local = match self.frames.split_first() {
            Some((first, more)) => {
                let first = first.at(globals);
                bsdf.frames.push(first);
                for axes in more {
                    bsdf.frames.push(axes.at(globals));
                }
                first.to_local(wo)
            }
            None => wo,
        };
        self.fill::<S, Turned>(local, wo, curves, bsdf);
    }

    /// The lobes, in a BSDF that has its frames; `local` is `wo` in the first of them.
    #[inline(always)]
    fn fill<'m, L: Over<S>, P: Prepare<S, L>>(
        &'m self,
        mut local: V3<L>,
        wo: V3<L>,
        curves: &'m Curves<S>,
        bsdf: &mut Bsdf<'m, L>,
    ) {
        let mut stack = FlatStack::<L>::default();
        let mut frame = 0;
        let (mut alpha_o, mut total) = (L::one(), L::zero());
        for (p, (kind, weight)) in self.places.iter().zip(&self.lobes) {
            if p.frame != frame {
                frame = p.frame;
                local = bsdf.frames[frame as usize].to_local(wo);
            }
            if p.steps & step::MIDDLE != 0 {
                alpha_o = stack.alpha();
            }
            let scale = stack.step(p.steps, self.layering.rule, alpha_o);
            let known = curves.at(p.site);
            let (zero, lobe) = ([L::zero(); 3], AimedLobe::nothing());
            bsdf.lobes.push(FlatLobe { share: lifted(*weight), albedo: zero, alpha_o, known, lobe });
            let (Some(l), Some(site)) = (bsdf.lobes.last_mut(), &known.site) else { return };
            // Made where it stays: what has just been stored in parts would have to be waited for.
            let [albedo, bound] = P::prepare(*kind, site, local, &known.curve, p, &mut l.lobe);
            total += l.weigh([scale; 3], albedo);
            if p.inside {
                stack.lobe(p.weight_in_top, bound);
            }
        }
        bsdf.share_out(total);
    }
}

impl Plan<f32> {
    /// What the lobes do not keep of themselves, for eight points at once.
    pub(crate) fn rests(&self, curves: &Curves<f32>, to: &mut Vec<AnyLobe<F32x8>>) {
        let up = V3::new(F32x8([0.0; 8]), F32x8([0.0; 8]), F32x8([1.0; 8]));
        to.clear();
        to.extend(self.places.iter().zip(&self.lobes).filter_map(|(p, (kind, _))| {
            let known = curves.at(p.site);
            Some(AnyLobe::new(*kind, known.site.as_ref()?.values(), up, &known.curve))
        }));
    }

    /// [`turn`](Self::turn) at eight points: the bits of each.
    pub(crate) fn turn_eight<'m>(
        &'m self,
        points: [&Globals; 8],
        wo: [[f32; 3]; 8],
        curves: &'m Curves<f32>,
        bsdf: &mut Bsdf<'m, F32x8>,
    ) {
        let packed = |each: [V3<f32>; 8]| V3::new(each.map(|v| v.x), each.map(|v| v.y), each.map(|v| v.z)).map(F32x8);
        let wo = packed(wo.map(|[x, y, z]| frame::normalize_or_zero(V3::new(x, y, z))));
        bsdf.reset(wo, packed(points.map(|globals| vector(globals.ng))), self.layering, self.depth);
        bsdf.plan = Some(self);
        for axes in &self.frames {
            let each = points.map(|globals| axes.at::<f32>(globals));
            let frame =
                Frame { t: packed(each.map(|f| f.t)), b: packed(each.map(|f| f.b)), n: packed(each.map(|f| f.n)) };
            bsdf.frames.push(frame);
        }
        let local = bsdf.frames.first().map_or(wo, |frame| frame.to_local(wo));
        self.fill::<F32x8, Made>(local, wo, curves, bsdf);
    }
}

/// How a lobe of known parameters is prepared for ωo.
trait Prepare<S: Scalar, L: Over<S>> {
    /// Gives what [`AnyLobe::albedos`] would; in a top under `view` the second is [`AnyLobe::view_bound`].
    fn prepare(
        kind: LobeKind,
        site: &Site<S>,
        wo: V3<L>,
        curve: &AlbedoCurve<S>,
        place: &Place<S>,
        to: &mut AimedLobe<L>,
    ) -> [Rgb<L>; 2];
}

/// From its parameters.
struct Made;

impl<S: Scalar, L: Over<S>> Prepare<S, L> for Made {
    #[inline(always)]
    fn prepare(
        kind: LobeKind,
        site: &Site<S>,
        wo: V3<L>,
        curve: &AlbedoCurve<S>,
        place: &Place<S>,
        to: &mut AimedLobe<L>,
    ) -> [Rgb<L>; 2] {
        let made = AnyLobe::new(kind, site.values(), wo.apart(), curve);
        *to = AimedLobe::of(&made);
        let [albedo, bound] = made.albedos(wo, curve, place.in_top);
        [albedo, if place.of_view() { made.view_bound(wo, curve) } else { bound }]
    }
}

/// Turned from what was prepared before, where there is such a way.
struct Turned;

impl<S: Scalar> Prepare<S, S> for Turned {
    #[inline(always)]
    fn prepare(
        kind: LobeKind,
        site: &Site<S>,
        wo: V3<S>,
        curve: &AlbedoCurve<S>,
        place: &Place<S>,
        to: &mut AimedLobe<S>,
    ) -> [Rgb<S>; 2] {
        let Some([albedo, bound]) = site.turn(wo, curve, place.in_top, to) else {
            return Made::prepare(kind, site, wo, curve, place, to);
        };
        if place.of_view() {
            // As numbers: what comes from a call stays in memory.
            let [r, g, b] = to.view_bound(Some(site.lobe()), wo.apart(), curve);
            return [albedo, [r, g, b]];
        }
        [albedo, bound]
    }
}

#[inline(always)]
fn vector<S: Scalar>(v: Vec3) -> V3<S> {
    V3::from_f32(v.to_array())
}

/// Whether a layering is one that plans are for.
pub(crate) fn plans(layering: Layering) -> bool {
    layering.tint == TintRule::Largest && layering.rule != LayeringRule::Balanced
}
