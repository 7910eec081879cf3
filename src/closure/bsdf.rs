//! What a host holds at a shading point: a BSDF for one ωo.
//!
//! Directions are unit vectors in world space that point away from the surface. Each lobe uses the cosine of its own
//! normal; nothing is clipped at the geometric normal.

use super::balance::Balanced;
use super::flatten::Layering;
use super::layer::{LayerStack, LayeringRule};
use super::tree::MAX_LAYERS;
use crate::albedo::AlbedoCurve;
use crate::lobes::signals::SignalKind;
use crate::lobes::{AnyLobe, LobeKind, Rgb};
use crate::optics::{F32x8, Frame, Lift, Real, Scalar, V3};
use smallvec::SmallVec;

/// f·|cos| per channel and the density of sampling that direction.
#[derive(Clone, Copy, Debug, PartialEq)]
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
}

/// Something a material tells the renderer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal<S = f32> {
    /// What it stands for.
    pub kind: SignalKind,
    /// Its weight, dimmed by the layers above it.
    pub value: Rgb<S>,
}

/// Scattering below the surface that a material asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubsurfacePart<S = f32> {
    /// What comes back of white light from all around, weights and layers toward ωo included.
    pub albedo: Rgb<S>,
    /// The shading normal, world space.
    pub normal: [S; 3],
    /// Mean free path per channel, in the scene's unit.
    pub radius: [f32; 3],
    /// Mean cosine of scattering, in [−1, 1].
    pub anisotropy: f32,
    /// Index of refraction of the medium.
    pub ior: f32,
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
    pub lobe: AnyLobe<S>,
    pub curve: &'m AlbedoCurve<S>,
    pub kind: LobeKind,
    pub site: u32,
    pub frame: u32,
    /// |N·ωo|.
    pub cos_o: S,
    /// From the root of the tree.
    pub weight: Rgb<S>,
    /// From the root of the innermost top.
    pub weight_in_top: Rgb<S>,
    /// Its bound is needed for every ωi.
    pub in_top: bool,
    pub delta: bool,
    /// What it is estimated to scatter for this ωo, weights and layers included.
    pub albedo: Rgb<S>,
    /// What scales it in place of the layers' own rule, if that was solved for.
    pub balanced: Option<Balanced<'m, S>>,
    /// Of being chosen by `sample`.
    pub probability: S,
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
    ng: V3<S>,
    pub(crate) layering: Layering,
    /// The most layers open at once.
    depth: u16,
    pub(crate) ops: SmallVec<[Op; 32]>,
    pub(crate) lobes: SmallVec<[FlatLobe<'m, S>; 8]>,
    pub(crate) layers: SmallVec<[LayerAlpha<S>; 7]>,
    pub(crate) frames: SmallVec<[Frame<S>; 8]>,
    pub(crate) emission: Rgb<S>,
    pub(crate) signals: SmallVec<[Signal<S>; 8]>,
}

/// Which cosine multiplies f.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cosine {
    /// |N·ωi|: light arriving from ωi, seen from ωo.
    Light,
    /// |N·ωo|: the adjoint, f·(ηo/ηi)².
    View,
    /// None: f·ηo/ηi, which is symmetric where f is reciprocal.
    None,
}

impl<'m, S: Scalar> Bsdf<'m, S> {
    pub(crate) fn empty(wo: V3<S>, ng: V3<S>, layering: Layering, depth: u16) -> Self {
        Bsdf {
            wo,
            ng,
            layering,
            depth,
            ops: SmallVec::new(),
            lobes: SmallVec::new(),
            layers: SmallVec::new(),
            frames: SmallVec::new(),
            emission: [S::zero(); 3],
            signals: SmallVec::new(),
        }
    }

    /// A BSDF that scatters nothing.
    pub fn black() -> Self {
        let zero = V3::new(S::zero(), S::zero(), S::zero());
        Bsdf::empty(zero, zero, Layering::default(), 0)
    }

