//! The means ⟨s⟩ of one lobe as a matrix, and the iteration.

use super::Unbalanced;
use super::scales::{cosine_at, weight_at};
use crate::albedo::quadrature::Rule;
use crate::albedo::{AlbedoCurve, curve};
use crate::lobes::{AnyLobe, LobeKind};
use crate::optics::{Scalar, V3};
use std::f64::consts::PI;

/// Points per interval between two nodes, and over half the azimuth.
const POLAR: usize = 3;
const AZIMUTH: usize = 24;
/// How many times as many points along both tell what those miss, at every which probe.
const FINER: usize = 3;
const CHECKED: usize = 5;
/// A lobe whose means lie further off than this, along the nodes' coordinate from 0 to 1, is too narrow for them.
const MOST_ASTRAY: f64 = 1e-3;
/// The iteration ends when no node's albedo is further from its target than this, relatively.
const CONVERGED: f64 = 1e-9;
const ITERATIONS: usize = 500;
/// What every scale is lowered by, for rounding and for what lies between the probes.
const MARGIN: f64 = 1e-5;

/// Row by row the weights that ⟨s⟩ at a probe gives to s at the nodes. Probes are the nodes and the middles between
/// them, in ascending order.
#[derive(Clone, Debug)]
pub struct Kernel {
    pub(super) nodes: usize,
    /// One block of rows if the channels are alike, else three.
    pub(super) channels: Vec<Vec<f32>>,
    /// How far off the means may lie, along the nodes' coordinate: ⟨s⟩ is known to this times the largest slope of s.
    astray: f64,
}

/// Probes over `nodes` nodes.
fn probes(nodes: usize) -> usize {
    2 * nodes - 1
}

/// How many places from one probe to the next where α is asked for: it may have kinks anywhere, and costs little.
const FINE: usize = 4;

/// Places over `nodes` nodes where α is asked for.
pub(super) fn targets(nodes: usize) -> usize {
    2 * FINE * (nodes - 1) + 1
}

/// The cosine of the `k`th of them.
pub(super) fn target_cosine(k: usize, nodes: usize) -> f64 {
    cosine_at(k as f64 / (2 * FINE * (nodes - 1)) as f64)
}

/// The cosine of probe `k`.
fn probe_cosine(k: usize, nodes: usize) -> f64 {
    cosine_at(k as f64 / (2 * (nodes - 1)) as f64)
}

impl Kernel {
    /// # Errors
    /// For a lobe that scatters to the other side or on it, and for one too narrow to be integrated at the nodes.
    pub fn new<S: Scalar>(
        kind: LobeKind,
        values: &[f32],
        curve: &AlbedoCurve<S>,
        nodes: usize,
    ) -> Result<Kernel, Unbalanced> {
        let at = |cos: f64| AnyLobe::<S>::new(kind, values, V3::polar(S::c(cos), S::zero()), curve);
        let below = |cos: f64| at(-cos).albedo(V3::polar(S::c(-cos), S::zero()), curve).iter().any(|e| *e > S::zero());
        if [0.1, 0.5, 0.9].iter().any(|cos| at(*cos).sides().transmit || below(*cos)) {
            return Err(Unbalanced::Crosses);
        }
        let directions = |finer: usize| directions::<S>(nodes, POLAR * finer, AZIMUTH * finer);
        let rows_at = |probes: &[usize], finer: usize| {
            let directions = directions(finer);
            curve::parallel(probes, |k| row(&at(probe_cosine(*k, nodes)), curve, &directions, nodes))
        };
        let all: Vec<usize> = (0..probes(nodes)).collect();
        let checked: Vec<usize> = all.iter().copied().step_by(CHECKED).collect();
        let (rows, finer) = (rows_at(&all, 1), rows_at(&checked, FINER));
        let off = checked.iter().zip(&finer).flat_map(|(k, fine)| (0..3).map(|c| distance(&rows[*k][c], &fine[c])));
        let astray = off.fold(0.0, f64::max);
        if astray > MOST_ASTRAY {
            return Err(Unbalanced::Narrow);
        }
        let grey = rows.iter().all(|r| r[1] == r[0] && r[2] == r[0]);
        let block = |c: usize| rows.iter().flat_map(|r| r[c].iter().map(|x| *x as f32)).collect();
        Ok(Kernel { nodes, channels: (0..if grey { 1 } else { 3 }).map(block).collect(), astray })
    }

