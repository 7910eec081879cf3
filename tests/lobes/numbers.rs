//! The elementary functions and frames, over their whole range.

use overcoat::optics::{F32x8, Frame, Real, V3, elementary};

/// Every exponent, a few mantissas each.
fn spread() -> impl Iterator<Item = f32> {
    (1..255u32).flat_map(|e| (0..64u32).map(move |m| f32::from_bits((e << 23) | (m * 0x1_ffff))))
}

fn ulps(a: f32, truth: f64) -> f64 {
    let t = truth as f32;
    let ulp = (f32::from_bits(t.abs().to_bits() + 1) - t.abs()) as f64;
    (a as f64 - truth).abs() / ulp
}

#[test]
fn exp_and_ln_are_within_two_ulps() {
    let (mut worst_exp, mut worst_ln) = (0.0f64, 0.0f64);
    for x in spread() {
        worst_ln = worst_ln.max(if (x - 1.0).abs() < 0.05 {
            // Near 1 the logarithm itself goes to zero; what counts there is the absolute error.
            (elementary::ln(x) as f64 - (x as f64).ln()).abs() / 6e-8
        } else {
            ulps(elementary::ln(x), (x as f64).ln())
        });
        for x in [x, -x] {
            if x > -87.0 && x < 88.7 {
                worst_exp = worst_exp.max(ulps(elementary::exp(x), (x as f64).exp()));
            }
        }
    }
    println!("exp {worst_exp:.2} ulp, ln {worst_ln:.2} ulp");
    assert!(worst_exp < 2.0 && worst_ln < 2.0, "exp {worst_exp} ulp, ln {worst_ln} ulp");
}

#[test]
fn powers_of_two_their_logarithms_and_ln_1p() {
    let (mut worst_power, mut worst_log, mut worst_1p) = (0.0f64, 0.0f64, 0.0f64);
    for x in spread() {
        let log = (x as f64).log2();
        worst_log = worst_log.max((elementary::log2(x) as f64 - log).abs() / log.abs().max(0.05));
        let u = elementary::ln_1p(x) as f64;
        worst_1p = worst_1p.max((u / (x as f64).ln_1p() - 1.0).abs());
        for x in [x, -x] {
            if x > -126.0 && x < 127.9 {
                let error = (elementary::exp2(x) as f64 / (x as f64).exp2() - 1.0).abs();
                worst_power = worst_power.max(error / (1.0 + x.abs() as f64));
            }
        }
    }
    println!("exp2 {worst_power:.2e}, log2 {worst_log:.2e}, ln_1p {worst_1p:.2e}");
    assert!(worst_power < 2e-7 && worst_log < 3e-7 && worst_1p < 3e-7, "{worst_power} {worst_log} {worst_1p}");
    assert_eq!([0.0, 1.0, -126.0].map(elementary::exp2), [1.0, 2.0, f32::MIN_POSITIVE]);
    assert_eq!([-126.1, f32::NEG_INFINITY].map(elementary::exp2), [0.0; 2]);
    assert_eq!([128.0, f32::INFINITY].map(elementary::exp2), [f32::INFINITY; 2]);
    assert!(elementary::exp2(f32::NAN).is_nan());
    assert_eq!([1.0, 8.0, 0.0, -1.0, 1e-45].map(elementary::log2), [0.0, 3.0, -126.0, -126.0, -126.0]);
    assert_eq!([0.0, f32::INFINITY].map(elementary::ln_1p), [0.0, f32::INFINITY]);
}

#[test]
fn floors_and_indices() {
    for x in spread().flat_map(|x| [x, -x]).chain([0.0, 0.5, -0.5, 1e9, -1e9, f32::INFINITY]) {
        assert_eq!(elementary::floor(x), x.floor(), "{x}");
    }
    assert!(elementary::floor(f32::NAN).is_nan());
    for i in [0, 1, 77, 4095, 4_194_304, 8_388_607] {
        assert_eq!(elementary::index(i as f32), i);
    }
}

#[test]
fn exp_and_ln_at_the_edges() {
    assert_eq!(elementary::exp(-200.0), 0.0);
    assert_eq!(elementary::exp(f32::NEG_INFINITY), 0.0);
    assert_eq!(elementary::exp(200.0), f32::INFINITY);
    assert_eq!(elementary::exp(f32::INFINITY), f32::INFINITY);
    assert_eq!(elementary::exp(0.0), 1.0);
    assert!(elementary::exp(f32::NAN).is_nan());
    for x in [0.0, -0.0, -1.0, f32::NEG_INFINITY, 1e-45] {
        assert!((elementary::ln(x) + 87.336_54).abs() < 1e-4, "{x}");
    }
    assert_eq!(elementary::ln(f32::INFINITY), f32::INFINITY);
    assert_eq!(elementary::ln(1.0), 0.0);
    assert_eq!(0.0f32.powf(0.0), 1.0);
    assert_eq!(0.0f32.powf(2.0), 0.0);
}

