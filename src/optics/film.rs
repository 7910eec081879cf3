//! A thin film on a metal or on glass: the exact sum of all reflections between its two faces (Airy 1833), unpolarised.
//!
//! With r₁₂, r₂₃ the amplitudes at either face and β = 2π·n₂·d·cos θ₂/λ, R = |r₁₂ + r₂₃·e^{2iβ}|²/|1 + r₁₂·r₂₃·e^{2iβ}|². Each
//! channel is the mean over three wavelengths about its own, which lets the fringes of thick films fade as they do for a broad
//! band. R ≤ 1 whatever the film.

use super::Real;
use std::f64::consts::TAU;

/// The middle of each channel, in nanometres.
const WAVELENGTHS: [f64; 3] = [630.0, 532.0, 465.0];
/// Wavelengths of a channel over its middle, and their weights.
const BAND: [(f64, f64); 3] = [(0.94, 0.25), (1.0, 0.5), (1.06, 0.25)];

/// A film: thickness in nanometres, index at least 1.
#[derive(Clone, Copy, Debug)]
pub struct Film<L> {
    /// In nanometres.
    pub thickness: L,
    /// Index of refraction.
    pub ior: L,
}

#[derive(Clone, Copy)]
struct Complex<L>(L, L);

impl<L: Real> Complex<L> {
    fn times(self, o: Self) -> Self {
        Complex(self.0 * o.0 - self.1 * o.1, self.0 * o.1 + self.1 * o.0)
    }

    fn plus(self, x: L) -> Self {
        Complex(self.0 + x, self.1)
    }

    fn norm(self) -> L {
        self.0.mul_add(self.0, self.1 * self.1)
    }

    fn over(self, o: Self) -> Self {
        let inv = L::one() / o.norm().max(L::c(1e-30));
        let Complex(re, im) = self.times(Complex(o.0, -o.1));
        Complex(re * inv, im * inv)
    }
}

/// Reflectance at the cosine `c` of a metal with index n + i·k under a film, for `channel` 0, 1, 2.
#[inline(always)]
pub fn metal<L: Real>(film: Film<L>, n: L, k: L, c: L, channel: usize) -> L {
    let c = c.clamp(L::c(1e-6), L::one());
    let n2 = film.ior.max(L::one());
    // cos²θ₂ without the difference 1 − sin²θ/n₂², which leaves nothing of a grazing cosine where n₂ is 1.
    let c2 = c.mul_add(c, (n2 - L::one()) * (n2 + L::one())).safe_sqrt() / n2;
    // q = N·cos θ₃ = √(N² − sin²θ), its parts without the difference that cancels.
    let square = Complex(n * n - k * k, L::c(2.0) * n * k);
    // As in `fresnel::conductor`: c² is not lost where n is next to 1.
    let real = (n - L::one()).mul_add(n + L::one(), c * c) - k * k;
    let modulus = real.mul_add(real, square.1.sq()).safe_sqrt();
    let large = L::c(0.5) * (modulus + real.abs());
    let small = L::c(0.25) * square.1.sq() / large.max(L::c(1e-30));
    let up = real.ge(L::zero());
    let q = Complex(L::select(up, large, small).safe_sqrt(), L::select(up, small, large).safe_sqrt());
    let outer = [(c - n2 * c2) / (c + n2 * c2), (c2 - n2 * c) / (c2 + n2 * c)];
    let (a, b) = (n2 * c2, Complex(q.0 * n2, q.1 * n2));
    // The differences a − q and n₂·q − N²·cos θ₂ as those of squares over the sums: nothing cancels where N is next to n₂.
    let lack = Complex((n2 - n).mul_add(n2 + n, k * k), -square.1);
    let sum_s = q.plus(a);
    let inner_s = lack.over(sum_s.times(sum_s));
    let sum_p = Complex(b.0 + square.0 * c2, b.1 + square.1 * c2);
    let t2 = (L::one() - c) * (L::one() + c) / (n2 * n2);
    let turn = Complex(square.0.mul_add(L::one() - t2, -(t2 * n2 * n2)), square.1 * (L::one() - t2));
    let inner_p = lack.times(turn).over(sum_p.times(sum_p));
    let path = L::c(2.0) * n2 * film.thickness * c2;
    let mut sum = L::zero();
    for (ratio, weight) in BAND {
        let (sin, cos) = phase(path, ratio, channel);
        for (outer, inner) in outer.into_iter().zip([inner_s, inner_p]) {
            let back = inner.times(Complex(cos, sin));
            let under = Complex(back.0 * outer, back.1 * outer).plus(L::one());
            sum = (back.plus(outer).norm() / under.norm().max(L::c(1e-30))).mul_add(L::c(0.5 * weight), sum);
        }
    }
    sum.clamp(L::zero(), L::one())
}

