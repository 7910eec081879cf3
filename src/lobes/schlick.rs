//! MaterialX's generalized Schlick: a reflection whose color at both ends is free.
//!
//! F = F0 + (F90 − F0)·(1 − c)^exponent. With F0 = 0.04 a varnish, with a saturated F0 a metal; F90 tints the rim. What
//! bounces between the facets is included (`lobes::rough`).
//!
//! With a transmission tint what is not reflected is refracted, 1 − F per channel, and the lobe lies between two media
//! (`lobes::interface`): F is then taken at the cosine outside, from either side, and what is totally reflected stays so.
//!
//! A film over it ([`crate::optics::film`]) lies on clear media that reflect f0 facing; f90 and the exponent are then not
//! used.
//!
//! Where this departs from the source: roughness is used as the width α of the slopes. What bounces between facets is divided between reflection and refraction as for clear glass, whatever the colors.

use super::interface::{Interface, InterfaceSeen, by_interface, index};
use super::limits::{Limits, SlotRange};
use super::lobe::{keeps_one_of, keeps_that_of};
use super::registry::{ClosureParams, LobeSpec, closure};
use super::rough::{
    DISTRIBUTIONS, Reflectance, Reflector, ReflectorSeen, coated_glass, known_width, known_widths, metal_reflectance,
    widths,
};
use super::{Evaluated, Lobe, OneOf, Rgb, Sides};
use crate::albedo::facets::{Facet, FacetKey, FacetSpec};
use crate::albedo::{AlbedoCurve, TableSpec};
use crate::optics::{Over, Real, V3, rgb};

closure! {
    /// Reflection with a color facing and a color grazing, and refraction of the rest if it has a tint; what bounces between
    /// the facets is included. One-sided unless it transmits.
    closure "generalized_schlick_bsdf" as GeneralizedSchlickParams {
        /// Shading normal.
        normal N;
        /// Direction that `roughness_x` is measured along.
        vector U;
        /// What is reflected is multiplied with this.
        color reflection_tint = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// What is refracted is multiplied with this. Black: a coat or a metal, one-sided; else the surface lies between two
        /// media, the index that of a dielectric that reflects the mean of f0 facing.
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
        /// Thickness of a film on it, in nanometres; 0: none.
        @keyword float thinfilm_thickness = 0.0, in (0.0, 2000.0);
        /// Index of refraction of the film.
        @keyword float thinfilm_ior = 1.5, in (1.0, 4.0);
    }
    source: "MaterialX, generalized_schlick_bsdf; Schlick 1994; Kulla & Conty 2017",
    reciprocal: true,
    class: Scatter,
}

const SPEC: &LobeSpec = GeneralizedSchlickParams::SPEC;

/// See [`GeneralizedSchlickParams`].
#[derive(Clone, Copy, Debug)]
pub enum GeneralizedSchlick<S> {
    /// Reflects.
    Coat(Tinted<S>),
    /// Between two media.
    Glass(Interface<S>),
}

use GeneralizedSchlick::{Coat, Glass};

/// A reflecting surface times a color.
#[derive(Clone, Copy, Debug)]
pub struct Tinted<S> {
    surface: Reflector<S>,
    tint: Rgb<S>,
}

keeps_that_of!(Tinted { surface: ReflectorSeen });
keeps_one_of!(GeneralizedSchlick: Coat(ReflectorSeen<S>) | Glass(InterfaceSeen<S>));

/// For tables: the key holds F0, F90 and the exponent.
fn schlick_reflectance(key: &FacetKey, c: f64) -> [f64; 3] {
    Reflectance::Schlick([key[0], key[1], key[2]], [key[3], key[4], key[5]], key[6]).at(c, 1.0 - c)
}

/// The index of a dielectric that reflects `f0` facing.
fn clear(f0: f64) -> f64 {
    let root = f0.clamp(0.0, 0.99).sqrt();
    (1.0 + root) / (1.0 - root)
}

/// That of the mean of `f0`, as [`index`] keeps it.
fn index_of(f0: [f32; 3]) -> f64 {
    index(clear(f0.iter().map(|f| f64::from(*f)).sum::<f64>() / 3.0) as f32)
}

fn known<const N: usize>(values: &[Option<f32>], at: usize, param: usize) -> Option<[f32; N]> {
    let mut color = [0.0; N];
    for (c, color) in color.iter_mut().enumerate() {
        *color = SPEC.params[param].clamp(c, values[at + c]?);
    }
    Some(color)
}

/// f0, and the reflectance with its key.
type Law = ([f32; 3], fn(&FacetKey, f64) -> [f64; 3], FacetKey);

/// If they are known.
fn law(values: &[Option<f32>]) -> Option<Law> {
    let f0 = known::<3>(values, 14, 6)?;
    let [thickness] = known(values, 22, 10)?;
    if thickness > 0.0 {
        let [ior] = known(values, 23, 11)?;
        return Some((f0, metal_reflectance, coated_glass(f0.map(|f| clear(f.into())), [thickness, ior])));
    }
    let (f90, [exponent]) = (known::<3>(values, 17, 7)?, known(values, 20, 8)?);
    let mut key = [0.0; 8];
    key.iter_mut().zip(f0.into_iter().chain(f90).chain([exponent])).for_each(|(key, v)| *key = f64::from(v));
    Some((f0, schlick_reflectance, key))
}

