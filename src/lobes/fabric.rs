//! Woven cloth seen from afar: the DreamWorks fabric, "Physically plausible fabric shading" (talk, 2017).
//!
//! f = (1 − |sin θh|)ⁿ / I_c. Light is thrown into a cone about the thread: θh is half the sum of the two directions'
//! angles to the plane across the thread T. At roughness 0 (n = 30) a tight satin band across the threads; at 0.5
//! (n = 8) the broad shine of polished cotton; at 1 (n = 1) hardly a highlight is left.
//!
//! Where this departs from the talk: n stays real (rounding it up makes 30 visible steps); the constant includes the
//! cosine at the surface, without which normal incidence reflects only 0.53–0.63; it is integrated with positive terms,
//! because the binomial sum loses all digits in single precision by n = 30; the printed density does not integrate to
//! one and its inverse lacks an exponent, so sampling follows the derivation at [`Fabric::sample`].

use super::registry::{ClosureParams, closure};
use super::{Lobe, Rgb};
use crate::albedo::AlbedoCurve;
use crate::albedo::{COMPONENTS, FibreKey, FibreSpec, TableSpec};
use crate::optics::{Over, Real, V3, sampling};
use std::f64::consts::FRAC_1_PI;

closure! {
    /// Woven cloth whose threads run along T: a highlight in a cone about them. One-sided: black below the surface.
    closure "fabric" as FabricParams {
        /// Shading normal.
        normal N;
        /// Direction of the threads; its part along N is removed.
        vector T;
        /// Width of the highlight (talk: α): n = 1 + 29·(1 − α)². Low: satin; high: matt.
        float roughness = 0.5, in (0.0, 1.0);
        /// The exponent n itself, any real number, in place of the roughness; 0 leaves it to the roughness.
        @keyword float exponent = 0.0, in (0.0, 1000.0);
    }
    source: "DreamWorks fabric model (SIGGRAPH talk 2017), after Glumac & Doepp 2004",
    reciprocal: true,
    class: Scatter,
}

/// The largest exponent.
const MAX_EXPONENT: f64 = 1000.0;

/// n of a parameter block.
fn exponent(roughness: f64, exponent: f64) -> f64 {
    if exponent > 0.0 { exponent } else { 1.0 + 29.0 * (1.0 - roughness) * (1.0 - roughness) }
}

/// I_c(n) = 8 ∫₀^{π/4} (1 − sin x)ⁿ (1 − 2 sin² x)² dx: what a thread seen along the normal reflects, cosine included.
///
/// With y = −ln(1 − sin x) the power becomes e^{−ny} and the rest is smooth, so that 16 Gauss–Legendre points over the
/// part of the range that matters (e⁻²² is left out) do for any n ≥ 0.
pub fn normalization(n: f64) -> f64 {
    // −ln(1 − sin π/4).
    const END: f64 = 1.227_947_177_299_515;
    let end = END.min(22.0 / n.max(1e-9));
    let half = |(t, w): (f64, f64)| {
        [0.5 - 0.5 * t, 0.5 + 0.5 * t].map(|u| {
            let y = end * u;
            let left = (-y).exp();
            let s = 1.0 - left;
            let cos2 = left * (1.0 + s);
            let across = 1.0 - 2.0 * s * s;
            0.5 * w * (-n * y).exp() * left / cos2.sqrt() * across * across
        })
    };
    8.0 * end * GAUSS.iter().flat_map(|p| half(*p)).sum::<f64>()
}

/// The positive nodes and the weights of the 16-point Gauss–Legendre rule on [−1, 1].
const GAUSS: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_54),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_87),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_78),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_89),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_095),
];

/// See [`FabricParams`].
#[derive(Clone, Copy, Debug)]
pub struct Fabric<S> {
    /// sin θo and cos θo.
    sin: S,
    cos: S,
    n: S,
    /// 1/I_c above the surface, else 0.
    scale: S,
    /// The part of the mass of sin θh that is negative, times n + 1; and the whole, M·(n + 1).
    below: S,
    mass: S,
    /// The share of samples that follow the highlight; the others follow the cosine.
    share: S,
    /// The place of n in a table over it.
    place: S,
}

/// sin θh and cos θh. With a = θo and b = θi, sin a + sin b = 2 sin θh cos θd and cos a + cos b = 2 cos θh cos θd.
#[inline(always)]
fn half_angle<L: Real>(sin_o: L, cos_o: L, sin_i: L, cos_i: L) -> (L, L) {
    let (s, c) = (sin_o + sin_i, cos_o + cos_i);
    let inv = L::one() / s.mul_add(s, c * c).max(L::c(1e-30)).sqrt();
    ((s * inv).clamp(-L::one(), L::one()), (c * inv).clamp(L::zero(), L::one()))
}

/// (1 − |s|)ⁿ for s = sin θh, c = cos θh; 1 − |s| as c²/(1 + |s|) where that is more accurate.
#[inline(always)]
fn falloff<L: Real>(s: L, c: L, n: L) -> L {
    let s = s.abs();
    let left = L::select(s.gt(L::c(0.5)), c * c / (L::one() + s), L::one() - s);
    left.max(L::c(1e-30)).powf(n)
}

