//! What the integrator asks of a material, so that tests can hand it surfaces whose answer is known.

use crate::closure::{Bsdf, Eval, Sample};
use crate::engine::ShadeError;
use crate::lobes::Rgb32;
use crate::{Globals, Material};
use glam::Vec3;

/// Something that can be shaded.
pub trait Surface: Sync {
    /// Scattering at one point for one ωo.
    type Scatter<'a>: Scatter
    where
        Self: 'a;

    /// The scattering at a point seen from `wo` (unit, world space, away from the surface, on the side of `globals.n`).
    fn shade(&self, globals: &Globals, wo: Vec3) -> Result<Self::Scatter<'_>, ShadeError>;
}

/// Scattering at one point for one ωo. Directions are unit, world space, away from the surface.
pub trait Scatter {
    /// f·|cos| and the density of [`sample`](Self::sample), without delta lobes.
    fn eval(&self, wi: Vec3) -> Eval;
    /// Draws a direction, `None` if the sample is lost.
    fn sample(&self, u: [f32; 3]) -> Option<Sample>;
    /// Radiance given off toward ωo.
    fn emission(&self) -> Rgb32;
}

impl Surface for Material {
    type Scatter<'a> = Bsdf<'a>;

    fn shade(&self, globals: &Globals, wo: Vec3) -> Result<Bsdf<'_>, ShadeError> {
        Material::shade(self, globals, wo)
    }
}

impl Scatter for Bsdf<'_> {
    fn eval(&self, wi: Vec3) -> Eval {
        Bsdf::eval(self, wi.to_array())
    }
    fn sample(&self, u: [f32; 3]) -> Option<Sample> {
        Bsdf::sample(self, u)
    }
    fn emission(&self) -> Rgb32 {
        Bsdf::emission(self)
    }
}
