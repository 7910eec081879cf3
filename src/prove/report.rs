//! What a proof has to say, in the script's own words: which terms add up, what to do about it, what stood in the way.

use super::energy::{Detail, Held, Loose, reachable};
use super::graph::{Cid, Closure, Id, LeafKind, Node};
use super::number::{Path, Region};
use super::search::{Outcome, Problem, TOLERANCE, Which};
use super::witness::{Hunt, Witness};
use crate::audit::Side;
use crate::diag::Diagnostic;
use crate::engine::Shader;
use crate::ir::Value;
use crate::span::Span;

/// What became of a proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Proven: no albedo is above 1 + [`TOLERANCE`].
    Conserves,
    /// Neither proven nor refuted.
    Undecided,
    /// Measured: an albedo is above 1 + [`TOLERANCE`].
    Gains,
}

impl Verdict {
    /// As it is written in results.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Conserves => "conserves",
            Verdict::Undecided => "undecided",
            Verdict::Gains => "gains",
        }
    }
}

/// The outcome of a proof.
#[derive(Clone, Debug)]
pub struct Report {
    /// The verdict over all cases.
    pub verdict: Verdict,
    /// No albedo is above this, from either side; `None` where that was not established.
    pub bound: Option<f64>,
    /// Where it gains.
    pub witness: Option<Witness>,
    /// What is wrong, or stood in the way, with places.
    pub diagnostics: Vec<Diagnostic>,
    /// What was assumed, and what is worth knowing.
    pub notes: Vec<String>,
}

/// More terms than this are not listed.
const MAX_TERMS: usize = 5;
/// Longer pieces of the script are cut.
const MAX_QUOTE: usize = 60;

/// A term of the sum that `Ci` is.
struct Term {
    /// The closure, without the weights above it.
    closure: Cid,
    span: Span,
    /// What it scatters at most, per channel.
    part: [f64; 3],
}

impl Report {
    pub(super) fn new(notes: Vec<String>) -> Report {
        Report { verdict: Verdict::Conserves, bound: Some(0.0), witness: None, diagnostics: Vec::new(), notes }
    }

    pub(super) fn too_large(&mut self, shader: &Shader) {
        self.verdict = Verdict::Undecided;
        self.bound = None;
        let message = "the script branches too often to be followed";
        self.diagnostics.push(Diagnostic::warning("W0702", shader.checked().span, message));
    }

    /// Warns about weights that can be negative.
    pub(super) fn look(&mut self, problem: &Problem<'_>, shader: &Shader) {
        let whole = problem.whole();
        let mut path = Path::new(problem.graph, &whole, false, 0);
        let mut seen: Vec<Span> = self.diagnostics.iter().map(|d| d.span).collect();
        for id in reachable(problem.graph, problem.root) {
            let Closure::Mul(weights, _) = problem.graph.closure_at(id) else { continue };
            for w in weights {
                let Node::Weight(x) = problem.graph.node(*w) else { continue };
                let lowest = path.number(x).range.lo;
                let span = problem.graph.place(x);
                if lowest < -1e-4 && lowest.is_finite() && !seen.contains(&span) {
                    seen.push(span);
                    let least = if lowest > -1e3 { format!(", perhaps {}", short(lowest)) } else { String::new() };
                    let message = format!("the weight `{}` can be negative{least}", quote(shader, span));
                    let d = Diagnostic::warning("W0703", span, message).note("negative weights count as 0");
                    self.diagnostics.push(d.help("write `max(0, …)` if that is meant"));
                }
            }
        }
    }

    /// Takes in how far a search came.
    pub(super) fn outcome(&mut self, shader: &Shader, problem: &Problem<'_>, outcome: &Outcome, which: Which) {
        let finite = outcome.upper.is_finite();
        self.bound = self.bound.filter(|_| finite).map(|b| b.max(outcome.upper));
        if outcome.upper <= 1.0 + TOLERANCE {
            return;
        }
        self.verdict = self.verdict.max(Verdict::Undecided);
        if self.diagnostics.iter().any(|d| d.code == "W0702") {
            return;
        }
        let side = match which {
            Which::View if problem.looks_at_view => " toward the viewer",
            Which::View => "",
            Which::Light => " seen from the light",
        };
        let span = problem.graph.closure_place(problem.root);
        let message = match finite {
            true => format!(
                "not decided: no more than {} is proven{side}, and nothing above 1 was found",
                short(outcome.upper)
            ),
            false => format!("not decided: no bound was found{side}, and nothing above 1 either"),
        };
        let mut d = Diagnostic::warning("W0702", span, message);
        let mut named: Vec<String> = Vec::new();
        for id in &outcome.open {
            let advice = match problem.graph.node(*id) {
                Node::Leaf(leaf) => {
                    let name = self.leaf_name(problem, shader, leaf);
                    format!("a narrower range of `{name}` would help: `--range {name}=lo,hi`")
                }
                _ => format!("`{}` is taken as free within its range", quote(shader, problem.graph.place(*id))),
            };
            if named.len() < 3 && !named.contains(&advice) {
                named.push(advice);
            }
        }
        d = named.into_iter().fold(d, Diagnostic::help);
        if which == Which::Light {
            d = d.help("weights that look at the view are bounded one by one where the light is held");
        }
        self.diagnostics.push(d);
    }

