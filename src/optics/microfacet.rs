//! Rough surfaces as a field of microscopic mirrors: distribution, shadowing, and the sampling of what is visible.
//!
//! Two distributions of the facets' slopes, GGX (Trowbridge & Reitz 1975; Walter et al. 2007) and Beckmann, both
//! stretched by α along x and y, with Smith's height-correlated shadowing (Heitz 2014). With ℓ(ω) = |μ|(1 + 2Λ(ω)) the
//! formulas need no division by a cosine:
//!
//! G₂/(4·μo·μi) = ½/(μi·ℓo + μo·ℓi),  G₁ = 2μ/(μ + ℓ),
//!
//! and the density of visible facets is 2·(ω·h)·D(h)/(μ + ℓ). D takes the half vector as it comes, ωo + ωi: its x and y
//! keep their digits where a normalised h would have lost them, so that α = 1e-4 works in single precision.

use super::{Over, Real, V3};
use std::f64::consts::FRAC_1_PI;

/// The distribution of slopes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    /// Trowbridge & Reitz: long tails.
    Ggx,
    /// Gaussian slopes.
    Beckmann,
}

/// A rough surface: shape and widths.
#[derive(Clone, Copy, Debug)]
pub struct Facets<S> {
    shape: Shape,
    alpha: [S; 2],
    inverse: [S; 2],
    /// 1/(π·αx·αy).
    scale: S,
}

impl<S: Real> Facets<S> {
    /// With widths `alpha` along x and y, both in [1e-4, 1].
    pub fn new(shape: Shape, alpha: [S; 2]) -> Self {
        let inverse = alpha.map(|a| S::one() / a);
        Facets { shape, alpha, inverse, scale: S::c(FRAC_1_PI) * inverse[0] * inverse[1] }
    }

    /// The same widths with GGX slopes: what visible facets are drawn from.
    #[inline(always)]
    pub fn proposal(&self) -> Self {
        Facets { shape: Shape::Ggx, ..*self }
    }

    /// Whether it is its own [`proposal`](Self::proposal).
    #[inline(always)]
    pub fn is_proposal(&self) -> bool {
        self.shape == Shape::Ggx
    }

    /// The widths along x and y.
    pub fn alpha(&self) -> [S; 2] {
        self.alpha
    }

    /// √α of the widths' geometric mean, at most 1: the roughness users know.
    pub fn roughness(&self) -> S {
        (self.alpha[0] * self.alpha[1]).sqrt().sqrt().min(S::one())
    }

    /// Density of facets with normal along `h` (any length), per solid angle and area of the surface.
    #[inline(always)]
    pub fn d<L: Over<S>>(&self, h: V3<L>) -> L {
        let (x, y, z2) = (h.x * L::lift(self.inverse[0]), h.y * L::lift(self.inverse[1]), h.z * h.z);
        let slope2 = x.mul_add(x, y * y);
        let length2 = h.length_squared();
        match self.shape {
            Shape::Ggx => L::lift(self.scale) * (length2 / (slope2 + z2).max(L::c(1e-30))).sq(),
            Shape::Beckmann => {
                // The exponential has long vanished where the ratio is capped.
                let inv = L::one() / z2.max(length2 * L::c(1e-8)).max(L::c(1e-30));
                let steep = slope2 * inv;
                let d = L::lift(self.scale) * (length2 * inv).sq() * (-steep).exp();
                // Nothing is left there, and every precision says so alike.
                L::select(steep.lt(L::c(60.0)), d, L::zero())
            }
        }
    }

    /// ℓ(ω) = |μ|·(1 + 2Λ(ω)) of a unit vector.
    #[inline(always)]
    pub fn reach<L: Over<S>>(&self, w: V3<L>) -> L {
        let (x, y) = (w.x * L::lift(self.alpha[0]), w.y * L::lift(self.alpha[1]));
        let s2 = x.mul_add(x, y * y);
        match self.shape {
            Shape::Ggx => w.z.mul_add(w.z, s2).sqrt(),
            Shape::Beckmann => {
                let (s, z) = (s2.sqrt(), w.z.abs());
                // Beyond 9 nothing is left of it, even in double precision.
                let a = (z / s.max(L::c(1e-30))).min(L::c(9.0));
                s.mul_add(integral_erfc(a), z)
            }
        }
    }

    /// [`reach`](Self::reach) of the surface and of its [`proposal`](Self::proposal).
    #[inline(always)]
    pub fn reaches<L: Over<S>>(&self, w: V3<L>) -> [L; 2] {
        let reach = self.reach(w);
        [reach, if self.is_proposal() { reach } else { self.proposal().reach(w) }]
    }

    /// A facet seen from `wo` (unit, z > 0) for two uniform numbers in [0, 1): any length. Follows the density of
    /// visible facets of [`proposal`](Self::proposal); spherical caps, Dupuy & Benyoub 2023, listing 3.
    #[inline(always)]
    pub fn visible(&self, wo: V3<S>, u: [S; 2]) -> V3<S> {
        self.seen_at(self.squeezed(wo), u[0].sin_cos_of_turns(), u[1])
    }

