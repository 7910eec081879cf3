//! A concrete material and direction that gain, found among the worst regions and measured.
//!
//! Candidates are ranked by the bound at a point, which is close to the truth and costs microseconds; only what it
//! leaves possible is measured, by the same adaptive quadrature as `overcoat albedo`. What is found is then made plain:
//! parameters go back to their defaults and to round numbers as long as it still gains.

use super::domain::Case;
use super::energy::Detail;
use super::graph::{Id, LeafKind};
use super::interval::Interval;
use super::number::Region;
use super::search::{Problem, TOLERANCE, Which};
use super::trace::ENDLESS;
use crate::audit::{Albedo, Side, Tolerance, albedo};
use crate::closure::Bsdf;
use crate::engine::Shader;
use crate::globals::Globals;
use crate::ir::body::GlobalVar;
use crate::ir::{Ty, Value};
use crate::optics::{Frame, V3};
use glam::Vec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

/// A material, a point and a direction, and what was measured there.
#[derive(Clone, Debug)]
pub struct Witness {
    /// Parameters that are not at their defaults.
    pub params: Vec<(String, Value)>,
    /// Globals the script reads, with their values.
    pub globals: Vec<(String, Vec<f32>)>,
    /// Which direction is held.
    pub side: Side,
    /// Its cosine to N.
    pub cos: f64,
    /// The direction, world space.
    pub dir: [f64; 3],
    /// The albedo there.
    pub albedo: Albedo,
    /// The shading point.
    pub scene: Globals,
    point: Point,
}

/// Values of all leaves, and a direction.
#[derive(Clone, Debug)]
pub struct Point {
    /// By leaf.
    pub leaves: Vec<f64>,
    /// Cosine of the held direction.
    pub cos: f64,
    /// Its azimuth.
    pub phi: f64,
}

/// How often a witness is measured before the search gives up.
const MEASUREMENTS: usize = 10;

/// Looks for witnesses of one case of a script.
pub struct Hunt<'p, 'g> {
    /// What is looked at.
    pub problem: &'p Problem<'g>,
    /// The shader.
    pub shader: &'p Shader,
    /// Ints and strings, and what was set.
    pub case: &'p Case,
    defaults: Vec<Option<f64>>,
    measured: usize,
    rng: Pcg32,
}

impl<'p, 'g> Hunt<'p, 'g> {
    /// For one case.
    pub fn new(problem: &'p Problem<'g>, shader: &'p Shader, case: &'p Case) -> Self {
        let default = |kind: LeafKind| match kind {
            LeafKind::Param(p, channel) => {
                let numbers = shader.params()[p].default.as_ref().map(Value::numbers);
                numbers.and_then(|n| n.get(channel).copied()).map(f64::from)
            }
            _ => Some(0.0),
        };
        let defaults = problem.graph.leaves.iter().map(|l| default(l.kind)).collect();
        Hunt { problem, shader, case, defaults, measured: 0, rng: Pcg32::seed_from_u64(7) }
    }

    /// A witness in or near a region, if one is found.
    pub fn near(&mut self, region: &Region) -> Option<Witness> {
        if self.measured >= MEASUREMENTS {
            return None;
        }
        let starts = self.starts(region);
        let (start, upper) = starts.first()?.clone();
        let (point, upper) = self.climb(start, upper);
        if let Some(found) = self.accept(&point, upper) {
            let plain = self.plain(point, upper);
            let upper = self.upper(&plain);
            return Some(self.accept(&plain, upper).unwrap_or(found));
        }
        // The bound may be loose where it is largest.
        starts.iter().step_by(4).take(3).find_map(|(point, upper)| self.accept(point, *upper))
    }

    /// Measures a point that may gain, from both sides.
    fn accept(&mut self, point: &Point, upper: f64) -> Option<Witness> {
        let light_too = self.problem.looks_at_view && self.problem.energy.sides_alike();
        if upper <= 1.0 + 1.5 * TOLERANCE && !light_too {
            return None;
        }
        self.measured += 1;
        let material = self.shader.material(&self.params(point)).ok()?;
        let sides: &[Side] = if self.problem.energy.sides_alike() { &[Side::View, Side::Light] } else { &[Side::View] };
        for side in sides {
            let cosines: &[f64] =
                if light_too && *side == Side::Light { &[point.cos, 1.0, 0.5, 0.1] } else { &[point.cos] };
            for cos in cosines {
                let point = Point { cos: *cos, ..point.clone() };
                let (globals, dir) = self.scene(&point);
                let measured = measure(&material, &globals, *side, dir);
                if measured.max() - measured.error > 1.0 + TOLERANCE {
                    return Some(self.witness(&point, *side, dir, measured));
                }
            }
        }
        None
    }

