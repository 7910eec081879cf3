//! What speed costs in accuracy: a material in every tier, under every layering rule, with tables of several sizes.
//!
//! Each variant is timed and compared with the reference tier under the same rule: f·|cos| over a fixed set of
//! directions, and the energy that a white furnace misses. [`mark_front`] tells which variants nothing beats.

use super::clock;
use super::{Side, Tolerance, albedo};
use crate::albedo::Precision;
use crate::closure::{Bsdf, LayeringRule, Scratch};
use crate::engine::{Material, ShadeError, Tier};
use crate::globals::Globals;
use crate::optics::Scalar;
use std::hint::black_box;
use std::time::Instant;

/// How large tables are, next to what the tier asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableSize {
    /// Half the nodes along every axis.
    Half,
    /// As the tier has them.
    Normal,
    /// Twice the nodes along every axis.
    Double,
}

impl TableSize {
    /// All of them.
    pub const ALL: [TableSize; 3] = [TableSize::Half, TableSize::Normal, TableSize::Double];

    fn factor(self) -> f64 {
        match self {
            TableSize::Half => 0.5,
            TableSize::Normal => 1.0,
            TableSize::Double => 2.0,
        }
    }
}

/// One way to make a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Precision of arithmetic and tables.
    pub tier: Tier,
    /// How layers scale.
    pub rule: LayeringRule,
    /// Of the single precision tiers; the reference tier has its own.
    pub tables: TableSize,
}

impl Choice {
    /// What the tables are baked by.
    pub fn precision(self) -> Precision {
        self.tier.precision().scaled(self.tables.factor())
    }
}

/// Cosines of ωo at which [`Point::lost`] is measured.
pub const COSINES: [f64; 3] = [0.9, 0.5, 0.1];

/// What a choice costs and what it gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The variant.
    pub choice: Choice,
    /// Nanoseconds per evaluation.
    pub eval: f64,
    /// Nanoseconds per direction of a batch; `None` in the reference tier, which has no batches.
    pub batch: Option<f64>,
    /// Nanoseconds per sample.
    pub sample: f64,
    /// Nanoseconds to shade a point and to flatten its closures.
    pub setup: f64,
    /// Milliseconds to make the material, once: nearly all of it goes into its tables. A material of the reference tier also
    /// has those of `standard`.
    pub bake: f64,
    /// Largest |f·cos − reference|, relative to the brightest direction seen from the same ωo.
    pub max_error: f64,
    /// Root of the mean square of the same.
    pub rms_error: f64,
    /// The part of the energy that is missing at each of [`COSINES`]: 1 − E/E′, where E′ is the albedo under the rule that
    /// loses nothing toward the camera, in the reference tier. Measured to some 1e-4.
    pub lost: [f64; COSINES.len()],
    /// Memory of the tables.
    pub table_bytes: usize,
    /// Memory of one BSDF.
    pub bsdf_bytes: usize,
    /// No other variant with the same rule is both faster and closer to the reference.
    pub on_front: bool,
}

impl Point {
    /// Nanoseconds per direction, evaluated the fastest way there is.
    pub fn fastest(&self) -> f64 {
        self.batch.map_or(self.eval, |batch| batch.min(self.eval))
    }
}

const TOLERANCE: Tolerance = Tolerance { error: 2e-5, evaluations: 40_000 };
/// Cosines of ωo at which errors are measured, and how many ωi over the whole sphere.
const VIEWS: [f64; 6] = [0.99, 0.8, 0.5, 0.25, 0.1, 0.03];
const LIGHTS: usize = 128;

/// Measures a material in every tier, and, where it has layers, under every rule, where it has tables, with each size of
/// them. `make` makes it as told, from nothing: the time it takes counts. The shading point is the default one at u = 0.3,
/// v = 0.6.
///
/// # Errors
/// Whatever `make` fails with, and closure trees beyond a budget.
pub fn measure<E: From<ShadeError>>(make: impl Fn(Choice) -> Result<Material, E>) -> Result<Vec<Point>, E> {
    let globals = Globals { u: 0.3, v: 0.6, ..Globals::default() };
    let timed = |choice| {
        let start = Instant::now();
        Ok::<_, E>(Made { choice, material: make(choice)?, milliseconds: start.elapsed().as_secs_f64() * 1e3 })
    };
    let reference = |rule| timed(Choice { tier: Tier::Reference, rule, tables: TableSize::Normal });
    let lossless = reference(LayeringRule::View)?.material;
    let tree = lossless.tree(&globals)?;
    let rules = if tree.size(tree.root()).layers > 0 { &LayeringRule::ALL[..] } else { &LayeringRule::ALL[..1] };
    let whole = energy(&lossless, &globals)?;
    let mut points = Vec::new();
    for &rule in rules {
        let truth = reference(rule)?;
        let mut row = Vec::new();
        for tier in [Tier::Fast, Tier::Standard] {
            for tables in TableSize::ALL {
                let made = timed(Choice { tier, rule, tables })?;
                // Without tables there is but one size.
                if tables == TableSize::Normal || made.material.table_bytes() > 0 {
                    row.push(point(&made, &truth.material, &globals, whole)?);
                }
            }
        }
        row.push(point(&truth, &truth.material, &globals, whole)?);
        mark_front(&mut row);
        points.append(&mut row);
    }
    Ok(points)
}

/// Marks the points that no other beats: none is as close to the reference in less time per direction, and none in as
/// little time closer. Times within a fiftieth of each other count as the same.
pub fn mark_front(points: &mut [Point]) {
    let beaten: Vec<bool> = points
        .iter()
        .map(|a| {
            points.iter().any(|b| {
                let (no_slower, faster) = (b.fastest() <= a.fastest() * 1.02, b.fastest() < a.fastest() * 0.98);
                (no_slower && b.max_error < a.max_error) || (faster && b.max_error <= a.max_error)
            })
        })
        .collect();
    for (point, beaten) in points.iter_mut().zip(beaten) {
        point.on_front = !beaten;
    }
}

