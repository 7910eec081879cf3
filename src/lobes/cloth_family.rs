//! One family of the threads of a woven cloth, and what is sampled of it. Not a lobe itself.

use super::cloth::{TANGENTS, Yarn};
use super::cylinder::{Around, Cylinder, Parts, Ridge, around_thread};
use super::{Rgb, cloth_range};
use crate::optics::{Over, Real, V3};
use std::f64::consts::PI;

/// The proposal for θi of one family: a ridge per tangent, taken as often as the tangent is seen.
#[derive(Clone, Copy, Debug)]
struct Proposal<S> {
    /// Center of the first tangent's ridge, and the step to the next.
    first: S,
    step: S,
    sigma: S,
    /// How much of each tangent's whole distribution there is; what lies beyond ±π/2 is left out.
    parts: [S; TANGENTS],
}

impl<S: Real> Proposal<S> {
    fn at(&self, k: usize) -> Ridge<S> {
        Ridge::new(self.step.mul_add(S::c(k as f64), self.first), self.sigma)
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, theta: L) -> L {
        let mut sum = L::zero();
        for (k, part) in self.parts.iter().enumerate() {
            let center = self.step.mul_add(S::c(k as f64), self.first);
            sum += L::lift(*part) * Ridge::<S>::density(theta, L::lift(center), L::lift(self.sigma));
        }
        sum
    }

    fn sample(&self, u: S) -> S {
        let mut rest = u;
        let mut theta = -self.first;
        let mut open = S::one();
        for (k, part) in self.parts.iter().enumerate() {
            let ridge = self.at(k);
            let p = *part * ridge.span();
            let inside = open.gt(S::zero()) & rest.lt(p);
            theta = S::select(inside, ridge.sample((rest / p.max(S::c(1e-9))).clamp(S::zero(), S::one())), theta);
            open = S::select(inside, S::zero(), open);
            rest -= p;
        }
        theta
    }
}

/// A family, prepared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Family<S> {
    cylinder: Cylinder<S>,
    /// Cosine and sine of the middle offset and of the step between offsets, in double precision: what turning by them
    /// leaves of a direction near a tangent plane is a small difference.
    middle: (f64, f64),
    step: (f64, f64),
    pub weights: &'static [f64; TANGENTS],
    pub cover: S,
    kd: S,
    /// Reflectance at normal incidence.
    head_on: S,
    pub color: Rgb<S>,
    /// Of the offsets, in radians: the first, and the step between them.
    first: S,
    stride: S,
    /// How wide the ridges of the proposal are.
    sigma: S,
}

/// What of a family depends on ωo.
#[derive(Clone, Copy, Debug)]
pub(super) struct FamilySeen<S> {
    /// See [`Proposal`].
    parts: [S; TANGENTS],
    /// How often it is sampled.
    pub share: S,
}

impl<S: Real> Family<S> {
    pub fn new(yarn: &Yarn) -> Self {
        let radians = |degrees: f32| S::c(degrees as f64 * PI / 180.0);
        let turn = |degrees: f64| {
            let (s, c) = degrees.to_radians().sin_cos();
            (c, s)
        };
        let range = yarn.hi as f64 - yarn.lo as f64;
        let stride = (radians(yarn.hi) - radians(yarn.lo)) * S::c(1.0 / (TANGENTS - 1) as f64);
        // A tangent stands for an interval as wide as the step: a standard deviation of step/√12.
        let spread = stride * S::c(12f64.sqrt().recip());
        // What comes from inside is most of it, and the wider.
        let width = (yarn.gamma_v as f64).to_radians();
        let sigma = 2.0 * width.hypot(range.to_radians() / ((TANGENTS - 1) as f64 * 12f64.sqrt()));
        let [eta, gamma_s, gamma_v] = [yarn.eta, yarn.gamma_s, yarn.gamma_v].map(S::from_f32);
        Family {
            cylinder: Cylinder::new(eta, gamma_s, gamma_v, spread),
            middle: turn((yarn.lo as f64 + yarn.hi as f64) / 2.0),
            step: turn(range / (TANGENTS - 1) as f64),
            weights: yarn.weights,
            cover: S::from_f32(yarn.cover),
            kd: S::from_f32(yarn.kd),
            head_on: ((eta - S::one()) / (eta + S::one())).sq(),
            color: yarn.color.map(S::from_f32),
            first: radians(yarn.lo),
            stride,
            sigma: S::c(sigma),
        }
    }

