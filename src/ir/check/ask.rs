//! Calls with results besides their value, or with options: what is asked of the host, splines, `fresnel`.

use super::super::body::{Op, VarId};
use super::super::tasks::Task;
use super::super::types::Ty;
use super::call::Given;
use super::task::at;
use super::{Checker, Typed};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast;

impl Checker<'_> {
    /// `getattribute("name", variable)`, `getattribute("object", "name", variable)`, and either with an index before the
    /// variable. Arrays and matrices are asked for element by element.
    pub(super) fn attribute(&mut self, given: &Given, types: &[Ty], span: Span) -> Option<Typed> {
        let (object, name, index, target) = match types {
            [Ty::String, _] => (None, 0, None, 1),
            [Ty::String, Ty::String, _] => (Some(0), 1, None, 2),
            [Ty::String, Ty::Int, _] => (None, 0, Some(1), 2),
            [Ty::String, Ty::String, Ty::Int, _] => (Some(0), 1, Some(2), 3),
            _ => return None,
        };
        let ty = types[target];
        let element = match ty {
            Ty::Matrix => Ty::Float,
            Ty::Array(number) => self.arrays[usize::from(number)].0,
            ty => ty,
        };
        if element.is_aggregate() || matches!(element, Ty::Closure | Ty::Void) || ty != element && index.is_some() {
            let message = format!("`getattribute()` into {} is not supported", self.words(ty));
            return Some(self.error(Diagnostic::error("E0109", span, message)));
        }
        self.aside(given);
        let object = match object {
            Some(index) => self.value_of(given, index, Ty::String),
            None => self.text("", span),
        };
        let name = self.value_of(given, name, Ty::String);
        let index = index.map(|index| self.value_of(given, index, Ty::Int));
        let mut old = Vec::new();
        self.variables(given, target, ty, span, &mut old);
        let (found, value) = (self.temporary(Ty::Int), self.allocate(ty));
        let outs = std::iter::once(found).chain((0..old.len() as u32).map(|i| VarId(value.base.0 + i))).collect();
        // One value without an index is asked for as such; of several each by its place.
        let index = match index {
            Some(index) => index,
            None if ty == element => self.number(-1.0, Ty::Int, span),
            None => self.number(0.0, Ty::Int, span),
        };
        self.deed(Task::Attribute, [vec![object, name, index], old].concat(), outs, span);
        self.write_result(given.ids[target], value, ty, span);
        Some(self.back(found, Ty::Int, span))
    }

    /// `gettextureinfo("file", "what", variable)`.
    pub(super) fn texture_info(&mut self, given: &Given, types: &[Ty], span: Span) -> Option<Typed> {
        let ty = types[2];
        let element = match ty {
            Ty::Array(number) => self.arrays[usize::from(number)].0,
            ty => ty,
        };
        if element.is_aggregate() || matches!(element, Ty::Closure | Ty::Void) {
            return None;
        }
        self.aside(given);
        let (file, what) = (self.value_of(given, 0, Ty::String), self.value_of(given, 1, Ty::String));
        let mut old = Vec::new();
        self.variables(given, 2, ty, span, &mut old);
        let (found, value) = (self.temporary(Ty::Int), self.allocate(ty));
        let outs = std::iter::once(found).chain((0..old.len() as u32).map(|i| VarId(value.base.0 + i))).collect();
        self.deed(Task::TextureInfo, [vec![file, what], old].concat(), outs, span);
        self.write_result(given.ids[2], value, ty, span);
        Some(self.back(found, Ty::Int, span))
    }

    /// `fresnel(I, N, eta, Kr, Kt)`, and with R and T after them.
    pub(super) fn fresnel(&mut self, given: &Given, types: &[Ty], span: Span) -> Typed {
        self.aside(given);
        let args = vec![
            self.value_of(given, 0, Ty::Vector),
            self.value_of(given, 1, Ty::Vector),
            self.value_of(given, 2, Ty::Float),
        ];
        let outs = [Ty::Float, Ty::Float, Ty::Vector, Ty::Vector].map(|ty| (self.temporary(ty), ty));
        self.deed(Task::Fresnel, args, outs.iter().map(|(var, _)| *var).collect(), span);
        for (k, (var, ty)) in outs.into_iter().enumerate().take(types.len() - 3) {
            self.write_result(given.ids[k + 3], at(var), ty, span);
        }
        self.resume();
        Typed { ty: Ty::Void, ..self.poison() }
    }

    /// `spline("basis", x, a, b, c, d, …)` and `spline("basis", x, array)`; `splineinverse` alike.
    pub(super) fn spline(&mut self, name: &str, given: &Given, types: &[Ty], span: Span) -> Option<Typed> {
        if !types[1].is_scalar() {
            return None;
        }
        let result = match types[2..] {
            [Ty::Array(number)] => self.arrays[usize::from(number)].0,
            // `spline("basis", x, count, array)`
            [Ty::Int, Ty::Array(number)] => self.arrays[usize::from(number)].0,
            [..] if types.len() >= 6 && types[2..].iter().all(|ty| ty.is_scalar()) => Ty::Float,
            [first, _, .., last] if types.len() >= 6 && first == last => first,
            _ => return None,
        };
        if !(result == Ty::Float || result.is_triple()) {
            return None;
        }
        self.aside(given);
        let mut args = vec![self.value_of(given, 0, Ty::String), self.value_of(given, 1, Ty::Float)];
        let first = if matches!(types[2..], [Ty::Int, Ty::Array(_)]) { 3 } else { 2 };
        for i in first..types.len() {
            self.variables(given, i, result, span, &mut args);
        }
        let inverse = name == "splineinverse";
        if inverse && result != Ty::Float {
            return None;
        }
        Some(self.result(if inverse { Task::SplineInverse } else { Task::Spline }, args, result, span))
    }

    /// `texture("file", s, t, …)`.
    pub(super) fn texture(&mut self, given: &Given, types: &[Ty], span: Span, wanted: Option<Ty>) -> Typed {
        if !types[1].is_scalar() || !types[2].is_scalar() {
            let message = "the coordinates of `texture` are floats";
            return self.error(Diagnostic::error("E0205", span, message));
        }
        self.aside(given);
        let name = self.value_of(given, 0, Ty::String);
        let (s, t) = (self.value_of(given, 1, Ty::Float), self.value_of(given, 2, Ty::Float));
        let periodic = self.text("default", span);
        let channel = self.number(0.0, Ty::Int, span);
        let smart = self.text("smartcubic", span);
        let plain = self.text("", span);
        let (black, clear) = (self.number(0.0, Ty::Color, span), self.number(0.0, Ty::Float, span));
        let no = self.number(0.0, Ty::Int, span);
        let mut args = vec![name, s, t, periodic, periodic, channel, smart, plain, black, clear, no];
        let mut alpha = None;
        // Four derivatives may stand before the options.
        let mut next = if types.get(3).is_some_and(|ty| ty.is_scalar()) { 7 } else { 3 };
        let derivatives: Vec<VarId> = match types.get(3..7) {
            Some(four) if next == 7 && four.iter().all(|ty| ty.is_scalar()) => {
                (3..7).map(|i| self.value_of(given, i, Ty::Float)).collect()
            }
            _ => Vec::new(),
        };
        while next < given.ids.len() {
            let key = self.ast.expr(given.ids[next]).kind;
            let (ast::ExprKind::String(key), Some(ty)) = (key, types.get(next + 1).copied()) else {
                let d = Diagnostic::error("E0302", self.span_of(given.ids[next]), "expected an option and its value");
                self.error(d);
                break;
            };
            let key = self.ast.name(key);
            let found = texture_option(key);
            if key == "alpha" {
                alpha = Some(given.ids[next + 1]);
            } else if found.is_none() && !IDLE_OPTIONS.contains(&key) {
                let message = format!("`texture` has no option `{key}`");
                self.error(Diagnostic::error("E0302", self.span_of(given.ids[next]), message));
            }
            if let Some((slots, wants)) = found {
                if ty.distance(wants).is_none() {
                    let message = format!("this option is {}, not {}", wants.name(), self.words(ty));
                    self.error(Diagnostic::error("E0203", self.span_of(given.ids[next + 1]), message));
                    break;
                }
                let var = self.value_of(given, next + 1, wants);
                slots.iter().for_each(|slot| args[*slot] = var);
                if slots == [8] {
                    args[10] = self.number(1.0, Ty::Int, span);
                }
            }
            next += 2;
        }
        let (color, opacity) = (self.temporary(Ty::Color), self.temporary(Ty::Float));
        // In a call they stand as dsdx, dtdx, dsdy, dtdy.
        args.extend(derivatives);
        self.deed(Task::Texture, args, vec![color, opacity], span);
        if let Some(target) = alpha {
            self.write_result(target, at(opacity), Ty::Float, span);
        }
        let value = self.back(color, Ty::Color, span);
        match wanted {
            Some(Ty::Float) => {
                let first = self.int(0, span);
                self.op(Op::Component, &[value.id, first.id], Ty::Float, span)
            }
            Some(ty) if ty.is_triple() => Typed { ty, ..value },
            _ => value,
        }
    }
}

/// The arguments of a task that an option of `texture` sets, and its type.
fn texture_option(name: &str) -> Option<(&'static [usize], Ty)> {
    Some(match name {
        "wrap" => (&[3, 4], Ty::String),
        "swrap" => (&[3], Ty::String),
        "twrap" => (&[4], Ty::String),
        "firstchannel" => (&[5], Ty::Int),
        "interp" => (&[6], Ty::String),
        "colorspace" => (&[7], Ty::String),
        "missingcolor" => (&[8], Ty::Color),
        "missingalpha" => (&[9], Ty::Float),
        _ => return None,
    })
}

/// Options of `texture` that change nothing here.
const IDLE_OPTIONS: [&str; 11] =
    ["blur", "sblur", "tblur", "width", "swidth", "twidth", "fill", "subimage", "time", "rwrap", "errormessage"];
