//! Scattering by one dielectric thread: what the thread and cloth lobes share. Not a lobe itself.
//!
//! The thread runs along x. θ is the angle to the plane across it, φ the angle around it; θh and θd are half the sum
//! and half the difference of two directions' θ, φd is the difference of their φ (Sadeghi, Bisker, De Deken & Jensen
//! 2013, §5):
//!
//! f = [Fr·¼ cos(φd/2)·½ g(γs, θh) + ½ Ft²·A·((1 − kd)·g(γv, θh) + kd)/(cos θi + cos θo)] / cos² θd.
//!
//! The paper has neither the ¼, the share of a smooth cylinder's width that reflects toward φd, nor the ½, which is
//! there because g is normalised over θh while light is collected over θi = 2θh − θo. With both, a smooth and perfectly
//! reflecting thread reflects 1 (the paper's form: 8). The second term's ½ is the same one.
//!
//! Nothing here calls an inverse function where angles cancel: with s = sin θi + sin θo and c = cos θi + cos θo,
//! tan θh = s/c and s² + c² = 4 cos² θd; with unit vectors p around the thread, |pi + po| = 2 cos(φd/2).

use crate::optics::{Lift, Over, Real, V3, fresnel};
use std::f64::consts::{FRAC_PI_2, PI};

/// cos θi + cos θo is taken as at least this: where both directions run along the thread the paper's division has no
/// limit.
const MIN_COS_SUM: f64 = 0.02;

/// A direction in the coordinates of a thread.
#[derive(Clone, Copy, Debug)]
pub struct Around<R> {
    /// sin θ.
    pub sin: R,
    /// cos θ.
    pub cos: R,
    /// The unit vector (y, z)/cos θ: sin φ.
    pub py: R,
    /// See `py`; cos φ.
    pub pz: R,
}

impl<R: Real> Around<R> {
    /// Of a unit vector in the thread's frame.
    #[inline(always)]
    pub fn new(w: V3<R>) -> Self {
        let cos = w.y.mul_add(w.y, w.z * w.z).sqrt();
        let inv = R::one() / cos.max(R::c(1e-15));
        Around { sin: w.x, cos, py: w.y * inv, pz: w.z * inv }
    }

    /// The same in another type.
    #[inline(always)]
    pub fn lift<S: Real>(o: Around<S>) -> Self
    where
        R: Lift<S>,
    {
        Around { sin: R::lift(o.sin), cos: R::lift(o.cos), py: R::lift(o.py), pz: R::lift(o.pz) }
    }

    /// θ.
    #[inline(always)]
    pub fn angle(self) -> R {
        self.sin.atan2(self.cos)
    }

    /// |pi − po|² = 2(1 − cos φd).
    #[inline(always)]
    pub fn turn(self, o: Self) -> R {
        (self.py - o.py).sq() + (self.pz - o.pz).sq()
    }
}

/// The surface reflection and the two parts of the volume term, before A and kd.
#[derive(Clone, Copy, Debug)]
pub struct Parts<R> {
    /// The surface reflection.
    pub surface: R,
    /// The g(γv) part.
    pub forward: R,
    /// The isotropic part.
    pub even: R,
}

/// A thread's constants.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder<S> {
    /// η² − 1.
    m: S,
    /// 1/(2γ²) and 1/(γ√2π) for surface and volume.
    surface: (S, S),
    volume: (S, S),
}

impl<S: Real> Cylinder<S> {
    /// Widths in degrees; `spread` (radians) is a further spread of tangents that both are widened by.
    pub fn new(eta: S, gamma_s: S, gamma_v: S, spread: S) -> Self {
        let gauss = |degrees: S| {
            let width = degrees * S::c(PI / 180.0);
            let var = (width * width + spread * spread).max(S::c(1e-6));
            (S::c(0.5) / var, S::c((0.5 / PI).sqrt()) / var.sqrt())
        };
        Cylinder { m: (eta - S::one()) * (eta + S::one()), surface: gauss(gamma_s), volume: gauss(gamma_v) }
    }

