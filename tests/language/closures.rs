//! The closures people already write: other names mean what they say, keywords and literals are taken, what differs or
//! is not there says so.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use overcoat::closure::{ClosureTree, Node, NodeId};
use overcoat::engine::Tier;
use overcoat::lobes::forms;
use overcoat::lobes::host::HostLobe;
use overcoat::lobes::registry::ParamTy;
use overcoat::lobes::signals::SignalKind;
use overcoat::{Engine, Globals, Material, Shader};

fn compile(script: &str) -> Shader {
    match Engine::new().tier(Tier::Fast).compile("test", script) {
        Ok(shader) => shader,
        Err(e) => panic!("{script}\n{}", e.render(false)),
    }
}

fn material(script: &str) -> Material {
    compile(script).material(&[]).unwrap_or_else(|e| panic!("{script}\n{}", e.render(false)))
}

/// A tree as text.
fn shape(tree: &ClosureTree, id: NodeId) -> String {
    match tree.node(id) {
        Node::Zero => "0".into(),
        Node::Add(a, b) => format!("({} + {})", shape(tree, a), shape(tree, b)),
        Node::Mul(w, c) => format!("{w:?} * {}", shape(tree, c)),
        Node::Layer { top, base } => format!("layer({}, {})", shape(tree, top), shape(tree, base)),
        Node::Lobe { kind, slots, .. } => format!("{} {:?}", kind.spec().name, tree.values(kind, slots)),
    }
}

fn meaning(closure: &str) -> String {
    let tree = material(&format!("Ci = {closure};")).tree(&Globals::default()).expect("a tree");
    shape(&tree, tree.root())
}

fn complaint(script: &str) -> String {
    Engine::new().compile("test", script).err().map(|e| e.render(false)).unwrap_or_default()
}

/// Names and what they stand for.
const SAME: &[(&str, &str)] = &[
    ("microfacet(\"beckmann\", N, 0.2, 1.4, 2)", "microfacet(\"beckmann\", N, 0, 0.2, 0.2, 1.4, 2)"),
    ("translucent_bsdf(N, color(0.2, 0.3, 1))", "color(0.2, 0.3, 1) * translucent(N)"),
    ("transparent_bsdf()", "transparent()"),
    ("uniform_edf(color(3, 2, 1))", "color(3, 2, 1) * emission()"),
    ("reflection(N)", "reflection(N, 0)"),
    ("microfacet_ggx(N, 0.2)", "microfacet(\"ggx\", N, 0.2, 0, 0)"),
    ("microfacet_ggx(N, 0.2, 1.3)", "microfacet(\"ggx\", N, 0.2, 1.3, 0)"),
    ("microfacet_beckmann(N, 0.2)", "microfacet(\"beckmann\", N, 0.2, 0, 0)"),
    ("microfacet_beckmann(N, 0.2, 1.3)", "microfacet(\"beckmann\", N, 0.2, 1.3, 0)"),
    ("microfacet_ggx_aniso(N, dPdu, 0.2, 0.3)", "microfacet(\"ggx\", N, dPdu, 0.2, 0.3, 0, 0)"),
    ("microfacet_beckmann_aniso(N, dPdu, 0.2, 0.3)", "microfacet(\"beckmann\", N, dPdu, 0.2, 0.3, 0, 0)"),
    ("microfacet_ggx_refraction(N, 0.2, 1.3)", "microfacet(\"ggx\", N, 0.2, 1.3, 1)"),
    ("microfacet_beckmann_refraction(N, 0.2, 1.3)", "microfacet(\"beckmann\", N, 0.2, 1.3, 1)"),
    ("microfacet_multi_ggx(N, 0.2, 0.5)", "microfacet(\"ggx\", N, 0.2, 0, 0)"),
    ("microfacet_multi_ggx_aniso(N, dPdu, 0.2, 0.3, 0.5)", "microfacet(\"ggx\", N, dPdu, 0.2, 0.3, 0, 0)"),
    ("microfacet_multi_ggx_glass(N, 0.2, 1.3, 0.5)", "microfacet(\"ggx\", N, 0.2, 1.3, 2)"),
    (
        "microfacet_aniso_fresnel(N, dPdu, 0.2, 0.3, 0.04, 1, 1.5, \"ggx\")",
        "generalized_schlick_bsdf(N, dPdu, 1, 0, 0.2, 0.3, 0.04, 1, 5, \"ggx\")",
    ),
    ("ashikhmin_velvet(N, 0.4)", "velvet(N, 0.4)"),
    ("sheen(N, 0.4)", "sheen_bsdf(N, 1, 0.4)"),
];

