//! What a host holds at a shading point: a BSDF for one ωo.
//!
//! Directions are unit vectors in world space that point away from the surface. Each lobe uses the cosine of its own
//! normal; nothing is clipped at the geometric normal.

use super::balance::Balanced;
use super::flatten::Layering;
use super::layer::{FlatStack, LayerStack, LayeringRule, TintRule};
use super::met::{FlatLobe, LayerAlpha, Lists, Met, Place};
use super::parts::{Cosine, Signal};
use super::plan::Plan;
use super::tree::MAX_LAYERS;
use crate::lobes::{AimedLobe, AnyLobe, Evaluated, Rgb};
use crate::optics::{Frame, Over, Real, Scalar, V3, array};
use smallvec::SmallVec;

/// f·|cos| per channel and the density of sampling that direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Eval<S = f32> {
    /// Σ w·f·|N·ωi| per channel, each lobe with its own normal; delta lobes left out.
    pub f_cos: Rgb<S>,
    /// Density over solid angle of [`Bsdf::sample`] choosing this direction; delta lobes left out.
    pub pdf: S,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<S = f32> {
    /// World space, unit, away from the surface.
    pub wi: [S; 3],
    /// f·|cos| per channel; for a delta sample what it scatters.
    pub f_cos: Rgb<S>,
    /// Density over solid angle, or the probability of a delta sample.
    pub pdf: S,
    /// `f_cos / pdf`.
    pub weight: Rgb<S>,
    /// What kind of scattering it is.
    pub flags: SampleFlags,
    /// Index of refraction on ωi's side over that on ωo's: 1 unless the sampled lobe refracts. Radiance carried from ωi
    /// to ωo is divided by its square; f is not.
    pub eta: S,
    /// How wide the lobe that was chosen scatters: 0 one direction, 1 as wide as a diffuse surface.
    pub roughness: S,
}

/// What kind of scattering a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SampleFlags {
    /// ωi lies on the other side of the geometric surface than ωo.
    pub transmit: bool,
    /// The direction comes from a delta lobe; `pdf` is a probability.
    pub delta: bool,
    /// The direction comes from a diffuse lobe that stands in for scattering below the surface.
    pub subsurface: bool,
}

/// The tree written out, top before base. Lobes and layers are stored in the order they are met.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Op {
    Lobe,
    Begin,
    Middle,
    End,
}

