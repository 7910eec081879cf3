//! A function of one number in (0, 1) as cubics, its cell read off the bits of the number: for functions that change as
//! powers do, evenly over each octave.
//!
//! Cells are the eighths of octaves from 2⁻²⁴ up to 1; what lies below reads as 2⁻²⁴. For x^0.2 the cubics are within
//! 1e-7 relatively, and with the rounding of single precision within 2.5e-7: as good as the function is there. For
//! single precision alone.

/// Octaves below 1.
const OCTAVES: u32 = 24;
/// Binary digits after the leading one that tell cells of an octave apart.
const DIGITS: u32 = 3;
/// How many cubics there are.
pub const CELLS: usize = (OCTAVES << DIGITS) as usize;
/// The lowest number that has a cell of its own, as bits.
const LOWEST: u32 = (127 - OCTAVES) << 23;

/// The cell of `x`, and where it lies in it, in [−1, 1].
#[inline(always)]
pub fn place(x: f32) -> (u32, f32) {
    let x = if x > f32::from_bits(LOWEST) { x } else { f32::from_bits(LOWEST) };
    let bits = x.to_bits();
    let cell = (bits - LOWEST) >> (23 - DIGITS);
    // The digits below the cell's, as a number in [1, 2).
    let rest = f32::from_bits(((bits << DIGITS) & 0x007f_ffff) | 0x3f80_0000);
    (cell, rest * 2.0 - 3.0)
}

/// a + b·t + c·t² + d·t³.
#[inline(always)]
pub fn cubic([a, b, c, d]: [f32; 4], t: f32) -> f32 {
    (d * t + c) * (t * t) + (b * t + a)
}

/// The cubics of `f`, four coefficients per cell, through its values at Chebyshev's nodes.
pub fn fit(f: impl Fn(f64) -> f64) -> Vec<f64> {
    let node = |k: usize| ((2 * k + 1) as f64 * std::f64::consts::PI / 8.0).cos();
    let cells = (0..CELLS).map(|cell| {
        let (octave, part) = (cell >> DIGITS, cell & ((1 << DIGITS) - 1));
        let unit = (octave as f64 - OCTAVES as f64).exp2();
        let eighth = 1.0 / (1 << DIGITS) as f64;
        let at = |t: f64| f(unit * (1.0 + eighth * (part as f64 + 0.5 + 0.5 * t)));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{F32x8, Lift};

    #[test]
    fn powers_are_as_good_as_single_precision() {
        let table: Vec<f32> = fit(|x| x.powf(0.2)).into_iter().map(|c| c as f32).collect();
        let mut x = 0.999_999_9f32;
        while x > 1e-7 {
            let truth = f64::from(x).powf(0.2);
            let ours = <f32 as Lift<f32>>::octaves(&table, x).expect("a table");
            assert!((f64::from(ours) / truth - 1.0).abs() < 2.5e-7, "{x}: {ours} for {truth}");
            let lanes = F32x8::octaves(&table, F32x8([x; 8])).expect("a table");
            assert_eq!(lanes.0, [ours; 8]);
            x *= 0.9993;
        }
        assert!(<f32 as Lift<f32>>::octaves(&[], 0.5).is_none());
        for odd in [0.0, -1.0, f32::NAN, 1.0, 2.0, f32::INFINITY] {
            assert!(<f32 as Lift<f32>>::octaves(&table, odd).is_some_and(f32::is_finite), "{odd}");
        }
    }
}