    fn witness(&self, point: &Point, side: Side, dir: [f64; 3], albedo: Albedo) -> Witness {
        let default = |name: &str| self.shader.params().iter().find(|p| p.name == name).and_then(|p| p.default.clone());
        let mut params = self.params(point);
        params.retain(|(name, value)| default(name).as_ref() != Some(value));
        let (globals, _) = self.scene(point);
        let scene = globals;
        let mut named: Vec<(String, Vec<f32>)> = Vec::new();
        for leaf in &self.problem.leaves {
            if let LeafKind::Global(g, _) = self.problem.graph.leaves[*leaf as usize].kind {
                let value = global_numbers(g, &globals, dir);
                if g != GlobalVar::I
                    && !named.iter().any(|(name, _)| name == g.name())
                    && !is_direction_of_lobes(self, g)
                {
                    named.push((g.name().to_owned(), value));
                }
            }
        }
        Witness { params, globals: named, side, cos: point.cos, dir, albedo, scene, point: point.clone() }
    }

    /// The point a witness was found at.
    pub fn point_of(&self, witness: &Witness) -> Point {
        witness.point.clone()
    }

    /// The values of all leaves at a witness.
    pub fn leaf_values(&self, witness: &Witness) -> Vec<(Id, f64)> {
        let point = self.consistent(&witness.point);
        self.problem.graph.leaves.iter().zip(point.leaves).map(|(l, x)| (l.id, x)).collect()
    }

    /// The values of all parameters at a point.
    pub fn params(&self, point: &Point) -> Vec<(String, Value)> {
        let mut params = self.case.fixed.clone();
        for (leaf, x) in self.problem.graph.leaves.iter().zip(&point.leaves) {
            let LeafKind::Param(p, channel) = leaf.kind else { continue };
            let param = &self.shader.params()[p];
            let x = *x as f32;
            let at = match params.iter().position(|(name, _)| *name == param.name) {
                Some(at) => at,
                None => {
                    let start = match param.ty {
                        Ty::Int => Value::Int(x as i32),
                        Ty::Float => Value::Float(x),
                        _ => param.default.clone().unwrap_or(Value::Color([0.0; 3])),
                    };
                    params.push((param.name.clone(), start));
                    params.len() - 1
                }
            };
            match &mut params[at].1 {
                Value::Color(v) => v[channel] = x,
                Value::Float(v) => *v = x,
                Value::Int(v) => *v = x as i32,
                _ => {}
            }
        }
        params
    }

    /// The globals of a point and the held direction.
    pub fn scene(&self, point: &Point) -> (Globals, [f64; 3]) {
        let mut globals = Globals::default();
        let mut normal = Vec3::ZERO;
        for (leaf, x) in self.problem.graph.leaves.iter().zip(&point.leaves) {
            let x = *x as f32;
            match leaf.kind {
                LeafKind::Global(GlobalVar::U, _) => globals.u = x,
                LeafKind::Global(GlobalVar::V, _) => globals.v = x,
                LeafKind::Global(GlobalVar::Time, _) => globals.time = x,
                LeafKind::Global(GlobalVar::Backfacing, _) => globals.backfacing = x != 0.0,
                LeafKind::Global(GlobalVar::P, k) => globals.p[k] = x,
                LeafKind::Global(GlobalVar::N, k) if self.reads_normal() => normal[k] = x,
                _ => {}
            }
        }
        globals.n = normal.try_normalize().unwrap_or(Vec3::Z);
        globals.ng = globals.n;
        let v = |v: Vec3| V3::new(v.x as f64, v.y as f64, v.z as f64);
        let frame = Frame::new(v(globals.n), v(globals.n), v(Vec3::X), v(Vec3::Y));
        let to_f32 = |v: V3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        (globals.dpdu, globals.dpdv) = (to_f32(frame.t), to_f32(frame.b));
        let dir = frame.to_world(V3::polar(point.cos, point.phi));
        (globals, [dir.x, dir.y, dir.z])
    }

    /// Whether numbers come from the components of N, not only frames.
    fn reads_normal(&self) -> bool {
        self.problem.reads_numbers_of(GlobalVar::N)
    }

