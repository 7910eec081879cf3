//! What a host renderer asks of a BSDF: flags, transparency, transport, memory that is used again, trees built in code.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use crate::common::at;
use overcoat::albedo::Precision;
use overcoat::audit::{self, Side, Tolerance};
use overcoat::closure::builder::{Arg, BuildError};
use overcoat::closure::{Builder, Layering, LayeringRule, Scattering, Transport};
use overcoat::ir::Value;
use overcoat::lobes::LobeKind;
use overcoat::lobes::registry::{LobeClass, ParamTy};
use overcoat::{Engine, Error, Globals, Material, OwnedBsdf, Scratch};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn material(script: &str) -> Material {
    Engine::new().material("test", script).unwrap_or_else(|e| panic!("{e}"))
}

fn randoms(count: usize) -> Vec<[f32; 3]> {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    (0..count).map(|_| [rng.random(), rng.random(), rng.random()]).collect()
}

#[test]
fn what_hosts_hold_may_cross_threads() {
    fn free<T: Send + Sync + 'static>() {}
    free::<Engine>();
    free::<Material>();
    free::<overcoat::Shader>();
    free::<OwnedBsdf>();
    free::<overcoat::closure::Bsdf<'static>>();
    free::<overcoat::closure::Composite>();
    free::<Error>();
}

/// Every registered lobe scatters only to the sides it names, and its samples are of the kinds the BSDF names.
#[test]
fn flags_tell_where_samples_go() {
    for kind in LobeKind::ALL.iter().filter(|k| k.class() != LobeClass::Emission) {
        let mut b = Builder::new().precision(Precision::FAST);
        let root = b.lobe(kind.spec().name, []);
        let composite = b.finish(root).expect("builds");
        let mut seen = Scattering::empty();
        for wo in [[0.6, 0.0, 0.8], [0.3, -0.9, 0.3], [0.6, 0.0, -0.8]] {
            let wo = glam::Vec3::from_array(wo).normalize();
            let bsdf = composite.shade(&Globals::default(), wo, &composite.inputs()).expect("shades");
            let flags = bsdf.flags();
            assert!(!flags.contains(Scattering::EMISSION));
            // From below, one-sided lobes draw directions that carry nothing.
            let samples = randoms(400).into_iter().filter_map(|u| bsdf.sample(u));
            for sample in samples.filter(|s| s.f_cos != [0.0; 3]) {
                assert!(flags.contains(sample.scattering()), "{kind:?}: {:?} not in {flags:?}", sample.scattering());
                assert_eq!(sample.roughness == 0.0, sample.flags.delta, "{kind:?}");
                seen |= sample.scattering();
            }
        }
        assert!(!seen.is_empty(), "{kind:?} is never sampled");
    }
    let shaded = |script: &str| {
        let m = material(script);
        let bsdf = m.shade(&Globals::default(), glam::Vec3::Z).expect("shades");
        (bsdf.flags(), bsdf.is_delta())
    };
    let cloth = Scattering::REFLECT | Scattering::DIFFUSE;
    let holes = Scattering::TRANSMIT | Scattering::DELTA | Scattering::NULL;
    assert_eq!(shaded("Ci = sheen(diffuse(N), N, 1, 0.3);"), (cloth, false));
    assert_eq!(shaded("Ci = 0.5 * diffuse(N) + 0.5 * transparent();"), (cloth | holes, false));
    assert_eq!(shaded("Ci = transparent();"), (holes, true));
    assert_eq!(shaded("Ci = emission();"), (Scattering::EMISSION, false));
    assert_eq!(shaded("Ci = 0 * diffuse(N);"), (Scattering::empty(), false));
}

#[test]
fn shadow_rays_are_colored_by_what_lies_above() {
    let wo = glam::Vec3::new(0.6, 0.0, 0.8);
    let transparency = |script: &str| {
        let m = material(script);
        m.shade(&Globals::default(), wo).expect("shades").transparency()
    };
    assert_eq!(transparency("Ci = color(0.2, 0.5, 1) * transparent();"), [0.2, 0.5, 1.0]);
    assert_eq!(transparency("Ci = 0.5 * diffuse(N);"), [0.0; 3]);
    let dimmed = transparency("Ci = sheen(color(0.2, 0.5, 1) * transparent(), N, 1, 0.3);");
    let bound = {
        let m = material("Ci = sheen(N, 0.3);");
        m.shade(&Globals::default(), wo).expect("shades").albedo_bound(wo.into())
    };
    for (c, part) in [0.2, 0.5, 1.0].into_iter().enumerate() {
        assert!((dimmed[c] - part * (1.0 - bound[c])).abs() < 1e-5, "{dimmed:?} below {bound:?}");
    }
}

