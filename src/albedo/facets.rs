//! Albedo of rough surfaces: what one bounce between facets leaves over, and how much of it is reflected or refracted.
//!
//! E at one direction comes from `visible.rs`; `fill.rs` spreads it over the table.
//!
//! `missing` is M(ω) ≤ 1 − E(ω), never above it: what the lobe may scatter once more without gaining. Nodes lie over
//! μ^¼, and over the azimuth for a stretched surface or over α^¼ where α varies from point to point. There M is 0
//! for a stretched surface: no simple function of the rows stays above its E.

pub use super::facet::{Facet, FacetKey, FacetSpec, MAX_STRETCH, MIN_ALPHA, PARTS, white};

use super::curve::Precision;
use super::fill::{Estimate, fill};
use super::quadrature::Rule;
use super::visible::FacetQuadrature;
use crate::optics::{Lift, Over, Real, Scalar, V3, lifted};
use std::f64::consts::FRAC_2_PI;

/// What the rows of a table go over.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rows<S> {
    One,
    /// Square roots of the widths: a row per diamond angle of (x√αx, y√αy).
    Azimuth([S; 2]),
    Alpha,
}

/// Albedos of a rough surface; see the module.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetTables<S> {
    missing: Vec<S>,
    /// Part after part, sheet after sheet, row after row.
    view: Vec<S>,
    bound: Vec<S>,
    /// Means of M over the cosine-weighted hemisphere, per sheet and row (one row unless α varies).
    means: Vec<S>,
    kind: Rows<S>,
    sheets: usize,
    rows: usize,
    nodes: usize,
    parts: usize,
    steps: Steps<S>,
}

/// Whole numbers that say where in a table to read, as numbers of the kind that is read.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Steps<S> {
    /// Cells over the cosine and the last of them, the same over the rows.
    cells: S,
    last: S,
    row_cells: S,
    last_row: S,
    /// Entries of a row, and of the sheet above.
    row: S,
    sheet: S,
}

impl<S: Real> Steps<S> {
    fn new(sheets: usize, rows: usize, nodes: usize) -> Self {
        Steps {
            cells: count(nodes.max(1) - 1),
            last: count(nodes.max(2) - 2),
            row_cells: count(rows.max(1) - 1),
            last_row: count(rows.max(2) - 2),
            row: count(nodes),
            sheet: count((sheets - 1) * rows * nodes),
        }
    }
}

impl<S: Real> Default for FacetTables<S> {
    fn default() -> Self {
        FacetTables {
            missing: vec![],
            view: vec![],
            bound: vec![],
            means: vec![],
            kind: Rows::One,
            sheets: 1,
            rows: 1,
            nodes: 0,
            parts: 0,
            steps: Steps::new(1, 1, 0),
        }
    }
}

/// Where in a table to read for a direction.
#[derive(Clone, Copy, Debug)]
pub struct FacetPlace<L: Real> {
    start: L,
    across: L,
    row: L,
    lit: L::Mask,
}

impl<S: Scalar> FacetTables<S> {
    /// Whether there is no table: nothing is known of what is missing, and M reads 0.
    pub fn is_empty(&self) -> bool {
        self.missing.is_empty()
    }

    /// Whether parts can be read.
    pub fn has_parts(&self) -> bool {
        self.parts > 0
    }

    /// M(ω), in [0, 1]: 1 − E(ω) or a little less. 0 in the surface, and below one that does not transmit. `alpha` are
    /// the widths at this point.
    #[inline(always)]
    pub fn missing<A: Real<Entry = S>, L: Over<A>>(&self, w: V3<L>, alpha: [A; 2]) -> L {
        self.missing_at(&self.place(w, alpha[0]), alpha)
    }

    /// [`missing`](Self::missing) where it is known where to read.
    #[inline(always)]
    pub fn missing_at<A: Real<Entry = S>, L: Over<A>>(&self, place: &FacetPlace<L>, alpha: [A; 2]) -> L {
        if self.is_empty() {
            return L::zero();
        }
        let missing = self.read(&self.missing, 0, place);
        match self.kind {
            Rows::Alpha => {
                let [x, y] = lifted::<_, L, 2>(alpha);
                L::select(x.lt(y) | y.lt(x), L::zero(), missing)
            }
            _ => missing,
        }
    }

