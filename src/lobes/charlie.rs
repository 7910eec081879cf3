//! The fibre distribution of Conty & Kulla 2017 ("Charlie") and its shadowing: fitted, refitted and exact.
//!
//! In: roughness and cosines. Out: D, ln Λ of the paper's fit, and the exact Smith Λ. Every sheen model is put together
//! from these; the file knows no lobe.
//!
//! The exact Λ is written Λ(μ) = D(0)·s²·H(μ, r)/(μ·√(1 + a·s²)), s² = 1 − μ², D(0) the largest value of D, with the
//! square root taking out what changes fast, and H a Chebyshev series in both variables. Its coefficients are fitted to [`lambda_quadrature`] by
//! `examples/fit_sheen.rs`; the series is within 3e-7 of the quadrature for r in [0.001, 1] and every angle.

use super::charlie_terms::TERMS;
use crate::albedo::Cells;
use crate::albedo::quadrature::Rule;
use crate::optics::{Over, Real, V3, octaves};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

/// The distribution D for one roughness.
#[derive(Clone, Copy, Debug)]
pub struct Fibres<S> {
    /// (2 + 1/r) / 2π.
    pub norm: S,
    /// 0.5 / r: the exponent of sin².
    exponent: S,
}

impl<S: Real> Fibres<S> {
    /// Prepares D for the roughness `r` > 0.
    pub fn new(r: S) -> Self {
        let inv_r = S::one() / r;
        Fibres { norm: (S::c(2.0) + inv_r) * S::c(0.5 * FRAC_1_PI), exponent: S::c(0.5) * inv_r }
    }

    /// D of eq. 2 from cot²θh. sin²θ is 1/(1 + cot²θ): its logarithm keeps full precision for fibres lying flat,
    /// where exponents of 500 would blow up the rounding of sin² itself.
    #[inline(always)]
    pub fn d<L: Over<S>>(&self, cot2: L) -> L {
        L::lift(self.norm) * (-L::lift(self.exponent) * cot2.ln_1p()).exp()
    }
}

/// sin² of the angle between the half vector of `wo` and `wi` and the normal.
#[inline(always)]
pub(crate) fn half_sin2<L: Real>(wo: V3<L>, wi: V3<L>) -> L {
    let (along, across) = half_squares(wo, wi);
    across / (along + across).max(L::c(1e-30))
}

/// h·h for h = ωo + ωi, the part along the normal and the part across.
#[inline(always)]
fn half_squares<L: Real>(wo: V3<L>, wi: V3<L>) -> (L, L) {
    let h = wo + wi;
    (h.z * h.z, h.x.mul_add(h.x, h.y * h.y))
}

/// cot² of the angle between the half vector of `wo` and `wi` and the normal; huge where they coincide.
#[inline(always)]
pub fn half_cot2<L: Real>(wo: V3<L>, wi: V3<L>) -> L {
    let (along, across) = half_squares(wo, wi);
    (along / across.max(L::c(1e-30))).min(L::c(1e12))
}

/// The paper's fit of ln Λ, eq. 3: L(x) = a/(1 + b·x^c) + d·x + e below cos θ = ½ and mirrored above.
#[derive(Clone, Copy, Debug)]
pub struct FittedLambda<S> {
    a: S,
    b: S,
    c: S,
    d: S,
    e: S,
    /// 2·L(½).
    twice_l_half: S,
}

impl<S: Real> FittedLambda<S> {
    /// As published: rows blended by (1 − r)².
    pub fn published(r: S) -> Self {
        Self::blended((S::one() - r).sq())
    }

    /// The same rows with the weight 0.4387·(−ln r) − 0.2449·(1 − r), the least-squares match to the exact Λ over
    /// r in [0.02, 1]: ln Λ is off by 0.05 (rms) there where the published weight is off by 0.24.
    pub fn refitted(r: S) -> Self {
        Self::blended(S::c(-0.4387) * r.ln() - S::c(0.2449) * (S::one() - r))
    }