    fn mean(&self, channel: usize, probe: usize, s: &[f64]) -> f64 {
        let row = &self.channels[channel][probe * self.nodes..][..self.nodes];
        row.iter().zip(s).map(|(m, s)| *m as f64 * s).sum()
    }

    /// s at the nodes, so that s·⟨s⟩ is `alpha` (at the [`targets`]) or, where that has no solution, below it.
    pub(super) fn solve(&self, channel: usize, alpha: &[f64]) -> Vec<f64> {
        let mut s: Vec<f64> = alpha.iter().step_by(2 * FINE).map(|a| a.sqrt()).collect();
        for _ in 0..ITERATIONS {
            let ratio = |j: usize| {
                let albedo = s[j] * self.mean(channel, 2 * j, &s);
                if albedo > 0.0 { alpha[2 * FINE * j] / albedo } else { 1.0 }
            };
            let ratios: Vec<f64> = (0..self.nodes).map(ratio).collect();
            for (s, r) in s.iter_mut().zip(&ratios) {
                *s *= r.sqrt();
            }
            if ratios.iter().all(|r| (r - 1.0).abs() < CONVERGED) {
                break;
            }
        }
        s
    }

    /// By how much each node must be lowered so that s·⟨s⟩ exceeds `alpha` nowhere. Between nodes the excess counts a fifth
    /// more, for kinks of α between the places where it is known.
    fn lowering(&self, channel: usize, s: &[f64], alpha: &[f64], factors: &mut [f64]) {
        let slope = s.windows(2).map(|s| (s[1] - s[0]).abs()).fold(0.0, f64::max) * (self.nodes - 1) as f64;
        let means: Vec<f64> = (0..probes(self.nodes)).map(|k| self.mean(channel, k, s)).collect();
        for (k, target) in alpha.iter().enumerate() {
            // ⟨s⟩ is as smooth as the lobe, and straight between probes; s has a bend at every node.
            let between = |values: &[f64], step: usize| {
                let (a, b) = (values[k / step], values[k.div_ceil(step)]);
                a + (b - a) * (k % step) as f64 / step as f64
            };
            let (here, mean) = (between(s, 2 * FINE), between(&means, FINE));
            let (a, b) = (k / (2 * FINE), k.div_ceil(2 * FINE));
            let albedo = here * mean;
            let excess = (albedo - target) * if a == b { 1.0 } else { 1.2 } + here * slope * self.astray;
            if excess > 0.0 {
                let factor = target / (target + excess);
                factors[a] = factors[a].min(factor);
                factors[b] = factors[b].min(factor);
            }
        }
    }

    /// A row of a table.
    pub(super) fn solve_row(&self, channel: usize, alpha: &[f64]) -> Vec<f64> {
        let mut s = self.solve(channel, alpha);
        let mut factors = vec![1.0; self.nodes];
        self.lowering(channel, &s, alpha, &mut factors);
        for (s, f) in s.iter_mut().zip(factors) {
            *s *= f * (1.0 - MARGIN);
        }
        s
    }

