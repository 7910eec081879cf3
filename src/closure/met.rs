//! The lobes of a BSDF: where each stands in the tree, and what it keeps of ωo.

use super::sites::Known;
use crate::albedo::AlbedoCurve;
use crate::lobes::diffuse::Diffuse;
use crate::lobes::{AimedLobe, AnyLobe, Evaluated, Rgb};
use crate::optics::{Frame, Real, Scalar, V3, rgb};
use smallvec::SmallVec;

/// Where a lobe stands in the tree: the same at every point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place<E> {
    /// From the root of the innermost top; the fourth is idle.
    pub weight_in_top: [E; 4],
    pub site: u32,
    pub frame: u32,
    /// Where among [`Bsdf::rests`] there is what the lobe does not keep itself; [`KNOWN`]: at its site.
    pub rest: u32,
    /// What [`FlatStack`] is to do first.
    pub steps: u8,
    /// It stands in a top.
    pub inside: bool,
    /// It does, and its bound is needed for every ωi.
    pub in_top: bool,
    pub delta: bool,
}

impl<E> Place<E> {
    /// It stands in a top whose bound is asked for toward ωo alone.
    #[inline(always)]
    pub fn of_view(&self) -> bool {
        self.inside && !self.in_top
    }
}

/// See [`Place::rest`].
pub(crate) const KNOWN: u32 = u32::MAX;

/// One lobe of a flattened tree, for one ωo.
#[derive(Clone, Debug)]
pub(crate) struct FlatLobe<'m, S: Real> {
    /// Its weight from the root of the tree, per channel; then its probability of being chosen by `sample`. In one, because
    /// f and pdf are worked out side by side.
    pub share: [S; 4],
    /// What it is estimated to scatter for this ωo, weights and layers included.
    pub albedo: Rgb<S>,
    /// α toward ωo of the layer that dims it, where its steps say that its base begins.
    pub alpha_o: S,
    /// Its table, and the rest of it if its parameters are known.
    pub known: &'m Known<S::Entry>,
    pub lobe: AimedLobe<S>,
}

impl<S: Real> FlatLobe<'_, S> {
    /// Of being chosen by `sample`.
    pub fn probability(&self) -> S {
        self.share[3]
    }

    /// Estimates what it scatters toward ωo where the layers above scale it by `scale` and its own albedo there is `albedo`;
    /// `share` holds its weight. Returns what its probability is in proportion to.
    #[inline(always)]
    pub fn weigh(&mut self, scale: Rgb<S>, albedo: Rgb<S>) -> S {
        self.albedo = rgb!(c => self.share[c] * scale[c] * albedo[c]);
        let largest = self.albedo[0].max(self.albedo[1]).max(self.albedo[2]).max(S::zero());
        // Weights reach 1e30; what matters is their ratio, and that their sum stays finite.
        self.share[3] = largest.min(S::c(1e30));
        self.share[3]
    }
}

/// A lobe with where it stands.
#[derive(Clone, Copy)]
pub(crate) struct Met<'b, 'm, S: Scalar> {
    pub place: &'b Place<S>,
    pub flat: &'b FlatLobe<'m, S>,
    /// The BSDF's own.
    pub rests: &'b SmallVec<[AnyLobe<S>; 8]>,
}

impl<'b, S: Scalar> Met<'b, '_, S> {
    #[inline(always)]
    pub fn curve(&self) -> &'b AlbedoCurve<S> {
        &self.flat.known.curve
    }

    /// What the lobe does not keep itself.
    #[inline(always)]
    pub fn rest(&self) -> Option<&'b AnyLobe<S>> {
        match self.place.rest {
            KNOWN => self.flat.known.lobe(),
            own => self.rests.get(own as usize),
        }
    }

    /// All of it.
    pub fn whole(&self) -> AnyLobe<S> {
        self.flat.lobe.whole(self.rest()).unwrap_or(AnyLobe::Diffuse(Diffuse::black()))
    }

    /// See [`AimedLobe::evaluate`].
    #[inline(always)]
    pub fn evaluate(&self, wi: V3<S>, bound: bool) -> Evaluated<S> {
        self.flat.lobe.evaluate(|| self.rest(), wi, self.curve(), bound)
    }

    pub fn f(&self, wi: V3<S>) -> Rgb<S> {
        self.flat.lobe.f(self.rest(), wi, self.curve())
    }

    pub fn pdf(&self, wi: V3<S>) -> S {
        self.flat.lobe.pdf(self.rest(), wi)
    }

    /// See [`AnyLobe::delta`]; `None` for lobes of another class, without making them again.
    pub fn delta(&self) -> Option<(V3<S>, Rgb<S>)> {
        if self.place.delta { self.whole().delta() } else { None }
    }

    pub fn relative_eta(&self, wi: V3<S>) -> S {
        self.whole().relative_eta(wi)
    }

    #[inline(always)]
    pub fn sample(&self, u: [S; 2]) -> V3<S> {
        self.flat.lobe.sample(|| self.rest(), u)
    }

    /// The bound on ωo's side alone.
    pub fn view_bound(&self, wo: V3<S>) -> Rgb<S> {
        self.flat.lobe.view_bound(self.rest(), wo, self.curve())
    }

    /// The bound at a direction, if it is asked for.
    pub fn bound(&self, w: V3<S>, asked: bool) -> Rgb<S> {
        if asked { self.flat.lobe.albedo_bound(self.rest(), w, self.curve()) } else { [S::zero(); 3] }
    }
}

/// A layer's α toward ωo and its weight relative to the top it stands in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerAlpha<S> {
    pub alpha_o: Rgb<S>,
    pub weight: Rgb<S>,
}

/// What a walk goes over, looked up once.
#[derive(Clone, Copy)]
pub(crate) struct Lists<'b, 'm, S: Scalar> {
    pub places: &'b [Place<S>],
    pub lobes: &'b [FlatLobe<'m, S>],
    pub frames: &'b [Frame<S>],
    pub rests: &'b SmallVec<[AnyLobe<S>; 8]>,
}

impl<'b, 'm, S: Scalar> Lists<'b, 'm, S> {
    #[inline(always)]
    pub fn met(self) -> impl ExactSizeIterator<Item = Met<'b, 'm, S>> {
        self.places.iter().zip(self.lobes).map(move |(place, flat)| Met { place, flat, rests: self.rests })
    }

    #[inline(always)]
    pub fn lobe(self, index: usize) -> Met<'b, 'm, S> {
        Met { place: &self.places[index], flat: &self.lobes[index], rests: self.rests }
    }

    /// The lobe that `u` in [0, 1) falls to.
    #[inline(always)]
    pub fn choose(self, u: S) -> Option<usize> {
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
}