    fn blended(w: S) -> Self {
        // Table 1: rows for r = 0 and r = 1.
        const ROWS: [[f64; 2]; 5] =
            [[25.3245, 21.5473], [3.32435, 3.82987], [0.16801, 0.19823], [-1.27393, -1.97760], [-4.85967, -4.32054]];
        let [a, b, c, d, e] = ROWS.map(|[p0, p1]| w * S::c(p0) + (S::one() - w) * S::c(p1));
        let fit = FittedLambda { a, b, c, d, e, twice_l_half: S::zero() };
        FittedLambda { twice_l_half: S::c(2.0) * fit.l(S::c(0.5)), ..fit }
    }

    /// L(x) of eq. 3.
    #[inline(always)]
    fn l<L: Over<S>>(&self, x: L) -> L {
        let power = x.powf(L::lift(self.c));
        L::lift(self.a) / (L::one() + L::lift(self.b) * power) + L::lift(self.d).mul_add(x, L::lift(self.e))
    }

    /// ln Λ(μ), eq. 3.
    #[inline(always)]
    pub fn ln_lambda<L: Over<S>>(&self, cos: L) -> L {
        let low = cos.lt(L::c(0.5));
        let l = self.l(L::select(low, cos, L::one() - cos));
        L::select(low, l, L::lift(self.twice_l_half) - l)
    }

    /// Λ(μ), made softer at grazing angles by eq. 4: Λ^(1 + `soften`·(1 − μ)⁸), `soften` being 2, or 0 for none of it.
    #[inline(always)]
    pub fn lambda<L: Over<S>>(&self, cos: L, soften: S) -> L {
        let grazing = (L::one() - cos).sq().sq().sq();
        let softened = L::lift(soften).mul_add(grazing, L::one());
        (self.ln_lambda(cos) * softened).exp()
    }
}

/// D, Λ and the albedos of a fitted sheen as [`Cells`]: Λ toward a light as `soften` makes it. Within 5e-6 of the formulas
/// for the lowest roughness, 0.07, and 1e-6 from 0.13 on; `None` where the exponent of D is too large for cubics. Cosines
/// below `least` are read as that: the bound there covers them.
pub(crate) fn cells(
    (fibres, fit, soften): (&Fibres<f64>, &FittedLambda<f64>, f64),
    least: f64,
    view: &dyn Fn(f64) -> f64,
    bound: &dyn Fn(f64) -> f64,
) -> Option<Cells> {
    if fibres.exponent > 7.2 {
        return None;
    }
    let lowest = (1..=64).map(|k| bound(least * f64::from(k) / 64.0)).fold(0.0, f64::max);
    // A hair more, because single precision may round `least` up.
    let bound = |cos: f64| if cos > least * (1.0 + 1e-6) { bound(cos) } else { lowest };
    let light = |cubic: Vec<[f64; 4]>, square: Vec<[f64; 3]>| {
        cubic.into_iter().zip(square).map(|([a, b, c, d], [e, f, g])| [a, b, c, d, e, f, g, 0.0])
    };
    let toward_light = |cos: f64| fit.lambda(cos, soften);
    let low = light(octaves::fit::<32, 4>(toward_light), octaves::above::<32, 4>(bound, 2e-7));
    let high =
        light(octaves::fit::<32, 4>(|x| toward_light(1.0 - x)), octaves::above::<32, 4>(|x| bound(1.0 - x), 2e-7));
    let viewer = |lambda: Vec<[f64; 4]>, view: Vec<[f64; 4]>| {
        lambda.into_iter().zip(view).map(|([a, b, c, d], [e, f, g, h])| [a, b, c, d, e, f, g, h])
    };
    let plain = |cos: f64| fit.lambda(cos, 0.0);
    let near = viewer(octaves::fit::<32, 3>(plain), octaves::fit::<32, 3>(view));
    let far = viewer(octaves::fit::<32, 3>(|x| plain(1.0 - x)), octaves::fit::<32, 3>(|x| view(1.0 - x)));
    Some(Cells {
        half: octaves::table(octaves::fit::<64, 4>(|sin2| fibres.d(1.0 / sin2 - 1.0))),
        light: octaves::table(low.chain(high)),
        viewer: octaves::table(near.chain(far)),
    })
}

