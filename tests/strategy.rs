//! The strategy for property tests, used as a host would: no tree of it gains energy.
#![cfg(feature = "proptest")]

use overcoat::Globals;
use overcoat::albedo::Precision;
use overcoat::audit::campaign::LIMIT;
use overcoat::audit::strategy::{closure_tree, recipe};
use overcoat::audit::{Side, Tolerance, albedo_until, script};
use overcoat::closure::{Curves, flatten};
use overcoat::optics::V3;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    #[test]
    fn no_tree_gains(tree in closure_tree(), z in -1.0f32..1.0, turn in 0.0f32..6.2) {
        let coarse = Precision { cos_nodes: 48, axis_nodes: 12, polar: 24, azimuth: 16, ..Precision::STANDARD };
        let curves = Curves::<f32>::for_tree(&tree, coarse);
        let subject = |wo: [f32; 3]| {
            let wo = V3::new(wo[0], wo[1], wo[2]);
            flatten(&tree, &Globals::default(), wo, Default::default(), &curves).expect("a small tree")
        };
        let r = (1.0 - z * z).max(0.0).sqrt();
        for side in [Side::View, Side::Light] {
            let tolerance = Tolerance { error: 2e-5, evaluations: 200_000 };
            let w = [r * turn.cos(), r * turn.sin(), z];
            let e = albedo_until(&subject, side, w, tolerance, |e| e.max() + e.error <= LIMIT);
            prop_assert!(e.max() - e.error <= LIMIT, "{side:?} {w:?}: {e:?}\n{}", script(&tree, |_, _| false));
        }
    }
}

proptest! {
    #[test]
    fn trees_are_budgeted(recipe in recipe()) {
        prop_assert!(recipe.budget().iter().all(|b| *b <= 1.0 + 1e-5), "{recipe:?}");
    }
}
