//! Albedo of lobes that follow a thread: over the angle along it, the angle around it, or one varying parameter.
//!
//! The thread runs along x, the normal is z. θ is the angle to the plane across the thread (sin θ = x), φ the angle
//! around it from the normal. A ridge θi = −θo, as narrow as a degree, is what a rule over (μ, azimuth) would miss, so
//! table and quadrature live in (θ, φ). Both node coordinates are square roots of diamond angles: cheap to read, fine
//! toward the thread's poles and toward the horizon.
//!
//! A lobe may be a sum of up to three components, each tabulated, whose colors are known only when shading. All lobes
//! here are reciprocal, so one albedo serves both sides. `bound` is lifted by the shortfall of the interpolation,
//! measured between the nodes.

use super::curve::{AlbedoCurve, CurveSpec, Precision, parallel};
use super::facets::FacetSpec;
use super::quadrature::Rule;
use crate::optics::{Lift, Real, Scalar, V3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Most components of a lobe.
pub const COMPONENTS: usize = 3;
/// The parameters of a lobe that its tables depend on.
pub type FibreKey = [f64; 16];
/// The components of f(ωo, ωi) for many ωi: `(key, ωo, ωi, out)`.
pub type FibreKernel = fn(&FibreKey, V3<f64>, &[V3<f64>], &mut [[f64; COMPONENTS]]);

/// What to bake for a lobe that follows a thread.
#[derive(Clone, Copy, Debug)]
pub struct FibreSpec {
    /// The components of f.
    pub kernel: FibreKernel,
    /// What the kernel is given.
    pub key: FibreKey,
    /// How many of the components are in use.
    pub components: usize,
    /// Which entry of the key varies, if one does: it runs over [0, 1], and the table holds the largest albedo over φ.
    pub axis: Option<usize>,
    /// Width of the ridge in θi, in radians: what the quadrature must resolve.
    pub width: f64,
    /// Whether the albedo depends on φ.
    pub around: bool,
    /// Scales the number of nodes and of quadrature points: less than 1 for lobes that are smooth but slow.
    pub detail: f64,
    /// What the bound is lifted by beyond what the precision asks for, relative to the albedo: for kinks that the
    /// quadrature does not follow.
    pub margin: f64,
    /// Whether the albedo is even in x.
    pub mirrored: bool,
}

impl PartialEq for FibreSpec {
    fn eq(&self, o: &Self) -> bool {
        let parts = |s: &Self| (s.key, s.components, s.axis, s.width, s.around, s.detail, s.margin, s.mirrored);
        std::ptr::fn_addr_eq(self.kernel, o.kernel) && parts(self) == parts(o)
    }
}

/// The albedo table a lobe asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)]
pub enum TableSpec {
    /// Over the cosine: isotropic lobes.
    Cosine(CurveSpec),
    /// Around a thread.
    Fibre(FibreSpec),
    /// Of rough surfaces.
    Facets(FacetSpec),
}

impl TableSpec {
    /// Integrates the albedos and lifts the bound by the measured interpolation error.
    pub fn bake<S: Scalar>(&self, precision: Precision) -> AlbedoCurve<S> {
        match self {
            TableSpec::Cosine(spec) => spec.bake(precision),
            TableSpec::Fibre(spec) => {
                let mut curve = AlbedoCurve::default();
                curve.fibre = spec.bake(precision);
                curve
            }
            TableSpec::Facets(spec) => {
                let mut curve = AlbedoCurve::default();
                curve.facets = spec.bake(precision);
                curve
            }
        }
    }
}

/// Albedo and bound per component around a thread.
#[derive(Clone, Debug, PartialEq)]
pub struct FibreTables<S> {
    /// Component after component, then x ≥ 0 and x < 0 if they differ, then row after row, `nodes` each.
    view: Vec<S>,
    bound: Vec<S>,
    components: usize,
    sheets: usize,
    rows: usize,
    nodes: usize,
    /// Rows go over this entry of the key in place of φ.
    axis: Option<usize>,
}

impl<S> Default for FibreTables<S> {
    fn default() -> Self {
        FibreTables { view: vec![], bound: vec![], components: 0, sheets: 1, rows: 1, nodes: 0, axis: None }
    }
}

impl<S: Real> FibreTables<S> {
    /// Whether nothing was baked, because too many parameters vary.
    pub fn is_empty(&self) -> bool {
        self.view.is_empty()
    }

    /// Which entry of the key varies.
    pub fn axis_index(&self) -> Option<usize> {
        self.axis
    }

    /// Albedo per component; `t` is the varying parameter in [0, 1], ignored if none varies. 0 below the surface.
    #[inline(always)]
    pub fn view<L: Real + Lift<S>>(&self, w: V3<L>, t: L) -> [L; COMPONENTS] {
        self.read(&self.view, w, t)
    }

    /// Never below the albedo per component; 0 below the surface.
    #[inline(always)]
    pub fn bound<L: Real + Lift<S>>(&self, w: V3<L>, t: L) -> [L; COMPONENTS] {
        self.read(&self.bound, w, t)
    }

    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        (self.view.len() + self.bound.len()) * size_of::<S>()
    }

    #[inline(always)]
    fn read<L: Real + Lift<S>>(&self, table: &[S], w: V3<L>, t: L) -> [L; COMPONENTS] {
        let mut result = [L::zero(); COMPONENTS];
        if table.is_empty() {
            return result;
        }
        let tiny = L::c(1e-30);
        let up = w.z.gt(L::zero());
        let z = w.z.max(L::zero());
        let across = w.y.mul_add(w.y, z * z).sqrt();
        let cell = |x: L, n: usize| {
            let x = x.clamp(L::zero(), L::one()) * L::c((n - 1) as f64);
            let i = x.floor().min(L::c((n.max(2) - 2) as f64));
            (i, x - i)
        };
        let (i, s) = cell((across / (across + w.x.abs()).max(tiny)).sqrt(), self.nodes);
        let row = if self.axis.is_some() { t } else { (z / (z + w.y.abs()).max(tiny)).sqrt() };
        let (j, r) = cell(row, self.rows);
        let sheet = if self.sheets == 2 {
            L::select(w.x.lt(L::zero()), L::c((self.rows * self.nodes) as f64), L::zero())
        } else {
            L::zero()
        };
        let start = sheet + j.mul_add(L::c(self.nodes as f64), i);
        let line = |at: L| {
            let (a, b) = (L::gather(table, at), L::gather(table, at + L::one()));
            (b - a).mul_add(s, a)
        };
        for (c, result) in result.iter_mut().enumerate().take(self.components) {
            let at = start + L::c((c * self.sheets * self.rows * self.nodes) as f64);
            let low = line(at);
            let value = if self.rows == 1 {
                low
            } else {
                let high = line(at + L::c(self.nodes as f64));
                (high - low).mul_add(r, low)
            };
            *result = L::select(up, value, L::zero());
        }
        result
    }
}

