//! What a host holds at a shading point: a BSDF for one ωo.
//!
//! Directions are unit vectors in world space that point away from the surface. Each lobe uses the cosine of its own
//! normal; nothing is clipped at the geometric normal.

use super::balance::Balanced;
use super::flatten::Layering;
use super::layer::{FlatStack, LayerStack, LayeringRule, TintRule};
use super::parts::{Cosine, Signal};
use super::tree::MAX_LAYERS;
use crate::albedo::AlbedoCurve;
use crate::lobes::{AnyLobe, Evaluated, Rgb};
use crate::optics::{Frame, Over, Real, Scalar, V3, array, rgb};
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

/// One lobe of a flattened tree.
#[derive(Clone, Debug)]
pub(crate) struct FlatLobe<'m, S: Real> {
    /// Its weight from the root of the tree, per channel; then its probability of being chosen by `sample`. In one, because
    /// f and pdf are worked out side by side.
    pub share: [S; 4],
    pub lobe: AnyLobe<S>,
    pub curve: &'m AlbedoCurve<S::Entry>,
    pub site: u32,
    pub frame: u32,
    /// From the root of the innermost top; the fourth is idle.
    pub weight_in_top: [S; 4],
    /// α toward ωo of the layer that dims it, where `steps` says that its base begins.
    pub alpha_o: S,
    /// What [`FlatStack`] is to do first.
    pub steps: u8,
    /// It stands in a top.
    pub inside: bool,
    /// It does, and its bound is needed for every ωi.
    pub in_top: bool,
    pub delta: bool,
    /// What it is estimated to scatter for this ωo, weights and layers included.
    pub albedo: Rgb<S>,
}

impl<S: Real> FlatLobe<'_, S> {
    /// Of being chosen by `sample`.
    pub fn probability(&self) -> S {
        self.share[3]
    }
}

