//! Albedo of rough surfaces: what one bounce between facets leaves over, and how much of it is reflected or refracted.
//!
//! A hemisphere rule would miss a lobe a ten-thousandth of a radian wide. Here E is the mean over visible facets of what
//! each passes on, an integral over the unit square that is as smooth at α = 1e-4 as at 1; along each line of it the
//! places where light goes below the horizon, or is totally reflected, are found by bisection.
//!
//! `missing` is M(ω) ≤ 1 − E(ω), never above it: what the lobe may scatter once more without gaining. Nodes lie over
//! μ^¼, and over the azimuth for a stretched surface or over α^¼ where α varies from point to point. There M is 0
//! for a stretched surface: no simple function of the rows stays above its E.

pub use super::facet::{Facet, FacetKey, FacetSpec, MAX_STRETCH, MIN_ALPHA, PARTS, white};

use super::curve::{Precision, parallel};
use super::quadrature::{Rule, adaptive};
use crate::optics::microfacet::{Facets, mirror};
use crate::optics::{Lift, Real, Scalar, V3};
use std::f64::consts::{FRAC_2_PI, PI, TAU};

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
}

impl<S> Default for FacetTables<S> {
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
        }
    }
}

/// Where in a table to read.
#[derive(Clone, Copy, Debug)]
struct Place<L> {
    start: L,
    across: L,
    row: L,
}

impl<S: Real> FacetTables<S> {
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
    pub fn missing<L: Real + Lift<S>>(&self, w: V3<L>, alpha: [S; 2]) -> L {
        if self.is_empty() {
            return L::zero();
        }
        let missing = self.read(&self.missing, 0, self.place(w, alpha[0]));
        let missing = match self.kind {
            Rows::Alpha => {
                let [x, y] = alpha.map(L::lift);
                L::select(x.lt(y) | y.lt(x), L::zero(), missing)
            }
            _ => missing,
        };
        self.lit(w, missing)
    }

    /// Mean of M over the hemisphere above (or below), weighted with μ/π.
    pub fn mean_missing(&self, below: bool, alpha: [S; 2]) -> S {
        if self.is_empty() {
            return S::zero();
        }
        let sheet = if below { self.sheets - 1 } else { 0 };
        let Rows::Alpha = self.kind else { return S::gather(&self.means, S::c(sheet as f64)) };
        let row = alpha_row(alpha[0]) * S::c((self.rows - 1) as f64);
        let j = row.floor().min(S::c((self.rows - 2) as f64));
        let at = S::c((sheet * self.rows) as f64) + j;
        let (a, b) = (S::gather(&self.means, at), S::gather(&self.means, at + S::one()));
        (b - a).mul_add(row - j, a)
    }

    /// Albedo of each part; 0 where `missing` is.
    pub fn view<L: Real + Lift<S>>(&self, w: V3<L>) -> [L; PARTS] {
        self.parts_of(&self.view, w)
    }

