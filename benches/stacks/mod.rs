//! What the benches of shading measure: layered stacks, and where they are seen from.
//!
//! Directions are handed over by reference until the call: three numbers that have just been put down are not at hand as a
//! direction before all calls before have ended, and no renderer would have it so.

use overcoat::{Engine, Material};

/// Stacks by name, lightest first.
pub const STACKS: &[(&str, &str)] = &[
    ("diffuse", "surface s() { Ci = diffuse(N); }"),
    ("sheen", "surface s() { Ci = sheen_bsdf(N, color(0.8, 0.3, 0.2), 0.4); }"),
    ("sheen_diffuse", "surface s() { Ci = 0.7 * diffuse(N); Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.4); }"),
    (
        "sheen_oren",
        "surface s() { Ci = color(0.7, 0.5, 0.2) * oren_nayar(N, 0.4); Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.4); }",
    ),
    ("sheen_u", "surface s() { Ci = 0.7 * diffuse(N); Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.1 + 0.8 * u); }"),
    (
        "sheen_dielectric_oren",
        "surface s() { Ci = 0.7 * oren_nayar(N, 0.4); Ci = layer(dielectric_bsdf(N, dPdu, 1, 0, 0.3, 0.3, 1.5, \"ggx\"), Ci);
            Ci = sheen(Ci, N, color(0.3, 0.4, 0.5), 0.4); }",
    ),
    ("velvet_eon", "surface s() { Ci = layer(0.4 * velvet(N, 0.3), 0.8 * eon(N, color(0.8), 0.5)); }"),
];

/// Their names.
pub fn names() -> impl Iterator<Item = &'static str> {
    STACKS.iter().map(|s| s.0)
}

/// One of them, its tables baked as the engine has it.
pub fn material(engine: &Engine, name: &str) -> Material {
    let text = STACKS.iter().find(|s| s.0 == name).expect("a stack").1;
    engine.material(name, text).expect("compiles")
}

/// Toward the viewer.
pub const WO: [f32; 3] = [0.6, 0.0, 0.8];

/// A thousand over the hemisphere, in no order that a branch could follow.
pub fn directions() -> Vec<[f32; 3]> {
    let direction = |i: u32| {
        let z = (i as f32 + 0.5) / 1024.0;
        let (r, a) = ((1.0 - z * z).sqrt(), i as f32 * 2.399_963);
        [r * a.cos(), r * a.sin(), z]
    };
    (0..1024).map(|i| direction(i * 389 % 1024)).collect()
}

/// As many triples of numbers to sample with.
#[allow(dead_code, reason = "not all of them sample")]
pub fn numbers() -> Vec<[f32; 3]> {
    directions().iter().map(|w| w.map(|x| 0.5 * x + 0.5)).collect()
}
