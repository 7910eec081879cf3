//! The static proof that a script keeps energy, for all values of its parameters and all directions – or a witness
//! that it does not.
//!
//! In: a [`Shader`] and what is known of its parameters. Out: a [`Report`]. The script becomes a graph of numbers and
//! closures (`trace`), whose albedo is bounded by polynomials over boxes of parameters and angles (`number`, `energy`),
//! which are divided until every part is below 1 (`search`). Where that fails a witness is looked for among the worst
//! parts and measured by quadrature (`witness`). Nothing here shades a point to prove something; nothing is called a
//! gain without having been measured.

mod domain;
mod energy;
mod functions;
mod graph;
mod interval;
mod light;
mod number;
mod poly;
mod probe;
mod report;
mod search;
mod trace;
mod witness;

pub use probe::probe;
pub use report::{Report, Verdict};
pub use search::TOLERANCE;
pub use witness::Witness;

use crate::diag::Diagnostic;
use crate::engine::Shader;
use crate::ir::Value;
use domain::{Case, domain};
use energy::{Detail, Energy};
use search::{Outcome, Problem, Which};
use witness::Hunt;

/// What is known of a script's parameters.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Parameters with a value.
    pub set: Vec<(String, Value)>,
    /// Ranges in place of the declared ones: name, lowest, highest. `u`, `v` and `time` may have one too.
    pub ranges: Vec<(String, f32, f32)>,
}

/// Operations spent with every lobe scattering everything, then with lobes as they are.
const COARSE_EFFORT: usize = 60_000;
const FINE_EFFORT: usize = 1_500_000;

/// Proves that a shader keeps energy over the ranges of its parameters, finds a witness that it does not, or says what
/// stood in the way.
///
/// # Errors
/// Parameters that are not there, values of the wrong type, ranges that make no sense.
pub fn prove(shader: &Shader, options: &Options) -> Result<Report, Vec<Diagnostic>> {
    let checked = shader.checked();
    checked.specialise(&options.set)?;
    let mut domain = domain(checked, options)?;
    let at_default = |case: &Case| {
        let moved = |(name, value): &&(String, Value)| {
            let param = shader.params().iter().find(|p| p.name == *name);
            param.is_none_or(|p| p.default.as_ref() != Some(value))
        };
        case.fixed.iter().filter(moved).count()
    };
    domain.cases.sort_by_key(at_default);
    let mut report = Report::new(std::mem::take(&mut domain.notes));
    let mut body = checked.body.clone();
    body.strings = domain.strings.clone();
    let effort = FINE_EFFORT / domain.cases.len().clamp(1, 30);
    for case in &domain.cases {
        let Some((graph, root)) = trace::trace(&body, case.bindings.clone(), &domain.globals) else {
            report.too_large(shader);
            break;
        };
        let energy = Energy::new(&graph, root, shader.engine().layering_of());
        let problem = Problem::new(&graph, root, energy);
        prove_case(&problem, shader, case, effort, &mut report);
        if report.verdict == Verdict::Gains {
            break;
        }
    }
    Ok(report)
}

fn prove_case(problem: &Problem<'_>, shader: &Shader, case: &Case, effort: usize, report: &mut Report) {
    report.look(problem, shader);
    let coarse = problem.search(Which::View, Detail::Coarse, COARSE_EFFORT, |_| false);
    let mut found = None;
    let mut hunt = Hunt::new(problem, shader, case);
    let view = match coarse.upper <= 1.0 + TOLERANCE {
        true => coarse,
        false => problem.search(Which::View, Detail::Fine, effort, |region| {
            found = hunt.near(region);
            found.is_some()
        }),
    };
    let dims_alike = problem.energy.sides_alike();
    let light: Option<Outcome> = match (dims_alike, problem.looks_at_view) {
        _ if found.is_some() => None,
        (true, false) => None,
        (true, true) => Some(problem.search(Which::Light, Detail::Fine, effort, |region| {
            found = hunt.near(region);
            found.is_some()
        })),
        // Reported, not judged.
        (false, _) => Some(problem.search(Which::Light, Detail::Fine, effort / 20, |_| false)),
    };
    if let Some(witness) = found {
        report.gains(problem, shader, &hunt, witness);
        return;
    }
    report.outcome(shader, problem, &view, Which::View);
    match light {
        Some(light) if dims_alike => report.outcome(shader, problem, &light, Which::Light),
        Some(light) => report.light_side(light.upper),
        None => {}
    }
}
