//! The sheen against its double-precision reference tables.
#![cfg(feature = "cloth")]

use crate::common::{Stack, alone, at, lobe, table};
use overcoat::albedo::Precision;
use overcoat::audit::{Side, Tolerance, albedo};
use overcoat::closure::ClosureTree;
use overcoat::lobes::LobeKind;

fn sheen(r: f64, softening: f32) -> ClosureTree {
    alone(LobeKind::Sheen, &[("roughness", r as f32), ("softening", softening)])
}

#[test]
fn albedo_of_the_lobe_matches_the_table() {
    let (_, rows) = table("sheen_albedo.csv");
    let rows: Vec<_> = rows.iter().filter(|r| r[0] >= 0.07 && r[1] >= 0.01).collect();
    let mut checked = 0;
    let mut worst = 0.0f64;
    for chunk in rows.chunk_by(|a, b| a[0] == b[0]).step_by(3) {
        let [soft, raw] = [1.0, 0.0].map(|s| Stack::<f32>::new(sheen(chunk[0][0], s), Precision::STANDARD));
        for row in chunk.iter().step_by(3) {
            let tolerance = Tolerance { error: 1e-5, evaluations: 20_000 };
            let of = |stack: &Stack<f32>, side| albedo(&|w| stack.bsdf(w), side, at(row[1]), tolerance).value[0];
            for (measured, truth) in
                [(of(&soft, Side::View), row[3]), (of(&soft, Side::Light), row[4]), (of(&raw, Side::View), row[2])]
            {
                worst = worst.max((measured - truth).abs());
                checked += 1;
            }
        }
    }
    println!("{checked} values, worst difference {worst:.2e}");
    assert!(checked > 200 && worst < 1e-4, "{checked} values, worst {worst}");
}

#[test]
fn sheen_over_lambert_matches_the_table() {
    let (_, rows) = table("sheen_over_lambert.csv");
    let mut worst = 0.0f64;
    for chunk in rows.chunk_by(|a, b| a[..2] == b[..2]) {
        let (r, tint) = (chunk[0][0], chunk[0][1] as f32);
        let mut tree = sheen(r, 1.0);
        let top = tree.mul([tint; 3], tree.root());
        let base = lobe(&mut tree, LobeKind::Diffuse, &[]);
        let both = tree.layer(top, base);
        tree.set_root(both);
        let stack = Stack::<f32>::new(tree, Precision::STANDARD);
        for row in chunk {
            for (side, truth) in [(Side::View, row[6]), (Side::Light, row[7])] {
                let a = albedo(&|w| stack.bsdf(w), side, at(row[2]), Tolerance { error: 2e-5, evaluations: 40_000 });
                worst = worst.max((a.value[0] - truth).abs());
                assert!(a.max() <= 1.0001, "r {r} tint {tint} cos {} {side:?}: {a:?}", row[2]);
            }
        }
    }
    println!("worst difference {worst:.2e}");
    assert!(worst < 1e-3, "worst difference {worst}");
}
