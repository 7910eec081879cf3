//! The sheen models and the velvet against double-precision reference tables.
#![cfg(feature = "cloth")]

use crate::common::{Stack, alone, at, table};
use overcoat::albedo::quadrature::Rule;
use overcoat::albedo::{AlbedoCurve, Precision};
use overcoat::audit::{Side, Tolerance, albedo};
use overcoat::closure::ClosureTree;
use overcoat::lobes::charlie::{ExactLambda, lambda_quadrature, term_rows, terms_at};
use overcoat::lobes::{AnyLobe, LobeKind};
use overcoat::optics::{Scalar, V3};

const CONTY_KULLA: f32 = 1.0;
const REFIT: f32 = 2.0;
const EXACT: f32 = 3.0;
const CHARLIE_V: f32 = 4.0;
const ZELTNER: f32 = 5.0;

fn sheen(r: f64, model: f32, softening: f32) -> ClosureTree {
    alone(LobeKind::Sheen, &[("roughness", r as f32), ("model", model), ("softening", softening)])
}

fn velvet(r: f64) -> ClosureTree {
    alone(LobeKind::Velvet, &[("roughness", r as f32)])
}

/// The largest relative error of Λ over the whole table.
fn lambda_error<S: Scalar>(terms: impl Fn(f64) -> Vec<f64>) -> f64 {
    let (_, rows) = table("lambda_exact_vs_fit.csv");
    let mut worst = 0.0f64;
    for rows in rows.chunk_by(|a, b| a[0] == b[0]) {
        let terms: Vec<S> = terms(rows[0][0]).into_iter().map(S::c).collect();
        let exact = ExactLambda::<S>::new(S::c(rows[0][0]));
        for row in rows.iter().filter(|row| row[2] > 0.0) {
            let (cos, sin2) = (S::c(row[1]), S::c((1.0 - row[1]) * (1.0 + row[1])));
            let lambda = exact.cos_lambda(cos, sin2, &terms).to_f64() / cos.to_f64();
            worst = worst.max((lambda / row[2] - 1.0).abs());
        }
    }
    worst
}

#[test]
fn exact_lambda_matches_the_table() {
    let one = |r: f64| terms_at(r).to_vec();
    let errors = [lambda_error::<f64>(one), lambda_error::<f32>(one)];
    let varying = [lambda_error::<f64>(|_| term_rows()), lambda_error::<f32>(|_| term_rows())];
    println!(
        "relative error of Λ, f64 and f32: constant roughness {:.1e} {:.1e}, varying {:.1e} {:.1e}",
        errors[0], errors[1], varying[0], varying[1]
    );
    assert!(errors[0] < 1e-6 && errors[1] < 1e-5, "{errors:?}");
    assert!(varying[0] < 1e-6 && varying[1] < 1e-5, "{varying:?}");
}

#[test]
fn lambda_by_quadrature_matches_the_table() {
    let (_, rows) = table("lambda_exact_vs_fit.csv");
    let rule = Rule::gauss_legendre(20);
    let error = |row: &Vec<f64>| (lambda_quadrature(row[1], row[0], &rule) / row[2] - 1.0).abs();
    let worst = rows.iter().filter(|row| row[2] > 0.0).map(error).fold(0.0, f64::max);
    println!("relative error of Λ by quadrature {worst:.2e}");
    assert!(worst < 1e-9, "{worst}");
}

/// The largest errors over a column of the table: by adaptive quadrature of the lobe, and of its own albedo.
fn albedo_errors<S: Scalar>(
    column: usize,
    side: Side,
    (r_min, cos_min): (f64, f64),
    precision: Precision,
    tree: impl Fn(f64) -> ClosureTree,
) -> [f64; 2] {
    let (_, rows) = table("sheen_albedo.csv");
    let rows: Vec<_> = rows.iter().filter(|r| r[0] >= r_min && r[1] >= cos_min).collect();
    let mut worst = [0.0f64; 2];
    for chunk in rows.chunk_by(|a, b| a[0] == b[0]).step_by(3) {
        let stack = Stack::<S>::new(tree(chunk[0][0]), precision);
        for row in chunk.iter().step_by(4) {
            let tolerance = Tolerance { error: 1e-5, evaluations: 60_000 };
            let measured = albedo(&|w| stack.bsdf(w), side, at(row[1]), tolerance).value[0];
            let own = if side == Side::View { stack.bsdf(at(row[1])).albedo()[0].to_f64() } else { row[column] };
            worst = [worst[0].max((measured - row[column]).abs()), worst[1].max((own - row[column]).abs())];
        }
    }
    worst
}

/// The fits from here up.
const FITTED: (f64, f64) = (0.07, 0.001);

