//! The `balanced` rule: lossless and reciprocal where it can be, `min` where not.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::common::at;
use overcoat::audit::chi2::direction;
use overcoat::audit::{Side, Tolerance, albedo, reciprocity_error};
use overcoat::closure::balance::Balance;
use overcoat::closure::{Fate, LayeringRule, TintRule, Unbalanced};
use overcoat::engine::Tier;
use overcoat::{Engine, Globals, Material};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

const TOLERANCE: Tolerance = Tolerance { error: 3e-5, evaluations: 30_000 };
const COSINES: [f64; 7] = [1.0, 0.75, 0.4, 0.15, 0.05, 0.01, 0.001];

fn material(layering: LayeringRule, script: &str) -> Material {
    let engine = Engine::new().layering(layering);
    engine.compile("test", script).expect("compiles").material(&[]).expect("sets")
}

fn measured(material: &Material, globals: &Globals, side: Side, cos: f64) -> [f64; 3] {
    let subject = |wo: [f32; 3]| material.shade(globals, wo.into()).expect("shades");
    albedo(&subject, side, at::<f32>(cos), TOLERANCE).value
}

/// The largest gap to `lossless` over angles and sides, the largest albedo, and the largest reciprocity error.
fn worst(script: &str, globals: &Globals, lossless: impl Fn(f64) -> [f64; 3]) -> (f64, f64, f64) {
    let material = material(LayeringRule::Balanced, script);
    let (mut gap, mut most) = (0.0f64, 0.0f64);
    for cos in COSINES {
        let target = lossless(cos);
        for side in [Side::View, Side::Light] {
            let e = measured(&material, globals, side, cos);
            for c in 0..3 {
                gap = gap.max((e[c] - target[c]).abs());
                most = most.max(e[c]);
            }
        }
    }
    let subject = |wo: [f32; 3]| material.shade(globals, wo.into()).expect("shades");
    let (reciprocity, ..) = reciprocity_error(&subject, 2000, &mut Pcg64Mcg::seed_from_u64(1));
    (gap, most, reciprocity)
}

/// E of the top, and of the base where nothing covers it.
fn parts(top: &str, base: &str) -> impl Fn(f64) -> ([f64; 3], [f64; 3]) + use<> {
    let of = |script: &str| material(LayeringRule::Min, &format!("Ci = {script};"));
    let (top, base) = (of(top), of(base));
    move |cos| {
        let e = |m: &Material| measured(m, &Globals::default(), Side::View, cos);
        (e(&top), e(&base))
    }
}

#[test]
fn lossless_and_reciprocal() {
    let tops = [
        r#"sheen_bsdf(N, 1, 0.1, "model", "exact")"#,
        r#"sheen_bsdf(N, 1, 0.3, "model", "exact")"#,
        r#"sheen_bsdf(N, 1, 1.0, "model", "exact")"#,
        r#"sheen_bsdf(N, 1, 0.3, "softening", 0)"#,
        r#"color(0.9, 0.5, 0.2) * sheen_bsdf(N, 1, 0.15, "softening", 0)"#,
    ];
    let bases = [
        "diffuse(N)",
        "eon(N, color(1, 0.6, 0.1), 0.8)",
        "velvet(N, 0.3)",
        "oren_nayar(N, 0.4)",
        "microfacet_ggx(N, 0.1)",
        "microfacet_ggx(N, 0.3)",
        "microfacet_ggx(N, 0.8)",
        "conductor_bsdf(N, dPdu, 0.3, 0.3, color(0.2, 0.4, 1.4), color(3.4, 2.3, 1.8), \"ggx\")",
        "color(0.4, 0.1, 0.6) * eon(N, color(1, 0.8, 0.3), 0.5) + color(0.6, 0.2, 0.1) * diffuse(N)",
        "color(0.4, 0.1, 0.6) * microfacet_ggx(N, 0.4) + color(0.6, 0.2, 0.1) * eon(N, color(1, 0.8, 0.3), 0.5)",
    ];
    for top in tops {
        for base in bases {
            let parts = parts(top, base);
            let lossless = |cos: f64| {
                let (t, b) = parts(cos);
                let alpha = 1.0 - t[0].max(t[1]).max(t[2]);
                std::array::from_fn(|c| t[c] + alpha * b[c])
            };
            let script = format!("Ci = layer({top}, {base});");
            let (gap, most, reciprocity) = worst(&script, &Globals::default(), lossless);
            assert!(gap < 1e-3, "{script}: {gap} from lossless");
            assert!(most <= 1.0001, "{script}: {most}");
            assert!(reciprocity <= 1e-5, "{script}: reciprocity {reciprocity}");
        }
    }
}