    /// Where `wo` points once the surface is squeezed until its facets cover a hemisphere.
    #[inline(always)]
    pub(crate) fn squeezed(&self, wo: V3<S>) -> V3<S> {
        let w = V3::new(wo.x * self.alpha[0], wo.y * self.alpha[1], wo.z);
        w.scale(S::one() / w.length_squared().sqrt().max(S::c(1e-18)))
    }

    /// [`visible`](Self::visible) from a squeezed direction, for sine and cosine of the azimuth.
    #[inline(always)]
    pub(crate) fn seen_at(&self, w: V3<S>, (sin, cos): (S, S), u: S) -> V3<S> {
        // z = 1 − u(1 + w.z); its sine without cancellation near 1.
        let fall = u * (S::one() + w.z);
        let across = (fall * (S::c(2.0) - fall)).safe_sqrt();
        let up = (S::one() - u) * (S::one() + w.z);
        V3::new(self.alpha[0] * across.mul_add(cos, w.x), self.alpha[1] * across.mul_add(sin, w.y), up)
    }

    /// Of [`visible`](Self::visible), density per solid angle of the mirrored direction: D/(2(μo + ℓo)); `reach_o` is
    /// the proposal's ℓ(ωo).
    #[inline(always)]
    pub fn mirrored_pdf<L: Over<S>>(&self, h: V3<L>, cos_o: L, reach_o: L) -> L {
        self.d_and_mirrored_pdf(h, cos_o, reach_o).1
    }

    /// [`d`](Self::d) and [`mirrored_pdf`](Self::mirrored_pdf).
    #[inline(always)]
    pub fn d_and_mirrored_pdf<L: Over<S>>(&self, h: V3<L>, cos_o: L, reach_o: L) -> (L, L) {
        let d = self.d(h);
        let proposed = if self.is_proposal() { d } else { self.proposal().d(h) };
        (d, proposed * L::c(0.5) / (cos_o + reach_o).max(L::c(1e-18)))
    }
}

/// `w` mirrored at the facet along `h` (any length).
#[inline(always)]
pub fn mirror<R: Real>(w: V3<R>, h: V3<R>) -> V3<R> {
    let scale = R::c(2.0) * w.dot(h) / h.length_squared().max(R::c(1e-30));
    h.scale(scale) - w
}

/// ∫ₐ^∞ erfc for a ≥ 0: e^(−a²)/√π − a·erfc(a).
#[inline(always)]
fn integral_erfc<R: Real>(a: R) -> R {
    let gauss = (-(a * a)).exp();
    let inv_sqrt_pi = R::c(0.564_189_583_547_756_3);
    (gauss * (inv_sqrt_pi - a * scaled_erfc(a))).max(R::zero())
}

/// erfc(a)·e^(a²) for a ≥ 0, to 1.2e-7 relatively (Press et al., Numerical Recipes, 2nd ed., §6.2).
#[inline(always)]
pub fn scaled_erfc<R: Real>(a: R) -> R {
    const TERMS: [f64; 10] = [
        0.170_872_77,
        -0.822_152_23,
        1.488_515_87,
        -1.135_203_98,
        0.278_868_07,
        -0.186_288_06,
        0.096_784_18,
        0.374_091_96,
        1.000_023_68,
        -1.265_512_23,
    ];
    let t = R::one() / R::c(0.5).mul_add(a, R::one());
    let sum = TERMS[1..].iter().fold(R::c(TERMS[0]), |sum, term| sum.mul_add(t, R::c(*term)));
    t * sum.exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_complementary_error_function_is_as_precise_as_it_says() {
        for k in 0..900 {
            let a = k as f64 * 0.01;
            let truth = statrs::function::erf::erfc(a);
            let ours = scaled_erfc(a) * (-a * a).exp();
            assert!((ours / truth - 1.0).abs() < 1.3e-7, "{a}: {ours} for {truth}");
        }
    }

    #[test]
    fn facets_cover_the_surface() {
        // ∫ D·cos over the hemisphere is 1, with cos θ = (1 − u²)… graded toward the peak: tan θ = α·t/(1 − t).
        let rule = crate::optics::microfacet::tests::midpoints(4000);
        for shape in [Shape::Ggx, Shape::Beckmann] {
            for alpha in [1e-4, 1e-2, 0.3, 1.0] {
                let facets = Facets::new(shape, [alpha, alpha]);
                let sum: f64 = rule
                    .iter()
                    .map(|t| {
                        let tan = alpha * t / (1.0 - t);
                        let cos = 1.0 / (1.0 + tan * tan).sqrt();
                        let d = facets.d(V3::new(tan, 0.0, 1.0));
                        // dω = 2π tan/(1 + tan²)^{3/2} d tan.
                        d * cos * TAU * tan * cos.powi(3) * alpha / (1.0 - t).powi(2) / rule.len() as f64
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 1e-5, "{shape:?} {alpha}: {sum}");
            }
        }
    }

    pub(super) fn midpoints(n: usize) -> Vec<f64> {
        (0..n).map(|k| (k as f64 + 0.5) / n as f64).collect()
    }
}
