//! Other names for the lobes of rough surfaces; see [`super::aliases`].

use super::LobeKind;
use super::microfacet::MicrofacetParams;
use super::registry::SlotSource::{Const, Param};
use super::registry::{Build, ClosureParams, Form, LobeSpec, ParamSpec, SlotSource};
use super::schlick::GeneralizedSchlickParams;

const FACETS: &LobeSpec = MicrofacetParams::SPEC;
const SCHLICK: &LobeSpec = GeneralizedSchlickParams::SPEC;
const DISTRIBUTION: ParamSpec = FACETS.params[0];
const N: ParamSpec = FACETS.params[1];
const U: ParamSpec = FACETS.params[2];
const T: ParamSpec = ParamSpec { name: "T", ..U };
const ALPHA: ParamSpec = ParamSpec { name: "alpha", doc: "Width of the facets' slopes.", ..FACETS.params[3] };
const ALPHA_X: ParamSpec = ParamSpec { doc: "Width of the slopes along T.", ..FACETS.params[3] };
const ALPHA_Y: ParamSpec = ParamSpec { doc: "Width of the slopes across T.", ..FACETS.params[4] };
const ETA: ParamSpec = FACETS.params[5];
const REFRACT: ParamSpec = FACETS.params[6];
const SPREAD: ParamSpec = ParamSpec {
    name: "C",
    doc: "Tints what bounces between facets elsewhere; has no effect here.",
    ..SCHLICK.params[2]
};
const F0: ParamSpec = SCHLICK.params[6];
const F90: ParamSpec = SCHLICK.params[7];
const CURVE: ParamSpec =
    ParamSpec { doc: "Index whose reflectance curve Cycles stretches; has no effect here.", ..ETA };

const WHITE: SlotSource = Const(&[1.0; 3]);
const BLACK: SlotSource = Const(&[0.0; 3]);

const fn facets(args: &'static [SlotSource]) -> Build {
    Build::Lobe { kind: LobeKind::Microfacet, args }
}

/// Distribution, normal, one width for both, index, mode.
const fn even(distribution: SlotSource, eta: SlotSource, mode: SlotSource) -> [SlotSource; 7] {
    [distribution, Param(0), BLACK, Param(1), Param(1), eta, mode]
}

/// Distribution, normal, tangent, both widths: a mirror.
const fn stretched(distribution: SlotSource) -> [SlotSource; 7] {
    [distribution, Param(0), Param(1), Param(2), Param(3), ZERO, ZERO]
}

const ZERO: SlotSource = Const(&[0.0]);
const ONE: SlotSource = Const(&[1.0]);
const TWO: SlotSource = Const(&[2.0]);

const MULTI: &str = "the color that tints what bounces between facets has no effect: the facets are white";

/// All of them.
pub(super) const FORMS: &[Form] = &[
    Form::alias(
        "microfacet",
        &[DISTRIBUTION, N, ALPHA, ETA, REFRACT],
        "`microfacet(distribution, N, 0, alpha, alpha, eta, refract)`.",
        FACETS,
        facets(&[Param(0), Param(1), BLACK, Param(2), Param(2), Param(3), Param(4)]),
    ),
    Form::alias(
        "microfacet_ggx",
        &[N, ALPHA],
        "`microfacet(\"ggx\", N, 0, alpha, alpha, 0, 0)`, as Cycles calls it.",
        FACETS,
        facets(&even(ZERO, ZERO, ZERO)),
    ),
    Form::alias(
        "microfacet_beckmann",
        &[N, ALPHA],
        "`microfacet(\"beckmann\", N, 0, alpha, alpha, 0, 0)`, as Cycles calls it.",
        FACETS,
        facets(&even(ONE, ZERO, ZERO)),
    ),
    Form::alias(
        "microfacet_ggx",
        &[N, ALPHA, ETA],
        "`microfacet(\"ggx\", N, 0, alpha, alpha, eta, 0)`, as early OSL calls it.",
        FACETS,
        facets(&even(ZERO, Param(2), ZERO)),
    ),
    Form::alias(
        "microfacet_beckmann",
        &[N, ALPHA, ETA],
        "`microfacet(\"beckmann\", N, 0, alpha, alpha, eta, 0)`, as early OSL calls it.",
        FACETS,
        facets(&even(ONE, Param(2), ZERO)),
    ),
    Form::alias(
        "microfacet_ggx_aniso",
        &[N, T, ALPHA_X, ALPHA_Y],
        "`microfacet(\"ggx\", N, T, xalpha, yalpha, 0, 0)`, as Cycles calls it.",
        FACETS,
        facets(&stretched(ZERO)),
    ),
    Form::alias(
        "microfacet_beckmann_aniso",
        &[N, T, ALPHA_X, ALPHA_Y],
        "`microfacet(\"beckmann\", N, T, xalpha, yalpha, 0, 0)`, as Cycles calls it.",
        FACETS,
        facets(&stretched(ONE)),
    ),
    Form::alias(
        "microfacet_ggx_refraction",
        &[N, ALPHA, ETA],
        "`microfacet(\"ggx\", N, 0, alpha, alpha, eta, 1)`, as Cycles calls it.",
        FACETS,
        facets(&even(ZERO, Param(2), ONE)),
    )
    .noted(REFRACTION),
    Form::alias(
        "microfacet_beckmann_refraction",
        &[N, ALPHA, ETA],
        "`microfacet(\"beckmann\", N, 0, alpha, alpha, eta, 1)`, as Cycles calls it.",
        FACETS,
        facets(&even(ONE, Param(2), ONE)),
    )
    .noted(REFRACTION),
    Form::alias(
        "microfacet_multi_ggx",
        &[N, ALPHA, SPREAD],
        "`microfacet(\"multi_ggx\", N, 0, alpha, alpha, 0, 0)`, as Cycles calls it.",
        FACETS,
        facets(&even(ZERO, ZERO, ZERO)),
    )
    .noted(MULTI),
    Form::alias(
        "microfacet_multi_ggx_aniso",
        &[N, T, ALPHA_X, ALPHA_Y, SPREAD],
        "`microfacet(\"multi_ggx\", N, T, xalpha, yalpha, 0, 0)`, as Cycles calls it.",
        FACETS,
        facets(&stretched(ZERO)),
    )
    .noted(MULTI),
    Form::alias(
        "microfacet_multi_ggx_glass",
        &[N, ALPHA, ETA, SPREAD],
        "`microfacet(\"multi_ggx\", N, 0, alpha, alpha, eta, 2)`, as Cycles calls it.",
        FACETS,
        facets(&even(ZERO, Param(2), TWO)),
    )
    .noted(MULTI),
    Form::alias(
        "microfacet_aniso_fresnel",
        &[N, T, ALPHA_X, ALPHA_Y, F0, F90, CURVE, DISTRIBUTION],
        "`generalized_schlick_bsdf(N, T, 1, 0, xalpha, yalpha, f0, f90, 5, distribution)`, nearly as Cycles has it.",
        SCHLICK,
        Build::Lobe {
            kind: LobeKind::GeneralizedSchlick,
            args: &[
                Param(0),
                Param(1),
                WHITE,
                BLACK,
                Param(2),
                Param(3),
                Param(4),
                Param(5),
                Const(&[5.0]),
                Param(7),
                ZERO,
                Const(&[1.5]),
            ],
        },
    )
    .noted("between f0 and f90 it follows Schlick's curve, not that of the index"),
];

const REFRACTION: &str = "what a facet reflects is left out here, by Fresnel's law; Cycles refracts all light";