#[test]
fn each_channel_on_its_own() {
    let (top, base) = (r#"color(1, 0.5, 0) * sheen_bsdf(N, 1, 0.5, "model", "exact")"#, "diffuse(N)");
    let script = format!("Ci = layer({top}, {base});");
    let engine = Engine::new().layering(LayeringRule::Balanced).tint_rule(TintRule::Channel);
    let material = engine.compile("t", &script).expect("compiles").material(&[]).expect("sets");
    for cos in COSINES {
        for x in measured(&material, &Globals::default(), Side::Light, cos) {
            assert!((1.0 - x).abs() < 1e-3, "cos {cos}: {x}");
        }
    }
}

#[test]
fn nested_layers_and_layers_as_tops() {
    let a = r#"color(0.8, 0.4, 0.1) * sheen_bsdf(N, 1, 0.2, "model", "exact")"#;
    let b = r#"sheen_bsdf(N, 1, 0.6, "model", "exact")"#;
    let (of_a, of_b) = (parts(a, a), parts(b, b));
    let both = |cos: f64| (of_a(cos).0, of_b(cos).0);
    // Nested, each layer passes 1 − its own largest channel; as one top, 1 − the largest of what both reflect.
    let top = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|c| a[c] + (1.0 - a[0]) * b[c]) };
    let nested = |cos: f64| {
        let (a, b) = both(cos);
        top(a, b).map(|e| e + (1.0 - a[0]) * (1.0 - b[0]))
    };
    let as_top = |cos: f64| {
        let (a, b) = both(cos);
        let top = top(a, b);
        top.map(|e| e + 1.0 - top[0])
    };
    let check = |script: &str, lossless: &dyn Fn(f64) -> [f64; 3]| {
        let (gap, most, reciprocity) = worst(script, &Globals::default(), lossless);
        assert!(gap < 1e-3 && most <= 1.0001 && reciprocity <= 1e-5, "{script}: {gap} {most} {reciprocity}");
    };
    check(&format!("Ci = layer({a}, layer({b}, diffuse(N)));"), &nested);
    check(&format!("Ci = layer(layer({a}, {b}), diffuse(N));"), &as_top);
}