/// The BSDF of a closure tree at one point for one ωo. Holds eight lobes without allocating.
///
/// `S` is `f32` in the standard tier and `f64` in the reference tier.
#[derive(Clone, Debug)]
pub struct Bsdf<'m, S: Real = f32> {
    pub(crate) wo: V3<S>,
    /// As given, of any length.
    ng: V3<S>,
    /// 1 where ωo is on its side, −1 on the other; 0 where there are no sides.
    side: S,
    pub(crate) layering: Layering,
    /// The most layers open at once.
    pub(super) depth: u16,
    /// See [`is_flat`](Self::is_flat).
    pub(super) flat: bool,
    /// What is the same at every point, of a tree that was written out before; in its place `ops`, `places`, `rests` and
    /// `layers`.
    pub(super) plan: Option<&'m Plan<S::Entry>>,
    /// Whether there may be anything in what plans never fill: these, balances, emission, signals.
    pub(super) filled: bool,
    pub(super) ops: SmallVec<[Op; 32]>,
    pub(super) places: SmallVec<[Place<S::Entry>; 8]>,
    /// See [`Place::rest`].
    pub(super) rests: SmallVec<[AnyLobe<S>; 8]>,
    pub(crate) lobes: SmallVec<[FlatLobe<'m, S>; 8]>,
    /// What scales each lobe in place of the layers' own rule, if that was solved for; empty where nothing was.
    pub(super) balanced: SmallVec<[Option<Balanced<'m, S>>; 8]>,
    pub(super) layers: SmallVec<[LayerAlpha<S>; 7]>,
    /// One for all lobes that share a normal and a tangent.
    pub(crate) frames: SmallVec<[Frame<S>; 8]>,
    pub(crate) emission: Rgb<S>,
    pub(crate) signals: SmallVec<[Signal<S>; 8]>,
}

impl<'m, S: Real> Bsdf<'m, S> {
    /// A BSDF that scatters nothing.
    pub fn black() -> Self {
        let zero = V3::new(S::zero(), S::zero(), S::zero());
        Bsdf {
            wo: zero,
            ng: zero,
            side: S::zero(),
            layering: Layering::default(),
            depth: 0,
            flat: true,
            plan: None,
            filled: false,
            ops: SmallVec::new(),
            places: SmallVec::new(),
            rests: SmallVec::new(),
            lobes: SmallVec::new(),
            balanced: SmallVec::new(),
            layers: SmallVec::new(),
            frames: SmallVec::new(),
            emission: [S::zero(); 3],
            signals: SmallVec::new(),
        }
    }

    /// Black again for another point, keeping what memory there is.
    pub(super) fn reset(&mut self, wo: V3<S>, ng: V3<S>, layering: Layering, depth: u16) {
        let (o, zero) = (ng.dot(wo), S::zero());
        self.side = S::select(o.gt(zero), S::one(), S::select(o.lt(zero), -S::one(), zero));
        (self.wo, self.ng, self.layering, self.depth) = (wo, ng, layering, depth);
        self.flat = true;
        self.plan = None;
        empty(&mut self.lobes);
        empty(&mut self.frames);
        if self.filled {
            self.filled = false;
            self.empty_more();
        }
    }

    /// What plans never fill.
    #[inline(never)]
    fn empty_more(&mut self) {
        empty(&mut self.ops);
        empty(&mut self.places);
        empty(&mut self.rests);
        empty(&mut self.layers);
        empty(&mut self.balanced);
        self.emission = [S::zero(); 3];
        empty(&mut self.signals);
    }

    /// The tree written out.
    pub(crate) fn ops(&self) -> &[Op] {
        match self.plan {
            Some(plan) => plan.ops(),
            None => &self.ops,
        }
    }

    /// Where each lobe stands.
    #[inline(always)]
    pub(crate) fn places(&self) -> &[Place<S::Entry>] {
        match self.plan {
            Some(plan) => plan.places(),
            None => &self.places,
        }
    }

    /// Turns estimated albedos, which add up to `total`, into probabilities and drops nothing.
    #[inline(always)]
    pub(super) fn share_out(&mut self, total: S) {
        // Until now the estimates themselves, by their largest channel.
        let even = S::one() / S::c(self.lobes.len() as f64);
        for l in &mut self.lobes {
            l.share[3] = S::select(total.gt(S::zero()), l.share[3] / total, even);
        }
    }
}

impl<'m, S: Scalar> Bsdf<'m, S> {
    #[inline(always)]
    fn lists(&self) -> Lists<'_, 'm, S> {
        Lists { places: self.places(), lobes: &self.lobes, frames: &self.frames, rests: &self.rests }
    }

    /// The lobes.
    pub(crate) fn met(&self) -> impl ExactSizeIterator<Item = Met<'_, 'm, S>> {
        self.lists().met()
    }

    /// One of them.
    pub(crate) fn lobe(&self, index: usize) -> Met<'_, 'm, S> {
        self.lists().lobe(index)
    }

    /// What is left to do when the list is whole.
    pub(super) fn finish(&mut self) {
        self.flat &= self.layering.tint == TintRule::Largest && self.balanced.is_empty();
        self.share_out(self.lobes.iter().fold(S::zero(), |sum, l| sum + l.share[3]));
        self.emission = self.emission.map(|e| e.min(S::c(1e30)));
        for s in &mut self.signals {
            s.value = s.value.map(|v| v.min(S::c(1e30)));
        }
    }

    /// f·|cos| and pdf of one direction.
    ///
    /// `wi`: world space, unit, away from the surface. A direction that is not finite, or shorter than ½ or longer than
    /// 2, gives black and pdf 0.
    #[inline]
    pub fn eval(&self, wi: impl Into<[S; 3]>) -> Eval<S> {
        let [x, y, z] = wi.into();
        self.eval_toward(x, y, z)
    }

    /// [`eval`](Self::eval), the direction in registers: three numbers that a caller has just put down one by one cannot be
    /// picked up as two before they have arrived.
    fn eval_toward(&self, x: S, y: S, z: S) -> Eval<S> {
        let wi = V3::new(x, y, z);
        let mut sum = Sum::new(usize::MAX);
        if is_unit(wi) {
            if self.is_flat() {
                self.walk_flat(self.lists(), wi, &mut sum);
            } else {
                sum.take(self.eval_deep(wi.apart(), usize::MAX));
            }
        }
        sum.eval()
    }

    /// Memory in use: the parts a walk touches, not the room kept for more lobes, nor what the material holds for all points.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.ops)
            + size_of_val(&*self.places)
            + size_of_val(&*self.rests)
            + size_of_val(&*self.lobes)
            + size_of_val(&*self.balanced)
            + size_of_val(&*self.layers)
            + size_of_val(&*self.frames)
            + 2 * size_of::<V3<S>>()
            + size_of::<Rgb<S>>()
            + 4 * size_of::<usize>()
    }

    /// [`eval`](Self::eval) with |N·ωo| in place of |N·ωi| and, across media, times (ηo/ηi)²: what E_light integrates
    /// over ωo.
    pub fn eval_adjoint(&self, wi: [S; 3]) -> Rgb<S> {
        self.part(vector(wi), Cosine::View, |_, _| true)
    }

    /// Σ w·f without cosines, times ηo/ηi across media: symmetric in its directions if the BSDF is reciprocal.
    pub fn f(&self, wi: [S; 3]) -> Rgb<S> {
        self.part(vector(wi), Cosine::None, |_, _| true)
    }

    /// Draws a direction from three uniform numbers in [0, 1): two for the direction, one to choose the lobe.
    /// `None` where nothing is scattered that way (a black BSDF, a direction below the horizon).
    #[inline]
    pub fn sample(&self, u: [S; 3]) -> Option<Sample<S>> {
        let [u0, u1, choice] = u;
        self.sample_for(u0, u1, choice)
    }

    /// [`sample`](Self::sample), its numbers in registers: see [`eval_toward`](Self::eval_toward).
    fn sample_for(&self, u0: S, u1: S, choice: S) -> Option<Sample<S>> {
        let lists = self.lists();
        let index = lists.choose(choice)?;
        let l = lists.lobe(index);
        if l.place.delta {
            return self.sample_delta(index, l);
        }
        let local = l.sample([u0, u1]).apart();
        if local.z == S::zero() {
            // No direction at all; turned to the world, rounding would put it on either side.
            return None;
        }
        let wi = lists.frames[l.place.frame as usize].to_world(local);
        let subsurface = matches!(l.flat.lobe, AimedLobe::Subsurface(_));
        let flags = SampleFlags { transmit: self.crosses(wi), delta: false, subsurface };
        // Where the lobe's own density is 0, as below a horizon, another lobe may scatter, but the sample is not one of its own.
        let mut sum = Sum::new(index);
        if self.is_flat() {
            self.walk_flat(lists, wi, &mut sum);
        } else {
            sum.take(self.eval_deep(wi.apart(), index));
        }
        if sum.pdf > S::zero() { Self::sampled(wi, sum.eval(), flags, l, local) } else { None }
    }

    #[inline(never)]
    fn sample_delta(&self, index: usize, l: Met<'_, 'm, S>) -> Option<Sample<S>> {
        let (local, _) = l.delta()?;
        let wi = self.frames[l.place.frame as usize].to_world(local);
        if !is_unit(wi) {
            // Seen along no direction, it has none to send light to.
            return None;
        }
        let f_cos = self.lobe_delta(index, true)?;
        let flags = SampleFlags { transmit: self.crosses(wi), delta: true, ..SampleFlags::default() };
        Self::sampled(wi, Eval { f_cos, pdf: l.flat.probability() }, flags, l, local)
    }

    /// Whether ωi lies on the other side of the geometric surface than ωo.
    #[inline(always)]
    fn crosses(&self, wi: V3<S>) -> bool {
        // By sign, whatever its length; one that is not finite has no sides.
        let i = self.ng.dot(wi) * self.side;
        i < S::zero() && i.is_finite()
    }

    /// [`sample`](Self::sample) for as many `u` as `out` has room for, and as many `out` as there are `u`.
    pub fn sample_batch(&self, u: &[[S; 3]], out: &mut [Option<Sample<S>>]) {
        for (u, out) in u.iter().zip(out) {
            *out = self.sample(*u);
        }
    }

    #[inline(always)]
    fn sampled(wi: V3<S>, eval: Eval<S>, flags: SampleFlags, lobe: Met<'_, 'm, S>, local: V3<S>) -> Option<Sample<S>> {
        let Eval { f_cos, pdf } = eval;
        let weight = f_cos.map(|f| f / pdf);
        // f and pdf are finite.
        let fine = pdf > S::zero() && weight[0].max(weight[1]).max(weight[2]).is_finite();
        let (eta, roughness) = lobe.flat.lobe.crossing(|| lobe.rest(), local);
        fine.then_some(Sample { wi: [wi.x, wi.y, wi.z], f_cos, pdf, weight, flags, eta, roughness })
    }

    /// Radiance given off toward ωo.
    pub fn emission(&self) -> Rgb<S> {
        self.emission
    }

    /// Whether nothing is scattered at all.
    pub fn is_black(&self) -> bool {
        self.lobes.is_empty()
    }

    /// Number of lobes.
    pub fn lobe_count(&self) -> usize {
        self.lobes.len()
    }

    /// The direction toward the viewer: world space, unit; zero if it was given as zero or not finite.
    pub fn wo(&self) -> [S; 3] {
        [self.wo.x, self.wo.y, self.wo.z]
    }

    /// A quick estimate of ∫ f·|cos| dωi, delta lobes included: each lobe's own albedo times its weights and
    /// α(ωo) of the layers above. Under `min` what layers take away toward the light makes the truth smaller.
    pub fn albedo(&self) -> Rgb<S> {
        let mut sum = [S::zero(); 3];
        for l in &self.lobes {
            for c in 0..3 {
                sum[c] += l.albedo[c];
            }
        }
        sum
    }

    /// Never below ∫ f·|cos| over the other direction when one direction is `w`, from either side.
    pub fn albedo_bound(&self, w: [S; 3]) -> Rgb<S> {
        let w = unit_or_zero(vector(w));
        self.walk(w, true, |_, l: Met<'_, 'm, S>, _, local, _| l.bound(local, true))
    }

    /// Whether [`walk_flat`](Self::walk_flat) will do: layers as scripts build them, all channels dimmed alike, nothing
    /// solved for.
    #[inline(always)]
    pub(super) fn is_flat(&self) -> bool {
        self.flat
    }

    /// Apart, because its stack is large.
    #[inline(never)]
    fn eval_deep(&self, wi: V3<S>, own: usize) -> Sum<S> {
        let mut sum = Sum::new(own);
        self.walk(wi, false, &mut sum);
        sum
    }

    /// [`walk`](Self::walk) for most materials.
    #[inline(always)]
    fn walk_flat(&self, lists: Lists<'_, 'm, S>, wi: V3<S>, mut visit: impl Visit<'m, S>) {
        let mut stack = FlatStack::<S>::default();
        let (mut frame, mut local) = (u32::MAX, wi);
        for (index, l) in lists.met().enumerate() {
            let place = l.place;
            if place.frame != frame {
                frame = place.frame;
                local = lists.frames[frame as usize].to_local(wi);
            }
            let scale = stack.step(place.steps, self.layering.rule, l.flat.alpha_o);
            let bound = visit.lobe(index, l, [scale; 3], local, place.in_top);
            if place.in_top {
                stack.lobe(place.weight_in_top, bound);
            }
        }
    }

    /// Visits every lobe, then gives the bound on the whole if it is asked for. `wi` has been looked at: unit or zero.
    #[inline(always)]
    pub(crate) fn walk(&self, wi: V3<S>, bound: bool, visit: impl Visit<'m, S>) -> Rgb<S> {
        match (self.depth, self.layering.tint) {
            (0..=4, TintRule::Largest) => self.walk_within::<4, 1>(wi, bound, visit),
            (0..=4, _) => self.walk_within::<4, 3>(wi, bound, visit),
            _ => self.walk_within::<{ MAX_LAYERS as usize }, 3>(wi, bound, visit),
        }
    }

    #[inline(always)]
    fn walk_within<const D: usize, const C: usize>(
        &self,
        wi: V3<S>,
        bound: bool,
        mut visit: impl Visit<'m, S>,
    ) -> Rgb<S> {
        let mut stack = LayerStack::<S, D, C>::default();
        let (mut index, mut layer) = (0, 0);
        let mut frame = u32::MAX;
        let mut local = wi;
        let (frames, balanced) = (&*self.frames, &*self.balanced);
        for op in self.ops() {
            match *op {
                Op::Lobe => {
                    let l = self.lobe(index);
                    if l.place.frame != frame {
                        frame = l.place.frame;
                        local = frames[frame as usize].to_local(wi);
                    }
                    let scale = match balanced.get(index) {
                        Some(Some(balanced)) => balanced.scale(local.z),
                        _ => stack.scale(),
                    };
                    let asked = l.place.in_top || bound;
                    let bound = visit.lobe(index, l, scale, local, asked);
                    if asked {
                        let [r, g, b, _] = l.place.weight_in_top;
                        stack.lobe([r, g, b], bound);
                    }
                    index += 1;
                }
                Op::Begin => stack.begin(),
                Op::Middle => {
                    let LayerAlpha { alpha_o, weight } = self.layer(layer, index);
                    layer += 1;
                    stack.middle(weight, self.layering.rule, self.layering.tint, Some(alpha_o));
                }
                Op::End => stack.end(),
            }
        }
        stack.bound()
    }

    /// A layer whose base begins with the lobe `next`.
    #[inline(always)]
    pub(super) fn layer(&self, index: usize, next: usize) -> LayerAlpha<S> {
        match self.plan {
            // One lobe at least stands in each base, and its own α with it.
            Some(plan) => LayerAlpha { alpha_o: [self.lobes[next].alpha_o; 3], weight: plan.layer_weight(index) },
            None => self.layers[index],
        }
    }

    /// Whether every layer scales symmetrically in its directions.
    pub fn symmetric_layers(&self) -> bool {
        self.depth == 0 || self.layering.rule != LayeringRule::View
    }
}

