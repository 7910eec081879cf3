//! Albedo over the cosine, and over one parameter where that is not known before shading.
//!
//! Uniform nodes in x = μ^¼, because albedos change fastest toward grazing; linear between them. `view` estimates
//! E_view. `bound` interpolates max(E_view, E_light) and is lifted by the largest shortfall measured between the
//! nodes around each, so that it never lies below either; `view_bound` likewise, of E_view alone.

use super::cells::Cells;
use super::facets::FacetTables;
use super::fibre::FibreTables;
use super::quadrature::Rule;
use crate::optics::{Over, Real, Scalar, V3, lifted};
use std::f64::consts::PI;

/// f(ωo, ωi) of an isotropic lobe for many ωi: `(key, ωo, ωi, out)`.
pub type Kernel = fn(&[f64; 4], V3<f64>, &[V3<f64>], &mut [f64]);

/// A parameter that varies over the material's points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Its place in [`CurveSpec::key`].
    pub index: usize,
    /// The lower end of its range, not negative.
    pub lo: f64,
    /// The upper end.
    pub hi: f64,
}

/// What to bake: a lobe's f, the parameters it depends on, and which of them varies.
#[derive(Clone, Copy, Debug)]
pub struct CurveSpec {
    /// The function to integrate.
    pub kernel: Kernel,
    /// Its parameters.
    pub key: [f64; 4],
    /// Which of them varies, if one does.
    pub axis: Option<Axis>,
    /// E_light equals E_view and need not be integrated.
    pub reciprocal: bool,
    /// The lobe gains energy somewhere, and is therefore divided by max(1, Ē(ωo), Ē(ωi)); see [`AlbedoCurve::excess`].
    /// The curve is that of the divided lobe.
    pub bounded: bool,
    /// Numbers the lobe wants beside its albedos, from the key and the axis; see [`AlbedoCurve::extra`].
    pub extra: fn(&[f64; 4], Option<Axis>) -> Extra<f64>,
    /// From the key, E_view and the bound over the cosine: what it reads in one place, where nothing varies.
    pub cells: CellsOf,
}

/// Tables of a lobe's own, beside its albedos; which is for what, the lobe knows.
pub type Extra<S> = [Vec<S>; 2];

/// See [`CurveSpec::cells`].
pub type CellsOf = fn(&[f64; 4], &dyn Fn(f64) -> f64, &dyn Fn(f64) -> f64) -> Option<Cells>;

/// For [`CurveSpec::cells`]: nothing.
pub fn no_cells(_: &[f64; 4], _: &dyn Fn(f64) -> f64, _: &dyn Fn(f64) -> f64) -> Option<Cells> {
    None
}

/// For [`CurveSpec::extra`]: nothing.
pub fn no_extra(_: &[f64; 4], _: Option<Axis>) -> Extra<f64> {
    Extra::default()
}

impl PartialEq for CurveSpec {
    fn eq(&self, o: &Self) -> bool {
        std::ptr::fn_addr_eq(self.kernel, o.kernel)
            && self.key == o.key
            && self.axis == o.axis
            && self.reciprocal == o.reciprocal
            && self.bounded == o.bounded
    }
}

/// How finely to bake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Nodes over the cosine.
    pub cos_nodes: usize,
    /// Nodes over a varying parameter.
    pub axis_nodes: usize,
    /// Quadrature points over the polar angle and over half the azimuth.
    pub polar: usize,
    /// Quadrature points over half the azimuth.
    pub azimuth: usize,
    /// What the bound is lifted by in any case: the quadrature's error and the rounding of the evaluating type.
    pub margin: f64,
    /// Nodes over the cosine of a balanced layer's scale.
    pub scale_nodes: usize,
}

impl Precision {
    /// `factor` times as many nodes along every axis, at least 8; as many points of quadrature.
    pub fn scaled(self, factor: f64) -> Precision {
        let scaled = |nodes: usize| ((nodes as f64 * factor).round() as usize).max(8);
        let Precision { cos_nodes, axis_nodes, scale_nodes, .. } = self;
        let [cos_nodes, axis_nodes, scale_nodes] = [cos_nodes, axis_nodes, scale_nodes].map(scaled);
        Precision { cos_nodes, axis_nodes, scale_nodes, ..self }
    }

