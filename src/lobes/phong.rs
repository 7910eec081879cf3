//! Phong's highlight around the mirror direction, normalised.
//!
//! f = (n + 2)/2π·cosⁿα, α the angle between ωi and the mirror direction of ωo. At exponent 0 an even dusting, at 20 a broad
//! round highlight, as on plastic, at 1000 a small one. Toward grazing angles half of it falls below the surface and is
//! lost: the edge of a ball darkens to one half.
//!
//! Where this departs from the sources: Phong's own form has no constant and is divided by μi in OSL's renderer, which gains
//! without limit toward grazing light. This one (Lafortune & Willems 1994) is reciprocal, and
//! E = (n + 2)/2π·∫ cosⁿα·μi dωi ≤ (n + 2)/2π·∫ cosⁿα·cos α dωi = 1, with equality for light along the normal: among half
//! spaces the one around the mirror direction holds the most.

use super::limits::{Limits, SlotRange};
use super::registry::{ClosureParams, closure};
use super::{Lobe, Rgb};
use crate::albedo::curve::{no_cells, no_extra};
use crate::albedo::quadrature::Rule;
use crate::albedo::{AlbedoCurve, Axis, CurveSpec};
use crate::optics::{Over, Real, V3, sampling};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};
use std::sync::OnceLock;

closure! {
    /// A round highlight about the mirror direction. One-sided.
    closure "phong" as PhongParams {
        /// Shading normal.
        normal N;
        /// How narrow the highlight is. A microfacet surface of width α has about the exponent 2/α² − 2.
        float exponent = 20.0, in (0.0, 10000.0);
    }
    source: "Phong 1975; Lafortune & Willems 1994; OSL specification, phong()",
    reciprocal: true,
    class: Scatter,
}

/// See [`PhongParams`].
#[derive(Clone, Copy, Debug)]
pub struct Phong<S> {
    wo: V3<S>,
    exponent: S,
    /// (n + 2)/2π and (n + 1)/2π on the normal's side, else 0.
    scale: S,
    density: S,
    /// The place of n in a table over it.
    place: S,
}

/// √(2/(n + 2)): what tables go over.
fn place(exponent: f64) -> f64 {
    (2.0 / (exponent + 2.0)).sqrt()
}

/// The albedo at the cosine `mu`: over α about the mirror direction, each ring counted as far as it lies above the surface.
fn albedo(n: f64, mu: f64) -> f64 {
    static RULE: OnceLock<Rule> = OnceLock::new();
    let rule = RULE.get_or_init(|| Rule::gauss_legendre(48));
    let mu = mu.clamp(0.0, 1.0);
    let sin = ((1.0 - mu) * (1.0 + mu)).sqrt();
    // Rings up to here lie above it altogether, and give μ·(1 − sinⁿ⁺²).
    let whole = mu.atan2(sin);
    let inside = mu * -((n + 2.0) * 0.5 * (-mu * mu).ln_1p()).exp_m1();
    let last = FRAC_PI_2.min(whole + 9.0 / (n + 1.0).sqrt());
    let mut sum = 0.0;
    for (v, weight) in rule.nodes.iter().zip(&rule.weights) {
        // Graded toward the ring that touches the surface.
        let alpha = whole + (last - whole) * v * v;
        let (s, c) = alpha.sin_cos();
        let turn = if s * sin > 0.0 { (-(c * mu) / (s * sin)).clamp(-1.0, 1.0).acos() } else { PI };
        let above = 2.0 * (turn * c * mu + turn.sin() * s * sin);
        sum += weight * 2.0 * v * (last - whole) * (n * c.max(1e-300).ln()).exp() * s * above.max(0.0);
    }
    (inside + (n + 2.0) / TAU * sum).min(1.0)
}

impl<S: Real> Phong<S> {
    /// tan²α and whether α is below 90°: 1 − cos α is half the square of the difference, which keeps its digits.
    #[inline(always)]
    fn spread<L: Over<S>>(&self, wi: V3<L>) -> (L, L::Mask) {
        let wo = V3::<L>::lift(self.wo);
        let d = V3::new(wo.x + wi.x, wo.y + wi.y, wi.z - wo.z);
        let d2 = d.length_squared();
        let cos = L::c(-0.5).mul_add(d2, L::one());
        let sin2 = d2 * L::c(-0.25).mul_add(d2, L::one());
        let lit = cos.gt(L::c(1e-6)) & wo.z.gt(L::zero()) & wi.z.gt(L::zero());
        (sin2.max(L::zero()) / cos.sq().max(L::c(1e-12)), lit)
    }

    /// cosⁿα.
    #[inline(always)]
    fn power<L: Over<S>>(&self, wi: V3<L>) -> L {
        let (tan2, lit) = self.spread(wi);
        let power = (L::c(-0.5) * L::lift(self.exponent) * tan2.ln_1p()).exp();
        L::select(lit, power, L::zero())
    }