/// What passes into glass of index n under a film, 1 − R: the product of what passes its two faces over the same sum, so
/// that it keeps its digits where nearly all is reflected. 0 where all is.
#[inline(always)]
pub fn passed<L: Real>(film: Film<L>, n: L, c: L, channel: usize) -> L {
    let one = L::one();
    let c = c.clamp(L::c(1e-6), one);
    let n2 = film.ior.max(one);
    let c2 = c.mul_add(c, (n2 - one) * (n2 + one)).safe_sqrt() / n2;
    // n·cos θ₃; none where the light is totally reflected.
    let q = c.mul_add(c, (n - one) * (n + one)).safe_sqrt();
    // The admittances at both faces, for either polarisation: r₁₂ = (x − y)/(x + y), r₂₃ = (u − v)/(u + v).
    let a = n2 * c2;
    let faces = [(c, a, a, q), (c2, n2 * c, n2 * q, n * n * c2)];
    let path = L::c(2.0) * a * film.thickness;
    let mut sum = L::zero();
    for (ratio, weight) in BAND {
        let cos = phase(path, ratio, channel).1;
        for (x, y, u, v) in faces {
            let (straight, back) = ((x + y) * (u + v), (x - y) * (u - v));
            let all = straight.mul_add(straight, back * back) + L::c(2.0) * straight * back * cos;
            sum = (x * y * u * v / all.max(L::c(1e-30))).mul_add(L::c(8.0 * weight), sum);
        }
    }
    sum.clamp(L::zero(), one)
}

/// Sine and cosine of the phase that one way to the far face and back adds, for the wavelength at `ratio` of a channel's own;
/// `path` is its optical length in nanometres.
#[inline(always)]
fn phase<L: Real>(path: L, ratio: f64, channel: usize) -> (L, L) {
    let turns = path * L::c(1.0 / (ratio * WAVELENGTHS[channel]));
    ((turns - turns.floor()) * L::c(TAU)).sin_cos()
}

#[cfg(test)]
mod tests {
    use super::super::fresnel;
    use super::*;

    #[test]
    fn a_film_of_no_thickness_is_no_film() {
        for (n, k) in [(0.2, 3.4), (1.5, 0.0), (2.9, 3.0)] {
            for c in [1.0, 0.6, 0.1, 1e-3] {
                let bare = fresnel::conductor(n, k, c);
                for ior in [1.0, 1.4, 2.2] {
                    let seen = metal(Film { thickness: 0.0f64, ior }, n, k, c, 1);
                    assert!((seen - bare).abs() < 1e-9, "{n} {k} {c} {ior}: {seen} for {bare}");
                }
                let air = metal(Film { thickness: 700.0f64, ior: 1.0 }, n, k, c, 0);
                assert!((air - bare).abs() < 1e-9, "{air} for {bare}");
            }
        }
    }

    #[test]
    fn a_quarter_wave_quenches_reflection() {
        // n₂ = √n₃ at a quarter of the wavelength: black in the middle of the band, so at most what its edges leave.
        let film = Film { thickness: 532.0 / (4.0 * 1.5), ior: 1.5f64 };
        let (quenched, bare) = (metal(film, 2.25, 0.0, 1.0, 1), fresnel::conductor(2.25, 0.0, 1.0));
        assert!(quenched < 0.005 && bare > 0.14, "{quenched} {bare}");
    }

    #[test]
    fn what_glass_does_not_reflect_passes() {
        for i in 0..4000u32 {
            let t = |m: u32| f64::from(i * m % 997) / 997.0;
            let film = Film { thickness: 2000.0 * t(13), ior: 1.0 + 2.0 * t(29) };
            let (n, c) = (0.3 + 3.0 * t(37), t(53).powi(3));
            let (back, on) = (metal(film, n, 0.0, c, 1), passed(film, n, c, 1));
            assert!((back + on - 1.0).abs() < 1e-9, "{film:?} {n} {c}: {back} and {on}");
            let narrow = Film { thickness: film.thickness as f32, ior: film.ior as f32 };
            let seen = f64::from(passed(narrow, n as f32, c as f32, 1));
            // Next to the critical angle what passes has a root's slope, and thick films turn fast with the angle.
            let edge = (c * c + (n - 1.0) * (n + 1.0)).abs() < 1e-3;
            assert!(edge || (seen - on).abs() < 2e-3 * on + 1e-6, "{film:?} {n} {c}: {seen} for {on}");
        }
    }

    #[test]
    fn single_precision_follows_and_nothing_exceeds_one() {
        for i in 0..4000u32 {
            let t = |m: u32| f64::from(i * m % 997) / 997.0;
            let film = Film { thickness: 2000.0 * t(13), ior: 1.0 + 2.0 * t(29) };
            let (n, k, c) = (0.05 + 4.0 * t(37), 6.0 * t(41), t(53));
            let truth = metal(film, n, k, c, 2);
            let narrow = Film { thickness: film.thickness as f32, ior: film.ior as f32 };
            let seen = metal(narrow, n as f32, k as f32, c as f32, 2);
            assert!((0.0..=1.0).contains(&truth), "{truth}");
            assert!((f64::from(seen) - truth).abs() < 2e-4, "{film:?} {n} {k} {c}: {seen} for {truth}");
        }
    }
}
