//! Gradient noise at one point: what [`noise`](super::noise::noise) gives, bit for bit, where it is worked out fastest.
//!
//! The corners of the cell go side by side, in vectors as wide as the processor has. What is read as one vector was written
//! as one: otherwise it waits until all its pieces have got to memory, about as long as the noise itself takes.

use super::noise::{avalanche, faded, gradient, in_range, seed, share_of};
use crate::optics::dispatch::{Work, widest};

/// Coordinates whose cells [`near`] finds are smaller than this.
const NEAR: f32 = 4_194_304.0;

/// Whether [`near`] will do for a point.
#[inline(always)]
pub fn is_near<const N: usize>(kind: usize, x: &[f32; N]) -> bool {
    kind < 4 && x.iter().fold(true, |near, x| near & (x.abs() < NEAR))
}

/// Noise of channel 0 where [`is_near`] says so and nothing repeats.
#[inline(always)]
pub fn near<const N: usize>(kind: usize, x: [f32; N]) -> f32 {
    let value = match N {
        // Two corners fill no vector.
        1 => between::<N, 2>((&Corners::new(x)).run()),
        2 => between::<N, 4>(widest(&Corners::new(x))),
        3 => between::<N, 8>(widest(&Corners::new(x))),
        _ => between::<N, 16>(widest(&Corners::new(x))),
    };
    if kind < 2 { 0.5 + 0.5 * value } else { value }
}

/// A point and the `C` corners of its cell. Aligned, so that no vector lies across two lines of the cache.
#[repr(C, align(32))]
struct Corners<const N: usize, const C: usize> {
    /// The lower corner.
    cell: [u32; 4],
    /// How far the point lies above it.
    above: [f32; 4],
    steps: &'static Steps<C>,
}

/// What each corner's gradient gives, and how far to go from lower to upper corners: along coordinate d in the 2^d places from
/// 2^d on, once for each pair.
#[repr(C, align(32))]
struct Values<const C: usize>([f32; C], [f32; C]);

/// From the lower corner to each. By a table that stays one: a compiler that knows where steps are 0 leaves them out there,
/// and as corners are no longer alike there are no vectors.
#[repr(align(32))]
struct Steps<const C: usize> {
    /// What it adds to the hash, with the seed.
    share: [u32; C],
    length: [[f32; C]; 4],
}

impl<const C: usize> Steps<C> {
    const fn new<const N: usize>() -> Self {
        let mut steps = Steps { share: [seed(N, 0); C], length: [[0.0; C]; 4] };
        let mut k = 0;
        while k < N * C {
            // Bit d of a corner's number is its step along coordinate d.
            let (corner, d) = (k / N, k % N);
            let step = (corner >> d & 1) as u32;
            steps.share[corner] = steps.share[corner].wrapping_add(share_of(step, d));
            steps.length[d][corner] = step as f32;
            k += 1;
        }
        steps
    }
}

impl<const N: usize, const C: usize> Corners<N, C> {
    const STEPS: &'static Steps<C> = &Steps::new::<N>();

    #[inline(always)]
    fn new(x: [f32; N]) -> Self {
        let mut corners = Corners { cell: [0; 4], above: [0.0; 4], steps: Self::STEPS };
        for d in 0..4 {
            // Any number where there is no coordinate, so that all four are worked out in one vector.
            let x = if d < N { x[d] } else { x[d % N].abs() };
            (corners.cell[d], corners.above[d]) = around_near(x);
        }
        corners
    }
}

impl<const N: usize, const C: usize> Work for &Corners<N, C> {
    type Output = Values<C>;

    #[inline(always)]
    fn run(self) -> Values<C> {
        let (above, steps) = (self.above, self.steps);
        let (mut values, mut fade) = ([0.0; C], [0.0; C]);
        for k in 0..C {
            fade[k] = faded(above[k.max(1).ilog2() as usize]);
        }
        let cell = (0..N).fold(0u32, |h, d| h.wrapping_add(share_of(self.cell[d], d)));
        for corner in 0..C {
            let mut offset = [0.0; 4];
            for d in 0..N {
                offset[d] = above[d] - steps.length[d][corner];
            }
            values[corner] = gradient::<N>(avalanche(cell.wrapping_add(steps.share[corner])), offset);
        }
        Values(values, fade)
    }
}

