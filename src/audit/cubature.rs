//! Adaptive integration over rectangles, three channels at a time.
//!
//! A tensor product of Gauss–Kronrod (7, 15) rules; the rectangle with the largest error is halved along the
//! direction that contributes most to it, until the sum of errors is below the tolerance. Where points are known not to be
//! black and the rule finds nothing, what they stand for is an error too. Deterministic.

use crate::albedo::quadrature::{GAUSS, KRONROD, NODES};
use std::collections::BinaryHeap;

/// An integral per channel, with an estimate of its absolute error (the largest over the channels).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integral {
    /// The integral per channel.
    pub value: [f64; 3],
    /// Estimated absolute error, the largest over the channels.
    pub error: f64,
    /// The error could not be brought below the tolerance within the budget.
    pub exhausted: bool,
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Absolute.
    pub error: f64,
    /// Most evaluations of the integrand.
    pub evaluations: usize,
}

impl Default for Tolerance {
    fn default() -> Self {
        Tolerance { error: 1e-5, evaluations: 400_000 }
    }
}

/// A rectangle to integrate over, with places where the integrand is known not to be black.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// `[x0, x1, y0, y1]`.
    pub corners: [f64; 4],
    /// Places, and the part of the integral that each stands for.
    pub points: Vec<([f64; 2], f64)>,
}

impl Patch {
    fn width(&self, axis: usize) -> f64 {
        self.corners[2 * axis + 1] - self.corners[2 * axis]
    }

    /// Two, `axis` cut at `at`.
    fn cut(self, axis: usize, at: f64) -> [Patch; 2] {
        let (mut below, mut above) = (self.corners, self.corners);
        (below[2 * axis + 1], above[2 * axis]) = (at, at);
        let (under, over) = self.points.into_iter().partition(|p| p.0[axis] < at);
        [Patch { corners: below, points: under }, Patch { corners: above, points: over }]
    }

    /// What its points stand for, if almost nothing of that was found: light that lies between the places looked at.
    fn missed(&self, found: [f64; 3]) -> f64 {
        self.untold(found, self.points.iter().map(|p| p.1).sum())
    }

    /// [`missed`](Self::missed) where a point stands for no more than its brightness over the whole cell: most of what a
    /// broad lobe's point stands for lies elsewhere.
    fn missed_of(&self, found: [f64; 3], mut f: impl FnMut(f64, f64) -> [f64; 3]) -> f64 {
        let area = self.width(0) * self.width(1);
        let here = |(p, share): &([f64; 2], f64)| share.min(area * f(p[0], p[1]).into_iter().fold(0.0, f64::max));
        let told = self.points.iter().map(here).sum();
        self.untold(found, told)
    }

    fn untold(&self, found: [f64; 3], told: f64) -> f64 {
        let found = found[0].max(found[1]).max(found[2]);
        let wide = self.width(0).max(self.width(1)) > SEEN;
        if found < 0.01 * told && wide { told } else { 0.0 }
    }

    /// The direction in which its points lie closest together, measured in the cell; a single one is closed in from both.
    fn narrow(&self) -> usize {
        match self.points.len() {
            0 | 1 => usize::from(self.width(1) > self.width(0)),
            _ => usize::from(self.spread(1) < self.spread(0)),
        }
    }

    /// Where to cut it so that the flanks of the peak its points show get cells of their own.
    fn cut_at(&mut self, axis: usize, most: usize) -> Option<f64> {
        let (lo, hi) = (self.corners[2 * axis], self.corners[2 * axis + 1]);
        let (first, last) = self.ends(axis);
        // A little at a time.
        let reach = (last - first).max(0.125 * (hi - lo)).max(NARROWEST);
        if self.points.len() < 2 {
            None
        } else if first - lo > 2.0 * reach {
            // What is empty is cut off.
            Some(first - reach)
        } else if hi - last > 2.0 * reach {
            Some(last + reach)
        } else {
            self.points.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis]));
            let middle = self.points[self.points.len() / 2].0[axis];
            (self.points.len() > most && middle > lo + NARROWEST && middle < hi - NARROWEST).then_some(middle)
        }
    }

    /// How far its points lie apart, over its width.
    fn spread(&self, axis: usize) -> f64 {
        let (lo, hi) = self.ends(axis);
        (hi - lo) / self.width(axis)
    }

    /// The first and the last of its points along an axis.
    fn ends(&self, axis: usize) -> (f64, f64) {
        let of = self.points.iter().map(|p| p.0[axis]);
        of.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)))
    }
}

/// In cells narrower than this nothing is looked for: directions of single precision are no closer.
const SEEN: f64 = 1e-6;

/// Integrates `f(x, y)` over the rectangles with corners `[x0, x1, y0, y1]`.
pub fn integrate(cells: &[[f64; 4]], tolerance: Tolerance, mut f: impl FnMut(f64, f64) -> [f64; 3]) -> Integral {
    let patch = |c: &[f64; 4]| (0, Patch { corners: *c, points: Vec::new() });
    integrate_until(cells.iter().map(patch).collect(), tolerance, |_, x, y| f(x, y), |_, _| false)
}