#[test]
fn other_names_mean_what_they_say() {
    for (name, closure) in SAME {
        assert_eq!(meaning(name), meaning(closure), "{name}");
    }
}

#[test]
fn what_differs_says_so_wherever_it_is_called() {
    let noted: Vec<_> = forms().filter(|f| !f.note.is_empty()).collect();
    assert!(noted.len() >= 5, "{}", noted.len());
    for form in noted {
        let args: Vec<&str> = form
            .positional()
            .map(|p| match p.ty {
                ParamTy::Normal => "N",
                ParamTy::Vector => "dPdu",
                ParamTy::String if p.options.is_empty() => "\"a\"",
                ParamTy::String => "\"ggx\"",
                ParamTy::Closure => "diffuse(N)",
                _ => "1",
            })
            .collect();
        let shader = compile(&format!("Ci = {}({});", form.name, args.join(", ")));
        let found = shader.warnings().iter().any(|w| w.code == "W0507" && w.help == [form.note]);
        assert!(found, "{}: {:?}", form.signature(), shader.warnings());
    }
    for closure in ["diffuse(N)", "microfacet_ggx(N, 0.2)", "translucent_bsdf(N, 1)"] {
        assert!(compile(&format!("Ci = {closure};")).warnings().is_empty(), "{closure}");
    }
}

#[test]
fn labels_are_taken_and_said_to_do_nothing() {
    let shader = compile("Ci = layer(sheen_bsdf(N, 1, 0.3, \"label\", \"fuzz\"), diffuse(N, \"label\", \"base\"));");
    let codes: Vec<_> = shader.warnings().iter().map(|w| w.code).collect();
    assert_eq!(codes, ["W0508", "W0508"]);
    assert!(complaint("Ci = diffuse(N, \"label\", 3);").contains("E0302"));
}

#[test]
fn zero_is_a_closure_where_one_is_asked_for() {
    let fuzz = "sheen_bsdf(N, 1, 0.3)";
    assert_eq!(meaning(&format!("layer({fuzz}, 0)")), meaning(fuzz));
    assert_eq!(meaning("layer(0, diffuse(N))"), meaning("diffuse(N)"));
    assert_eq!(meaning("mix(0, diffuse(N), 0.25)"), meaning("0.25 * diffuse(N)"));
    assert_eq!(meaning("mix(diffuse(N), 0, color(0.25))"), meaning("0.75 * diffuse(N)"));
    assert_eq!(meaning("sheen(0, N, 1, 0.3)"), meaning(fuzz));
    let own = "closure color twice(closure color c) { return 2 * c; } surface s() { Ci = twice(0) + diffuse(N); }";
    assert_eq!(material(own).tree(&Globals::default()).expect("a tree").len(), 2);
    assert!(complaint("Ci = layer(1, diffuse(N));").contains("E0205"));
}

#[test]
fn closures_mix_by_floats_and_colors() {
    assert_eq!(meaning("mix(diffuse(N), translucent(N), 0.25)"), meaning("0.75 * diffuse(N) + 0.25 * translucent(N)"));
    assert_eq!(
        meaning("mix(diffuse(N), translucent(N), color(0, 0.5, 1))"),
        meaning("color(1, 0.5, 0) * diffuse(N) + color(0, 0.5, 1) * translucent(N)")
    );
}

#[test]
fn closures_that_are_not_there_say_what_to_use() {
    for (name, hint) in [
        ("principled_hair", "thread"),
        ("medium_vdf", "renderer's business"),
        ("westin_sheen", "sheen_bsdf"),
        ("ambient_occlusion", "rays"),
    ] {
        let text = complaint(&format!("Ci = {name}(N);"));
        assert!(text.contains("E0109") && text.contains(hint), "{text}");
    }
}

#[test]
fn artists_choose_metals_by_color() {
    let script = "color n, k; artistic_ior(color(0.9, 0.5, 0.3), color(1, 0.5, 0), n, k); \
                  Ci = conductor_bsdf(N, dPdu, 0.001, 0.001, n, k, \"ggx\");";
    let m = material(script);
    let seen = m.shade(&Globals::default(), glam::Vec3::Z).expect("shades").albedo();
    for (seen, asked) in seen.into_iter().zip([0.9, 0.5, 0.3]) {
        assert!((seen - asked).abs() < 2e-3, "{seen} for {asked}");
    }
}

fn shaded(script: &str) -> (Material, Globals) {
    (material(script), Globals::default())
}