#[test]
fn where_the_top_varies() {
    let script =
        r#"Ci = sheen(color(1, u, v) * diffuse(N), N, color(1, 0, 0) * (0.2 + v * 0.8), u, "model", "exact");"#;
    for (u, v) in [(0.1, 0.3), (0.2, 1.0), (0.37, 0.7), (0.93, 0.95)] {
        let globals = Globals { u, v, ..Globals::default() };
        let parts = parts(&format!(r#"sheen_bsdf(N, {}, {u}, "model", "exact")"#, 0.2 + v * 0.8), "diffuse(N)");
        // What the base passes on is dimmed by the largest channel of the top, which is red.
        let lossless = |cos: f64| {
            let ([top, ..], _) = parts(cos);
            [1.0, u as f64 * (1.0 - top), v as f64 * (1.0 - top)]
        };
        let (gap, most, reciprocity) = worst(script, &globals, lossless);
        assert!(gap < 1e-3 && most <= 1.0001 && reciprocity <= 1e-5, "{u} {v}: {gap} {most} {reciprocity}");
    }
}

#[test]
fn bounds_hold() {
    for script in [
        r#"Ci = layer(layer(sheen_bsdf(N, 1, 0.3, "model", "exact"), diffuse(N)), translucent(N));"#,
        r#"Ci = sheen(0.7 * diffuse(N) + 0.3 * translucent(N), N, 1, 0.2 + 0.5 * u);"#,
        r#"Ci = sheen(sheen(eon(N, 1, 0.3), N, 1, 0.3), N, color(1, 0.2, 0), 0.8, "model", "charlie_v");"#,
    ] {
        for tier in [Tier::Fast, Tier::Standard] {
            let engine = Engine::new().layering(LayeringRule::Balanced).tier(tier);
            let material = engine.compile("t", script).expect("compiles").material(&[]).expect("sets");
            for cos in [1.0, 0.3, 0.02, -0.4] {
                for side in [Side::View, Side::Light] {
                    let e = measured(&material, &Globals::default(), side, cos);
                    let bsdf = material.shade(&Globals::default(), at::<f32>(0.5).into()).expect("shades");
                    let bound = bsdf.albedo_bound(at::<f32>(cos));
                    for c in 0..3 {
                        assert!(e[c] <= bound[c] as f64 + 6e-5, "{script} {tier:?} {side:?} {cos}: {e:?} {bound:?}");
                        assert!(e[c] <= 1.0001, "{script} {tier:?} {side:?} {cos}: {e:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_cannot_be_balanced_keeps_min() {
    let fate = |script: &str| {
        let fates = material(LayeringRule::Balanced, script).balance().map(Balance::fates).expect("balanced");
        fates.last().expect("a lobe").1
    };
    for (base, expected) in [
        ("diffuse(N)", Fate::Balanced),
        ("diffuse(Ng)", Fate::Min(Unbalanced::Normal)),
        ("translucent(N)", Fate::Min(Unbalanced::Crosses)),
        ("transparent()", Fate::Min(Unbalanced::Delta)),
        ("fabric(N, dPdu, 0.3)", Fate::Min(Unbalanced::Tangent)),
        ("sheen_bsdf(N, 1, 0.3)", Fate::Min(Unbalanced::NotReciprocal)),
        ("emission()", Fate::Uncovered),
    ] {
        assert_eq!(fate(&format!("Ci = layer(velvet(N, 0.5), {base});")), expected, "{base}");
    }
    assert_eq!(fate("Ci = layer(fabric(N, dPdu, 0.3), diffuse(N));"), Fate::Min(Unbalanced::Tangent));
    let two_normals = "Ci = layer(0.5 * velvet(N, 0.3) + 0.5 * velvet(Ng, 0.3), diffuse(N));";
    assert_eq!(fate(two_normals), Fate::Min(Unbalanced::Normal));
    // Bit for bit the same as `min`.
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    for script in [
        "Ci = layer(velvet(N, 0.5), 0.5 * translucent(N) + 0.5 * fabric(N, dPdu, 0.2));",
        "Ci = layer(max(0, -I[2]) * velvet(N, 0.5), diffuse(N));",
        "Ci = layer(2 * u * velvet(N, 0.5), diffuse(N));",
    ] {
        let globals = Globals { u: 0.7, ..Globals::default() };
        let (a, b) = (material(LayeringRule::Balanced, script), material(LayeringRule::Min, script));
        for _ in 0..50 {
            let (wo, wi) = (direction::<f32>(&mut rng), direction::<f32>(&mut rng));
            let f = |m: &Material| m.shade(&globals, wo.into()).expect("shades").eval(wi).f_cos;
            assert_eq!(f(&a), f(&b), "{script}");
        }
    }
}

#[test]
fn lambert_has_the_product_form() {
    let top = r#"sheen_bsdf(N, 1, 0.4, "model", "exact")"#;
    let material = material(LayeringRule::Balanced, &format!("Ci = layer({top}, diffuse(N));"));
    let alone = parts(top, top);
    let alpha = |cos: f64| 1.0 - alone(cos).0[0];
    // The mean of α over the hemisphere, cosine-weighted.
    let steps = 400;
    let mean: f64 = (0..steps).map(|k| (k as f64 + 0.5) / steps as f64).map(|x| alpha(x.sqrt()) / steps as f64).sum();
    let bsdf = material.shade(&Globals::default(), at::<f32>(0.3).into()).expect("shades");
    let top = self::material(LayeringRule::Min, &format!("Ci = {top};"));
    let top = top.shade(&Globals::default(), at::<f32>(0.3).into()).expect("shades");
    for cos in [0.9, 0.5, 0.1] {
        let base = (bsdf.f(at(cos))[0] - top.f(at(cos))[0]) as f64;
        let product = alpha(0.3) * alpha(cos) / mean / std::f64::consts::PI;
        assert!((base - product).abs() < 1e-3 * product, "cos {cos}: {base} {product}");
    }
}
