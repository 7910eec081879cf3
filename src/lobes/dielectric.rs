//! MaterialX's dielectric: glass, water, and clear coats.
//!
//! Smooth (0.001) a window; at 0.1 frosted with a clear core; at 0.5 milky, edges bright; at 1 a diffuser that sends
//! nearly as much back as through. Reflected and refracted light sum to what arrives, from both media and at every
//! roughness, if both tints are white (`lobes::interface`; thin walls: `lobes::pane`). As a coat over a closure use it with a black
//! `transmission_tint`: then only what it reflects is taken from the base.
//!
//! A film between the media colors both, reflection by the color that interferes and what passes by the rest
//! ([`crate::optics::film`]); thin walls have none.
//!
//! Where this departs from the source: roughness is used as the width α of the slopes, the geometric mean of both;
//! the film is summed exactly at three wavelengths per channel. What bounces between facets under a film is given back as the
//! channel that loses least has it; others may lose 0.3 %.

use super::interface::{Interface, InterfaceSeen, by_interface, index};
use super::lobe::{apart, keeps_one_of};
use super::pane::{self, Pane, PaneSeen};
use super::registry::{ClosureParams, LobeSpec, closure};
use super::rough::{DISTRIBUTIONS, Reflectance, coated_glass, known_thin, known_width, metal_reflectance, thin};
use super::{Evaluated, Lobe, OneOf, Rgb, Sides};
use crate::albedo::facets::{Facet, FacetSpec};
use crate::albedo::{AlbedoCurve, TableSpec};
use crate::optics::{Over, Real, V3};

closure! {
    /// Reflection and refraction between two media, what bounces between the facets included. Two-sided.
    closure "dielectric_bsdf" as DielectricParams {
        /// Shading normal.
        normal N;
        /// Direction that `roughness_x` is measured along.
        vector U;
        /// What is reflected is multiplied with this; black: nothing is.
        color reflection_tint = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// What is refracted is multiplied with this; black for a coat.
        color transmission_tint = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// Width of the facets' slopes (α) along U.
        float roughness_x = 0.3, in (1e-4, 1.0);
        /// Width of the slopes across U.
        float roughness_y = 0.3, in (1e-4, 1.0);
        /// Index of refraction inside over outside, taken as at least 1/4 and at least 1 % away from 1. Where the host
        /// says the back is seen, light comes from inside.
        float ior = 1.5, in (0.1, 4.0);
        /// Distribution of the slopes; "default" and "multi_ggx" are "ggx".
        string distribution = 0.0, in (0.0, 3.0), of ["ggx", "beckmann", "default", "multi_ggx"];
        /// 1: a thin wall, both its surfaces at once: light passes unbent, spread by the roughness as what is reflected.
        @keyword int thin_walled = 0.0, in (0.0, 1.0);
        /// Thickness of a film between the media, in nanometres; 0: none. Thin walls have none.
        @keyword float thinfilm_thickness = 0.0, in (0.0, 2000.0);
        /// Index of refraction of the film over that outside.
        @keyword float thinfilm_ior = 1.5, in (1.0, 4.0);
    }
    source: "MaterialX, dielectric_bsdf; Walter et al. 2007; Kulla & Conty 2017",
    reciprocal: true,
    class: Scatter,
}

const SPEC: &LobeSpec = DielectricParams::SPEC;

/// See [`DielectricParams`].
#[derive(Clone, Copy, Debug)]
pub enum Dielectric<S> {
    /// Between two media.
    Solid(Interface<S>),
    /// Two surfaces at once.
    Thin(Pane<S>),
}

use Dielectric::{Solid, Thin};

keeps_one_of!(Dielectric: Solid(InterfaceSeen<S>) | Thin(PaneSeen<S>));

impl<S: Real> Lobe<S> for Dielectric<S> {
    type Params = DielectricParams;
    type Aimed = OneOf<InterfaceSeen<S>, PaneSeen<S>>;

    fn sides(&self) -> Sides {
        match self {
            Solid(surface) => surface.scattered_to(),
            Thin(surface) => surface.scattered_to(),
        }
    }

    fn roughness(&self) -> S {
        match self {
            Solid(surface) => surface.roughness(),
            Thin(surface) => surface.roughness(),
        }
    }

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let shape = DISTRIBUTIONS[SPEC.params[7].clamp(0, values[15]?) as usize];
        let eta = index(SPEC.params[6].clamp(0, values[14]?));
        let (alpha, facet) = if SPEC.params[8].clamp(0, values[16]?) > 0.0 {
            let key = [eta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            (known_thin(SPEC, 4, 12, values, eta), Facet::Mirror { reflectance: pane::parts, key, parts: 2 })
        } else {
            // Without a film its index does not matter.
            let facet = match SPEC.params[9].clamp(0, values[17]?) {
                thickness if thickness > 0.0 => {
                    let key = coated_glass([eta; 3], [thickness, SPEC.params[10].clamp(0, values[18]?)]);
                    Facet::Colored { eta, reflectance: metal_reflectance, key }
                }
                _ => Facet::Dielectric { eta },
            };
            (known_width(SPEC, 4, 12, values), facet)
        };
        Some(TableSpec::Facets(FacetSpec { shape, alpha, facet }))
    }

    fn follows_tangent(params: &DielectricParams) -> bool {
        let [x, y] = thin([params.roughness_x, params.roughness_y], index(params.ior));
        params.thin_walled > 0 && x != y
    }

    fn between_media(params: &DielectricParams) -> bool {
        params.thin_walled == 0
    }

    fn new(params: &DielectricParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let shape = DISTRIBUTIONS[params.distribution as usize];
        let tints = [params.reflection_tint, params.transmission_tint];
        let (alpha, eta) = ([params.roughness_x, params.roughness_y], index(params.ior));
        if params.thin_walled > 0 {
            Thin(Pane::new(shape, alpha, eta, tints, wo, curve.facets()))
        } else {
            let film = Reflectance::coated([eta; 3], [params.thinfilm_thickness, params.thinfilm_ior]);
            Solid(Interface::new(shape, alpha, (eta, film), tints, wo, curve.facets()))
        }
    }

    by_interface!(First, Solid);

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Solid(surface) => surface.f(wi, curve.facets()),
            Thin(surface) => surface.f(wi, curve.facets()),
        }
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        match self {
            Solid(surface) => surface.pdf(wi),
            Thin(surface) => surface.pdf(wi),
        }
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        match self {
            Solid(surface) => surface.sample(u),
            Thin(surface) => surface.sample(u),
        }
    }

    #[inline(always)]
    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        match self {
            Solid(surface) => surface.albedo(w, curve.facets()),
            Thin(surface) => surface.albedo(w, curve.facets()),
        }
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Solid(surface) => surface.albedo_bound(w, curve.facets()),
            Thin(surface) => surface.albedo_bound(w, curve.facets()),
        }
    }

    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        match self {
            Solid(surface) => surface.evaluate(wi, curve.facets(), bound),
            Thin(_) => apart(self, wi, curve, bound),
        }
    }

    #[inline(always)]
    fn relative_eta<L: Over<S>>(&self, wi: V3<L>) -> L {
        match self {
            Solid(surface) => surface.relative_eta(wi),
            Thin(_) => L::one(),
        }
    }
}
