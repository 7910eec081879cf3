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

use super::bends::bends;
use super::curve::{AlbedoCurve, CurveSpec, Precision, parallel};
#[cfg(feature = "microfacet")]
use super::facets::FacetSpec;
use super::grid::{Grid, direction, first_place};
use super::panels::Panels;
use super::quadrature::Rule;
use crate::optics::{Over, Real, Scalar, V3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Most components of a lobe.
pub const COMPONENTS: usize = 3;
/// Most offsets of a family of threads.
pub const OFFSETS: usize = 5;
/// Below this cosine a cloth is taken to be as it is here: its f is a quotient of small numbers at its horizons, and its
/// tables have to end somewhere.
pub const HORIZON: f64 = 1e-5;
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
    /// For a cloth of two families of threads, along x and along y, the ridges of each. The kernel is then asked for one
    /// family's part of f at a time, 0 or 1 in the last entry of the key, and that is integrated about its own threads.
    pub weave: Option<[Ridges; 2]>,
}

/// Where the ridges of a family of threads lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ridges {
    /// Standard deviation of one ridge in θi, in radians.
    pub width: f64,
    /// How far from θi = −θo they may lie, in radians.
    pub reach: f64,
    /// How far the family's tangents bend out of the surface, in radians: each has a horizon of its own.
    pub offsets: [f64; OFFSETS],
}

impl PartialEq for FibreSpec {
    fn eq(&self, o: &Self) -> bool {
        let parts = |s: &Self| (s.key, s.components, s.axis, s.width, s.around, s.detail, s.margin, s.mirrored);
        std::ptr::fn_addr_eq(self.kernel, o.kernel) && parts(self) == parts(o) && self.weave == o.weave
    }
}

/// The albedo table a lobe asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)]
pub enum TableSpec {
    /// Over the cosine: isotropic lobes.
    Cosine(CurveSpec),
    /// Around a thread.
    #[cfg(feature = "cloth")]
    Fibre(FibreSpec),
    /// Of rough surfaces.
    #[cfg(feature = "microfacet")]
    Facets(FacetSpec),
}

