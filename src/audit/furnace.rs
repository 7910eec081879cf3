//! The white furnace: directional albedo of a whole BSDF from both sides, by adaptive quadrature.
//!
//! E_view(ω) fixes ωo = ω and integrates over the whole sphere of ωi; E_light(ω) fixes ωi = ω and integrates over ωo.
//! Each lobe is integrated in its own frame, where its horizon is an edge of the domain; delta lobes are added
//! exactly.

use super::cubature::{Patch, Tolerance, integrate, integrate_until, split, split_at};
use super::{Subject, dot};
use crate::closure::Bsdf;
use crate::closure::parts::Cosine;
use crate::lobes::registry::LobeClass;
use crate::lobes::{LobeKind, Rgb};
use crate::optics::{Frame, Scalar, V3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Which direction is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Side {
    /// ωo: what a viewer sees in a white world.
    #[default]
    View,
    /// ωi: what becomes of light from one direction.
    Light,
}

/// A directional albedo with an estimate of its absolute error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Albedo {
    /// Per channel.
    pub value: Rgb<f64>,
    /// The largest over the channels.
    pub error: f64,
}

impl Albedo {
    /// The largest channel.
    pub fn max(&self) -> f64 {
        self.value[0].max(self.value[1]).max(self.value[2])
    }
}

/// The albedo of `subject` for the direction `w` (world space, unit), delta lobes included.
pub fn albedo<'m, S: Scalar>(subject: &impl Subject<'m, S>, side: Side, w: [S; 3], tolerance: Tolerance) -> Albedo {
    albedo_until(subject, side, w, tolerance, |_| false)
}

/// [`albedo`], stopping early where `enough` says so of what is known so far.
pub fn albedo_until<'m, S: Scalar>(
    subject: &impl Subject<'m, S>,
    side: Side,
    w: [S; 3],
    tolerance: Tolerance,
    enough: impl Fn(&Albedo) -> bool,
) -> Albedo {
    let held = subject.bsdf(w);
    let delta = delta_albedo(subject, side, w, &held);
    let total = |value: [f64; 3], error: f64| Albedo { value: std::array::from_fn(|c| value[c] + delta[c]), error };
    let groups = groups(&held);
    let charts: Vec<Chart<S>> = groups.iter().map(|g| g.chart(w)).collect();
    let unknown =
        |chart: &Chart<S>| chart.cells().into_iter().map(|corners| Patch { corners, points: Vec::new() }).collect();
    let mut cells: Vec<Vec<Patch>> = charts.iter().map(unknown).collect();
    for lobe in (0..held.lobe_count()).filter(|lobe| held.lobe_kind(*lobe).0.class() == LobeClass::Scatter) {
        let index = group_of(&groups, held.lobe_frame(lobe), held.lobe_kind(lobe).0);
        let hints = charts[index].hints(&held, lobe, tolerance);
        cells[index] = split(std::mem::take(&mut cells[index]), &hints, CROWD);
    }
    let f = |index: usize, x: f64, y: f64| {
        let pick = |frame: &Frame<S>, kind: LobeKind| group_of(&groups, frame, kind) == index;
        let (moving, weight) = charts[index].direction(x, y);
        let part = match side {
            Side::View => held.part(moving, Cosine::Light, pick),
            Side::Light => subject.bsdf([moving.x, moving.y, moving.z]).part(vector(w), Cosine::View, pick),
        };
        part.map(|x| x.to_f64() * weight)
    };
    let lit =
        |index: usize, p: &Patch| !p.points.is_empty() || few(&p.corners).any(|[x, y]| f(index, x, y) != [0.0; 3]);
    let numbered = cells.into_iter().enumerate().flat_map(|(index, cells)| cells.into_iter().map(move |c| (index, c)));
    let cells = numbered.filter(|(index, patch)| lit(*index, patch)).collect();
    let i = integrate_until(cells, tolerance, f, |value, error| enough(&total(value, error)));
    total(i.value, i.error)
}

/// What one lobe does with the light of a view-side furnace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeShare {
    /// Index into [`Bsdf::lobe_kind`].
    pub lobe: usize,
    /// Scattered, weights and layers included.
    pub scattered: Albedo,
    /// What it would scatter with the same weight and no layer above it.
    pub unlayered: Albedo,
}