    /// Mean of M over the hemisphere above (or below), weighted with μ/π.
    pub fn mean_missing<A: Real<Entry = S>>(&self, below: bool, alpha: [A; 2]) -> A {
        if self.is_empty() {
            return A::zero();
        }
        let sheet = if below { self.sheets - 1 } else { 0 };
        let Rows::Alpha = self.kind else { return A::gather(&self.means, count::<A>(sheet)) };
        let row = alpha_row(alpha[0]) * count::<A>(self.rows - 1);
        let j = row.whole().min(count::<A>(self.rows - 2));
        let at = count::<A>(sheet * self.rows) + j;
        let (a, b) = (A::gather(&self.means, at), A::gather(&self.means, at + A::one()));
        (b - a).mul_add(row - j, a)
    }

    /// Albedo of each part; 0 where `missing` is.
    #[inline(always)]
    pub fn view<L: Over<S>>(&self, w: V3<L>) -> [L; PARTS] {
        self.parts_at(&self.view, &self.place(w, S::zero()))
    }

    /// Never below the albedo of each part.
    #[inline(always)]
    pub fn bound<L: Over<S>>(&self, w: V3<L>) -> [L; PARTS] {
        self.parts_at(&self.bound, &self.place(w, S::zero()))
    }

    /// [`view`](Self::view) of the first `N` parts where it is known where to read.
    #[inline(always)]
    pub fn view_at<L: Real<Entry = S>, const N: usize>(&self, place: &FacetPlace<L>) -> [L; N] {
        self.parts_at(&self.view, place)
    }

    /// [`bound`](Self::bound) of the first `N` parts where it is known where to read.
    #[inline(always)]
    pub fn bound_at<L: Real<Entry = S>, const N: usize>(&self, place: &FacetPlace<L>) -> [L; N] {
        self.parts_at(&self.bound, place)
    }

    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        (self.missing.len() + self.view.len() + self.bound.len() + self.means.len()) * size_of::<S>()
    }

    /// Parts are there only where the widths do not vary.
    #[inline(always)]
    fn parts_at<L: Real<Entry = S>, const N: usize>(&self, table: &[S], place: &FacetPlace<L>) -> [L; N] {
        let mut parts = [L::zero(); N];
        for (part, value) in parts.iter_mut().enumerate().take(self.parts) {
            *value = self.read(table, part, place);
        }
        parts
    }

    /// Where to read for a direction; `width` is the one that rows may go over.
    #[inline(always)]
    pub fn place<A: Real<Entry = S>, L: Over<A>>(&self, w: V3<L>, width: A) -> FacetPlace<L> {
        let steps = &self.steps;
        let x = w.z.abs().min(L::one()).sqrt().sqrt() * <L as Lift<S>>::lift(steps.cells);
        let i = x.whole().min(<L as Lift<S>>::lift(steps.last));
        let (mut start, mut cos) = (i, w.z);
        if self.sheets == 2 {
            cos = cos.abs();
            start += L::select(w.z.lt(L::zero()), <L as Lift<S>>::lift(steps.sheet), L::zero());
        }
        let (across, lit) = (x - i, cos.gt(L::zero()));
        let row = match self.kind {
            Rows::One => return FacetPlace { start, across, row: L::zero(), lit },
            Rows::Azimuth(roots) => {
                let (x, y) = (w.x.abs() * <L as Lift<S>>::lift(roots[0]), w.y.abs() * <L as Lift<S>>::lift(roots[1]));
                (y / (x + y).max(L::c(1e-30))).min(L::one())
            }
            Rows::Alpha => L::lift(alpha_row(width)),
        };
        let row = row * <L as Lift<S>>::lift(steps.row_cells);
        let j = row.whole().min(<L as Lift<S>>::lift(steps.last_row));
        FacetPlace { start: j.mul_add(<L as Lift<S>>::lift(steps.row), start), across, row: row - j, lit }
    }

    /// 0 in the surface, and below one that does not transmit.
    #[inline(always)]
    fn read<L: Real<Entry = S>>(&self, table: &[S], part: usize, place: &FacetPlace<L>) -> L {
        let start = match part {
            0 => place.start,
            _ => place.start + count::<L>(part * self.sheets * self.rows * self.nodes),
        };
        let low = L::between(table, start, place.across);
        let value = match self.kind {
            Rows::One => low,
            _ => {
                let row = <L as Lift<S>>::lift(self.steps.row);
                let high = L::between(table, start + row, place.across);
                (high - low).mul_add(place.row, low)
            }
        };
        L::select(place.lit, value, L::zero())
    }
}