/// From corners to the point.
#[inline(always)]
fn between<const N: usize, const C: usize>(Values(mut values, fade): Values<C>) -> f32 {
    for d in (0..N).rev() {
        for k in 0..1 << d {
            values[k] += fade[k + (1 << d)] * (values[k + (1 << d)] - values[k]);
        }
    }
    in_range::<N>(values[0])
}

/// The cell of a near coordinate and how far it lies above that, by additions alone.
#[inline(always)]
fn around_near(x: f32) -> (u32, f32) {
    // In the middle of the floats whose last bit is worth 1: adding it rounds, and the bits of the sum count.
    const WHOLE: f32 = 12_582_912.0;
    let sum = x + WHOLE;
    let rest = x - (sum - WHOLE);
    // All bits if that rounded up. (-0 is no less than the whole number it rounds to.)
    let up = ((rest + 0.0).to_bits() as i32 >> 31) as u32;
    let cell = sum.to_bits().wrapping_sub(WHOLE.to_bits()).wrapping_add(up);
    (cell, rest - f32::from_bits(up & (-1f32).to_bits()))
}

#[cfg(test)]
mod tests {
    use super::super::noise::{At, KINDS, noise};
    use super::*;

    /// Points between lattice points, on them, at both zeros, at the ends of what is near, and beyond.
    fn points<const N: usize>() -> impl Iterator<Item = [f32; N]> {
        (0..40_000usize).map(|k| {
            std::array::from_fn(|d| {
                let x = (avalanche((k * 4 + d) as u32) >> 8) as f32 * (40.0 / 16_777_216.0) - 20.0;
                match (k >> (2 * d)) % 8 {
                    0 => x.round(),
                    1 => -0.0,
                    2 => x * 1e-9,
                    3 => x * 1e5,
                    4 => NEAR.next_down() * x.signum(),
                    5 if d == 0 => [NEAR, f32::NAN, f32::NEG_INFINITY][k % 3],
                    _ => x,
                }
            })
        })
    }

    #[test]
    fn near_points_get_the_same() {
        fn compare<const N: usize>(found: &mut usize) {
            for x in points::<N>() {
                let at = At { x: std::array::from_fn(|d| [*x.get(d).unwrap_or(&0.0)]), n: N, period: [[0.0]; 4] };
                assert_eq!(is_near(0, &x), x.iter().all(|x| x.abs() < NEAR), "{x:?}");
                for kind in (0..KINDS.len()).filter(|kind| is_near(*kind, &x)) {
                    let (one, [other]) = (near(kind, x), noise(kind, &at, 0));
                    assert_eq!(one.to_bits(), other.to_bits(), "{} at {x:?}", KINDS[kind]);
                    *found += 1;
                }
            }
        }
        let mut found = 0;
        compare::<1>(&mut found);
        compare::<2>(&mut found);
        compare::<3>(&mut found);
        compare::<4>(&mut found);
        assert!(found > 500_000, "{found}");
    }

    #[test]
    fn wide_and_plain_code_give_the_same() {
        fn compare<const N: usize, const C: usize>() {
            for x in points::<N>().filter(|x| is_near(0, x)) {
                let corners = Corners::<N, C>::new(x);
                let (wide, plain) = (widest(&corners), (&corners).run());
                assert_eq!(wide.0.map(f32::to_bits), plain.0.map(f32::to_bits), "{x:?}");
                assert_eq!(wide.1.map(f32::to_bits), plain.1.map(f32::to_bits), "{x:?}");
            }
        }
        compare::<1, 2>();
        compare::<2, 4>();
        compare::<3, 8>();
        compare::<4, 16>();
    }
}
