//! Paths: from a camera ray to the radiance it brings home.
//!
//! Unidirectional path tracing. At every scattering the environment is sampled, and so is the BSDF; the two are weighted by
//! the power heuristic (Veach 1997), mirror-like samples count fully. Light that passes straight through the subject
//! (gauze) is found by both. Paths end by Russian roulette or at the depth limit,
//! where the last ray may still escape into the light. Transmitted rays go on from the other side of the surface. No
//! memory is allocated on the way.

use super::camera::Ray;
use super::sampler::Sampler;
use super::scene::{EPSILON, FLOOR_ALBEDO, Hit, Point, World};
use super::surface::goes_straight;
use super::{RenderSettings, Scatter, Surface};
use crate::Globals;
use crate::closure::{Eval, Sample, SampleFlags};
use crate::engine::ShadeError;
use crate::lobes::Rgb32;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, TAU};

/// How many times a path scatters before Russian roulette may end it.
const CERTAIN: u32 = 3;

/// What paths cost, and how many failed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub rays: u64,
    pub invalid: u64,
}

impl Tally {
    pub fn add(&mut self, other: Tally) {
        self.rays += other.rays;
        self.invalid += other.invalid;
    }
}

/// Follows paths through a world whose subject is made of one surface.
pub struct Tracer<'w, S> {
    world: &'w World,
    surface: &'w S,
    max_depth: u32,
    sample_env: bool,
    see_through: bool,
}

/// A path under way.
struct Path {
    ray: Ray,
    radiance: Vec3,
    throughput: Vec3,
    /// Density with which the last BSDF that had a choice chose the direction; `None` for a camera ray and behind a
    /// mirror, where no other technique could have found it.
    pdf: Option<f32>,
}

/// Where rays leave a scattering point.
pub(super) struct Exits {
    n: Vec3,
    /// On the side of `n`, and on the other.
    near: Vec3,
    far: Vec3,
}

impl<'w, S: Surface> Tracer<'w, S> {
    pub fn new(world: &'w World, surface: &'w S, settings: &RenderSettings) -> Self {
        Tracer {
            world,
            surface,
            max_depth: settings.max_depth,
            sample_env: settings.sample_env,
            see_through: surface.see_through(),
        }
    }

    /// Radiance arriving along `ray`, against its direction.
    pub fn radiance(&self, ray: Ray, sampler: &mut Sampler, tally: &mut Tally) -> Result<Vec3, ShadeError> {
        let mut path = Path { ray, radiance: Vec3::ZERO, throughput: Vec3::ONE, pdf: None };
        for depth in 0..=self.max_depth {
            tally.rays += 1;
            let hit = self.world.hit(path.ray);
            let goes_on = match hit {
                Hit::Nothing => {
                    path.radiance += path.throughput * self.escaped(&path);
                    false
                }
                Hit::Floor { p, opacity } => {
                    if opacity < 1.0 {
                        path.radiance += path.throughput * (1.0 - opacity) * self.escaped(&path);
                        path.throughput *= opacity;
                    }
                    let exits = Exits { n: Vec3::Y, near: p + Vec3::Y * EPSILON, far: p };
                    depth < self.max_depth && self.scatter(&mut path, &Matte, &exits, depth, sampler, tally)?
                }
                Hit::Subject(point) => {
                    let wo = -path.ray.dir;
                    let (globals, exits) = face(&point, wo);
                    let scattering = self.surface.shade(&globals, wo)?;
                    path.radiance += path.throughput * Vec3::from_array(scattering.emission());
                    depth < self.max_depth && self.scatter(&mut path, &scattering, &exits, depth, sampler, tally)?
                }
            };
            if !goes_on {
                break;
            }
        }
        Ok(path.radiance)
    }