/// Integrates several functions `f(which, x, y)`, each over the rectangles that come with its number, and adds them up.
/// Stops early where `enough(value, error)` says so.
pub(super) fn integrate_until(
    patches: Vec<(usize, Patch)>,
    tolerance: Tolerance,
    mut f: impl FnMut(usize, f64, f64) -> [f64; 3],
    enough: impl Fn([f64; 3], f64) -> bool,
) -> Integral {
    let mut heap: BinaryHeap<Cell> = patches.into_iter().map(|(which, p)| Cell::measure(which, p, &mut f)).collect();
    let mut evaluations = heap.len() * 225;
    loop {
        let error: f64 = heap.iter().map(|c| c.error).sum();
        let rough = heap.iter().fold([0.0; 3], |a, c| std::array::from_fn(|i| a[i] + c.value[i]));
        let done = error <= tolerance.error || enough(rough, error);
        if done || evaluations + 450 > tolerance.evaluations {
            // Summed in a fixed order, smallest errors first.
            let cells = heap.into_sorted_vec();
            let value = cells.iter().fold([0.0; 3], |a, c| std::array::from_fn(|i| a[i] + c.value[i]));
            return Integral { value, error, exhausted: !done };
        }
        let Some(worst) = heap.pop() else {
            return Integral { value: [0.0; 3], error: 0.0, exhausted: false };
        };
        let which = worst.which;
        for half in worst.halves() {
            heap.push(Cell::measure(which, half, &mut f));
        }
        evaluations += 450;
    }
}

/// No cell is cut narrower.
const NARROWEST: f64 = 1e-10;

/// Splits `cells` until none holds more than `most` of the `points` (where a peak too narrow to be found was sampled).
pub fn split_at(cells: &[[f64; 4]], points: &[[f64; 2]], most: usize) -> Vec<[f64; 4]> {
    let patches = cells.iter().map(|c| Patch { corners: *c, points: Vec::new() }).collect();
    let points: Vec<_> = points.iter().map(|p| (*p, 0.0)).collect();
    split(patches, &points, most).into_iter().map(|p| p.corners).collect()
}

/// [`split_at`] for patches, which take the points, each with the part of the integral that it stands for.
pub(super) fn split(patches: Vec<Patch>, points: &[([f64; 2], f64)], most: usize) -> Vec<Patch> {
    // A peak at an edge lies on both sides of it, wherever its points fell: those close by are looked for in both, but
    // stand for nothing in the other.
    let fold = |x: f64, lo: f64, hi: f64| {
        let folded = if x < lo {
            2.0 * lo - x
        } else if x >= hi {
            2.0 * hi - x
        } else {
            x
        };
        ((lo..hi).contains(&x) || (folded - x).abs() < 0.02 * (hi - lo)).then_some(folded)
    };
    let of = |c: &[f64; 4]| -> Vec<([f64; 2], f64)> {
        let within = |&(p, part): &([f64; 2], f64)| {
            let folded = [fold(p[0], c[0], c[1])?, fold(p[1], c[2], c[3])?];
            Some((folded, if folded == p { part } else { 0.0 }))
        };
        points.iter().filter_map(within).collect()
    };
    // The points that were there before are carried along.
    let mut open: Vec<(Patch, Patch)> =
        patches.into_iter().map(|old| (Patch { corners: old.corners, points: of(&old.corners) }, old)).collect();
    let mut done = Vec::new();
    while let Some((mut new, mut old)) = open.pop() {
        // Across the direction in which the points lie closest together, measured in the cell.
        let axis = new.narrow();
        match new.cut_at(axis, most) {
            Some(at) => open.extend(new.cut(axis, at).into_iter().zip(old.cut(axis, at))),
            None => {
                old.points.append(&mut new.points);
                done.push(old);
            }
        }
    }
    done
}

struct Cell {
    which: usize,
    patch: Patch,
    value: [f64; 3],
    error: f64,
    /// Halve along y (1) or x (0).
    axis: usize,
}