    /// Never below the albedo of each part.
    #[inline(always)]
    pub fn bound<L: Real + Lift<S>>(&self, w: V3<L>) -> [L; PARTS] {
        self.parts_of(&self.bound, w)
    }

    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        (self.missing.len() + self.view.len() + self.bound.len() + self.means.len()) * size_of::<S>()
    }

    #[inline(always)]
    fn parts_of<L: Real + Lift<S>>(&self, table: &[S], w: V3<L>) -> [L; PARTS] {
        let mut result = [L::zero(); PARTS];
        if self.parts > 0 {
            // Parts are there only where the widths do not vary.
            let place = self.place(w, S::zero());
            for (part, result) in result.iter_mut().enumerate().take(self.parts) {
                *result = self.lit(w, self.read(table, part, place));
            }
        }
        result
    }

    #[inline(always)]
    fn lit<L: Real>(&self, w: V3<L>, value: L) -> L {
        let cos = if self.sheets == 2 { w.z.abs() } else { w.z };
        L::select(cos.gt(L::zero()), value, L::zero())
    }

    #[inline(always)]
    fn place<L: Real + Lift<S>>(&self, w: V3<L>, width: S) -> Place<L> {
        let last = |n: usize| L::c((n.max(2) - 2) as f64);
        let x = w.z.abs().min(L::one()).sqrt().sqrt() * L::c((self.nodes - 1) as f64);
        let i = x.floor().min(last(self.nodes));
        let row = match self.kind {
            Rows::One => L::zero(),
            Rows::Azimuth(roots) => {
                let (x, y) = (w.x.abs() * L::lift(roots[0]), w.y.abs() * L::lift(roots[1]));
                (y / (x + y).max(L::c(1e-30))).min(L::one())
            }
            Rows::Alpha => L::lift(alpha_row(width)),
        };
        let row = row * L::c((self.rows - 1) as f64);
        let j = row.floor().min(last(self.rows));
        let below = L::c(((self.sheets - 1) * self.rows * self.nodes) as f64);
        let sheet = L::select(w.z.lt(L::zero()), below, L::zero());
        Place { start: sheet + j.mul_add(L::c(self.nodes as f64), i), across: x - i, row: row - j }
    }

    #[inline(always)]
    fn read<L: Real + Lift<S>>(&self, table: &[S], part: usize, place: Place<L>) -> L {
        let start = place.start + L::c((part * self.sheets * self.rows * self.nodes) as f64);
        let line = |at: L| {
            let (a, b) = (L::gather(table, at), L::gather(table, at + L::one()));
            (b - a).mul_add(place.across, a)
        };
        let low = line(start);
        if self.rows == 1 {
            return low;
        }
        let high = line(start + L::c(self.nodes as f64));
        (high - low).mul_add(place.row, low)
    }
}