    /// Within 1e-3 of the quadrature (2e-3 where a parameter varies).
    pub const STANDARD: Precision =
        Precision { cos_nodes: 160, axis_nodes: 32, polar: 32, azimuth: 24, margin: 1e-5, scale_nodes: 96 };
    /// Within 1e-2 of the quadrature, in a fifth of the memory. The quadrature itself is that of `STANDARD`: with less, rough
    /// glass gained 6e-4.
    pub const FAST: Precision =
        Precision { cos_nodes: 48, axis_nodes: 16, polar: 32, azimuth: 24, margin: 1e-4, scale_nodes: 40 };
    /// Interpolation below 5e-6.
    pub const REFERENCE: Precision =
        Precision { cos_nodes: 512, axis_nodes: 96, polar: 64, azimuth: 48, margin: 2e-6, scale_nodes: 160 };
}

/// E_view and a bound over μ, and over the varying parameter if there is one.
#[derive(Clone, Debug, PartialEq)]
pub struct AlbedoCurve<S> {
    /// Row after row, `cos_nodes` each; a row per node of the varying parameter.
    view: Vec<S>,
    bound: Vec<S>,
    /// Empty where E_light equals E_view: then `bound` serves.
    view_bound: Vec<S>,
    /// Empty unless [`CurveSpec::bounded`].
    excess: Vec<S>,
    /// What [`CurveSpec::extra`] gave.
    extra: Extra<S>,
    /// What [`CurveSpec::cells`] gave: for single precision alone.
    cells_read: Option<Box<Cells>>,
    cos_nodes: usize,
    rows: usize,
    /// Cells over the cosine, and over the varying parameter.
    cells: [S; 2],
    lo: S,
    /// 1/(hi − lo).
    inv_range: S,
    /// For lobes that follow a thread; empty for all others.
    pub(super) fibre: FibreTables<S>,
    /// For rough surfaces; empty for all others.
    pub(super) facets: FacetTables<S>,
}

impl<S> Default for AlbedoCurve<S>
where
    S: Real,
{
    /// For lobes that ask for no table; reads as 0.
    fn default() -> Self {
        AlbedoCurve {
            view: vec![],
            bound: vec![],
            view_bound: vec![],
            excess: vec![],
            extra: Extra::default(),
            cells_read: None,
            cos_nodes: 0,
            rows: 0,
            cells: [S::zero(); 2],
            lo: S::zero(),
            inv_range: S::zero(),
            fibre: FibreTables::default(),
            facets: FacetTables::default(),
        }
    }
}

impl<S: Scalar> AlbedoCurve<S> {
    /// The same numbers in double precision.
    pub fn in_double(&self) -> AlbedoCurve<f64> {
        self.cast()
    }

    /// The same numbers in another type, rounded to double precision.
    pub fn cast<T: Scalar>(&self) -> AlbedoCurve<T> {
        let all = |values: &[S]| values.iter().map(|v| T::c(v.to_f64())).collect();
        AlbedoCurve {
            view: all(&self.view),
            bound: all(&self.bound),
            view_bound: all(&self.view_bound),
            excess: all(&self.excess),
            extra: self.extra.each_ref().map(|e| all(e)),
            cells_read: self.cells_read.clone().filter(|_| T::SINGLE),
            cos_nodes: self.cos_nodes,
            rows: self.rows,
            cells: self.cells.map(|n| T::c(n.to_f64())),
            lo: T::c(self.lo.to_f64()),
            inv_range: T::c(self.inv_range.to_f64()),
            fibre: self.fibre.cast(),
            facets: self.facets.cast(),
        }
    }
}

impl<S: Scalar> AlbedoCurve<S> {
    /// E_view for the direction `w`; `parameter` is the varying one and is ignored if none varies. 0 below the surface.
    #[inline(always)]
    pub fn view<L: Over<S>>(&self, w: V3<L>, parameter: L) -> L {
        self.read(&self.view, w.z, parameter)
    }

