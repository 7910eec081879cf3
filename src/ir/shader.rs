//! A checked shader and its parameters, and how to fix them.

use super::body::{Body, Cells, ExprKind, VarId};
use super::check::suggest;
use super::host::{Answers, Host};
use super::lower;
use super::passes::{self, fold, layers, needs};
use super::program::Program;
use super::types::Ty;
use crate::diag::Diagnostic;
use crate::span::{Source, Span};
use std::collections::BTreeSet;
use std::sync::Arc;

/// A value that a parameter is set to.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// An int.
    Int(i32),
    /// A float.
    Float(f32),
    /// Linear RGB. Sets a vector, normal or point too, as three numbers do.
    Color([f32; 3]),
    /// A vector.
    Vector([f32; 3]),
    /// A normal.
    Normal([f32; 3]),
    /// A point.
    Point([f32; 3]),
    /// Text.
    String(String),
}

impl Value {
    /// The type a script would give it.
    pub fn ty(&self) -> Ty {
        match self {
            Value::Int(_) => Ty::Int,
            Value::Float(_) => Ty::Float,
            Value::Color(_) => Ty::Color,
            Value::Vector(_) => Ty::Vector,
            Value::Normal(_) => Ty::Normal,
            Value::Point(_) => Ty::Point,
            Value::String(_) => Ty::String,
        }
    }

    /// Its numbers: one for a scalar, three for a triple, none for a string.
    pub fn numbers(&self) -> Vec<f32> {
        match self {
            Value::Int(i) => vec![*i as f32],
            Value::Float(x) => vec![*x],
            Value::Color(v) | Value::Vector(v) | Value::Normal(v) | Value::Point(v) => v.to_vec(),
            Value::String(_) => Vec::new(),
        }
    }

    pub(crate) fn from_cells(ty: Ty, cells: Cells, strings: &[String]) -> Value {
        let triple = cells.map(f32::from_bits);
        match ty {
            Ty::Int => Value::Int(cells[0] as i32),
            Ty::Float => Value::Float(triple[0]),
            Ty::Vector => Value::Vector(triple),
            Ty::Normal => Value::Normal(triple),
            Ty::Point => Value::Point(triple),
            Ty::String => Value::String(strings.get(cells[0] as usize).cloned().unwrap_or_default()),
            // Parameters and metadata are of simple types.
            Ty::Color | Ty::Closure | Ty::Poison => Value::Color(triple),
            Ty::Matrix | Ty::Struct(_) | Ty::Array(_) | Ty::Void => Value::Color(triple),
        }
    }

    /// The bits of this value as a `ty`, if it can be one.
    pub(crate) fn to_cells(&self, ty: Ty, strings: &mut Vec<String>) -> Option<Cells> {
        match (self, ty) {
            (Value::Int(i), Ty::Int) => Some([*i as u32, 0, 0]),
            (Value::Float(x), Ty::Int) if x.fract() == 0.0 && x.abs() < 2e9 => Some([*x as i32 as u32, 0, 0]),
            (Value::Int(i), Ty::Float) => Some([(*i as f32).to_bits(), 0, 0]),
            (Value::Float(x), Ty::Float) => Some([x.to_bits(), 0, 0]),
            (Value::Int(i), ty) if ty.is_triple() => Some([(*i as f32).to_bits(); 3]),
            (Value::Float(x), ty) if ty.is_triple() => Some([x.to_bits(); 3]),
            (Value::Color(v) | Value::Vector(v) | Value::Normal(v) | Value::Point(v), ty) if ty.is_triple() => {
                Some(v.map(f32::to_bits))
            }
            (Value::String(text), Ty::String) => {
                let found = strings.iter().position(|s| s == text);
                let id = found.unwrap_or_else(|| {
                    strings.push(text.clone());
                    strings.len() - 1
                });
                Some([id as u32, 0, 0])
            }
            _ => None,
        }
    }
}

/// A declared parameter of a shader.
#[derive(Clone, Debug)]
pub struct ParamDecl {
    /// Its name.
    pub name: String,
    /// Its type.
    pub ty: Ty,
    /// Its default value with all parameters at their defaults; `None` where that depends on the shading point, and
    /// for closures.
    pub default: Option<Value>,
    /// Declared `output`.
    pub output: bool,
    /// What its `[[ ]]` holds, in order.
    pub metadata: Vec<(String, Value)>,
    /// Where its name stands.
    pub span: Span,
    pub(crate) var: VarId,
}

impl ParamDecl {
    /// The metadata called `name`.
    pub fn meta(&self, name: &str) -> Option<&Value> {
        self.metadata.iter().find(|(n, _)| n == name).map(|(_, value)| value)
    }
}

/// A shader without mistakes.
#[derive(Clone, Debug)]
pub struct CheckedShader {
    pub(super) name: String,
    pub(crate) span: Span,
    pub(super) params: Vec<ParamDecl>,
    pub(super) metadata: Vec<(String, Value)>,
    pub(crate) body: Body,
    /// How many variables the body had before derivatives were taken, if any were.
    pub(super) shadows: Option<u32>,
    pub(super) sources: Vec<Arc<Source>>,
    pub(crate) host: Option<Arc<dyn Host>>,
    pub(super) iterations: u32,
}

impl CheckedShader {
    /// Its name; for bare statements the stem of the file's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its parameters in declared order.
    pub fn params(&self) -> &[ParamDecl] {
        &self.params
    }

    /// What the `[[ ]]` after its name holds.
    pub fn metadata(&self) -> &[(String, Value)] {
        &self.metadata
    }

