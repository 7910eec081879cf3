//! `Dx` and its kin, where the host says how the globals change from pixel to pixel.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use overcoat::closure::{ClosureTree, Node};
use overcoat::ir::{Host, Lookup, Subject, Value};
use overcoat::{Differentials, Engine, Globals};

/// Gives derivatives; its pictures hold what is asked for, and its space "object" is turned, twice as large, and moved.
struct Given;

impl Host for Given {
    fn answers(&self, _: Subject) -> bool {
        true
    }
    fn texture(&self, lookup: &Lookup, _: &Globals) -> Option<[f32; 4]> {
        let [[sx, tx], [sy, ty]] = lookup.changes;
        Some([sx + 10.0 * tx, sy + 10.0 * ty, 0.0, 1.0])
    }
    fn matrix(&self, space: &str, _: &Globals) -> Option<[f32; 16]> {
        (space == "object").then_some([0., 0.5, 0., 0., -0.5, 0., 0., 0., 0., 0., 0.5, 0., 7., 8., 9., 1.])
    }
}

/// A point, and the step to the pixel on the right or below.
fn point() -> (Globals, Differentials) {
    let differentials = Differentials {
        dpdx: glam::vec3(0.02, -0.01, 0.03),
        dpdy: glam::vec3(-0.01, 0.04, 0.02),
        didx: glam::vec3(0.003, 0.001, 0.0),
        didy: glam::vec3(0.0, 0.002, -0.001),
        dudx: 0.01,
        dudy: -0.02,
        dvdx: 0.03,
        dvdy: 0.005,
    };
    let globals = Globals {
        p: glam::vec3(0.3, 1.2, -0.7),
        i: glam::vec3(0.6, 0.0, -0.8),
        u: 0.4,
        v: 0.7,
        differentials,
        ..Globals::default()
    };
    (globals, differentials)
}

/// A step of `h` pixels along x or y.
fn moved(globals: &Globals, d: &Differentials, axis: usize, h: f32) -> Globals {
    let (dp, di, du, dv) = if axis == 0 { (d.dpdx, d.didx, d.dudx, d.dvdx) } else { (d.dpdy, d.didy, d.dudy, d.dvdy) };
    Globals { p: globals.p + h * dp, i: globals.i + h * di, u: globals.u + h * du, v: globals.v + h * dv, ..*globals }
}

fn numbers(script: &str, set: &[(String, Value)], globals: &Globals) -> [f32; 3] {
    let shader = Engine::new().host(Given).compile("d.osl", script).unwrap_or_else(|e| panic!("{e}"));
    assert!(shader.warnings().is_empty(), "{script}");
    let tree: ClosureTree = shader.material(set).expect("specialises").tree(globals).expect("shades");
    match tree.node(tree.root()) {
        Node::Lobe { kind, slots, .. } => {
            let values = tree.values(kind, slots);
            [values[0], values[1], values[2]]
        }
        other => panic!("{script}: {other:?}"),
    }
}

fn value(code: &str, expression: &str, globals: &Globals) -> [f32; 3] {
    numbers(&format!("surface s() {{ {code} Ci = diffuse((vector)({expression})); }}"), &[], globals)
}

/// Statements that leave a number or triple `x`.
const SMOOTH: &[&str] = &[
    "float x = u;",
    "float x = u * u - v / (u + 2);",
    "float x = (u + v) * 3 - -u;",
    "point x = P * u + 2;",
    "float x = P[1] * P[0];",
    "vector x = vector(u, v * v, 1) / u;",
    "float x = sin(3 * u) + cos(v) * tan(u) - atan(v);",
    "float x = asin(u) + acos(v * 0.5) + exp(u) + exp2(v) + expm1(u);",
    "float x = log(u + 1) + log2(v + 1) + log10(v + 3) + log(u + 2, 3);",
    "float x = sqrt(u) + inversesqrt(v) + cbrt(u);",
    "float x = pow(u, 2.5) + pow(v, u) + pow(2, u);",
    "float x = abs(u - 1) * fabs(v) + radians(u) + degrees(v) * 0.01;",
    "float x = min(u, v) + 2 * max(u, v) + clamp(u, 0, v) + clamp(v, u, 0.6);",
    "float x = mix(u, v, u * v) + select(u, v, 1) + 3 * select(u, v, 0);",
    "float x = fmod(u * 10, 3) + mod(v * 7, u + 1);",
    "float x = atan2(u, v) + hypot(u, v) + hypot(u, v, P[0]);",
    "float x = smoothstep(0, 1, u) + linearstep(0.2, v + 1, u) + smoothstep(2, 3, u) + linearstep(u, 3, 1.5);",
    "float x = dot(P, I) + length(P) + distance(P, vector(u, v, 3)) + luminance(color(u, v, 1));",
    "vector x = cross(P, I) + normalize(P + I);",
    "vector x = reflect(I, normalize(P)) + refract(I, N, 0.9);",
    "point x = rotate(P, u, vector(0, 1, 1));",
    "float x = sinh(u) + cosh(v) + tanh(u) + erf(v);",
    "float x = noise(P * 3) + snoise(u * 5, v) + noise(\"simplex\", P * 2);",
    "color x = noise(P * 2, v) + pnoise(P * 2, point(3, 4, 5));",
    "color x = color(\"hsv\", u, v, 0.5) + transformc(\"hsl\", \"rgb\", color(u, 0.3, 0.4));",
    "color x = blackbody(2000 + 3000 * u) + wavelength_color(500 + 50 * v);",
    // Through variables, functions, branches, loops, arrays, structs.
    "float f(float a) { if (a > 0.3) return a * a; return 3 * a; } float x = f(u) + f(u * 0.5);",
    "float x = u; for (int i = 0; i < 3; i++) x = x * x + v;",
    "float x = 0; int i = 0; while (i < 2 + (int) (v * 2)) { x += u * i; i++; }",
    "float x = u > 0.1 ? u * v : 7;",
    "float a[4] = {1, u, v, u * v}; float x = a[(int) (u * 7)] * a[1]; a[(int) (v * 4)] = u; x += 2 * a[2];",
    "struct pair { float a; float b; }; pair p = {u, 2}; p.b *= v * p.a; float x = p.b;",
    "vector x = 0; x[1] = u; x[(int) (v * 3)] = v * v; x += x[1] * P;",
    "point x = transform(\"object\", P * u);",
    "vector x = transform(\"object\", \"common\", vector(P));",
    "float x = floor(u * 9) + step(0.1, u) + cellnoise(u * 3) + (int) (v * 9) + (u > v) + u;",
];

