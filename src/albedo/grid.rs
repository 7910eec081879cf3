//! The nodes of a table around a thread: where they lie, what is integrated there, and what interpolation between them misses.

use super::curve::parallel;
use super::fibre::{COMPONENTS, FibreQuadrature, FibreSpec, FibreTables, HORIZON};
use crate::optics::{Scalar, V3};

/// Angles around the thread, in degrees, whose largest albedo a table over a varying parameter holds.
const TURNS: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 89.99];

/// Where the fractions `row` and `place` along a node's row lie: square roots of diamond angles, for crossed threads
/// from both ends and from [`HORIZON`] on.
pub(super) fn direction(sheet: usize, row: f64, place: f64, crossed: bool) -> V3<f64> {
    let (along, around) = if crossed {
        let place = first_place() + place * (1.0 - first_place());
        let row = HORIZON.sqrt() + row * (1.0 - HORIZON.sqrt());
        (if place < 0.5 { 2.0 * place * place } else { 1.0 - 2.0 * (1.0 - place).powi(2) }, row.powi(2))
    } else {
        (place.powi(2).max(1e-9), row.powi(2).max(1e-12))
    };
    let unit = |a: f64, b: f64| (a / a.hypot(b), b / a.hypot(b));
    let (cos, sin) = unit(along, 1.0 - along);
    let (z, y) = unit(around, 1.0 - around);
    V3::new(if sheet == 0 { sin } else { -sin }, cos * y, cos * z)
}

/// Where [`HORIZON`] lies along the first half of a row of crossed threads.
pub(super) fn first_place() -> f64 {
    (0.5 * HORIZON).sqrt()
}

/// Where outermost cells are probed.
const EDGE: [f64; 5] = [0.02, 0.06, 0.16, 0.36, 0.66];

/// The nodes of a table and how to integrate there; fractional indices lie between nodes.
pub(super) struct Grid<'s> {
    pub spec: &'s FibreSpec,
    pub rule: FibreQuadrature,
    pub rows: usize,
    pub nodes: usize,
}

impl Grid<'_> {
    fn parameter(&self, row: f64) -> f64 {
        row / (self.rows.max(2) - 1) as f64
    }

    /// The direction at a node; just above the horizon in place of the horizon itself.
    fn direction(&self, sheet: usize, row: f64, node: f64) -> V3<f64> {
        let around = match self.spec.axis {
            None if self.rows > 1 => row / (self.rows - 1) as f64,
            _ => 1.0,
        };
        direction(sheet, around, node / (self.nodes - 1) as f64, self.spec.weave.is_some())
    }

    /// The row on which the cosine is [`HORIZON`], in a cloth's table.
    fn row_of_horizon(&self, sheet: usize, node: f64) -> f64 {
        let on_top = self.direction(sheet, (self.rows - 1) as f64, node);
        let y = (on_top.z * on_top.z - HORIZON * HORIZON).max(0.0).sqrt();
        let first = HORIZON.sqrt();
        ((HORIZON / (HORIZON + y)).sqrt() - first) / (1.0 - first) * (self.rows - 1) as f64
    }

    pub fn albedos(&self, sheet: usize, row: f64, node: f64) -> [f64; COMPONENTS] {
        let w = self.direction(sheet, row, node);
        let Some(axis) = self.spec.axis else {
            return self.rule.albedos(self.spec, &self.spec.key, w);
        };
        let mut key = self.spec.key;
        key[axis] = self.parameter(row);
        let mut largest = [0.0f64; COMPONENTS];
        let turns: &[f64] = if self.spec.around { &TURNS } else { &[0.0] };
        let across = w.y.hypot(w.z);
        for turn in turns {
            let (y, z) = turn.to_radians().sin_cos();
            let here = self.rule.albedos(self.spec, &key, V3::new(w.x, across * y, across * z));
            largest = std::array::from_fn(|c| largest[c].max(here[c]));
        }
        largest
    }

    /// How much every node of the bound must rise so that no probe between the nodes lies above it, with a fifth more
    /// for what lies between the probes. A cloth is probed at the horizon and about the poles only.
    pub fn shortfalls<S: Scalar>(&self, tables: &FibreTables<S>) -> Vec<[f64; COMPONENTS]> {
        let (rows, nodes) = (self.rows, self.nodes);
        // In cells: the middles of cells and of their edges between rows; the last cell of the first band more often,
        // because its corner is a pole of the threads across, about which the albedo turns within any distance. Of a cloth
        // only the outermost cells: linear in the cosine, it is even in its square root there, which no difference between
        // the nodes shows.
        let mut probes: Vec<(usize, f64, f64)> = Vec::new();
        for sheet in 0..tables.sheets {
            for half in 0..if self.spec.weave.is_some() { 0 } else { 2 * rows - 1 } {
                probes.extend((0..nodes - 1).map(|n| (sheet, half as f64 / 2.0, n as f64 + 0.5)));
                // A full step along the rows lies on a node.
                if half % 2 == 1 {
                    probes.extend((0..nodes).map(|n| (sheet, half as f64 / 2.0, n as f64)));
                }
            }
            let last = (nodes - 1) as f64;
            if self.spec.around && self.spec.axis.is_none() {
                const NEAR: [f64; 6] = [1e-3, 0.01, 0.04, 0.12, 0.3, 0.7];
                probes.extend(NEAR.iter().flat_map(|r| NEAR.map(|n| (sheet, *r, last - n * n))));
            }
            if self.spec.weave.is_some() {
                // Where they are taken to be level from there to the horizon, albedos have a kink.
                let halves = (0..2 * nodes - 1).map(|n| n as f64 / 2.0);
                probes.extend(halves.chain(EDGE).map(|n| (sheet, self.row_of_horizon(sheet, n), n)));
                for e in EDGE {
                    probes.extend((0..2 * nodes - 1).map(|n| (sheet, e, n as f64 / 2.0)));
                    let halves = (0..2 * rows - 1).map(|r| r as f64 / 2.0);
                    probes.extend(halves.flat_map(|r| [(sheet, r, e), (sheet, r, last - e)]));
                    probes.extend(EDGE.iter().flat_map(|n| [(sheet, e, *n), (sheet, e, last - n)]));
                }
            }
        }
        let missing = parallel(&probes, |&(sheet, row, node)| {
            let truth = self.albedos(sheet, row, node);
            let read = tables.view(self.direction(sheet, row, node).map(S::c), S::c(self.parameter(row)));
            std::array::from_fn::<f64, COMPONENTS, _>(|c| truth[c] - read[c].to_f64())
        });
        let mut lifts = vec![[0.0f64; COMPONENTS]; tables.sheets * rows * nodes];
        for (&(sheet, row, node), missing) in probes.iter().zip(missing) {
            for r in [row.floor() as usize, row.ceil() as usize] {
                for n in [node.floor() as usize, node.ceil() as usize] {
                    let lift = &mut lifts[(sheet * rows + r) * nodes + n];
                    *lift = std::array::from_fn(|c| lift[c].max(1.2 * missing[c]));
                }
            }
        }
        lifts
    }
}