/// A variant as it came.
struct Made {
    choice: Choice,
    material: Material,
    milliseconds: f64,
}

fn point(made: &Made, truth: &Material, globals: &Globals, whole: [f64; COSINES.len()]) -> Result<Point, ShadeError> {
    let &Made { choice, ref material, milliseconds } = made;
    let wo = [0.48, 0.36, 0.8];
    let double = choice.tier == Tier::Reference;
    let (calls, batch, setup, bsdf_bytes) = if double {
        let bsdf = material.shade_reference(globals, wo)?;
        let setup = || {
            black_box(material.shade_reference(black_box(globals), *black_box(&wo)).is_ok());
        };
        (clock::calls(&bsdf), None, clock::nanoseconds(setup), bsdf.bytes())
    } else {
        let wo = wo.map(|x| x as f32).into();
        let (bsdf, mut scratch) = (material.shade(globals, wo)?, Scratch::new());
        // Into memory that is used again, as renderers do.
        let setup = || {
            black_box(material.shade_in(black_box(globals), *black_box(&wo), &mut scratch).is_ok());
        };
        (clock::calls(&bsdf), Some(clock::batch(&bsdf)), clock::nanoseconds(setup), bsdf.bytes())
    };
    let (max_error, rms_error) = if double { (0.0, 0.0) } else { errors(material, truth, globals)? };
    let energy = energy(material, globals)?;
    Ok(Point {
        choice,
        eval: calls.0,
        batch,
        sample: calls.1,
        setup,
        bake: milliseconds,
        max_error,
        rms_error,
        lost: std::array::from_fn(|k| if whole[k] > 0.0 { 1.0 - energy[k] / whole[k] } else { 0.0 }),
        table_bytes: material.table_bytes(),
        bsdf_bytes,
        on_front: false,
    })
}

fn view(cos: f64) -> [f64; 3] {
    let sin = (1.0 - cos * cos).sqrt();
    [sin * 0.8, sin * 0.6, cos]
}

/// Largest and root mean square difference of f·cos, each relative to the brightest light from its ωo.
fn errors(material: &Material, truth: &Material, globals: &Globals) -> Result<(f64, f64), ShadeError> {
    let lights: Vec<[f32; 3]> = (0..LIGHTS)
        .map(|k| {
            let (z, phi) = (1.0 - (2.0 * k as f64 + 1.0) / LIGHTS as f64, 2.399_963 * k as f64);
            let r = (1.0 - z * z).sqrt();
            [r * phi.cos(), r * phi.sin(), z].map(|x| x as f32)
        })
        .collect();
    let (mut largest, mut squares, mut count) = (0.0f64, 0.0, 0);
    for cos in VIEWS {
        let wo = view(cos).map(|x| x as f32);
        let (fast, exact) = (material.shade(globals, wo.into())?, truth.shade_reference(globals, wo.map(f64::from))?);
        let pairs: Vec<[[f64; 3]; 2]> = lights
            .iter()
            .map(|wi| [fast.eval(*wi).f_cos.map(f64::from), exact.eval(wi.map(f64::from)).f_cos])
            .collect();
        let brightest = pairs.iter().flat_map(|p| p[1]).fold(0.0, f64::max);
        if brightest > 0.0 {
            for off in pairs.iter().flat_map(|p| (0..3).map(|c| (p[0][c] - p[1][c]) / brightest)) {
                largest = largest.max(off.abs());
                squares += off * off;
                count += 1;
            }
        }
    }
    Ok((largest, (squares / f64::from(count.max(1))).sqrt()))
}

/// The albedo toward the camera at each of [`COSINES`], summed over channels.
fn energy(material: &Material, globals: &Globals) -> Result<[f64; COSINES.len()], ShadeError> {
    fn sum<'m, S: Scalar>(bsdf: Bsdf<'m, S>, w: [f64; 3]) -> f64 {
        let subject = |_: [S; 3]| bsdf.clone();
        albedo(&subject, Side::View, w.map(S::c), TOLERANCE).value.iter().sum()
    }
    let mut energy = [0.0; COSINES.len()];
    for (energy, cos) in energy.iter_mut().zip(COSINES) {
        let w = view(cos);
        *energy = match material.tier() {
            Tier::Reference => sum(material.shade_reference(globals, w)?, w),
            Tier::Fast | Tier::Standard => sum(material.shade(globals, w.map(|x| x as f32).into())?, w),
        };
    }
    Ok(energy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(eval: f64, max_error: f64) -> Point {
        let choice = Choice { tier: Tier::Fast, rule: LayeringRule::Min, tables: TableSize::Normal };
        Point {
            choice,
            eval,
            batch: None,
            sample: 0.0,
            setup: 0.0,
            bake: 0.0,
            max_error,
            rms_error: 0.0,
            lost: [0.0; COSINES.len()],
            table_bytes: 0,
            bsdf_bytes: 0,
            on_front: false,
        }
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let mut points = [at(10.0, 1e-2), at(10.1, 1e-3), at(20.0, 1e-3), at(15.0, 1e-4), at(50.0, 0.0), at(60.0, 0.0)];
        mark_front(&mut points);
        assert_eq!(points.map(|p| p.on_front), [false, true, false, true, true, false]);
        // In a batch the first is the fastest.
        points[0].batch = Some(3.0);
        mark_front(&mut points);
        assert_eq!(points.map(|p| p.on_front), [true, true, false, true, true, false]);
    }
}
