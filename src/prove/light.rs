//! The light's side of closures that look at the view.
//!
//! With ωi held, every ωo sees a tree of its own: E_light = ∫ Σ w_k(ωo)·f_k·|cos θo| dωo. Lobes whose parameters are
//! known are cut into slices of the cosine to ωo, each with the largest weights of its slice and the part of the lobe's
//! albedo that falls into it; of all others each is taken at its largest weight, alone.

use super::energy::{Detail, Held, Loose, Only};
use super::interval::Interval;
use super::number::{Path, Region};
use super::search::Problem;

/// Slices of the cosine to ωo, from −1 to 1.
pub const SLICES: usize = 32;

/// Questions decided along one path.
const DECISIONS: usize = 4;

/// The slice with this number: finer toward grazing, where albedos and Fresnel terms change.
pub fn slice(k: usize) -> Interval {
    let end = |k: usize| {
        let x = 2.0 * k as f64 / SLICES as f64 - 1.0;
        x.signum() * x * x
    };
    Interval::new(end(k), end(k + 1))
}

/// No albedo with the light held in this region is larger.
pub fn upper(problem: &Problem<'_>, region: &Region, detail: Detail, loose: &mut Loose, work: &mut usize) -> f64 {
    if detail == Detail::Coarse {
        return f64::INFINITY;
    }
    let mut alone = |lobe| {
        let mut path = Path::sliced(problem.graph, region, Interval::new(-1.0, 1.0), DECISIONS);
        problem.upper(&mut path, detail, Held::LightOf(Only::Lobe(lobe)), loose, work)
    };
    let (unsliced, sliced) = problem.energy.lobes(problem.root);
    let unsliced: f64 = unsliced.into_iter().map(&mut alone).sum();
    let together: f64 = sliced.into_iter().map(&mut alone).sum();
    // Alone is often enough, and cheaper.
    if unsliced + together <= 1.0 {
        return unsliced + together;
    }
    let mut sum = 0.0f64;
    for k in 0..SLICES {
        let mut path = Path::sliced(problem.graph, region, slice(k), DECISIONS);
        sum += problem.upper(&mut path, detail, Held::LightOf(Only::Slice(k)), loose, work);
    }
    unsliced + sum.min(together)
}