/// Angles around the thread, in degrees, whose largest albedo a table over a varying parameter holds.
const TURNS: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 89.99];

impl FibreSpec {
    /// Integrates the components at the nodes, then measures the interpolation between them and lifts the bound.
    pub fn bake<S: Scalar>(&self, precision: Precision) -> FibreTables<S> {
        let scaled = |count: usize| (count as f64 * self.detail) as usize;
        let size = scaled(precision.cos_nodes);
        let precision = Precision { polar: scaled(precision.polar), ..precision };
        let flat = !self.around && self.axis.is_none();
        let nodes = if flat { size } else { (size / if self.axis.is_some() { 6 } else { 4 }).clamp(14, 64) };
        let rows = match self.axis {
            Some(_) if self.around => (precision.axis_nodes / 2).max(8),
            Some(_) => precision.axis_nodes,
            None if self.around => (size / if self.detail < 1.0 { 6 } else { 10 }).clamp(8, 28),
            None => 1,
        };
        let sheets = if self.mirrored { 1 } else { 2 };
        let grid = Grid { spec: self, rule: FibreQuadrature::new(precision), rows, nodes };

        let plane = rows * nodes;
        let places: Vec<usize> = (0..sheets * plane).collect();
        let albedos = parallel(&places, |&k| {
            let (sheet, row, node) = (k / plane, k % plane / nodes, k % nodes);
            grid.albedos(sheet, row as f64, node as f64)
        });
        let component = |c: usize| albedos.iter().map(move |a| a[c]);
        let table: Vec<S> = (0..self.components).flat_map(component).map(S::c).collect();
        let mut tables = FibreTables {
            bound: table.clone(),
            view: table,
            components: self.components,
            sheets,
            rows,
            nodes,
            axis: self.axis,
        };
        let lifts = grid.shortfalls(&tables);
        for (c, chunk) in tables.bound.chunks_mut(sheets * plane).enumerate() {
            for (bound, lift) in chunk.iter_mut().zip(&lifts) {
                // Relative as well: these albedos may be far above 1.
                *bound = *bound * S::c(1.0 + precision.margin + self.margin) + S::c(precision.margin + lift[c]);
            }
        }
        tables
    }
}

/// The nodes of a table and how to integrate there; fractional indices lie between nodes.
struct Grid<'s> {
    spec: &'s FibreSpec,
    rule: FibreQuadrature,
    rows: usize,
    nodes: usize,
}

