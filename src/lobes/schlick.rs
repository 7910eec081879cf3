//! MaterialX's generalized Schlick: a reflection whose color at both ends is free.
//!
//! F = F0 + (F90 − F0)·(1 − c)^exponent. With F0 = 0.04 a varnish, with a saturated F0 a metal; F90 tints the rim. What
//! bounces between the facets is included ([`super::rough`]).
//!
//! Where this departs from the source: reflection only; roughness is used as the width α of the slopes; no thin film.

use super::registry::{ClosureParams, LobeSpec, closure};
use super::rough::{DISTRIBUTIONS, Reflectance, Reflector, known_widths, widths};
use super::{Lobe, Rgb};
use crate::albedo::facets::{Facet, FacetKey, FacetSpec};
use crate::albedo::{AlbedoCurve, TableSpec};
use crate::optics::{Lift, Real, V3};

closure! {
    /// Reflection with a color facing and a color grazing, what bounces between the facets included. One-sided.
    closure "generalized_schlick_bsdf" as GeneralizedSchlickParams {
        /// Shading normal.
        normal N;
        /// Direction that `roughness_x` is measured along.
        vector U;
        /// What is reflected is multiplied with this.
        color reflection_tint = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// Has no effect: transmission is not modelled. Use `dielectric_bsdf` for it.
        color transmission_tint = [0.0, 0.0, 0.0], in (0.0, 1.0);
        /// Width of the facets' slopes (α) along U.
        float roughness_x = 0.3, in (1e-4, 1.0);
        /// Width of the slopes across U.
        float roughness_y = 0.3, in (1e-4, 1.0);
        /// Reflectance facing.
        color f0 = [0.04, 0.04, 0.04], in (0.0, 1.0);
        /// Reflectance grazing.
        color f90 = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// How late the color turns; Schlick's is 5.
        float exponent = 5.0, in (0.5, 20.0);
        /// Distribution of the slopes; "default" and "multi_ggx" are "ggx".
        string distribution = 0.0, in (0.0, 3.0), of ["ggx", "beckmann", "default", "multi_ggx"];
    }
    source: "MaterialX, generalized_schlick_bsdf; Schlick 1994; Kulla & Conty 2017",
    reciprocal: true,
    class: Scatter,
}

const SPEC: &LobeSpec = GeneralizedSchlickParams::SPEC;

/// See [`GeneralizedSchlickParams`].
#[derive(Clone, Copy, Debug)]
pub struct GeneralizedSchlick<S> {
    surface: Reflector<S>,
}

/// For [`Facet::Mirror`]: the key holds F0, F90 and the exponent.
fn reflectance(key: &FacetKey, c: f64) -> [f64; 3] {
    Reflectance::Schlick([key[0], key[1], key[2]], [key[3], key[4], key[5]], key[6]).at(c, 1.0 - c)
}

impl<S: Real> Lobe<S> for GeneralizedSchlick<S> {
    type Params = GeneralizedSchlickParams;

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let shape = DISTRIBUTIONS[SPEC.params[9].clamp(0, values[21]?) as usize];
        let mut key = [0.0; 8];
        let known = values[14..21].iter().zip(&mut key).enumerate().all(|(i, (value, key))| match value {
            Some(v) => {
                *key = SPEC.params[if i < 6 { 6 } else { 8 }].clamp(0, *v).into();
                true
            }
            None => false,
        });
        let facet = Facet::Mirror { reflectance, key, parts: if known { 3 } else { 0 } };
        Some(TableSpec::Facets(FacetSpec { shape, alpha: known_widths(SPEC, 4, 12, values), facet }))
    }

    fn tint_slot() -> Option<usize> {
        SPEC.slot_of("reflection_tint")
    }

    fn weight(params: &GeneralizedSchlickParams) -> [f32; 3] {
        params.reflection_tint
    }

    fn follows_tangent(params: &GeneralizedSchlickParams) -> bool {
        let [x, y] = widths([params.roughness_x, params.roughness_y]);
        x != y
    }

    fn new(params: &GeneralizedSchlickParams, wo: V3<S>, curve: &AlbedoCurve<S>) -> Self {
        let shape = DISTRIBUTIONS[params.distribution as usize];
        let [f0, f90] = [params.f0, params.f90].map(|f| f.map(S::from_f32));
        let curved = Reflectance::Schlick(f0, f90, S::from_f32(params.exponent));
        let alpha = [params.roughness_x, params.roughness_y];
        GeneralizedSchlick { surface: Reflector::new(shape, alpha, curved, wo, curve.facets()) }
    }

    #[inline(always)]
    fn f<L: Real + Lift<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S>) -> Rgb<L> {
        self.surface.f(wi, curve.facets())
    }

    #[inline(always)]
    fn pdf<L: Real + Lift<S>>(&self, wi: V3<L>) -> L {
        self.surface.pdf(wi)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        self.surface.sample(u)
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S>) -> Rgb<S> {
        self.surface.albedo(w, curve.facets())
    }

    #[inline(always)]
    fn albedo_bound<L: Real + Lift<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S>) -> Rgb<L> {
        self.surface.albedo_bound(w, curve.facets())
    }
}