    fn leaf_name(&self, problem: &Problem<'_>, shader: &Shader, leaf: u32) -> String {
        match problem.graph.leaves[leaf as usize].kind {
            LeafKind::Param(p, _) => shader.params()[p].name.clone(),
            LeafKind::Global(g, _) => g.name().to_owned(),
            LeafKind::Facing => "dot(N, I)".to_owned(),
            LeafKind::Picture(_) => "texture()".to_owned(),
        }
    }

    /// The light side under `view` layering.
    pub(super) fn light_side(&mut self, upper: f64) {
        if upper > 1.0 + TOLERANCE {
            let note = "seen from the light, `view` layering may gain";
            self.notes.retain(|n| !n.starts_with(note));
            self.notes.push(match upper.is_finite() {
                true => format!("{note}: up to {}", short(upper)),
                false => note.to_owned(),
            });
        }
    }

    /// Takes in a witness, and says which terms add up.
    pub(super) fn gains(&mut self, problem: &Problem<'_>, shader: &Shader, hunt: &Hunt<'_, '_>, witness: Witness) {
        self.verdict = Verdict::Gains;
        self.bound = None;
        let terms = terms(problem, hunt, &witness);
        let root = problem.graph.closure_place(problem.root);
        let side = match witness.side {
            Side::View => "",
            Side::Light => ", seen from the light",
        };
        let at = at_words(&witness);
        let message = format!("the material scatters {} of the light{at}{side}", short(witness.albedo.max()));
        let channel =
            (0..3).fold(0, |best, c| if witness.albedo.value[c] > witness.albedo.value[best] { c } else { best });
        let span = terms.first().filter(|_| terms.len() == 1).map_or(root, |t| t.span);
        let mut d = Diagnostic::error("E0701", span, message);
        let mut places: Vec<Span> = Vec::new();
        for term in terms.iter().take(MAX_TERMS) {
            let part = format!("up to {}", short(term.part[channel]));
            if term.span == span && d.note.is_empty() {
                d = d.note(part);
            } else if !places.contains(&term.span) {
                places.push(term.span);
                d = d.label(term.span, part);
            }
        }
        if terms.len() > 1 {
            let parts: Vec<String> = terms
                .iter()
                .take(MAX_TERMS)
                .map(|t| format!("`{}` contributes up to {}", quote(shader, t.span), short(t.part[channel])))
                .collect();
            let more =
                if terms.len() > MAX_TERMS { format!(", and {} more", terms.len() - MAX_TERMS) } else { String::new() };
            d = d.help(format!("{}{more}; together {}", parts.join(", "), short(witness.albedo.max())));
        }
        for repair in repairs(problem, shader, hunt, &witness, &terms) {
            d = d.help(repair);
        }
        self.diagnostics.retain(|d| d.code != "W0702");
        self.diagnostics.insert(0, d);
        self.witness = Some(witness);
    }
}

/// ` at base_color = 1, cosine 0.3`.
fn at_words(witness: &Witness) -> String {
    let mut words: Vec<String> =
        witness.params.iter().map(|(name, value)| format!("{name} = {}", value_text(value))).collect();
    words.extend(witness.globals.iter().map(|(name, value)| format!("{name} = {}", numbers_text(value))));
    if words.is_empty() {
        words.push("the default parameters".to_owned());
    }
    format!(" at {}, cosine {}", words.join(", "), short(witness.cos))
}

fn value_text(value: &Value) -> String {
    match value {
        Value::String(text) => format!("\"{text}\""),
        other => numbers_text(&other.numbers()),
    }
}

