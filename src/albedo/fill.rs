//! Values of a smooth function over a grid, computed where they must be and interpolated where that will do.
//!
//! The grid is covered with panels of 9 by 9 of its points. Where polynomials through every fourth and every second of them
//! show that the one through all tells what lies between, that one fills the panel; else it is halved, at last down to
//! every point of the grid.

use super::curve::parallel;

/// Steps along a panel's side.
const STEPS: usize = 8;
/// Grid steps along the nodes that one panel may cover from the start: so that nothing narrow falls between.
const WIDEST: usize = 64;

/// How many panels there are at least, if they are more than their points: what happens near one end does not show in points
/// that far apart.
const LEAST: usize = 8;

/// A value and how far off it may be.
pub(super) type Estimate = (f64, f64);

/// `f(row, node)` at all points of a grid, row after row, within about `tolerance` (far below it where f is smooth).
/// Both sides of the grid have a power of two steps, or none.
pub(super) fn fill<const N: usize>(
    rows: usize,
    nodes: usize,
    tolerance: f64,
    f: impl Fn(usize, usize) -> [Estimate; N] + Sync,
) -> Vec<[Estimate; N]> {
    let mut known: Vec<Option<[Estimate; N]>> = vec![None; rows * nodes];
    let mut filled = vec![[(0.0, 0.0); N]; rows * nodes];
    let width = (nodes - 1).min(WIDEST).min((nodes / LEAST).max(STEPS)).min(nodes - 1);
    let mut open: Vec<Panel> = (0..nodes - 1)
        .step_by(width)
        .map(|node| Panel { row: Side { from: 0, steps: rows - 1 }, node: Side { from: node, steps: width } })
        .collect();
    while !open.is_empty() {
        let mut wanted: Vec<usize> =
            open.iter().flat_map(|p| p.lattice(nodes)).filter(|k| known[*k].is_none()).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let found = parallel(&wanted, |&k| f(k / nodes, k % nodes));
        for (k, value) in wanted.into_iter().zip(found) {
            known[k] = Some(value);
        }
        let mut halves = Vec::new();
        for panel in open {
            let lattice: Vec<[Estimate; N]> =
                panel.lattice(nodes).map(|k| known[k].unwrap_or([(0.0, 0.0); N])).collect();
            match panel.parts(&lattice, tolerance) {
                Some(parts) => halves.extend(parts),
                None => panel.fill(&lattice, nodes, &mut filled),
            }
        }
        open = halves;
    }
    known.into_iter().zip(filled).map(|(known, filled)| known.unwrap_or(filled)).collect()
}

/// One side of a panel, in steps of the grid.
#[derive(Clone, Copy)]
struct Side {
    from: usize,
    steps: usize,
}

impl Side {
    /// Grid steps from one point of the lattice to the next.
    fn stride(self) -> usize {
        (self.steps / STEPS).max(1)
    }

    /// Points of the lattice.
    fn points(self) -> usize {
        self.steps / self.stride() + 1
    }

    fn halves(self, split: bool) -> Vec<Side> {
        let half = self.steps / 2;
        if split {
            vec![Side { steps: half, ..self }, Side { from: self.from + half, steps: half }]
        } else {
            vec![self]
        }
    }

    /// For every grid point of this side, how the lattice's points add up to it.
    fn weights(self) -> Vec<[f64; STEPS + 1]> {
        (0..=self.steps).map(|k| lagrange(self.points(), k as f64 / self.stride() as f64)).collect()
    }
}

#[derive(Clone, Copy)]
struct Panel {
    row: Side,
    node: Side,
}

impl Panel {
    fn lattice(self, nodes: usize) -> impl Iterator<Item = usize> {
        let Panel { row, node } = self;
        (0..row.points()).flat_map(move |r| {
            let start = (row.from + r * row.stride()) * nodes + node.from;
            (0..node.points()).map(move |n| start + n * node.stride())
        })
    }

    /// Halves, or quarters, if the polynomial may miss the truth by more than `tolerance`; `None` if not.
    fn parts<const N: usize>(self, lattice: &[[Estimate; N]], tolerance: f64) -> Option<Vec<Panel>> {
        let across = self.node.points();
        let off = |side: Side, start: usize, step: usize| {
            if side.stride() == 1 { 0.0 } else { missed(|k| &lattice[start + k * step]) }
        };
        let along_nodes = (0..self.row.points()).map(|r| off(self.node, r * across, 1)).fold(0.0, f64::max);
        let along_rows = (0..across).map(|n| off(self.row, n, across)).fold(0.0, f64::max);
        let split = (along_rows > tolerance, along_nodes > tolerance);
        (split.0 || split.1).then(|| {
            let nodes = self.node.halves(split.1);
            let both = |row: Side| nodes.iter().map(move |node| Panel { row, node: *node }).collect::<Vec<_>>();
            self.row.halves(split.0).into_iter().flat_map(both).collect()
        })
    }

