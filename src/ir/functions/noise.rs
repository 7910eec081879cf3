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

use crate::optics::dispatch::{Work, widest};

/// Names by their number.
pub const KINDS: &[&str] = &["uperlin", "noise", "perlin", "snoise", "cell", "hash", "simplex", "usimplex"];

/// Coordinates of `L` points.
#[derive(Clone, Copy, Debug)]
pub struct At<const L: usize> {
    /// Unused dimensions at the end.
    pub x: [[f32; L]; 4],
    /// How many dimensions count.
    pub n: usize,
    /// Whole numbers after which the noise repeats; 0 means never.
    pub period: [[f32; L]; 4],
}

/// Noise of the kind numbered `kind` in [`KINDS`], at each point what it is at that point alone; `channel` tells the
/// components of a triple apart.
pub fn noise<const L: usize>(kind: usize, at: &At<L>, channel: u32) -> [f32; L] {
    if at.x[..at.n].iter().flatten().any(|x| !x.is_finite()) {
        // The others are not to notice.
        return if L == 1 { [0.0; L] } else { at.each(|one| noise(kind, one, channel)) };
    }
    let half = |mut x: [f32; L]| {
        x.iter_mut().for_each(|x| *x = 0.5 + 0.5 * *x);
        x
    };
    match kind {
        2 | 3 => perlin(at, channel),
        4 => at.each(|one| [unit(hash(&one.cells(), at.n, channel))]),
        5 => at.each(|one| [unit(hash(&one.x.map(|x| (x[0] + 0.0).to_bits()), at.n, channel))]),
        6 => at.each(|one| simplex(one, channel)),
        7 => half(at.each(|one| simplex(one, channel))),
        _ => half(perlin(at, channel)),
    }
}

/// The cells around a coordinate, and how far it lies above the lower one.
type Around<const L: usize> = ([[u32; L]; 2], [f32; L]);

impl<const L: usize> At<L> {
    /// Point by point.
    fn each(&self, f: impl Fn(&At<1>) -> [f32; 1]) -> [f32; L] {
        std::array::from_fn(|l| {
            let one = |values: &[[f32; L]; 4]| values.map(|x| [x[l]]);
            f(&At { x: one(&self.x), n: self.n, period: one(&self.period) })[0]
        })
    }

    /// The cells around coordinate `d`, and how far it lies above the lower one.
    #[inline(always)]
    fn around(&self, d: usize) -> Around<L> {
        let (mut cells, mut above) = ([[0; L]; 2], [0.0; L]);
        let x = &self.x[d];
        let odd = |l: usize| self.period[d][l] >= 1.0 || x[l].abs() >= 2_147_483_648.0;
        let any_odd = (0..L).fold(false, |any, l| any | odd(l));
        for l in 0..L {
            // `floor` is a call where the processor has no instruction for it; a conversion never is.
            let whole = x[l] as i32;
            let below = i32::from(whole as f32 > x[l]);
            let cell = whole.wrapping_sub(below) as u32;
            (cells[0][l], cells[1][l]) = (cell, cell.wrapping_add(1));
            above[l] = x[l] - (whole as f32 - below as f32);
        }
        if any_odd {
            for l in (0..L).filter(|l| odd(*l)) {
                let floor = x[l].floor();
                let period = self.period[d][l];
                (cells[0][l], cells[1][l]) = (wrapped(floor, period), wrapped(floor + 1.0, period));
                above[l] = x[l] - floor;
            }
        }
        (cells, above)
    }
}

impl At<1> {
    /// The cell of each coordinate within the period.
    fn cells(&self) -> [u32; 4] {
        std::array::from_fn(|d| self.wrapped(self.x[d][0].floor(), d))
    }

    fn wrapped(&self, cell: f32, d: usize) -> u32 {
        wrapped(cell, self.period[d][0])
    }
}

fn wrapped(cell: f32, period: f32) -> u32 {
    let period = period.floor();
    let cell = if period >= 1.0 { cell - period * (cell / period).floor() } else { cell };
    // Through i64, so that far cells wrap round instead of piling up at the end.
    cell as i64 as u32
}

/// Mixes up to four words (Jenkins' one-at-a-time, with a final avalanche).
#[inline(always)]
fn hash(words: &[u32; 4], n: usize, channel: u32) -> u32 {
    let mut h = seed(n, channel);
    for word in &words[..n] {
        h = h.wrapping_add(*word);
        h = h.wrapping_add(h << 10);
        h ^= h >> 6;
        h = h.wrapping_mul(0x85eb_ca6b);
    }
    avalanche(h)
}

/// Lets every bit change about half of all bits (Wellons, lowbias32).
#[inline(always)]
pub(super) fn avalanche(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ h >> 16
}