impl<S: Scalar> FacetTables<S> {
    pub(super) fn cast<T: Scalar>(&self) -> FacetTables<T> {
        let all = |values: &[S]| values.iter().map(|v| T::c(v.to_f64())).collect();
        FacetTables {
            missing: all(&self.missing),
            view: all(&self.view),
            bound: all(&self.bound),
            means: all(&self.means),
            kind: match self.kind {
                Rows::One => Rows::One,
                Rows::Azimuth(roots) => Rows::Azimuth(roots.map(|r| T::c(r.to_f64()))),
                Rows::Alpha => Rows::Alpha,
            },
            sheets: self.sheets,
            rows: self.rows,
            nodes: self.nodes,
            parts: self.parts,
            steps: Steps::new(self.sheets, self.rows, self.nodes),
        }
    }

    /// The directions of the nodes about cosines between `cos.0` and `cos.1` (signed); of one row where the rows are a
    /// width's. What is read between them is linear in what is read there.
    pub fn directions(&self, cos: (f64, f64)) -> impl Iterator<Item = V3<f64>> {
        let last = (self.nodes.max(2) - 1) as f64;
        let rows = if matches!(self.kind, Rows::Alpha) { 1 } else { self.rows };
        let place = |c: f64| c.clamp(0.0, 1.0).sqrt().sqrt() * last;
        let sheet = move |side: f64, lo: f64, hi: f64| {
            let nodes = place(lo).floor() as usize..=place(hi).ceil() as usize;
            let roots = match self.kind {
                Rows::Azimuth(roots) => roots.map(|r| r.to_f64()),
                _ => [1.0; 2],
            };
            nodes.flat_map(move |node| {
                (0..rows).map(move |row| {
                    // Just inside the horizon, where nothing is lit.
                    let cos = (node as f64 / last).powi(4).max(1e-12);
                    let t = row as f64 / (rows.max(2) - 1) as f64;
                    let (sin_phi, cos_phi) = (t * roots[0]).atan2((1.0 - t) * roots[1]).sin_cos();
                    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
                    V3::new(sin * cos_phi, sin * sin_phi, side * cos)
                })
            })
        };
        let above = (cos.1 > 0.0).then(|| sheet(1.0, cos.0, cos.1));
        let below = (cos.0 < 0.0 && self.sheets == 2).then(|| sheet(-1.0, -cos.1, -cos.0));
        above.into_iter().flatten().chain(below.into_iter().flatten())
    }
}

/// A number of entries. By way of 32 bits: from 64 to floating point there is no single instruction.
#[inline(always)]
fn count<L: Real>(n: usize) -> L {
    L::c(f64::from(n as u32))
}

/// The row of a width, in [0, 1].
fn alpha_row<S: Real>(width: S) -> S {
    let low = MIN_ALPHA.sqrt().sqrt();
    let x = (width.max(S::zero()).sqrt().sqrt() - S::c(low)) * S::c(1.0 / (1.0 - low));
    x.clamp(S::zero(), S::one())
}