    /// For [`CurveSpec`]: a constant with the albedo that is wanted. key = [the place of n].
    fn kernel(key: &[f64; 4], wo: V3<f64>, _: &[V3<f64>], out: &mut [f64]) {
        let n = 2.0 / (key[0] * key[0]) - 2.0;
        out.fill(albedo(n, wo.z) * FRAC_1_PI);
    }
}

impl<S: Real> Lobe<S> for Phong<S> {
    type Params = PhongParams;
    type Aimed = Self;

    fn roughness(&self) -> S {
        self.place.sqrt()
    }

    fn curve(values: &[Option<f32>]) -> Option<CurveSpec> {
        let spec = &PhongParams::SPEC.params[1];
        let known = values[3].map(|v| place(f64::from(spec.clamp(0, v))));
        let axis = Axis { index: 0, lo: place(f64::from(spec.max)), hi: 1.0 };
        Some(CurveSpec {
            kernel: Phong::<f64>::kernel,
            key: [known.unwrap_or(0.0), 0.0, 0.0, 0.0],
            axis: known.is_none().then_some(axis),
            reciprocal: true,
            bounded: false,
            extra: no_extra,
            cells: no_cells,
        })
    }

    /// E rises with μ, and lies below the lobe of exponent 0 at μ = 0: ½.
    fn limits(ranges: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        let spec = &PhongParams::SPEC.params[1];
        let range = ranges.get(3).copied().unwrap_or((spec.min, spec.max));
        let ends = [range.0, range.1].map(|n| f64::from(spec.clamp(0, n)));
        let at = |mu: f64| ends.map(|n| albedo(n, mu));
        let (low, high) = (at(cos.0.max(0.0)), at(cos.1));
        // For each μ the larger of the ends is not exceeded between them by more than this.
        Some(Limits::above(cos, (low[0].min(low[1]) - 5e-3).max(0.0), (high[0].max(high[1]) + 1e-2).min(1.0)))
    }

    fn new(params: &PhongParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        let n = S::from_f32(params.exponent);
        let lit = |x: S| S::select(wo.z.gt(S::zero()), x * S::c(0.5 * FRAC_1_PI), S::zero());
        let place = S::c(place(f64::from(params.exponent)));
        Phong { wo, exponent: n, scale: lit(n + S::c(2.0)), density: lit(n + S::one()), place }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::lift(self.scale) * self.power(wi); 3]
    }

    /// What falls below the surface is no direction at all.
    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        L::lift(self.density) * self.power(wi)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        let one = S::one();
        // cosⁿ⁺¹α is even over [0, 1].
        let ln = (one - u[0]).max(S::c(1e-30)).ln() / (self.exponent + one);
        let cos = ln.exp();
        let sin2 = (one - cos) * (one + cos);
        let (sin, (sin_phi, cos_phi)) = (sin2.safe_sqrt(), u[1].sin_cos_of_turns());
        let axis = V3::new(-self.wo.x, -self.wo.y, self.wo.z);
        let (t, b) = sampling::around(axis);
        let w = axis.scale(cos) + t.scale(sin * cos_phi) + b.scale(sin * sin_phi);
        V3::new(w.x, w.y, w.z.max(S::zero()))
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [curve.view(w, self.place); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [curve.bound(w, L::lift(self.place)).min(L::one()); 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_albedo_has_its_known_values() {
        // n = 0: half the sphere around the mirror direction; the normal: all; n = 1 at the horizon: 3/2π·∫… = ⅜·… by hand.
        for n in [0.0, 1.0, 7.5, 300.0, 1e4] {
            assert!((albedo(n, 1.0) - 1.0).abs() < 1e-9, "{n}");
        }
        assert!((albedo(0.0, 0.0) - 0.5).abs() < 1e-6, "{}", albedo(0.0, 0.0));
        // (n + 2)/2π·Γ(3/2)Γ((n + 1)/2)/Γ((n + 4)/2), for n = 1: 3/2π·(√π/2)/(¾√π) = 1/π.
        assert!((albedo(1.0, 0.0) - FRAC_1_PI).abs() < 1e-6, "{}", albedo(1.0, 0.0));
    }

    #[test]
    fn the_albedo_rises_with_the_cosine_and_turns_slowly_with_the_exponent() {
        let grid: Vec<f64> = (0..=60).map(|k| (k as f64 / 60.0).powi(3)).collect();
        for k in 0..40 {
            let n = 1e4 * (k as f64 / 39.0).powi(4);
            for pair in grid.windows(2) {
                assert!(albedo(n, pair[1]) >= albedo(n, pair[0]) - 1e-7, "{n} {pair:?}");
            }
            for mu in &grid {
                // Between any two exponents none exceeds the larger end by more than `limits` allows.
                let most = albedo(0.0, *mu).max(albedo(n, *mu));
                let between = (1..10).map(|j| albedo(n * j as f64 / 10.0, *mu)).fold(0.0, f64::max);
                assert!(between <= most + 1e-2, "{n} {mu}: {between} above {most}");
            }
        }
    }
}