    /// At least max(E_view, E_light); 0 below the surface.
    #[inline(always)]
    pub fn bound<L: Over<S>>(&self, w: V3<L>, parameter: L) -> L {
        self.read(&self.bound, w.z, parameter)
    }

    /// At least E_view; 0 below the surface.
    #[inline(always)]
    pub fn view_bound<L: Over<S>>(&self, w: V3<L>, parameter: L) -> L {
        self.read(if self.view_bound.is_empty() { &self.bound } else { &self.view_bound }, w.z, parameter)
    }

    /// At least max(1, E_view, E_light) of the lobe before it is divided. A lobe that gains divides f by the larger of
    /// this at ωo and at ωi: symmetric, and E ≤ 1 from both sides. 1 for lobes that never gain.
    #[inline(always)]
    pub fn excess<L: Over<S>>(&self, w: V3<L>, parameter: L) -> L {
        self.read(&self.excess, w.z, parameter).max(L::one())
    }

    /// Whether [`excess`](Self::excess) is above 1 anywhere.
    #[inline(always)]
    pub fn divides(&self) -> bool {
        !self.excess.is_empty()
    }

    /// What the lobe asked for beside its albedos; empty if it asked for nothing.
    #[inline(always)]
    pub fn extra(&self) -> &Extra<S> {
        &self.extra
    }

    /// Whether the lobe's functions, and with them its albedos, are read in one place.
    #[inline(always)]
    pub fn cells(&self) -> Option<&Cells> {
        self.cells_read.as_deref()
    }

    /// The smallest E_view and the largest bound at the nodes around a range of cosines and of the varying parameter:
    /// between nodes both are interpolated, so that nothing lies outside. (0, 0) below the surface.
    pub fn range(&self, cos: (f64, f64), parameter: (f64, f64)) -> (f64, f64)
    where
        S: Scalar,
    {
        if self.view.is_empty() || cos.1 <= 0.0 {
            return (0.0, 0.0);
        }
        let nodes = |lo: f64, hi: f64, count: usize| {
            let last = (count - 1) as f64;
            // A hair wider: the reading type may round into the next cell.
            let at = |x: f64, slack: f64| (x * last + slack).clamp(0.0, last);
            at(lo, -1e-3).floor() as usize..=at(hi, 1e-3).ceil() as usize
        };
        let x = |c: f64| c.clamp(0.0, 1.0).sqrt().sqrt();
        let y = |p: f64| (p.max(0.0).sqrt() - self.lo.to_f64()) * self.inv_range.to_f64();
        let rows = if self.rows == 1 {
            0..=0
        } else {
            nodes(y(parameter.0).clamp(0.0, 1.0), y(parameter.1).clamp(0.0, 1.0), self.rows)
        };
        let (mut lowest, mut highest) = (f64::INFINITY, 0.0f64);
        for row in rows {
            for node in nodes(x(cos.0), x(cos.1), self.cos_nodes) {
                let at = row * self.cos_nodes + node;
                lowest = lowest.min(self.view[at].to_f64());
                highest = highest.max(self.bound[at].to_f64());
            }
        }
        (if cos.0 >= 0.0 { lowest } else { 0.0 }, highest)
    }

    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        let own = [&self.view, &self.bound, &self.view_bound, &self.excess];
        own.into_iter().chain(&self.extra).map(Vec::len).sum::<usize>() * size_of::<S>()
            + self.cells_read.as_ref().map_or(0, |c| c.bytes())
            + self.fibre.bytes()
            + self.facets.bytes()
    }

    /// The tables of a lobe that follows a thread.
    #[inline(always)]
    pub fn fibre(&self) -> &FibreTables<S> {
        &self.fibre
    }

    /// The tables of a rough surface.
    #[inline(always)]
    pub fn facets(&self) -> &FacetTables<S> {
        &self.facets
    }

    #[inline(always)]
    fn read<L: Over<S>>(&self, table: &[S], cos: L, parameter: L) -> L {
        if table.is_empty() {
            return L::zero();
        }
        if self.rows == 1 {
            return L::quartic(table, self.cells[0], cos);
        }
        let [cells, row_cells] = lifted::<_, L, 2>(self.cells);
        let x = cos.clamp(L::zero(), L::one()).sqrt().sqrt() * cells;
        let i = x.whole().min(cells - L::one());
        let t = x - i;
        let y = (parameter.safe_sqrt() - L::lift(self.lo)) * L::lift(self.inv_range);
        let y = y.clamp(L::zero(), L::one()) * row_cells;
        let j = y.whole().min(row_cells - L::one());
        let at = j.mul_add(cells + L::one(), i);
        let (a, b) = (L::between(table, at, t), L::between(table, at + cells + L::one(), t));
        let value = (b - a).mul_add(y - j, a);
        L::select(cos.gt(L::zero()), value, L::zero())
    }
}

