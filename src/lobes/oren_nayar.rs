//! Rough diffuse reflection: the qualitative model of Oren & Nayar 1994.
//!
//! f = (A + B·max(0, cos Δφ)·sin α·tan β) / π. At sigma 0 it is Lambert; at 0.3 the edge of a lit ball stays bright,
//! as on plaster; toward π/2 the ball looks flat, as a full moon does.
//!
//! The published form gains up to 1.5 % at grazing angles for sigma near 0.2 (E = A + B/2 there). Its albedo has the
//! closed form used below, so the lobe is divided by max(1, E(ωo), E(ωi)), which keeps it reciprocal.

use super::limits::{Limits, SlotRange};
use super::registry::{ClosureParams, closure};
use super::{Lobe, Rgb};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, Scalar, V3, sampling};
use std::f64::consts::FRAC_1_PI;

closure! {
    /// Rough diffuse reflection, brighter toward the light's own direction than Lambert's. Sigma 0 is Lambert.
    closure "oren_nayar" as OrenNayarParams {
        /// Shading normal.
        normal N;
        /// Standard deviation of the facets' slope angle, in radians.
        float sigma = 0.3, in (0.0, 1.5707964);
    }
    source: "Oren & Nayar 1994, eq. 30 (qualitative model)",
    reciprocal: true,
    class: Scatter,
}

/// See [`OrenNayarParams`].
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar<S> {
    a: S,
    b: S,
    wo: V3<S>,
    /// Whether E, which is highest at the horizon, exceeds 1 there.
    gains: bool,
    /// max(1, E(ωo)).
    excess: S,
    /// 1/π on the normal's side, else 0.
    scale: S,
}

impl<S: Real> OrenNayar<S> {
    /// The published lobe's albedo at `cos` > 0: A + B/π·[sin θ(θ − sin θ cos θ) + ⅔·tan θ(1 − sin³ θ)], written so
    /// that nothing cancels at grazing angles; next to the normal the sine has digits that the cosine has lost.
    #[inline(always)]
    fn raw_albedo<L: Over<S>>(&self, w: V3<L>) -> L {
        let cos = w.z.clamp(L::zero(), L::one());
        let sin = w.x.mul_add(w.x, w.y.sq()).sqrt().min(L::one());
        let near = sin * beyond_sine(sin, cos);
        let far = L::c(2.0 / 3.0) * sin * cos * (L::one() + sin + sin.sq()) / (L::one() + sin);
        (L::lift(self.b) * L::c(FRAC_1_PI)).mul_add(near + far, L::lift(self.a))
    }

    #[inline(always)]
    fn on_side<L: Real>(cos: L, value: L) -> L {
        L::select(cos.gt(L::zero()), value, L::zero())
    }
}

/// (θ − sin θ·cos θ)/(sin θ·(1 − cos θ)) over the cosine in [0, 1]: a polynomial that departs from it by 3.3e-8 of its value.
const BEYOND_SINE: [f64; 9] = [
    1.57079628,
    -0.429195112,
    0.355952212,
    -0.307779153,
    0.263105357,
    -0.202181297,
    0.121138035,
    -0.0469809388,
    0.00847798898,
];

/// θ − sin θ·cos θ for θ in [0, π/2].
#[inline(always)]
fn beyond_sine<L: Real>(sin: L, cos: L) -> L {
    if !L::Entry::SINGLE {
        return sin.atan2(cos) - sin * cos;
    }
    let mut ratio = L::zero();
    for k in (0..BEYOND_SINE.len()).rev() {
        ratio = ratio.mul_add(cos, L::c(BEYOND_SINE[k]));
    }
    sin * (L::one() - cos) * ratio
}

impl<S: Real> Lobe<S> for OrenNayar<S> {
    type Params = OrenNayarParams;
    type Aimed = Self;

    /// A falls and B rises with sigma; of the two parts of the sum the first falls with μ, the second is s(1 + s + s²)/
    /// (1 + s), rising with s, times μ.
    fn limits(ranges: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        const PIECES: usize = 16;
        let spec = &OrenNayarParams::SPEC.params[1];
        let (lo, hi) = ranges.get(3).map_or((spec.min, spec.max), |r| (spec.clamp(0, r.0), spec.clamp(0, r.1)));
        let at = |sigma: f32| {
            OrenNayar::<f64>::new(
                &OrenNayarParams { N: [0.0, 0.0, 1.0], sigma },
                V3::new(0.0, 0.0, 1.0),
                &AlbedoCurve::default(),
            )
        };
        let (least, most) = (at(lo), at(hi));
        let (from, to) = (cos.0.clamp(0.0, 1.0), cos.1.clamp(0.0, 1.0));
        let sine = |c: f64| (1.0 - c * c).max(0.0).sqrt();
        let mut highest = 0.0f64;
        for k in 0..PIECES {
            let node = |k: usize| from + (to - from) * k as f64 / PIECES as f64;
            let (c, s) = (node(k + 1), sine(node(k)));
            let near = s * (s.atan2(node(k)) - s * node(k));
            let far = 2.0 / 3.0 * s * c * (1.0 + s + s * s) / (1.0 + s);
            highest = highest.max(least.a + most.b * FRAC_1_PI * (near + far));
        }
        Some(Limits::above(cos, 0.0, highest.min(1.0)))
    }

    fn new(params: &OrenNayarParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        let var = S::from_f32(params.sigma).sq();
        let variance = f64::from(params.sigma).powi(2);
        let lobe = OrenNayar {
            a: S::one() - S::c(0.5) * var / (var + S::c(0.33)),
            b: S::c(0.45) * var / (var + S::c(0.09)),
            wo,
            // A + B/2, and a little.
            gains: 0.225 / (variance + 0.09) > 0.4999 / (variance + 0.33),
            excess: S::one(),
            scale: Self::on_side(wo.z, S::c(FRAC_1_PI)),
        };
        OrenNayar { excess: if lobe.gains { lobe.raw_albedo(wo).max(S::one()) } else { S::one() }, ..lobe }
    }

    fn toward(&self, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Option<Self> {
        let excess = if self.gains { self.raw_albedo(wo).max(S::one()) } else { S::one() };
        Some(OrenNayar { wo, excess, scale: Self::on_side(wo.z, S::c(FRAC_1_PI)), ..*self })
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let wo = V3::<L>::lift(self.wo);
        // sin θi·sin θo·cos Δφ over the larger cosine is sin α·tan β·cos Δφ.
        let across = (wo.x * wi.x + wo.y * wi.y).max(L::zero());
        let retro = across / wo.z.max(wi.z).max(L::c(1e-6));
        let f = L::lift(self.scale) * L::lift(self.b).mul_add(retro, L::lift(self.a));
        let f = if self.gains { f / self.raw_albedo(wi).max(L::lift(self.excess)) } else { f };
        [Self::on_side(wi.z, f); 3]
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        sampling::cosine_hemisphere_pdf(wi.z)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        sampling::cosine_hemisphere(u)
    }

    #[inline(always)]
    fn albedo(&self, w: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [Self::on_side(w.z, self.raw_albedo(w).min(S::one())); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [Self::on_side(w.z, self.raw_albedo(w).min(L::one())); 3]
    }
}
