//! What a proof is about: the values each parameter may take.
//!
//! A range comes from the caller, else from the metadata `min` and `max`, else from `UImin` and `UImax`, else it is
//! [0, 1] and the default. Ints with few values and strings with `options` are gone through one by one, each choice a
//! case of its own. Everything else stays at its default.

use super::Options;
use super::interval::Interval;
use super::trace::Binding;
use crate::diag::Diagnostic;
use crate::ir::body::{Cells, GlobalVar, VarId};
use crate::ir::{CheckedShader, ParamDecl, Ty, Value};
use std::collections::HashMap;

/// Ints with more values than this are taken as any number in their range.
const MAX_VALUES: usize = 64;
/// More combinations of ints and strings than this are not gone through.
const MAX_CASES: usize = 512;

/// One combination of ints and strings, the rest in ranges.
#[derive(Clone, Debug)]
pub struct Case {
    /// By variable.
    pub bindings: HashMap<VarId, Binding>,
    /// What was set or chosen.
    pub fixed: Vec<(String, Value)>,
}

/// All that a proof is about.
#[derive(Clone, Debug, Default)]
pub struct Domain {
    /// Every combination.
    pub cases: Vec<Case>,
    /// Ranges of globals.
    pub globals: Vec<(GlobalVar, Interval)>,
    /// What was assumed, in words.
    pub notes: Vec<String>,
    /// The strings of the script, with those that were added.
    pub strings: Vec<String>,
}

enum Choice {
    One(Binding),
    Values(Vec<Value>),
}

