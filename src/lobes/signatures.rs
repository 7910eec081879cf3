//! Every way to call a closure, gathered from the lobes and their other names.

use super::registry::{Build, Form, ParamSpec};
use super::{LobeKind, aliases, subsurface};
#[cfg(feature = "microfacet")]
use super::{facet_aliases, specular};
#[cfg(feature = "cloth")]
use super::{microcylinder_threads, sheen};

/// Layers one closure over another.
const LAYER: Form = Form {
    name: "layer",
    params: &[
        ParamSpec::closure("top", "What light meets first."),
        ParamSpec::closure("base", "What lies below; scaled by what the top passes on."),
    ],
    doc: "`top` over `base`: the base is scaled by min(α(ωo), α(ωi)), α = 1 − the albedo bound of the top.",
    source: "Conty & Kulla 2017, §5, after Kelemen & Szirmay-Kalos 2001",
    reciprocal: true,
    build: Build::Layer,
    note: "",
};

/// Every way to call a closure: each lobe under its own name, then wrappers and aliases. Several forms may share a
/// name; their parameter types tell them apart.
pub fn forms() -> impl Iterator<Item = Form> {
    let lobes = LobeKind::ALL.iter().map(|k| Form::of_lobe(*k, k.spec()));
    let lists: &[&[Form]] = &[
        #[cfg(feature = "cloth")]
        &[microcylinder_threads::FORM],
        #[cfg(feature = "cloth")]
        sheen::FORMS,
        #[cfg(feature = "microfacet")]
        specular::FORMS,
        #[cfg(feature = "microfacet")]
        facet_aliases::FORMS,
        aliases::FORMS,
        &subsurface::FORMS,
    ];
    lobes.chain([LAYER]).chain(lists.iter().copied().flatten().copied())
}
