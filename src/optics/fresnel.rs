//! How much a smooth surface reflects: dielectrics, conductors, and Schlick's curve. Unpolarised light.

use super::Real;

/// Reflectance of a dielectric surface at cosine `c`; `m` is η² − 1, η the far side's index over the near side's.
/// Negative `m` is light leaving the denser side: beyond the critical angle all of it is reflected.
#[inline(always)]
pub fn dielectric<L: Real>(m: L, c: L) -> L {
    let c = c.clamp(L::zero(), L::one());
    dielectric_at(m, c, c.mul_add(c, m))
}

/// [`dielectric`] where g² = c² + m is known better than from c: next to the critical angle, where it is 0, the
/// reflectance has a root's slope.
///
/// g − c is written as m/(g + c): the difference itself has no digits left for η near 1.
#[inline(always)]
pub fn dielectric_at<L: Real>(m: L, c: L, g2: L) -> L {
    let g = g2.safe_sqrt();
    let sum = (g + c).max(L::c(1e-12));
    let difference = m / sum;
    let ratio = (c * sum - L::one()) / (c * difference + L::one());
    let part = (L::c(0.5) * (difference / sum).sq() * ratio.mul_add(ratio, L::one())).min(L::one());
    L::select(g2.le(L::zero()), L::one(), part)
}

/// Reflectance of a conductor with index n + i·k against the outside, at cosine `c` (Born & Wolf, §14.2).
#[inline(always)]
pub fn conductor<L: Real>(n: L, k: L, c: L) -> L {
    let c = c.clamp(L::zero(), L::one());
    let (c2, n2, k2) = (c * c, n * n, k * k);
    let s2 = L::one() - c2;
    // a² + b² = |N² − sin²|, a the real part of its root. Not n² − k² − sin²: next to n = 1 that leaves nothing of c².
    let real = (n - L::one()).mul_add(n + L::one(), c2) - k2;
    let product = L::c(4.0) * n2 * k2;
    let modulus = real.mul_add(real, product).safe_sqrt();
    let half = L::c(0.5);
    // Of real ± modulus only the sum of equal signs is formed.
    let large = half * (modulus + real.abs());
    let small = half * half * product / large.max(L::c(1e-30));
    let up = real.ge(L::zero());
    let a = L::select(up, large, small).safe_sqrt();
    let b2 = L::select(up, small, large).max(L::zero());
    // As squares: next to n = 1 their sums less twice the product would leave no digits.
    let (s, p) = (ratio(a, c, b2), ratio(a * c, s2, b2 * c2));
    (half * s * (L::one() + p)).clamp(L::zero(), L::one())
}

/// ((x − y)² + rest) / ((x + y)² + rest).
#[inline(always)]
fn ratio<L: Real>(x: L, y: L, rest: L) -> L {
    ((x - y).sq() + rest) / ((x + y).sq() + rest).max(L::c(1e-30))
}

/// n and k of a conductor that reflects `r` (in [0, 0.99]) at normal incidence; `g` in [0, 1] tints its edge: 1 keeps
/// the color, 0 lets it whiten late (Gulbrandsen 2014, eq. 7-9).
#[inline(always)]
pub fn artistic<L: Real>(r: L, g: L) -> (L, L) {
    let r = r.clamp(L::zero(), L::c(0.99));
    let g = g.clamp(L::zero(), L::one());
    let one = L::one();
    let (low, root) = ((one - r) / (one + r), r.sqrt());
    let high = (one + root) / (one - root);
    let n = (low - high).mul_add(g, high);
    let k2 = ((n + one).sq() * r - (n - one).sq()) / (one - r);
    (n, k2.safe_sqrt())
}

/// [`artistic`] per channel.
pub fn artistic_ior(reflectivity: [f32; 3], edge_tint: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let pairs: [(f64, f64); 3] = std::array::from_fn(|c| artistic(f64::from(reflectivity[c]), f64::from(edge_tint[c])));
    (pairs.map(|p| p.0 as f32), pairs.map(|p| p.1 as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_conductor_without_extinction_is_a_dielectric() {
        for n in [1.05, 1.5, 4.0] {
            for c in [0.0, 1e-3, 0.1, 0.5, 0.9, 1.0] {
                let (metal, glass) = (conductor(n, 0.0, c), dielectric(n * n - 1.0, c));
                assert!((metal - glass).abs() < 1e-12f64, "n {n} c {c}: {metal} for {glass}");
            }
        }
    }

    #[test]
    fn reflectance_is_the_same_from_both_sides() {
        for (n, sin) in [(1.5f64, 0.3f64), (1.33, 0.74), (2.4, 0.1)] {
            let (outside, inside) = ((1.0 - sin * sin).sqrt(), (1.0 - (sin / n).powi(2)).sqrt());
            let (a, b) = (dielectric(n * n - 1.0, outside), dielectric(1.0 / (n * n) - 1.0, inside));
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert_eq!(dielectric(1.0 / 2.25 - 1.0, 0.7f64), 1.0, "total reflection");
    }

    #[test]
    fn gold_reflects_what_it_was_asked_to() {
        for r in [0.04f64, 0.4, 0.9] {
            for g in [0.0, 0.5, 1.0] {
                let (n, k) = artistic(r, g);
                assert!((conductor(n, k, 1.0) - r).abs() < 1e-12, "r {r} g {g}");
                assert_eq!(conductor(n, k, 0.0), 1.0);
            }
        }
    }
}