/// Which end a cosine is nearer to: Λ changes as powers do toward both.
#[inline(always)]
fn from_its_end<L: Real>(cos: L) -> L {
    L::select(cos.lt(L::c(0.5)), cos, -(L::one() - cos))
}

/// D at sin²θh from [`cells`]: a logarithm and an exponential less.
#[inline(always)]
pub(crate) fn read_d<L: Real>(cells: &Cells, sin2: L) -> Option<L> {
    let (row, t) = L::octaves::<64, 4, 1024, 4>(&cells.half, sin2)?;
    Some(octaves::cubic(row, t))
}

/// Λ toward a light, and the bound of the albedo there.
#[inline(always)]
pub(crate) fn read_light<L: Real>(cells: &Cells, cos: L) -> Option<(L, L)> {
    let ([a, b, c, d, e, f, g, _], t) = L::octaves::<32, 4, 1024, 8>(&cells.light, from_its_end(cos))?;
    Some((octaves::cubic([a, b, c, d], t), octaves::square([e, f, g], t)))
}

/// Λ toward the viewer, and the albedo seen from there.
#[inline(always)]
pub(crate) fn read_viewer<L: Real>(cells: &Cells, cos: L) -> Option<(L, L)> {
    let ([a, b, c, d, e, f, g, h], t) = L::octaves::<32, 3, 512, 8>(&cells.viewer, from_its_end(cos))?;
    Some((octaves::cubic([a, b, c, d], t), octaves::cubic([e, f, g, h], t)))
}

/// Narkowicz's G/(4·μo·μi) = 1/(4(μo + μi − μo·μi)), after Neubelt & Pettineo 2013.
#[inline(always)]
pub(super) fn visibility<L: Real>(cos_o: L, cos_i: L) -> L {
    L::c(0.25) / (cos_o + cos_i - cos_o * cos_i).max(L::c(1e-30))
}

/// The lowest roughness the series of the exact Λ covers.
pub const MIN_ROUGHNESS: f64 = 0.001;
/// Terms of the series over the cosine.
pub const COS_TERMS: usize = 28;
/// Terms of the series over the roughness.
pub const ROUGHNESS_TERMS: usize = 18;
/// Rows of a table over the roughness, equally spaced in ln r.
const ROWS: usize = 64;

/// Coefficients over the cosine for the roughness `r`: the double series summed over r.
pub fn terms_at(r: f64) -> [f64; COS_TERMS] {
    let y = roughness_coordinate(r);
    let (mut t0, mut t1) = (1.0, y);
    let mut row = [0.0; COS_TERMS];
    for terms in TERMS.as_chunks::<COS_TERMS>().0 {
        for (sum, term) in row.iter_mut().zip(terms) {
            *sum += t0 * term;
        }
        (t0, t1) = (t1, 2.0 * y * t1 - t0);
    }
    row
}

/// [`terms_at`] for rows over the whole range of roughness.
pub fn term_rows() -> Vec<f64> {
    let ln_r = |row: usize| MIN_ROUGHNESS.ln() * (1.0 - row as f64 / (ROWS - 1) as f64);
    (0..ROWS).flat_map(|row| terms_at(ln_r(row).exp())).collect()
}

/// ln r from [ln 0.001, 0] to [−1, 1].
pub fn roughness_coordinate(r: f64) -> f64 {
    (1.0 - 2.0 * r.ln() / MIN_ROUGHNESS.ln()).clamp(-1.0, 1.0)
}

