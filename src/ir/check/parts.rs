//! Making values from parts, and taking parts of values: constructors, indices, fields.

use super::super::body::{ExprKind, Op};
use super::super::types::Ty;
use super::assign::component_of;
use super::call::Given;
use super::place::{At, Place};
use super::{Checker, Typed, suggest};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::{self, Sym, TypeName};

impl Checker<'_> {
    pub(super) fn construct(&mut self, name: TypeName, args: ast::Args, span: Span) -> Typed {
        let ty = Ty::simple(name).unwrap_or(Ty::Poison);
        let ids = self.ast.args(args).to_vec();
        let typed: Vec<Typed> = ids.iter().map(|id| self.of(*id)).collect();
        if typed.iter().any(|t| t.ty == Ty::Poison) {
            return self.poison();
        }
        let given = Given { ids, typed };
        if ty == Ty::Matrix { self.construct_matrix(&given, span) } else { self.construct_simple(ty, &given, span) }
    }

    /// `color(r, g, b)`, `color("hsv", h, s, v)`, `point("space", x, y, z)`, `float(x)`.
    pub(super) fn construct_simple(&mut self, ty: Ty, given: &Given, span: Span) -> Typed {
        let named = ty.is_triple() && given.typed.first().is_some_and(|t| t.ty == Ty::String);
        let numbers = &given.typed[usize::from(named)..];
        match *numbers {
            [one] if !named => return self.cast(ty, one, span),
            [x, y, z] if ty.is_triple() => {
                let parts = [x, y, z];
                if let Some(i) = parts.iter().position(|part| part.ty.distance(Ty::Float).is_none()) {
                    let message = format!("a component of {} is a float, not {}", ty.name(), self.words(parts[i].ty));
                    let at = self.span_of(given.ids[i + usize::from(named)]);
                    return self.error(Diagnostic::error("E0203", at, message));
                }
                if named && ty != Ty::Color {
                    return self.in_space(given, ty, span);
                }
                let floats = parts.map(|part| self.convert(part, Ty::Float, span));
                let triple = self.op(Op::Triple, &floats, ty, span);
                if !named {
                    return triple;
                }
                let given = Given { ids: vec![given.ids[0], given.ids[1]], typed: vec![given.typed[0], triple] };
                return self.builtin("transformc", &given, span, None).map_or(self.poison(), |(_, made)| made);
            }
            _ => {}
        }
        let d = Diagnostic::error("E0205", span, format!("{} cannot be made from {} values", ty.name(), numbers.len()));
        self.error(if ty.is_triple() { d.help("give one value or three") } else { d.help("give one value") })
    }

    pub(super) fn index(&mut self, a: Typed, i: Typed, at: ast::ExprId, span: Span) -> Typed {
        if a.ty == Ty::Poison || i.ty == Ty::Poison {
            return self.poison();
        }
        if let (Some((element, count)), Some(place)) = (self.elements(a.ty), a.place) {
            return self.array_index(element, count, place, (i, at), span);
        }
        if !self.check_index(a.ty, i.ty, at, span) {
            return self.poison();
        }
        Typed { place: None, ..self.op(Op::Component, &[a.id, i.id], Ty::Float, span) }
    }

    fn array_index(&mut self, element: Ty, count: u32, place: Place, index: (Typed, ast::ExprId), span: Span) -> Typed {
        let (i, at) = index;
        let known = match self.body.expr(i.id).kind {
            ExprKind::Const(cells) if i.ty == Ty::Int => Some(cells[0] as i32),
            _ => None,
        };
        let at_span = self.span_of(at);
        if i.ty != Ty::Int {
            let d = Diagnostic::error("E0208", at_span, format!("an index is an int, not {}", self.words(i.ty)));
            return self.error(d);
        }
        let index = match known {
            Some(k) if !(0..count as i32).contains(&k) => {
                let d = Diagnostic::error("E0208", at_span, "there is no such element");
                return self.error(d.help(format!("there are {count}, counted from 0")));
            }
            Some(k) => At::Known(k as u32),
            None => At::Expr(i.id),
        };
        let place = self.element_of(place, count, index, span);
        self.load(place, element, span)
    }

    /// `.x` of a triple, or a field of a struct.
    pub(super) fn field_value(&mut self, a: Typed, name: Sym, at: Span, span: Span) -> Typed {
        if let (Ty::Struct(number), Some(place)) = (a.ty, a.place) {
            let fields = &self.layouts[usize::from(number)].fields;
            if let Some(index) = fields.iter().position(|(field, _)| *field == name) {
                let (place, ty) = self.field_of(number, place, index);
                return self.load(place, ty, span);
            }
            let names: Vec<&str> = fields.iter().map(|(field, _)| self.ast.name(*field)).collect();
            let text = self.ast.name(name);
            let d = Diagnostic::error("E0208", at, format!("`{}` has no field `{text}`", self.words(a.ty)));
            let help = match suggest(text, names.iter().copied()) {
                Some(like) => format!("did you mean `{like}`?"),
                None => format!("its fields are `{}`", names.join("`, `")),
            };
            return self.error(d.help(help));
        }
        match self.field(a.ty, name, at) {
            Some(i) if a.ty.is_triple() => {
                let i = self.int(i, at);
                self.op(Op::Component, &[a.id, i.id], Ty::Float, span)
            }
            _ => self.poison(),
        }
    }

    fn check_index(&mut self, ty: Ty, index: Ty, at: ast::ExprId, span: Span) -> bool {
        let at_span = self.span_of(at);
        let d = if !ty.is_triple() {
            Diagnostic::error("E0208", span, format!("{} has no components", self.words(ty)))
        } else if index != Ty::Int {
            Diagnostic::error("E0208", at_span, format!("an index is an int, not {}", self.words(index)))
        } else if matches!(self.ast.expr(at).kind, ast::ExprKind::Int(i) if !(0..3).contains(&i)) {
            Diagnostic::error("E0208", at_span, "there is no such component").help("the components are 0, 1 and 2")
        } else {
            return true;
        };
        self.diagnostics.push(d);
        false
    }

    /// The index of a named component.
    fn field(&mut self, ty: Ty, name: Sym, at: Span) -> Option<i32> {
        let text = self.ast.name(name);
        let names: &[&str] = if ty == Ty::Color { &["r", "g", "b"] } else { &["x", "y", "z"] };
        let found = component_of(ty, text);
        match ty {
            Ty::Poison => None,
            ty if ty.is_triple() => {
                if found.is_none() {
                    let message = format!("{} has no component `{text}`", ty.name());
                    let d = Diagnostic::error("E0208", at, message);
                    self.diagnostics.push(d.help(format!("its components are `.{}`", names.join("`, `."))));
                }
                found.map(|i| i as i32)
            }
            ty => {
                self.diagnostics.push(Diagnostic::error("E0208", at, format!("{} has no components", ty.name())));
                None
            }
        }
    }
}