#[test]
fn signals_reach_the_host_and_scatter_nothing() {
    let (m, globals) = shaded(
        "Ci = 0.5 * holdout() + color(0.1, 0.2, 0.3) * debug(\"wear\") + 0.25 * debug(\"wear\") + 2 * background() \
         + layer(0.25 * diffuse(N), debug(\"below\"));",
    );
    let bsdf = m.shade(&globals, glam::Vec3::Z).expect("shades");
    let value = |kind: SignalKind| bsdf.signals().iter().find(|s| s.kind == kind).map(|s| s.value);
    assert_eq!(value(SignalKind::Holdout), Some([0.5; 3]));
    assert_eq!(value(SignalKind::Background), Some([2.0; 3]));
    let wear = value(SignalKind::Debug("wear")).expect("there");
    assert!(wear.iter().zip([0.35, 0.45, 0.55]).all(|(a, b)| (a - b).abs() < 1e-6), "{wear:?}");
    assert_eq!(value(SignalKind::Debug("below")), Some([0.75; 3]), "a layer dims what lies below");
    assert_eq!(bsdf.signals().len(), 4);
    assert!((bsdf.albedo()[0] - 0.25).abs() < 1e-6 && bsdf.emission() == [0.0; 3]);
    assert_eq!(bsdf.lobe_count(), 1);
}

#[test]
fn tags_may_be_known_only_when_shading() {
    let shader = compile("string s = u > 0.5 ? \"right\" : concat(\"le\", \"ft\"); Ci = debug(s);");
    let m = shader.material(&[]).expect("sets");
    for (u, name) in [(0.2, "left"), (0.8, "right")] {
        let globals = Globals { u, ..Globals::default() };
        let bsdf = m.shade(&globals, glam::Vec3::Z).expect("shades");
        assert_eq!(bsdf.signals()[0].kind, SignalKind::Debug(name));
    }
}

#[test]
fn what_is_scattered_below_is_diffuse_and_says_so() {
    let script = "Ci = subsurface_bssrdf(N, color(0.9, 0.5, 0.3), color(1, 0.2, 0.1), 0.5);";
    assert_eq!(compile(script).warnings()[0].code, "W0507");
    let (m, globals) = shaded(script);
    let bsdf = m.shade(&globals, glam::Vec3::Z).expect("shades");
    let part = bsdf.subsurface().next().expect("one");
    assert_eq!((part.albedo, part.radius, part.anisotropy), ([0.9, 0.5, 0.3], [1.0, 0.2, 0.1], 0.5));
    let wi = [0.6, 0.0, 0.8];
    let plain = material("Ci = color(0.9, 0.5, 0.3) * diffuse(N);");
    assert_eq!(bsdf.eval(wi), plain.shade(&globals, glam::Vec3::Z).expect("shades").eval(wi));
    assert!(bsdf.sample([0.2, 0.3, 0.4]).expect("a direction").flags.subsurface);
    assert_eq!(
        meaning("subsurface(1.3, 0.5, color(1, 2, 3), 0.7)"),
        meaning("subsurface_bssrdf(N, 0.7, color(1, 2, 3), 0.5, \"ior\", 1.3)")
    );
    assert_eq!(
        meaning("bssrdf(\"random_walk\", N, vector(1, 2, 3), 0.7)"),
        meaning("subsurface_bssrdf(N, 0.7, color(1, 2, 3), 0)")
    );
}

/// Half of what is asked for, evenly.
struct Half;

impl HostLobe for Half {
    fn f(&self, values: &[f32], wo: [f64; 3], wi: [f64; 3]) -> [f64; 3] {
        let lit = wo[2] > 0.0 && wi[2] > 0.0;
        [3, 4, 5].map(|c| if lit { 0.5 * f64::from(values[c]) / std::f64::consts::PI } else { 0.0 })
    }
    fn albedo_bound(&self, values: &[f32], w: [f64; 3]) -> [f64; 3] {
        [3, 4, 5].map(|c| if w[2] > 0.0 { 0.5 * f64::from(values[c]) } else { 0.0 })
    }
}

#[test]
fn a_host_takes_scattering_below_over() {
    let engine = Engine::new().subsurface(Half);
    for closure in ["subsurface_bssrdf(N, 0.8, 1, 0)", "subsurface(1.4, 0, 1, 0.8)", "bssrdf(\"a\", N, 1, 0.8)"] {
        let shader = engine.compile("test", &format!("Ci = {closure};")).expect("compiles");
        assert!(shader.warnings().is_empty());
        let m = shader.material(&[]).expect("sets");
        let albedo = m.shade(&Globals::default(), glam::Vec3::Z).expect("shades").albedo();
        assert!((albedo[1] - 0.4).abs() < 1e-6, "{closure}: {albedo:?}");
    }
}