    /// Adds the light that reaches the point directly and sends the path on its way; `false` where it ends.
    fn scatter(
        &self,
        path: &mut Path,
        scattering: &impl Scatter,
        exits: &Exits,
        depth: u32,
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Result<bool, ShadeError> {
        let [light_u, light_v, survive, _] = sampler.next4();
        let [u0, u1, u2, _] = sampler.next4();
        if self.sample_env {
            let sheets = self.max_depth - 1 - depth;
            path.radiance += path.throughput * self.direct(scattering, exits, sheets, [light_u, light_v], tally)?;
        }
        let Some(sample) = scattering.sample([u0, u1, u2]) else {
            return Ok(false);
        };
        path.throughput *= Vec3::from_array(sample.weight);
        let wi = Vec3::from(sample.wi);
        if !(path.throughput.is_finite() && wi.is_finite()) {
            // Ends here, and is counted where the sample reaches the film.
            path.radiance = Vec3::NAN;
            return Ok(false);
        }
        let odds = if depth + 1 < CERTAIN { 1.0 } else { path.throughput.max_element().min(1.0) };
        if survive >= odds || path.throughput.max_element() <= 0.0 {
            return Ok(false);
        }
        path.throughput /= odds;
        if !sample.flags.delta {
            path.pdf = Some(sample.pdf);
        } else if !goes_straight(-path.ray.dir, wi) {
            path.pdf = None;
        }
        // Straight on, the direction is still the one that the point before chose.
        path.ray = exits.leave(wi);
        Ok(true)
    }

    /// Light from the environment by one direction drawn from it, through at most `sheets` of the subject's surfaces.
    fn direct(
        &self,
        scattering: &impl Scatter,
        exits: &Exits,
        sheets: u32,
        u: [f32; 2],
        tally: &mut Tally,
    ) -> Result<Vec3, ShadeError> {
        let Some(light) = self.world.environment.sample(u) else {
            return Ok(Vec3::ZERO);
        };
        let Eval { f_cos, pdf } = scattering.eval(light.dir);
        let f_cos = Vec3::from_array(f_cos);
        if f_cos == Vec3::ZERO {
            return Ok(Vec3::ZERO);
        }
        let visible = self.visibility(exits.leave(light.dir), sheets, tally)?;
        Ok(f_cos * light.radiance * visible * (power_heuristic(light.pdf, pdf) / light.pdf))
    }

    /// The share of the environment's light that comes through along the ray: whole where nothing stands in between,
    /// less behind what lets light pass straight.
    fn visibility(&self, mut ray: Ray, sheets: u32, tally: &mut Tally) -> Result<Vec3, ShadeError> {
        tally.rays += 1;
        if !self.see_through {
            return Ok(Vec3::splat(self.world.visibility(ray)));
        }
        let mut through = Vec3::ONE;
        for _ in 0..=sheets {
            match self.world.hit(ray) {
                Hit::Nothing => return Ok(through),
                Hit::Floor { opacity, .. } => return Ok(through * (1.0 - opacity)),
                Hit::Subject(point) => {
                    let wo = -ray.dir;
                    let (globals, exits) = face(&point, wo);
                    through *= Vec3::from_array(self.surface.shade(&globals, wo)?.straight());
                    if through == Vec3::ZERO {
                        return Ok(through);
                    }
                    ray = exits.leave(ray.dir);
                    tally.rays += 1;
                }
            }
        }
        Ok(Vec3::ZERO)
    }

    /// The environment as the path sees it, weighted against having drawn that direction in [`direct`](Self::direct).
    fn escaped(&self, path: &Path) -> Vec3 {
        let (radiance, env_pdf) = self.world.environment.look(path.ray.dir);
        match path.pdf {
            Some(pdf) if self.sample_env => radiance * power_heuristic(pdf, env_pdf),
            _ => radiance,
        }
    }
}

/// The weight of a technique of density `p` beside another of density `q`.
fn power_heuristic(p: f32, q: f32) -> f32 {
    // As a ratio: squares of densities overflow.
    if p >= q {
        let r = q / p;
        if p > 0.0 { 1.0 / (1.0 + r * r) } else { 0.0 }
    } else {
        let r = p / q;
        r * r / (1.0 + r * r)
    }
}

/// The point as a viewer along `wo` sees it: normals on the viewer's side. An interpolated normal that turns away from
/// the viewer all the same is bent back until it just faces it; the BSDF is never told otherwise.
pub(super) fn face(point: &Point, wo: Vec3) -> (Globals, Exits) {
    const FACING: f32 = 0.02;
    let backfacing = point.ng.dot(wo) < 0.0;
    let side = if backfacing { -1.0 } else { 1.0 };
    let (ng, mut n) = (point.ng * side, point.n * side);
    let cos = n.dot(wo);
    if cos < FACING {
        n = (n + wo * (FACING - cos)).normalize_or(ng);
    }
    let (near, far) = if backfacing { (point.inside, point.outside) } else { (point.outside, point.inside) };
    let globals = Globals {
        p: point.p,
        n,
        ng,
        i: -wo,
        u: point.u,
        v: point.v,
        dpdu: point.dpdu,
        dpdv: point.dpdv,
        backfacing,
        ..Globals::default()
    };
    (globals, Exits { n, near, far })
}

impl Exits {
    fn leave(&self, dir: Vec3) -> Ray {
        Ray { origin: if self.n.dot(dir) >= 0.0 { self.near } else { self.far }, dir }
    }
}

/// The floor: Lambert, facing up.
struct Matte;

impl Scatter for Matte {
    fn eval(&self, wi: Vec3) -> Eval {
        let pdf = wi.y.max(0.0) * FRAC_1_PI;
        Eval { f_cos: (FLOOR_ALBEDO * pdf).to_array(), pdf }
    }

    fn sample(&self, u: [f32; 3]) -> Option<Sample> {
        let (r, (sin, cos)) = (u[0].sqrt(), (u[1] * TAU).sin_cos());
        let wi = Vec3::new(r * cos, (1.0 - u[0]).sqrt(), r * sin);
        let Eval { f_cos, pdf } = self.eval(wi);
        let weight = FLOOR_ALBEDO.to_array();
        (pdf > 0.0).then_some(Sample {
            wi: wi.into(),
            f_cos,
            pdf,
            weight,
            flags: SampleFlags::default(),
            eta: 1.0,
            roughness: 1.0,
        })
    }

    fn emission(&self) -> Rgb32 {
        [0.0; 3]
    }

    fn straight(&self) -> Rgb32 {
        [0.0; 3]
    }
}