/// A layer's α toward ωo and its weight relative to the top it stands in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerAlpha<S> {
    pub alpha_o: Rgb<S>,
    pub weight: Rgb<S>,
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
    pub(super) ng: V3<S>,
    pub(crate) layering: Layering,
    /// The most layers open at once.
    pub(super) depth: u16,
    /// Whether [`FlatStack`] will do for its layers, as far as the tree goes.
    pub(super) flat: bool,
    pub(crate) ops: SmallVec<[Op; 32]>,
    /// Whether there may be anything in what plans never fill: ops, balances, emission, signals.
    pub(super) filled: bool,
    /// In place of them, for a tree that was written out before.
    pub(super) planned_ops: &'m [Op],
    pub(crate) lobes: SmallVec<[FlatLobe<'m, S>; 8]>,
    /// What scales each lobe in place of the layers' own rule, if that was solved for; empty where nothing was.
    pub(super) balanced: SmallVec<[Option<Balanced<'m, S>>; 8]>,
    pub(crate) layers: SmallVec<[LayerAlpha<S>; 7]>,
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
            layering: Layering::default(),
            depth: 0,
            flat: true,
            ops: SmallVec::new(),
            filled: false,
            planned_ops: &[],
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
        (self.wo, self.ng, self.layering, self.depth) = (wo, ng, layering, depth);
        self.flat = true;
        self.planned_ops = &[];
        empty(&mut self.lobes);
        empty(&mut self.layers);
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
        empty(&mut self.balanced);
        self.emission = [S::zero(); 3];
        empty(&mut self.signals);
    }

    /// The tree written out.
    pub(crate) fn ops(&self) -> &[Op] {
        if self.planned_ops.is_empty() { &self.ops } else { self.planned_ops }
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
    /// What is left to do when the list is whole.
    pub(super) fn finish(&mut self) {
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
        self.eval_own(V3::new(x, y, z), usize::MAX).0
    }

    /// [`eval`](Self::eval), and the density of lobe `own` alone (0 if there is none of that index).
    #[inline(always)]
    fn eval_own(&self, wi: V3<S>, own: usize) -> (Eval<S>, S) {
        let mut sum = Sum { all: [S::zero(); 4], own, pdf: S::zero() };
        if is_unit(wi) {
            if self.is_flat() {
                self.walk_flat(wi, &mut sum);
            } else {
                self.eval_deep(wi.apart(), &mut sum);
            }
        }
        // All four alike, so that they are written as one.
        let [r, g, b, pdf] = array(|k| finite(sum.all[k]));
        (Eval { f_cos: [r, g, b], pdf }, sum.pdf)
    }

    /// Memory in use: the parts a walk touches, not the room kept for more lobes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.ops())
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
        let index = self.choose(choice)?;
        let l = &self.lobes[index];
        if l.delta {
            return self.sample_delta(index, l);
        }
        let local = l.lobe.sample([u0, u1]).apart();
        if local.z == S::zero() {
            // No direction at all; turned to the world, rounding would put it on either side.
            return None;
        }
        let wi = self.frames[l.frame as usize].to_world(local);
        let subsurface = matches!(l.lobe, AnyLobe::Subsurface(_));
        let flags = SampleFlags { transmit: self.crosses(wi), delta: false, subsurface };
        // Where the lobe's own density is 0, as below a horizon, another lobe may scatter, but the sample is not one of its own.
        let (eval, own) = self.eval_own(wi, index);
        if own > S::zero() { Self::sampled(wi, eval, flags, l, local) } else { None }
    }

    #[inline(never)]
    fn sample_delta(&self, index: usize, l: &FlatLobe<'m, S>) -> Option<Sample<S>> {
        let (local, _) = l.lobe.delta()?;
        let wi = self.frames[l.frame as usize].to_world(local);
        if !is_unit(wi) {
            // Seen along no direction, it has none to send light to.
            return None;
        }
        let f_cos = self.lobe_delta(index, true)?;
        let flags = SampleFlags { transmit: self.crosses(wi), delta: true, ..SampleFlags::default() };
        Self::sampled(wi, Eval { f_cos, pdf: l.probability() }, flags, l, local)
    }

    /// Whether ωi lies on the other side of the geometric surface than ωo.
    #[inline(always)]
    fn crosses(&self, wi: V3<S>) -> bool {
        let (i, o) = (self.ng.dot(wi), self.ng.dot(self.wo));
        // By sign, whatever its length; one that is not finite has no sides.
        let apart = (i.lt(S::zero()) & o.gt(S::zero())) | (i.gt(S::zero()) & o.lt(S::zero()));
        apart && i.is_finite() && o.is_finite()
    }

    /// [`sample`](Self::sample) for as many `u` as `out` has room for, and as many `out` as there are `u`.
    pub fn sample_batch(&self, u: &[[S; 3]], out: &mut [Option<Sample<S>>]) {
        for (u, out) in u.iter().zip(out) {
            *out = self.sample(*u);
        }
    }

    #[inline(always)]
    fn sampled(
        wi: V3<S>,
        eval: Eval<S>,
        flags: SampleFlags,
        lobe: &FlatLobe<'m, S>,
        local: V3<S>,
    ) -> Option<Sample<S>> {
        let Eval { f_cos, pdf } = eval;
        let weight = f_cos.map(|f| f / pdf);
        // f and pdf are finite.
        let fine = pdf > S::zero() && weight[0].max(weight[1]).max(weight[2]).is_finite();
        let (eta, roughness) = lobe.lobe.crossing(local);
        fine.then_some(Sample { wi: [wi.x, wi.y, wi.z], f_cos, pdf, weight, flags, eta, roughness })
    }

    /// The lobe that `u` in [0, 1) falls to.
    fn choose(&self, u: S) -> Option<usize> {
        let mut rest = u.max(S::zero());
        let mut last = None;
        for (i, l) in self.lobes.iter().enumerate() {
            let probability = l.probability();
            if probability > S::zero() {
                last = Some(i);
                if rest < probability {
                    return last;
                }
                rest -= probability;
            }
        }
        // Rounding may leave a little over.
        last
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
        self.walk(w, true, |_, l: &FlatLobe<'m, S>, _, local, _| l.lobe.albedo_bound(local, l.curve))
    }

    /// Whether [`walk_flat`](Self::walk_flat) will do: layers as scripts build them, all channels dimmed alike, nothing
    /// solved for.
    #[inline(always)]
    pub(super) fn is_flat(&self) -> bool {
        self.flat && self.layering.tint == TintRule::Largest && self.balanced.is_empty()
    }

    /// Apart, because its stack is large.
    #[inline(never)]
    fn eval_deep(&self, wi: V3<S>, sum: &mut Sum<S>) {
        self.walk(wi, false, sum);
    }

    /// [`walk`](Self::walk) for most materials.
    #[inline(always)]
    fn walk_flat<L: Over<S>>(&self, wi: V3<L>, mut visit: impl Visit<'m, S, L>) {
        let frames = &*self.frames;
        let mut stack = FlatStack::<L>::default();
        let (mut frame, mut local) = (u32::MAX, wi);
        for (index, l) in self.lobes.iter().enumerate() {
            if l.frame != frame {
                frame = l.frame;
                local = frames[frame as usize].to_local(wi);
            }
            let scale = stack.step(l.steps, self.layering.rule, L::lift(l.alpha_o));
            let bound = visit.lobe(index, l, [scale; 3], local, l.in_top);
            if l.in_top {
                stack.lobe(l.weight_in_top, bound);
            }
        }
    }

    /// Visits every lobe, then gives the bound on the whole if it is asked for. `wi` has been looked at: unit or zero.
    #[inline(always)]
    pub(crate) fn walk(&self, wi: V3<S>, bound: bool, visit: impl Visit<'m, S, S>) -> Rgb<S> {
        match (self.depth, self.layering.tint) {
            (0..=4, TintRule::Largest) => self.walk_within::<S, 4, 1>(wi, bound, visit),
            (0..=4, _) => self.walk_within::<S, 4, 3>(wi, bound, visit),
            _ => self.walk_within::<S, { MAX_LAYERS as usize }, 3>(wi, bound, visit),
        }
    }

    #[inline(always)]
    fn walk_within<L: Over<S>, const D: usize, const C: usize>(
        &self,
        wi: V3<L>,
        bound: bool,
        mut visit: impl Visit<'m, S, L>,
    ) -> Rgb<L> {
        let mut stack = LayerStack::<L, D, C>::default();
        let (mut index, mut layer) = (0, 0);
        let mut frame = u32::MAX;
        let mut local = wi;
        let (lobes, layers, frames, balanced) = (&*self.lobes, &*self.layers, &*self.frames, &*self.balanced);
        for op in self.ops() {
            match *op {
                Op::Lobe => {
                    let l = &lobes[index];
                    if l.frame != frame {
                        frame = l.frame;
                        local = frames[frame as usize].to_local(wi);
                    }
                    let scale = match balanced.get(index) {
                        Some(Some(balanced)) => balanced.scale(local.z),
                        _ => stack.scale(),
                    };
                    let asked = l.in_top || bound;
                    let bound = visit.lobe(index, l, scale, local, asked);
                    if asked {
                        let [r, g, b, _] = l.weight_in_top;
                        stack.lobe([r, g, b], bound);
                    }
                    index += 1;
                }
                Op::Begin => stack.begin(),
                Op::Middle => {
                    let LayerAlpha { alpha_o, weight } = layers[layer];
                    layer += 1;
                    stack.middle(weight, self.layering.rule, self.layering.tint, Some(alpha_o));
                }
                Op::End => stack.end(),
            }
        }
        stack.bound()
    }

    /// Whether every layer scales symmetrically in its directions.
    pub fn symmetric_layers(&self) -> bool {
        self.layers.is_empty() || self.layering.rule != LayeringRule::View
    }
}

/// Is shown every lobe: its index, what the layers above it scale it by for this ωi, the direction in its frame, and
/// whether its bound there is asked for, which is then to be returned.
pub(crate) trait Visit<'m, S: Real, L> {
    fn lobe(&mut self, index: usize, lobe: &FlatLobe<'m, S>, scale: Rgb<L>, local: V3<L>, bound: bool) -> Rgb<L>;
}

impl<'m, S: Real, L, F: FnMut(usize, &FlatLobe<'m, S>, Rgb<L>, V3<L>, bool) -> Rgb<L>> Visit<'m, S, L> for F {
    #[inline(always)]
    fn lobe(&mut self, index: usize, lobe: &FlatLobe<'m, S>, scale: Rgb<L>, local: V3<L>, bound: bool) -> Rgb<L> {
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

impl<'m, S: Scalar> Visit<'m, S, S> for &mut Sum<S> {
    #[inline(always)]
    fn lobe(&mut self, index: usize, l: &FlatLobe<'m, S>, scale: Rgb<S>, local: V3<S>, bound: bool) -> Rgb<S> {
        let e = l.lobe.evaluate(local, l.curve, bound);
        add(&mut self.all, l, scale, local.z, &e);
        self.pdf = if index == self.own { e.pdf } else { self.pdf };
        e.bound
    }
}

/// Adds f·|cos| per channel and the pdf of one lobe, scaled by what lies above it.
#[inline(always)]
pub(super) fn add<S: Real, L: Over<S>>(sum: &mut [L; 4], l: &FlatLobe<'_, S>, scale: Rgb<L>, cos: L, e: &Evaluated<L>) {
    let cos = cos.abs().min(L::one());
    let values = [e.f[0], e.f[1], e.f[2], e.pdf];
    let scales = [scale[0] * cos, scale[1] * cos, scale[2] * cos, L::one()];
    for k in 0..4 {
        // In this order, because a lobe without color has but one such product.
        sum[k] += L::lift(l.share[k]) * (values[k] * scales[k]);
    }
}

impl<S: Real> FlatLobe<'_, S> {
    /// Estimates what it scatters toward ωo, `wo` in its frame, where the layers above scale it by `scale`; `share` holds its
    /// weight. The albedo and its bound there come along. Returns the bound, if it stands in a top – under `view` on that side
    /// alone –, and what its probability is in proportion to.
    #[inline(always)]
    pub(super) fn weigh(&mut self, wo: V3<S>, scale: Rgb<S>, [albedo, bound]: [Rgb<S>; 2]) -> (Rgb<S>, S) {
        self.albedo = rgb!(c => self.share[c] * scale[c] * albedo[c]);
        let largest = self.albedo[0].max(self.albedo[1]).max(self.albedo[2]).max(S::zero());
        // Weights reach 1e30; what matters is their ratio, and that their sum stays finite.
        let part = largest.min(S::c(1e30));
        self.share[3] = part;
        if self.inside && !self.in_top {
            // As numbers: what comes from a call stays in memory.
            let [r, g, b] = self.lobe.view_bound(wo.apart(), self.curve);
            ([r, g, b], part)
        } else {
            (bound, part)
        }
    }
}

impl<S: Scalar> FlatLobe<'_, S> {
    /// The bound at a direction, if it is asked for.
    pub(super) fn bound(&self, local: V3<S>, asked: bool) -> Rgb<S> {
        if asked { self.lobe.albedo_bound(local, self.curve) } else { [S::zero(); 3] }
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