/// The closures of stdosl.h 1.13, as it declares them.
const STDOSL: &[&str] = &[
    "emission()",
    "background()",
    "diffuse(normal N)",
    "oren_nayar(normal N, float sigma)",
    "translucent(normal N)",
    "phong(normal N, float exponent)",
    "ward(normal N, vector T, float ax, float ay)",
    "microfacet(string distribution, normal N, vector U, float xalpha, float yalpha, float eta, int refract)",
    "microfacet(string distribution, normal N, float alpha, float eta, int refract)",
    "reflection(normal N, float eta)",
    "reflection(normal N)",
    "refraction(normal N, float eta)",
    "transparent()",
    "debug(string tag)",
    "holdout()",
    "subsurface(float eta, float g, color mfp, color albedo)",
    "oren_nayar_diffuse_bsdf(normal N, color albedo, float roughness)",
    "burley_diffuse_bsdf(normal N, color albedo, float roughness)",
    "dielectric_bsdf(normal N, vector U, color reflection_tint, color transmission_tint, float roughness_x, \
     float roughness_y, float ior, string distribution)",
    "conductor_bsdf(normal N, vector U, float roughness_x, float roughness_y, color ior, color extinction, \
     string distribution)",
    "generalized_schlick_bsdf(normal N, vector U, color reflection_tint, color transmission_tint, float roughness_x, \
     float roughness_y, color f0, color f90, float exponent, string distribution)",
    "translucent_bsdf(normal N, color albedo)",
    "transparent_bsdf()",
    "subsurface_bssrdf(normal N, color albedo, color radius, float anisotropy)",
    "sheen_bsdf(normal N, color albedo, float roughness)",
    "uniform_edf(color emittance)",
    "layer(closure color top, closure color base)",
];

#[test]
fn the_standard_header_is_covered() {
    for declared in STDOSL {
        let same = |f: &overcoat::lobes::registry::Form| {
            let params: Vec<String> = f.positional().map(|p| format!("{} {}", p.ty.name(), p.name)).collect();
            format!("{}({})", f.name, params.join(", ")) == *declared
        };
        assert!(forms().any(|f| same(&f)), "{declared}");
    }
}

#[test]
fn films_color_what_they_lie_on() {
    let seen = |thickness: u32, wo: [f32; 3]| {
        let m = material(&format!(
            "Ci = conductor_bsdf(N, dPdu, 0.01, 0.01, 2.5, 2.5, \"ggx\", \"thinfilm_thickness\", {thickness}, \
             \"thinfilm_ior\", 1.6);"
        ));
        m.shade(&Globals::default(), wo.into()).expect("shades").albedo()
    };
    let up = [0.0, 0.0, 1.0];
    let spread = |c: [f32; 3]| c[0].max(c[1]).max(c[2]) - c[0].min(c[1]).min(c[2]);
    assert!(spread(seen(0, up)) < 1e-3, "{:?}", seen(0, up));
    assert!(spread(seen(300, up)) > 0.05, "{:?}", seen(300, up));
    let shift: f32 = seen(300, up).iter().zip(seen(300, [0.8, 0.0, 0.6])).map(|(a, b)| (a - b).abs()).sum();
    assert!(shift > 0.05, "{shift}");
    for glass in [
        "dielectric_bsdf(N, dPdu, 1, 0, 0.1, 0.1, 1.5, \"ggx\"",
        "generalized_schlick_bsdf(N, dPdu, 1, 0, 0.1, 0.1, 0.04, 1, 5, \"ggx\"",
    ] {
        let seen = |thickness: u32| {
            let m = material(&format!("Ci = {glass}, \"thinfilm_thickness\", {thickness}, \"thinfilm_ior\", 2.2);"));
            m.shade(&Globals::default(), up.into()).expect("shades").albedo()
        };
        assert!(spread(seen(0)) < 1e-3 && spread(seen(300)) > 0.05, "{glass} {:?} {:?}", seen(0), seen(300));
    }
}

#[test]
fn the_proof_knows_the_new_closures() {
    for (script, most) in [
        ("Ci = layer(0.5 * phong(N, 30), diffuse(N));", 1.0),
        ("Ci = 0.5 * burley_diffuse_bsdf(N, color(0.5), 0.3) + 0.5 * ward(N, dPdu, 0.2, 0.2);", 0.85),
        ("Ci = subsurface_bssrdf(N, 0.4, 1, 0) + 0.3 * oren_nayar_diffuse_bsdf(N, 0.5, 0.5) + holdout();", 0.56),
    ] {
        let report = overcoat::prove::prove(&compile(script), &overcoat::prove::Options::default()).expect("proves");
        assert_eq!(report.verdict, overcoat::prove::Verdict::Conserves, "{script}: {report:?}");
        assert!(report.bound.is_some_and(|b| b <= most + 1e-3), "{script}: {:?}", report.bound);
    }
}
