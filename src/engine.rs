//! `Engine` → `Material` → `shade` → `Bsdf`: the way a host goes through the library. (STUB, replaced soon.)

use crate::Globals;
use crate::closure::{Bsdf, ClosureTree, Curves, Layering, TreeError, flatten};
use crate::lobes::LobeKind;
use crate::optics::V3;
use glam::Vec3;

/// A specialised shader: cheap to share between threads.
#[derive(Clone, Debug, Default)]
pub struct Material {
    curves: Curves<f32>,
}

/// Shading went beyond a budget.
pub type ShadeError = TreeError;

impl Material {
    /// The BSDF at a point seen from `wo` (unit, away from the surface).
    pub fn shade(&self, globals: &Globals, wo: Vec3) -> Result<Bsdf<'_>, ShadeError> {
        let mut tree = ClosureTree::new();
        let lobe = tree.lobe(LobeKind::Diffuse, 0, &globals.n.to_array());
        let lobe = tree.mul([0.8, 0.1, 0.1], lobe);
        tree.set_root(lobe);
        flatten(&tree, globals, V3::from_f32(wo.to_array()), Layering::default(), &self.curves)
    }
}