impl<S: Real> Fabric<S> {
    fn prepare(n: f64, wo: V3<S>) -> Self {
        let (zero, one, half) = (S::zero(), S::one(), S::c(0.5));
        let across = wo.y.mul_add(wo.y, wo.z * wo.z).sqrt();
        let (sin, cos) = (wo.x.clamp(-one, one), across.clamp(zero, one));
        let more = S::c(n + 1.0);
        // sin θh runs from −√((1 − sin θo)/2) to √((1 + sin θo)/2).
        let side = |s: S| {
            let twice = S::select(s.gt(half), cos * cos / (one + s), one - s);
            let end = (half * twice).safe_sqrt();
            one - (one - end).max(S::c(1e-30)).powf(more)
        };
        let (below, above) = (side(sin), side(-sin));
        Fabric {
            sin,
            cos,
            n: S::c(n),
            scale: S::select(wo.z.gt(zero), S::c(1.0 / normalization(n)), zero),
            below,
            mass: (below + above).max(S::c(1e-6)),
            share: S::c(n * n / (n * n + 6.0)),
            place: S::c((n / MAX_EXPONENT).cbrt()),
        }
    }

    #[inline(always)]
    fn value<L: Over<S>>(&self, wi: V3<L>) -> L {
        let cos_i = wi.y.mul_add(wi.y, wi.z * wi.z).sqrt();
        let (s, c) = half_angle(L::lift(self.sin), L::lift(self.cos), wi.x, cos_i);
        L::select(wi.z.gt(L::zero()), falloff(s, c, L::lift(self.n)) * L::lift(self.scale), L::zero())
    }

    /// What [`FibreSpec`] integrates: key = [n] or, where n varies, [its place].
    fn kernel(key: &FibreKey, wo: V3<f64>, wi: &[V3<f64>], out: &mut [[f64; COMPONENTS]]) {
        let n = if key[1] > 0.5 { MAX_EXPONENT * key[0].powi(3) } else { key[0] };
        let lobe = Fabric::<f64>::prepare(n, wo);
        for (out, wi) in out.iter_mut().zip(wi) {
            out[0] = lobe.value(*wi);
        }
    }
}

impl<S: Real> Lobe<S> for Fabric<S> {
    type Params = FabricParams;
    type Aimed = Self;

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let spec = FabricParams::SPEC;
        let value = |i: usize| {
            let p = &spec.params[i];
            values[spec.slot_of(p.name).unwrap_or(0)].map(|v| p.clamp(0, v) as f64)
        };
        let n = match (value(2), value(3)) {
            (_, Some(e)) if e > 0.0 => Some(e),
            (Some(r), Some(e)) => Some(exponent(r, e)),
            _ => None,
        };
        let mut key = [0.0; 16];
        (key[0], key[1]) = n.map_or((0.0, 1.0), |n| (n, 0.0));
        Some(TableSpec::Fibre(FibreSpec {
            kernel: Fabric::<f64>::kernel,
            key,
            components: 1,
            axis: n.is_none().then_some(0),
            width: 2.0 / n.unwrap_or(60.0).max(1.0),
            // f does not depend on φ: neither does its integral over the half circle around the thread.
            around: false,
            detail: 1.0,
            margin: 0.0,
            mirrored: true,
            weave: None,
        }))
    }

    fn new(params: &FabricParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Fabric::prepare(exponent(params.roughness as f64, params.exponent as f64), wo)
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [self.value(wi); 3]
    }

    /// A mixture of μi/π and (1 − |sin θh|)ⁿ·cos θh/(2M·cos θi) · ½ cos φi. Both have the φi of the target; the second
    /// has its ridge, the first its cos² θi, which is what matters for small n.
    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        let across2 = wi.y.mul_add(wi.y, wi.z * wi.z);
        let (s, c) = half_angle(L::lift(self.sin), L::lift(self.cos), wi.x, across2.sqrt());
        let fall = falloff(s, c, L::lift(self.n)) * (L::lift(self.n) + L::one());
        // cos φi / cos θi = μi / cos² θi.
        let ridge = L::c(0.25) * fall * c / L::lift(self.mass) / across2.max(L::c(1e-12));
        let share = L::lift(self.share);
        let even = (L::one() - share) * L::c(FRAC_1_PI);
        wi.z.max(L::zero()) * ridge.mul_add(share, even)
    }

    /// sin θh from its two-sided density (1 − |s|)ⁿ over what keeps θi within ±π/2, then θi = 2 θh − θo; φi from its
    /// cosine. A share goes evenly over the cosine. No sample falls below the surface.
    fn sample(&self, u: [S; 2]) -> V3<S> {
        let (zero, one, two) = (S::zero(), S::one(), S::c(2.0));
        let rest = one - self.share;
        let even = sampling::cosine_hemisphere([(u[0] / rest).clamp(zero, one), u[1]]);
        let v = ((u[0] - rest) / self.share.max(S::c(1e-6))).clamp(zero, one);
        let at = v * self.mass - self.below;
        let left = (one - at.abs()).clamp(S::c(1e-30), one);
        let s = (one - left.powf(one / (self.n + one))).clamp(zero, one).copysign(at);
        let (sin_2h, cos_2h) = (two * s * (one - s * s).safe_sqrt(), one - two * s * s);
        let sin = (sin_2h * self.cos - cos_2h * self.sin).clamp(-one, one);
        let cos = (cos_2h * self.cos + sin_2h * self.sin).clamp(zero, one);
        let sin_phi = two * u[1] - one;
        let ridge = V3::new(sin, cos * sin_phi, cos * two * (u[1] * (one - u[1])).safe_sqrt());
        let pick = |a: S, b: S| S::select(u[0].lt(rest), a, b);
        V3::new(pick(even.x, ridge.x), pick(even.y, ridge.y), pick(even.z, ridge.z))
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [curve.fibre().view(w, self.place)[0]; 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        // Never above 1: the constant is that of the most reflecting direction.
        [curve.fibre().bound(w, L::lift(self.place))[0].min(L::one()); 3]
    }
}