/// What coordinate `d` of a lattice point adds to its hash. A point's is the avalanche of the sum of these and of
/// [`seed`]: one product per coordinate, not per corner, and corners hash side by side. (A sum, because an exclusive or
/// gives mirrored cells the same hash.)
#[inline(always)]
pub(super) const fn share_of(cell: u32, d: usize) -> u32 {
    const ODD: [u32; 4] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d, 0x27d4_eb2f];
    cell.wrapping_mul(ODD[d])
}

/// Tells components of a triple and numbers of dimensions apart.
#[inline(always)]
pub(super) const fn seed(n: usize, channel: u32) -> u32 {
    0x9e37_79b9u32.wrapping_mul(channel.wrapping_add(n as u32 * 8 + 1))
}

/// The hash of an int, for `hash()`.
pub fn hash_int(words: [u32; 4], n: usize) -> u32 {
    hash(&words, n, 77) & 0x7fff_ffff
}

/// A hash as a number in [0, 1).
fn unit(h: u32) -> f32 {
    (h >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// `x`, negated if the top bit of `h` is set.
#[inline(always)]
fn signed(x: f32, h: u32) -> f32 {
    f32::from_bits(x.to_bits() ^ (h & 0x8000_0000))
}

/// The dot product of a hashed gradient with an offset. Choices are selections, not branches, so that corners can be
/// worked out side by side.
#[inline(always)]
pub(super) fn gradient<const N: usize>(h: u32, [x, y, z, w]: [f32; 4]) -> f32 {
    let choose = |first: bool, a: f32, b: f32| if first { a } else { b };
    let choice = h & 0xffff;
    // By a mask: where there is no instruction to select floats, a selection of single ones would be a branch after all,
    // and one that nothing foretells.
    let below = |limit: u32, a: f32, b: f32| {
        let mask = (choice.wrapping_sub(limit) as i32 >> 31) as u32;
        f32::from_bits(a.to_bits() & mask | b.to_bits() & !mask)
    };
    match N {
        // Slopes ±1/8 to ±1.
        1 => signed((1 + (h & 7)) as f32 * 0.125 * x, h),
        // The eight compass points.
        2 => {
            let (a, b) = (signed(x, h), signed(y, h << 1));
            let straight = choose(choice & 2 == 0, a, b);
            choose(choice & 1 == 0, straight, (a + b) * std::f32::consts::FRAC_1_SQRT_2)
        }
        // Toward the middles of a cube's edges: all but one coordinate ±1.
        3 => {
            let (a, b) = (below(21_845, y, x), below(43_690, z, y));
            signed(a, h) + signed(b, h << 1)
        }
        _ => {
            let (a, b) = (below(0x4000, y, x), below(0x8000, z, y));
            let c = below(0xc000, w, z);
            signed(a, h) + signed(b, h << 1) + signed(c, h << 2)
        }
    }
}

/// Gradient noise, which [`widest`] compiles.
struct Perlin<'a, const L: usize> {
    at: &'a At<L>,
    channel: u32,
}

impl<const L: usize> Work for Perlin<'_, L> {
    type Output = [f32; L];

    #[inline(always)]
    fn run(self) -> [f32; L] {
        // One body per dimension: its loops are of known length then, which is most of the speed.
        match self.at.n {
            1 => self.lattice::<1>(),
            2 => self.lattice::<2>(),
            3 => self.lattice::<3>(),
            _ => self.lattice::<4>(),
        }
    }
}

impl<const L: usize> Perlin<'_, L> {
    #[inline(always)]
    fn lattice<const N: usize>(&self) -> [f32; L] {
        let mut around = [([[0; L]; 2], [0.0; L]); N];
        for d in 0..N {
            around[d] = self.at.around(d);
        }
        lattice(around, self.channel)
    }
}

fn perlin<const L: usize>(at: &At<L>, channel: u32) -> [f32; L] {
    let perlin = Perlin { at, channel };
    // A single point fills no vector.
    if L > 1 { widest(perlin) } else { perlin.run() }
}