    fn fill<const N: usize>(self, lattice: &[[Estimate; N]], nodes: usize, filled: &mut [[Estimate; N]]) {
        let off: [f64; N] = std::array::from_fn(|c| lattice.iter().map(|v| v[c].1).fold(0.0, f64::max));
        let (along, across) = (self.node.weights(), self.node.points());
        for (r, row_weights) in self.row.weights().into_iter().enumerate() {
            // First across the rows, then along the one that results.
            let part = |n: usize, c: usize| -> f64 {
                (0..self.row.points()).map(|i| row_weights[i] * lattice[i * across + n][c].0).sum()
            };
            let line: Vec<[f64; N]> = (0..across).map(|n| std::array::from_fn(|c| part(n, c))).collect();
            for (n, weights) in along.iter().enumerate() {
                let value = |c: usize| line.iter().zip(weights).map(|(v, w)| w * v[c]).sum();
                let at = (self.row.from + r) * nodes + self.node.from + n;
                filled[at] = std::array::from_fn(|c| (value(c), off[c]));
            }
        }
    }
}

/// How far the polynomial through nine values in a row may lie from the truth. From every fourth value to every second the
/// miss falls by some factor, and by its square on to all of them if f is smooth; four times the result is said. At an edge it
/// hardly falls.
fn missed<'v, const N: usize>(value: impl Fn(usize) -> &'v [Estimate; N]) -> f64 {
    let by = |stride: usize| {
        let (points, mut most) = (STEPS / stride + 1, 0.0f64);
        for k in (stride / 2..STEPS).step_by(stride) {
            let weights = lagrange(points, k as f64 / stride as f64);
            for c in 0..N {
                let told: f64 = (0..points).map(|i| weights[i] * value(i * stride)[c].0).sum();
                most = most.max((told - value(k)[c].0).abs());
            }
        }
        most
    };
    let (coarse, fine) = (by(4), by(2));
    4.0 * fine * (fine / coarse.max(fine).max(1e-300)).powi(2)
}

/// The weights of `points` values at 0, 1, 2 … for the polynomial through them at `t`.
fn lagrange(points: usize, t: f64) -> [f64; STEPS + 1] {
    let mut weights = [0.0; STEPS + 1];
    for (i, weight) in weights.iter_mut().enumerate().take(points) {
        let others = (0..points).filter(|j| *j != i);
        *weight = others.map(|j| (t - j as f64) / (i as f64 - j as f64)).product();
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// What `fill` misses by at most, and the share of the points it asks for.
    fn measure(rows: usize, nodes: usize, f: impl Fn(f64, f64) -> f64 + Sync) -> (f64, f64) {
        let calls = AtomicUsize::new(0);
        let at = |k: usize, n: usize| k as f64 / (n.max(2) - 1) as f64;
        let values = fill(rows, nodes, 1e-5, |row, node| {
            calls.fetch_add(1, Ordering::Relaxed);
            [(f(at(row, rows), at(node, nodes)), 1e-9), (1.0, 0.0)]
        });
        let mut worst = 0.0f64;
        for (k, [(value, off), one]) in values.iter().enumerate() {
            worst = worst.max((value - f(at(k / nodes, rows), at(k % nodes, nodes))).abs());
            assert!((one.0 - 1.0).abs() < 1e-12 && *off == 1e-9);
        }
        (worst, calls.into_inner() as f64 / values.len() as f64)
    }

    #[test]
    fn smooth_functions_are_asked_for_rarely() {
        for (rows, nodes) in [(1, 257), (33, 129), (5, 9), (1, 2)] {
            let (worst, share) = measure(rows, nodes, |y, x| (2.0 * x - y).sin() + y * x);
            assert!(worst < 1e-7, "{rows} {nodes}: {worst}");
            assert!(share < 0.3 || nodes < 16, "{rows} {nodes}: {share}");
        }
    }

    #[test]
    fn edges_and_peaks_are_followed_to_the_last_point() {
        for (rows, nodes) in [(1, 513), (33, 129)] {
            let (worst, share) =
                measure(rows, nodes, |y, x| (x - 0.3 - 0.2 * y).max(0.0).sqrt() + (-(x - 0.7).powi(2) * 3e3).exp());
            assert!(worst < 1e-5, "{rows} {nodes}: {worst}");
            assert!(share < 0.9, "{rows} {nodes}: {share}");
        }
    }
}
