//! The directional albedo by importance sampling: quick and rough, with an honest deviation.
//!
//! Three quarters of the samples follow the BSDF at the held direction, a quarter goes evenly over the sphere, so that
//! a sampler that neglects a part of f cannot hide it. Both are stratified; two samples in each stratum tell the
//! deviation.

use super::furnace::{Side, delta_albedo};
use super::{Subject, chi2};
use crate::closure::Eval;
use crate::optics::Scalar;
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

/// An estimated albedo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Per channel, delta lobes included.
    pub value: [f64; 3],
    /// Standard deviation per channel.
    pub sigma: [f64; 3],
}

impl Estimate {
    /// Whether the albedo may be one, at `k` standard deviations.
    pub fn may_reach_one(&self, k: f64) -> bool {
        self.at_most(k) >= 1.0
    }

    /// The largest channel, `k` standard deviations up.
    pub fn at_most(&self, k: f64) -> f64 {
        (0..3).map(|c| self.value[c] + k * self.sigma[c]).fold(0.0, f64::max)
    }

    /// Whether this and another measurement with its error can be of the same albedo, at `k` standard deviations.
    pub fn agrees(&self, value: [f64; 3], error: f64, k: f64) -> bool {
        (0..3).all(|c| (self.value[c] - value[c]).abs() <= k * self.sigma[c] + error)
    }
}

/// Estimates the albedo of `subject` for the direction `w` (world space, unit) with 288·`effort`² samples.
pub fn estimate<'m, S: Scalar>(
    subject: &impl Subject<'m, S>,
    side: Side,
    w: [S; 3],
    effort: usize,
    rng: &mut impl Rng,
) -> Estimate {
    let held = subject.bsdf(w);
    let (cells, picks) = (6 * effort, 3);
    let (even_count, own_count) = ((2 * cells * cells) as f64, (2 * cells * cells * picks) as f64);
    // f·|cos| and pdf of one direction, over the density that both ways of sampling have there.
    let term = |wi: [S; 3], eval: Eval<S>| -> [f64; 3] {
        let f = match side {
            Side::View => eval.f_cos,
            Side::Light => subject.bsdf(wi).eval_adjoint(w),
        };
        let density = own_count * eval.pdf.to_f64() + even_count / (4.0 * PI);
        f.map(|f| f.to_f64() / density)
    };
    let own = |u: [f64; 3]| match held.sample(u.map(|x| S::c(x as f32 as f64))) {
        Some(sample) if !sample.flags.delta => term(sample.wi, Eval { f_cos: sample.f_cos, pdf: sample.pdf }),
        _ => [0.0; 3],
    };
    let even = |u: [f64; 3]| {
        let (z, phi) = (1.0 - 2.0 * u[0], TAU * u[1]);
        let r = (1.0 - z * z).max(0.0).sqrt();
        let wi = [r * phi.cos(), r * phi.sin(), z].map(S::c);
        term(wi, held.eval(wi))
    };

    let (mut value, mut variance) = (delta_albedo(subject, side, w, &held), [0.0; 3]);
    let mut add = |pair: [[f64; 3]; 2]| {
        for c in 0..3 {
            value[c] += pair[0][c] + pair[1][c];
            variance[c] += (pair[0][c] - pair[1][c]).powi(2);
        }
    };
    let mut within = |i: usize, j: usize, k: usize| {
        let at = |i: usize, n: usize, r: f64| ((i as f64 + r) / n as f64).min(0.999_999_9);
        [at(i, cells, rng.random()), at(j, cells, rng.random()), at(k, picks, rng.random())]
    };
    for i in 0..cells {
        for j in 0..cells {
            add([even(within(i, j, 0)), even(within(i, j, 0))]);
            for k in 0..picks {
                add([own(within(i, j, k)), own(within(i, j, k))]);
            }
        }
    }
    Estimate { value, sigma: variance.map(f64::sqrt) }
}

/// A direction to hold, as `overcoat albedo` takes it: the cosine to +z, and the azimuth in degrees.
pub fn held_direction(rng: &mut impl Rng, normals: &[[f32; 3]]) -> (f64, f64) {
    let phi = rng.random::<f64>() * 360.0;
    let grazing = |rng: &mut dyn FnMut() -> f64| 10f64.powf(-1.0 - 5.0 * rng());
    let mut uniform = || rng.random::<f64>();
    let cos = match (uniform() * 10.0) as u32 {
        0..=3 => uniform(),
        4 | 5 => grazing(&mut uniform),
        6 => -uniform(),
        7 => -grazing(&mut uniform),
        _ => {
            // Close to the horizon of one of the normals.
            let n = normals[(uniform() * normals.len() as f64) as usize % normals.len()].map(f64::from);
            let around = chi2::direction::<f64>(rng);
            let along: f64 = (0..3).map(|c| n[c] * around[c]).sum();
            let mut uniform = || rng.random::<f64>();
            let tilt = if uniform() < 0.7 { 1.0 } else { -1.0 } * 10f64.powf(-5.0 * uniform());
            let flat: [f64; 3] = std::array::from_fn(|c| around[c] - along * n[c]);
            let length = flat.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
            let w: [f64; 3] = std::array::from_fn(|c| flat[c] / length + tilt * n[c]);
            let norm = w.iter().map(|x| x * x).sum::<f64>().sqrt();
            return ((w[2] / norm).clamp(-1.0, 1.0), w[1].atan2(w[0]).to_degrees());
        }
    };
    (cos, phi)
}

/// The direction of [`held_direction`]: azimuth from +x about +z.
pub fn direction_of(cos: f64, degrees: f64) -> [f64; 3] {
    let (sin, phi) = ((1.0 - cos * cos).max(0.0).sqrt(), degrees.to_radians());
    [sin * phi.cos(), sin * phi.sin(), cos]
}
