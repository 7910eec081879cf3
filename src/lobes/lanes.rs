//! A formula for one direction, over eight of them: loops that the compiler makes vector code of.
//!
//! What a loop reads and writes is local, so that nothing it writes can be something it reads. Formulas that read a table
//! would stay narrow: they get what was read as numbers that go with each direction.

use super::Rgb;
use crate::optics::{F32x8, V3};

/// One number of every lane.
#[inline(always)]
pub(super) fn each_lane(wi: &V3<F32x8>, f: impl Fn(V3<f32>) -> f32) -> F32x8 {
    each_lane_of(wi, [], |w, []| f(w))
}

/// [`each_lane`], from numbers that go with it too.
#[inline(always)]
pub(super) fn each_lane_of<const N: usize>(
    wi: &V3<F32x8>,
    with: [F32x8; N],
    f: impl Fn(V3<f32>, [f32; N]) -> f32,
) -> F32x8 {
    let V3 { x: F32x8(x), y: F32x8(y), z: F32x8(z) } = *wi;
    let mut out = [0.0; F32x8::LANES];
    for i in 0..F32x8::LANES {
        out[i] = f(V3::new(x[i], y[i], z[i]), with.map(|w| w.0[i]));
    }
    F32x8(out)
}

/// A color of every lane.
#[inline(always)]
pub(super) fn over_lanes(wi: &V3<F32x8>, f: impl Fn(V3<f32>) -> Rgb<f32>) -> Rgb<F32x8> {
    over_lanes_of(wi, [], |w, []| f(w))
}

/// [`over_lanes`], from numbers that go with it too.
#[inline(always)]
pub(super) fn over_lanes_of<const N: usize>(
    wi: &V3<F32x8>,
    with: [F32x8; N],
    f: impl Fn(V3<f32>, [f32; N]) -> Rgb<f32>,
) -> Rgb<F32x8> {
    let V3 { x: F32x8(x), y: F32x8(y), z: F32x8(z) } = *wi;
    let mut out = [[0.0; F32x8::LANES]; 3];
    for i in 0..F32x8::LANES {
        let value = f(V3::new(x[i], y[i], z[i]), with.map(|w| w.0[i]));
        for c in 0..3 {
            out[c][i] = value[c];
        }
    }
    out.map(F32x8)
}
