//! Maps from the unit square to directions, each beside its density.

use super::{Real, V3};
use std::f64::consts::FRAC_1_PI;

/// A direction about z with density cos θ/π.
#[inline(always)]
pub fn cosine_hemisphere<R: Real>(u: [R; 2]) -> V3<R> {
    cosine_and_uniform_hemisphere(u).0
}

/// Density of [`cosine_hemisphere`]; 0 below the surface.
#[inline(always)]
pub fn cosine_hemisphere_pdf<R: Real>(cos: R) -> R {
    cos.max(R::zero()) * R::c(FRAC_1_PI)
}

/// A direction about z, uniform over the upper hemisphere.
#[inline(always)]
pub fn uniform_hemisphere<R: Real>(u: [R; 2]) -> V3<R> {
    cosine_and_uniform_hemisphere(u).1
}

/// [`cosine_hemisphere`] and [`uniform_hemisphere`] of the same numbers.
#[inline(always)]
pub(crate) fn cosine_and_uniform_hemisphere<R: Real>(u: [R; 2]) -> (V3<R>, V3<R>) {
    let (s, c) = u[1].sin_cos_of_turns();
    let (root, sin) = (u[0].sqrt(), (R::one() - u[0] * u[0]).safe_sqrt());
    (V3::new(root * c, root * s, (R::one() - u[0]).safe_sqrt()), V3::new(sin * c, sin * s, u[0]))
}

/// Density of [`uniform_hemisphere`]; 0 below the surface.
#[inline(always)]
pub fn uniform_hemisphere_pdf<R: Real>(cos: R) -> R {
    R::select(cos.gt(R::zero()), R::c(0.5 * FRAC_1_PI), R::zero())
}

/// Two unit vectors that stand at right angles on the unit vector `axis` and on each other (Duff et al. 2017).
#[inline(always)]
pub fn around<R: Real>(axis: V3<R>) -> (V3<R>, V3<R>) {
    let sign = R::one().copysign(axis.z);
    let a = -R::one() / (sign + axis.z);
    let b = axis.x * axis.y * a;
    let t = V3::new((sign * axis.x * axis.x).mul_add(a, R::one()), sign * b, -sign * axis.x);
    (t, V3::new(b, (axis.y * axis.y).mul_add(a, sign), -axis.y))
}