    /// Turns estimated albedos into probabilities and drops nothing.
    pub(crate) fn finish(&mut self) {
        let share = |l: &FlatLobe<S>| {
            let largest = l.albedo[0].max(l.albedo[1]).max(l.albedo[2]).max(S::zero());
            // Weights reach 1e30; what matters is their ratio, and that their sum stays finite.
            largest.min(S::c(1e30))
        };
        let total = self.lobes.iter().map(share).fold(S::zero(), |a, b| a + b);
        let n = self.lobes.len();
        for l in &mut self.lobes {
            let p = if total > S::zero() { share(l) / total } else { S::one() / S::c(n as f64) };
            l.probability = p;
        }
        self.emission = self.emission.map(|e| e.min(S::c(1e30)));
        for s in &mut self.signals {
            s.value = s.value.map(|v| v.min(S::c(1e30)));
        }
    }

    /// f·|cos| and pdf of one direction.
    ///
    /// `wi`: world space, unit, away from the surface. A direction that is not finite, or shorter than ½ or longer than
    /// 2, gives black and pdf 0.
    pub fn eval(&self, wi: impl Into<[S; 3]>) -> Eval<S> {
        let mut pdf = S::zero();
        let f_cos = self.sum(vector(wi.into()), Cosine::Light, |l, local| {
            pdf = l.probability.mul_add(l.lobe.pdf(local), pdf);
        });
        Eval { f_cos, pdf }
    }

    /// [`eval`](Self::eval) of many directions at once, eight at a time. Gives bit for bit what `eval` gives.
    ///
    /// # Panics
    /// If `out` is shorter than `wi`.
    pub fn eval_batch(&self, wi: &[[f32; 3]], out: &mut [Eval])
    where
        F32x8: Lift<S>,
    {
        assert!(out.len() >= wi.len(), "{} results for {} directions", out.len(), wi.len());
        for (wi, out) in wi.chunks(F32x8::LANES).zip(out.chunks_mut(F32x8::LANES)) {
            let lane = |c: usize| F32x8(std::array::from_fn(|i| wi.get(i).map_or(0.0, |w| w[c])));
            let mut pdf = F32x8::zero();
            let f_cos = self.sum(V3::new(lane(0), lane(1), lane(2)), Cosine::Light, |l, local| {
                pdf = F32x8::lift(l.probability).mul_add(l.lobe.pdf(local), pdf);
            });
            for i in 0..wi.len() {
                out[i] = Eval { f_cos: f_cos.map(|f| f.0[i]), pdf: pdf.0[i] };
            }
        }
    }