/// The values the parameters of a shader may take.
///
/// # Errors
/// Names that are no parameters, and ranges that make no sense.
pub fn domain(shader: &CheckedShader, options: &Options) -> Result<Domain, Vec<Diagnostic>> {
    let mut domain = Domain { strings: shader.body.strings.clone(), ..Domain::default() };
    let mut errors = Vec::new();
    for (name, lo, hi) in &options.ranges {
        let global = [GlobalVar::U, GlobalVar::V, GlobalVar::Time].into_iter().find(|g| g.name() == name);
        if !(lo <= hi && lo.is_finite() && hi.is_finite()) {
            errors.push(Diagnostic::error("E0402", shader.span, format!("`{name}` cannot run from {lo} to {hi}")));
        } else if let Some(global) = global {
            domain.globals.push((global, Interval::new(*lo as f64, *hi as f64)));
        } else if !shader.params().iter().any(|p| p.name == *name) {
            errors.push(shader.unknown_parameter(name));
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let choices: Vec<Choice> =
        shader.params().iter().enumerate().map(|(index, p)| choice(index, p, options, &mut domain)).collect();
    domain.combine(shader, choices);
    Ok(domain)
}

impl Domain {
    fn combine(&mut self, shader: &CheckedShader, choices: Vec<Choice>) {
        let mut cases = vec![Case { bindings: HashMap::new(), fixed: Vec::new() }];
        for (index, (param, choice)) in shader.params().iter().zip(choices).enumerate() {
            let values = match choice {
                Choice::One(binding) => {
                    for case in &mut cases {
                        if let Binding::Fixed(cells) = &binding {
                            let value = Value::from_cells(param.ty, *cells, &self.strings);
                            case.fixed.push((param.name.clone(), value));
                        }
                        case.bindings.insert(param.var, binding.clone());
                    }
                    continue;
                }
                Choice::Values(values) => values,
            };
            if cases.len() * values.len() > MAX_CASES {
                self.notes.push(format!("`{}` has too many combinations with others: not gone through", param.name));
                let binding = match span_of_ints(&values) {
                    Some(range) => Binding::Free(index, vec![range; 3]),
                    None => Binding::Default,
                };
                cases.iter_mut().for_each(|c| drop(c.bindings.insert(param.var, binding.clone())));
                continue;
            }
            let mut more = Vec::new();
            for case in &cases {
                for value in &values {
                    let Some(cells) = value.to_cells(param.ty, &mut self.strings) else { continue };
                    let mut case = case.clone();
                    case.bindings.insert(param.var, Binding::Fixed(cells));
                    case.fixed.push((param.name.clone(), value.clone()));
                    more.push(case);
                }
            }
            cases = more;
        }
        self.cases = cases;
    }
}

fn span_of_ints(values: &[Value]) -> Option<Interval> {
    let numbers: Vec<f64> = values.iter().flat_map(|v| v.numbers()).map(f64::from).collect();
    let (lo, hi) = (numbers.iter().copied().reduce(f64::min)?, numbers.iter().copied().reduce(f64::max)?);
    Some(Interval::new(lo, hi))
}

fn choice(index: usize, param: &ParamDecl, options: &Options, domain: &mut Domain) -> Choice {
    if let Some((_, value)) = options.set.iter().rev().find(|(name, _)| *name == param.name) {
        let cells: Option<Cells> = value.to_cells(param.ty, &mut domain.strings);
        return Choice::One(cells.map_or(Binding::Default, Binding::Fixed));
    }
    match param.ty {
        Ty::Float | Ty::Color => match ranges(param, options, &mut domain.notes) {
            Some(ranges) => Choice::One(Binding::Free(index, ranges)),
            None => Choice::One(Binding::Default),
        },
        Ty::Int => ints(index, param, options),
        Ty::String => match param.meta("options") {
            Some(Value::String(text)) => {
                let mut words: Vec<String> = text.split('|').map(|w| w.trim().to_owned()).collect();
                if let Some(Value::String(default)) = &param.default
                    && !words.contains(default)
                {
                    words.push(default.clone());
                }
                words.retain(|w| !w.is_empty());
                Choice::Values(words.into_iter().map(Value::String).collect())
            }
            _ => Choice::One(Binding::Default),
        },
        _ => Choice::One(Binding::Default),
    }
}

fn given(param: &ParamDecl, options: &Options) -> Option<(f64, f64)> {
    options.ranges.iter().rev().find(|r| r.0 == param.name).map(|r| (r.1 as f64, r.2 as f64))
}

/// One end of the declared range of a channel.
fn declared(param: &ParamDecl, names: [&str; 2], channel: usize) -> Option<f64> {
    let numbers = names.iter().find_map(|n| param.meta(n))?.numbers();
    numbers.get(channel).or(numbers.first()).map(|x| *x as f64).filter(|x| !x.is_nan())
}

/// The range of each channel; `None` where there is none and the default is computed.
fn ranges(param: &ParamDecl, options: &Options, notes: &mut Vec<String>) -> Option<Vec<Interval>> {
    let default = param.default.as_ref().map(Value::numbers);
    let mut all = Vec::new();
    let mut assumed = false;
    for channel in 0..param.ty.cells() {
        let own = default.as_ref().and_then(|d| d.get(channel)).map(|x| *x as f64);
        let range = match given(param, options) {
            Some((lo, hi)) => Interval::new(lo, hi),
            None => {
                let (lo, hi) = (declared(param, ["min", "UImin"], channel), declared(param, ["max", "UImax"], channel));
                if lo.is_none() && hi.is_none() && own.is_none() {
                    return None;
                }
                assumed |= lo.is_none() || hi.is_none();
                let (lo, hi) =
                    (lo.unwrap_or(0.0f64.min(hi.unwrap_or(0.0))), hi.unwrap_or(1.0f64.max(lo.unwrap_or(1.0))));
                let declared = Interval::new(lo.min(hi), hi.max(lo));
                own.filter(|x| x.is_finite()).map_or(declared, |x| declared.hull(Interval::point(x)))
            }
        };
        all.push(range);
    }
    if assumed {
        let ends = all.iter().copied().reduce(Interval::hull).unwrap_or(Interval::new(0.0, 1.0));
        notes.push(format!(
            "`{}` declares no range: taken as {} to {}; say so with `[[ float min = …, float max = … ]]`",
            param.name, ends.lo as f32, ends.hi as f32
        ));
    }
    Some(all)
}

fn ints(index: usize, param: &ParamDecl, options: &Options) -> Choice {
    let ends = given(param, options)
        .or_else(|| Some((declared(param, ["min", "UImin"], 0)?, declared(param, ["max", "UImax"], 0)?)));
    let Some((lo, hi)) = ends.filter(|(lo, hi)| lo <= hi) else { return Choice::One(Binding::Default) };
    let default = param.default.as_ref().and_then(|d| d.numbers().first().copied()).map(f64::from);
    if hi - lo < MAX_VALUES as f64 {
        let mut values: Vec<i32> = (lo as i32..=hi as i32).collect();
        values.extend(default.map(|d| d as i32).filter(|d| !values.contains(d)));
        return Choice::Values(values.into_iter().map(Value::Int).collect());
    }
    let range = Interval::new(lo, hi);
    let range = default.map_or(range, |d| range.hull(Interval::point(d)));
    Choice::One(Binding::Free(index, vec![range; 3]))
}