fn transmits(tint: [f32; 3]) -> bool {
    tint.iter().any(|t| *t > 0.0)
}

impl<S: Real> Lobe<S> for GeneralizedSchlick<S> {
    type Params = GeneralizedSchlickParams;
    type Aimed = OneOf<ReflectorSeen<S>, InterfaceSeen<S>>;

    fn sides(&self) -> Sides {
        match self {
            Coat(_) => Sides::REFLECT,
            Glass(surface) => surface.scattered_to(),
        }
    }

    fn roughness(&self) -> S {
        match self {
            Coat(coat) => coat.surface.roughness(),
            Glass(surface) => surface.roughness(),
        }
    }

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let shape = DISTRIBUTIONS[SPEC.params[9].clamp(0, values[21]?) as usize];
        // Whether light passes decides what the table is of.
        let transmits = transmits(known(values, 9, 3)?);
        let law = law(values);
        let (reflectance, key) = law.map_or((schlick_reflectance as fn(&_, _) -> _, [0.0; 8]), |law| (law.1, law.2));
        let (alpha, facet) = if transmits {
            (known_width(SPEC, 4, 12, values), Facet::Colored { eta: index_of(law?.0), reflectance, key })
        } else {
            let parts = if law.is_some() { 3 } else { 0 };
            (known_widths(SPEC, 4, 12, values), Facet::Mirror { reflectance, key, parts })
        };
        Some(TableSpec::Facets(FacetSpec { shape, alpha, facet }))
    }

    /// Where not all is known, no more than the larger tint.
    fn limits(ranges: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        let open = ranges.iter().skip(12).any(|r| r.0 != r.1);
        let most = ranges.get(6..12)?.iter().fold(0.0f32, |most, r| most.max(r.1)).clamp(0.0, 1.0);
        let dark = ranges[9..12].iter().all(|r| r.1 <= 0.0);
        let limits = Limits { lowest: 0.0, highest: f64::from(most) };
        let limits = if dark { Limits::above(cos, 0.0, limits.highest) } else { limits };
        (open || ranges[9..12].iter().any(|r| r.0 != r.1)).then_some(limits)
    }

    fn follows_tangent(params: &GeneralizedSchlickParams) -> bool {
        let [x, y] = widths([params.roughness_x, params.roughness_y]);
        x != y && !transmits(params.transmission_tint)
    }

    fn between_media(params: &GeneralizedSchlickParams) -> bool {
        transmits(params.transmission_tint)
    }

    fn new(params: &GeneralizedSchlickParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let shape = DISTRIBUTIONS[params.distribution as usize];
        let [f0, f90] = [params.f0, params.f90].map(|f| f.map(S::from_f32));
        let film = [params.thinfilm_thickness, params.thinfilm_ior];
        let curved = Reflectance::coated(params.f0.map(|f| clear(f.into())), film).unwrap_or(Reflectance::Schlick(
            f0,
            f90,
            S::from_f32(params.exponent),
        ));
        let alpha = [params.roughness_x, params.roughness_y];
        if transmits(params.transmission_tint) {
            let tints = [params.reflection_tint, params.transmission_tint];
            Glass(Interface::new(shape, alpha, (index_of(params.f0), Some(curved)), tints, wo, curve.facets()))
        } else {
            let surface = Reflector::new(shape, alpha, curved, wo, curve.facets());
            Coat(Tinted { surface, tint: params.reflection_tint.map(S::from_f32) })
        }
    }

    by_interface!(Second, Glass);

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Coat(Tinted { surface, tint }) => tinted(tint, surface.f(wi, curve.facets())),
            Glass(surface) => surface.f(wi, curve.facets()),
        }
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        match self {
            Coat(coat) => coat.surface.pdf(wi),
            Glass(surface) => surface.pdf(wi),
        }
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        match self {
            Coat(coat) => coat.surface.sample(u),
            Glass(surface) => surface.sample(u),
        }
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        match self {
            Coat(Tinted { surface, tint }) => tinted(tint, surface.albedo(w, curve.facets())),
            Glass(surface) => surface.albedo(w, curve.facets()),
        }
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        match self {
            Coat(Tinted { surface, tint }) => tinted(tint, surface.albedo_bound(w, curve.facets())),
            Glass(surface) => surface.albedo_bound(w, curve.facets()),
        }
    }

    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        match self {
            Coat(Tinted { surface, tint }) => {
                let e = surface.evaluate(wi, curve.facets(), bound);
                Evaluated { f: tinted(tint, e.f), bound: tinted(tint, e.bound), ..e }
            }
            Glass(surface) => surface.evaluate(wi, curve.facets(), bound),
        }
    }

    #[inline(always)]
    fn relative_eta<L: Over<S>>(&self, wi: V3<L>) -> L {
        match self {
            Coat(_) => L::one(),
            Glass(surface) => surface.relative_eta(wi),
        }
    }
}

#[inline(always)]
fn tinted<S: Real, L: Over<S>>(tint: &Rgb<S>, color: Rgb<L>) -> Rgb<L> {
    rgb!(c => L::lift(tint[c]) * color[c])
}