impl TableSpec {
    /// Integrates the albedos and lifts the bound by the measured interpolation error.
    pub fn bake<S: Scalar>(&self, precision: Precision) -> AlbedoCurve<S> {
        match self {
            TableSpec::Cosine(spec) => spec.bake(precision),
            #[cfg(feature = "cloth")]
            TableSpec::Fibre(spec) => {
                let mut curve = AlbedoCurve::default();
                curve.fibre = spec.bake(precision);
                curve
            }
            #[cfg(feature = "microfacet")]
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
    pub(super) sheets: usize,
    rows: usize,
    nodes: usize,
    /// Rows go over this entry of the key in place of φ.
    axis: Option<usize>,
    /// There are threads along y as well: nodes are dense toward the poles of both families.
    crossed: bool,
}

impl<S> Default for FibreTables<S> {
    fn default() -> Self {
        FibreTables {
            view: vec![],
            bound: vec![],
            components: 0,
            sheets: 1,
            rows: 1,
            nodes: 0,
            axis: None,
            crossed: false,
        }
    }
}

impl<S: Scalar> FibreTables<S> {
    pub(super) fn cast<T: Scalar>(&self) -> FibreTables<T> {
        let all = |values: &[S]| values.iter().map(|v| T::c(v.to_f64())).collect();
        FibreTables {
            view: all(&self.view),
            bound: all(&self.bound),
            components: self.components,
            sheets: self.sheets,
            rows: self.rows,
            nodes: self.nodes,
            axis: self.axis,
            crossed: self.crossed,
        }
    }
}

impl<S: Scalar> FibreTables<S> {
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
    pub fn view<L: Over<S>>(&self, w: V3<L>, t: L) -> [L; COMPONENTS] {
        self.read(&self.view, w, t)
    }

    /// Never below the albedo per component; 0 below the surface.
    #[inline(always)]
    pub fn bound<L: Over<S>>(&self, w: V3<L>, t: L) -> [L; COMPONENTS] {
        self.read(&self.bound, w, t)
    }

    /// The largest bound per component over all directions and the varying parameter: that of a node.
    pub fn highest(&self) -> [f64; COMPONENTS]
    where
        S: Scalar,
    {
        let mut highest = [0.0f64; COMPONENTS];
        let plane = self.sheets * self.rows * self.nodes;
        for (highest, chunk) in highest.iter_mut().zip(self.bound.chunks(plane.max(1))) {
            *highest = chunk.iter().fold(0.0, |a, b| a.max(b.to_f64()));
        }
        highest
    }

    /// The directions of the nodes, of one row where the rows are a parameter's.
    pub fn directions(&self) -> impl Iterator<Item = V3<f64>> {
        let (sheets, rows, nodes) = (self.sheets, self.rows, self.nodes);
        let around = self.axis.is_none() && rows > 1;
        (0..sheets * rows * nodes).map(move |k| {
            let (sheet, row, node) = (k / (rows * nodes), k % (rows * nodes) / nodes, k % nodes);
            let row = if around { row as f64 / (rows - 1) as f64 } else { 1.0 };
            direction(sheet, row, node as f64 / (nodes.max(2) - 1) as f64, self.crossed)
        })
    }

    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        (self.view.len() + self.bound.len()) * size_of::<S>()
    }

    #[inline(always)]
    fn read<L: Over<S>>(&self, table: &[S], w: V3<L>, t: L) -> [L; COMPONENTS] {
        let mut result = [L::zero(); COMPONENTS];
        if table.is_empty() {
            return result;
        }
        let tiny = L::c(1e-30);
        let up = w.z.gt(L::zero());
        let z = w.z.max(L::zero());
        let across = w.y.mul_add(w.y, z * z).sqrt();
        let inv = L::one() / (across + w.x.abs()).max(tiny);
        let place = if self.crossed {
            let half = L::c(0.5).sqrt();
            let (near, far) = (half * (across * inv).sqrt(), L::one() - half * (w.x.abs() * inv).sqrt());
            L::select(across.lt(w.x.abs()), near, far)
        } else {
            (across * inv).sqrt()
        };
        let row = if self.axis.is_some() { t } else { (z / (z + w.y.abs()).max(tiny)).sqrt() };
        let (place, row) = if self.crossed {
            let from = |x: L, first: f64| (x - L::c(first)) * L::c(1.0 / (1.0 - first));
            (from(place, first_place()), from(row, HORIZON.sqrt()))
        } else {
            (place, row)
        };
        let ((i, s), (j, r)) = (cell(place, self.nodes), cell(row, self.rows));
        let sheet = if self.sheets == 2 {
            L::select(w.x.lt(L::zero()), L::c((self.rows * self.nodes) as f64), L::zero())
        } else {
            L::zero()
        };
        let start = sheet + j.mul_add(L::c(self.nodes as f64), i);
        for (c, result) in result.iter_mut().enumerate().take(self.components) {
            let at = start + L::c((c * self.sheets * self.rows * self.nodes) as f64);
            let low = L::between(table, at, s);
            let value = if self.rows == 1 {
                low
            } else {
                let high = L::between(table, at + L::c(self.nodes as f64), s);
                (high - low).mul_add(r, low)
            };
            *result = L::select(up, value, L::zero());
        }
        result
    }
}

impl FibreSpec {
    /// Integrates the components at the nodes, then measures the interpolation between them and lifts the bound.
    pub fn bake<S: Scalar>(&self, precision: Precision) -> FibreTables<S> {
        let scaled = |count: usize| (count as f64 * self.detail) as usize;
        let size = scaled(precision.cos_nodes);
        let rule = FibreQuadrature::new(Precision { polar: scaled(precision.polar), ..precision });
        let (rows, nodes) = match (self.axis, self.weave) {
            // Every quadrature becomes a node; see `bends`.
            (None, Some(_)) => ((size * 47 / 100).clamp(22, 80), (size * 47 / 100).clamp(22, 80)),
            (None, None) if self.around => ((size / 10).clamp(8, 28), (size / 4).clamp(14, 64)),
            (None, None) => (1, size),
            (Some(_), _) if self.around => ((precision.axis_nodes / 2).max(8), (size / 6).clamp(14, 64)),
            (Some(_), _) => (precision.axis_nodes, (size / 6).clamp(14, 64)),
        };
        let sheets = if self.mirrored { 1 } else { 2 };
        let grid = Grid { spec: self, rule, rows, nodes };

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
            crossed: self.weave.is_some(),
        };
        let mut lifts = grid.shortfalls(&tables);
        if self.weave.is_some() {
            let bends = bends(&albedos, rows, nodes);
            for (lift, bend) in lifts.iter_mut().zip(&bends) {
                *lift = std::array::from_fn(|c| lift[c] + bend.low[c]);
            }
            let rise = |c: usize| bends.iter().map(move |b| S::c(b.middle[c]));
            for (view, rise) in tables.view.iter_mut().zip((0..self.components).flat_map(rise)) {
                *view = (*view + rise).max(S::zero());
            }
        }
        for (c, chunk) in tables.bound.chunks_mut(sheets * plane).enumerate() {
            for (bound, lift) in chunk.iter_mut().zip(&lifts) {
                // Relative as well: these albedos may be far above 1.
                *bound = *bound * S::c(1.0 + precision.margin + self.margin) + S::c(precision.margin + lift[c]);
            }
        }
        tables
    }
}