impl CurveSpec {
    /// Integrates the albedos at the nodes, then measures the interpolation between them and lifts the bound by it.
    pub fn bake<S: Scalar>(&self, precision: Precision) -> AlbedoCurve<S> {
        let extra = (self.extra)(&self.key, self.axis).map(|e| e.into_iter().map(S::c).collect());
        let raw = AlbedoCurve { extra, ..self.bake_with(precision, &AlbedoCurve::default()) };
        if !self.bounded {
            let at = |cos: f64| V3::polar(S::c(cos), S::zero());
            let view = |cos: f64| raw.view(at(cos), S::zero()).to_f64();
            let bound = |cos: f64| raw.bound(at(cos), S::zero()).to_f64();
            let wanted = S::SINGLE && self.axis.is_none();
            let cells_read = if wanted { (self.cells)(&self.key, &view, &bound).map(Box::new) } else { None };
            return AlbedoCurve { cells_read, ..raw };
        }
        // Twice: what the lobe gains by, then the lobe that is divided by it.
        let at_least_one = |e: &S| e.max(S::one());
        let excess = AlbedoCurve { excess: raw.bound.iter().map(at_least_one).collect(), ..raw };
        let mut curve = self.bake_with(precision, &excess);
        for b in curve.bound.iter_mut().chain(&mut curve.view_bound) {
            *b = b.min(S::one());
        }
        AlbedoCurve { excess: excess.excess, extra: excess.extra, ..curve }
    }

    fn bake_with<S: Scalar>(&self, precision: Precision, excess: &AlbedoCurve<S>) -> AlbedoCurve<S> {
        let quadrature = Quadrature::new(precision);
        let n = precision.cos_nodes;
        let (lo, hi) = self.axis.map_or((0.0, 0.0), |a| (a.lo.sqrt(), a.hi.sqrt()));
        let rows = if self.axis.is_some() { precision.axis_nodes } else { 1 };
        let parameter = |row: f64| (lo + (hi - lo) * row / (rows.max(2) - 1) as f64).powi(2);
        let cosine = |node: f64| (node / (n - 1) as f64).powi(4);

        let nodes: Vec<(f64, f64)> = (0..rows * n).map(|k| ((k / n) as f64, (k % n) as f64)).collect();
        let albedos = parallel(&nodes, |&(row, node)| {
            // Just above the horizon in place of the horizon itself, where a one-sided lobe is black.
            quadrature.albedos(self, excess, parameter(row), cosine(node).max(1e-12))
        });
        let mut curve = AlbedoCurve {
            view: albedos.iter().map(|a| S::c(a.view)).collect(),
            bound: albedos.iter().map(|a| S::c(a.bound())).collect(),
            view_bound: vec![],
            excess: vec![],
            extra: Extra::default(),
            cells_read: None,
            cos_nodes: n,
            rows,
            cells: [n, rows].map(|n| S::c((n - 1) as f64)),
            lo: S::c(lo),
            inv_range: S::c(1.0 / (hi - lo).max(1e-30)),
            fibre: FibreTables::default(),
            facets: FacetTables::default(),
        };
        let truth = |p: f64, cos: f64| quadrature.albedos(self, excess, p, cos);
        let lifts = shortfalls(&curve, truth, parameter, cosine);
        for (b, lift) in curve.bound.iter_mut().zip(&lifts) {
            *b += S::c(precision.margin + lift[0]);
        }
        if !self.reciprocal {
            let lifted = |(v, lift): (&S, &[f64; 2])| *v + S::c(precision.margin + lift[1]);
            curve.view_bound = curve.view.iter().zip(&lifts).map(lifted).collect();
        }
        curve
    }
}