#[test]
fn derivatives_are_those_of_shading_again_next_door() {
    let (globals, d) = point();
    for code in SMOOTH {
        // Functions and structs stand before the shader.
        let (before, code) = match code.rfind("} float x = f").or(code.rfind("}; pair")) {
            Some(at) => code.split_at(at + code[at..].find(' ').expect("a space")),
            None => ("", *code),
        };
        for (axis, name) in ["Dx", "Dy"].into_iter().enumerate() {
            let script = |result: &str| format!("{before} surface s() {{ {code} Ci = diffuse((vector)({result})); }}");
            let found = numbers(&script(&format!("{name}(x)")), &[], &globals);
            let h = 0.02;
            let [right, left] = [h, -h].map(|h| numbers(&script("x"), &[], &moved(&globals, &d, axis, h)));
            for k in 0..3 {
                let wanted = (right[k] - left[k]) / (2.0 * h);
                let close = (found[k] - wanted).abs() <= 2e-3 * wanted.abs() + 1e-4;
                assert!(close, "{name}: {code}: component {k} is {}, not {wanted}", found[k]);
            }
        }
    }
}

#[test]
fn what_is_given_comes_back_exactly() {
    let (globals, d) = point();
    assert_eq!(value("", "Dx(P)", &globals), d.dpdx.to_array());
    assert_eq!(value("", "Dy(P)", &globals), d.dpdy.to_array());
    assert_eq!(value("", "vector(Dx(u), Dy(u), Dx(v))", &globals), [d.dudx, d.dudy, d.dvdx]);
    assert_eq!(value("", "Dx(I) + Dy(N) + Dx(time) + Dx(3.5)", &globals), d.didx.to_array());
    assert_eq!(value("", "filterwidth(u)", &globals), [(d.dudx * d.dudx + d.dudy * d.dudy).sqrt(); 3]);
    assert_eq!(value("", "calculatenormal(P)", &globals), d.dpdx.cross(d.dpdy).to_array());
    assert_eq!(value("", "area(P)", &globals), [d.dpdx.cross(d.dpdy).length(); 3]);
    // Second derivatives are zero, and so are those of what a derivative goes into.
    assert_eq!(value("", "Dx(Dy(u * u)) + Dx(u * Dx(u))", &globals), [d.dudx * d.dudx; 3]);
    // A variable that is read and written at once.
    assert_eq!(value("float a = u; a += Dx(a);", "Dx(a)", &globals), [d.dudx; 3]);
}

#[test]
fn steps_are_as_wide_as_the_pixel() {
    let (globals, d) = point();
    let width = (d.dudx * d.dudx + d.dudy * d.dudy).sqrt();
    for (edge, want) in [(0.4 - width, 1.0), (0.4, 0.5), (0.4 + width, 0.0), (0.4 + 0.25 * width, 0.25)] {
        let found = value(&format!("float e = {edge};"), "aastep(e, u)", &globals)[0];
        assert!((found - want).abs() < 1e-4, "{edge}: {found}");
    }
    let found = value("", "aastep(0.5, 0.55, 0.1, 0.1)", &globals)[0];
    assert!((found - 0.75).abs() < 1e-5, "{found}");
}

#[test]
fn a_parameter_that_is_set_stands_still() {
    let (globals, d) = point();
    let script = "surface s(float a = u) { Ci = diffuse((vector) Dx(a * 2)); }";
    assert_eq!(numbers(script, &[], &globals), [2.0 * d.dudx; 3]);
    assert_eq!(numbers(script, &[("a".to_owned(), Value::Float(0.4))], &globals), [0.0; 3]);
}

#[test]
fn pictures_hear_how_far_the_pixel_reaches() {
    let (globals, d) = point();
    let found = value("color c = texture(\"a\", u * 2, v);", "c", &globals);
    assert_eq!(found, [2.0 * d.dudx + 10.0 * d.dvdx, 2.0 * d.dudy + 10.0 * d.dvdy, 0.0]);
    let found = value("color c = texture(\"a\", u, v, 1, 2, 3, 4);", "c", &globals);
    assert_eq!(found, [21.0, 43.0, 0.0]);
}

#[test]
fn without_them_derivatives_are_zero_and_say_so() {
    for script in ["Ci = (1 + Dx(u)) * diffuse(N);", "Ci = (1 + filterwidth(P)[0] + area(P)) * diffuse(N);"] {
        let shader = Engine::new().compile("d.osl", script).expect("compiles");
        assert!(shader.warnings().iter().all(|w| w.code == "W0506") && !shader.warnings().is_empty());
        assert!(shader.material(&[]).expect("specialises").program().is_constant(), "{script}");
    }
}
