//! Orthonormal shading frames.

use super::{Over, Real, Scalar, V3};

/// An orthonormal frame: `t` and `b` span the surface, `n` is the normal, t × b = n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<S> {
    /// The x axis, in the surface.
    pub t: V3<S>,
    /// The y axis, in the surface.
    pub b: V3<S>,
    /// The z axis: the normal.
    pub n: V3<S>,
}

impl<S: Scalar> Frame<S> {
    /// The frame about `n` whose x axis is as close to `along` as can be.
    ///
    /// A zero or non-finite `n` is replaced by `fallback_n`, and that by +z; an `along` that is zero, non-finite or
    /// parallel to the normal by `fallback_along`, and that by any tangent.
    #[inline(always)]
    pub fn new(n: V3<S>, fallback_n: V3<S>, along: V3<S>, fallback_along: V3<S>) -> Self {
        let n = match to_unit(n.length_squared()) {
            Some(k) => n.scale(k),
            None => rare_normal(n.apart(), fallback_n.apart()).apart(),
        };
        let t = along - n.scale(n.dot(along));
        // Half or more is left: nothing has cancelled.
        let whole = along.length_squared();
        let left = Some(t.length_squared()).filter(|left| is_ordinary(whole) && Real::gt(*left, whole * S::c(0.25)));
        let t = match left.and_then(to_unit) {
            Some(k) => t.scale(k),
            None => rare_tangent(n.apart(), along.apart(), fallback_along.apart()).apart(),
        };
        Frame { t, b: n.cross(t), n }
    }
}

impl<S: Real> Frame<S> {
    /// World to local.
    #[inline(always)]
    pub fn to_local<L: Over<S>>(&self, w: V3<L>) -> V3<L> {
        V3::new(V3::lift(self.t).dot(w), V3::lift(self.b).dot(w), V3::lift(self.n).dot(w))
    }

    /// Local to world.
    #[inline(always)]
    pub fn to_world(&self, w: V3<S>) -> V3<S> {
        self.t.scale(w.x) + self.b.scale(w.y) + self.n.scale(w.z)
    }
}

/// The unit vector along `v`; `None` if `v` is zero or not finite. Safe for lengths whose square over- or underflows.
#[inline(always)]
pub fn normalize<S: Scalar>(v: V3<S>) -> Option<V3<S>> {
    match to_unit(v.length_squared()) {
        Some(k) => Some(v.scale(k)),
        None => normalize_extreme(v),
    }
}

/// [`normalize`], with 0 for what has no direction.
#[inline(always)]
pub fn normalize_or_zero<S: Scalar>(v: V3<S>) -> V3<S> {
    match to_unit(v.length_squared()) {
        Some(k) => v.scale(k),
        None => {
            let zero = V3::new(S::zero(), S::zero(), S::zero());
            normalize_extreme(v).unwrap_or(zero).apart()
        }
    }
}

/// What a vector of this squared length is to be scaled by; `None` where that has to be found with more care.
#[inline(always)]
fn to_unit<S: Scalar>(square: S) -> Option<S> {
    let off = square - S::one();
    if off.abs().lt(S::c(if S::SINGLE { 1e-4 } else { 1e-8 })) {
        // A unit vector but for rounding, as most are: one of Newton's steps in place of a root and a division. It leaves
        // 3/8·off², below the last digit.
        Some(S::c(-0.5).mul_add(off, S::one()))
    } else if is_ordinary(square) {
        Some(S::one() / square.sqrt())
    } else {
        None
    }
}

/// Whether a squared length is far from where squares over- or underflow; never for NaN.
#[inline(always)]
fn is_ordinary<S: Scalar>(square: S) -> bool {
    square.gt(S::c(1e-20)) & square.lt(S::c(1e20))
}

#[cold]
fn normalize_extreme<S: Scalar>(v: V3<S>) -> Option<V3<S>> {
    let largest = v.x.abs().max(v.y.abs()).max(v.z.abs());
    let finite = v.x.is_finite() && v.y.is_finite() && v.z.is_finite();
    if !finite || largest.le(S::zero()) {
        return None;
    }
    // Two steps, because 1/largest is infinite for denormals.
    let u = V3::new(v.x / largest, v.y / largest, v.z / largest);
    Some(u.scale(S::one() / u.length_squared().sqrt()))
}

/// The normal of a frame whose first choice is no ordinary vector.
#[cold]
fn rare_normal<S: Scalar>(n: V3<S>, fallback: V3<S>) -> V3<S> {
    normalize_extreme(n).or_else(|| normalize(fallback)).unwrap_or(V3::new(S::zero(), S::zero(), S::one()))
}

/// The tangent of a frame whose first choice is nearly parallel to the normal, or no ordinary vector.
#[cold]
fn rare_tangent<S: Scalar>(n: V3<S>, along: V3<S>, fallback: V3<S>) -> V3<S> {
    tangent(n, along).or_else(|| tangent(n, fallback)).unwrap_or_else(|| any_tangent(n))
}

/// The part of `along` perpendicular to the unit vector `n`, normalised; `None` if less than 1e-6 of it is left.
fn tangent<S: Scalar>(n: V3<S>, along: V3<S>) -> Option<V3<S>> {
    let a = normalize(along)?;
    let t = a - n.scale(n.dot(a));
    if t.length_squared().lt(S::c(1e-12)) {
        return None;
    }
    let t = normalize(t)?;
    // Once more: what cancellation left of n is removed at full precision.
    normalize(t - n.scale(n.dot(t)))
}

/// Some unit vector perpendicular to the unit vector `n`.
fn any_tangent<S: Scalar>(n: V3<S>) -> V3<S> {
    let (zero, one) = (S::zero(), S::one());
    let axis = if n.x.abs().lt(S::c(0.6)) { V3::new(one, zero, zero) } else { V3::new(zero, one, zero) };
    let t = axis - n.scale(n.dot(axis));
    t.scale(one / t.length_squared().sqrt())
}