impl<S: Scalar> FacetTables<S> {
    pub(super) fn in_double(&self) -> FacetTables<f64> {
        let all = |values: &[S]| values.iter().map(|v| v.to_f64()).collect();
        FacetTables {
            missing: all(&self.missing),
            view: all(&self.view),
            bound: all(&self.bound),
            means: all(&self.means),
            kind: match self.kind {
                Rows::One => Rows::One,
                Rows::Azimuth(roots) => Rows::Azimuth(roots.map(S::to_f64)),
                Rows::Alpha => Rows::Alpha,
            },
            sheets: self.sheets,
            rows: self.rows,
            nodes: self.nodes,
            parts: self.parts,
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

/// The row of a width, in [0, 1].
fn alpha_row<S: Real>(width: S) -> S {
    let low = MIN_ALPHA.sqrt().sqrt();
    let x = (width.max(S::zero()).sqrt().sqrt() - S::c(low)) * S::c(1.0 / (1.0 - low));
    x.clamp(S::zero(), S::one())
}

impl FacetSpec {
    /// Integrates at the nodes, then measures the interpolation between them and lowers M and lifts the bounds by it.
    pub fn bake<S: Scalar>(&self, precision: Precision) -> FacetTables<S> {
        let coarse = (precision.cos_nodes * 3 / 10).clamp(24, 96);
        let (kind, rows, nodes) = match self.alpha {
            None => (Rows::Alpha, precision.axis_nodes.min(48), coarse),
            Some([x, y]) if x != y => {
                let rows = (precision.axis_nodes / 2).clamp(8, 32);
                (Rows::Azimuth([S::c(x.sqrt()), S::c(y.sqrt())]), rows, coarse * 3 / 2)
            }
            Some(_) => (Rows::One, 1, precision.cos_nodes * 3 / 2),
        };
        let (sheets, parts) = self.facet.size();
        let parts = if self.alpha.is_some() { parts } else { 0 };
        let grid = Grid { spec: self, rule: FacetQuadrature::new(precision), rows, nodes };
        let plane = rows * nodes;
        let places: Vec<usize> = (0..sheets * plane).collect();
        let albedos = parallel(&places, |&k| grid.albedos(k / plane, (k % plane / nodes) as f64, (k % nodes) as f64));
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
        };
        let lifts = grid.shortfalls(&tables);
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
        tables.means = grid.means(&tables);
        tables
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

    fn albedos(&self, sheet: usize, row: f64, node: f64) -> [(f64, f64); PARTS + 1] {
        let (w, alpha) = self.at(sheet, row, node);
        self.rule.albedos(self.spec, alpha, w)
    }

    /// By how much the truth between the nodes exceeds what is read there: a quarter more than the middles of cells and
    /// of their edges show. E is smooth, and off most in the middle.
    fn shortfalls<S: Scalar>(&self, tables: &FacetTables<S>) -> Vec<[f64; PARTS + 1]> {
        let mut probes: Vec<(usize, f64, f64)> = Vec::new();
        for sheet in 0..tables.sheets {
            for half in 0..2 * self.rows - 1 {
                let row = half as f64 / 2.0;
                probes.extend((0..self.nodes - 1).map(|n| (sheet, row, n as f64 + 0.5)));
                if half % 2 == 1 {
                    probes.extend((0..self.nodes).map(|n| (sheet, row, n as f64)));
                }
            }
        }
        let missed = parallel(&probes, |&(sheet, row, node)| {
            let (w, alpha) = self.at(sheet, row, node);
            let truth = self.rule.albedos(self.spec, alpha, w);
            let (w, alpha) = (w.map(S::c), alpha.map(S::c));
            let read = tables.view(w);
            let mut missed = [truth[0].0 - (1.0 - tables.missing(w, alpha).to_f64()); PARTS + 1];
            for part in 0..tables.parts {
                missed[part + 1] = truth[part + 1].0 - read[part].to_f64();
            }
            missed
        });
        let mut lifts = vec![[0.0f64; PARTS + 1]; tables.sheets * self.rows * self.nodes];
        for (&(sheet, row, node), missed) in probes.iter().zip(missed) {
            for r in [row.floor() as usize, row.ceil() as usize] {
                for n in [node.floor() as usize, node.ceil() as usize] {
                    let lift = &mut lifts[(sheet * self.rows + r) * self.nodes + n];
                    *lift = std::array::from_fn(|c| lift[c].max(1.25 * missed[c]));
                }
            }
        }
        lifts
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

/// A rule over visible facets.
pub struct FacetQuadrature {
    along: Rule,
    /// What each piece may be off by around the azimuth.
    error: f64,
}

/// Where along a line the kind of facet is looked at.
const STEPS: usize = 16;
/// Most halvings of a piece around the azimuth.
const HALVINGS: usize = 6;

impl FacetQuadrature {
    /// As fine as a precision asks for.
    pub fn new(precision: Precision) -> Self {
        FacetQuadrature { along: Rule::gauss_legendre(precision.polar), error: precision.margin }
    }

    /// E and its parts at `w`, whose z may be negative for a dielectric; and how far off they may be.
    pub fn albedos(&self, spec: &FacetSpec, alpha: [f64; 2], w: V3<f64>) -> [(f64, f64); PARTS + 1] {
        let facets = Facets::new(spec.shape, alpha);
        let wo = V3::new(w.x, w.y, w.z.abs());
        let (facet, below) = (spec.facet, w.z < 0.0);
        let (reach, proposal) = (facets.reach(wo), facets.proposal().reach(wo));
        let seen = Seen { facets: &facets, facet, beyond: facet.beyond(below), below, wo, reach, proposal };
        // About the azimuth of ωo as the stretched surface sees it. Half the circle will do where the other half is its
        // mirror image.
        let start = (wo.y * alpha[1]).atan2(wo.x * alpha[0]);
        let turns: &[f64] = if alpha[0] == alpha[1] { &[1.0] } else { &[1.0, -1.0] };
        let mut sums = [(0.0, 0.0); PARTS + 1];
        for turn in turns {
            let halves = self.half(&seen, |v| (start + turn * PI * (1.0 - v * v)) / TAU);
            for (sum, (value, off)) in sums.iter_mut().zip(halves) {
                let share = 1.0 / turns.len() as f64;
                *sum = (sum.0 + share * value, sum.1 + share * off);
            }
        }
        facet.total(sums)
    }

    /// The mean over half the azimuths, and how far off it may be; `azimuth` is graded toward the far end, where at grazing angles
    /// facets seen edge-on meet. Lines run from the facet that is seen best and are graded toward the steepest ones, among
    /// which a narrow surface keeps everything that is not quite smooth.
    fn half(&self, seen: &Seen<'_>, azimuth: impl Fn(f64) -> f64) -> [(f64, f64); PARTS + 1] {
        let line = |v: f64| {
            let u0 = azimuth(v);
            move |s: f64| seen.facets.visible(seen.wo, [u0, 1.0 - (1.0 - s) * (1.0 - s)])
        };
        let kinds =
            |v: f64| changes(|s| seen.kind(line(v)(s)), STEPS).into_iter().map(|piece| piece.1).collect::<Vec<_>>();
        let ends = changes(kinds, 2 * STEPS);
        let mut inner = |v: f64| {
            let line = line(v);
            let (mut sums, mut low) = ([0.0; PARTS + 1], 0.0);
            for (edge, _) in changes(|s| seen.kind(line(s)), STEPS) {
                for (s, weight) in self.along.between(low, edge) {
                    let weight = weight * 2.0 * (1.0 - s) * 2.0 * v;
                    for (sum, value) in sums.iter_mut().zip(seen.values(line(s))) {
                        *sum += weight * value;
                    }
                }
                low = edge;
            }
            sums
        };
        let (mut total, mut from) = ([(0.0, 0.0); PARTS + 1], 0.0);
        for (to, _) in ends {
            let piece = adaptive((from, to), self.error, HALVINGS, &mut inner);
            total = std::array::from_fn(|i| (total[i].0 + piece[i].0, total[i].1 + piece[i].1));
            from = to;
        }
        total
    }
}

/// The pieces of [0, 1] on which a value stays the same, as far as steps of 1/`steps` show it: their ends, and the value.
fn changes<T: PartialEq>(of: impl Fn(f64) -> T, steps: usize) -> Vec<(f64, T)> {
    let mut pieces = Vec::new();
    let (mut last, mut value) = (0.0, of(0.0));
    for k in 1..=steps {
        let next = k as f64 / steps as f64;
        // A step may hold several changes.
        while of(next) != value {
            let (mut lo, mut hi) = (last, next);
            for _ in 0..14 {
                let middle = 0.5 * (lo + hi);
                if of(middle) == value { lo = middle } else { hi = middle }
            }
            pieces.push((hi, std::mem::replace(&mut value, of(hi))));
            last = hi;
        }
        last = next;
    }
    pieces.push((1.0, value));
    pieces
}

/// A surface seen from one direction.
struct Seen<'f> {
    facets: &'f Facets<f64>,
    facet: Facet,
    /// See [`Facet::beyond`].
    beyond: Option<f64>,
    below: bool,
    wo: V3<f64>,
    reach: f64,
    proposal: f64,
}

impl Seen<'_> {
    /// Cosine of the facet, and the mirrored and the refracted direction; the last is `None` if totally reflected.
    fn directions(&self, h: V3<f64>) -> (f64, V3<f64>, Option<V3<f64>>) {
        let h = h.scale(1.0 / h.length_squared().sqrt().max(1e-300));
        let c = self.wo.dot(h).max(0.0);
        let refracted = self.beyond.and_then(|eta| {
            let cos2 = 1.0 - (1.0 - c * c) / (eta * eta);
            (cos2 > 0.0).then(|| h.scale(c / eta - cos2.sqrt()) - self.wo.scale(1.0 / eta))
        });
        (c, mirror(self.wo, h), refracted)
    }

    fn kind(&self, h: V3<f64>) -> (bool, Option<bool>) {
        let (_, up, down) = self.directions(h);
        (up.z > 0.0, down.map(|w| w.z < 0.0))
    }

    fn values(&self, h: V3<f64>) -> [f64; PARTS + 1] {
        let (c, up, down) = self.directions(h);
        let ratio = self.facets.d(h) / self.facets.proposal().d(h).max(1e-300);
        // f·μ/pdf of the proposal, for light reflected and refracted alike.
        let passed = |wi: V3<f64>| {
            let cos = wi.z.abs();
            let shadowed = cos * self.reach + self.wo.z * self.facets.reach(wi);
            ratio * cos * (self.wo.z + self.proposal) / shadowed.max(1e-300)
        };
        let reflected = if up.z > 0.0 { passed(up) } else { 0.0 };
        // Of the bent direction: its cosine with the facet, and what passes on.
        let bent = down.zip(self.beyond).map(|(w, eta)| {
            let cos = (1.0 - (1.0 - c * c) / (eta * eta)).max(0.0).sqrt();
            (cos, if w.z < 0.0 { passed(w) } else { 0.0 })
        });
        self.facet.parts(self.below, (c, reflected), bent)
    }
}
