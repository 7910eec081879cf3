//! EON: the energy-preserving Oren–Nayar model of Portsmouth, Kutz & Hill 2024.
//!
//! A rough diffuse surface (Fujii's form of Oren–Nayar) plus a reciprocal lobe that gives back what light bouncing
//! between the facets carries on. At roughness 0 it is Lambert; at 0.5 edges stay bright, as on clay; at 1 a lit ball
//! looks flat, and a saturated albedo gains saturation from the repeated bounces. White stays white at any roughness:
//! E = 1 exactly for albedo 1, so an even environment hides the ball.
//!
//! Where this departs from the paper: its albedo term (sin θ/cos θ)(1 − sin³θ) − sin θ is written without the
//! difference, so that nothing cancels at grazing angles, and it is sampled by a transformed cosine that keeps the
//! horizon in place, mixed with a uniform share ([`super::ltc`]), where the paper clips one that does not.

use super::limits::{Limits, SlotRange};
use super::lobe::keeps_seen;
use super::ltc::Ltc;
use super::ltc_tables::EON;
use super::registry::{ClosureParams, closure};
use super::{Lobe, Rgb};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3, rgb};
use std::f64::consts::{FRAC_1_PI, PI};

closure! {
    /// Rough diffuse reflection that loses no energy: what bounces between the facets is added back. Roughness 0 is
    /// Lambert. One-sided.
    closure "eon" as EonParams {
        /// Shading normal.
        normal N;
        /// Reflectance of the facets; at roughness 0 the albedo of the whole.
        color albedo = [0.8, 0.8, 0.8], in (0.0, 1.0);
        /// Spread of the facets' slopes (paper: r).
        float roughness = 0.5, in (0.0, 1.0);
    }
    source: "Portsmouth, Kutz & Hill 2024, eq. 13-24",
    reciprocal: true,
    class: Scatter,
}

/// The paper's constants: ½ − 2/(3π) and ⅔ − 28/(15π).
const C1: f64 = 0.5 - 2.0 / (3.0 * PI);
const C2: f64 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// See [`EonParams`].
#[derive(Clone, Copy, Debug)]
pub struct Eon<S> {
    rho: Rgb<S>,
    /// 1/(1 + C1·r), and r times that.
    a: S,
    b: S,
    roughness: S,
    /// Albedo of the repeated bounces.
    rho_ms: Rgb<S>,
    seen: EonSeen<S>,
}

/// What of an [`Eon`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct EonSeen<S> {
    wo: V3<S>,
    /// 1/π on the normal's side, else 0.
    scale: S,
    /// (1 − E(ωo))/(1 − mean E).
    missing: S,
    ltc: Ltc<S>,
}

keeps_seen!(Eon, EonSeen);

impl<S: Real> Eon<S> {
    /// The single-scattering albedo for white facets, A + (B/π)·G(μ).
    #[inline(always)]
    fn single<L: Over<S>>(&self, cos: L) -> L {
        let cos = cos.clamp(L::zero(), L::one());
        let sin = (L::one() - cos.sq()).safe_sqrt();
        let theta = sin.atan2(cos);
        let near = sin * (theta - sin * cos);
        // (s/c)(1 − s³) − s = s·[c(1 + s + s²)/(1 + s) − 1].
        let far = sin * (cos * (L::one() + sin + sin.sq()) / (L::one() + sin) - L::one());
        let g = L::c(2.0 / 3.0).mul_add(far, near);
        (L::lift(self.b) * L::c(FRAC_1_PI)).mul_add(g, L::lift(self.a)).min(L::one())
    }

    #[inline(always)]
    fn on_side<L: Real>(cos: L, value: L) -> L {
        L::select(cos.gt(L::zero()), value, L::zero())
    }

    /// E for facets of albedo ρ: single scattering and what it leaves to the bounces.
    #[inline(always)]
    fn total<L: Over<S>>(&self, cos: L) -> Rgb<L> {
        let e = self.single(cos);
        rgb!(c => {
            let (rho, ms) = (L::lift(self.rho[c]), L::lift(self.rho_ms[c]));
            Self::on_side(cos, rho.mul_add(e, ms * (L::one() - e)).min(L::one()))
        })
    }
}

impl<S: Real> Lobe<S> for Eon<S> {
    type Params = EonParams;
    type Aimed = EonSeen<S>;

    /// E = ρ·E₁ + ρms·(1 − E₁) with ρms = ρ²m/(1 − ρ(1 − m)) ≤ ρ: never above ρ.
    fn limits(_: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        Some(Limits::above(cos, 0.0, 1.0))
    }

    fn tint_slot() -> Option<usize> {
        EonParams::SPEC.slot_of("albedo")
    }

    fn new(params: &EonParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        let r = S::from_f32(params.roughness);
        let rho = params.albedo.map(S::from_f32);
        let a = S::one() / S::c(C1).mul_add(r, S::one());
        // 1 − A(1 + C2·r), without the difference.
        let lost = a * r * S::c(C1 - C2);
        let mean = S::one() - lost;
        let rho_ms = rho.map(|rho| rho.sq() * mean / (S::one() - rho * lost));
        let (zero, scale) = (S::zero(), Self::on_side(wo.z, S::c(FRAC_1_PI)));
        let seen = EonSeen { wo, scale, missing: zero, ltc: Ltc::proposal(&EON, wo, r) };
        let lobe = Eon { rho, a, b: a * r, roughness: r, rho_ms, seen };
        let missing = (S::one() - lobe.single(wo.z)) / lost.max(S::c(1e-6));
        Eon { seen: EonSeen { missing, ..seen }, ..lobe }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let wo = V3::<L>::lift(self.seen.wo);
        let s = wo.x.mul_add(wi.x, wo.y * wi.y);
        let forward = s / wo.z.max(wi.z).max(L::c(1e-6));
        let s = L::select(s.gt(L::zero()), forward, s);
        // s ≥ −1 for unit vectors; longer ones must not turn f negative.
        let single = L::lift(self.a) * L::lift(self.roughness).mul_add(s, L::one()).max(L::zero());
        let bounced = L::lift(self.seen.missing) * (L::one() - self.single(wi.z));
        let scale = Self::on_side(wi.z, L::lift(self.seen.scale));
        rgb!(c => scale * L::lift(self.rho[c]).mul_add(single, L::lift(self.rho_ms[c]) * bounced))
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.seen.ltc.pdf(wi)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        self.seen.ltc.sample(u)
    }

    fn albedo(&self, w: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        self.total(w.z)
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.total(w.z)
    }
}
