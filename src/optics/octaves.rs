//! Functions of one number in (0, 1) as cubics, their cell read off the bits of the number: for functions that change as
//! powers do, evenly over each octave.
//!
//! Of `OCTAVES` octaves below 1 each is cut into 2^`DIGITS` cells; what lies below them reads as their lowest number. A
//! second half of the table, if there is one, is for negative numbers. Tables have `CELLS` rows, a power of two, so that
//! no cell can be beyond them: reading them takes no look at their length. Functions that are read at the same place share a
//! row. Cubics are within (p/2^(`DIGITS` + 1))⁴/190 of x^p, p a few, and with the rounding of single precision within 2e-7
//! more: as good as the function is there. For single precision alone.
// Only cloths are read off them.
#![cfg_attr(not(feature = "cloth"), allow(dead_code))]

use super::elementary::{Bits, Single};
use super::real::Real;

/// The lowest number that has a cell of its own, as bits.
const fn lowest(octaves: u32) -> u32 {
    (127 - octaves) << 23
}

/// The highest number below 1.
const HIGHEST: f32 = 1.0f32.next_down();

/// The cell of `x`, |x| ≤ 1, and where it lies in it, in [−1, 1].
#[inline(always)]
pub fn place<const OCTAVES: u32, const DIGITS: i32, R: Single>(x: R) -> (R::Bits, R) {
    let (low, word) = (lowest(OCTAVES), R::Bits::of);
    let size = x.abs().max(R::from_f32(f32::from_bits(low)));
    // 1 itself is read at the end of the last cell.
    let bits = size.min(R::from_f32(HIGHEST)).to_bits();
    // 23 − `DIGITS` bits lie below a cell's.
    let cell = match DIGITS {
        3 => bits.minus(word(low)).down::<20>(),
        _ => bits.minus(word(low)).down::<19>(),
    };
    let half = x.to_bits().down_signed::<31>().and(word(OCTAVES << DIGITS));
    // The digits below the cell's, as a number in [1, 2).
    let rest = R::from_bits(bits.up::<DIGITS>().and(word(0x007f_ffff)).or(word(0x3f80_0000)));
    (cell.plus(half), rest * R::from_f32(2.0) - R::from_f32(3.0))
}

/// a + b·t + c·t² + d·t³.
#[inline(always)]
pub fn cubic<R: Real>([a, b, c, d]: [R; 4], t: R) -> R {
    (d * t + c) * (t * t) + (b * t + a)
}

/// a + b·t + c·t².
#[inline(always)]
pub fn square<R: Real>([a, b, c]: [R; 3], t: R) -> R {
    (c * t + b) * t + a
}

/// The ends of every cell over (0, 1), upward.
fn cells<const OCTAVES: u32, const DIGITS: i32>() -> impl Iterator<Item = (f64, f64)> {
    (0..OCTAVES << DIGITS).map(|cell| {
        let (octave, part) = (cell >> DIGITS, cell & ((1 << DIGITS) - 1));
        let unit = (f64::from(octave) - f64::from(OCTAVES)).exp2();
        let width = 1.0 / f64::from(1 << DIGITS);
        (unit * (1.0 + width * f64::from(part)), unit * (1.0 + width * f64::from(part + 1)))
    })
}

/// The cubics of `f` over (0, 1), through its values at Chebyshev's nodes of each cell.
pub fn fit<const OCTAVES: u32, const DIGITS: i32>(f: impl Fn(f64) -> f64) -> Vec<[f64; 4]> {
    let node = |k: usize| ((2 * k + 1) as f64 * std::f64::consts::PI / 8.0).cos();
    let cubic = |(low, high): (f64, f64)| {
        // Coefficients over Chebyshev's polynomials, then over powers.
        let values: [f64; 4] = std::array::from_fn(|k| f(0.5 * (low + high) + 0.5 * (high - low) * node(k)));
        let c: [f64; 4] = std::array::from_fn(|j| {
            let angle = |k: usize| (j * (2 * k + 1)) as f64 * std::f64::consts::PI / 8.0;
            let sum: f64 = (0..4).map(|k| values[k] * angle(k).cos()).sum();
            sum * if j == 0 { 0.25 } else { 0.5 }
        });
        [c[0] - c[2], c[1] - 3.0 * c[3], 2.0 * c[2], 4.0 * c[3]]
    };
    cells::<OCTAVES, DIGITS>().map(cubic).collect()
}