/// Where the energy goes, lobe by lobe, for ωo = `w`.
pub fn breakdown<'m, S: Scalar>(subject: &impl Subject<'m, S>, w: [S; 3], tolerance: Tolerance) -> Vec<LobeShare> {
    let bsdf = subject.bsdf(w);
    (0..bsdf.lobe_count())
        .map(|lobe| {
            let chart = Group::of(bsdf.lobe_frame(lobe), bsdf.lobe_kind(lobe).0).chart(w);
            let hints: Vec<[f64; 2]> = chart.hints(&bsdf, lobe, tolerance).into_iter().map(|h| h.0).collect();
            let cells = split_at(&chart.cells(), &hints, CROWD);
            let of = |layered: bool| match bsdf.lobe_delta(lobe, layered) {
                Some(part) => Albedo { value: part.map(S::to_f64), error: 0.0 },
                None => {
                    let i = integrate(&cells, tolerance, |x, y| {
                        let (wi, weight) = chart.direction(x, y);
                        bsdf.lobe_part(lobe, wi, layered).map(|x| x.to_f64() * weight)
                    });
                    Albedo { value: i.value, error: i.error }
                }
            };
            LobeShare { lobe, scattered: of(true), unlayered: of(false) }
        })
        .collect()
}

/// Directions of each lobe that tell where to look.
const HINTS: usize = 256;
/// And at least one for so many evaluations: what none of them shows may be missed.
const PER_HINT: usize = 2000;
/// More directions of one lobe than this in a cell are split up.
const CROWD: usize = 64;

/// Where a cell to which no light was seen to go is looked at before it is integrated: if it is black there, as below a
/// surface, it is left out.
fn few(cell: &[f64; 4]) -> impl Iterator<Item = [f64; 2]> {
    let [x0, x1, y0, y1] = *cell;
    let at = |lo: f64, hi: f64, k: usize| lo + (hi - lo) * [0.03, 0.21, 0.5, 0.79, 0.97][k];
    (0..25).map(move |k| [at(x0, x1, k / 5), at(y0, y1, k % 5)])
}

/// Directions that one lobe sends light from (or toward) the held direction to, and how much of it each stands for: where
/// to look for its peak.
fn directions<S: Scalar>(held: &Bsdf<'_, S>, lobe: usize, count: usize) -> Vec<(V3<S>, f64)> {
    let sample = |k: usize| {
        // A rank-1 lattice in two dimensions.
        let u = [0.754_877_67, 0.569_840_29].map(|step: f64| S::c((0.5 + step * k as f64).fract()));
        let (w, pdf) = held.lobe_sample(lobe, u)?;
        let [r, g, b] = held.lobe_part(lobe, w, true).map(S::to_f64);
        Some((w, r.max(g).max(b) / (pdf.to_f64() * count as f64)))
    };
    (0..count).filter_map(sample).collect()
}

/// Lobes that are integrated together, because their edges and ridges lie alike.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Group<S> {
    frame: Frame<S>,
    /// They follow the frame's x axis; the others follow its normal alone.
    along_thread: bool,
}

impl<S: Scalar> Group<S> {
    fn of(frame: &Frame<S>, kind: LobeKind) -> Self {
        Group { frame: *frame, along_thread: kind.spec().tangent_slot().is_some() }
    }

    fn takes(&self, frame: &Frame<S>, kind: LobeKind) -> bool {
        let along_thread = kind.spec().tangent_slot().is_some();
        self.along_thread == along_thread && self.frame.n == frame.n && (!along_thread || self.frame.t == frame.t)
    }

    /// How the sphere is laid out for them, if `held` is the direction that does not move.
    fn chart(&self, held: [S; 3]) -> Chart<S> {
        let local = self.frame.to_local(vector(held)).map(|x| x.to_f64());
        let layout = if self.along_thread { Layout::around_thread(local) } else { Layout::about_normal(local) };
        Chart { frame: self.frame, layout }
    }
}