fn numbers_text(x: &[f32]) -> String {
    match x {
        [x] => x.to_string(),
        [a, b, c] if a == b && b == c => a.to_string(),
        _ => format!("({})", x.iter().map(f32::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// Few digits, none that say nothing.
fn short(x: f64) -> String {
    let text = if (x - 1.0).abs() < 0.01 { format!("{x:.5}") } else { format!("{x:.3}") };
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.is_empty() || text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The source at a place, on one line.
fn quote(shader: &Shader, span: Span) -> String {
    let text = shader.source().slice(span).split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(MAX_QUOTE) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text,
    }
}

/// A place with the brackets that its text lacks.
fn balanced(shader: &Shader, span: Span) -> Span {
    let source = &shader.source().text;
    let (mut open, mut missing) = (0usize, 0usize);
    for c in shader.source().slice(span).chars() {
        match c {
            '(' => open += 1,
            ')' if open > 0 => open -= 1,
            ')' => missing += 1,
            _ => {}
        }
    }
    let mut start = span.start as usize;
    for _ in 0..missing {
        match source[..start].rfind('(') {
            Some(at) => start = at,
            None => break,
        }
    }
    Span { start: start as u32, ..span }
}

/// The region that is a witness and nothing else.
fn region_of(problem: &Problem<'_>, hunt: &Hunt<'_, '_>, witness: &Witness) -> Region {
    let mut region = problem.whole();
    for (id, x) in hunt.leaf_values(witness) {
        region.ranges.insert(id.0, super::interval::Interval::point(x));
    }
    region.cos = super::interval::Interval::point(witness.cos);
    region
}

/// The terms of `Ci` at a witness, largest first, those that scatter nothing left out.
fn terms(problem: &Problem<'_>, hunt: &Hunt<'_, '_>, witness: &Witness) -> Vec<Term> {
    let region = region_of(problem, hunt, witness);
    let mut path = Path::new(problem.graph, &region, true, 0);
    let graph = problem.graph;
    let mut found = Vec::new();
    let mut waiting = vec![(problem.root, Vec::new(), None::<Span>)];
    while let Some((id, weights, span)) = waiting.pop() {
        if found.len() > 200 {
            break;
        }
        let here = span.unwrap_or_else(|| balanced(hunt.shader, graph.closure_place(id)));
        match graph.closure_at(id) {
            Closure::Zero => {}
            Closure::Add(a, b) => {
                // The parts of a sum that is scaled as a whole have places of their own.
                waiting.push((*b, weights.clone(), None));
                waiting.push((*a, weights, None));
            }
            Closure::Mul(w, c) => {
                let mut weights = weights;
                weights.push(*w);
                waiting.push((*c, weights, Some(here)));
            }
            Closure::Select(c, a, b) => {
                let first = super::number::decided(path.number(*c).range).unwrap_or(true);
                waiting.push((if first { *a } else { *b }, weights, span));
            }
            Closure::Lobe(..) | Closure::Layer(..) => {
                let bound = problem.energy.bound(&mut path, id, Detail::Exact, Held::Viewer, &mut Loose::new());
                let part = std::array::from_fn(|c| {
                    let factors =
                        weights.iter().map(|w: &[Id; 3]| path.number(w[c]).range.hi.max(0.0)).product::<f64>();
                    factors * path.upper(&bound.most[c])
                });
                found.push(Term { closure: id, span: here, part });
            }
        }
    }
    let size = |t: &Term| t.part[0].max(t.part[1]).max(t.part[2]);
    found.retain(|t| size(t) > 1e-3);
    found.sort_by(|a, b| size(b).total_cmp(&size(a)));
    found
}

/// What to do about a gain.
fn repairs(
    problem: &Problem<'_>,
    shader: &Shader,
    hunt: &Hunt<'_, '_>,
    witness: &Witness,
    terms: &[Term],
) -> Vec<String> {
    let mut repairs = Vec::new();
    if witness.side == Side::Light && problem.looks_at_view {
        repairs.push(
            "weights that look at the view favour the directions a lobe shines in: weigh less, or by a constant"
                .to_owned(),
        );
    }
    let above_one = |x: &f32| *x > 1.0;
    for (name, value) in &hunt.params(&hunt.point_of(witness)) {
        let declared = !matches!(value, Value::Int(_)) && problem_names(problem, shader).contains(name);
        if declared && value.numbers().iter().any(above_one) {
            let fix = format!(
                "`{name}` goes up to {}: declare `[[ float max = 1 ]]`, or write `min({name}, 1)`",
                numbers_text(&value.numbers())
            );
            if !repairs.contains(&fix) {
                repairs.push(fix);
            }
        }
    }
    for (name, value) in &witness.globals {
        if value.len() == 1 && (value[0] > 1.0 || value[0] < 0.0) {
            repairs.push(format!(
                "`{name}` is not limited to 0..1: write `clamp({name}, 0, 1)`, or check with `--range {name}=0,1`"
            ));
        }
    }
    let is_sheen = |t: &Term| matches!(problem.graph.closure_at(t.closure), Closure::Lobe(kind, ..) if matches!(kind.spec().name, "sheen_bsdf" | "velvet"));
    let texts: Vec<String> = terms.iter().take(2).map(|t| quote(shader, t.span)).collect();
    match terms {
        [a, b, ..] if a.span != b.span => {
            let (top, base) = if is_sheen(a) { (&texts[0], &texts[1]) } else { (&texts[1], &texts[0]) };
            if is_sheen(a) || is_sheen(b) {
                repairs.push(format!("let one lie over the other: `layer({top}, {base})`"));
            } else {
                repairs.push(format!(
                    "share the light between them: `mix({}, {}, x)` with x from 0 to 1",
                    texts[0], texts[1]
                ));
            }
        }
        _ => {}
    }
    let factor = (1.0 / witness.albedo.max() * 1000.0).floor() / 1000.0;
    if factor > 0.0 {
        let or = if repairs.is_empty() { "" } else { "or " };
        repairs.push(format!("{or}scale the whole by {}", short(factor)));
    }
    repairs
}

/// Parameters that matter.
fn problem_names(problem: &Problem<'_>, shader: &Shader) -> Vec<String> {
    let name = |leaf: &u32| match problem.graph.leaves[*leaf as usize].kind {
        LeafKind::Param(p, _) => Some(shader.params()[p].name.clone()),
        _ => None,
    };
    problem.leaves.iter().filter_map(name).collect()
}
