//! Lambertian transmission.

use super::limits::{Limits, SlotRange};
use super::registry::closure;
use super::{Lobe, Rgb, Sides};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3, sampling};

closure! {
    /// Lambertian transmission: f = 1/π where ωo and ωi lie on opposite sides, either way round. Albedo 1 from both.
    closure "translucent" as TranslucentParams {
        /// Shading normal.
        normal N;
    }
    source: "OSL specification, translucent()",
    reciprocal: true,
    class: Scatter,
}

/// See [`TranslucentParams`].
#[derive(Clone, Copy, Debug)]
pub struct Translucent<S> {
    /// +1 if ωo is above the surface, −1 below, 0 in it.
    side: S,
}

impl<S: Real> Lobe<S> for Translucent<S> {
    type Params = TranslucentParams;
    type Aimed = Self;

    fn limits(_: &[SlotRange], _: (f64, f64)) -> Option<Limits> {
        Some(Limits { lowest: 1.0, highest: 1.0 })
    }

    fn new(_: &TranslucentParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        let zero = S::zero();
        let below = S::select(wo.z.lt(zero), -S::one(), zero);
        Translucent { side: S::select(wo.z.gt(zero), S::one(), below) }
    }

    fn sides(&self) -> Sides {
        Sides::TRANSMIT
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let across = (wi.z * L::lift(self.side)).lt(L::zero());
        [L::select(across, L::c(std::f64::consts::FRAC_1_PI), L::zero()); 3]
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        sampling::cosine_hemisphere_pdf(-(wi.z * L::lift(self.side)))
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        let w = sampling::cosine_hemisphere(u);
        V3::new(w.x, w.y, -(w.z * self.side))
    }

    fn albedo(&self, w: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [S::select(w.z.abs().gt(S::zero()), S::one(), S::zero()); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::select(w.z.abs().gt(L::zero()), L::one(), L::zero()); 3]
    }
}