    /// Fixes the parameters in `set` – the rest stay at their defaults – and compiles what is left. Of two values for
    /// one parameter the last counts. A value outside the `min` and `max` of the metadata is taken as it is, with a
    /// warning in [`Program::warnings`].
    ///
    /// # Errors
    /// Unknown parameters (`E0401`), values of the wrong type (`E0402`), and string options that turn out unknown.
    pub fn specialise(&self, set: &[(String, Value)]) -> Result<Program, Vec<Diagnostic>> {
        let mut body = self.body.clone();
        let mut known: Vec<Option<Cells>> = vec![None; body.vars.len()];
        let (mut errors, mut warnings) = (Vec::new(), Vec::new());
        for (name, value) in set {
            let Some(param) = self.params.iter().find(|p| p.name == *name) else {
                errors.push(self.unknown_parameter(name));
                continue;
            };
            match value.to_cells(param.ty, &mut body.strings) {
                Some(cells) => {
                    known[param.var.index()] = Some(cells);
                    // Whatever its default does, this does not change from pixel to pixel.
                    for shadow in self.shadows.into_iter().flat_map(|n| [n, 2 * n]) {
                        known[param.var.index() + shadow as usize] = Some([0; 3]);
                    }
                }
                None => {
                    let message = format!("`{name}` is {}, not {}", param.ty.name(), value.ty().name());
                    errors.push(Diagnostic::error("E0402", param.span, message).note("declared here"));
                }
            }
            warnings.extend(out_of_range(param, value));
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let answers = Answers::of(self.host.as_deref());
        let body = passes::tighten(fold::fold(&body, &known, answers));
        let needs = needs::needs(&body, answers);
        if !needs.errors.is_empty() {
            return Err(needs.errors);
        }
        let layers = layers::layers(&body);
        for top in layers.tops() {
            let expr = body.expr(top);
            if let ExprKind::Lobe(kind, _) = expr.kind
                && kind.transmits()
            {
                let message = format!("what `{}` transmits counts as spent in a top", kind.spec().name);
                let d = Diagnostic::warning("W0504", expr.span, message);
                warnings.push(d.help("the base gets nothing of it; a sum, or a weight on the top, lets it through"));
            }
        }
        let removed = self.removed(&body, &needs, set);
        let program = lower::lower(&body, &needs, &layers, warnings);
        Ok(Program { host: self.host.clone(), iterations: self.iterations, removed, ..program })
    }

    /// The program with every parameter left open: read from memory at every point instead of folded away. What
    /// specialising saves is the difference to it.
    pub fn unspecialised(&self) -> Program {
        let open: Vec<VarId> = self.params.iter().map(|p| p.var).collect();
        let answers = Answers::of(self.host.as_deref());
        let body = passes::tighten(fold::fold_open(&self.body, &open, answers));
        let program = lower::lower(&body, &needs::needs(&body, answers), &layers::layers(&body), Vec::new());
        Program { host: self.host.clone(), iterations: self.iterations, kept: None, ..program }
    }

    /// Included files; the first is file 1 of spans.
    pub fn sources(&self) -> &[Arc<Source>] {
        &self.sources
    }

    /// What is gone from a specialised body: lobes that were written but are not made, and parameters nothing reads.
    fn removed(&self, body: &Body, needs: &needs::Needs, set: &[(String, Value)]) -> Vec<String> {
        let lobes = |body: &Body, live: &dyn Fn(usize) -> bool| {
            let mut found: BTreeSet<(Span, &'static str)> = BTreeSet::new();
            for (_, expr) in body.exprs.iter().enumerate().filter(|(i, _)| live(*i)) {
                if let ExprKind::Lobe(kind, _) = expr.kind {
                    found.insert((expr.span, kind.spec().name));
                }
            }
            found
        };
        let (written, made) = (lobes(&self.body, &|_| true), lobes(body, &|i| needs.used[i]));
        let gone = written.difference(&made);
        let mut found: Vec<String> = gone
            .map(|(_, name)| format!("`{name}` is never made: its weight is zero or its branch is not taken"))
            .collect();
        found.dedup();
        let fixed = set.iter().map(|(name, _)| format!("`{name}`")).collect::<BTreeSet<_>>();
        if !fixed.is_empty() {
            let names = fixed.into_iter().collect::<Vec<_>>().join(", ");
            found.push(format!("folded into the program as they are set: {names}"));
        }
        let live = needs.used.iter().filter(|used| **used).count();
        if live < self.body.exprs.len() {
            let of = self.body.exprs.len();
            found.push(format!("{live} of {of} expressions are left: what is constant is worked out before shading"));
        }
        found
    }

    pub(crate) fn unknown_parameter(&self, name: &str) -> Diagnostic {
        let d = Diagnostic::error("E0401", self.span, format!("`{}` has no parameter `{name}`", self.name));
        let names = || self.params.iter().map(|p| p.name.as_str());
        match suggest(name, names()) {
            Some(like) => d.help(format!("did you mean `{like}`?")),
            None if self.params.is_empty() => d.help("it has no parameters"),
            None => d.help(format!("its parameters are {}", names().collect::<Vec<_>>().join(", "))),
        }
    }
}

fn out_of_range(param: &ParamDecl, value: &Value) -> Option<Diagnostic> {
    let limit = |name: &str, k: usize| {
        let numbers = param.meta(name)?.numbers();
        numbers.get(k).or(numbers.first()).copied()
    };
    for (k, x) in value.numbers().into_iter().enumerate() {
        let (min, max) = (limit("min", k), limit("max", k));
        let inside = min.is_none_or(|min| x >= min) && max.is_none_or(|max| x <= max);
        if !inside {
            let side = |x: Option<f32>| x.map_or("any".to_owned(), |x| x.to_string());
            let name = &param.name;
            let message = format!("`{name}` is set to {x}, outside its range {} to {}", side(min), side(max));
            return Some(Diagnostic::warning("W0503", param.span, message).note("declared here"));
        }
    }
    None
}
