//! Assignments and steps.

use super::super::body::{ExprId, ExprKind, Op, VarId};
use super::super::types::Ty;
use super::expr::{Global, global};
use super::place::{At, Place};
use super::{Access, Checker, Typed};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::{self, BinaryOp};

/// What an assignment writes.
#[derive(Clone, Copy)]
pub(super) struct Target {
    pub place: Place,
    pub ty: Ty,
    /// A component of it.
    pub component: Option<At>,
}

impl Checker<'_> {
    /// Makes what a target names stay what it is while the value is worked out.
    pub(super) fn pin_target(&mut self, id: ast::ExprId, value: Option<u32>) {
        if self.depth == 0 {
            // Defaults assign nothing; the assignment says so.
            return;
        }
        let Some(target) = self.target(id) else { return };
        let wanted = if target.component.is_some() { Ty::Float } else { target.ty };
        if let Some(value) = value {
            self.hints.insert(value, wanted);
        }
        let moving = |at: At| matches!(at, At::Expr(_));
        let target = if moving(target.place.at) || target.component.is_some_and(moving) {
            self.spill_with(&target)
        } else {
            target
        };
        self.targets.insert(id.0, target);
    }

    fn spill_with(&mut self, target: &Target) -> Target {
        let keep = |checker: &mut Self, at: At| match at {
            At::Expr(index) => {
                let var = checker.temporary(Ty::Int);
                checker.keep(var, index);
                At::Var(var)
            }
            other => other,
        };
        let place = Place { at: keep(self, target.place.at), ..target.place };
        let component = target.component.map(|at| keep(self, at));
        self.spill();
        self.resume();
        Target { place, component, ..*target }
    }

    /// What an expression names that can be written.
    pub(super) fn target(&mut self, id: ast::ExprId) -> Option<Target> {
        if !self.writable(id) {
            return None;
        }
        let typed = self.of(id);
        if typed.ty == Ty::Poison {
            return None;
        }
        let component = match self.ast.expr(id).kind {
            ast::ExprKind::Index(base, index) if self.of(base).ty.is_triple() => {
                let at = match self.ast.expr(index).kind {
                    ast::ExprKind::Int(i) => At::Known(i.clamp(0, 2) as u32),
                    _ => At::Expr(self.of(index).id),
                };
                Some((base, at))
            }
            ast::ExprKind::Field(base, name, _) if self.of(base).ty.is_triple() => {
                let index = component_of(self.of(base).ty, self.ast.name(name))?;
                Some((base, At::Known(index)))
            }
            _ => None,
        };
        match component {
            Some((base, at)) => {
                let base = self.of(base);
                Some(Target { place: base.place?, ty: base.ty, component: Some(at) })
            }
            None => Some(Target { place: typed.place?, ty: typed.ty, component: None }),
        }
    }

    /// Whether an expression names something that may be written; says so if not.
    fn writable(&mut self, id: ast::ExprId) -> bool {
        let mut at = id;
        while let ast::ExprKind::Index(base, _) | ast::ExprKind::Field(base, ..) = self.ast.expr(at).kind {
            at = base;
        }
        let ast::Expr { kind, span } = *self.ast.expr(at);
        let ast::ExprKind::Name(sym) = kind else {
            if self.of(id).ty != Ty::Poison {
                let d = Diagnostic::error("E0207", self.span_of(id), "this cannot be assigned to");
                self.diagnostics.push(d.help("assign to a variable or to one of its components"));
            }
            return false;
        };
        let text = self.ast.name(sym);
        if let Some(binding) = self.names.get(&sym).map(|b| &self.bindings[*b]) {
            if binding.access == Access::ReadOnly {
                let d = Diagnostic::error("E0207", span, format!("the parameter `{text}` cannot be assigned to"));
                let d = d.label(binding.span, "declared here");
                self.diagnostics.push(d.help("copy it to a local variable, or declare it `output`"));
                return false;
            }
            return true;
        }
        match global(text) {
            Some(Global::Ci) => {
                self.assigned_ci = true;
                true
            }
            Some(_) => {
                let d = Diagnostic::error("E0207", span, format!("`{text}` cannot be assigned to"));
                self.diagnostics.push(d.help("a surface shader writes `Ci`; copy the rest to local variables"));
                false
            }
            None => false,
        }
    }

    /// `target = value`; `last` if nothing uses the result.
    pub(super) fn assignment(
        &mut self,
        op: Option<BinaryOp>,
        target: ast::ExprId,
        value: ast::ExprId,
        span: Span,
        last: bool,
    ) -> Typed {
        let Some(to) = self.targets.remove(&target.0) else { return self.poison() };
        let mut given = self.of(value);
        if let Some(op) = op {
            let old = self.current(&to, self.span_of(target));
            given = self.binary(op, old, given, span, (target, value));
        }
        self.write(&to, given, self.span_of(value), value);
        if last { Typed { ty: Ty::Void, ..self.poison() } } else { self.current(&to, span) }
    }

    /// `++x`, `x--`
    pub(super) fn step(&mut self, step: ast::Step, target: ast::ExprId, span: Span, last: bool) -> Typed {
        let Some(to) = self.targets.remove(&target.0) else { return self.poison() };
        let old = self.current(&to, span);
        if !old.ty.is_scalar() {
            let message = format!("{} cannot be counted up or down", self.words(old.ty));
            return self.error(Diagnostic::error("E0204", span, message));
        }
        let before = (step.after && !last).then(|| {
            self.spill();
            self.run_start = self.body.exprs.len() as u32;
            let old = self.current(&to, span);
            let var = self.temporary(old.ty);
            self.assign(var, old.id);
            self.resume();
            (var, old.ty)
        });
        let old = self.current(&to, span);
        let one = self.int(1, span);
        let op = if step.down { BinaryOp::Sub } else { BinaryOp::Add };
        let new = self.binary(op, old, one, span, (target, target));
        self.write(&to, new, span, target);
        match before {
            Some((var, ty)) => self.push(ExprKind::Var(var), ty, span),
            None if last => Typed { ty: Ty::Void, ..self.poison() },
            None => self.current(&to, span),
        }
    }

    /// What a target holds now.
    pub(super) fn current(&mut self, target: &Target, span: Span) -> Typed {
        let whole = self.load(target.place, target.ty, span);
        match target.component {
            None => whole,
            Some(at) => {
                let index = self.index_value(at, span);
                self.op(Op::Component, &[whole.id, index], Ty::Float, span)
            }
        }
    }

    /// Writes a value of the run at hand and starts a new one.
    pub(super) fn write(&mut self, to: &Target, value: Typed, span: Span, from: ast::ExprId) {
        if value.ty == Ty::Poison {
            return;
        }
        if to.ty.is_aggregate() {
            self.give(to.place, to.ty, value, span, from);
            return self.resume();
        }
        let ty = if to.component.is_some() { Ty::Float } else { to.ty };
        let mut new = self.initial(value, ty, span, ast::Root { first: from.0, root: from });
        if self.body.expr(new).ty == Ty::Poison {
            return;
        }
        if let Some(at) = to.component {
            let whole = self.load(to.place, to.ty, span);
            let index = self.index_value(at, span);
            new = self.op(Op::Insert, &[whole.id, index, new], to.ty, span).id;
        }
        if self.pending.len() > 1 || self.pending.first().is_some_and(|id| *id != from) {
            // Others wait too; the new value is kept with them.
            let var = self.temporary(to.ty);
            self.keep(var, new);
            self.spill();
            new = self.push(ExprKind::Var(var), to.ty, span).id;
        }
        self.store_at(to.place, to.ty, new, span);
        self.resume();
    }

    /// Gives a place a value: simple ones are converted, others copied part by part. Ends the run.
    pub(super) fn give(&mut self, place: Place, ty: Ty, value: Typed, span: Span, from: ast::ExprId) {
        if value.ty == Ty::Poison || ty == Ty::Poison {
            return;
        }
        if !ty.is_aggregate() {
            let new = self.initial(value, ty, span, ast::Root { first: from.0, root: from });
            if self.body.expr(new).ty != Ty::Poison {
                self.store_at(place, ty, new, span);
            }
            return;
        }
        if let (true, Some(source)) = (self.same_shape(value.ty, ty), value.place) {
            let source = self.pinned(source);
            self.spill();
            // Parts may be read after others are written, as in `a = swapped(a)`.
            return self.copy(place, source, value.ty, span);
        }
        if ty == Ty::Matrix && value.ty.is_scalar() {
            let float = self.convert(value, Ty::Float, span);
            let var = self.temporary(Ty::Float);
            self.keep(var, float);
            self.spill();
            return self.diagonal(place, var, span);
        }
        let message = format!("expected {}, found {}", self.words(ty), self.words(value.ty));
        let d = Diagnostic::error("E0203", span, message).note(format!("this is {}", self.words(value.ty)));
        self.error(d);
    }

    /// Whether values of one type can be copied to another: the same, or arrays of which the target is as long.
    pub(super) fn same_shape(&self, from: Ty, to: Ty) -> bool {
        match (from, to) {
            (a, b) if a == b => true,
            (Ty::Array(a), Ty::Array(b)) => {
                let (a, b) = (self.arrays[usize::from(a)], self.arrays[usize::from(b)]);
                a.0 == b.0 && a.1 <= b.1
            }
            _ => false,
        }
    }

    /// An int constant.
    pub(super) fn int(&mut self, value: i32, span: Span) -> Typed {
        self.push(ExprKind::Const([value as u32, 0, 0]), Ty::Int, span)
    }

    /// A value of the run at hand, in a variable; the run ends.
    pub(super) fn kept(&mut self, value: ExprId, ty: Ty) -> VarId {
        let var = self.temporary(ty);
        self.assign(var, value);
        var
    }
}

/// The number of a named component.
pub(super) fn component_of(ty: Ty, name: &str) -> Option<u32> {
    let names: &[&str] = if ty == Ty::Color { &["r", "g", "b"] } else { &["x", "y", "z"] };
    names.iter().position(|n| *n == name).map(|i| i as u32)
}
