//! Light that passes straight through.

use super::limits::{Limits, SlotRange};
use super::registry::closure;
use super::{Lobe, Rgb, Sides};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3};

closure! {
    /// Light passes straight through, unbent: a delta lobe in the direction −ωo that transmits everything.
    closure "transparent" as TransparentParams {}
    source: "OSL specification, transparent()",
    reciprocal: true,
    class: Delta,
}

/// See [`TransparentParams`].
#[derive(Clone, Copy, Debug)]
pub struct Transparent<S> {
    wo: V3<S>,
}

impl<S: Real> Lobe<S> for Transparent<S> {
    type Params = TransparentParams;
    type Aimed = Self;

    fn limits(_: &[SlotRange], _: (f64, f64)) -> Option<Limits> {
        Some(Limits { lowest: 1.0, highest: 1.0 })
    }

    fn new(_: &TransparentParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Transparent { wo }
    }

    fn sides(&self) -> Sides {
        Sides::TRANSMIT
    }

    fn roughness(&self) -> S {
        S::zero()
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
        -self.wo
    }

    fn albedo(&self, _: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [S::one(); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, _: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::one(); 3]
    }

    fn delta(&self) -> Option<(V3<S>, Rgb<S>)> {
        Some((-self.wo, [S::one(); 3]))
    }
}