/// How much every node of the bound, and of E_view, must rise so that nothing between the nodes lies above it: twice what
/// the probes in the middle see, because a kink close to a node shows there with half its height.
fn shortfalls<S: Scalar>(
    curve: &AlbedoCurve<S>,
    truth: impl Fn(f64, f64) -> Albedos + Sync,
    parameter: impl Fn(f64) -> f64 + Sync,
    cosine: impl Fn(f64) -> f64 + Sync,
) -> Vec<[f64; 2]> {
    // Cell centres, and the middles of the cells' edges between rows.
    let half_rows = 2 * curve.rows - 1;
    let probes: Vec<(usize, usize)> =
        (0..half_rows).flat_map(|row| (0..curve.cos_nodes - 1).map(move |node| (row, node))).collect();
    let shortfalls = parallel(&probes, |&(half_row, node)| {
        let (p, cos) = (parameter(half_row as f64 / 2.0), cosine(node as f64 + 0.5));
        let (truth, w) = (truth(p, cos), V3::polar(S::c(cos), S::zero()));
        [truth.bound() - curve.bound(w, S::c(p)).to_f64(), truth.view - curve.view(w, S::c(p)).to_f64()]
    });
    let mut lifts = vec![[0.0f64; 2]; curve.rows * curve.cos_nodes];
    for (&(half_row, node), shortfall) in probes.iter().zip(shortfalls) {
        for row in [half_row / 2, half_row.div_ceil(2)] {
            for corner in [node, node + 1] {
                let lift = &mut lifts[row * curve.cos_nodes + corner];
                *lift = std::array::from_fn(|k| lift[k].max(2.0 * shortfall[k]));
            }
        }
    }
    lifts
}

/// E_view and E_light at one cosine.
#[derive(Clone, Copy, Debug)]
pub struct Albedos {
    /// ∫ f(ω, ωi)·|cos θi| dωi.
    pub view: f64,
    /// ∫ f(ωo, ω)·|cos θo| dωo.
    pub light: f64,
}

impl Albedos {
    fn bound(self) -> f64 {
        self.view.max(self.light)
    }
}

/// A product rule over the hemisphere: μ = u³ (grading toward grazing) and half the azimuth.
pub struct Quadrature {
    /// Over u = μ^⅓.
    polar: Rule,
    azimuths: Vec<(f64, f64)>,
}

impl Quadrature {
    /// The rule for a precision; its table sizes do not matter here.
    pub fn new(precision: Precision) -> Self {
        let polar = Rule::gauss_legendre(precision.polar);
        let azimuth = Rule::gauss_legendre(precision.azimuth);
        // The azimuth is graded toward π, where two grazing directions face each other and the half vector turns fast.
        let angle = |(&v, &w): (&f64, &f64)| (PI * (1.0 - v * v), w * 2.0 * v * 2.0 * PI);
        Quadrature { polar, azimuths: azimuth.nodes.iter().zip(&azimuth.weights).map(angle).collect() }
    }

    /// Both albedos at `cos` with the varying parameter, if there is one, at `parameter`.
    ///
    /// f is divided by the larger `excess` of its two directions.
    pub fn albedos<S: Scalar>(&self, spec: &CurveSpec, excess: &AlbedoCurve<S>, parameter: f64, cos: f64) -> Albedos {
        let mut key = spec.key;
        if let Some(axis) = spec.axis {
            key[axis.index] = parameter;
        }
        let here = V3::polar(cos, 0.0);
        let mut values = vec![0.0; self.azimuths.len()];
        let mut albedos = Albedos { view: 0.0, light: 0.0 };
        let excess_at = |cos: f64| excess.excess(V3::polar(S::c(cos), S::zero()), S::c(parameter)).to_f64();
        let excess_here = excess_at(cos);
        // A divided lobe has a kink where its two directions are equally steep.
        let kink = if excess.excess.is_empty() { 1.0 } else { cos.clamp(0.0, 1.0).cbrt() };
        for (mu, weight) in self.cosines(0.0, kink).chain(self.cosines(kink, 1.0)) {
            let weight = weight / excess_at(mu).max(excess_here);
            let ring: Vec<V3<f64>> = self.azimuths.iter().map(|a| V3::polar(mu, a.0)).collect();
            (spec.kernel)(&key, here, &ring, &mut values);
            albedos.view += weight * mu * self.over_azimuth(&values);
            if !spec.reciprocal {
                let ring: Vec<V3<f64>> = self.azimuths.iter().map(|a| V3::polar(cos, a.0)).collect();
                (spec.kernel)(&key, V3::polar(mu, 0.0), &ring, &mut values);
                albedos.light += weight * mu * self.over_azimuth(&values);
            }
        }
        if spec.reciprocal {
            albedos.light = albedos.view;
        }
        albedos
    }