    /// What is sampled from ωo, in the family's frame.
    #[inline(always)]
    fn proposal(&self, wo: V3<S>, parts: [S; TANGENTS]) -> Proposal<S> {
        // An offset δ moves the ridge by −2δ.
        let two = S::c(2.0);
        let first = -(Around::new(wo).angle() + two * self.first);
        Proposal { first, step: -(two * self.stride), sigma: self.sigma, parts }
    }

    /// Seen from ωo, in the family's frame; `share` of the samples that go to threads are its own. `samples`: whether it is
    /// ever sampled; integrating needs no proposal.
    pub fn seen_from(&self, wo: V3<S>, share: f64, samples: bool) -> FamilySeen<S> {
        let mut ridges = self.proposal(wo, self.weights.map(S::c));
        let (mut total, mut weight, mut all) = (S::c(1e-9), S::zero(), S::c(1e-9));
        for k in 0..if samples { TANGENTS } else { 0 } {
            let (sin, cos) = (self.first + self.stride * S::c(k as f64)).sin_cos();
            let seen = (cos * wo.z - sin * wo.x).max(S::c(0.05));
            // Steep threads, at 45° and more, have their cone about the normal: it is no ridge along this family.
            let flat = (cos * cos - sin * sin).max(S::c(0.0));
            ridges.parts[k] *= seen;
            weight += ridges.parts[k] * flat;
            all += ridges.parts[k];
            ridges.parts[k] *= flat.max(S::c(1e-3));
            total += ridges.parts[k] * ridges.at(k).span();
        }
        FamilySeen { parts: ridges.parts.map(|p| p / total), share: S::c(0.75) * weight / all * S::c(share) }
    }

    /// Which part of its samples is taken close to the horizon on ωo's side of the thread: where both directions graze the
    /// thread on one side they are masked as one, and f·μ does not fall with the cosine. Signed as that side.
    #[inline(always)]
    fn beside(wo: V3<S>) -> S {
        let o = Around::new(wo);
        let beside = S::c(0.6) * (S::one() - o.pz.clamp(S::zero(), S::one())).sq();
        S::select(o.py.lt(S::zero()), -beside, beside)
    }

    /// A direction in the thread's frame: φi with density ½ cos φi, or sin φi on ωo's side.
    pub fn sample(&self, wo: V3<S>, seen: &FamilySeen<S>, u: S, v: S) -> V3<S> {
        let side = Self::beside(wo);
        let (theta, part) = (self.proposal(wo, seen.parts).sample(u), side.abs());
        let beside = v.lt(part);
        let rest = ((v - part) / (S::one() - part)).clamp(S::zero(), S::one());
        let cosine = around_thread(theta, rest);
        let low = S::one() - (v / part.max(S::c(1e-9))).clamp(S::zero(), S::one());
        let cos = cosine.y.mul_add(cosine.y, cosine.z * cosine.z).sqrt();
        let y = cos * (S::one() - low * low).safe_sqrt();
        let y = S::select(side.lt(S::zero()), -y, y);
        V3::new(cosine.x, S::select(beside, y, cosine.y), S::select(beside, cos * low, cosine.z))
    }

    /// How many offsets there are, one where all threads are flat, and their cosines and sines.
    #[inline(always)]
    pub fn tangents(&self) -> (usize, [(f64, f64); TANGENTS]) {
        // From the middle outward, so that no rounding tilts a tangent that lies flat.
        let ((mid_cos, mid_sin), (one_cos, one_sin)) = (self.middle, self.step);
        let (two_cos, two_sin) = (one_cos * one_cos - one_sin * one_sin, 2.0 * one_sin * one_cos);
        let turn = |c: f64, s: f64| (mid_cos * c - mid_sin * s, mid_sin * c + mid_cos * s);
        let tangents = [
            turn(two_cos, -two_sin),
            turn(one_cos, -one_sin),
            self.middle,
            turn(one_cos, one_sin),
            turn(two_cos, two_sin),
        ];
        let count = if self.weights[1..].iter().all(|w| *w == 0.0) { 1 } else { TANGENTS };
        (count, tangents)
    }

