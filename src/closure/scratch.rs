//! Memory for shading that is used again.

use super::{Bsdf, ClosureTree};
use crate::optics::Scalar;

/// Room for one shading point, kept between points: what [`Material::shade_in`](crate::Material::shade_in) fills. After the first few points it
/// allocates only where a tree is larger than all before. One per thread.
///
/// ```
/// # #[cfg(feature = "cloth")] {
/// use overcoat::{Engine, Globals, Scratch};
/// let material = Engine::new().material("cloth", "Ci = sheen(diffuse(N), N, 1, 0.3);")?;
/// let mut scratch = Scratch::new();
/// for cos in [0.9f32, 0.5, 0.1] {
///     let wo = glam::Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
///     let bsdf = material.shade_in(&Globals::default(), wo, &mut scratch)?;
///     assert!(bsdf.albedo()[0] <= 1.0);
/// }
/// # }
/// # Ok::<(), overcoat::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scratch<'m, S: Scalar = f32> {
    pub(crate) tree: ClosureTree,
    pub(crate) bsdf: Bsdf<'m, S>,
}

impl<S: Scalar> Scratch<'_, S> {
    /// Empty.
    pub fn new() -> Self {
        Scratch { tree: ClosureTree::new(), bsdf: Bsdf::black() }
    }
}

impl<'m, S: Scalar> Scratch<'m, S> {
    /// What was shaded last; black before.
    pub fn bsdf(&self) -> &Bsdf<'m, S> {
        &self.bsdf
    }
}

impl<S: Scalar> Default for Scratch<'_, S> {
    fn default() -> Self {
        Scratch::new()
    }
}