/// One group per distinct normal, and per distinct thread.
fn groups<S: Scalar>(bsdf: &Bsdf<'_, S>) -> Vec<Group<S>> {
    let mut groups: Vec<Group<S>> = Vec::new();
    for lobe in 0..bsdf.lobe_count() {
        let (frame, kind) = (bsdf.lobe_frame(lobe), bsdf.lobe_kind(lobe).0);
        let integrated = kind.class() == LobeClass::Scatter;
        if integrated && !groups.iter().any(|g| g.takes(frame, kind)) {
            groups.push(Group::of(frame, kind));
        }
    }
    groups
}

/// The group a lobe is counted in; one whose frame was not there for the held direction (it may depend on the view)
/// goes with the first.
fn group_of<S: Scalar>(groups: &[Group<S>], frame: &Frame<S>, kind: LobeKind) -> usize {
    groups.iter().position(|g| g.takes(frame, kind)).unwrap_or(0)
}

/// The sphere as rectangles.
struct Chart<S> {
    frame: Frame<S>,
    layout: Layout,
}

#[derive(Clone, Copy, Debug)]
enum Layout {
    /// (u, φ): z = ±u², graded toward the horizon, and φ from the azimuth of the held direction on. Split where that
    /// puts edges: at its azimuth, and at its own polar angle, where the two α of a layer meet.
    AboutNormal { azimuth: f64, split: f64 },
    /// (u, v): the angles θ along the x axis and φ around it. A thread's ridge lies at θ = −θ of the held direction, as
    /// narrow as a thousandth: the cells meet there and grow from it with the cube. φ is graded toward the horizon and
    /// split at that of the held direction.
    AroundThread { ridge: f64, split: f64 },
}

/// φ = ¾π·(v − v³/3), from −½π to ½π for v in [−1, 1].
fn turn(v: f64) -> f64 {
    0.75 * PI * (v - v.powi(3) / 3.0)
}

impl Layout {
    fn about_normal(held: V3<f64>) -> Layout {
        let split = held.z.abs().clamp(1e-4, 1.0 - 1e-4).sqrt();
        Layout::AboutNormal { azimuth: held.y.atan2(held.x), split }
    }

    fn around_thread(held: V3<f64>) -> Layout {
        let around = held.y.atan2(held.z).clamp(-FRAC_PI_2, FRAC_PI_2);
        let split = solve(turn, around, -1.0, 1.0).clamp(-0.99, 0.99);
        Layout::AroundThread { ridge: -held.x.atan2(held.y.hypot(held.z)), split }
    }
}

impl<S: Scalar> Chart<S> {
    /// Where the light of one lobe was seen to go, and how much of it each place stands for. More such places beside edges
    /// of the chart that a peak may lie across stand for nothing.
    fn hints(&self, held: &Bsdf<'_, S>, lobe: usize, tolerance: Tolerance) -> Vec<([f64; 2], f64)> {
        let count = HINTS.max(tolerance.evaluations / PER_HINT);
        let places = directions(held, lobe, count).into_iter().map(|(w, share)| (self.place(w), share));
        match self.layout {
            // The mirror direction lies where the azimuth begins and ends.
            Layout::AboutNormal { .. } => places
                .flat_map(|([u, y], share)| [([u, y], share), ([u, y - 2.0 * PI], 0.0), ([u, y + 2.0 * PI], 0.0)])
                .collect(),
            // The cells meet on the ridge.
            Layout::AroundThread { .. } => places
                .flat_map(|([x, y], share)| [Some(([x, y], share)), (x.abs() < 0.2).then_some(([-x, y], 0.0))])
                .flatten()
                .collect(),
        }
    }

    /// The whole sphere.
    fn cells(&self) -> Vec<[f64; 4]> {
        match self.layout {
            Layout::AboutNormal { split, .. } => {
                let half = |(a, b)| {
                    // u < 0 is the lower hemisphere, black for most lobes.
                    [[-1.0, 0.0, a, b], [0.0, split, a, b], [split, 1.0, a, b]]
                };
                [(0.0, PI), (PI, 2.0 * PI)].into_iter().flat_map(half).collect()
            }
            Layout::AroundThread { split, .. } => {
                let half = |(lo, hi)| [[lo, hi, -1.0, split], [lo, hi, split, 1.0], [lo, hi, 1.0, 3.0]];
                [(-1.0, 0.0), (0.0, 1.0)].into_iter().flat_map(half).collect()
            }
        }
    }

