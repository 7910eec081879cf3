//! Burley's diffuse reflection: a rough surface that darkens at its edge when smooth and lights up there when rough.
//!
//! f = ρ/π·(1 + (F90 − 1)(1 − μi)⁵)·(1 + (F90 − 1)(1 − μo)⁵), F90 = ½ + 2·roughness·cos²θd, θd half the angle between the
//! two directions. At roughness 0 a shadowed rim, as on skin under powder; at 0.5 close to Lambert; at 1 a bright rim that
//! follows the light.
//!
//! Where this departs from the source: from roughness 0.4 on the published lobe gains at grazing angles, up to 1.6 times what
//! arrives; it is divided by max(1, Ē(ωo), Ē(ωi)), which keeps it reciprocal.

use super::registry::{ClosureParams, closure};
use super::{Lobe, Rgb};
use crate::albedo::curve::{no_cells, no_extra};
use crate::albedo::{AlbedoCurve, Axis, CurveSpec};
use crate::optics::{Over, Real, V3, sampling};
use std::f64::consts::FRAC_1_PI;

closure! {
    /// Diffuse reflection with a rim: dark when smooth, bright when rough. One-sided.
    closure "burley_diffuse_bsdf" as BurleyParams {
        /// Shading normal.
        normal N;
        /// Color the lobe is multiplied with.
        color albedo = [0.8, 0.8, 0.8], in (0.0, 1.0);
        /// Low: a dark rim; high: a bright one.
        float roughness = 0.5, in (0.0, 1.0);
    }
    source: "Burley 2012, §5.3; MaterialX, burley_diffuse_bsdf",
    reciprocal: true,
    class: Scatter,
}

/// See [`BurleyParams`].
#[derive(Clone, Copy, Debug)]
pub struct Burley<S> {
    wo: V3<S>,
    roughness: S,
    /// 1/π on the normal's side, else 0.
    scale: S,
    /// (1 − μo)⁵.
    fall: S,
    /// The curve's excess at ωo.
    excess: S,
}

#[inline(always)]
fn fifth<L: Real>(x: L) -> L {
    let x = x.clamp(L::zero(), L::one());
    x.sq().sq() * x
}

impl<S: Real> Burley<S> {
    fn prepare(roughness: S, wo: V3<S>) -> Self {
        let scale = S::select(wo.z.gt(S::zero()), S::c(FRAC_1_PI), S::zero());
        Burley { wo, roughness, scale, fall: fifth(S::one() - wo.z), excess: S::one() }
    }

    /// f(ωo, ωi) for ρ = 1, before it is bounded.
    #[inline(always)]
    fn value<L: Over<S>>(&self, wi: V3<L>) -> L {
        let wo = V3::<L>::lift(self.wo);
        let cos2 = (L::c(0.5) * (L::one() + wo.dot(wi))).clamp(L::zero(), L::one());
        let rise = L::c(2.0) * L::lift(self.roughness) * cos2 - L::c(0.5);
        let factor = |fall: L| rise.mul_add(fall, L::one());
        let f = L::lift(self.scale) * factor(L::lift(self.fall)) * factor(fifth(L::one() - wi.z));
        L::select(wi.z.gt(L::zero()), f, L::zero())
    }

    /// What [`CurveSpec`] integrates: key = [roughness].
    fn kernel(key: &[f64; 4], wo: V3<f64>, wi: &[V3<f64>], out: &mut [f64]) {
        let lobe = Burley::<f64>::prepare(key[0], wo);
        for (out, wi) in out.iter_mut().zip(wi) {
            *out = lobe.value(*wi);
        }
    }
}

impl<S: Real> Lobe<S> for Burley<S> {
    type Params = BurleyParams;
    type Aimed = Self;

    fn curve(values: &[Option<f32>]) -> Option<CurveSpec> {
        let spec = &BurleyParams::SPEC.params[2];
        let roughness = values[6].map(|v| f64::from(spec.clamp(0, v)));
        Some(CurveSpec {
            kernel: Burley::<f64>::kernel,
            key: [roughness.unwrap_or(0.0), 0.0, 0.0, 0.0],
            axis: roughness.is_none().then_some(Axis { index: 0, lo: 0.0, hi: 1.0 }),
            reciprocal: true,
            bounded: true,
            extra: no_extra,
            cells: no_cells,
        })
    }

    fn tint_slot() -> Option<usize> {
        BurleyParams::SPEC.slot_of("albedo")
    }

    fn weight(params: &BurleyParams) -> [f32; 3] {
        params.albedo
    }

    fn new(params: &BurleyParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let lobe = Burley::prepare(S::from_f32(params.roughness), wo);
        Burley { excess: curve.excess(wo, lobe.roughness), ..lobe }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let excess = curve.excess(wi, L::lift(self.roughness)).max(L::lift(self.excess));
        [self.value(wi) / excess; 3]
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        sampling::cosine_hemisphere_pdf(wi.z)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        sampling::cosine_hemisphere(u)
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [curve.view(w, self.roughness); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [curve.bound(w, L::lift(self.roughness)); 3]
    }
}
