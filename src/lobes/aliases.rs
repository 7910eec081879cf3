//! Other names for the lobes: MaterialX's, those of older headers, Cycles'. Each expands to a lobe with its values, and
//! goes where the lobe goes: those of rough surfaces are in [`super::facet_aliases`].
//!
//! Where another renderer means something else by a name, the form carries a note, which `overcoat lobes` shows and
//! every call is warned with.

use super::LobeKind;
use super::emission::EmissionParams;
use super::oren_nayar_diffuse::OrenNayarDiffuseParams;
use super::registry::SlotSource::Param;
use super::registry::{Build, ClosureParams, Form, ParamSpec};
use super::translucent::TranslucentParams;
use super::transparent::TransparentParams;
#[cfg(feature = "cloth")]
use super::velvet::VelvetParams;

const N: ParamSpec = TranslucentParams::SPEC.params[0];
const ALBEDO: ParamSpec = ParamSpec {
    name: "albedo",
    doc: "Color the lobe is multiplied with.",
    default: &[1.0; 3],
    ..OrenNayarDiffuseParams::SPEC.params[1]
};

#[cfg(feature = "cloth")]
const SIGMA: ParamSpec = ParamSpec { name: "sigma", ..VelvetParams::SPEC.params[1] };

/// All of them.
pub(super) const FORMS: &[Form] = &[
    Form::alias(
        "translucent_bsdf",
        &[N, ALBEDO],
        "MaterialX's translucency: `albedo * translucent(N)`.",
        TranslucentParams::SPEC,
        Build::Tinted { kind: LobeKind::Translucent, args: &[Param(0)], weight: 1 },
    ),
    Form::alias(
        "transparent_bsdf",
        &[],
        "`transparent()`, as MaterialX calls it.",
        TransparentParams::SPEC,
        // A list of no sources stands for the form's own parameters: none either.
        Build::Lobe { kind: LobeKind::Transparent, args: &[] },
    ),
    Form::alias(
        "uniform_edf",
        &[ParamSpec {
            name: "emittance",
            doc: "Radiance given off on the normal's side.",
            max: f32::INFINITY,
            ..ALBEDO
        }],
        "MaterialX's emission: `emittance * emission()`.",
        EmissionParams::SPEC,
        Build::Tinted { kind: LobeKind::Emission, args: &[], weight: 0 },
    ),
    #[cfg(feature = "cloth")]
    Form::alias(
        "ashikhmin_velvet",
        &[N, SIGMA],
        "`velvet(N, sigma)`, nearly as Cycles has it.",
        VelvetParams::SPEC,
        Build::Lobe { kind: LobeKind::Velvet, args: &[Param(0), Param(1)] },
    )
    .noted("it is `velvet(N, sigma)`: an even body beside the rim, and another shadowing than Cycles has"),
];