/// The exact Smith Λ for one roughness. Its coefficients are handed to every call: one row of [`COS_TERMS`]
/// ([`terms_at`]) where the roughness is constant, else [`term_rows`].
#[derive(Clone, Copy, Debug)]
pub struct ExactLambda<S> {
    norm: S,
    /// c of the coordinate x = 2·v(1 + c)/(v + c) − 1, v = 1 − μ: 2.5·√r.
    stretch: S,
    /// a of the square root: (1/r + 1)·π/32.
    flatten: S,
    /// First of the four rows that are blended, and their weights.
    row: S,
    blend: [S; 4],
}

impl<S: Real> ExactLambda<S> {
    /// Prepares the roughness `r` in [0.001, 1].
    pub fn new(r: S) -> Self {
        let at = (S::one() - r.ln() * S::c(1.0 / MIN_ROUGHNESS.ln())) * S::c((ROWS - 1) as f64);
        let row = (at.floor() - S::one()).clamp(S::zero(), S::c((ROWS - 4) as f64));
        // Lagrange's cubic through the rows at 0, 1, 2, 3.
        let t = at - row;
        let [t0, t1, t2, t3] = [0.0, 1.0, 2.0, 3.0].map(|k| t - S::c(k));
        let blend = [
            t1 * t2 * t3 * S::c(-1.0 / 6.0),
            t0 * t2 * t3 * S::c(0.5),
            t0 * t1 * t3 * S::c(-0.5),
            t0 * t1 * t2 * S::c(1.0 / 6.0),
        ];
        ExactLambda {
            norm: Fibres::new(r).norm,
            stretch: S::c(STRETCH) * r.sqrt(),
            flatten: (S::one() / r + S::one()) * S::c(FLATTEN),
            row,
            blend,
        }
    }

    /// μ·Λ(μ), which stays finite at the horizon, from μ and sin²θ.
    #[inline(always)]
    pub fn cos_lambda<L: Over<S>>(&self, cos: L, sin2: L, terms: &[S::Entry]) -> L {
        if terms.len() < COS_TERMS {
            return L::zero();
        }
        let v = L::one() - cos;
        let c = L::lift(self.stretch);
        let x2 = L::c(4.0) * v * (L::one() + c) / (v + c) - L::c(2.0);
        // Clenshaw's recurrence.
        let (mut b1, mut b2) = (L::zero(), L::zero());
        for k in (1..COS_TERMS).rev() {
            (b1, b2) = (x2.mul_add(b1, self.term::<L>(terms, k)) - b2, b1);
        }
        let h = (L::c(0.5) * x2).mul_add(b1, self.term::<L>(terms, 0)) - b2;
        let root = L::lift(self.flatten).mul_add(sin2, L::one()).sqrt();
        L::lift(self.norm) * sin2 * h / root
    }

    #[inline(always)]
    fn term<L: Over<S>>(&self, terms: &[S::Entry], k: usize) -> L {
        if terms.len() == COS_TERMS {
            return L::lift(terms[k]);
        }
        let at = |row: usize| self.row.mul_add(S::c(COS_TERMS as f64), S::c((row * COS_TERMS + k) as f64));
        let sum = |sum: S, row: usize| self.blend[row].mul_add(S::gather(terms, at(row)), sum);
        L::lift([0, 1, 2, 3].into_iter().fold(S::zero(), sum))
    }
}

/// What [`ExactLambda`] and the fit of its coefficients share.
const STRETCH: f64 = 2.5;
const FLATTEN: f64 = PI / 32.0;

/// The cosine at the coordinate `x` in [−1, 1] of the series for the roughness `r`.
pub fn series_cosine(x: f64, r: f64) -> f64 {
    let (p, c) = (0.5 * (x + 1.0), STRETCH * r.sqrt());
    1.0 - p * c / (1.0 + c - p)
}

