//! The white furnace: directional albedo of a whole BSDF from both sides, by adaptive quadrature.
//!
//! E_view(ω) fixes ωo = ω and integrates over the whole sphere of ωi; E_light(ω) fixes ωi = ω and integrates over ωo.
//! Each lobe is integrated in its own frame, where its horizon is an edge of the domain; delta lobes are added
//! exactly.

use super::cubature::{Integral, Tolerance, integrate, split_at};
use super::{Subject, dot};
use crate::closure::Bsdf;
use crate::lobes::Rgb;
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
    let held = subject.bsdf(w);
    let normals = distinct_normals(&held);
    let hints = hints(&held);
    let mut total = Albedo { value: [0.0; 3], error: 0.0 };
    let share = Tolerance { error: tolerance.error / normals.len().max(1) as f64, ..tolerance };
    for (group, frame) in normals.iter().enumerate() {
        let part = over_sphere(frame, w, &hints, share, |moving| match side {
            Side::View => held.part(moving, false, |n| group_of(&normals, n) == group),
            Side::Light => {
                subject.bsdf([moving.x, moving.y, moving.z]).part(vector(w), true, |n| group_of(&normals, n) == group)
            }
        });
        for c in 0..3 {
            total.value[c] += part.value[c];
        }
        total.error += part.error;
    }
    let delta = delta_albedo(subject, side, w, &held);
    for c in 0..3 {
        total.value[c] += delta[c];
    }
    total
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
    let hints = hints(&bsdf);
    (0..bsdf.lobe_count())
        .map(|lobe| {
            let frame = bsdf.lobe_frame(lobe);
            let of = |layered: bool| match bsdf.lobe_delta(lobe, layered) {
                Some(part) => Albedo { value: part.map(S::to_f64), error: 0.0 },
                None => {
                    let i = over_sphere(frame, w, &hints, tolerance, |wi| bsdf.lobe_part(lobe, wi, layered));
                    Albedo { value: i.value, error: i.error }
                }
            };
            LobeShare { lobe, scattered: of(true), unlayered: of(false) }
        })
        .collect()
}

/// Directions that light from (or toward) the held direction goes to: where to look for peaks.
fn hints<S: Scalar>(held: &Bsdf<'_, S>) -> Vec<[S; 3]> {
    let sample = |k: usize| {
        // A rank-1 lattice in three dimensions.
        let u = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step: f64| S::c((0.5 + step * k as f64).fract()));
        held.sample(u).filter(|s| !s.flags.delta).map(|s| s.wi)
    };
    (0..64).filter_map(sample).collect()
}

/// ∫ over the sphere about `frame`, graded toward its horizon and split where `held` puts edges: at its azimuth, at
/// right angles to it, at its own polar angle, where the two α of a layer meet, and among the `hints`.
pub(crate) fn over_sphere<S: Scalar>(
    frame: &Frame<S>,
    held: [S; 3],
    hints: &[[S; 3]],
    tolerance: Tolerance,
    mut f: impl FnMut(V3<S>) -> Rgb<S>,
) -> Integral {
    let local = frame.to_local(vector(held));
    let azimuth = local.y.to_f64().atan2(local.x.to_f64());
    let split = local.z.to_f64().abs().clamp(1e-4, 1.0 - 1e-4).sqrt();
    let mut cells = Vec::new();
    for side in [-1.0, 1.0] {
        for quarter in 0..4 {
            let (a, b) = (quarter as f64 * FRAC_PI_2, (quarter + 1) as f64 * FRAC_PI_2);
            // u < 0 is the lower hemisphere.
            let mut cell = |lo: f64, hi: f64| cells.push([lo.min(hi), lo.max(hi), a, b]);
            cell(0.0, side * split);
            cell(side * split, side);
        }
    }
    let place = |hint: &[S; 3]| {
        let local = frame.to_local(vector(*hint)).map(|x| x.to_f64());
        let turn = (local.y.atan2(local.x) - azimuth + PI).rem_euclid(2.0 * PI);
        [local.z.abs().sqrt().copysign(local.z), turn]
    };
    let points: Vec<[f64; 2]> = hints.iter().map(place).collect();
    integrate(&split_at(&cells, &points, 4), tolerance, |u, phi| {
        // z = ±u²: dz = 2|u| du.
        let z = u * u.abs();
        let (sin, phi) = ((1.0 - z * z).max(0.0).sqrt(), phi + azimuth - PI);
        let direction = V3::new(S::c(sin * phi.cos()), S::c(sin * phi.sin()), S::c(z));
        f(frame.to_world(direction)).map(|x| x.to_f64() * 2.0 * u.abs())
    })
}

fn vector<S>(w: [S; 3]) -> V3<S> {
    let [x, y, z] = w;
    V3 { x, y, z }
}

/// One frame per distinct normal.
fn distinct_normals<S: Scalar>(bsdf: &Bsdf<'_, S>) -> Vec<Frame<S>> {
    let mut frames: Vec<Frame<S>> = Vec::new();
    for frame in bsdf.frames() {
        if !frames.iter().any(|f| f.n == frame.n) {
            frames.push(*frame);
        }
    }
    frames
}

/// The group a lobe with normal `n` is counted in; a normal that was not there for the held direction (it may depend
/// on the view) goes with the first.
fn group_of<S: Scalar>(normals: &[Frame<S>], n: V3<S>) -> usize {
    normals.iter().position(|f| f.n == n).unwrap_or(0)
}

fn delta_albedo<'m, S: Scalar>(subject: &impl Subject<'m, S>, side: Side, w: [S; 3], held: &Bsdf<'m, S>) -> Rgb<f64> {
    if side == Side::View {
        return held.delta_albedo().map(S::to_f64);
    }
    // Light from ω leaves a delta lobe along the direction the lobe would show to a viewer there.
    let mut seen: Vec<[S; 3]> = Vec::new();
    let mut sum = [0.0; 3];
    for (direction, _) in held.delta_parts() {
        if seen.iter().any(|d| dot(*d, direction) > 1.0 - 1e-6) {
            continue;
        }
        seen.push(direction);
        for (back, part) in subject.bsdf(direction).delta_parts() {
            if dot(back, w) > 1.0 - 1e-6 {
                for c in 0..3 {
                    sum[c] += part[c].to_f64();
                }
            }
        }
    }
    sum
}