    /// The parts of f, symmetric in their directions.
    #[inline(always)]
    pub fn parts<L: Over<S>>(&self, o: Around<L>, i: Around<L>) -> Parts<L> {
        let (s, c) = (o.sin + i.sin, o.cos + i.cos);
        let four_cos2_d = s.mul_add(s, c * c).max(L::c(1e-9));
        let inv_cos2_d = L::c(4.0) / four_cos2_d;
        let theta_h = s.atan2(c);
        let th2 = theta_h * theta_h;
        let turned = ((o.py + i.py).sq() + (o.pz + i.pz).sq()).sqrt();
        let cos_half = (L::c(0.5) * turned).min(L::one());
        let reflected = fresnel::dielectric(L::lift(self.m), L::c(0.5) * four_cos2_d.sqrt() * cos_half);
        let half = L::c(0.5) * inv_cos2_d;
        let even = half * (L::one() - reflected).sq() / c.max(L::c(MIN_COS_SUM));
        Parts {
            surface: half * reflected * L::c(0.25) * cos_half * gauss::<S, L>(self.surface, th2),
            forward: even * gauss::<S, L>(self.volume, th2),
            even,
        }
    }
}

/// A Gaussian at the square of its argument.
#[inline(always)]
fn gauss<S: Real, L: Over<S>>((k, norm): (S, S), square: L) -> L {
    L::lift(norm) * (-(L::lift(k) * square)).exp()
}

/// What a perfectly reflecting cylinder with a Gaussian of `width` (radians) sends out in all when it is seen at
/// longitudinal angle `theta`: ∫∫ ¼ cos(φd/2)·½ g(width, θh)·cos² θi/cos² θd dθi dφ. 1 for a narrow width away from
/// the poles. Multiply by 2 for a Gaussian that is not halved, by 4 again for a form without the ¼.
pub fn total_reflectance(width: f64, theta: f64) -> f64 {
    let rule = crate::albedo::quadrature::Rule::gauss_legendre(40);
    let value = |theta_i: f64| {
        let (h, d) = (0.5 * (theta_i + theta), 0.5 * (theta_i - theta));
        let g = (-0.5 * (h / width).powi(2)).exp() / (width * (2.0 * PI).sqrt());
        // ∫ ¼ cos(φd/2) dφ over the full turn is 1.
        0.5 * g * (theta_i.cos() / d.cos()).powi(2)
    };
    // Cells of the width about the ridge θi = −θ, out to where g vanishes, and ever finer toward ±π/2, where the
    // cosines turn fast if θ is near the other end.
    let (lo, hi) = ((-theta - 18.0 * width).max(-FRAC_PI_2), (18.0 * width - theta).min(FRAC_PI_2));
    let mut edges: Vec<f64> = (0..=((hi - lo) / width).ceil() as usize).map(|k| lo + width * k as f64).collect();
    for k in 1..24 {
        let distance = 0.5f64.powi(k);
        edges.extend([distance - FRAC_PI_2, FRAC_PI_2 - distance]);
    }
    edges.extend([lo, hi]);
    edges.retain(|e| (lo..=hi).contains(e));
    edges.sort_by(f64::total_cmp);
    let cell = |ends: &[f64]| {
        let size = ends[1] - ends[0];
        size * rule.nodes.iter().zip(&rule.weights).map(|(u, w)| w * value(ends[0] + size * u)).sum::<f64>()
    };
    edges.windows(2).map(cell).sum()
}