impl FacetSpec {
    /// Integrates at the nodes, then measures the interpolation between them and lowers M and lifts the bounds by it.
    pub fn bake<S: Scalar>(&self, precision: Precision) -> FacetTables<S> {
        // A power of two steps, as `fill` wants them.
        let steps = |n: usize| 1usize << (n as f64).log2().round() as u32;
        let coarse = (precision.cos_nodes * 3 / 10).clamp(24, 96);
        let (kind, rows, nodes) = match self.alpha {
            None => (Rows::Alpha, steps(precision.axis_nodes.min(48)), coarse),
            Some([x, y]) if x != y => {
                let rows = steps((precision.axis_nodes / 2).clamp(16, 32));
                (Rows::Azimuth([S::c(x.sqrt()), S::c(y.sqrt())]), rows, (coarse * 3 / 2).max(64))
            }
            Some(_) => (Rows::One, 0, precision.cos_nodes * 3 / 2),
        };
        let (rows, nodes) = (rows + 1, steps(nodes) + 1);
        let (sheets, parts) = self.facet.size();
        let parts = if self.alpha.is_some() { parts } else { 0 };
        let grid = Grid { spec: self, rule: FacetQuadrature::new(precision), rows, nodes };
        let plane = rows * nodes;
        // What `fill` says it may miss is an estimate: not to be as large as the margin of a small table.
        let tolerance = precision.margin.min(Precision::STANDARD.margin);
        let fine: Vec<Fine> = (0..sheets).map(|sheet| grid.fine(sheet, tolerance)).collect();
        let albedos: Vec<[Estimate; PARTS + 1]> =
            (0..sheets * plane).map(|k| fine[k / plane].at(2 * (k % plane / nodes), 2 * (k % nodes))).collect();
        let parts_of = |part: usize| albedos.iter().map(move |a| S::c(a[part + 1].0));
        let view: Vec<S> = (0..parts).flat_map(parts_of).collect();
        let mut tables = FacetTables {
            missing: albedos.iter().map(|a| S::c((1.0 - a[0].0).max(0.0))).collect(),
            bound: view.clone(),
            view,
            means: vec![],
            kind,
            sheets,
            rows,
            nodes,
            parts,
            steps: Steps::new(sheets, rows, nodes),
        };
        let lifts = grid.shortfalls(&tables, &fine);
        for (k, lift) in lifts.iter().enumerate() {
            let missing = tables.missing[k].to_f64();
            // Not quite 0, so that between nodes single precision keeps its digits.
            let floor = (0.1 * missing).min(2e-5);
            let margin = |part: usize| lift[part] + 2.0 * precision.margin + albedos[k][part].1;
            tables.missing[k] = S::c((missing - margin(0)).max(floor));
            for part in 0..parts {
                let bound = &mut tables.bound[part * sheets * plane + k];
                *bound = S::c(bound.to_f64() + margin(part + 1));
            }
        }
        let factors = grid.dimmed(&tables, &fine);
        for (missing, factor) in tables.missing.iter_mut().zip(factors) {
            *missing *= S::c(factor);
        }
        tables.means = grid.means(&tables);
        tables
    }
}

/// Steps within a cell in which a part jumps.
const STEPS: usize = 8;

/// Albedos over a table's nodes and half way between them.
struct Fine {
    values: Vec<[Estimate; PARTS + 1]>,
    nodes: usize,
}

impl Fine {
    /// In half steps.
    fn at(&self, row: usize, node: usize) -> [Estimate; PARTS + 1] {
        self.values[row * self.nodes + node]
    }
}

/// The nodes of a table and how to integrate there; fractional indices lie between nodes.
struct Grid<'s> {
    spec: &'s FacetSpec,
    rule: FacetQuadrature,
    rows: usize,
    nodes: usize,
}

