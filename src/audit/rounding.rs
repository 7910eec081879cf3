//! How much of an error the rounding of the input accounts for.

use crate::optics::Scalar;

/// How much `f` changes, at most and to first order, where every component of its two directions moves by `step` – one unit
/// in the last place of 1 in the type under test, as turning into a lobe's frame does: an error that no way of computing
/// avoids.
///
/// `f` is evaluated in a type with more digits than the one under test.
///
/// ```
/// use overcoat::audit::rounding;
/// let steep = |a: [f64; 3], b: [f64; 3]| 1e3 * a[0] * b[0];
/// let unavoidable = rounding(f64::from(f32::EPSILON), steep, [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
/// assert!((unavoidable - 2e3 * f64::from(f32::EPSILON)).abs() < 1e-9);
/// ```
pub fn rounding<T: Scalar>(step: f64, f: impl Fn([T; 3], [T; 3]) -> T, a: [T; 3], b: [T; 3]) -> f64 {
    let truth = f(a, b);
    let moved = |i: usize, by: f64| {
        let (mut a, mut b) = (a, b);
        let w = if i < 3 { &mut a } else { &mut b };
        w[i % 3] += T::c(by);
        (f(a, b) - truth).abs().to_f64()
    };
    (0..6).map(|i| moved(i, step).max(moved(i, -step))).sum()
}
