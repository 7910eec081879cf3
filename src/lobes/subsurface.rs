//! Light that enters and leaves elsewhere, as a surface can stand in for it: a diffuse lobe of the same albedo.
//!
//! Where light leaves depends on the object's shape, which a lobe does not see. The renderer finds what was asked for in
//! `Bsdf::subsurface`, or brings a lobe of its own (`Engine::subsurface`) that takes this one's place.

use super::limits::{Limits, SlotRange};
use super::registry::{Build, ClosureParams, Form, ParamSpec, SlotSource, closure};
use super::{Lobe, LobeKind, Rgb, Rgb32};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3, sampling};

closure! {
    /// Scattering below the surface, drawn as `albedo * diffuse(N)` unless the renderer takes it over: soft shadows and
    /// light that shines through are lost, the overall color is not. One-sided.
    closure "subsurface_bssrdf" as SubsurfaceParams {
        /// Shading normal.
        normal N;
        /// What comes back of white light from all around, after all scattering.
        color albedo = [0.8, 0.8, 0.8], in (0.0, 1.0);
        /// Mean free path per channel, in the scene's unit of length. For the renderer.
        color radius = [1.0, 1.0, 1.0], in (0.0, 1e30);
        /// Mean cosine of scattering: negative backward, positive forward. For the renderer.
        float anisotropy = 0.0, in (-1.0, 1.0);
        /// Index of refraction of the medium. For the renderer.
        @keyword float ior = 1.4, in (0.1, 4.0);
    }
    source: "MaterialX, subsurface_bssrdf; OSL specification, subsurface()",
    reciprocal: true,
    class: Scatter,
    note: NOTE,
}

/// Said wherever the lobe stands in for the renderer.
pub(super) const NOTE: &str =
    "light leaves where it enters: it is drawn as `albedo * diffuse(N)` unless the renderer takes it over";

const SPEC: &[ParamSpec] = SubsurfaceParams::SPEC.params;
const ETA: ParamSpec = ParamSpec { name: "eta", keyword: false, ..SPEC[4] };
const G: ParamSpec = ParamSpec { name: "g", ..SPEC[3] };
const MFP: ParamSpec = ParamSpec { name: "mfp", ..SPEC[2] };
const RADIUS: ParamSpec = ParamSpec { ty: super::registry::ParamTy::Vector, default: &[], ..SPEC[2] };
const METHOD: ParamSpec = ParamSpec {
    name: "method",
    ty: super::registry::ParamTy::String,
    default: &[0.0],
    min: 0.0,
    max: 65535.0,
    doc: "How Cycles walks; has no effect here.",
    ..SPEC[3]
};

const OSL: &[ParamSpec] = &[ETA, G, MFP, SPEC[1]];
const CYCLES: &[ParamSpec] = &[METHOD, SPEC[0], RADIUS, SPEC[1]];

/// With the lobe of this file.
pub(super) const FORMS: [Form; 2] = forms(LobeKind::Subsurface, NOTE);

/// `subsurface(eta, g, mfp, albedo)` and Cycles' `bssrdf`, for a lobe that takes [`SubsurfaceParams`].
pub(crate) const fn forms(kind: LobeKind, note: &'static str) -> [Form; 2] {
    use SlotSource::{Const, Normal, Param};
    [
        Form {
            name: "subsurface",
            params: OSL,
            doc: "`subsurface_bssrdf(N, albedo, mfp, g, \"ior\", eta)` with the shading point's normal.",
            source: SubsurfaceParams::SPEC.source,
            reciprocal: true,
            build: Build::Lobe { kind, args: &[Normal, Param(3), Param(2), Param(1), Param(0)] },
            note,
        },
        Form {
            name: "bssrdf",
            params: CYCLES,
            doc: "`subsurface_bssrdf(N, albedo, radius, 0)`, as Cycles calls it.",
            source: SubsurfaceParams::SPEC.source,
            reciprocal: true,
            build: Build::Lobe { kind, args: &[Param(1), Param(3), Param(2), Const(&[0.0]), Const(&[1.4])] },
            note,
        },
    ]
}

/// See [`SubsurfaceParams`].
#[derive(Clone, Copy, Debug)]
pub struct Subsurface<S> {
    /// 1/π if ωo is on the normal's side, else 0.
    value: S,
    radius: Rgb32,
    anisotropy: f32,
    ior: f32,
}

impl<S: Real> Subsurface<S> {
    /// Mean free path per channel, mean cosine of scattering, index of refraction.
    pub fn medium(&self) -> (Rgb32, f32, f32) {
        (self.radius, self.anisotropy, self.ior)
    }
}

impl<S: Real> Lobe<S> for Subsurface<S> {
    type Params = SubsurfaceParams;
    type Aimed = Self;

    fn limits(_: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        Some(Limits::above(cos, 1.0, 1.0))
    }

    fn tint_slot() -> Option<usize> {
        SubsurfaceParams::SPEC.slot_of("albedo")
    }

    fn weight(params: &SubsurfaceParams) -> Rgb32 {
        params.albedo
    }

    fn new(params: &SubsurfaceParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        let SubsurfaceParams { radius, anisotropy, ior, .. } = *params;
        let value = S::select(wo.z.gt(S::zero()), S::c(std::f64::consts::FRAC_1_PI), S::zero());
        Subsurface { value, radius, anisotropy, ior }
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

    fn albedo(&self, w: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [S::select(w.z.gt(S::zero()), S::one(), S::zero()); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::select(w.z.gt(L::zero()), L::one(), L::zero()); 3]
    }
}
