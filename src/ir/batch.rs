//! Shading many points of one material with one call.

use super::program::{Program, ShadeError};
use super::wide::{self, LANES, Registers};
use crate::Globals;
use crate::closure::ClosureTree;

/// Where trees of many points go, and room to work. Keep one per thread: it allocates only when it grows.
///
/// ```
/// use overcoat::{Engine, Globals, ir::Batch};
/// let shader = Engine::new().compile("a", "Ci = (0.2 + 0.6 * noise(8 * P)) * diffuse(N);")?;
/// let material = shader.material(&[])?;
/// let points: Vec<Globals> = (0..100).map(|k| Globals { p: glam::Vec3::X * k as f32, ..Globals::default() }).collect();
/// let mut batch = Batch::new();
/// material.shade_batch(&points, &mut batch);
/// assert_eq!(batch.trees().len(), 100);
/// let bsdf = material.bsdf(&batch.trees()[3], &points[3])?;
/// assert!(bsdf.eval([0.0, 0.6, 0.8]).f_cos[0] > 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Batch {
    trees: Vec<ClosureTree>,
    errors: Vec<(usize, ShadeError)>,
    registers: Registers,
}

impl Batch {
    /// An empty one.
    pub fn new() -> Self {
        Batch::default()
    }

    /// The tree of each point of the last call, in order; black where shading went beyond a budget.
    pub fn trees(&self) -> &[ClosureTree] {
        &self.trees
    }

    /// The points of the last call where shading went beyond a budget, by their index.
    pub fn errors(&self) -> &[(usize, ShadeError)] {
        &self.errors
    }
}

impl Program {
    /// Shades every point; `batch` then holds what [`shade`](Self::shade) would have made of each, bit for bit.
    pub fn shade_batch(&self, points: &[Globals], batch: &mut Batch) {
        batch.errors.clear();
        batch.trees.resize_with(points.len(), ClosureTree::new);
        match self.kept() {
            Some(Ok(kept)) => points.iter().zip(&mut batch.trees).for_each(|(point, tree)| kept.give(point, tree)),
            Some(Err(e)) => {
                batch.trees.iter_mut().for_each(ClosureTree::clear);
                batch.errors.extend((0..points.len()).map(|k| (k, *e)));
            }
            None => {
                for (k, (points, trees)) in points.chunks(LANES).zip(batch.trees.chunks_mut(LANES)).enumerate() {
                    let errors = wide::run(self, points, trees, &mut batch.registers);
                    let errors = errors.into_iter().enumerate();
                    batch.errors.extend(errors.filter_map(|(lane, e)| Some((k * LANES + lane, e?))));
                }
            }
        }
    }
}