    /// With leaves that follow from others set to what they are.
    fn consistent(&self, point: &Point) -> Point {
        let (globals, dir) = self.scene(point);
        let mut point = point.clone();
        for (leaf, x) in self.problem.graph.leaves.iter().zip(&mut point.leaves) {
            match leaf.kind {
                LeafKind::Facing => *x = -point.cos,
                LeafKind::Global(g, k) => {
                    let numbers = global_numbers(g, &globals, dir);
                    *x = numbers.get(k).map_or(*x, |n| *n as f64);
                }
                LeafKind::Param(..) => *x = *x as f32 as f64,
            }
        }
        point
    }

    /// The bound at a point.
    pub fn upper(&self, point: &Point) -> f64 {
        let point = self.consistent(point);
        let mut region = self.problem.whole();
        for (leaf, x) in self.problem.graph.leaves.iter().zip(&point.leaves) {
            region.ranges.insert(leaf.id.0, Interval::point(*x));
        }
        region.cos = Interval::point(point.cos);
        self.problem.bound(region, Which::View, Detail::Fine, &mut 0).upper
    }

    /// Points in a region, those with the largest bounds first.
    fn starts(&mut self, region: &Region) -> Vec<(Point, f64)> {
        let graph = self.problem.graph;
        let range = |k: usize| {
            let leaf = &graph.leaves[k];
            region.ranges.get(&leaf.id.0).map_or(leaf.range, |r| leaf.range.narrowed(*r))
        };
        let count = graph.leaves.len();
        let cos = |c: f64| if c.abs() < 1e-3 { 0.3 } else { c };
        let mut points = Vec::new();
        let point = |leaves: Vec<f64>, c: f64| Point { leaves, cos: cos(c), phi: 0.3 };
        let defaults = (0..count).map(|k| self.defaults[k].unwrap_or(range(k).middle()));
        points.push(point(defaults.collect(), region.cos.middle()));
        points.push(point((0..count).map(|k| range(k).middle()).collect(), region.cos.middle()));
        for high in [true, false] {
            let end = |k: usize| finite(if high { range(k).hi } else { range(k).lo }, range(k));
            points.push(point((0..count).map(end).collect(), region.cos.hi));
            points.push(point((0..count).map(end).collect(), region.cos.middle()));
        }
        for _ in 0..24 {
            let mut leaves = Vec::new();
            for k in 0..count {
                let r = range(k);
                leaves.push(if r.width() < ENDLESS {
                    [r.lo, r.hi, r.lo + r.width() * self.rng.random_range(0.0..1.0)][self.rng.random_range(0..3usize)]
                } else {
                    [0.0, 0.25, 0.5, 1.0, 3.0, -1.0, 0.01, 0.03][self.rng.random_range(0..8usize)]
                        * [1.0, 1.0, 10.0][self.rng.random_range(0..3usize)]
                });
            }
            let c = region.cos.lo + region.cos.width() * self.rng.random_range(0.0..1.0);
            points.push(point(leaves, c));
        }
        let mut ranked: Vec<(Point, f64)> =
            points.into_iter().map(|p| (self.upper(&p), p)).map(|(u, p)| (p, u)).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked
    }

    /// A point anywhere in the domain; every third coordinate at an end of its range.
    pub fn random(&self, rng: &mut Pcg32, round: usize) -> Point {
        let mut leaves = Vec::new();
        for (k, leaf) in self.problem.graph.leaves.iter().enumerate() {
            let r = leaf.range;
            let inside = match r.width() < ENDLESS {
                true => r.lo + r.width() * rng.random_range(0.0..1.0),
                false => rng.random_range(-1.0..2.0) * [1.0, 1.0, 30.0][rng.random_range(0..3usize)],
            };
            let end = if rng.random_range(0..2) == 0 { r.lo } else { r.hi };
            let at_end = (k + round).is_multiple_of(3) && r.width() < ENDLESS;
            let x = if at_end { end } else { inside };
            leaves.push(if leaf.whole { x.floor() } else { x });
        }
        Point { leaves, cos: 0.5, phi: 0.0 }
    }

    /// One coordinate at a time.
    fn climb(&mut self, mut point: Point, mut upper: f64) -> (Point, f64) {
        const COSINES: [f64; 12] = [1.0, 0.9, 0.75, 0.6, 0.45, 0.3, 0.2, 0.1, 0.05, 0.02, -0.5, -0.1];
        for round in 0..3 {
            let before = upper;
            for cos in COSINES {
                self.try_point(Point { cos, ..point.clone() }, &mut point, &mut upper);
            }
            for k in self.problem.leaves.clone() {
                let leaf = &self.problem.graph.leaves[k as usize];
                let (r, x, k) = (leaf.range, point.leaves[k as usize], k as usize);
                let step = if r.width() < ENDLESS { r.width() * 0.2 / (1 + 3 * round) as f64 } else { 0.1 };
                for to in [finite(r.lo, r), finite(r.hi, r), x - step, x + step] {
                    let mut leaves = point.leaves.clone();
                    leaves[k] = to.clamp(r.lo, r.hi);
                    self.try_point(Point { leaves, ..point.clone() }, &mut point, &mut upper);
                }
            }
            if upper <= before + 1e-6 {
                break;
            }
        }
        (point, upper)
    }