#[test]
fn sines_and_angles() {
    let mut worst = (0.0f64, 0.0f64);
    for k in -8000i32..=8000 {
        let x = k as f32 * 0.003_14;
        let (s, c) = elementary::sin_cos(x);
        worst.0 = worst.0.max((s as f64 - (x as f64).sin()).abs()).max((c as f64 - (x as f64).cos()).abs());
        let r = 1e-3 + (k.abs() % 97) as f32;
        let (y, x) = (s * r, c * r);
        worst.1 = worst.1.max((elementary::atan2(y, x) as f64 - (y as f64).atan2(x as f64)).abs());
    }
    let mut turned = 0.0f64;
    for k in -40_000i32..=40_000 {
        let u = k as f32 * 1e-4;
        let (s, c) = elementary::sin_cos_of_turns(u);
        let (sine, cosine) = (std::f64::consts::TAU * u as f64).sin_cos();
        turned = turned.max((s as f64 - sine).abs()).max((c as f64 - cosine).abs());
    }
    println!("sin, cos {:.2e}, of turns {turned:.2e}, atan2 {:.2e}", worst.0, worst.1);
    assert!(turned < 1e-7, "{turned:e}");
    assert!(worst.0 < 1.5e-7 && worst.1 < 3e-7, "{worst:?}");
    assert_eq!(elementary::atan2(0.0, 0.0), 0.0);
    assert_eq!(elementary::atan2(1.0, 0.0), std::f32::consts::FRAC_PI_2);
}

/// What the lanes give, and how one number gets there.
type Pair = (F32x8, fn(f32) -> f32);

#[test]
fn lanes_and_scalars_share_every_function() {
    let xs: Vec<f32> = spread().step_by(7).flat_map(|x| [x, -x]).chain([0.0, -0.0, f32::INFINITY, f32::NAN]).collect();
    for chunk in xs.chunks_exact(8) {
        let lanes = F32x8(chunk.try_into().unwrap());
        let pairs: [Pair; 9] = [
            (lanes.exp(), Real::exp),
            (lanes.ln(), Real::ln),
            (lanes.abs().sqrt(), |x| x.abs().sqrt()),
            (lanes.sin_cos().0, |x| Real::sin_cos(x).0),
            (lanes.sin_cos_of_turns().1, |x| Real::sin_cos_of_turns(x).1),
            (lanes.atan2(F32x8::c(0.5)), |x| Real::atan2(x, 0.5)),
            (lanes.powf(F32x8::c(0.3)), |x| Real::powf(x, 0.3)),
            (lanes.abs().ln_1p(), |x| Real::ln_1p(x.abs())),
            (lanes.floor(), Real::floor),
        ];
        for (wide, narrow) in pairs {
            for i in 0..8 {
                let one = narrow(chunk[i]);
                assert!(wide.0[i].to_bits() == one.to_bits() || (wide.0[i].is_nan() && one.is_nan()), "{}", chunk[i]);
            }
        }
    }
}

#[test]
fn frames_are_orthonormal_whatever_comes_in() {
    let odd = [f32::NAN, f32::INFINITY, 0.0, 1e-45, 1e-30, 1.0, -1.0, 1e30, f32::MAX];
    let mut vectors = Vec::new();
    for x in odd {
        for y in odd {
            vectors.extend([[x, y, 0.3], [0.0, x, y], [y, y, x]].map(V3::<f32>::from_f32));
        }
    }
    for (i, n) in vectors.iter().enumerate() {
        let other = |k: usize| vectors[(i * k + k) % vectors.len()];
        let f = Frame::new(*n, other(7), other(13), other(5));
        for (a, b, product) in
            [(f.t, f.t, 1.0), (f.b, f.b, 1.0), (f.n, f.n, 1.0), (f.t, f.b, 0.0), (f.t, f.n, 0.0), (f.b, f.n, 0.0)]
        {
            assert!((a.dot(b) - product).abs() < 3e-6, "{n:?}: {f:?}");
        }
    }
}

#[test]
fn a_bad_normal_or_tangent_falls_back() {
    let v = |x, y, z| V3::new(x, y, z);
    let zero = v(0.0f64, 0.0, 0.0);
    let f = Frame::new(zero, v(0.0, 0.0, 2.0), v(0.0, 0.0, 1.0), v(3.0, 0.0, 0.0));
    assert_eq!((f.n, f.t), (v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0)));
    let f = Frame::new(zero, v(f64::NAN, 0.0, 0.0), zero, zero);
    assert_eq!(f.n, v(0.0, 0.0, 1.0));
}