fn check_columns<S: Scalar>(tier: &str, precision: Precision, limit: f64) {
    type Column = (&'static str, usize, Side, (f64, f64), fn(f64) -> ClosureTree);
    let columns: [Column; 6] = [
        ("E_fit", 2, Side::View, FITTED, |r| sheen(r, CONTY_KULLA, 0.0)),
        ("E_soft_view", 3, Side::View, FITTED, |r| sheen(r, CONTY_KULLA, 1.0)),
        ("E_soft_light", 4, Side::Light, FITTED, |r| sheen(r, CONTY_KULLA, 1.0)),
        ("E_exact", 5, Side::View, (0.001, 0.001), |r| sheen(r, EXACT, 0.0)),
        ("E_charlie_V", 6, Side::View, (0.21, 0.001), |r| sheen(r, CHARLIE_V, 0.0)),
        ("E_ash_V", 7, Side::View, (0.01, 0.001), velvet),
    ];
    for (name, column, side, range, tree) in columns {
        let [measured, own] = albedo_errors::<S>(column, side, range, precision, tree);
        println!("{tier} {name}: measured within {measured:.1e}, own albedo within {own:.1e}");
        assert!(measured < limit && own < limit, "{tier} {name}: {measured} {own}");
    }
}

#[test]
fn albedos_match_the_table_in_single_precision() {
    check_columns::<f32>("standard", Precision::STANDARD, 1e-3);
}

#[test]
fn albedos_match_the_table_in_double_precision() {
    check_columns::<f64>("reference", Precision::REFERENCE, 1e-4);
}

#[test]
fn no_model_gains_over_its_whole_range() {
    for (model, softening) in [(REFIT, 0.0), (REFIT, 1.0), (EXACT, 0.0), (CHARLIE_V, 0.0), (ZELTNER, 0.0)] {
        let mut worst = (0.0, 0.0, 0.0);
        for k in 0..12 {
            let r = 0.001f64.powf(1.0 - k as f64 / 11.0);
            let stack = Stack::<f32>::new(sheen(r, model, softening), Precision::STANDARD);
            for cos in [1.0, 0.7, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-5, 1e-9] {
                for side in [Side::View, Side::Light] {
                    let tolerance = Tolerance { error: 1e-5, evaluations: 60_000 };
                    let e = albedo(&|w| stack.bsdf(w), side, at(cos), tolerance).max();
                    if e > worst.0 {
                        worst = (e, r, cos);
                    }
                }
            }
        }
        println!(
            "model {model} softening {softening}: E up to {:.4} at r {:.3}, cos {:.1e}",
            worst.0, worst.1, worst.2
        );
        assert!(worst.0 <= 1.0001, "{model} {softening}: {worst:?}");
    }
}

#[test]
fn zeltner_has_the_exact_models_albedo() {
    let (_, rows) = table("sheen_albedo.csv");
    let (mut sum, mut worst, mut n) = (0.0, 0.0f64, 0.0);
    for row in rows.iter().filter(|r| r[0] >= 0.05) {
        let values = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, row[0] as f32, 0.0, ZELTNER, 0.0];
        let curve = AlbedoCurve::<f64>::default();
        let wo = V3::polar(row[1], 0.0);
        let lobe = AnyLobe::<f64>::new(LobeKind::Sheen, &values, wo, &curve);
        // f·cos over the density it is sampled with is the albedo, for every direction.
        let wi = V3::polar(0.3, 1.0);
        let e = lobe.f(wi, &curve)[0] * wi.z / lobe.pdf(wi);
        sum += (e - row[5]).abs();
        worst = worst.max((e - row[5]).abs());
        n += 1.0;
    }
    println!("albedo of zeltner against the exact model: {:.1e} on average, {worst:.1e} at worst", sum / n);
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn what_is_unknown_before_shading_is_still_bounded() {
    // Roughness, mode, model and softening all vary.
    let unknown = [Some(0.0), Some(0.0), Some(1.0), Some(1.0), Some(1.0), Some(1.0), None, None, None, None];
    let spec = LobeKind::Sheen.curve(&unknown).expect("a curve");
    let curve = spec.bake::<f32>(Precision { cos_nodes: 64, axis_nodes: 24, ..Precision::STANDARD });
    let quadrature = (Rule::gauss_legendre(48), Rule::gauss_legendre(32));
    for model in 1..=5 {
        for (k, r) in [0.003, 0.05, 0.1, 0.37, 0.9].into_iter().enumerate() {
            let values = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, r, 0.0, model as f32, (k % 2) as f32];
            for cos in [0.004, 0.03, 0.21, 0.65, 1.0] {
                let wo = V3::<f32>::polar(cos, 0.0);
                let lobe = AnyLobe::new(LobeKind::Sheen, &values, wo, &curve);
                let mut e = 0.0;
                for (u, wu) in quadrature.0.nodes.iter().zip(&quadrature.0.weights) {
                    for (v, wv) in quadrature.1.nodes.iter().zip(&quadrature.1.weights) {
                        let wi = V3::polar((u * u * u) as f32, (std::f64::consts::PI * (1.0 - v * v)) as f32);
                        let f = lobe.f(wi, &curve)[0] as f64;
                        e += f * u.powi(5) * 3.0 * wu * wv * 4.0 * std::f64::consts::PI * v;
                    }
                }
                let bound = lobe.albedo_bound(wo, &curve)[0] as f64;
                assert!(e <= bound + 1e-4 && e <= 1.0001, "model {model} r {r} cos {cos}: {e} over {bound}");
            }
        }
    }
}
