//! Light the surface gives off.

use super::limits::{Limits, SlotRange};
use super::registry::closure;
use super::{Lobe, Rgb};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3};

closure! {
    /// Emitted radiance of 1 on the normal's side, none below. Scatters nothing and never counts as albedo; below a
    /// layer it is dimmed by what the layer passes toward the viewer.
    closure "emission" as EmissionParams {}
    source: "OSL specification, emission()",
    reciprocal: true,
    class: Emission,
}

/// See [`EmissionParams`].
#[derive(Clone, Copy, Debug)]
pub struct Emission<S> {
    /// Radiance toward ωo.
    radiance: S,
}

impl<S: Real> Emission<S> {
    /// Radiance toward ωo.
    pub fn radiance(&self) -> S {
        self.radiance
    }
}

impl<S: Real> Lobe<S> for Emission<S> {
    type Params = EmissionParams;
    type Aimed = Self;

    fn limits(_: &[SlotRange], _: (f64, f64)) -> Option<Limits> {
        Some(Limits { lowest: 0.0, highest: 0.0 })
    }

    fn new(_: &EmissionParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Emission { radiance: S::select(wo.z.gt(S::zero()), S::one(), S::zero()) }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, _: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::zero(); 3]
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, _: V3<L>) -> L {
        L::zero()
    }

    fn sample(&self, _: [S; 2]) -> V3<S> {
        V3::new(S::zero(), S::zero(), S::one())
    }

    fn albedo(&self, _: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [S::zero(); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, _: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::zero(); 3]
    }
}