/// Widths of panels, in radians, from which on they take more points.
const PANELS: [f64; 3] = [0.15, 0.45, 1.0];

/// A product rule over (θi, φi) that follows the ridges.
pub struct FibreQuadrature {
    along: Rule,
    /// For one cell of a family's ridges.
    cell: Rule,
    around: Vec<(f64, f64, f64)>,
    /// For panels around the thread, by width.
    panels: [Rule; PANELS.len() + 1],
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
            cell: Rule::gauss_legendre((precision.polar / 5).clamp(4, 8)),
            around: around.nodes.iter().zip(&around.weights).map(point).collect(),
            panels: [2, 3, 5, 9].map(|points| Rule::gauss_legendre(points * precision.azimuth.max(16) / 24)),
        }
    }

    /// ∫ f·μ over the other direction, per component.
    pub fn albedos(&self, spec: &FibreSpec, key: &FibreKey, w: V3<f64>) -> [f64; COMPONENTS] {
        let ridge = |w: V3<f64>| -w.x.atan2(w.y.hypot(w.z));
        let Some(families) = spec.weave else {
            return self.ring_by_ring(spec, key, w, &self.graded(ridge(w), spec.width), |wi| wi);
        };
        let mut key = *key;
        let mut sums = [0.0; COMPONENTS];
        for (family, ridges) in families.iter().enumerate() {
            key[key.len() - 1] = family as f64;
            // The weft's frame is a quarter turn from the warp's.
            let own = if family == 0 { w } else { V3::new(w.y, -w.x, w.z) };
            let across = families[1 - family].offsets.map(|d| if family == 0 { d } else { -d });
            let panels = Panels::new(own, &ridges.offsets, across);
            let along = self.cells(ridge(own), ridges);
            let part = self.panel_by_panel(spec, &key, w, &along, &panels, family);
            sums = std::array::from_fn(|c| sums[c] + part[c]);
        }
        sums
    }

    /// ∫ f·μ of one family, each ring split where f has kinks.
    fn panel_by_panel(
        &self,
        spec: &FibreSpec,
        key: &FibreKey,
        w: V3<f64>,
        along: &[(f64, f64)],
        panels: &Panels,
        family: usize,
    ) -> [f64; COMPONENTS] {
        let (mut turns, mut ring, mut values) = (Vec::new(), Vec::new(), Vec::new());
        let mut sums = [0.0; COMPONENTS];
        for (theta, weight) in along {
            let (sin, cos) = theta.sin_cos();
            self.turns(&panels.edges(sin / cos.max(1e-9)), &mut turns);
            ring.clear();
            ring.extend(turns.iter().map(|&(phi, _): &(f64, f64)| {
                let (s, c) = phi.sin_cos();
                let (y, z) = (cos * s, cos * c);
                if family == 0 { V3::new(sin, y, z) } else { V3::new(-y, sin, z) }
            }));
            values.resize(ring.len(), [0.0; COMPONENTS]);
            (spec.kernel)(key, w, &ring, &mut values);
            for ((value, wi), (_, a)) in values.iter().zip(&ring).zip(&turns) {
                for c in 0..spec.components {
                    sums[c] += weight * cos * wi.z * a * value[c];
                }
            }
        }
        sums
    }

    /// Points and weights in φi between these edges, more in wider panels; the outermost graded toward the horizon.
    fn turns(&self, edges: &[f64], out: &mut Vec<(f64, f64)>) {
        out.clear();
        for e in edges.windows(2) {
            let length = e[1] - e[0];
            let rule = &self.panels[PANELS.iter().take_while(|l| length > **l).count()];
            for (u, w) in rule.nodes.iter().zip(&rule.weights) {
                if e[1] == FRAC_PI_2 {
                    out.push((e[1] - length * u * u, 2.0 * u * w * length));
                } else if e[0] == -FRAC_PI_2 {
                    out.push((e[0] + length * u * u, 2.0 * u * w * length));
                } else {
                    out.push((e[0] + length * u, w * length));
                }
            }
        }
    }

    /// Points and weights in θi: θ = ridge + length·uᵖ on each side, a third of the points within the ridge's width.
    fn graded(&self, ridge: f64, width: f64) -> Vec<(f64, f64)> {
        let mut points = Vec::with_capacity(2 * self.along.nodes.len());
        for length in [FRAC_PI_2 - ridge, -FRAC_PI_2 - ridge] {
            if length.abs() < 1e-9 {
                continue;
            }
            let power = ((width / length.abs()).ln() / 0.35f64.ln()).clamp(1.0, 6.0);
            for (u, weight) in self.along.nodes.iter().zip(&self.along.weights) {
                points.push((ridge + length * u.powf(power), weight * length.abs() * power * u.powf(power - 1.0)));
            }
        }
        points
    }

    /// Points and weights in θi: cells of two widths over all the ridges, growing twofold beyond them, and shrinking
    /// twofold where the ridges reach the thread's end, toward which f grows.
    fn cells(&self, center: f64, ridges: &Ridges) -> Vec<(f64, f64)> {
        let half = ridges.reach + 4.0 * ridges.width;
        let (lo, hi) = ((center - half).max(-FRAC_PI_2), (center + half).min(FRAC_PI_2));
        let count = ((hi - lo) / (2.0 * ridges.width)).ceil().max(1.0);
        let step = (hi - lo) / count;
        let mut edges: Vec<f64> = (0..=count as usize).map(|k| lo + step * k as f64).collect();
        for (start, end) in [(lo, -FRAC_PI_2), (hi, FRAC_PI_2)] {
            let way = (end - start).abs();
            if way < 1e-6 {
                // As far as cos θo, and only where the ridge is: beyond, f no longer grows.
                let least = (0.3 * center.cos()).max(5e-3);
                let mut length = 0.5 * step;
                while length > least && center * end > 0.0 {
                    edges.push(end - length.copysign(end));
                    length *= 0.5;
                }
            } else {
                let mut along = 2.0 * ridges.width;
                while along < 0.8 * way {
                    edges.push(start + along.copysign(end));
                    along *= 3.0;
                }
                edges.push(end);
            }
        }
        edges.sort_by(f64::total_cmp);
        let rule = || self.cell.nodes.iter().zip(&self.cell.weights);
        let cell = |e: &[f64]| {
            let (a, length) = (e[0], e[1] - e[0]);
            rule().map(move |(u, w)| (a + length * u, w * length)).collect::<Vec<_>>()
        };
        edges.windows(2).flat_map(cell).collect()
    }

    /// ∫ f·μ with these points along the thread; `place` brings a direction in the thread's frame into the lobe's.
    fn ring_by_ring(
        &self,
        spec: &FibreSpec,
        key: &FibreKey,
        w: V3<f64>,
        along: &[(f64, f64)],
        place: impl Fn(V3<f64>) -> V3<f64>,
    ) -> [f64; COMPONENTS] {
        let mut ring = vec![w; self.around.len()];
        let mut values = vec![[0.0; COMPONENTS]; self.around.len()];
        let mut sums = [0.0; COMPONENTS];
        for (theta, weight) in along {
            let (sin, cos) = theta.sin_cos();
            for (wi, &(y, z, _)) in ring.iter_mut().zip(&self.around) {
                *wi = place(V3::new(sin, cos * y, cos * z));
            }
            (spec.kernel)(key, w, &ring, &mut values);
            for (value, a) in values.iter().zip(&self.around) {
                for c in 0..spec.components {
                    sums[c] += weight * cos * cos * a.2 * value[c];
                }
            }
        }
        sums
    }
}
/// The cell of `x`, in [0, 1], over `n` nodes, and where it lies in it.
#[inline(always)]
fn cell<L: Real>(x: L, n: usize) -> (L, L) {
    let x = x.clamp(L::zero(), L::one()) * L::c((n - 1) as f64);
    let i = x.whole().min(L::c((n.max(2) - 2) as f64));
    (i, x - i)
}
