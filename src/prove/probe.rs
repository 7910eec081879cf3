//! Verdicts held against random materials: parameters within their ranges, directions and sides at random, measured.

use super::energy::Energy;
use super::search::{Problem, TOLERANCE};
use super::trace::trace;
use super::witness::{Hunt, measure};
use super::{Options, Report, Verdict};
use crate::audit::{Side, Tolerance, albedo};
use crate::closure::Bsdf;
use crate::engine::Shader;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

/// Directions measured per material.
const DIRECTIONS: usize = 25;

/// Measures `count` random (parameter, angle) pairs and the witness, and returns what contradicts the report. Same seed,
/// same probes.
pub fn probe(shader: &Shader, options: &Options, report: &Report, count: usize, seed: u64) -> Vec<String> {
    let mut found: Vec<String> = witness_stands(shader, options, report).into_iter().collect();
    let checked = shader.checked();
    let Ok(domain) = super::domain::domain(checked, options) else { return found };
    let mut body = checked.body.clone();
    body.strings = domain.strings.clone();
    let mut rng = Pcg32::seed_from_u64(seed);
    if report.verdict == Verdict::Gains {
        return found;
    }
    for round in 0..count.div_ceil(DIRECTIONS) {
        let case = &domain.cases[rng.random_range(0..domain.cases.len())];
        let Some((graph, root)) = trace(&body, case.bindings.clone(), &domain.globals) else { return found };
        let problem = Problem::new(&graph, root, Energy::new(&graph, root, shader.engine().layering_of()));
        let hunt = Hunt::new(&problem, shader, case);
        let mut point = hunt.random(&mut rng, round);
        let Ok(material) = shader.material(&hunt.params(&point)) else { continue };
        let both = problem.energy.sides_alike();
        for _ in 0..DIRECTIONS {
            let graded = rng.random_range(0.0..1.0f64).powi(rng.random_range(1..5));
            point.cos = graded.max(1e-4) * if rng.random_range(0..6) == 0 { -1.0 } else { 1.0 };
            point.phi = rng.random_range(0.0..std::f64::consts::TAU);
            let side = if both && rng.random_range(0..2) == 0 { Side::Light } else { Side::View };
            let (globals, dir) = hunt.scene(&point);
            let rough = Tolerance { error: 1e-3, evaluations: 9000 };
            let subject = |wo: [f32; 3]| material.shade(&globals, wo.into()).unwrap_or_else(|_| Bsdf::black());
            let seen = albedo(&subject, side, dir.map(|x| x as f32), rough);
            // Rules that are too coarse may err upward: what looks like a gain is measured again.
            if seen.max() <= 1.0 + TOLERANCE {
                continue;
            }
            let sure = measure(&material, &globals, side, dir);
            if sure.max() - sure.error > 1.0 + TOLERANCE {
                let params: Vec<String> =
                    hunt.params(&point).iter().map(|(n, v)| format!("{n} = {:?}", v.numbers())).collect();
                found.push(format!(
                    "`{}` but {side:?} albedo {:.5} ± {:.0e} at {}, u {}, v {}, cosine {:.4}",
                    report.verdict.name(),
                    sure.max(),
                    sure.error,
                    params.join(", "),
                    globals.u,
                    globals.v,
                    point.cos,
                ));
                return found;
            }
        }
    }
    found
}

/// The witness of a gain measured again, in double precision.
fn witness_stands(shader: &Shader, options: &Options, report: &Report) -> Option<String> {
    let witness = report.witness.as_ref()?;
    let mut set = options.set.clone();
    set.extend(witness.params.iter().cloned());
    let material = shader.material(&set).ok()?;
    let globals = witness.scene;
    let subject = |wo: [f64; 3]| material.shade_reference(&globals, wo).unwrap_or_else(|_| Bsdf::black());
    let tolerance = Tolerance { error: 2e-5, evaluations: 200_000 };
    let measured = albedo(&subject, witness.side, witness.dir, tolerance);
    let stands = measured.max() - measured.error > 1.0 + TOLERANCE;
    (!stands).then(|| format!("`gains` but the witness measures {:.5} ± {:.0e}", measured.max(), measured.error))
}
