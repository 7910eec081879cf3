//! MaterialX's conductor: metals, from n and k.
//!
//! Smooth a colored mirror that whitens at the very edge; at 0.3 brushed; at 0.8 cast metal, its color deeper than the
//! mirror's, because light that meets several facets is colored by each (`lobes::rough`).
//!
//! A film on it shifts the color with the angle, as heat does on steel ([`crate::optics::film`]).
//!
//! Where this departs from the source: roughness is used as the width α of the slopes; the film is summed exactly at three
//! wavelengths per channel.

use super::lobe::keeps_that_of;
use super::registry::{ClosureParams, LobeSpec, closure};
use super::rough::{DISTRIBUTIONS, Reflectance, Reflector, ReflectorSeen, known_widths, metal_reflectance, widths};
use super::{Evaluated, Lobe, Rgb};
use crate::albedo::facets::{Facet, FacetSpec};
use crate::albedo::{AlbedoCurve, TableSpec};
use crate::optics::film::Film;
use crate::optics::{Over, Real, V3};

closure! {
    /// Reflection by a metal's facets, what bounces between them included. One-sided.
    closure "conductor_bsdf" as ConductorParams {
        /// Shading normal.
        normal N;
        /// Direction that `roughness_x` is measured along.
        vector U;
        /// Width of the facets' slopes (α) along U.
        float roughness_x = 0.3, in (1e-4, 1.0);
        /// Width of the slopes across U.
        float roughness_y = 0.3, in (1e-4, 1.0);
        /// Index of refraction per channel (n).
        color ior = [0.183, 0.421, 1.373], in (0.0, 500.0);
        /// Extinction coefficient per channel (k).
        color extinction = [3.424, 2.346, 1.77], in (0.0, 500.0);
        /// Distribution of the slopes; "default" and "multi_ggx" are "ggx".
        string distribution = 0.0, in (0.0, 3.0), of ["ggx", "beckmann", "default", "multi_ggx"];
        /// Thickness of a film on the metal, in nanometres; 0: none.
        @keyword float thinfilm_thickness = 0.0, in (0.0, 2000.0);
        /// Index of refraction of the film.
        @keyword float thinfilm_ior = 1.5, in (1.0, 4.0);
    }
    source: "MaterialX, conductor_bsdf; Born & Wolf, §14.2; Kulla & Conty 2017",
    reciprocal: true,
    class: Scatter,
}

const SPEC: &LobeSpec = ConductorParams::SPEC;

/// See [`ConductorParams`].
#[derive(Clone, Copy, Debug)]
pub struct Conductor<S> {
    surface: Reflector<S>,
}

keeps_that_of!(Conductor { surface: ReflectorSeen });

impl<S: Real> Lobe<S> for Conductor<S> {
    type Params = ConductorParams;
    type Aimed = ReflectorSeen<S>;

    fn roughness(&self) -> S {
        self.surface.roughness()
    }

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let shape = DISTRIBUTIONS[SPEC.params[6].clamp(0, values[14]?) as usize];
        let mut key = [0.0; 8];
        let slots = values[8..14].iter().chain(&values[15..17]).zip(&mut key).enumerate();
        let known = slots.fold(true, |known, (i, (value, key))| {
            // n and k, then the film.
            let spec = &SPEC.params[[4, 4, 4, 5, 5, 5, 7, 8][i]];
            *key = value.map_or(0.0, |v| spec.clamp(0, v).into());
            known && value.is_some()
        });
        let facet = Facet::Mirror { reflectance: metal_reflectance, key, parts: if known { 3 } else { 0 } };
        Some(TableSpec::Facets(FacetSpec { shape, alpha: known_widths(SPEC, 2, 6, values), facet }))
    }

    fn follows_tangent(params: &ConductorParams) -> bool {
        let [x, y] = widths([params.roughness_x, params.roughness_y]);
        x != y
    }

    fn new(params: &ConductorParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let shape = DISTRIBUTIONS[params.distribution as usize];
        let [n, k] = [params.ior, params.extinction].map(|v| v.map(S::from_f32));
        let [thickness, ior] = [params.thinfilm_thickness, params.thinfilm_ior].map(S::from_f32);
        let metal = Reflectance::metal(n, k, Film { thickness, ior }, params.thinfilm_thickness > 0.0);
        let alpha = [params.roughness_x, params.roughness_y];
        Conductor { surface: Reflector::new(shape, alpha, metal, wo, curve.facets()) }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.surface.f(wi, curve.facets())
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.surface.pdf(wi)
    }

    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        self.surface.evaluate(wi, curve.facets(), bound)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        self.surface.sample(u)
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        self.surface.albedo(w, curve.facets())
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.surface.albedo_bound(w, curve.facets())
    }
}