/// Gradient noise between lattice points, given the cells around each coordinate and how far it lies above the lower.
#[inline(always)]
fn lattice<const N: usize, const L: usize>(around: [Around<L>; N], channel: u32) -> [f32; L] {
    // Along each coordinate: what the two cells add to the hash, the offsets from them, the share of the upper one.
    let (mut shares, mut offsets, mut fade) = ([[[0u32; L]; 2]; N], [[[0.0f32; L]; 2]; 4], [[0.0f32; L]; N]);
    for d in 0..N {
        let (cells, t) = around[d];
        for l in 0..L {
            let t = t[l];
            (shares[d][0][l], shares[d][1][l]) = (share_of(cells[0][l], d), share_of(cells[1][l], d));
            (offsets[d][0][l], offsets[d][1][l]) = (t, t - 1.0);
            fade[d][l] = faded(t);
        }
    }
    // Bit d of a corner's number is its step along coordinate d.
    let seed = seed(N, channel);
    let (mut hashes, mut values) = ([[0u32; L]; 16], [[0.0f32; L]; 16]);
    for corner in 0..1 << N {
        for l in 0..L {
            hashes[corner][l] = avalanche((0..N).fold(seed, |h, d| h.wrapping_add(shares[d][corner >> d & 1][l])));
        }
    }
    for corner in 0..1 << N {
        for l in 0..L {
            let offset = std::array::from_fn(|d| offsets[d][corner >> d & 1][l]);
            values[corner][l] = gradient::<N>(hashes[corner][l], offset);
        }
    }
    for d in (0..N).rev() {
        for k in 0..1 << d {
            for l in 0..L {
                values[k][l] += fade[d][l] * (values[k + (1 << d)][l] - values[k][l]);
            }
        }
    }
    let mut out = values[0];
    out.iter_mut().for_each(|x| *x = in_range::<N>(*x));
    out
}