#[test]
fn rho_and_transport_agree_with_what_is_measured() {
    let m = material("Ci = sheen(0.6 * diffuse(N) + 0.2 * transparent(), N, 1, 0.4);");
    let wo = at::<f32>(0.5);
    let bsdf = m.shade(&Globals::default(), wo.into()).expect("shades");
    let subject = |wo: [f32; 3]| m.shade(&Globals::default(), wo.into()).expect("shades");
    let tolerance = Tolerance { error: 1e-4, evaluations: 40_000 };
    let measured = audit::albedo(&subject, Side::View, wo, tolerance).value;
    let rho = bsdf.rho(&randoms(40_000));
    for c in 0..3 {
        assert!((f64::from(rho[c]) - measured[c]).abs() < 5e-3, "{rho:?} for {measured:?}");
    }
    assert_eq!(bsdf.rho(&[]), [0.0; 3]);
    let wi = at::<f32>(0.8);
    let (radiance, importance) = (bsdf.eval_for(wi, Transport::Radiance), bsdf.eval_for(wi, Transport::Importance));
    assert_eq!(radiance, bsdf.eval(wi));
    assert_eq!(radiance.pdf, bsdf.pdf(wi));
    // One normal: the adjoint differs by the cosines' ratio.
    for c in 0..3 {
        assert!((importance.f_cos[c] * 0.8 - radiance.f_cos[c] * 0.5).abs() < 1e-6, "{importance:?} {radiance:?}");
    }
}

#[test]
fn memory_used_again_gives_the_same() {
    let scripts = [
        "Ci = sheen(diffuse(N), N, 1, 0.2 + u);",
        "Ci = 0 * diffuse(N);",
        "Ci = sheen(sheen(0.4 * translucent(N) + 0.2 * transparent(), N, 0.5, 0.3), N, u, 0.7);",
        "for (int i = 0; i < 20; i++) Ci += 0.05 * diffuse(normalize(N + 0.01 * i * dPdu));",
    ];
    let materials = scripts.map(material);
    let mut scratch = Scratch::new();
    let mut owned = OwnedBsdf::new(materials[0].clone());
    for k in 0..24 {
        let m = &materials[k % materials.len()];
        let globals = Globals { u: k as f32 / 24.0, ..Globals::default() };
        let wo = glam::Vec3::new(0.3, 0.1, 0.2 + 0.02 * k as f32).normalize();
        let fresh = m.shade(&globals, wo).expect("shades");
        owned.shade(m, &globals, wo).expect("shades");
        let again = m.shade_in(&globals, wo, &mut scratch).expect("shades");
        for u in randoms(10) {
            let wi: [f32; 3] = glam::Vec3::new(u[0] - 0.5, u[1] - 0.5, u[2] - 0.3).normalize().into();
            assert_eq!(fresh.eval(wi), again.eval(wi));
            assert_eq!(fresh.sample(u), again.sample(u));
            assert_eq!(fresh.eval(wi), owned.with(|b| b.eval(wi)));
        }
        assert_eq!(fresh.flags(), again.flags());
    }
}

#[test]
fn batches_end_with_the_shorter_slice() {
    let m = material("Ci = diffuse(N);");
    let bsdf = m.shade(&Globals::default(), glam::Vec3::Z).expect("shades");
    let black = overcoat::closure::Eval { f_cos: [9.0; 3], pdf: 9.0 };
    let (directions, mut out) = ([[0.0, 0.0, 1.0]; 20], [black; 11]);
    bsdf.eval_batch(&directions, &mut out);
    assert!(out.iter().all(|e| *e == bsdf.eval([0.0, 0.0, 1.0])));
    bsdf.eval_batch(&directions[..3], &mut out);
    let us = randoms(9);
    let mut samples = [None; 12];
    bsdf.sample_batch(&us, &mut samples);
    assert!((0..9).all(|i| samples[i] == bsdf.sample(us[i])) && samples[9..].iter().all(Option::is_none));
}