/// Is shown every lobe: its index, what the layers above it scale it by for this ωi, the direction in its frame, and
/// whether its bound there is asked for, which is then to be returned.
pub(crate) trait Visit<'m, S: Scalar> {
    fn lobe(&mut self, index: usize, lobe: Met<'_, 'm, S>, scale: Rgb<S>, local: V3<S>, bound: bool) -> Rgb<S>;
}

impl<'m, S: Scalar, F: FnMut(usize, Met<'_, 'm, S>, Rgb<S>, V3<S>, bool) -> Rgb<S>> Visit<'m, S> for F {
    #[inline(always)]
    fn lobe(&mut self, index: usize, lobe: Met<'_, 'm, S>, scale: Rgb<S>, local: V3<S>, bound: bool) -> Rgb<S> {
        self(index, lobe, scale, local, bound)
    }
}

/// Adds up f·|cos| and the pdf; no closure, because those cannot be told to be inlined.
struct Sum<S> {
    /// Three channels of f·|cos|, then the pdf.
    all: [S; 4],
    /// A lobe's index, and its density once met.
    own: usize,
    pdf: S,
}

impl<S: Scalar> Sum<S> {
    #[inline(always)]
    fn new(own: usize) -> Self {
        Sum { all: [S::zero(); 4], own, pdf: S::zero() }
    }