    /// Σ a·z⁺.
    #[inline(always)]
    pub fn seen<L: Over<S>>(&self, w: V3<L>) -> L {
        let mut sum = L::zero();
        let (count, tangents) = self.tangents();
        for (weight, (cos, sin)) in self.weights[..count].iter().zip(tangents) {
            sum += L::lift(self.cover) * L::c(*weight) * turned(w, cos, sin).z.max(L::zero());
        }
        sum
    }

    /// Σ a·z⁺, and Σ a·z⁺·R for the surface and the volume, R what a tangent reflects at most; see [`cloth_range`].
    #[inline(always)]
    pub fn facing<L: Over<S>>(&self, w: V3<L>) -> [L; 3] {
        let (head_on, kd) = (L::lift(self.head_on), L::lift(self.kd));
        let mut sums = [L::zero(); 3];
        let (count, tangents) = self.tangents();
        for (weight, (cos, sin)) in self.weights[..count].iter().zip(tangents) {
            let w = turned(w, cos, sin);
            let area = L::lift(self.cover) * L::c(*weight) * w.z.max(L::zero());
            let across = w.y.mul_add(w.y, w.z * w.z).sqrt();
            let (forward, even) = (cloth_range::forward(head_on, across), cloth_range::even(head_on, across));
            sums[0] += area;
            sums[1] += area * cloth_range::surface(head_on, across);
            sums[2] += area * kd.mul_add(even - forward, forward);
        }
        sums
    }

    /// Adds Σ a·S·M to the surface and volume sums, and Σ a·z⁺ of ωi to `q`.
    #[inline(always)]
    pub fn add<L: Over<S>>(&self, wo: V3<L>, wi: V3<L>, surface: &mut L, volume: &mut L, q: &mut L) {
        let (zero, kd) = (L::zero(), L::lift(self.kd));
        let (count, tangents) = self.tangents();
        for (weight, (cos, sin)) in self.weights[..count].iter().zip(tangents) {
            let (lo, li) = (turned(wo, cos, sin), turned(wi, cos, sin));
            let (o, i) = (Around::new(lo), Around::new(li));
            let area = L::lift(self.cover) * L::c(*weight);
            *q += area * li.z.max(zero);
            let correlated = (L::c(-0.5 / (20.0 * PI / 180.0f64).powi(2)) * o.turn(i)).exp();
            let apart = lo.z.max(zero) * li.z.max(zero);
            let together = o.pz.min(i.pz).max(zero) * o.cos * i.cos;
            let seen = area * correlated.mul_add(together - apart, apart);
            let Parts { surface: s, forward, even } = self.cylinder.parts(o, i);
            *surface += seen * s;
            *volume += seen * kd.mul_add(even - forward, forward);
        }
    }
}

/// A direction where the tangent at this offset is x and its normal z.
#[inline(always)]
fn turned<L: Real>(w: V3<L>, cos: f64, sin: f64) -> V3<L> {
    V3::new(w.x.turned(cos, w.z, sin), w.y, w.z.turned(cos, w.x, -sin))
}

impl<S: Real> Family<S> {
    /// Over solid angle, of sampling along the ridges, `w` in the family's frame.
    #[inline(always)]
    pub fn density<L: Over<S>>(&self, wo: V3<S>, seen: &FamilySeen<S>, w: V3<L>) -> L {
        let i = Around::new(w);
        let beside = L::lift(Self::beside(wo));
        let turn = (L::one() - beside.abs()).mul_add(L::c(0.5) * w.z, (beside * w.y).max(L::zero()));
        self.proposal(wo, seen.parts).pdf(i.angle()) * turn / i.cos.sq().max(L::c(1e-12))
    }
}
