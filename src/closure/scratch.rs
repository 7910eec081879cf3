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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Engine, Globals};

    #[test]
    fn nothing_is_left_of_the_point_before() {
        let material =
            Engine::new().material("m", "Ci = holdout() + 0.5 * diffuse(N) + u * emission();").expect("a script");
        let mut scratch = Scratch::new();
        for u in [0.5, 0.0, 1.0] {
            let globals = Globals { u, ..Globals::default() };
            let bsdf = material.shade_in(&globals, glam::Vec3::Z, &mut scratch).expect("small");
            let alone = material.shade(&globals, glam::Vec3::Z).expect("small");
            assert_eq!(bsdf.signals(), alone.signals());
            assert_eq!((bsdf.emission(), bsdf.lobe_count()), (alone.emission(), alone.lobe_count()));
        }
    }
}