    fn try_point(&self, candidate: Point, point: &mut Point, upper: &mut f64) {
        let u = self.upper(&candidate);
        if u > *upper {
            (*point, *upper) = (candidate, u);
        }
    }

    /// With defaults and round numbers wherever a good part of the gain stays.
    fn plain(&self, mut point: Point, upper: f64) -> Point {
        let enough = 1.0 + (0.4 * (upper - 1.0)).clamp(3.0 * TOLERANCE, 0.5);
        let keep = |candidate: Point, point: &mut Point| {
            let good = self.upper(&candidate) >= enough;
            if good {
                *point = candidate;
            }
            good
        };
        let leaves = &self.problem.graph.leaves;
        for p in 0..self.shader.params().len() {
            let own: Vec<usize> =
                (0..leaves.len()).filter(|k| matches!(leaves[*k].kind, LeafKind::Param(q, _) if q == p)).collect();
            let with = |values: &dyn Fn(usize) -> f64, point: &Point| {
                let mut candidate = point.clone();
                own.iter()
                    .for_each(|k| candidate.leaves[*k] = values(*k).clamp(leaves[*k].range.lo, leaves[*k].range.hi));
                candidate
            };
            if own.is_empty() || keep(with(&|k| self.defaults[k].unwrap_or(0.0), &point), &mut point) {
                continue;
            }
            let largest = own.iter().map(|k| point.leaves[*k]).fold(f64::NEG_INFINITY, f64::max);
            keep(with(&|_| largest, &point), &mut point);
            for digits in [0, 1, 2, 3] {
                let now = point.clone();
                let round = |k: usize| (now.leaves[k] * 10f64.powi(digits)).round() / 10f64.powi(digits);
                if keep(with(&round, &point), &mut point) {
                    break;
                }
            }
        }
        for k in 0..leaves.len() {
            if matches!(leaves[k].kind, LeafKind::Param(..) | LeafKind::Facing) {
                continue;
            }
            for value in [
                0.0,
                0.5,
                1.0,
                2.0,
                -1.0,
                (point.leaves[k] * 10.0).round() / 10.0,
                (point.leaves[k] * 100.0).round() / 100.0,
            ] {
                let mut candidate = point.clone();
                candidate.leaves[k] = value.clamp(leaves[k].range.lo, leaves[k].range.hi);
                if keep(candidate, &mut point) {
                    break;
                }
            }
        }
        for cos in [1.0, 0.5, (point.cos * 10.0).round() / 10.0, (point.cos * 100.0).round() / 100.0] {
            if cos != 0.0 && keep(Point { cos, ..point.clone() }, &mut point) {
                break;
            }
        }
        point
    }
}

/// The albedo of a material at a point, by quadrature.
pub fn measure(material: &crate::engine::Material, globals: &Globals, side: Side, dir: [f64; 3]) -> Albedo {
    let subject = |wo: [f32; 3]| material.shade(globals, wo.into()).unwrap_or_else(|_| Bsdf::black());
    let dir = dir.map(|x| x as f32);
    let rough = albedo(&subject, side, dir, Tolerance { error: 1e-3, evaluations: 9000 });
    if rough.max() < 0.99 && rough.error < 5e-3 {
        return rough;
    }
    albedo(&subject, side, dir, Tolerance { error: 2e-5, evaluations: 60_000 })
}

fn finite(x: f64, range: Interval) -> f64 {
    if range.width() < ENDLESS { x } else { 3.0 * x.signum() }
}

/// A global that only turns the frames of lobes does not belong to a witness.
fn is_direction_of_lobes(hunt: &Hunt<'_, '_>, g: GlobalVar) -> bool {
    g.is_frame() && !hunt.problem.reads_numbers_of(g)
}

fn global_numbers(g: GlobalVar, globals: &Globals, dir: [f64; 3]) -> Vec<f32> {
    let globals = Globals { i: -Vec3::new(dir[0] as f32, dir[1] as f32, dir[2] as f32), ..*globals };
    let cells = g.read(&globals);
    match g.ty() {
        Ty::Int => vec![cells[0] as i32 as f32],
        ty => cells[..ty.cells()].iter().map(|c| f32::from_bits(*c)).collect(),
    }
}