/// Squares that nowhere lie below `f`, which may have kinks: through its values at the ends and in the middle of each
/// cell, lifted by what they lack at many places in between and by `margin`.
pub fn above<const OCTAVES: u32, const DIGITS: i32>(f: impl Fn(f64) -> f64, margin: f64) -> Vec<[f64; 3]> {
    const PLACES: usize = 32;
    let square = |(low, high): (f64, f64)| {
        let at = |t: f64| f(0.5 * (low + high) + 0.5 * (high - low) * t);
        let (first, middle, last) = (at(-1.0), at(0.0), at(1.0));
        let [a, b, c] = [middle, 0.5 * (last - first), 0.5 * (first + last) - middle];
        let places = (0..=PLACES).map(|k| 2.0 * k as f64 / PLACES as f64 - 1.0);
        // A kink between two places shows at the nearer one with half its height.
        let lack = places.map(|t| at(t) - ((c * t + b) * t + a)).fold(0.0, f64::max);
        [a + 2.0 * lack + margin, b, c]
    };
    cells::<OCTAVES, DIGITS>().map(square).collect()
}

/// Rows as a table of them; what is missing is 0.
pub fn table<const WIDTH: usize, const CELLS: usize>(
    rows: impl IntoIterator<Item = [f64; WIDTH]>,
) -> Box<[[f32; WIDTH]; CELLS]> {
    let mut table = Box::new([[0.0; WIDTH]; CELLS]);
    for (entry, row) in table.iter_mut().zip(rows) {
        *entry = row.map(|x| x as f32);
    }
    table
}

#[cfg(feature = "cloth")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{F32x8, Real};

    fn read<const CELLS: usize>(table: &[[f32; 4]; CELLS], x: f32) -> f32 {
        let (row, t) = <f32 as Real>::octaves::<32, 4, CELLS, 4>(table, x).expect("single precision");
        let (rows, ts) = F32x8::octaves::<32, 4, CELLS, 4>(table, F32x8([x; 8])).expect("single precision");
        let value = cubic(row, t);
        assert_eq!(cubic(rows, ts).0, [value; 8]);
        value
    }

    #[test]
    fn powers_are_as_good_as_single_precision() {
        for p in [0.2, 1.0, 3.5] {
            let up = fit::<32, 4>(|x| x.powf(p));
            assert_eq!(read::<512>(&table(up.clone()), 0.5), 0.5f32.powf(p as f32));
            let both = table(up.into_iter().chain(fit::<32, 4>(|x| 3.0 - x)));
            let close = 2e-7 + (p / 32.0f64).powi(4) / 190.0;
            let mut x = 1.0f32;
            while x > 1e-7 {
                let truth = f64::from(x).powf(p);
                let ours = f64::from(read::<1024>(&both, x));
                assert!((ours / truth - 1.0).abs() < close, "{x}^{p}: {ours} for {truth}");
                assert!((read::<1024>(&both, -x) + x - 3.0).abs() < 5e-7, "{x}");
                x *= 0.9993;
            }
        }
    }

    #[test]
    fn what_is_to_lie_above_does() {
        let kinked = |x: f64| x.powf(0.3).min(0.7 + 0.1 * x) + (40.0 * x).sin().abs() * 1e-3;
        let rows = table::<4, 512>(above::<32, 4>(kinked, 1e-6).into_iter().map(|[a, b, c]| [a, b, c, 0.0]));
        let (mut x, mut most) = (1.0f32, 0.0f64);
        while x > 1e-9 {
            let over = f64::from(read(&rows, x)) - kinked(x.into());
            assert!(over > 0.0, "{over} at {x}");
            most = most.max(over);
            x *= 0.9997;
        }
        assert!(most < 2e-3, "{most}");
    }

    #[test]
    fn whatever_is_looked_up_there_is_a_number() {
        let rows = table::<4, 512>(fit::<32, 4>(f64::sqrt));
        for odd in [0.0, -0.0, -1.0, f32::NAN, 1.0, 2.0, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE] {
            assert!(read(&rows, odd).is_finite(), "{odd}");
        }
    }
}