    /// Memory in use: the parts a walk touches, not the room kept for more lobes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.ops)
            + size_of_val(&*self.lobes)
            + size_of_val(&*self.layers)
            + size_of_val(&*self.frames)
            + 2 * size_of::<V3<S>>()
            + size_of::<Rgb<S>>()
            + 4 * size_of::<usize>()
    }

    /// [`eval`](Self::eval) with |N·ωo| in place of |N·ωi| and, across media, times (ηo/ηi)²: what E_light integrates
    /// over ωo.
    pub fn eval_adjoint(&self, wi: [S; 3]) -> Rgb<S> {
        self.sum(vector(wi), Cosine::View, |_, _| {})
    }

    /// Σ w·f without cosines, times ηo/ηi across media: symmetric in its directions if the BSDF is reciprocal.
    pub fn f(&self, wi: [S; 3]) -> Rgb<S> {
        self.sum(vector(wi), Cosine::None, |_, _| {})
    }

    /// Draws a direction from three uniform numbers in [0, 1): two for the direction, one to choose the lobe.
    /// `None` where nothing is scattered that way (a black BSDF, a direction below the horizon).
    pub fn sample(&self, u: [S; 3]) -> Option<Sample<S>> {
        let index = self.choose(u[2])?;
        let l = &self.lobes[index];
        let frame = &self.frames[l.frame as usize];
        let transmit = |wi: V3<S>| (self.ng.dot(wi) * self.ng.dot(self.wo)).lt(S::zero());
        if l.delta {
            let (local, _) = l.lobe.delta()?;
            let wi = frame.to_world(local);
            let f_cos = self.lobe_delta(index, true)?;
            let flags = SampleFlags { transmit: transmit(wi), delta: true, ..SampleFlags::default() };
            let eta = S::one() / l.lobe.relative_eta(local);
            return Self::sampled(wi, Eval { f_cos, pdf: l.probability }, flags, eta);
        }
        let local = l.lobe.sample([u[0], u[1]]);
        let wi = frame.to_world(local);
        let subsurface = matches!(l.lobe, AnyLobe::Subsurface(_));
        let flags = SampleFlags { transmit: transmit(wi), delta: false, subsurface };
        Self::sampled(wi, self.eval_own(wi, index)?, flags, S::one() / l.lobe.relative_eta(local))
    }

    /// [`eval`](Self::eval) of a direction that lobe `index` gave. `None` where that lobe's density is 0, as below a
    /// horizon: another lobe may scatter there, but the sample is not one of its own.
    fn eval_own(&self, wi: V3<S>, index: usize) -> Option<Eval<S>> {
        let (mut pdf, mut own, mut at) = (S::zero(), S::zero(), 0);
        let f_cos = self.sum(wi, Cosine::Light, |l, local| {
            let part = l.lobe.pdf(local);
            own = if at == index { part } else { own };
            pdf = l.probability.mul_add(part, pdf);
            at += 1;
        });
        (own > S::zero()).then_some(Eval { f_cos, pdf })
    }

    fn sampled(wi: V3<S>, eval: Eval<S>, flags: SampleFlags, eta: S) -> Option<Sample<S>> {
        let Eval { f_cos, pdf } = eval;
        let weight = f_cos.map(|f| f / pdf);
        let fine = pdf > S::zero() && weight.iter().all(|w| w.is_finite());
        fine.then_some(Sample { wi: [wi.x, wi.y, wi.z], f_cos, pdf, weight, flags, eta })
    }

    /// The lobe that `u` in [0, 1) falls to.
    fn choose(&self, u: S) -> Option<usize> {
        let mut rest = u.max(S::zero());
        let mut last = None;
        for (i, l) in self.lobes.iter().enumerate() {
            if l.probability > S::zero() {
                last = Some(i);
                if rest < l.probability {
                    return last;
                }
                rest -= l.probability;
            }
        }
        // Rounding may leave a little over.
        last
    }

    /// Radiance given off toward ωo.
    pub fn emission(&self) -> Rgb<S> {
        self.emission
    }

    /// What the material tells the renderer beside light: `holdout`, `background` and `debug`, one entry per kind and name.
    pub fn signals(&self) -> &[Signal<S>] {
        &self.signals
    }

    pub(crate) fn signal(&mut self, kind: SignalKind, value: Rgb<S>) {
        match self.signals.iter_mut().find(|s| s.kind == kind) {
            Some(s) => s.value = std::array::from_fn(|c| s.value[c] + value[c]),
            None => self.signals.push(Signal { kind, value }),
        }
    }

    /// What is to be scattered below the surface, for a renderer that does so itself. The BSDF counts it as diffuse.
    pub fn subsurface(&self) -> impl Iterator<Item = SubsurfacePart<S>> {
        self.lobes.iter().filter_map(|l| match &l.lobe {
            AnyLobe::Subsurface(lobe) => {
                let (radius, anisotropy, ior) = lobe.medium();
                let n = self.frames[l.frame as usize].n;
                Some(SubsurfacePart { albedo: l.albedo, normal: [n.x, n.y, n.z], radius, anisotropy, ior })
            }
            _ => None,
        })
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
        let mut bound = [S::zero(); 3];
        self.walk(vector(w), true, |_, _, _, _| {}, |b| bound = b);
        bound
    }

    /// What the delta lobes scatter, exactly: the part of the albedo that `eval` leaves out.
    pub fn delta_albedo(&self) -> Rgb<S> {
        self.delta_parts().fold([S::zero(); 3], |sum, (_, part)| std::array::from_fn(|c| sum[c] + part[c]))
    }

    /// The delta lobes: the direction each scatters to (world space) and how much, weights and layers included.
    pub fn delta_parts(&self) -> impl Iterator<Item = ([S; 3], Rgb<S>)> {
        (0..self.lobes.len()).filter_map(|i| Some((self.lobe_delta_direction(i)?, self.lobe_delta(i, true)?)))
    }

    /// The direction delta lobe `index` scatters to, in world space; `None` for other lobes.
    pub(crate) fn lobe_delta_direction(&self, index: usize) -> Option<[S; 3]> {
        let (local, _) = self.lobes[index].lobe.delta()?;
        let wi = self.frames[self.lobes[index].frame as usize].to_world(local);
        Some([wi.x, wi.y, wi.z])
    }

    /// The direction lobe `index` scatters to for two uniform numbers, in world space; `None` for delta lobes, where it
    /// scatters nothing that way, and for lobes that do not count.
    pub(crate) fn lobe_sample(&self, index: usize, u: [S; 2]) -> Option<[S; 3]> {
        let l = &self.lobes[index];
        if l.delta || l.probability <= S::zero() {
            return None;
        }
        let local = l.lobe.sample(u);
        let wi = self.frames[l.frame as usize].to_world(local);
        (l.lobe.pdf(local) > S::zero()).then_some([wi.x, wi.y, wi.z])
    }

    /// What delta lobe `index` scatters, with or without the layers above it (which look at ωo and at its own
    /// direction); `None` for other lobes.
    pub(crate) fn lobe_delta(&self, index: usize, layered: bool) -> Option<Rgb<S>> {
        let l = &self.lobes[index];
        let (local, part) = l.lobe.delta()?;
        let wi = self.frames[l.frame as usize].to_world(local);
        let mut scale = [S::one(); 3];
        if layered {
            self.walk(
                wi,
                false,
                |i, _, s, _| {
                    if i == index {
                        scale = s
                    }
                },
                |_| {},
            );
        }
        Some(std::array::from_fn(|c| l.weight[c] * scale[c] * part[c]))
    }

    /// w·f·|cos θi| of lobe `index` alone, with or without the layers above it.
    pub(crate) fn lobe_part(&self, index: usize, wi: V3<S>, layered: bool) -> Rgb<S> {
        let mut result = [S::zero(); 3];
        self.walk(
            wi,
            false,
            |i, l, scale, local| {
                if i == index {
                    let scale = if layered { scale } else { [S::one(); 3] };
                    result = weighted(l, scale, local, Cosine::Light);
                }
            },
            |_| {},
        );
        result
    }

    /// Like `eval` (or `eval_adjoint`) with only the lobes whose frame and kind `pick` accepts.
    pub(crate) fn part(&self, wi: V3<S>, adjoint: bool, pick: impl Fn(&Frame<S>, LobeKind) -> bool) -> Rgb<S> {
        let cosine = if adjoint { Cosine::View } else { Cosine::Light };
        let mut sum = [S::zero(); 3];
        self.walk(
            wi,
            false,
            |_, l, scale, local| {
                if pick(&self.frames[l.frame as usize], l.kind) {
                    let part = weighted(l, scale, local, cosine);
                    for c in 0..3 {
                        sum[c] += part[c];
                    }
                }
            },
            |_| {},
        );
        sum
    }

    /// The frames in use, one per distinct normal and tangent.
    pub fn frames(&self) -> &[Frame<S>] {
        &self.frames
    }

    /// The frame of lobe `index`.
    pub fn lobe_frame(&self, index: usize) -> &Frame<S> {
        &self.frames[self.lobes[index].frame as usize]
    }

    /// What lobe `index` is, and the place in the program that made it.
    pub fn lobe_kind(&self, index: usize) -> (LobeKind, u32) {
        (self.lobes[index].kind, self.lobes[index].site)
    }

    #[inline]
    fn sum<L: Real + Lift<S>>(
        &self,
        wi: V3<L>,
        cosine: Cosine,
        mut each: impl FnMut(&FlatLobe<'m, S>, V3<L>),
    ) -> Rgb<L> {
        let mut sum = [L::zero(); 3];
        self.walk(
            wi,
            false,
            |_, l, scale, local| {
                let part = weighted(l, scale, local, cosine);
                for c in 0..3 {
                    sum[c] += part[c];
                }
                each(l, local);
            },
            |_| {},
        );
        // A million terms of weight 1e30 are still a number.
        sum.map(|x| x.min(L::c(f32::MAX as f64)))
    }

    /// Visits every lobe with what the layers above it scale it by for this ωi, and the direction in its frame.
    #[inline]
    fn walk<L: Real + Lift<S>>(
        &self,
        wi: V3<L>,
        bound: bool,
        visit: impl FnMut(usize, &FlatLobe<'m, S>, Rgb<L>, V3<L>),
        done: impl FnOnce(Rgb<L>),
    ) {
        match self.depth {
            0..=4 => self.walk_within::<L, 4>(wi, bound, visit, done),
            _ => self.walk_within::<L, { MAX_LAYERS as usize }>(wi, bound, visit, done),
        }
    }

    #[inline]
    fn walk_within<L: Real + Lift<S>, const D: usize>(
        &self,
        wi: V3<L>,
        bound: bool,
        mut visit: impl FnMut(usize, &FlatLobe<'m, S>, Rgb<L>, V3<L>),
        done: impl FnOnce(Rgb<L>),
    ) {
        let wi = unit_or_zero(wi);
        let mut stack = LayerStack::<L, D>::default();
        let (mut lobe, mut layer) = (0, 0);
        let mut frame = u32::MAX;
        let mut local = wi;
        for op in &self.ops {
            match *op {
                Op::Lobe => {
                    let l = &self.lobes[lobe];
                    if l.frame != frame {
                        frame = l.frame;
                        local = self.frames[frame as usize].to_local(wi);
                    }
                    let scale = match &l.balanced {
                        Some(balanced) => balanced.scale(local.z),
                        None => stack.scale(),
                    };
                    visit(lobe, l, scale, local);
                    lobe += 1;
                    if l.in_top || bound {
                        stack.lobe(l.weight_in_top, l.lobe.albedo_bound(local, l.curve));
                    }
                }
                Op::Begin => stack.begin(),
                Op::Middle => {
                    let LayerAlpha { alpha_o, weight } = self.layers[layer];
                    layer += 1;
                    stack.middle(weight, self.layering.rule, self.layering.tint, Some(alpha_o));
                }
                Op::End => stack.end(),
            }
        }
        done(stack.bound());
    }

    /// Whether every layer scales symmetrically in its directions.
    pub fn symmetric_layers(&self) -> bool {
        self.layers.is_empty() || self.layering.rule != LayeringRule::View
    }
}

#[inline(always)]
fn weighted<S: Scalar, L: Real + Lift<S>>(l: &FlatLobe<'_, S>, scale: Rgb<L>, local: V3<L>, cosine: Cosine) -> Rgb<L> {
    let f = l.lobe.f(local, l.curve);
    let cos = match cosine {
        Cosine::Light => local.z.abs().min(L::one()),
        Cosine::View => L::lift(l.cos_o) * l.lobe.relative_eta(local).sq(),
        Cosine::None => l.lobe.relative_eta(local),
    };
    std::array::from_fn(|c| L::lift(l.weight[c]) * scale[c] * f[c] * cos)
}

/// Directions that are not finite, or far from unit length, become zero: in every surface at once, hence black.
#[inline(always)]
fn unit_or_zero<L: Real>(w: V3<L>) -> V3<L> {
    let length = w.length_squared();
    let fine = length.gt(L::c(0.25)) & length.lt(L::c(4.0));
    w.map(|x| L::select(fine, x, L::zero()))
}

#[inline(always)]
fn vector<S: Real>(w: [S; 3]) -> V3<S> {
    V3::new(w[0], w[1], w[2])
}
