//! `Engine` → `Material` → `shade` → `Bsdf`: the way a host goes through the library. (STUB, replaced soon.)

use crate::Globals;
use crate::closure::Bsdf;
use glam::Vec3;

/// A specialised shader: cheap to share between threads.
#[derive(Clone, Debug, Default)]
pub struct Material {}

/// Shading went beyond a budget.
#[derive(Clone, Debug)]
pub struct ShadeError(pub String);

impl Material {
    /// The BSDF at a point seen from `wo` (unit, away from the surface).
    pub fn shade(&self, globals: &Globals, wo: Vec3) -> Result<Bsdf<'_>, ShadeError> {
        Ok(Bsdf::stub(globals.n, wo))
    }
}
