//! A BSDF that owns what it borrows.

use super::Material;
use crate::closure::{Bsdf, Scratch};
use crate::globals::Globals;
use crate::ir::ShadeError;
use glam::Vec3;
use self_cell::self_cell;
use std::fmt;

self_cell!(
    struct Cell {
        owner: Material,
        #[not_covariant]
        dependent: Scratch,
    }
);

/// A [`Bsdf`] together with the material whose tables it reads, for hosts that keep it where no lifetime can be named.
/// Shading the same material again uses the same memory.
///
/// ```
/// # #[cfg(feature = "cloth")] {
/// use overcoat::{Engine, Globals, OwnedBsdf};
/// let material = Engine::new().material("cloth", "Ci = sheen(diffuse(N), N, 1, 0.3);")?;
/// let mut bsdf = OwnedBsdf::new(material.clone());
/// bsdf.shade(&material, &Globals::default(), glam::Vec3::Z)?;
/// drop(material);
/// assert!(bsdf.with(|bsdf| bsdf.eval([0.0, 0.6, 0.8])).pdf > 0.0);
/// # }
/// # Ok::<(), overcoat::Error>(())
/// ```
pub struct OwnedBsdf(Cell);

impl OwnedBsdf {
    /// Black so far.
    pub fn new(material: Material) -> Self {
        OwnedBsdf(Cell::new(material, |_| Scratch::new()))
    }

    /// Shades `material`: see [`Material::shade`]. After an error it is black.
    ///
    /// # Errors
    /// If the closure tree goes beyond a budget.
    pub fn shade(&mut self, material: &Material, globals: &Globals, wo: Vec3) -> Result<(), ShadeError> {
        if !material.is_same(self.0.borrow_owner()) {
            self.0 = Cell::new(material.clone(), |_| Scratch::new());
        }
        self.0.with_dependent_mut(|material, scratch| material.shade_in(globals, wo, scratch).map(|_| ()))
    }

    /// Gives the BSDF shaded last to `f`.
    pub fn with<R>(&self, f: impl FnOnce(&Bsdf<'_>) -> R) -> R {
        self.0.with_dependent(|_, scratch| f(scratch.bsdf()))
    }

    /// The material shaded last.
    pub fn material(&self) -> &Material {
        self.0.borrow_owner()
    }
}

impl fmt::Debug for OwnedBsdf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.with(|bsdf| f.debug_tuple("OwnedBsdf").field(bsdf).finish())
    }
}
