//! What one tangent of a cloth reflects at most, whatever its parameters: for cloths whose parameters are known only
//! when shading, so that no table can be baked.
//!
//! In the notation of `cloth.rs`, M ≤ zo⁺·cos θi·h with h = (1 − u)·cos φi + u·min(cos φi, cos φo)/cos φo, and
//! Q(ωi) ≥ level·μi, level = 1 − a₁ − a₂ + Σ a·cos δ: offsets come in pairs ±δ, which together show at least 2·cos δ·μ.
//! Therefore
//!
//! E(ωo) = ∫ f·μi ≤ Σ a·zo⁺·R(θo) / (level·Q(ωo)), R(θo) = max over φo, η and the widths of ∫ S·h·cos θi dωi:
//!
//! a mean of R over what is seen of the tangents, over the level. R depends on the tangent alone, and the functions
//! below lie above it for every width from 1° up, every η from 1 to 3 and every direction; the test integrates it.

use crate::optics::Real;

/// Surface reflection; `head_on` is the reflectance at normal incidence, `cos` cos θo.
#[inline(always)]
pub fn surface<L: Real>(head_on: L, cos: L) -> L {
    let away = (L::one() - cos).clamp(L::zero(), L::one());
    let pole = away.sq().sq().sq().sq().sq().sq();
    let grazing = L::c(0.5).mul_add(away * away.sq() + pole, L::c(0.01));
    (L::one() - head_on).mul_add(grazing, L::c(0.48) * head_on)
}

/// Light from inside that stays in the cone.
#[inline(always)]
pub fn forward<L: Real>(head_on: L, cos: L) -> L {
    L::c(1.21) * (L::one() - head_on).sq() / cos.max(L::c(0.006))
}

/// Light from inside that leaves evenly.
#[inline(always)]
pub fn even<L: Real>(head_on: L, cos: L) -> L {
    L::c(1.21) * (L::one() - head_on).sq() / cos.max(L::c(0.035))
}

#[cfg(test)]
mod tests {
    use super::super::cylinder::{Around, Cylinder, Parts};
    use super::*;
    use crate::albedo::quadrature::Rule;
    use crate::optics::V3;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Cells of [−π/2, π/2]: about the ridge, and finer toward both ends.
    fn edges(ridge: f64, width: f64) -> Vec<f64> {
        let mut edges: Vec<f64> = (-8..=8).map(|k| ridge + width * f64::from(k)).collect();
        for k in 0..14 {
            let length = FRAC_PI_2 * 0.55f64.powi(k);
            edges.extend([FRAC_PI_2 - length, length - FRAC_PI_2]);
        }
        edges.iter_mut().for_each(|e| *e = e.clamp(-FRAC_PI_2, FRAC_PI_2));
        edges.extend([-FRAC_PI_2, FRAC_PI_2]);
        edges.sort_by(f64::total_cmp);
        edges
    }

    /// ∫ S·h·cos θi dωi over the tangent's own upper hemisphere.
    fn reflected(thread: &Cylinder<f64>, theta: f64, phi: f64, width: f64) -> [f64; 3] {
        let rule = Rule::gauss_legendre(5);
        let place = |theta: f64, phi: f64| {
            let ((s, c), (y, z)) = (theta.sin_cos(), phi.sin_cos());
            Around::new(V3::new(s, c * y, c * z))
        };
        let o = place(theta, phi);
        let mut turns = Vec::new();
        for (a, b) in [(-FRAC_PI_2, phi), (phi, FRAC_PI_2)] {
            for k in 0..4 {
                let (a, length) = (a + (b - a) * f64::from(k) / 4.0, (b - a) / 4.0);
                turns.extend(rule.nodes.iter().zip(&rule.weights).map(|(u, w)| (a + length * u, w * length)));
            }
        }
        let mut sums = [0.0; 3];
        for e in edges(-theta, width).windows(2).filter(|e| e[1] - e[0] > 1e-12) {
            for (u, w) in rule.nodes.iter().zip(&rule.weights) {
                let theta = e[0] + (e[1] - e[0]) * u;
                for (turn, v) in &turns {
                    let i = place(theta, *turn);
                    let correlated = (-0.5 / (20.0 * PI / 180.0f64).powi(2) * o.turn(i)).exp();
                    let seen = (1.0 - correlated) * i.pz + correlated * i.pz.min(o.pz) / o.pz;
                    let Parts { surface, forward, even } = thread.parts(o, i);
                    let weight = w * (e[1] - e[0]) * v * seen * i.cos * i.cos;
                    for (sum, part) in sums.iter_mut().zip([surface, forward, even]) {
                        *sum += weight * part;
                    }
                }
            }
        }
        sums
    }

    #[test]
    fn no_tangent_reflects_more() {
        let cosines = [1.0f64, 0.9, 0.7, 0.5, 0.35, 0.25, 0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.003, 1e-3, 1e-5, 1e-8];
        let mut tightest = [f64::INFINITY; 3];
        for (eta, cos) in [1.0f64, 1.01, 1.05, 1.2, 1.5, 2.0, 3.0].iter().flat_map(|e| cosines.map(|c| (*e, c))) {
            let head_on = ((eta - 1.0) / (eta + 1.0)).powi(2);
            let bound = [surface(head_on, cos), forward(head_on, cos), even(head_on, cos)];
            for width in [1.0f64, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 95.0] {
                let thread = Cylinder::new(eta, width, width, 0.0);
                for phi in [0.0f64, 30.0, 60.0, 75.0, 85.0, 89.0, 89.99] {
                    let r = reflected(&thread, cos.acos(), phi.to_radians(), 2.0 * width.to_radians());
                    for c in 0..3 {
                        assert!(
                            r[c] <= bound[c],
                            "{c}: {} above {} at η {eta}, {width}°, {cos}, {phi}°",
                            r[c],
                            bound[c]
                        );
                        tightest[c] = tightest[c].min(bound[c] / r[c]);
                    }
                }
            }
        }
        println!("bounds over what is reflected, at the tightest: {tightest:?}");
        assert!(tightest.iter().all(|t| *t < 1.1), "needlessly wide: {tightest:?}");
    }
}