impl Cell {
    fn measure(which: usize, patch: Patch, f: &mut impl FnMut(usize, f64, f64) -> [f64; 3]) -> Cell {
        let [x0, x1, y0, y1] = patch.corners;
        let (cx, hx) = (0.5 * (x0 + x1), 0.5 * (x1 - x0));
        let (cy, hy) = (0.5 * (y0 + y1), 0.5 * (y1 - y0));
        // Kronrod × Kronrod, Gauss × Kronrod, Kronrod × Gauss.
        let mut sums = [[0.0; 3]; 3];
        for i in 0..15 {
            let (x, kx, gx) = node(i);
            for j in 0..15 {
                let (y, ky, gy) = node(j);
                let value = f(which, cx + hx * x, cy + hy * y);
                for c in 0..3 {
                    sums[0][c] += kx * ky * value[c];
                    sums[1][c] += gx * ky * value[c];
                    sums[2][c] += kx * gy * value[c];
                }
            }
        }
        let area = hx * hy;
        let value = sums[0].map(|s| s * area);
        let gap = |other: [f64; 3]| (0..3).map(|c| (sums[0][c] - other[c]).abs()).fold(0.0, f64::max) * area;
        let (ex, ey) = (gap(sums[1]), gap(sums[2]));
        let missed = match patch.missed(value) {
            told if told > 0.0 => patch.missed_of(value, |x, y| f(which, x, y)),
            none => none,
        };
        let axis = if missed > 0.0 { patch.narrow() } else { usize::from(ey > ex) };
        let error = if value.iter().all(|v| v.is_finite()) { ex + ey + missed } else { f64::INFINITY };
        Cell { which, patch, value, error, axis }
    }

    fn halves(self) -> [Patch; 2] {
        let [lo, hi] = [0, 1].map(|end| self.patch.corners[2 * self.axis + end]);
        self.patch.cut(self.axis, 0.5 * (lo + hi))
    }
}

/// Node `i` of 15 in ascending order, with its Kronrod and Gauss weights.
fn node(i: usize) -> (f64, f64, f64) {
    let k = if i < 8 { i } else { 14 - i };
    let x = if i < 8 { -NODES[k] } else { NODES[k] };
    let gauss = if k % 2 == 1 { GAUSS[k / 2] } else { 0.0 };
    (x, KRONROD[k], gauss)
}

impl PartialEq for Cell {
    fn eq(&self, o: &Self) -> bool {
        self.cmp(o).is_eq()
    }
}
impl Eq for Cell {}
impl PartialOrd for Cell {
    fn partial_cmp(&self, o: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Cell {
    fn cmp(&self, o: &Self) -> std::cmp::Ordering {
        let place = |c: &Cell| (c.which, c.patch.corners.map(f64::to_bits));
        self.error.total_cmp(&o.error).then_with(|| place(self).cmp(&place(o)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_functions_converge_at_once() {
        let i = integrate(&[[0.0, 1.0, 0.0, 2.0]], Tolerance::default(), |x, y| [x * y, x.exp(), (x + y).sin()]);
        approx::assert_abs_diff_eq!(i.value[0], 1.0, epsilon = 1e-13);
        approx::assert_abs_diff_eq!(i.value[1], 2.0 * (1f64.exp() - 1.0), epsilon = 1e-13);
        approx::assert_abs_diff_eq!(i.value[2], 1f64.sin() + 2f64.sin() - 3f64.sin(), epsilon = 1e-13);
        assert!(!i.exhausted);
    }

    #[test]
    fn kinks_and_edges_are_found() {
        let i = integrate(&[[-1.0, 1.0, -1.0, 1.0]], Tolerance::default(), |x, y| {
            let inside = if x * x + y * y < 0.25 { 1.0 } else { 0.0 };
            [(x - 0.3 * y).abs(), inside, 0.0]
        });
        approx::assert_abs_diff_eq!(i.value[0], 2.0 * (1.0 + 0.09 / 3.0), epsilon = 1e-4);
        approx::assert_abs_diff_eq!(i.value[1], std::f64::consts::PI * 0.25, epsilon = 2e-3);
    }

    #[test]
    fn a_peak_is_found_where_points_show_it() {
        let peak = |x: f64, y: f64| {
            let r2 = (x - 0.31).powi(2) + (y - 0.77).powi(2);
            [(-r2 / 1e-8).exp() / (1e-8 * std::f64::consts::PI), 0.0, 0.0]
        };
        let unit = [[0.0, 1.0, 0.0, 1.0]];
        assert!(integrate(&unit, Tolerance::default(), peak).value[0] < 1e-3, "found without help");
        let spiral = |k: usize| (2e-5 * (k as f64).sqrt(), 2.4 * k as f64);
        let points: Vec<[f64; 2]> =
            (0..64).map(spiral).map(|(r, a)| [0.31 + r * a.cos(), 0.77 + r * a.sin()]).collect();
        let cells = split_at(&unit, &points, 4);
        let area: f64 = cells.iter().map(|c| (c[1] - c[0]) * (c[3] - c[2])).sum();
        approx::assert_abs_diff_eq!(area, 1.0, epsilon = 1e-12);
        approx::assert_abs_diff_eq!(integrate(&cells, Tolerance::default(), peak).value[0], 1.0, epsilon = 1e-5);
    }

    #[test]
    fn a_budget_that_is_too_small_is_said() {
        let tolerance = Tolerance { error: 1e-12, evaluations: 1000 };
        assert!(integrate(&[[0.0, 1.0, 0.0, 1.0]], tolerance, |x, _| [x.powf(0.1); 3]).exhausted);
    }
}