    /// Rows over the weight of the top and its parameter, lowered so that nothing between them exceeds its target
    /// either. `bound(y, cosine)` is the top's albedo bound at `y` in [0, 1] along the parameter.
    pub(super) fn solve_rows(&self, weights: usize, params: usize, bound: impl Fn(f64, f64) -> f64 + Sync) -> Vec<f64> {
        let along = |j: usize| j as f64 / (2 * (params.max(2) - 1)) as f64;
        // Targets at the rows and halfway between them.
        let wanted = |i: usize, j: usize| -> Vec<f64> {
            // Reading is linear in the weight itself between two rows.
            let w = 0.5 * (weight_at(i / 2, weights) + weight_at(i.div_ceil(2), weights));
            let target = |k| (1.0 - w * bound(along(j), target_cosine(k, self.nodes))).clamp(0.0, 1.0);
            (0..targets(self.nodes)).map(target).collect()
        };
        let all: Vec<(usize, usize)> = (0..params).flat_map(|j| (0..weights).map(move |i| (i, j))).collect();
        let rows = curve::parallel(&all, |&(i, j)| self.solve(0, &wanted(2 * i, 2 * j)));
        let halves: Vec<(usize, usize)> =
            (0..2 * params - 1).flat_map(|j| (0..2 * weights - 1).map(move |i| (i, j))).collect();
        let around = |i: usize, j: usize| {
            [(i / 2, j / 2), (i.div_ceil(2), j / 2), (i / 2, j.div_ceil(2)), (i.div_ceil(2), j.div_ceil(2))]
                .map(|(i, j)| j * weights + i)
        };
        let lowered = curve::parallel(&halves, |&(i, j)| {
            let corners = around(i, j);
            let s: Vec<f64> =
                (0..self.nodes).map(|n| corners.iter().map(|r| rows[*r][n]).sum::<f64>() * 0.25).collect();
            let mut factors = vec![1.0; self.nodes];
            self.lowering(0, &s, &wanted(i, j), &mut factors);
            factors
        });
        let mut factors = vec![1.0f64; weights * params * self.nodes];
        for (&(i, j), lowered) in halves.iter().zip(&lowered) {
            for row in around(i, j) {
                for (f, l) in factors[row * self.nodes..].iter_mut().zip(lowered) {
                    *f = f.min(*l);
                }
            }
        }
        rows.iter().flatten().zip(factors).map(|(s, f)| s * f * (1.0 - MARGIN)).collect()
    }
}

/// How far two rows of weights lie apart: what has to be moved, times how far, along a coordinate from 0 to 1 (Kantorovich
/// 1942). No mean of an s of slope 1 differs by more.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let (mut moved, mut ahead) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        ahead += a - b;
        moved += f64::abs(ahead);
    }
    moved / (a.len() - 1) as f64
}

/// A ring of directions at one cosine, the interval it lies in, its share of the two nodes there, and its weight.
struct Ring<S> {
    interval: usize,
    fraction: f64,
    weight: f64,
    directions: Vec<(V3<S>, f64)>,
}

fn directions<S: Scalar>(nodes: usize, polar: usize, azimuth: usize) -> Vec<Ring<S>> {
    let (polar, azimuth) = (Rule::gauss_legendre(polar), Rule::gauss_legendre(azimuth));
    let mut rings = Vec::new();
    for interval in 0..nodes - 1 {
        for (t, w) in polar.nodes.iter().zip(&polar.weights) {
            let x = (interval as f64 + t) / (nodes - 1) as f64;
            let cos = x.powi(4);
            // The azimuth is graded toward π, where a narrow lobe has its peak; dμ = 4x³ dx.
            let direction = |(v, w): (&f64, &f64)| (V3::polar(S::c(cos), S::c(PI * (1.0 - v * v))), w * 2.0 * v);
            let directions = azimuth.nodes.iter().zip(&azimuth.weights).map(direction).collect();
            rings.push(Ring { interval, fraction: *t, weight: cos * 4.0 * x.powi(3) * w, directions });
        }
    }
    rings
}

/// The weights of ⟨s⟩ per channel; where nothing is scattered they do not matter.
fn row<S: Scalar>(lobe: &AnyLobe<S>, curve: &AlbedoCurve<S>, rings: &[Ring<S>], nodes: usize) -> [Vec<f64>; 3] {
    let mut rows = [(); 3].map(|()| vec![0.0; nodes]);
    for ring in rings {
        let mut sum = [0.0; 3];
        for (wi, w) in &ring.directions {
            let f = lobe.f(*wi, curve);
            for c in 0..3 {
                sum[c] += w * f[c].to_f64();
            }
        }
        for c in 0..3 {
            rows[c][ring.interval] += (1.0 - ring.fraction) * ring.weight * sum[c];
            rows[c][ring.interval + 1] += ring.fraction * ring.weight * sum[c];
        }
    }
    for row in &mut rows {
        let total: f64 = row.iter().sum();
        if total > 0.0 {
            row.iter_mut().for_each(|x| *x /= total);
        } else {
            row[nodes - 1] = 1.0;
        }
    }
    rows
}
