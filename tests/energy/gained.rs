//! What once gained energy, found by campaigns of random trees and cut down to what mattered.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use overcoat::audit::{Side, Tolerance, albedo};
use overcoat::closure::LayeringRule::{self, Balanced, Min, View};
use overcoat::engine::Tier::{self, Fast, Standard};
use overcoat::{Engine, Globals};

/// Tier, rule, cosine and azimuth in degrees of the viewer's direction, what `Ci` is.
const GAINED: &[(Tier, LayeringRule, f64, f64, &str)] = &[
    // By 40 %: a cloth whose offsets are a hundredth of a degree, between the horizon and the first node of its table.
    (
        Fast,
        View,
        1e-6,
        0.0,
        "layer(microcylinder_threads(N, vector(1, 0, 0), 1, 2.85, 1, 17, 2, 0.3, 0.01, 1, 1.43, 0.37, 2, 2, 0, 0), transparent())",
    ),
    // By 5 %: one family of threads, seen across.
    (
        Standard,
        View,
        1.8e-5,
        87.0,
        "layer(microcylinder_threads(N, vector(1, 0, 0), 1, 1.46, 0.3, 12, 24, 0.3, 3, 1, 1.46, 0.3, 12, 24, 0, 0), transparent())",
    ),
    // By 6e-4: glass bends most within 20 degrees of the normal, between two nodes of a small table.
    (Fast, Min, 0.955, 0.0, r#"dielectric_bsdf(N, vector(1, 0, 0), 1, 1, 0.66, 0.66, 1.227, "ggx")"#),
    // By 2e-4: what a stretched surface misses is next to nothing at the normal and grows fast from there.
    (
        Fast,
        Min,
        0.96,
        85.0,
        r#"dielectric_bsdf(N, vector(1, 0, 0), 1, 1, 0.0138, 0.3, 4, "beckmann", "thin_walled", 1)"#,
    ),
    // By 9e-3: a stretched thin wall next to its total reflection.
    (
        Standard,
        View,
        0.023,
        303.14,
        r#"layer(dielectric_bsdf(normal(0.36, -0.53, 0.766), vector(1, 0, 0), 1, 0, 0.0001, 1, 0.1, "ggx",
            "thin_walled", 1), transparent())"#,
    ),
    // By a tenth: a mirror that reflects from below too, below a layer that passes less there.
    (
        Fast,
        Balanced,
        -2.2e-5,
        112.35,
        r#"layer(0.876 * refraction(N, 1.5), layer(0.0129 * eon(N, color(0.426, 0.187, 0.149), 0.305),
            microfacet("default", N, vector(-0.57, 0.52, 0.18), 1, 0.527, 0.2147, 0)))"#,
    ),
    // By 1e-3: a color that weighs the lobe only where energy is not compensated.
    (
        Standard,
        Balanced,
        0.377,
        0.0,
        r#"layer(layer(phong(N, 2.27), oren_nayar_diffuse_bsdf(N, 0.187, 0.7266, "energy_compensation", 1)), transparent())"#,
    ),
    // By 6 % and 1.5 %: facets that only reflect, or only refract, next to their total reflection: the step lies between two
    // nodes of their tables.
    (
        Fast,
        View,
        -0.734,
        24.0,
        r#"layer(microfacet("ggx", N, vector(1, 0, 0), 0.0001, 0.0001, 1.5, 0), transparent())"#,
    ),
    (
        Standard,
        View,
        0.9719,
        69.0,
        r#"layer(microfacet("ggx", N, vector(1, 0, 0), 0.0325, 0.0001, 0.25, 1), transparent())"#,
    ),
    // By 2e-5 more than is allowed: half way between a probe and a node that lacks next to nothing.
    (Fast, Min, 0.98427, 165.396, r#"microfacet("beckmann", N, vector(1, 0, 0), 0.349, 0.0402, 0, 2)"#),
];

#[test]
fn what_once_gained_does_not() {
    for (tier, rule, cos, phi, closure) in GAINED {
        let engine = Engine::new().tier(*tier).layering(*rule);
        let shader = engine.compile("gained", &format!("Ci = {closure};")).expect("compiles");
        let material = shader.material(&[]).expect("sets");
        let globals = Globals::default();
        let subject = |wo: [f32; 3]| material.shade(&globals, wo.into()).expect("shades");
        let (sin, phi) = ((1.0 - cos * cos).sqrt(), phi.to_radians());
        let wo = [sin * phi.cos(), sin * phi.sin(), *cos].map(|x| x as f32);
        let e = albedo(&subject, Side::View, wo, Tolerance { error: 2e-5, evaluations: 400_000 });
        println!("{:.5} ± {:.0e}: {closure}", e.max(), e.error);
        assert!(e.max() <= 1.0001 && e.error < 1e-4, "{} ± {}: {closure}", e.max(), e.error);
    }
}
