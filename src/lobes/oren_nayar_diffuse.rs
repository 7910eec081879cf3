//! MaterialX's rough diffuse reflection: `oren_nayar` with a color, or `eon` where it is to keep all energy.
//!
//! At roughness 0 it is Lambert; at 0.3 edges stay bright, as on plaster; at 1 a lit ball looks flat. With
//! `"energy_compensation", 1` what bounces between the facets is added back, so that white stays white and colors deepen.
//!
//! Where this departs from the source: without compensation the lobe is the bounded one of `oren_nayar`.

use super::eon::{Eon, EonParams, EonSeen};
use super::limits::{Limits, SlotRange};
use super::lobe::keeps_one_of;
use super::oren_nayar::{OrenNayar, OrenNayarParams};
use super::registry::{ClosureParams, closure};
use super::{Lobe, OneOf, Rgb};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3};

closure! {
    /// Rough diffuse reflection with a color. Roughness 0 is Lambert. One-sided.
    closure "oren_nayar_diffuse_bsdf" as OrenNayarDiffuseParams {
        /// Shading normal.
        normal N;
        /// Color of the surface.
        color albedo = [0.8, 0.8, 0.8], in (0.0, 1.0);
        /// Standard deviation of the facets' slope angle, in radians; with compensation the spread of `eon`.
        float roughness = 0.3, in (0.0, 1.0);
        /// 1: what bounces between the facets is added back, as `eon` does. 0: it is lost, as `oren_nayar` has it.
        @keyword int energy_compensation = 0.0, in (0.0, 1.0);
    }
    source: "MaterialX, oren_nayar_diffuse_bsdf; Oren & Nayar 1994; Portsmouth, Kutz & Hill 2024",
    reciprocal: true,
    class: Scatter,
}

/// See [`OrenNayarDiffuseParams`].
#[derive(Clone, Copy, Debug)]
pub enum OrenNayarDiffuse<S> {
    /// What bounces is lost; the color is the lobe's weight.
    Single(OrenNayar<S>),
    /// What bounces is added back.
    Kept(Eon<S>),
}

use OrenNayarDiffuse::{Kept, Single};

keeps_one_of!(OrenNayarDiffuse: Single(OrenNayar<S>) | Kept(EonSeen<S>));

impl<S: Real> Lobe<S> for OrenNayarDiffuse<S> {
    type Params = OrenNayarDiffuseParams;
    type Aimed = OneOf<OrenNayar<S>, EonSeen<S>>;

    fn limits(_: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        Some(Limits::above(cos, 0.0, 1.0))
    }

    fn tint_slot() -> Option<usize> {
        OrenNayarDiffuseParams::SPEC.slot_of("albedo")
    }

    fn weight(params: &OrenNayarDiffuseParams) -> [f32; 3] {
        if params.energy_compensation == 0 { params.albedo } else { [1.0; 3] }
    }

    fn new(params: &OrenNayarDiffuseParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let OrenNayarDiffuseParams { N, albedo, roughness, energy_compensation } = *params;
        if energy_compensation == 0 {
            Single(OrenNayar::new(&OrenNayarParams { N, sigma: roughness }, wo, curve))
        } else {
            Kept(Eon::new(&EonParams { N, albedo, roughness }, wo, curve))
        }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Single(lobe) => lobe.f(wi, curve),
            Kept(lobe) => lobe.f(wi, curve),
        }
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        match self {
            Single(lobe) => lobe.pdf(wi),
            Kept(lobe) => lobe.pdf(wi),
        }
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        match self {
            Single(lobe) => lobe.sample(u),
            Kept(lobe) => lobe.sample(u),
        }
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        match self {
            Single(lobe) => lobe.albedo(w, curve),
            Kept(lobe) => lobe.albedo(w, curve),
        }
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Single(lobe) => lobe.albedo_bound(w, curve),
            Kept(lobe) => lobe.albedo_bound(w, curve),
        }
    }
}
