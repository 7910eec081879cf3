//! Noise of one to four dimensions. The functions are ours: the same kinds, ranges and periods as in OSL, other values.
//!
//! | name | kind | range |
//! |---|---|---|
//! | `perlin`, `snoise` | gradient noise (Perlin 2002) with hashed gradients | −1 to 1, 0 at whole coordinates |
//! | `uperlin`, `noise` | half of that plus a half | 0 to 1 |
//! | `simplex`, `usimplex` | gradient noise over simplices (Perlin 2001) | as above |
//! | `cell` | one number per unit cell | 0 to 1 |
//! | `hash` | one number per coordinate | 0 to 1 |
//!
//! A coordinate that is not finite gives 0; beyond 2³¹ cells repeat.

/// Names by their number.
pub const KINDS: &[&str] = &["uperlin", "noise", "perlin", "snoise", "cell", "hash", "simplex", "usimplex"];

/// A coordinate.
#[derive(Clone, Copy, Debug)]
pub struct At {
    /// Unused dimensions at the end.
    pub x: [f32; 4],
    /// How many dimensions count.
    pub n: usize,
    /// Whole numbers after which the noise repeats; 0 means never.
    pub period: [f32; 4],
}

/// Noise of the kind numbered `kind` in [`KINDS`]; `channel` tells the components of a triple apart.
pub fn noise(kind: usize, at: &At, channel: u32) -> f32 {
    if at.x[..at.n].iter().any(|x| !x.is_finite()) {
        return 0.0;
    }
    let half = |x: f32| 0.5 + 0.5 * x;
    match KINDS.get(kind).copied().unwrap_or("uperlin") {
        "perlin" | "snoise" => perlin(at, channel),
        "cell" => unit(hash(&at.cells(|x| x), at.n, channel)),
        "hash" => unit(hash(&at.x.map(|x| (x + 0.0).to_bits()), at.n, channel)),
        "simplex" => simplex(at, channel),
        "usimplex" => half(simplex(at, channel)),
        _ => half(perlin(at, channel)),
    }
}

impl At {
    /// The cell of each coordinate, after `step`, within the period.
    fn cells(&self, step: impl Fn(f32) -> f32) -> [u32; 4] {
        std::array::from_fn(|d| self.wrapped(step(self.x[d]).floor(), d))
    }

    fn wrapped(&self, cell: f32, d: usize) -> u32 {
        let period = self.period[d].floor();
        let cell = if period >= 1.0 { cell - period * (cell / period).floor() } else { cell };
        // Through i64, so that far cells wrap round instead of piling up at the end.
        cell as i64 as u32
    }
}

/// Mixes up to four words (Jenkins' one-at-a-time, with a final avalanche).
fn hash(words: &[u32; 4], n: usize, channel: u32) -> u32 {
    let mut h = 0x9e37_79b9u32.wrapping_mul(channel.wrapping_add(n as u32 * 8 + 1));
    for word in &words[..n] {
        h = h.wrapping_add(*word);
        h = h.wrapping_add(h << 10);
        h ^= h >> 6;
        h = h.wrapping_mul(0x85eb_ca6b);
    }
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ h >> 16
}

/// The hash of an int, for `hash()`.
pub fn hash_int(words: [u32; 4], n: usize) -> u32 {
    hash(&words, n, 77) & 0x7fff_ffff
}

/// A hash as a number in [0, 1).
fn unit(h: u32) -> f32 {
    (h >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The dot product of a hashed gradient with an offset.
fn gradient(h: u32, x: &[f32; 4], n: usize) -> f32 {
    if n == 1 {
        // Slopes ±1/8 to ±1.
        let slope = (1 + (h & 7)) as f32 * 0.125;
        return if h & 8 == 0 { slope * x[0] } else { -slope * x[0] };
    }
    if n == 2 {
        // The eight compass points.
        let turn = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]][(h & 3) as usize];
        let diagonal = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]][(h & 3) as usize];
        let g = if h & 4 == 0 { turn } else { diagonal.map(|d: f32| d * std::f32::consts::FRAC_1_SQRT_2) };
        return g[0] * x[0] + g[1] * x[1];
    }
    // Toward the middles of a cube's edges: all but one coordinate ±1.
    let skip = (h % n as u32) as usize;
    let signs = h / n as u32;
    (0..n).filter(|d| *d != skip).map(|d| if signs >> d & 1 == 0 { x[d] } else { -x[d] }).sum()
}

/// What brings each dimension's gradient noise to ±1: one over the largest value any gradients give.
fn perlin(at: &At, channel: u32) -> f32 {
    let n = at.n;
    let floor = at.x.map(f32::floor);
    let offset: [f32; 4] = std::array::from_fn(|d| at.x[d] - floor[d]);
    let fade = offset.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let mut sum = 0.0;
    for corner in 0..1u32 << n {
        let step = |d: usize| (corner >> d & 1) as f32;
        let cell = std::array::from_fn(|d| at.wrapped(floor[d] + step(d), d));
        let toward = std::array::from_fn(|d| offset[d] - step(d));
        let share: f32 = (0..n).map(|d| if step(d) == 1.0 { fade[d] } else { 1.0 - fade[d] }).product();
        sum += share * gradient(hash(&cell, n, channel), &toward, n);
    }
    // At the middle of a cell all corners' gradients may agree; the largest such sum is known per dimension.
    let largest = [0.5, std::f32::consts::FRAC_1_SQRT_2, 1.0, 1.5][n - 1];
    (sum / largest).clamp(-1.0, 1.0)
}