/// How much of the upper cell's a point gets that lies `t` above the lower.
#[inline(always)]
pub(super) fn faded(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Brings the greatest to ±1: at the middle of a cell all corners' gradients may agree.
#[inline(always)]
pub(super) fn in_range<const N: usize>(x: f32) -> f32 {
    let largest = [0.5, std::f32::consts::FRAC_1_SQRT_2, 1.0, 1.5][N - 1];
    (x / largest).clamp(-1.0, 1.0)
}

fn simplex(at: &At<1>, channel: u32) -> [f32; 1] {
    match at.n {
        1 => simplex_in::<1>(at, channel),
        2 => simplex_in::<2>(at, channel),
        3 => simplex_in::<3>(at, channel),
        _ => simplex_in::<4>(at, channel),
    }
}

fn simplex_in<const N: usize>(at: &At<1>, channel: u32) -> [f32; 1] {
    let nf = N as f32;
    // Skew to a grid of cubes whose simplices are regular; back again with `unskew`.
    let skew = ((nf + 1.0).sqrt() - 1.0) / nf;
    let unskew = (1.0 - 1.0 / (nf + 1.0).sqrt()) / nf;
    let slant: f32 = at.x[..N].iter().map(|x| x[0]).sum::<f32>() * skew;
    let cell: [f32; N] = std::array::from_fn(|d| (at.x[d][0] + slant).floor());
    let back: f32 = cell.iter().sum::<f32>() * unskew;
    let first: [f32; N] = std::array::from_fn(|d| at.x[d][0] - (cell[d] - back));
    // The corners of the simplex: from the cell's corner along the coordinates, the largest first.
    let mut order: [usize; N] = std::array::from_fn(|d| d);
    order.sort_by(|a, b| first[*b].total_cmp(&first[*a]));
    let mut step = [0.0f32; N];
    let mut sum = 0.0;
    for corner in 0..=N {
        if corner > 0 {
            step[order[corner - 1]] = 1.0;
        }
        let offset: [f32; 4] =
            std::array::from_fn(|d| if d < N { first[d] - step[d] + corner as f32 * unskew } else { 0.0 });
        let falloff = 0.5 - offset.iter().map(|x| x * x).sum::<f32>();
        if falloff > 0.0 {
            let share = |d: usize| share_of(at.wrapped(cell[d] + step[d], d), d);
            let h = (0..N).fold(seed(N, channel), |h, d| h.wrapping_add(share(d)));
            sum += falloff.powi(4) * gradient::<N>(avalanche(h), offset);
        }
    }
    let largest = [0.0231, 0.0143, 0.0137, 0.0159][N - 1];
    [(sum / largest).clamp(-1.0, 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(kind: usize, at: &At<1>, channel: u32) -> f32 {
        super::noise(kind, at, channel)[0]
    }

    fn points(n: usize) -> impl Iterator<Item = At<1>> {
        (0..40_000u32).map(move |k| {
            let x = std::array::from_fn(|d| [unit(hash(&[k, d as u32, 5, 0], 3, 1)) * 40.0 - 20.0]);
            At { x, n, period: [[0.0]; 4] }
        })
    }

    #[test]
    fn ranges_are_used_and_kept() {
        for n in 1..=4 {
            for (kind, name) in KINDS.iter().enumerate() {
                // Far apart, so that cells are many.
                let far = |at: At<1>| At { x: at.x.map(|x| [x[0] * 97.0]), ..at };
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
                    let step = At { x: at.x.map(|x| [x[0] + 1e-3]), ..at };
                    let jump = (noise(kind, &at, 0) - noise(kind, &step, 0)).abs();
                    assert!(jump < 0.04, "{n} {kind}: {jump} at {:?}", at.x);
                }
            }
            for at in points(n).take(200) {
                let grid = At { x: at.x.map(|x| [x[0].round()]), ..at };
                assert_eq!(noise(2, &grid, 0), 0.0);
            }
        }
    }

    #[test]
    fn periods_repeat_and_channels_differ() {
        for n in 1..=4 {
            let mut apart = 0;
            for at in points(n).take(500) {
                let at =
                    At { x: at.x.map(|x| [(x[0] * 16.0).round() / 16.0]), period: [[3.0], [4.0], [5.0], [7.0]], ..at };
                let next = At { x: std::array::from_fn(|d| [at.x[d][0] + at.period[d][0]]), ..at };
                for kind in [0, 2, 4] {
                    assert!((noise(kind, &at, 0) - noise(kind, &next, 0)).abs() < 1e-5);
                }
                apart += usize::from(noise(4, &at, 0) != noise(4, &at, 1));
            }
            assert!(apart > 490);
        }
    }

    #[test]
    fn lattice_hashes_are_even_and_neighbours_independent() {
        // Sixteen classes of 4096 each over a block of cells, and pairs of neighbours along each coordinate.
        let class = |x: u32, y: u32, z: u32| {
            let h = [x, y, z].iter().enumerate().fold(seed(3, 0), |h, (d, cell)| h.wrapping_add(share_of(*cell, d)));
            let h = avalanche(h);
            (h >> 30 | (h & 3) << 2) as usize
        };
        let mut counts = [0u32; 16];
        let mut pairs = [[0u32; 256]; 3];
        let cells = (0..40u32).flat_map(|x| (0..40u32).flat_map(move |y| (0..40u32).map(move |z| [x, y, z])));
        for cell in cells.map(|cell| cell.map(|c| c.wrapping_sub(20))) {
            let here = class(cell[0], cell[1], cell[2]);
            counts[here] += 1;
            for (d, pairs) in pairs.iter_mut().enumerate() {
                let mut next = cell;
                next[d] = next[d].wrapping_add(1);
                pairs[here * 16 + class(next[0], next[1], next[2])] += 1;
            }
        }
        let chi2 = |counts: &[u32]| {
            let expected = 64_000.0 / counts.len() as f64;
            counts.iter().map(|n| (f64::from(*n) - expected).powi(2) / expected).sum::<f64>()
        };
        // The one in ten thousand quantiles for 15 and 255 degrees of freedom.
        assert!(chi2(&counts) < 44.3, "{}", chi2(&counts));
        for pairs in &pairs {
            assert!(chi2(pairs) < 347.7, "{}", chi2(pairs));
        }
    }

    #[test]
    fn far_and_odd_coordinates_are_answered() {
        for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, -1e30, 1e-40, -0.0, 3e9] {
            for (kind, _) in KINDS.iter().enumerate() {
                for period in [0.0, 1.0, f32::NAN, f32::INFINITY, -3.0] {
                    for n in 1..=4 {
                        let value = noise(kind, &At { x: [[x]; 4], n, period: [[period]; 4] }, 2);
                        assert!((-1.0..=1.0).contains(&value), "{kind} {x} {period}: {value}");
                    }
                }
            }
        }
    }

    #[test]
    fn side_by_side_is_one_by_one() {
        let odd = [f32::NAN, f32::INFINITY, -1e30, 3e9, -0.0, 0.0, 5.0, -7.25];
        for n in 1..=4 {
            let ones: Vec<At<1>> = points(n).take(64).collect();
            for (k, eight) in ones.chunks(8).enumerate() {
                let mut at = At::<8> {
                    x: std::array::from_fn(|d| std::array::from_fn(|l| eight[l].x[d][0])),
                    n,
                    period: std::array::from_fn(|d| std::array::from_fn(|l| ((k + d) * l % 3) as f32)),
                };
                // From the fourth group on a lane or all of them are odd.
                (0..8).filter(|l| k > 6 || k == l + 4).for_each(|l| at.x[n - 1][l] = odd[l]);
                for kind in 0..KINDS.len() {
                    let found = super::noise(kind, &at, 1).map(f32::to_bits);
                    let alone = at.each(|one| super::noise(kind, one, 1)).map(f32::to_bits);
                    assert_eq!(found, alone, "{kind} {n} {:?}", at.x);
                }
            }
        }
    }
}