    /// Where a direction in world space lies in the chart.
    fn place(&self, w: V3<S>) -> [f64; 2] {
        let local = self.frame.to_local(w).map(|x| x.to_f64());
        match self.layout {
            Layout::AboutNormal { azimuth, .. } => {
                let turn = (local.y.atan2(local.x) - azimuth + PI).rem_euclid(2.0 * PI);
                [local.z.abs().sqrt().copysign(local.z), turn]
            }
            Layout::AroundThread { ridge, .. } => {
                let off = local.x.atan2(local.y.hypot(local.z)) - ridge;
                let length = if off < 0.0 { FRAC_PI_2 + ridge } else { FRAC_PI_2 - ridge };
                let (lift, around) =
                    if local.z < 0.0 { (2.0, (local.y).atan2(-local.z)) } else { (0.0, local.y.atan2(local.z)) };
                [(off / length).cbrt(), lift + solve(turn, around, -1.0, 1.0)]
            }
        }
    }

    /// A direction in world space, and the solid angle per area of the chart there.
    fn direction(&self, x: f64, y: f64) -> (V3<S>, f64) {
        let (direction, weight) = match self.layout {
            Layout::AboutNormal { azimuth, .. } => {
                // dz = 2|u| du.
                let z = x * x.abs();
                let (sin, phi) = ((1.0 - z * z).max(0.0).sqrt(), y + azimuth - PI);
                (V3::new(sin * phi.cos(), sin * phi.sin(), z), 2.0 * x.abs())
            }
            Layout::AroundThread { ridge, .. } => {
                let length = if x < 0.0 { FRAC_PI_2 + ridge } else { FRAC_PI_2 - ridge };
                let (sin, cos) = (ridge + length * x.powi(3)).sin_cos();
                // z ≥ 0 for v in [−1, 1]; the lower side follows for v in [1, 3].
                let (side, v) = if y > 1.0 { (-1.0, y - 2.0) } else { (1.0, y) };
                let (sin_phi, cos_phi) = turn(v).sin_cos();
                let weight = length * 3.0 * x * x * 0.75 * PI * (1.0 - v * v) * cos.max(0.0);
                (V3::new(sin, cos * sin_phi, side * cos * cos_phi), weight)
            }
        };
        (self.frame.to_world(direction.map(S::c)), weight)
    }
}

/// x in `[lo, hi]` with f(x) = y, for an increasing f.
fn solve(f: impl Fn(f64) -> f64, y: f64, mut lo: f64, mut hi: f64) -> f64 {
    for _ in 0..50 {
        let middle = 0.5 * (lo + hi);
        if f(middle) < y { lo = middle } else { hi = middle }
    }
    0.5 * (lo + hi)
}

fn vector<S>(w: [S; 3]) -> V3<S> {
    let [x, y, z] = w;
    V3 { x, y, z }
}

/// What delta lobes add to the albedo.
pub(super) fn delta_albedo<'m, S: Scalar>(
    subject: &impl Subject<'m, S>,
    side: Side,
    w: [S; 3],
    held: &Bsdf<'m, S>,
) -> Rgb<f64> {
    if side == Side::View {
        return held.delta_albedo().map(S::to_f64);
    }
    // Light from ω leaves a delta lobe along the direction the lobe would show to a viewer there. Lobes are told apart by
    // where they were constructed: toward the horizon the directions of different ones meet.
    let mut seen: Vec<(LobeKind, u32, [S; 3])> = Vec::new();
    let mut sum = [0.0; 3];
    for lobe in 0..held.lobe_count() {
        let Some(direction) = held.lobe_delta_direction(lobe) else { continue };
        let (kind, site) = held.lobe_kind(lobe);
        if seen.iter().any(|s| (s.0, s.1) == (kind, site) && dot(s.2, direction) > 1.0 - 1e-6) {
            continue;
        }
        seen.push((kind, site, direction));
        let there = subject.bsdf(direction);
        for other in (0..there.lobe_count()).filter(|o| there.lobe_kind(*o) == (kind, site)) {
            if there.lobe_delta_direction(other).is_some_and(|back| dot(back, w) > 1.0 - 1e-6) {
                let part = there.lobe_delta(other, true).unwrap_or([S::zero(); 3]);
                for c in 0..3 {
                    sum[c] += part[c].to_f64();
                }
            }
        }
    }
    sum
}
