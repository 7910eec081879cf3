//! How long calls take.

use crate::closure::{Bsdf, Eval};
use crate::optics::Scalar;
use std::hint::black_box;
use std::time::Instant;

/// Of one call, in nanoseconds: the fastest of several runs, each long enough for the clock.
pub fn nanoseconds(mut call: impl FnMut()) -> f64 {
    let mut calls = 16u32;
    loop {
        let start = Instant::now();
        (0..calls).for_each(|_| call());
        if start.elapsed().as_micros() > 500 {
            break;
        }
        calls *= 2;
    }
    let run = |_| {
        let start = Instant::now();
        (0..calls).for_each(|_| call());
        start.elapsed().as_secs_f64() * 1e9 / f64::from(calls)
    };
    (0..12).map(run).fold(f64::INFINITY, f64::min)
}

/// Directions of the upper hemisphere, evenly over their cosines.
const DIRECTIONS: usize = 64;

fn directions<S: Scalar>() -> Vec<[S; 3]> {
    let direction = |k: usize| {
        let (z, phi) = ((k as f64 + 0.5) / DIRECTIONS as f64, 2.399_963 * k as f64);
        let r = (1.0 - z * z).sqrt();
        [r * phi.cos(), r * phi.sin(), z].map(S::c)
    };
    (0..DIRECTIONS).map(direction).collect()
}

/// Nanoseconds per [`Bsdf::eval`] and per [`Bsdf::sample`], over directions of the upper hemisphere in turn.
pub fn calls<S: Scalar>(bsdf: &Bsdf<'_, S>) -> (f64, f64) {
    let directions = directions::<S>();
    let numbers: Vec<[S; 3]> = directions.iter().map(|[a, b, c]| [a.abs(), b.abs(), *c]).collect();
    let mut next = 0;
    let mut turn = || {
        next = (next + 1) % DIRECTIONS;
        next
    };
    // By reference: three numbers just put down are not at hand as a direction before all calls before have ended.
    let eval = nanoseconds(|| {
        black_box(&bsdf.eval(*black_box(&directions[turn()])));
    });
    let sample = nanoseconds(|| {
        black_box(&bsdf.sample(*black_box(&numbers[turn()])));
    });
    (eval, sample)
}

/// Nanoseconds per direction of [`Bsdf::eval_batch`], for batches of 64.
pub fn batch(bsdf: &Bsdf<'_>) -> f64 {
    let directions = directions::<f32>();
    let mut out = vec![Eval::default(); DIRECTIONS];
    nanoseconds(|| bsdf.eval_batch(black_box(&directions), black_box(&mut out))) / DIRECTIONS as f64
}