#[test]
fn setting_leaves_clones_alone_and_shares_tables() {
    let engine = Engine::new();
    let script = "surface s(float r = 0.3, color c = 0.5, string model = \"conty_kulla\" )
        { Ci = sheen(c * diffuse(N), N, 1, r); if (model == \"none\") Ci = 0; }";
    let first = engine.material("s", script).expect("compiles");
    let mut second = first.clone();
    second.set("c", [0.1, 0.2, 0.3]).expect("sets");
    second.set("c", [0.3, 0.2, 0.1]).expect("sets");
    assert_eq!(first.params(), []);
    assert_eq!(second.params(), [("c".to_owned(), Value::Color([0.3, 0.2, 0.1]))]);
    // The quickest of several: a machine may be busy elsewhere.
    let quickest = |times: &mut dyn Iterator<Item = std::time::Duration>| times.min().expect("some");
    let alone = quickest(&mut (0..5).map(|_| Engine::new().material("s", script).expect("compiles").bake_time()));
    let shared = quickest(&mut (0..5).map(|_| engine.material("s", script).expect("compiles").bake_time()));
    assert!(shared < alone / 2, "{shared:?} for {alone:?}");
    let error = second.set("r", "rough").expect_err("a word");
    assert_eq!(error.diagnostics[0].code, "E0402");
    assert!(second.set_all([("rr", 0.5.into()), ("c", 0.1.into())]).is_err());
    assert_eq!(second.params().len(), 1, "a refused value changes nothing");
    second.set("model", "none").expect("sets");
    assert!(second.shade(&Globals::default(), glam::Vec3::Z).expect("shades").is_black());
    assert!(!first.shade(&Globals::default(), glam::Vec3::Z).expect("shades").is_black());
}

#[test]
fn errors_tell_their_places() {
    let error: Error = Engine::new().compile("a.osl", "float x = 1;\nCi = y * difuse(N);").expect_err("wrong").into();
    let places = error.places();
    assert!(places.iter().all(|p| p.file == "a.osl" && p.at.line == 2), "{places:?}");
    assert!(places.len() >= 2 && error.to_string().contains("a.osl:2:6"));
}

/// A tree built in code is what the script builds, for fixed and for varying values.
#[test]
fn composites_are_what_scripts_make() {
    let script = "Ci = sheen(color(0.6, 0.3, v) * diffuse(N) + 0.2 * translucent(N), N, color(1, 0.8, 0.6), u);";
    for rule in [LayeringRule::Min, LayeringRule::View] {
        let engine = Engine::new().layering(rule);
        let m = engine.material("m", script).expect("compiles");
        let mut b = engine.builder();
        let (rough, color) = (b.float(0.5), b.triple([1.0; 3]));
        let ground = b.lobe("diffuse", []);
        let ground = b.mul(color, ground);
        let back = b.lobe("translucent", []);
        let back = b.mul(0.2, back);
        let below = b.add(ground, back);
        let fuzz = b.lobe("sheen_bsdf", [("roughness", rough.into())]);
        let fuzz = b.mul([1.0, 0.8, 0.6], fuzz);
        let root = b.layer(fuzz, below);
        let composite = b.finish(root).expect("builds");
        let (mut inputs, mut scratch) = (composite.inputs(), Scratch::new());
        for [u, v, x] in randoms(50) {
            let n = glam::Vec3::new(x - 0.5, 0.2, 1.0).normalize();
            let globals = Globals { u, v, n, ..Globals::default() };
            inputs.set(rough, u).expect("fits");
            inputs.set(color, [0.6, 0.3, v]).expect("fits");
            let wo = glam::Vec3::new(0.5, v - 0.5, 0.6).normalize();
            let script = m.shade(&globals, wo).expect("shades");
            let code = composite.shade_in(&globals, wo, &inputs, &mut scratch).expect("shades");
            for wi in [[0.0, 0.6, 0.8], [0.6, 0.0, -0.8], [0.99, 0.0, 0.1]] {
                assert_eq!(script.eval(wi), code.eval(wi));
            }
            assert_eq!(script.sample([u, v, x]), code.sample([u, v, x]));
        }
    }
    let balanced = |b: &mut Builder| {
        let ground = b.lobe("diffuse", []);
        let fuzz = b.lobe("sheen_bsdf", [("roughness", 0.5.into()), ("softening", 0.0.into())]);
        b.layer(fuzz, ground)
    };
    let mut b = Builder::new().layering(Layering { rule: LayeringRule::Balanced, ..Layering::default() });
    let root = balanced(&mut b);
    let composite = b.finish(root).expect("builds");
    let subject = |wo: [f32; 3]| composite.shade(&Globals::default(), wo.into(), &composite.inputs()).expect("shades");
    let white = audit::albedo(&subject, Side::View, at::<f32>(0.4), Tolerance { error: 1e-4, evaluations: 40_000 });
    assert!(white.max() <= 1.0001 && white.max() > 0.999, "{white:?}");
}

#[test]
fn mistakes_in_building_are_told() {
    let built = |f: fn(&mut Builder) -> overcoat::closure::builder::Part| {
        let mut b = Builder::new();
        let root = f(&mut b);
        b.finish(root).map(|_| ()).expect_err("a mistake").to_string()
    };
    assert_eq!(built(|b| b.lobe("difuse", [])), "there is no closure `difuse`");
    assert_eq!(built(|b| b.lobe("diffuse", [("M", 0.5.into())])), "`diffuse` has no parameter `M`");
    assert_eq!(built(|b| b.lobe("oren_nayar", [("sigma", "x".into())])), "`sigma` of `oren_nayar` is not a float");
    assert!(built(|b| b.lobe("sheen_bsdf", [("model", 1.0.into())])).contains("is not one of `"));
    assert!(built(|b| b.lobe("sheen_bsdf", [("model", "smooth".into())])).contains("is not one of `"));
    assert!(built(|b| b.lobe("oren_nayar", [("sigma", [0.0; 3].into())])).contains("is not a float"));
    let two = built(|b| {
        let d = b.lobe("diffuse", []);
        let d = b.mul("red", d);
        b.lobe("difuse", []);
        d
    });
    assert_eq!(two, "`red` of `weight` is not a number or a color", "the first mistake counts");
    let mut other = Builder::new();
    let (foreign, input) = (other.lobe("diffuse", []), other.float(0.5));
    let mut b = Builder::new();
    let sum = b.add(foreign, foreign);
    assert_eq!(b.finish(sum).expect_err("foreign"), BuildError::Foreign);
    assert_eq!(Builder::new().finish(foreign).expect_err("foreign"), BuildError::Foreign);
    let mut b = Builder::new();
    let own = b.float(0.5);
    let d = b.lobe("oren_nayar", [("sigma", Arg::Input(own))]);
    let composite = b.finish(d).expect("builds");
    assert_eq!(composite.inputs().set(input, 0.5), Err(BuildError::Foreign));
    assert!(composite.inputs().set(own, [0.5; 3]).is_err());
    let wrong = other.finish(foreign).expect("builds");
    assert_eq!(composite.shade(&Globals::default(), glam::Vec3::Z, &wrong.inputs()).err(), Some(BuildError::Foreign));
    let mut b = Builder::new();
    let mut deep = b.lobe("diffuse", []);
    for _ in 0..300 {
        let top = b.lobe("diffuse", []);
        deep = b.layer(top, deep);
    }
    assert!(matches!(b.finish(deep), Err(BuildError::Tree(_))));
}

/// Odd directions give zeros, not panics, and parameters of every type can be given.
#[test]
fn nothing_panics() {
    let odd = [f32::NAN, f32::INFINITY, 0.0, -0.0, 1e-40, 1e30, -1.0];
    for kind in LobeKind::ALL {
        let mut b = Builder::new().precision(Precision::FAST);
        let args = kind.spec().params.iter().map(|p| match p.ty {
            ParamTy::String => (p.name, Arg::Word(p.options.first().copied().unwrap_or("word").to_owned())),
            ParamTy::Float | ParamTy::Int => (p.name, Arg::Input(b.float(f32::NAN))),
            _ => (p.name, Arg::Input(b.triple([f32::NAN; 3]))),
        });
        let args: Vec<_> = args.collect();
        let root = b.lobe(kind.spec().name, args);
        let composite = b.finish(root).expect("builds");
        for x in odd {
            let wo = glam::Vec3::new(x, 0.0, 1.0);
            let bsdf = composite.shade(&Globals::default(), wo, &composite.inputs()).expect("shades");
            for y in odd {
                let e = bsdf.eval_for([y, x, 0.3], Transport::Importance);
                assert!(e.f_cos.iter().chain([&e.pdf]).all(|v| v.is_finite() && *v >= 0.0), "{kind:?}");
                if let Some(s) = bsdf.sample([y, x, 0.3]) {
                    assert!(s.weight.iter().all(|v| v.is_finite()), "{kind:?}");
                }
            }
            let _ = (bsdf.flags(), bsdf.transparency(), bsdf.rho(&[[x; 3]]), bsdf.is_delta());
        }
    }
}