/// The way of a ray after it is refracted into a smooth dielectric cylinder of index `eta` about the x axis and out
/// again: `way` is its unit direction, `offset` in (−1, 1) how far from the axis it passes, in radii. `None` where it is
/// reflected inside. The component along the axis stays what it was (Marschner et al. 2003).
pub fn through_smooth_cylinder(way: [f64; 3], offset: f64, eta: f64) -> Option<[f64; 3]> {
    let refract = |d: [f64; 3], n: [f64; 3], eta: f64| {
        let c = -(d[0] * n[0] + d[1] * n[1] + d[2] * n[2]);
        let k = 1.0 - eta * eta * (1.0 - c * c);
        (k > 0.0).then(|| std::array::from_fn::<f64, 3, _>(|i| eta * d[i] + (eta * c - k.sqrt()) * n[i]))
    };
    // Where it meets the unit circle across the axis.
    let flat = way[1].hypot(way[2]).max(f64::MIN_POSITIVE);
    let u = [way[1] / flat, way[2] / flat];
    let back = (1.0 - offset * offset).max(0.0).sqrt();
    let n = [0.0, -offset * u[1] - back * u[0], offset * u[0] - back * u[1]];
    let inside = refract(way, n, 1.0 / eta)?;
    let flat2 = inside[1] * inside[1] + inside[2] * inside[2];
    let chord = -2.0 * (n[1] * inside[1] + n[2] * inside[2]) / flat2;
    let out = [0.0, -(n[1] + chord * inside[1]), -(n[2] + chord * inside[2])];
    refract(inside, out, eta)
}

/// A proposal for θi: the logistic distribution about a ridge, cut off at ±π/2. Its tails are heavier than a
/// Gaussian's, and both it and its inverse have a closed form.
#[derive(Clone, Copy, Debug)]
pub struct Ridge<S> {
    center: S,
    scale: S,
    /// The distribution function at −π/2, and the probability between the ends.
    low: S,
    span: S,
}

impl<S: Real> Ridge<S> {
    /// About `center` with standard deviation `sigma`, both radians.
    pub fn new(center: S, sigma: S) -> Self {
        let end = S::c(FRAC_PI_2);
        let center = center.clamp(-end, end);
        let scale = sigma * S::c(3f64.sqrt() / PI);
        let below = |x: S| S::one() / (S::one() + ((center - x) / scale).clamp(S::c(-80.0), S::c(80.0)).exp());
        let low = below(-end);
        Ridge { center, scale, low, span: below(end) - low }
    }

    /// Density over θi.
    #[inline(always)]
    pub fn pdf<L: Over<S>>(&self, theta: L) -> L {
        logistic(theta - L::lift(self.center), L::lift(self.scale)) / L::lift(self.span)
    }

    /// Density over θi of the distribution about `center` before it is cut off.
    #[inline(always)]
    pub fn density<L: Real>(theta: L, center: L, sigma: L) -> L {
        let end = L::c(FRAC_PI_2);
        logistic(theta - center.clamp(-end, end), sigma * L::c(3f64.sqrt() / PI))
    }

    /// How much of the whole distribution lies within ±π/2.
    pub fn span(&self) -> S {
        self.span
    }

    /// θi for a uniform number.
    pub fn sample(&self, u: S) -> S {
        let v = u.mul_add(self.span, self.low).clamp(S::c(1e-7), S::c(1.0 - 1e-7));
        let end = S::c(FRAC_PI_2);
        self.scale.mul_add((v / (S::one() - v)).ln(), self.center).clamp(-end, end)
    }
}

#[inline(always)]
fn logistic<L: Real>(x: L, scale: L) -> L {
    let e = (-(x.abs() / scale).min(L::c(80.0))).exp();
    e / ((L::one() + e).sq() * scale)
}

/// A direction from θi and a uniform number for φi, with density ½ cos φi.
pub fn around_thread<S: Real>(theta: S, u: S) -> V3<S> {
    let (sin, cos) = theta.sin_cos();
    let cos = cos.max(S::zero());
    let two = S::c(2.0);
    V3::new(sin, cos * (two * u - S::one()), cos * two * (u * (S::one() - u)).safe_sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnel_has_its_limits() {
        for eta in [1.0f64, 1.000_001, 1.345, 1.5, 3.0] {
            let m = (eta - 1.0) * (eta + 1.0);
            let head_on = ((eta - 1.0) / (eta + 1.0)).powi(2);
            approx::assert_relative_eq!(fresnel::dielectric(m, 1.0), head_on, epsilon = 1e-30, max_relative = 1e-9);
            let single = fresnel::dielectric(m as f32, 1.0f32) as f64;
            approx::assert_relative_eq!(single, head_on, epsilon = 1e-30, max_relative = 1e-5);
            if eta > 1.0 {
                assert!((fresnel::dielectric(m, 0.0) - 1.0).abs() < 1e-9);
            }
        }
    }
}
