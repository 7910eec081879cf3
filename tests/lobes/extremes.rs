//! Every lobe at the ends of its parameters and of its angles gives sane numbers, and rounding stays rounding.
#![cfg(feature = "cli")]

use overcoat::audit::extremes::{Extremes, PAIRS, Row, Setting};
use overcoat::engine::Tier;
use overcoat::lobes::LobeKind;
use overcoat::lobes::registry::LobeClass;
use rayon::prelude::*;

#[test]
fn no_result_is_infinite_undefined_or_negative() {
    // Two blocks of parameters for each lobe; `overcoat extremes` tries more.
    let campaign = Extremes { seed: 1, cases: 2 * PAIRS };
    let rows: Vec<Row> = LobeKind::ALL.par_iter().flat_map_iter(|k| campaign.measure(*k)).collect();
    assert_eq!(rows.len(), LobeKind::ALL.len() * 3 * 7);
    for r in &rows {
        assert_eq!((r.evaluations, r.faults), (2 * PAIRS as u64, 0), "{:?}", r.fault);
    }
    // The comparison sees something of most lobes that scatter.
    let scatters = |r: &&Row| r.lobe.spec().class == LobeClass::Scatter && r.setting == Setting::Alone;
    let (seen, all) =
        (rows.iter().filter(scatters).filter(|r| r.compared > 20).count(), rows.iter().filter(scatters).count());
    assert!(seen * 2 > all, "{seen} of {all}");
}

#[test]
fn the_same_seed_finds_the_same() {
    let find = |seed| {
        let rows = Extremes { seed, cases: PAIRS }.measure(LobeKind::OrenNayar);
        rows.iter().map(|r| (r.compared, r.error.error.to_bits(), r.beyond.error.to_bits())).collect::<Vec<_>>()
    };
    assert_eq!(find(3), find(3));
    assert_ne!(find(3), find(4));
}

/// Diffuse surfaces are polynomials of cosines: whatever their parameters, only rounding is left of an error.
#[test]
fn smooth_lobes_are_off_by_rounding_alone() {
    for kind in [LobeKind::Diffuse, LobeKind::Translucent, LobeKind::OrenNayar] {
        for r in (Extremes { seed: 2, cases: 8 * PAIRS }).measure(kind).iter().filter(|r| r.setting == Setting::Alone) {
            let unit = if r.tier == Tier::Reference { f64::EPSILON } else { f64::from(f32::EPSILON) };
            assert!(r.compared > 100, "{kind:?} {:?}: {}", r.tier, r.compared);
            assert!(r.beyond.error < 16.0 * unit, "{kind:?} {:?}: {:e} {:?}", r.tier, r.beyond.error, r.beyond.at);
        }
    }
}
