//! Orthonormal shading frames.

use super::{Over, Scalar, V3};

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
        let n = normalize(n).or_else(|| normalize(fallback_n)).unwrap_or(V3::new(S::zero(), S::zero(), S::one()));
        let t = tangent(n, along).or_else(|| tangent(n, fallback_along)).unwrap_or_else(|| any_tangent(n));
        Frame { t, b: n.cross(t), n }
    }

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
    let square = v.length_squared();
    if is_ordinary(square) { Some(v.scale(S::one() / square.sqrt())) } else { normalize_extreme(v) }
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

/// The part of `along` perpendicular to the unit vector `n`, normalised; `None` if less than 1e-6 of it is left.
#[inline(always)]
fn tangent<S: Scalar>(n: V3<S>, along: V3<S>) -> Option<V3<S>> {
    let t = along - n.scale(n.dot(along));
    let (square, whole) = (t.length_squared(), along.length_squared());
    // Half or more is left: nothing has cancelled.
    if is_ordinary(whole) && square.gt(whole * S::c(0.25)) {
        return Some(t.scale(S::one() / square.sqrt()));
    }
    tangent_near(n, along)
}

/// [`tangent`] where `along` is nearly parallel to the normal, or its square not a number to rely on.
#[cold]
fn tangent_near<S: Scalar>(n: V3<S>, along: V3<S>) -> Option<V3<S>> {
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