    /// Cosines and weights for u = μ^⅓ in `[lo, hi]`; none for an empty interval.
    fn cosines(&self, lo: f64, hi: f64) -> impl Iterator<Item = (f64, f64)> {
        let nodes = self.polar.nodes.iter().zip(&self.polar.weights);
        nodes.take_while(move |_| hi > lo).map(move |(u, w)| {
            let u = lo + (hi - lo) * u;
            (u * u * u, w * (hi - lo) * 3.0 * u * u)
        })
    }

    fn over_azimuth(&self, values: &[f64]) -> f64 {
        self.azimuths.iter().zip(values).map(|(a, f)| a.1 * f).sum()
    }
}

/// Maps over `items` on all cores, in order.
pub(crate) fn parallel<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let chunk = items.len().div_ceil(threads).max(16);
    let f = &f;
    std::thread::scope(|scope| {
        let workers: Vec<_> =
            items.chunks(chunk).map(|c| scope.spawn(move || c.iter().map(f).collect::<Vec<_>>())).collect();
        workers.into_iter().flat_map(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    })
}

#[cfg(feature = "cloth")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::lobes::LobeKind;

    fn sheen(roughness: Option<f32>) -> CurveSpec {
        let mut values = [Some(1.0); 10];
        values[7] = Some(0.0);
        values[6] = roughness;
        LobeKind::Sheen.curve(&values).unwrap()
    }

    #[test]
    fn curves_stay_above_the_truth_and_close_to_it() {
        let quadrature = Quadrature::new(Precision { polar: 96, azimuth: 64, ..Precision::STANDARD });
        for (roughness, slack) in [(Some(0.07), 1e-3), (Some(0.3), 1e-3), (Some(1.0), 1e-3), (None, 2e-3)] {
            let spec = sheen(roughness);
            let curve = spec.bake::<f32>(Precision::STANDARD);
            for k in 1..200 {
                let cos = (k as f64 / 200.0 + 0.001).powi(3);
                let r = roughness.unwrap_or(0.07 + 0.93 * (k * 37 % 100) as f32 / 99.0);
                let truth = quadrature.albedos(&spec, &AlbedoCurve::<f64>::default(), r as f64, cos);
                let w = V3::polar(cos as f32, 0.3);
                let (view, bound) = (curve.view(w, r) as f64, curve.bound(w, r) as f64);
                assert!(bound >= truth.bound(), "r {r} cos {cos}: {bound} below {truth:?}");
                assert!(bound <= truth.bound() + slack, "r {r} cos {cos}: {bound} far above {truth:?}");
                assert!((view - truth.view).abs() < slack, "r {r} cos {cos}: {view} off {truth:?}");
            }
        }
    }

    #[test]
    fn curves_are_black_at_and_below_the_horizon() {
        let curve = sheen(Some(0.3)).bake::<f32>(Precision { cos_nodes: 8, ..Precision::STANDARD });
        for cos in [0.0, -0.0, -1e-20, -1.0, f32::NAN] {
            assert_eq!(curve.bound(V3::new(0.6, 0.8, cos), 0.3), 0.0);
        }
        assert!(curve.bound(V3::new(1.0, 0.0, 1e-20), 0.3f32) > 0.5);
    }
}
