//! Families of lobes, which a build may leave out: a cargo feature each.
//!
//! Which lobe is in which family stands in the list of `lobes/mod.rs`. Here are the names of their closures, which a build
//! without them still has to know: a script that calls one is told what brings it.

/// A cargo feature, and the closures it brings.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    /// As in `Cargo.toml`.
    pub feature: &'static str,
    /// Whether this build has it.
    pub here: bool,
    /// The names scripts call them by.
    pub closures: &'static [&'static str],
}

/// All that can be left out.
pub const FAMILIES: &[Family] = &[
    Family {
        feature: "cloth",
        here: cfg!(feature = "cloth"),
        closures: &[
            "ashikhmin_velvet",
            "fabric",
            "microcylinder",
            "microcylinder_threads",
            "sheen",
            "sheen_bsdf",
            "thread",
            "velvet",
        ],
    },
    Family {
        feature: "microfacet",
        here: cfg!(feature = "microfacet"),
        closures: &[
            "conductor_bsdf",
            "dielectric_bsdf",
            "generalized_schlick_bsdf",
            "metal",
            "microfacet",
            "microfacet_aniso_fresnel",
            "microfacet_beckmann",
            "microfacet_beckmann_aniso",
            "microfacet_beckmann_refraction",
            "microfacet_ggx",
            "microfacet_ggx_aniso",
            "microfacet_ggx_refraction",
            "microfacet_multi_ggx",
            "microfacet_multi_ggx_aniso",
            "microfacet_multi_ggx_glass",
            "reflection",
            "refraction",
        ],
    },
    Family { feature: "legacy", here: cfg!(feature = "legacy"), closures: &["phong", "ward"] },
];

/// The feature that would bring the closure `name`, if this build was made without it.
pub fn left_out(name: &str) -> Option<&'static str> {
    FAMILIES.iter().find(|f| !f.here && f.closures.contains(&name)).map(|f| f.feature)
}

#[cfg(test)]
mod tests {
    use super::super::forms;
    use super::super::registry::Build;
    use super::*;
    use crate::closure::builder::BuildError;
    use std::collections::BTreeSet;

    /// What there is by the list of lobes and their other names, and what is said here.
    #[test]
    fn every_closure_is_named_in_its_family() {
        for family in FAMILIES {
            let built = forms().filter_map(|form| match form.build {
                Build::Lobe { kind, .. } | Build::Wrap { kind, .. } | Build::Tinted { kind, .. } => {
                    (kind.family() == Some(family.feature)).then_some(form.name)
                }
                Build::Layer => None,
            });
            let named: BTreeSet<_> = family.closures.iter().copied().filter(|_| family.here).collect();
            assert_eq!(built.collect::<BTreeSet<_>>(), named, "{}", family.feature);
        }
    }

    #[test]
    fn what_is_left_out_says_what_brings_it() {
        for family in FAMILIES {
            for name in family.closures {
                assert_eq!(left_out(name), (!family.here).then_some(family.feature));
                let script = format!("Ci = {name}(N, 0.5);");
                let found = crate::Engine::new().compile("left_out", &script).err().map(|e| e.to_string());
                let told = |text: String| text.contains("E0305") && text.contains(&format!("`{}`", family.feature));
                assert_eq!(found.is_some_and(told), !family.here, "{name}");
                let mut builder = crate::closure::Builder::new();
                let part = builder.lobe(name, []);
                let refused = matches!(builder.finish(part), Err(BuildError::LeftOut { .. }));
                assert_eq!(refused, !family.here, "{name}");
            }
        }
        assert!(forms().all(|form| left_out(form.name).is_none()));
    }
}
