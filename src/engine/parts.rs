//! Parts of a material's tree, looked at on their own.

use super::{Baked, Material, ShadeError};
use crate::closure::{Balance, Balancer, Bsdf, ClosureTree, LayeringRule, Tables, flatten};
use crate::globals::Globals;
use crate::optics::{Scalar, V3};
use glam::Vec3;

impl Material {
    /// Shows `look` the BSDF of a tree made of this material's lobes, for example of a part of [`tree`](Self::tree), seen
    /// from `wo` (world space, unit). Where it is constant, the scales of the `balanced` rule are solved anew, because
    /// those of a part are not those of the whole: milliseconds.
    ///
    /// # Errors
    /// If the tree goes beyond a budget.
    pub fn with_part<R>(
        &self,
        tree: &ClosureTree,
        globals: &Globals,
        wo: Vec3,
        look: impl FnOnce(&Bsdf<'_>) -> R,
    ) -> Result<R, ShadeError> {
        self.part(tree, globals, V3::from_f32(wo.to_array()), &self.inner.tables, look)
    }

    /// [`with_part`](Self::with_part) in double precision.
    ///
    /// # Errors
    /// If the tree goes beyond a budget.
    pub fn with_part_reference<R>(
        &self,
        tree: &ClosureTree,
        globals: &Globals,
        wo: [f64; 3],
        look: impl FnOnce(&Bsdf<'_, f64>) -> R,
    ) -> Result<R, ShadeError> {
        self.part(tree, globals, V3::new(wo[0], wo[1], wo[2]), self.reference_tables(), look)
    }

    fn part<S: Scalar, R>(
        &self,
        tree: &ClosureTree,
        globals: &Globals,
        wo: V3<S>,
        tables: &Baked<S>,
        look: impl FnOnce(&Bsdf<'_, S>) -> R,
    ) -> Result<R, ShadeError> {
        let (layering, curves) = (self.layering(), &tables.curves);
        let anew = (layering.rule == LayeringRule::Balanced && self.program().is_constant())
            .then(|| Balancer::new(tables.precision).solve(tree, globals, layering.tint, curves));
        // Scales of materials that vary belong to pairs of sites, wherever those stand.
        let balance: Option<&Balance<S>> = anew.as_ref().or(tables.balance.as_ref());
        Ok(look(&flatten(tree, globals, wo, layering, Tables { curves, balance })?))
    }
}
