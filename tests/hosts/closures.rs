//! Closures that a host brings along are lobes like any other.
#![cfg(feature = "cloth")]

use crate::common::at;
use overcoat::audit::{Side, Tolerance, albedo, chi2, reciprocity_error};
use overcoat::closure::LayeringRule;
use overcoat::lobes::host::{ClosureSpec, HostLobe, RegisterError};
use overcoat::{Engine, Globals, Material};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::{FRAC_1_PI, PI};

const TOLERANCE: Tolerance = Tolerance { error: 2e-5, evaluations: 60_000 };

/// Minnaert 1941: k·(μo·μi)^(m−1), white at k = 1, gaining toward grazing angles for m < 1 unless it is divided.
struct Minnaert;

impl HostLobe for Minnaert {
    fn f(&self, values: &[f32], wo: [f64; 3], wi: [f64; 3]) -> [f64; 3] {
        let m = f64::from(values[3]);
        if wo[2] <= 0.0 || wi[2] <= 0.0 {
            return [0.0; 3];
        }
        let f = (wo[2] * wi[2]).powf(m - 1.0) * (m + 1.0) * 0.5 * FRAC_1_PI;
        std::array::from_fn(|c| f * f64::from(values[4 + c]))
    }

    fn albedo_bound(&self, values: &[f32], w: [f64; 3]) -> [f64; 3] {
        if w[2] <= 0.0 {
            return [0.0; 3];
        }
        let e = w[2].powf(f64::from(values[3]) - 1.0);
        std::array::from_fn(|c| e * f64::from(values[4 + c]))
    }
}

fn minnaert() -> ClosureSpec {
    ClosureSpec::new("minnaert")
        .doc("The law of the lunar disc.", "Minnaert 1941")
        .normal("N", "Shading normal.")
        .float("m", 0.7, 0.5..=2.0, "1 is Lambert; lower brightens the limb.")
        .color("tint", [1.0; 3], 0.0..=1.0, "Color.")
        .keyword()
}

fn engine() -> Engine {
    Engine::new().register(minnaert(), Minnaert).expect("registers")
}

fn material(engine: &Engine, script: &str) -> Material {
    engine.compile("test", script).expect("compiles").material(&[]).expect("sets")
}

fn measured(material: &Material, side: Side, cos: f64) -> [f64; 3] {
    let subject = |wo: [f32; 3]| material.shade(&Globals::default(), wo.into()).expect("shades");
    albedo(&subject, side, at::<f32>(cos), TOLERANCE).value
}

#[test]
fn it_keeps_energy_wherever_it_stands() {
    for script in [
        "Ci = minnaert(N, 0.5);",
        "Ci = minnaert(N, 2);",
        "Ci = layer(minnaert(N, 0.6, \"tint\", color(0.9, 0.2, 0)), diffuse(N));",
        "Ci = sheen(minnaert(N, 0.5 + u), N, 1, 0.4);",
        "Ci = layer(0.5 * minnaert(N, 0.5) + 0.5 * velvet(N, 0.2), minnaert(Ng, 1.5));",
    ] {
        for rule in [LayeringRule::Min, LayeringRule::Balanced] {
            let material = material(&engine().layering(rule), script);
            for cos in [1.0, 0.6, 0.2, 0.03, -0.5] {
                for side in [Side::View, Side::Light] {
                    let e = measured(&material, side, cos);
                    assert!(e.iter().all(|e| *e <= 1.0001), "{script} {rule:?} {side:?} {cos}: {e:?}");
                }
            }
        }
    }
    // Not by going dark: at m = 1 it is Lambert.
    let white = material(&engine(), "Ci = minnaert(N, 1);");
    assert!((measured(&white, Side::View, 0.4)[0] - 1.0).abs() < 1e-4);
}

#[test]
fn it_is_sampled_and_reciprocal() {
    let material = material(&engine(), "Ci = layer(minnaert(N, 0.6), diffuse(N));");
    let subject = |wo: [f32; 3]| material.shade(&Globals::default(), wo.into()).expect("shades");
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    for cos in [1.0, 0.3, 0.05] {
        assert!(chi2(&subject, at(cos), 100_000, &mut rng).p_value > 1e-4, "cos {cos}");
    }
    assert!(reciprocity_error(&subject, 1000, &mut rng).0 < 1e-5);
    let bsdf = subject(at(0.4));
    let directions: Vec<[f32; 3]> = (0..20).map(|k| at(k as f64 / 10.0 - 1.0)).collect();
    let mut batch = vec![bsdf.eval([0.0, 0.0, 1.0]); directions.len()];
    bsdf.eval_batch(&directions, &mut batch);
    for (direction, eval) in directions.iter().zip(batch) {
        assert_eq!(bsdf.eval(*direction), eval);
    }
}

