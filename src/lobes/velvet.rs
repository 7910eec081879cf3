//! Velvet: Ashikhmin's inverted Gaussian under the smooth denominator, as Narkowicz 2018 writes it down.
//!
//! f = D·V, D = (1 + 4·exp(−cot²θh/m²)/sin⁴θh) / (π(1 + 4m²)), V = 1/(4(μo + μi − μoμi)). At low roughness (0.05–0.2)
//! a hard bright rim round an even, rather light body; in the middle (0.3–0.5) the rim widens and the body darkens,
//! as on crushed velvet; toward 1 a broad matt highlight with a harsh terminator.
//!
//! Where this departs from the source: D is written in cot²θh, which takes the 0/0 at h = n out of it (the limit there
//! is 1/(π(1 + 4m²))), and V is kept finite where both cosines vanish. The post's `π·n·l` is its convention for point
//! lights and no part of f. E stays below 0.86 for every roughness and angle.

use super::ltc::Ltc;
use super::ltc_tables::VELVET;
use super::registry::{ClosureParams, closure};
use super::{Lobe, Rgb, charlie};
use crate::albedo::curve::{no_cells, no_extra};
use crate::albedo::{AlbedoCurve, Axis, CurveSpec};
use crate::optics::{Over, Real, V3};
use std::f64::consts::FRAC_1_PI;

closure! {
    /// Velvet after Ashikhmin: an even body with a rim toward grazing angles. One-sided: black below the surface.
    closure "velvet" as VelvetParams {
        /// Shading normal.
        normal N;
        /// Width of the rim (source: m). Low: thin and bright; high: broad.
        float roughness = 0.3, in (0.01, 1.0);
    }
    source: "Ashikhmin & Premoze 2007; Neubelt & Pettineo 2013; Narkowicz 2018",
    reciprocal: true,
    class: Scatter,
}

/// See [`VelvetParams`].
#[derive(Clone, Copy, Debug)]
pub struct Velvet<S> {
    roughness: S,
    /// 1/m².
    inv_m2: S,
    /// 1/(π(1 + 4m²)) on the normal's side, else 0.
    scale: S,
    wo: V3<S>,
    ltc: Ltc<S>,
}

impl<S: Real> Velvet<S> {
    fn prepare(roughness: S, wo: V3<S>) -> Self {
        let m2 = roughness.sq();
        let scale = S::c(FRAC_1_PI) / S::c(4.0).mul_add(m2, S::one());
        Velvet {
            roughness,
            inv_m2: S::one() / m2,
            scale: S::select(wo.z.gt(S::zero()), scale, S::zero()),
            wo,
            ltc: Ltc::proposal(&VELVET, wo, roughness),
        }
    }

    #[inline(always)]
    fn value<L: Over<S>>(&self, wi: V3<L>) -> L {
        let wo = V3::<L>::lift(self.wo);
        // 1/sin⁴ = (1 + cot²)²; the exponential has long vanished at the cap.
        let cot2 = charlie::half_cot2(wo, wi).min(L::c(1e6));
        let rim = L::c(4.0) * (-cot2 * L::lift(self.inv_m2)).exp() * (L::one() + cot2).sq();
        let f = L::lift(self.scale) * (L::one() + rim) * charlie::visibility(wo.z, wi.z);
        L::select(wi.z.gt(L::zero()), f, L::zero())
    }

    /// What [`CurveSpec`] integrates: key = [roughness].
    fn kernel(key: &[f64; 4], wo: V3<f64>, wi: &[V3<f64>], out: &mut [f64]) {
        let lobe = Velvet::<f64>::prepare(key[0], wo);
        for (out, wi) in out.iter_mut().zip(wi) {
            *out = lobe.value(*wi);
        }
    }
}

impl<S: Real> Lobe<S> for Velvet<S> {
    type Params = VelvetParams;
    type Aimed = Self;

    fn curve(values: &[Option<f32>]) -> Option<CurveSpec> {
        let spec = &VelvetParams::SPEC.params[1];
        let roughness = values[3].map(|v| spec.clamp(0, v) as f64);
        Some(CurveSpec {
            kernel: Velvet::<f64>::kernel,
            key: [roughness.unwrap_or(0.0), 0.0, 0.0, 0.0],
            axis: roughness.is_none().then_some(Axis { index: 0, lo: spec.min as f64, hi: spec.max as f64 }),
            reciprocal: true,
            bounded: false,
            extra: no_extra,
            cells: no_cells,
        })
    }

    fn new(params: &VelvetParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Velvet::prepare(S::from_f32(params.roughness), wo)
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [self.value(wi); 3]
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.ltc.pdf(wi)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        self.ltc.sample(u)
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [curve.view(w, self.roughness); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [curve.bound(w, L::lift(self.roughness)); 3]
    }
}