fn simplex(at: &At, channel: u32) -> f32 {
    let n = at.n;
    let nf = n as f32;
    // Skew to a grid of cubes whose simplices are regular; back again with `unskew`.
    let skew = ((nf + 1.0).sqrt() - 1.0) / nf;
    let unskew = (1.0 - 1.0 / (nf + 1.0).sqrt()) / nf;
    let slant: f32 = at.x[..n].iter().sum::<f32>() * skew;
    let cell: [f32; 4] = std::array::from_fn(|d| (at.x[d] + slant).floor());
    let back: f32 = cell[..n].iter().sum::<f32>() * unskew;
    let first: [f32; 4] = std::array::from_fn(|d| at.x[d] - (cell[d] - back));
    // The corners of the simplex: from the cell's corner along the coordinates, the largest first.
    let mut order: [usize; 4] = [0, 1, 2, 3];
    order[..n].sort_by(|a, b| first[*b].total_cmp(&first[*a]));
    let mut step = [0.0f32; 4];
    let mut sum = 0.0;
    for corner in 0..=n {
        if corner > 0 {
            step[order[corner - 1]] = 1.0;
        }
        let offset: [f32; 4] = std::array::from_fn(|d| first[d] - step[d] + corner as f32 * unskew);
        let falloff = 0.5 - offset[..n].iter().map(|x| x * x).sum::<f32>();
        if falloff > 0.0 {
            let corner = std::array::from_fn(|d| at.wrapped(cell[d] + step[d], d));
            sum += falloff.powi(4) * gradient(hash(&corner, n, channel), &offset, n);
        }
    }
    let largest = [0.0231, 0.0143, 0.0137, 0.0159][n - 1];
    (sum / largest).clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(n: usize) -> impl Iterator<Item = At> {
        (0..40_000u32).map(move |k| {
            let x = std::array::from_fn(|d| unit(hash(&[k, d as u32, 5, 0], 3, 1)) * 40.0 - 20.0);
            At { x, n, period: [0.0; 4] }
        })
    }

    #[test]
    fn ranges_are_used_and_kept() {
        for n in 1..=4 {
            for (kind, name) in KINDS.iter().enumerate() {
                // Far apart, so that cells are many.
                let far = |at: At| At { x: at.x.map(|x| x * 97.0), ..at };
                let values: Vec<f32> = points(n).map(|at| noise(kind, &far(at), 0)).collect();
                let (lo, hi) = values.iter().fold((9f32, -9f32), |(l, h), v| (l.min(*v), h.max(*v)));
                let mean = values.iter().sum::<f32>() / values.len() as f32;
                let signed = matches!(*name, "perlin" | "snoise" | "simplex");
                let (floor, middle) = if signed { (-1.0, 0.0) } else { (0.0, 0.5) };
                assert!(lo >= floor && hi <= 1.0, "{name} {n}: {lo} {hi}");
                assert!((mean - middle).abs() < 0.02, "{name} {n}: mean {mean}");
                // Neither wasted nor clipped away.
                let spread = (hi - lo) / (1.0 - floor);
                assert!(spread > 0.6, "{name} {n}: {lo} {hi}");
                let at_ends = values.iter().filter(|v| **v == floor || **v == 1.0).count();
                assert!(at_ends < 40, "{name} {n}: {at_ends} clipped");
            }
        }
    }

    #[test]
    fn gradient_noise_is_smooth_and_vanishes_on_the_grid() {
        for n in 1..=4 {
            for kind in [2, 6] {
                for at in points(n).take(4000) {
                    let step = At { x: at.x.map(|x| x + 1e-3), ..at };
                    let jump = (noise(kind, &at, 0) - noise(kind, &step, 0)).abs();
                    assert!(jump < 0.04, "{n} {kind}: {jump} at {:?}", at.x);
                }
            }
            for at in points(n).take(200) {
                let grid = At { x: at.x.map(f32::round), ..at };
                assert_eq!(noise(2, &grid, 0), 0.0);
            }
        }
    }

    #[test]
    fn periods_repeat_and_channels_differ() {
        for n in 1..=4 {
            let mut apart = 0;
            for at in points(n).take(500) {
                let at = At { x: at.x.map(|x| (x * 16.0).round() / 16.0), period: [3.0, 4.0, 5.0, 7.0], ..at };
                let next = At { x: std::array::from_fn(|d| at.x[d] + at.period[d]), ..at };
                for kind in [0, 2, 4] {
                    assert!((noise(kind, &at, 0) - noise(kind, &next, 0)).abs() < 1e-5);
                }
                apart += usize::from(noise(4, &at, 0) != noise(4, &at, 1));
            }
            assert!(apart > 490);
        }
    }

    #[test]
    fn far_and_odd_coordinates_are_answered() {
        for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, -1e30, 1e-40, -0.0, 3e9] {
            for (kind, _) in KINDS.iter().enumerate() {
                for period in [0.0, 1.0, f32::NAN, f32::INFINITY, -3.0] {
                    for n in 1..=4 {
                        let value = noise(kind, &At { x: [x; 4], n, period: [period; 4] }, 2);
                        assert!((-1.0..=1.0).contains(&value), "{kind} {x} {period}: {value}");
                    }
                }
            }
        }
    }
}