/// H(μ, r): what the series approximates.
pub fn series_target(cos: f64, r: f64, rule: &Rule) -> f64 {
    let sin2 = (1.0 - cos) * (1.0 + cos);
    projected_area(cos, r, rule) * ((1.0 / r + 1.0) * FLATTEN * sin2 + 1.0).sqrt()
}

/// Λ(μ) by quadrature: the reference.
///
/// The all-positive form of the projected area (after Heitz 2014): with x = cos θm and s² = 1 − μ²,
/// Λ = (2/μ) ∫₀ˢ [√(s² − x²) − μx·atan2(√(s² − x²), μx)] D(x) dx. `rule` is applied on panels graded toward both
/// ends; 20 nodes give 1e-13.
pub fn lambda_quadrature(cos: f64, r: f64, rule: &Rule) -> f64 {
    (1.0 - cos) * (1.0 + cos) / cos * Fibres::new(r).norm * projected_area(cos, r, rule)
}

/// The integral above with x = s·sin t, over s²·D(0).
fn projected_area(cos: f64, r: f64, rule: &Rule) -> f64 {
    let sin2 = (1.0 - cos) * (1.0 + cos);
    let lower = (1..=9).rev().map(|i| 0.5f64.powi(i));
    let upper = (2..=16).map(|i| 1.0 - 0.5f64.powi(i));
    let edges: Vec<f64> = [0.0].into_iter().chain(lower).chain(upper).chain([1.0]).collect();
    let mut sum = 0.0;
    for panel in edges.windows(2) {
        let width = panel[1] - panel[0];
        for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
            let (s, c) = ((panel[0] + width * node) * FRAC_PI_2).sin_cos();
            let d = (0.5 / r * (-sin2 * s * s).ln_1p()).exp();
            sum += weight * width * FRAC_PI_2 * c * (c - cos * s * c.atan2(cos * s)) * d;
        }
    }
    2.0 * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_off_cells_is_the_formula() {
        let close = |read: f32, truth: f64, relative: f64, what: &str| {
            assert!((f64::from(read) - truth).abs() <= relative * truth + 1e-6, "{what}: {read} for {truth}");
        };
        let (view, bound) = (|cos: f64| 0.1 + 0.8 * (1.0 - cos).powi(3), |cos: f64| (0.3f64).max(0.9 - 2.0 * cos));
        for r in [0.07, 0.2, 0.4, 1.0] {
            let fibres = Fibres::new(r);
            for (fit, soften) in [(FittedLambda::published(r), 2.0), (FittedLambda::refitted(r), 0.0)] {
                let cells = cells((&fibres, &fit, soften), 1e-4, &view, &bound).expect("its exponent is small");
                let mut cos = 1.0f32;
                while cos > 1e-4 {
                    for cos in [cos, 1.0 - cos * cos] {
                        let cos = cos.max(1e-4);
                        let (at, exact) = (format!("at {cos}, roughness {r}"), f64::from(cos));
                        let (lambda, albedo) = read_viewer(&cells, cos).expect("single precision");
                        close(lambda, fit.lambda(exact, 0.0), 2e-6, &at);
                        close(albedo, view(exact), 2e-6, &at);
                        let (lambda, most) = read_light(&cells, cos).expect("single precision");
                        close(lambda, fit.lambda(exact, soften), 5e-6, &at);
                        assert!(
                            (0.0..2e-3).contains(&(f64::from(most) - bound(exact))),
                            "{most} for {}, {at}",
                            bound(exact)
                        );
                    }
                    let truth = fibres.d(1.0 / f64::from(cos) - 1.0);
                    close(read_d(&cells, cos).expect("cubics"), truth, 6e-6, &format!("D at {cos}, roughness {r}"));
                    cos *= 0.97;
                }
            }
        }
        let fibres = Fibres::new(0.02);
        assert!(cells((&fibres, &FittedLambda::refitted(0.02), 0.0), 1e-4, &view, &bound).is_none());
    }
}
