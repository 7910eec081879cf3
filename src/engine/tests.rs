//! What a BSDF is held to that needs a material to be tried.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

use super::*;
use crate::Globals;
use crate::closure::Eval;

#[test]
fn lanes_of_any_processor_give_what_single_calls_give() {
    let scripts = [
        "Ci = sheen(0.7 * diffuse(N), N, color(0.3, 0.4, 0.5), 0.4);",
        "Ci = sheen(0.7 * oren_nayar(N, 0.2), N, color(0.3, 0.4, 0.5), 0.1 + 0.8 * u);",
        "Ci = layer(dielectric_bsdf(N, dPdu, 1, 1, 0.3, 0.3, 1.5, \"ggx\"), eon(N, color(0.8), 0.5));",
        "Ci = layer(layer(sheen(N, 0.3), 0.5 * velvet(N, 0.3)), fabric(normal(0, 0.6, 0.8), dPdu, 0.3));",
        "Ci = microcylinder(N, dPdu, \"linen\") + 0.2 * translucent(N);",
    ];
    let wi: Vec<[f32; 3]> = (0..77)
        .map(|k| V3::polar(1.0 - k as f32 * 0.02, k as f32 * 0.7))
        .map(|w| [w.x, w.y, w.z])
        .chain([[f32::NAN, 0.0, 1.0], [0.0; 3], [3.0, 0.0, 0.0]])
        .collect();
    for script in scripts {
        for rule in LayeringRule::ALL {
            let material = Engine::new().layering(rule).material("m", script).expect(script);
            let globals = Globals { u: 0.3, ..Globals::default() };
            let bsdf = material.shade(&globals, glam::vec3(0.48, 0.36, 0.8)).expect("small");
            let single: Vec<Eval> = wi.iter().map(|w| bsdf.eval(*w)).collect();
            for (w, e) in wi.iter().zip(&single) {
                assert_eq!(bsdf.pdf(*w).to_bits(), e.pdf.to_bits(), "{script} {w:?}");
            }
            for count in [8, 13, 64, wi.len()] {
                let black = Eval { f_cos: [-1.0; 3], pdf: -1.0 };
                let (mut portable, mut widest) = (vec![black; count], vec![black; count]);
                bsdf.eval_batch_in_arrays(&wi[..count], &mut portable);
                bsdf.eval_batch(&wi, &mut widest);
                assert_eq!(portable, single[..count], "{script} {rule:?}");
                assert_eq!(widest, single[..count], "{script} {rule:?}");
            }
        }
    }
}

#[test]
fn nothing_is_left_of_the_point_before() {
    let material =
        Engine::new().material("m", "Ci = holdout() + 0.5 * diffuse(N) + u * emission();").expect("a script");
    let mut scratch = Scratch::new();
    for u in [0.5, 0.0, 1.0] {
        let globals = Globals { u, ..Globals::default() };
        let bsdf = material.shade_in(&globals, glam::Vec3::Z, &mut scratch).expect("small");
        let alone = material.shade(&globals, glam::Vec3::Z).expect("small");
        assert_eq!(bsdf.signals(), alone.signals());
        assert_eq!((bsdf.emission(), bsdf.lobe_count()), (alone.emission(), alone.lobe_count()));
    }
}

#[test]
fn many_points_give_what_each_gives_alone() {
    let scripts = [
        "Ci = sheen(0.7 * diffuse(N), N, color(0.3, 0.4, 0.5), 0.4);",
        "Ci = sheen(0.7 * diffuse(N), N, color(0.3, 0.4, 0.5), 0.1 + 0.8 * u);",
        "Ci = emission() + diffuse(N);",
        "Ci = 0;",
    ];
    let wo: Vec<[f32; 3]> =
        (0..21).map(|k| V3::polar(1.0 - k as f32 * 0.06, k as f32)).map(|w| [w.x, w.y, w.z]).collect();
    let points: Vec<Globals> = (0..21).map(|k| Globals { u: k as f32 / 21.0, ..Globals::default() }).collect();
    let materials = scripts.map(|script| Engine::new().material("m", script).expect(script));
    let mut bsdfs = Bsdfs::new();
    for (material, script) in materials.iter().zip(scripts) {
        // Fewer than before, more than before, fewer directions than points.
        for count in [13, 21, 0] {
            material.shade_many(&points[..count], &wo, &mut bsdfs).expect("small");
            assert_eq!((bsdfs.len(), bsdfs.is_empty()), (count, count == 0));
            let mut out = vec![Eval { f_cos: [-1.0; 3], pdf: -1.0 }; 21];
            bsdfs.eval(&wo[..count], &mut out);
            for k in 0..21 {
                let alone = material.shade(&points[k], wo[k].into()).expect("small").eval(wo[k]);
                let expected = if k < count { alone } else { Eval { f_cos: [-1.0; 3], pdf: -1.0 } };
                assert_eq!(out[k], expected, "{script} at {k} of {count}");
            }
        }
    }
    let deep = "Ci = diffuse(N); for (int i = 0; i < 4000 * u; i++) Ci = layer(0.1 * sheen(N, 0.3), Ci);";
    let deep = Engine::new().material("m", deep).expect(deep);
    let mut bsdfs = Bsdfs::new();
    assert!(deep.shade_many(&points[..1], &wo, &mut bsdfs).is_ok() && bsdfs.len() == 1);
    assert!(deep.shade_many(&points, &wo, &mut bsdfs).is_err() && bsdfs.is_empty());
}