    /// As numbers: what comes from a call stays in memory.
    #[inline(always)]
    fn take(&mut self, sum: Sum<S>) {
        (self.all, self.pdf) = (array(|k| sum.all[k]), sum.pdf);
    }

    #[inline(always)]
    fn eval(&self) -> Eval<S> {
        // All four alike, so that they are written as one.
        let [r, g, b, pdf] = array(|k| finite(self.all[k]));
        Eval { f_cos: [r, g, b], pdf }
    }
}

impl<'m, S: Scalar> Visit<'m, S> for &mut Sum<S> {
    #[inline(always)]
    fn lobe(&mut self, index: usize, l: Met<'_, 'm, S>, scale: Rgb<S>, local: V3<S>, bound: bool) -> Rgb<S> {
        let e = l.evaluate(local, bound);
        add(&mut self.all, &l.flat.share, scale, local.z, &e);
        self.pdf = if index == self.own { e.pdf } else { self.pdf };
        e.bound
    }
}

/// Adds f·|cos| per channel and the pdf of one lobe, scaled by what lies above it.
#[inline(always)]
pub(super) fn add<S: Real, L: Over<S>>(sum: &mut [L; 4], share: &[S; 4], scale: Rgb<L>, cos: L, e: &Evaluated<L>) {
    let cos = cos.abs().min(L::one());
    let values = [e.f[0], e.f[1], e.f[2], e.pdf];
    let scales = [scale[0] * cos, scale[1] * cos, scale[2] * cos, L::one()];
    for k in 0..4 {
        // In this order, because a lobe without color has but one such product.
        sum[k] += L::lift(share[k]) * (values[k] * scales[k]);
    }
}

/// Empties a list, keeping what memory it has; `clear` goes over every entry.
#[inline(always)]
fn empty<A: smallvec::Array>(list: &mut SmallVec<A>) {
    if list.spilled() {
        list.clear();
    } else {
        *list = SmallVec::new();
    }
}

/// A million terms of weight 1e30 are still a number.
#[inline(always)]
pub(super) fn finite<L: Real>(x: L) -> L {
    x.min(L::c(f32::MAX as f64))
}

/// Directions that are not finite, or far from unit length, become zero: in every surface at once, hence black.
#[inline(always)]
pub(super) fn unit_or_zero<L: Real>(w: V3<L>) -> V3<L> {
    let fine = is_unit(w);
    w.map(|x| L::select(fine, x, L::zero()))
}

/// Whether a direction is finite and about as long as it should be.
#[inline(always)]
pub(super) fn is_unit<L: Real>(w: V3<L>) -> L::Mask {
    let length = w.length_squared();
    length.gt(L::c(0.25)) & length.lt(L::c(4.0))
}

#[inline(always)]
pub(super) fn vector<S: Real>(w: [S; 3]) -> V3<S> {
    V3::new(w[0], w[1], w[2])
}