#[test]
fn scripts_know_it_and_only_where_it_is_registered() {
    let engine = engine();
    let wrong = engine.compile("t", "Ci = minnaert(N);").unwrap_err().to_string();
    assert!(wrong.contains("minnaert"), "{wrong}");
    let wrong = engine.compile("t", "Ci = minaert(N, 1);").unwrap_err().to_string();
    assert!(wrong.contains("did you mean `minnaert`?"), "{wrong}");
    assert!(Engine::new().compile("t", "Ci = minnaert(N, 1);").is_err());
    // Values outside the range are clamped, nonsense becomes the default.
    let eval = |script: &str| {
        let bsdf_of = material(&engine, script);
        bsdf_of.shade(&Globals::default(), glam::Vec3::new(0.6, 0.0, 0.8)).expect("shades").eval([0.0, 0.6, 0.8]).f_cos
    };
    assert_eq!(eval("Ci = minnaert(N, 9);"), eval("Ci = minnaert(N, 2);"));
    assert_eq!(eval("Ci = minnaert(N, log(0) - log(0) + 0.7);"), eval("Ci = minnaert(N, 0.7);"));
}

/// Answers with nonsense.
struct Broken;

impl HostLobe for Broken {
    fn f(&self, _: &[f32], _: [f64; 3], wi: [f64; 3]) -> [f64; 3] {
        [f64::NAN, f64::INFINITY, if wi[0] > 0.0 { -1.0 } else { 1e300 }]
    }

    fn albedo_bound(&self, _: &[f32], w: [f64; 3]) -> [f64; 3] {
        [f64::NAN, -5.0, if w[1] > 0.0 { f64::INFINITY } else { 1e-300 }]
    }

    fn pdf(&self, _: &[f32], _: [f64; 3], _: [f64; 3]) -> f64 {
        f64::NAN
    }

    fn sample(&self, _: &[f32], _: [f64; 3], _: [f64; 2]) -> [f64; 3] {
        [f64::NAN; 3]
    }
}

#[test]
fn nonsense_stays_finite() {
    let engine = Engine::new().register(ClosureSpec::new("broken"), Broken).expect("registers");
    let material = material(&engine, "Ci = layer(0.5 * broken() + 0.5 * velvet(N, 0.3), broken() + diffuse(N));");
    let bsdf = material.shade(&Globals::default(), glam::Vec3::Z).expect("shades");
    for cos in [-1.0, -0.2, 0.0, 0.3, 1.0] {
        let eval = bsdf.eval(at(cos));
        assert!(eval.f_cos.iter().all(|f| f.is_finite() && *f >= 0.0) && eval.pdf.is_finite(), "{eval:?}");
        for sample in bsdf.sample([0.3, 0.7, cos.abs() as f32 * 0.99]).into_iter() {
            assert!(sample.weight.iter().all(|w| w.is_finite()), "{sample:?}");
        }
    }
}

/// Claims half of what it reflects.
struct Boaster;

impl HostLobe for Boaster {
    fn f(&self, _: &[f32], wo: [f64; 3], wi: [f64; 3]) -> [f64; 3] {
        [if wo[2] > 0.0 && wi[2] > 0.0 { 1.0 / PI } else { 0.0 }; 3]
    }

    fn albedo_bound(&self, _: &[f32], w: [f64; 3]) -> [f64; 3] {
        [if w[2] > 0.0 { 0.5 } else { 0.0 }; 3]
    }
}

#[test]
fn a_bound_that_is_too_low_is_found_by_measuring() {
    let engine = Engine::new().register(ClosureSpec::new("boaster").normal("N", ""), Boaster).expect("registers");
    let material = material(&engine, "Ci = layer(boaster(N), diffuse(N));");
    assert!(measured(&material, Side::View, 0.5)[0] > 1.4);
}

#[test]
fn malformed_signatures_are_refused() {
    let refused = |spec: ClosureSpec| Engine::new().register(spec, Minnaert).err();
    assert_eq!(refused(ClosureSpec::new("2b")), Some(RegisterError::BadName("2b".into())));
    assert_eq!(refused(ClosureSpec::new("a b")), Some(RegisterError::BadName("a b".into())));
    let same = ClosureSpec::new("x").float("a", 0.0, 0.0..=1.0, "").float("a", 0.0, 0.0..=1.0, "");
    assert_eq!(refused(same), Some(RegisterError::SameName("a".into())));
    let range = ClosureSpec::new("x").float("a", 2.0, 0.0..=1.0, "");
    assert_eq!(refused(range), Some(RegisterError::BadRange("a".into())));
    let nan = ClosureSpec::new("x").float("a", 0.0, f32::NAN..=1.0, "");
    assert_eq!(refused(nan), Some(RegisterError::BadRange("a".into())));
    let many = (0..9).fold(ClosureSpec::new("x"), |s, k| s.color(&format!("c{k}"), [0.0; 3], 0.0..=1.0, ""));
    assert_eq!(refused(many), Some(RegisterError::TooManyValues(27)));
    assert_eq!(refused(ClosureSpec::new("diffuse").normal("N", "")), Some(RegisterError::Taken("diffuse".into())));
    let twice = engine().register(minnaert(), Minnaert).err();
    assert_eq!(twice, Some(RegisterError::Taken("minnaert".into())));
    // The same name with other types is another form.
    assert!(refused(ClosureSpec::new("diffuse").normal("N", "").float("x", 0.0, 0.0..=1.0, "")).is_none());
}
