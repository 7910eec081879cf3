//! What the integrator asks of a material, so that tests can hand it surfaces whose answer is known.

use crate::closure::{Bsdf, Eval, Sample};
use crate::engine::ShadeError;
use crate::lobes::Rgb32;
use crate::lobes::registry::LobeClass;
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

    /// Whether some light may pass straight through somewhere, see [`Scatter::straight`]. If not, whatever stands
    /// between a point and a light hides it, and need not be shaded to know.
    fn see_through(&self) -> bool;
}

/// Scattering at one point for one ωo. Directions are unit, world space, away from the surface.
pub trait Scatter {
    /// f·|cos| and the density of [`sample`](Self::sample), without delta lobes.
    fn eval(&self, wi: Vec3) -> Eval;
    /// Draws a direction, `None` if the sample is lost.
    fn sample(&self, u: [f32; 3]) -> Option<Sample>;
    /// Radiance given off toward ωo.
    fn emission(&self) -> Rgb32;
    /// The share of light that passes without changing its direction: the weight of delta lobes toward −ωo.
    fn straight(&self) -> Rgb32;
}

/// Whether a ray that came from `wo` and leaves along `wi` has gone straight on, up to rounding.
pub fn goes_straight(wo: Vec3, wi: Vec3) -> bool {
    wo.dot(wi) < -1.0 + 2e-6
}

impl Surface for Material {
    type Scatter<'a> = Bsdf<'a>;

    fn shade(&self, globals: &Globals, wo: Vec3) -> Result<Bsdf<'_>, ShadeError> {
        Material::shade(self, globals, wo)
    }

    fn see_through(&self) -> bool {
        self.program().sites().iter().any(|site| site.kind.spec().class == LobeClass::Delta)
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
    fn straight(&self) -> Rgb32 {
        self.transparency()
    }
}
