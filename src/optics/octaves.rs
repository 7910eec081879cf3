//! A function of one number in (0, 1) as cubics, its cell read off the bits of the number: for functions that change as
//! powers do, evenly over each octave.
//!
//! Of `OCTAVES` octaves below 1 each is cut into 2^`DIGITS` cells; what lies below them reads as their lowest number. A
//! second half of the table, if there is one, is for negative numbers. Tables have `CELLS` cubics, a power of two, so that
//! no cell can be beyond them: reading them takes no look at their length. Cubics are within (p/2^(`DIGITS` + 1))⁴/190 of
//! x^p, p a few, and with the rounding of single precision within 2e-7 more: as good as the function is there. For
//! single precision alone.

/// The lowest number that has a cell of its own, as bits.
const fn lowest(octaves: u32) -> u32 {
    (127 - octaves) << 23
}

/// The highest number below 1.
const HIGHEST: f32 = 1.0f32.next_down();

/// The cubics in `table`; `None` if it is no table of this kind.
#[inline(always)]
pub fn cubics<const CELLS: usize>(table: &[f32]) -> Option<&[[f32; 4]; CELLS]> {
    table.as_chunks().0.try_into().ok()
}

/// The cell of `x`, |x| ≤ 1, and where it lies in it, in [−1, 1].
#[inline(always)]
pub fn place<const OCTAVES: u32, const DIGITS: u32>(x: f32) -> (u32, f32) {
    let low = f32::from_bits(lowest(OCTAVES));
    let size = if x.abs() > low { x.abs() } else { low };
    // 1 itself is read at the end of the last cell.
    let bits = if size < HIGHEST { size } else { HIGHEST }.to_bits();
    let half = (x.to_bits() >> 31) * (OCTAVES << DIGITS);
    let cell = ((bits - lowest(OCTAVES)) >> (23 - DIGITS)) + half;
    // The digits below the cell's, as a number in [1, 2).
    let rest = f32::from_bits(((bits << DIGITS) & 0x007f_ffff) | 0x3f80_0000);
    (cell, rest * 2.0 - 3.0)
}

/// a + b·t + c·t² + d·t³.
#[inline(always)]
pub fn cubic([a, b, c, d]: [f32; 4], t: f32) -> f32 {
    (d * t + c) * (t * t) + (b * t + a)
}

/// The cubics of `f` over (0, 1), four coefficients per cell, through its values at Chebyshev's nodes.
#[cfg(feature = "cloth")]
pub fn fit<const OCTAVES: u32, const DIGITS: u32>(f: impl Fn(f64) -> f64) -> Vec<f64> {
    let node = |k: usize| ((2 * k + 1) as f64 * std::f64::consts::PI / 8.0).cos();
    let cells = (0..OCTAVES << DIGITS).map(|cell| {
        let (octave, part) = (cell >> DIGITS, cell & ((1 << DIGITS) - 1));
        let unit = (octave as f64 - OCTAVES as f64).exp2();
        let width = 1.0 / (1 << DIGITS) as f64;
        let at = |t: f64| f(unit * (1.0 + width * (part as f64 + 0.5 + 0.5 * t)));
        // Coefficients over Chebyshev's polynomials, then over powers.
        let values: [f64; 4] = std::array::from_fn(|k| at(node(k)));
        let c: [f64; 4] = std::array::from_fn(|j| {
            let angle = |k: usize| (j * (2 * k + 1)) as f64 * std::f64::consts::PI / 8.0;
            let sum: f64 = (0..4).map(|k| values[k] * angle(k).cos()).sum();
            sum * if j == 0 { 0.25 } else { 0.5 }
        });
        [c[0] - c[2], c[1] - 3.0 * c[3], 2.0 * c[2], 4.0 * c[3]]
    });
    cells.flatten().collect()
}

#[cfg(feature = "cloth")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{F32x8, Lift};

    fn read<const CELLS: usize>(table: &[f32], x: f32) -> f32 {
        let value = <f32 as Lift<f32>>::octaves::<32, 4, CELLS>(table, x).expect("a table");
        let lanes = F32x8::octaves::<32, 4, CELLS>(table, F32x8([x; 8])).expect("a table");
        assert_eq!(lanes.0, [value; 8]);
        value
    }

    #[test]
    fn powers_are_as_good_as_single_precision() {
        for p in [0.2, 1.0, 3.5] {
            let mut table: Vec<f32> = fit::<32, 4>(|x| x.powf(p)).into_iter().map(|c| c as f32).collect();
            assert_eq!(read::<512>(&table, 0.5), 0.5f32.powf(p as f32));
            table.extend(fit::<32, 4>(|x| 3.0 - x).into_iter().map(|c| c as f32));
            let close = 2e-7 + (p / 32.0f64).powi(4) / 190.0;
            let mut x = 1.0f32;
            while x > 1e-7 {
                let truth = f64::from(x).powf(p);
                let ours = f64::from(read::<1024>(&table, x));
                assert!((ours / truth - 1.0).abs() < close, "{x}^{p}: {ours} for {truth}");
                assert!((read::<1024>(&table, -x) + x - 3.0).abs() < 5e-7, "{x}");
                x *= 0.9993;
            }
        }
    }

    #[test]
    fn whatever_is_looked_up_there_is_a_number() {
        let table: Vec<f32> = fit::<32, 4>(f64::sqrt).into_iter().map(|c| c as f32).collect();
        assert!(<f32 as Lift<f32>>::octaves::<32, 4, 512>(&[], 0.5).is_none());
        assert!(<f32 as Lift<f32>>::octaves::<32, 4, 1024>(&table, 0.5).is_none());
        for odd in [0.0, -0.0, -1.0, f32::NAN, 1.0, 2.0, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE] {
            assert!(read::<512>(&table, odd).is_finite(), "{odd}");
        }
    }
}