impl Grid<'_> {
    fn parameter(&self, row: f64) -> f64 {
        row / (self.rows.max(2) - 1) as f64
    }

    /// The direction at a node; just above the horizon in place of the horizon itself.
    fn direction(&self, sheet: usize, row: f64, node: f64) -> V3<f64> {
        let along = (node / (self.nodes - 1) as f64).powi(2).max(1e-9);
        let around = match self.spec.axis {
            None if self.rows > 1 => (row / (self.rows - 1) as f64).powi(2),
            _ => 1.0,
        };
        let unit = |a: f64, b: f64| (a / a.hypot(b), b / a.hypot(b));
        let (cos, sin) = unit(along, 1.0 - along);
        let (z, y) = unit(around.max(1e-12), 1.0 - around);
        V3::new(if sheet == 0 { sin } else { -sin }, cos * y, cos * z)
    }

    fn albedos(&self, sheet: usize, row: f64, node: f64) -> [f64; COMPONENTS] {
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
    /// for what lies between the probes.
    fn shortfalls<S: Scalar>(&self, tables: &FibreTables<S>) -> Vec<[f64; COMPONENTS]> {
        let (rows, nodes) = (self.rows, self.nodes);
        // In cells: the middles of cells and of their edges between rows; the last cell of the first band more often,
        // because its corner is a pole of the threads across, about which the albedo turns within any distance.
        let mut probes: Vec<(usize, f64, f64)> = Vec::new();
        for sheet in 0..tables.sheets {
            for half in 0..2 * rows - 1 {
                probes.extend((0..nodes - 1).map(|n| (sheet, half as f64 / 2.0, n as f64 + 0.5)));
                // A full step along the rows lies on a node.
                if half % 2 == 1 {
                    probes.extend((0..nodes).map(|n| (sheet, half as f64 / 2.0, n as f64)));
                }
            }
            if self.spec.around && self.spec.axis.is_none() {
                const NEAR: [f64; 6] = [1e-3, 0.01, 0.04, 0.12, 0.3, 0.7];
                let last = (nodes - 1) as f64;
                probes.extend(NEAR.iter().flat_map(|r| NEAR.map(|n| (sheet, *r, last - n * n))));
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

/// A product rule over (θi, φi), split at the ridge θi = −θo and graded toward it.
pub struct FibreQuadrature {
    along: Rule,
    around: Vec<(f64, f64, f64)>,
}

impl FibreQuadrature {
    /// `polar` points on each side of the ridge, `azimuth` around the thread.
    pub fn new(precision: Precision) -> Self {
        let around = Rule::gauss_legendre(precision.azimuth.min(32));
        let point = |(u, w): (&f64, &f64)| {
            // Graded toward the horizon, where the other family of a cloth has its poles.
            let v = 2.0 * u - 1.0;
            let (sin, cos) = (FRAC_PI_2 * 0.5 * v * (3.0 - v * v)).sin_cos();
            (sin, cos, w * PI * 1.5 * (1.0 - v * v) * cos)
        };
        FibreQuadrature {
            along: Rule::gauss_legendre(precision.polar.min(40)),
            around: around.nodes.iter().zip(&around.weights).map(point).collect(),
        }
    }

    /// ∫ f·μ over the other direction, per component.
    pub fn albedos(&self, spec: &FibreSpec, key: &FibreKey, w: V3<f64>) -> [f64; COMPONENTS] {
        let ridge = -w.x.atan2(w.y.hypot(w.z));
        let mut ring = vec![w; self.around.len()];
        let mut values = vec![[0.0; COMPONENTS]; self.around.len()];
        let mut sums = [0.0; COMPONENTS];
        for length in [FRAC_PI_2 - ridge, -FRAC_PI_2 - ridge] {
            if length.abs() < 1e-9 {
                continue;
            }
            // θ = ridge + length·uᵖ: a third of the points lie within the ridge's width.
            let power = ((spec.width / length.abs()).ln() / 0.35f64.ln()).clamp(1.0, 6.0);
            for (u, weight) in self.along.nodes.iter().zip(&self.along.weights) {
                let (sin, cos) = (ridge + length * u.powf(power)).sin_cos();
                let weight = weight * length.abs() * power * u.powf(power - 1.0) * cos * cos;
                for (wi, &(y, z, _)) in ring.iter_mut().zip(&self.around) {
                    *wi = V3::new(sin, cos * y, cos * z);
                }
                (spec.kernel)(key, w, &ring, &mut values);
                for (value, a) in values.iter().zip(&self.around) {
                    for c in 0..spec.components {
                        sums[c] += weight * a.2 * value[c];
                    }
                }
            }
        }
        sums
    }
}
