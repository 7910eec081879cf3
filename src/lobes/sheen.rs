//! Sheen.
use super::registry::*;
use super::{Lobe, LobeKind, Rgb};
use crate::albedo::AlbedoCurve;
use crate::optics::{Lift, Real, V3};

closure! {
    /// Cloth sheen after Conty & Kulla: fibres standing along the normal, seen as a glow toward grazing angles.
    closure "sheen_bsdf" as SheenParams {
        /// Shading normal.
        normal N;
        /// Color the lobe is multiplied with.
        color albedo = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// How far the fibres lean from the normal (paper: r).
        float roughness = 0.3, in (0.07, 1.0);
        /// 1: the light's shadowing is softened (eq. 4).
        @keyword int softening = 1.0, in (0.0, 1.0);
    }
    source: "Conty & Kulla 2017, eq. 1-4, Table 1",
    reciprocal: false,
    class: Scatter,
}

const BASE: ParamSpec = ParamSpec {
    name: "base",
    ty: ParamTy::Closure,
    keyword: false,
    default: &[],
    min: f32::NEG_INFINITY,
    max: f32::INFINITY,
    options: &[],
    doc: "What the sheen lies over.",
};
const TINT: ParamSpec = ParamSpec { name: "tint", doc: "Color of the sheen.", ..SheenParams::SPEC.params[1] };

pub(super) const FORMS: &[Form] = &[
    Form {
        name: "sheen",
        params: &[BASE, SheenParams::SPEC.params[0], TINT, SheenParams::SPEC.params[2], SheenParams::SPEC.params[3]],
        doc: "Sheen layered over a closure: `layer(tint * sheen_bsdf(N, 1, roughness), base)`.",
        source: "Conty & Kulla 2017, §5",
        reciprocal: false,
        build: Build::Wrap {
            kind: LobeKind::Sheen,
            args: &[SlotSource::Param(1), SlotSource::Const(&[1.0; 3]), SlotSource::Param(3), SlotSource::Param(4)],
            weight: 2,
            base: 0,
        },
    },
    Form {
        name: "sheen",
        params: &[SheenParams::SPEC.params[0], SheenParams::SPEC.params[2]],
        doc: "The bare sheen lobe: `sheen_bsdf(N, 1, roughness)`.",
        source: "Conty & Kulla 2017",
        reciprocal: false,
        build: Build::Lobe {
            kind: LobeKind::Sheen,
            args: &[
                SlotSource::Param(0),
                SlotSource::Const(&[1.0; 3]),
                SlotSource::Param(1),
                SlotSource::Const(&[1.0]),
            ],
        },
    },
];

#[derive(Clone, Copy, Debug)]
pub struct Sheen<S> {
    wo: V3<S>,
}
impl<S: Real> Lobe<S> for Sheen<S> {
    type Params = SheenParams;
    fn new(_: &SheenParams, wo: V3<S>, _: &AlbedoCurve<S>) -> Self {
        Sheen { wo }
    }
    fn f<L: Real + Lift<S>>(&self, _: V3<L>, _: &AlbedoCurve<S>) -> Rgb<L> {
        [L::zero(); 3]
    }
    fn pdf<L: Real + Lift<S>>(&self, _: V3<L>) -> L {
        L::zero()
    }
    fn sample(&self, _: [S; 2]) -> V3<S> {
        self.wo
    }
    fn albedo(&self, _: V3<S>, _: &AlbedoCurve<S>) -> Rgb<S> {
        [S::zero(); 3]
    }
    fn albedo_bound<L: Real + Lift<S>>(&self, _: V3<L>, _: &AlbedoCurve<S>) -> Rgb<L> {
        [L::zero(); 3]
    }
}
