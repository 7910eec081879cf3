//! Microfacet reflection and refraction: the closure of the OSL specification, with what bounces between the facets
//! given back.
//!
//! At α = 1e-4 a mirror; at 0.05–0.2 polished to satin; at 0.5 a broad sheen that follows the light; at 1 almost matt,
//! brightest toward the light's mirror side. With αx ≠ αy the highlight is drawn out across the finer direction, as on
//! brushed metal. White in, white out: what the facets do not return at the first bounce returns as a reciprocal,
//! nearly even lobe (`lobes::rough`; `lobes::interface` with an index), so that a white surface reflects all light
//! at every roughness.
//!
//! Where this departs from the source: the specification has single bounces only and leaves the rest dark; an index of 0
//! means a perfect mirror, as in OSL's own renderer; widths are
//! kept in [1e-4, 1], and the finer one at 1/64 of the other or more. Beckmann facets are sampled as GGX facets of the
//! same width, at weights below 1.5 near the peak.

use super::interface::{Interface, InterfaceSeen, by_interface, index};
use super::lobe::keeps_one_of;
use super::registry::{ClosureParams, LobeSpec, closure};
use super::rough::{DISTRIBUTIONS, Reflectance, Reflector, ReflectorSeen, known_width, known_widths, widths};
use super::{Evaluated, Lobe, OneOf, Rgb, Sides};
use crate::albedo::facets::{Facet, FacetSpec, white};
use crate::albedo::{AlbedoCurve, TableSpec};
use crate::optics::{Over, Real, V3};

closure! {
    /// Reflection and refraction by microscopic facets, what bounces between them included. Without an index it is white
    /// at every roughness and one-sided; with one it lies between two media and scatters on both sides.
    closure "microfacet" as MicrofacetParams {
        /// Distribution of the facets' slopes; "default" and "multi_ggx" are "ggx".
        string distribution = 0.0, in (0.0, 3.0), of ["ggx", "beckmann", "default", "multi_ggx"];
        /// Shading normal.
        normal N;
        /// Direction that `xalpha` is measured along.
        vector U;
        /// Width of the slopes along U.
        float xalpha = 0.3, in (1e-4, 1.0);
        /// Width of the slopes across U.
        float yalpha = 0.3, in (1e-4, 1.0);
        /// Index of refraction inside over outside; where the host says the back is seen, light comes from inside. 0:
        /// the facets are perfect mirrors. Others are taken as at least 1/4, and at least 1 % away from 1.
        float eta = 1.5, in (0.0, 4.0);
        /// 0: what is reflected, 1: what is refracted, 2: both.
        int refract = 0.0, in (0.0, 2.0);
    }
    source: "OSL specification, microfacet(); Walter et al. 2007; Heitz 2014; Kulla & Conty 2017",
    reciprocal: true,
    class: Scatter,
}

const SPEC: &LobeSpec = MicrofacetParams::SPEC;
/// See [`MicrofacetParams`].
#[derive(Clone, Copy, Debug)]
pub enum Microfacet<S> {
    /// Without an index.
    Mirror(Reflector<S>),
    /// Between two media.
    Glass(Interface<S>),
}

use Microfacet::{Glass, Mirror};

keeps_one_of!(Microfacet: Mirror(ReflectorSeen<S>) | Glass(InterfaceSeen<S>));

/// Whether an index and a mode ask for two media.
fn two_media(eta: f32, refract: u32) -> bool {
    eta > 0.0 || refract > 0
}

impl<S: Real> Lobe<S> for Microfacet<S> {
    type Params = MicrofacetParams;
    type Aimed = OneOf<ReflectorSeen<S>, InterfaceSeen<S>>;

    fn sides(&self) -> Sides {
        match self {
            Mirror(_) => Sides::REFLECT,
            Glass(surface) => surface.scattered_to(),
        }
    }

    fn roughness(&self) -> S {
        match self {
            Mirror(surface) => surface.roughness(),
            Glass(surface) => surface.roughness(),
        }
    }

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let value = |param: usize, slot: usize| values[slot].map(|v| SPEC.params[param].clamp(0, v));
        let shape = DISTRIBUTIONS[value(0, 0)? as usize];
        let eta = value(5, 9)?;
        let (alpha, facet) = if two_media(eta, value(6, 10)? as u32) {
            (known_width(SPEC, 3, 7, values), Facet::Dielectric { eta: index(eta) })
        } else {
            (known_widths(SPEC, 3, 7, values), Facet::Mirror { reflectance: white, key: [0.0; 8], parts: 0 })
        };
        Some(TableSpec::Facets(FacetSpec { shape, alpha, facet }))
    }

    fn follows_tangent(params: &MicrofacetParams) -> bool {
        let [x, y] = widths([params.xalpha, params.yalpha]);
        x != y && !two_media(params.eta, params.refract)
    }

    fn between_media(params: &MicrofacetParams) -> bool {
        two_media(params.eta, params.refract)
    }

    fn new(params: &MicrofacetParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let shape = DISTRIBUTIONS[params.distribution as usize];
        let alpha = [params.xalpha, params.yalpha];
        if two_media(params.eta, params.refract) {
            let on = |yes: bool| [f32::from(u8::from(yes)); 3];
            let tints = [on(params.refract != 1), on(params.refract != 0)];
            Glass(Interface::new(shape, alpha, (index(params.eta), None), tints, wo, curve.facets()))
        } else {
            Mirror(Reflector::new(shape, alpha, Reflectance::White, wo, curve.facets()))
        }
    }

    by_interface!(Second, Glass);

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Mirror(surface) => surface.f(wi, curve.facets()),
            Glass(surface) => surface.f(wi, curve.facets()),
        }
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        match self {
            Mirror(surface) => surface.pdf(wi),
            Glass(surface) => surface.pdf(wi),
        }
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        match self {
            Mirror(surface) => surface.sample(u),
            Glass(surface) => surface.sample(u),
        }
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        match self {
            Mirror(surface) => surface.albedo(w, curve.facets()),
            Glass(surface) => surface.albedo(w, curve.facets()),
        }
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Mirror(surface) => surface.albedo_bound(w, curve.facets()),
            Glass(surface) => surface.albedo_bound(w, curve.facets()),
        }
    }

    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        match self {
            Mirror(surface) => surface.evaluate(wi, curve.facets(), bound),
            Glass(surface) => surface.evaluate(wi, curve.facets(), bound),
        }
    }

    #[inline(always)]
    fn relative_eta<L: Over<S>>(&self, wi: V3<L>) -> L {
        match self {
            Mirror(_) => L::one(),
            Glass(surface) => surface.relative_eta(wi),
        }
    }
}