impl Grid<'_> {
    /// The direction and the widths at a node.
    fn at(&self, sheet: usize, row: f64, node: f64) -> (V3<f64>, [f64; 2]) {
        // Just above the horizon in place of the horizon itself.
        let cos = (node / (self.nodes - 1) as f64).powi(4).max(1e-12);
        let y = row / (self.rows.max(2) - 1) as f64;
        let (azimuth, alpha) = match self.spec.alpha {
            None => {
                let low = MIN_ALPHA.sqrt().sqrt();
                (0.0, [(low + (1.0 - low) * y).powi(4); 2])
            }
            Some(alpha) if self.rows > 1 => ((y * alpha[0].sqrt()).atan2((1.0 - y) * alpha[1].sqrt()), alpha),
            Some(alpha) => (0.0, alpha),
        };
        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
        (V3::new(sin * azimuth.cos(), sin * azimuth.sin(), if sheet == 0 { cos } else { -cos }), alpha)
    }

    /// The albedos at the nodes, at the middles of the cells and of their edges.
    fn fine(&self, sheet: usize, tolerance: f64) -> Fine {
        let (rows, nodes) = (2 * self.rows - 1, 2 * self.nodes - 1);
        let values = fill(rows, nodes, tolerance, |row, node| {
            let (w, alpha) = self.at(sheet, 0.5 * row as f64, 0.5 * node as f64);
            self.rule.albedos(self.spec, alpha, w)
        });
        Fine { values, nodes }
    }

    /// The middles of cells and of their edges, in half steps.
    fn probes(&self, sheets: usize) -> Vec<(usize, usize, usize)> {
        let mut probes = Vec::new();
        for sheet in 0..sheets {
            for row in 0..2 * self.rows - 1 {
                // Where the row is one of the table's, only what lies between the nodes.
                let nodes = (0..2 * self.nodes - 1).filter(|node| row % 2 == 1 || node % 2 == 1);
                probes.extend(nodes.map(|node| (sheet, row, node)));
            }
        }
        probes
    }

    /// The nodes of the table around a probe.
    fn around(&self, (sheet, row, node): (usize, usize, usize)) -> impl Iterator<Item = usize> + use<> {
        let (rows, nodes) = (self.rows, self.nodes);
        [row / 2, row.div_ceil(2)]
            .into_iter()
            .flat_map(move |r| [node / 2, node.div_ceil(2)].map(|n| (sheet * rows + r) * nodes + n))
    }

    /// What M at the nodes is to be multiplied by, so that neither a probe nor, for a quadratic, what lies half way from it
    /// to a node reads more than is missing there. Where next to nothing is missing at one node, lowering that one does
    /// not do.
    fn dimmed<S: Scalar>(&self, tables: &FacetTables<S>, fine: &[Fine]) -> Vec<f64> {
        let mut factors = vec![1.0f64; tables.sheets * self.rows * self.nodes];
        for probe in self.probes(tables.sheets) {
            let (sheet, row, node) = probe;
            let (w, alpha) = self.at(sheet, 0.5 * row as f64, 0.5 * node as f64);
            let read = tables.missing(w.map(S::c), alpha.map(S::c)).to_f64();
            let (albedo, off) = fine[sheet].at(row, node)[0];
            let missing = (1.0 - albedo - off).max(0.0);
            if read > missing {
                self.around(probe).for_each(|k| factors[k] = factors[k].min((missing / read).powi(2)));
            }
        }
        factors
    }

    /// By how much the truth between the nodes exceeds what is read there: a quarter more than the middles of cells and
    /// of their edges show. E is smooth, and off most in the middle.
    fn shortfalls<S: Scalar>(&self, tables: &FacetTables<S>, fine: &[Fine]) -> Vec<[f64; PARTS + 1]> {
        let probes = self.probes(tables.sheets);
        let missed = probes.iter().map(|&(sheet, row, node)| {
            let truth = fine[sheet].at(row, node);
            let (w, alpha) = self.at(sheet, 0.5 * row as f64, 0.5 * node as f64);
            let (w, alpha) = (w.map(S::c), alpha.map(S::c));
            let read = tables.view(w);
            let mut missed = [truth[0].0 - (1.0 - tables.missing(w, alpha).to_f64()); PARTS + 1];
            for part in 0..tables.parts {
                missed[part + 1] = truth[part + 1].0 - read[part].to_f64();
            }
            missed
        });
        let mut lifts = vec![[0.0f64; PARTS + 1]; tables.sheets * self.rows * self.nodes];
        for (probe, missed) in probes.iter().zip(missed) {
            for k in self.around(*probe) {
                lifts[k] = std::array::from_fn(|c| lifts[k][c].max(1.25 * missed[c]));
            }
        }
        for sheet in 0..tables.sheets {
            for node in self.jumps(sheet) {
                let missed = self.missed_within(tables, sheet, node);
                for lift in &mut lifts[sheet * self.nodes + node..][..2] {
                    *lift = std::array::from_fn(|c| lift[c].max(missed[c]));
                }
            }
        }
        lifts
    }

    /// The cells, by their first node, in which a sheet's parts go over to total reflection too steeply for its nodes.
    /// Only surfaces that are not stretched transmit, so that there is one row.
    fn jumps(&self, sheet: usize) -> std::ops::Range<usize> {
        let (Some(eta), Some([alpha, _])) = (self.spec.facet.beyond(sheet == 1), self.spec.alpha) else { return 0..0 };
        let sin = eta.min(1.0);
        let (critical, reach) = ((1.0 - sin * sin).sqrt(), 4.0 * alpha * sin);
        let cell = |cos: f64| (cos.clamp(0.0, 1.0).sqrt().sqrt() * (self.nodes - 1) as f64) as usize;
        let cells = cell(critical - reach)..(cell(critical + reach) + 1).min(self.nodes - 1);
        if eta < 1.0 && self.rows == 1 && cells.len() <= 8 { cells } else { 0..0 }
    }

    /// By how much the truth may exceed what is read within the cell after a node. Parts rise or fall all the way there:
    /// between two places none exceeds its larger end.
    fn missed_within<S: Scalar>(&self, tables: &FacetTables<S>, sheet: usize, node: usize) -> [f64; PARTS + 1] {
        let at = |step: usize| {
            let (w, alpha) = self.at(sheet, 0.0, node as f64 + step as f64 / STEPS as f64);
            let (truth, read) = (self.rule.albedos(self.spec, alpha, w), tables.view(w.map(S::c)));
            std::array::from_fn(|c| match c {
                0 => (0.0, 0.0),
                _ => (truth[c].0 + truth[c].1, read[c - 1].to_f64()),
            })
        };
        let places: Vec<[(f64, f64); PARTS + 1]> = (0..=STEPS).map(at).collect();
        let missed = |c: usize, w: &[[(f64, f64); PARTS + 1]]| w[0][c].0.max(w[1][c].0) - w[0][c].1.min(w[1][c].1);
        std::array::from_fn(|c| places.windows(2).map(|w| missed(c, w)).fold(0.0, f64::max))
    }

    /// Means of M as it is read, exactly: it is linear between nodes.
    fn means<S: Scalar>(&self, tables: &FacetTables<S>) -> Vec<S> {
        let rule = Rule::gauss_legendre(8);
        let mut over_cos = vec![0.0; self.nodes];
        for cell in 0..self.nodes - 1 {
            for (t, weight) in rule.nodes.iter().zip(&rule.weights) {
                // μ dμ/½ with μ = x⁴.
                let x = (cell as f64 + t) / (self.nodes - 1) as f64;
                let weight = weight * 8.0 * x.powi(7) / (self.nodes - 1) as f64;
                over_cos[cell] += weight * (1.0 - t);
                over_cos[cell + 1] += weight * t;
            }
        }
        let line = |line: &[S]| line.iter().zip(&over_cos).map(|(m, w)| m.to_f64() * w).sum::<f64>();
        let lines: Vec<f64> = tables.missing.chunks(self.nodes).map(line).collect();
        let Some([ax, ay]) = self.spec.alpha.filter(|_| self.rows > 1) else {
            return lines.into_iter().map(S::c).collect();
        };
        // tan φ = t/(k(1 − t)).
        let k = (ay / ax).sqrt();
        let mut over_azimuth = vec![0.0; self.rows];
        for cell in 0..self.rows - 1 {
            for (s, weight) in rule.nodes.iter().zip(&rule.weights) {
                let t = (cell as f64 + s) / (self.rows - 1) as f64;
                let weight = FRAC_2_PI * weight / (self.rows - 1) as f64 * k / ((k * (1.0 - t)).powi(2) + t * t);
                over_azimuth[cell] += weight * (1.0 - s);
                over_azimuth[cell + 1] += weight * s;
            }
        }
        let sheet = |rows: &[f64]| S::c(rows.iter().zip(&over_azimuth).map(|(m, w)| m * w).sum());
        lines.chunks(self.rows).map(sheet).collect()
    }
}
