//! Lambertian reflection.

use super::limits::{Limits, SlotRange};
use super::registry::closure;
use super::{Lobe, Rgb};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3, sampling};

closure! {
    /// Lambertian reflection: f = 1/π where ωo and ωi lie on the normal's side. Albedo 1 on that side, 0 below.
    closure "diffuse" as DiffuseParams {
        /// Shading normal.
        normal N;
    }
    source: "Lambert 1760; OSL specification, diffuse()",
    reciprocal: true,
    class: Scatter,
}

/// See [`DiffuseParams`].
#[derive(Clone, Copy, Debug)]
pub struct Diffuse<S> {
    /// 1/π if ωo is on the normal's side, else 0.
    value: S,
}

impl<S: Real> Diffuse<S> {
    /// Scatters nothing.
    pub(crate) fn black() -> Self {
        Diffuse { value: S::zero() }
    }
}

impl<S: Real> Lobe<S> for Diffuse<S> {
    type Params = DiffuseParams;
    type Aimed = Self;

    fn limits(_: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        Some(Limits::above(cos, 1.0, 1.0))
    }

    fn new(_: &DiffuseParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Diffuse { value: S::select(wo.z.gt(S::zero()), S::c(std::f64::consts::FRAC_1_PI), S::zero()) }
    }

    #[inline(always)]
    fn toward(&self, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Option<Self> {
        Some(Diffuse { value: S::select(wo.z.gt(S::zero()), S::c(std::f64::consts::FRAC_1_PI), S::zero()) })
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::select(wi.z.gt(L::zero()), L::lift(self.value), L::zero()); 3]
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
        [S::select(w.z.gt(S::zero()), S::one(), S::zero()); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::select(w.z.gt(L::zero()), L::one(), L::zero()); 3]
    }
}
