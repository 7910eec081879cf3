//! Checking of single expressions: names, operators, conversions, assignments.

use super::super::body::{Args, ExprId, ExprKind, GlobalVar, Op, VarId};
use super::super::builtins::{BUILTINS, CONSTANTS};
use super::super::types::Ty;
use super::{Access, Checker, Typed, suggest};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::{self, BinaryOp, Sym, TypeName, UnaryOp};

/// What a name that every shader knows stands for.
pub(super) enum Global {
    Read(GlobalVar),
    Ci,
    Number(f32),
}

pub(super) fn global(name: &str) -> Option<Global> {
    if name == "Ci" {
        return Some(Global::Ci);
    }
    let read = GlobalVar::ALL.iter().find(|g| g.name() == name).map(|g| Global::Read(*g));
    read.or_else(|| CONSTANTS.iter().find(|(n, _)| *n == name).map(|(_, x)| Global::Number(*x)))
}

/// Globals of OSL that are not there.
const ABSENT: &[&str] = &["Ps", "dtime", "dPdtime"];

impl Checker<'_> {
    /// Checks one expression whose operands have been checked.
    pub(super) fn expression(&mut self, id: ast::ExprId, statement_level: &[ast::ExprId]) -> Typed {
        let ast::Expr { kind, span } = *self.ast.expr(id);
        match kind {
            ast::ExprKind::Int(value) => self.push(ExprKind::Const([value as u32, 0, 0]), Ty::Int, span),
            ast::ExprKind::Float(value) => self.push(ExprKind::Const([value.to_bits(), 0, 0]), Ty::Float, span),
            ast::ExprKind::String(sym) => {
                let ast = self.ast;
                let string = self.string(ast.name(sym));
                self.push(ExprKind::Const([string, 0, 0]), Ty::String, span)
            }
            ast::ExprKind::Name(sym) => self.name(sym, span),
            ast::ExprKind::Unary(op, a) => self.unary(op, self.of(a), span),
            ast::ExprKind::Binary(op, a, b) => self.binary(op, self.of(a), self.of(b), span, (a, b)),
            ast::ExprKind::Ternary(c, a, b) => self.ternary(c, a, b, span),
            ast::ExprKind::Call(name, at, args) => self.call(name, at, args, span),
            ast::ExprKind::Construct(ty, args) => self.construct(ty, args, span),
            ast::ExprKind::Cast(ty, a) => self.cast(Ty::from(ty), self.of(a), span),
            ast::ExprKind::Index(a, i) => self.index(self.of(a), self.of(i), i, span),
            ast::ExprKind::Field(a, name, at) => match (self.of(a), self.field(self.of(a).ty, name, at)) {
                (a, Some(i)) if a.ty.is_triple() => {
                    let i = self.int(i, at);
                    self.op(Op::Component, &[a.id, i.id], Ty::Float, span)
                }
                _ => self.poison(),
            },
            // Chains are in the order they are carried out, so the one at hand is found by its place.
            ast::ExprKind::Assign(op, target, value)
                if statement_level.binary_search_by_key(&id.0, |e| e.0).is_ok() =>
            {
                self.assignment(op, target, value, span, statement_level.last() == Some(&id))
            }
            ast::ExprKind::Assign(..) => {
                let d = Diagnostic::error("E0109", span, "an assignment inside an expression is not supported");
                self.error(d.help("assign in a statement of its own; `==` compares"))
            }
        }
    }

    pub(super) fn of(&self, id: ast::ExprId) -> Typed {
        self.typed[id.0 as usize]
    }

    pub(super) fn span_of(&self, id: ast::ExprId) -> Span {
        self.ast.expr(id).span
    }

    pub(super) fn push(&mut self, kind: ExprKind, ty: Ty, span: Span) -> Typed {
        Typed { id: self.body.push(kind, ty, span), ty }
    }

    pub(super) fn op(&mut self, op: Op, operands: &[ExprId], ty: Ty, span: Span) -> Typed {
        let mut ids = [ExprId(0); 3];
        ids[..operands.len()].copy_from_slice(operands);
        self.push(ExprKind::Op(op, ids), ty, span)
    }

    fn int(&mut self, value: i32, span: Span) -> Typed {
        self.push(ExprKind::Const([value as u32, 0, 0]), Ty::Int, span)
    }

    fn name(&mut self, sym: Sym, span: Span) -> Typed {
        if let Some(var) = self.names.get(&sym) {
            return self.push(ExprKind::Var(*var), self.body.vars[var.index()], span);
        }
        let text = self.ast.name(sym);
        match global(text) {
            Some(Global::Read(g)) => self.push(ExprKind::Global(g), g.ty(), span),
            Some(Global::Ci) => self.push(ExprKind::Var(VarId::CI), Ty::Closure, span),
            Some(Global::Number(x)) => self.push(ExprKind::Const([x.to_bits(), 0, 0]), Ty::Float, span),
            None if ABSENT.contains(&text) => {
                self.error(Diagnostic::error("E0109", span, format!("the global `{text}` is not supported")))
            }
            None => {
                let d = Diagnostic::error("E0201", span, format!("unknown name `{text}`")).note("not declared here");
                let help = self.like(text);
                self.error(help.into_iter().fold(d, Diagnostic::help))
            }
        }
    }

    /// Advice for an unknown name.
    fn like(&self, text: &str) -> Option<String> {
        if self.is_function(text) {
            return Some(format!("`{text}` is a function: call it with `{text}(…)`"));
        }
        let locals = self.names.keys().map(|sym| self.ast.name(*sym));
        let globals = GlobalVar::ALL.iter().map(|g| g.name()).filter(|n| !n.contains('('));
        let numbers = CONSTANTS.iter().map(|(name, _)| *name);
        let mut candidates: Vec<&str> = locals.chain(globals).chain(numbers).chain(["Ci"]).collect();
        candidates.sort_unstable();
        suggest(text, candidates).map(|name| format!("did you mean `{name}`?"))
    }

    fn unary(&mut self, op: UnaryOp, a: Typed, span: Span) -> Typed {
        match (op, a.ty) {
            (_, Ty::Poison) => a,
            (UnaryOp::Neg, Ty::Int) => self.op(Op::NegI, &[a.id], Ty::Int, span),
            (UnaryOp::Neg, ty) if ty.is_numeric() => self.op(Op::NegF, &[a.id], ty, span),
            (UnaryOp::Plus, ty) if ty.is_numeric() => a,
            (UnaryOp::Not, ty) if ty.is_numeric() => {
                let truth = Typed { id: self.truth(a, span), ty: Ty::Int };
                self.op(Op::NotI, &[truth.id], Ty::Int, span)
            }
            (UnaryOp::BitNot, Ty::Int) => self.op(Op::BitNotI, &[a.id], Ty::Int, span),
            (UnaryOp::Neg, Ty::Closure) => {
                let d = Diagnostic::error("E0301", span, "a closure cannot be negated").note("this is a closure");
                self.error(d.help("closures are added and scaled by weights that are not negative"))
            }
            (_, ty) => {
                let message = format!("`{}` does not apply to {}", op.text(), ty.name());
                self.error(Diagnostic::error("E0204", span, message))
            }
        }
    }

    fn binary(&mut self, op: BinaryOp, a: Typed, b: Typed, span: Span, ids: (ast::ExprId, ast::ExprId)) -> Typed {
        if a.ty == Ty::Poison || b.ty == Ty::Poison {
            return self.poison();
        }
        if a.ty == Ty::Closure || b.ty == Ty::Closure {
            return self.closure_binary(op, a, b, span, ids);
        }
        let found = match op {
            BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div => self.arithmetic(op, a, b, span),
            BinaryOp::Rem | BinaryOp::BitAnd | BinaryOp::BitOr | BinaryOp::BitXor | BinaryOp::Shl | BinaryOp::Shr => {
                self.integer(op, a, b, span)
            }
            BinaryOp::Eq | BinaryOp::Ne => self.equality(op, a, b, span),
            BinaryOp::Lt | BinaryOp::Le | BinaryOp::Gt | BinaryOp::Ge => self.order(op, a, b, span),
            BinaryOp::And | BinaryOp::Or => {
                let (x, y) = (self.truth(a, self.span_of(ids.0)), self.truth(b, self.span_of(ids.1)));
                let op = if op == BinaryOp::And { Op::And } else { Op::Or };
                Some(self.op(op, &[x, y], Ty::Int, span))
            }
        };
        found.unwrap_or_else(|| {
            let message = format!("`{}` does not apply to {} and {}", op.text(), a.ty.name(), b.ty.name());
            let mut d = Diagnostic::error("E0204", span, message);
            d = d.label(self.span_of(ids.0), a.ty.name()).label(self.span_of(ids.1), b.ty.name());
            if op == BinaryOp::Rem {
                d = d.help("`%` is for ints; for floats call `mod(a, b)` or `fmod(a, b)`");
            } else if a.ty.is_triple() && b.ty.is_triple() {
                d = d.help(format!("cast one of them, for example `({}) x`", a.ty.name()));
            }
            self.error(d)
        })
    }

    fn closure_binary(
        &mut self,
        op: BinaryOp,
        a: Typed,
        b: Typed,
        span: Span,
        ids: (ast::ExprId, ast::ExprId),
    ) -> Typed {
        let weight = |ty: Ty| ty.is_scalar() || ty == Ty::Color;
        match (op, a.ty, b.ty) {
            (BinaryOp::Add, Ty::Closure, Ty::Closure) => return self.op(Op::AddC, &[a.id, b.id], Ty::Closure, span),
            (BinaryOp::Mul, Ty::Closure, ty) if weight(ty) => return self.scale(b, a, span),
            (BinaryOp::Mul, ty, Ty::Closure) if weight(ty) => return self.scale(a, b, span),
            _ => {}
        }
        let (message, help) = match (op, a.ty, b.ty) {
            (BinaryOp::Mul, Ty::Closure, Ty::Closure) => (
                "closures cannot be multiplied with each other".to_owned(),
                "scale a closure by a color or float, or put one over the other with `layer(top, base)`",
            ),
            (BinaryOp::Sub, Ty::Closure, Ty::Closure) => (
                "closures cannot be subtracted".to_owned(),
                "a difference could be negative; scale each closure by its own weight and add",
            ),
            (BinaryOp::Div, Ty::Closure, _) => {
                ("a closure cannot be divided".to_owned(), "multiply by the reciprocal: `closure * (1 / x)`")
            }
            (BinaryOp::Add, ..) => (
                format!("`+` does not apply to {} and {}", a.ty.name(), b.ty.name()),
                "only closures add to closures; turn a color into one by scaling, for example `color * diffuse(N)`",
            ),
            (BinaryOp::Mul, ..) => (
                format!("`*` does not apply to {} and {}", a.ty.name(), b.ty.name()),
                "a closure is scaled by a color, a float or an int",
            ),
            _ => (
                format!("`{}` does not apply to {} and {}", op.text(), a.ty.name(), b.ty.name()),
                "closures are added and scaled, nothing else",
            ),
        };
        let d = Diagnostic::error("E0301", span, message);
        let d = d.label(self.span_of(ids.0), a.ty.name()).label(self.span_of(ids.1), b.ty.name());
        self.error(d.help(help))
    }

    /// weight × closure
    pub(super) fn scale(&mut self, weight: Typed, closure: Typed, span: Span) -> Typed {
        let weight = self.convert(weight, Ty::Color, span);
        self.op(Op::MulC, &[weight, closure.id], Ty::Closure, span)
    }

    fn arithmetic(&mut self, op: BinaryOp, a: Typed, b: Typed, span: Span) -> Option<Typed> {
        let ty = common(op, a.ty, b.ty)?;
        let (x, y) = (self.convert(a, ty, span), self.convert(b, ty, span));
        let op = match (op, ty) {
            (BinaryOp::Add, Ty::Int) => Op::AddI,
            (BinaryOp::Sub, Ty::Int) => Op::SubI,
            (BinaryOp::Mul, Ty::Int) => Op::MulI,
            (_, Ty::Int) => Op::DivI,
            (BinaryOp::Add, _) => Op::AddF,
            (BinaryOp::Sub, _) => Op::SubF,
            (BinaryOp::Mul, _) => Op::MulF,
            _ => Op::DivF,
        };
        let points = a.ty == Ty::Point && b.ty == Ty::Point && op == Op::SubF;
        Some(self.op(op, &[x, y], if points { Ty::Vector } else { ty }, span))
    }

    fn integer(&mut self, op: BinaryOp, a: Typed, b: Typed, span: Span) -> Option<Typed> {
        let op = match op {
            BinaryOp::Rem => Op::RemI,
            BinaryOp::BitAnd => Op::BitAndI,
            BinaryOp::BitOr => Op::BitOrI,
            BinaryOp::BitXor => Op::BitXorI,
            BinaryOp::Shl => Op::ShlI,
            _ => Op::ShrI,
        };
        (a.ty == Ty::Int && b.ty == Ty::Int).then(|| self.op(op, &[a.id, b.id], Ty::Int, span))
    }

    fn equality(&mut self, op: BinaryOp, a: Typed, b: Typed, span: Span) -> Option<Typed> {
        let strings = a.ty == Ty::String && b.ty == Ty::String;
        let ty = if strings { Ty::String } else { common(BinaryOp::Add, a.ty, b.ty)? };
        let (x, y) = (self.convert(a, ty, span), self.convert(b, ty, span));
        let op = match (op, ty) {
            (BinaryOp::Eq, Ty::Int | Ty::String) => Op::EqI,
            (_, Ty::Int | Ty::String) => Op::NeI,
            (BinaryOp::Eq, _) => Op::EqF,
            _ => Op::NeF,
        };
        Some(self.op(op, &[x, y], Ty::Int, span))
    }

    fn order(&mut self, op: BinaryOp, a: Typed, b: Typed, span: Span) -> Option<Typed> {
        if !a.ty.is_scalar() || !b.ty.is_scalar() {
            return None;
        }
        let ty = common(BinaryOp::Add, a.ty, b.ty)?;
        let (x, y) = (self.convert(a, ty, span), self.convert(b, ty, span));
        let op = match (op, ty) {
            (BinaryOp::Lt, Ty::Int) => Op::LtI,
            (BinaryOp::Le, Ty::Int) => Op::LeI,
            (BinaryOp::Gt, Ty::Int) => Op::GtI,
            (_, Ty::Int) => Op::GeI,
            (BinaryOp::Lt, _) => Op::LtF,
            (BinaryOp::Le, _) => Op::LeF,
            (BinaryOp::Gt, _) => Op::GtF,
            _ => Op::GeF,
        };
        Some(self.op(op, &[x, y], Ty::Int, span))
    }

    fn ternary(&mut self, c: ast::ExprId, a: ast::ExprId, b: ast::ExprId, span: Span) -> Typed {
        let condition = self.truth(self.of(c), self.span_of(c));
        let (x, y) = (self.of(a), self.of(b));
        if x.ty == Ty::Poison || y.ty == Ty::Poison {
            return self.poison();
        }
        let ty = if y.ty.distance(x.ty).is_some() { Some(x.ty) } else { x.ty.distance(y.ty).map(|_| y.ty) };
        let Some(ty) = ty else {
            let message = format!("the two values of `? :` are {} and {}", x.ty.name(), y.ty.name());
            let d = Diagnostic::error("E0203", span, message);
            let d = d.label(self.span_of(a), x.ty.name()).label(self.span_of(b), y.ty.name());
            return self.error(d.help("make both the same type"));
        };
        let (x, y) = (self.convert(x, ty, span), self.convert(y, ty, span));
        self.op(Op::Select, &[condition, x, y], ty, span)
    }

    /// An int that tells whether a value is other than zero.
    pub(super) fn truth(&mut self, a: Typed, span: Span) -> ExprId {
        match a.ty {
            Ty::Poison => a.id,
            Ty::Int => self.op(Op::TruthI, &[a.id], Ty::Int, span).id,
            ty if ty.is_numeric() => self.op(Op::TruthF, &[a.id], Ty::Int, span).id,
            ty => {
                let message = format!("a condition is a number, not {}", ty.name());
                let d = Diagnostic::error("E0209", span, message).note(format!("this is {}", ty.name()));
                self.error(d.help("compare it with something: `a == b`")).id
            }
        }
    }

    /// Applies a conversion that [`Ty::distance`] allows.
    pub(super) fn convert(&mut self, a: Typed, to: Ty, span: Span) -> ExprId {
        match (a.ty, to) {
            (Ty::Int, Ty::Float) => self.op(Op::IntToFloat, &[a.id], Ty::Float, span).id,
            (Ty::Int, to) if to.is_triple() => {
                let float = self.op(Op::IntToFloat, &[a.id], Ty::Float, span);
                self.op(Op::Splat, &[float.id], to, span).id
            }
            (Ty::Float, to) if to.is_triple() => match self.body.expr(a.id).kind {
                // Three numbers where three are asked for, rather than one three times.
                ExprKind::Call(index, _) if BUILTINS[index as usize].result_follows_use() => {
                    self.push(self.body.expr(a.id).kind, to, span).id
                }
                _ => self.op(Op::Splat, &[a.id], to, span).id,
            },
            _ => a.id,
        }
    }

    /// Converts the value that a variable of type `ty` starts with or is given.
    pub(super) fn initial(&mut self, value: Typed, ty: Ty, span: Span, run: ast::Root) -> ExprId {
        if value.ty.distance(ty).is_some() {
            return self.convert(value, ty, span);
        }
        if ty == Ty::Closure && matches!(self.ast.expr(run.root).kind, ast::ExprKind::Int(0)) {
            return self.zero(ty, span);
        }
        let message = format!("expected {}, found {}", ty.name(), value.ty.name());
        let d = Diagnostic::error("E0203", span, message).note(format!("this is {}", value.ty.name()));
        let d = conversion_help(value.ty, ty).into_iter().fold(d, Diagnostic::help);
        self.error(d).id
    }

    fn cast(&mut self, ty: Ty, a: Typed, span: Span) -> Typed {
        match (a.ty, ty) {
            (Ty::Poison, _) => a,
            (from, to) if from.distance(to).is_some() => Typed { id: self.convert(a, to, span), ty: to },
            (from, to) if from.is_triple() && to.is_triple() => Typed { id: a.id, ty: to },
            (Ty::Float, Ty::Int) => self.op(Op::FloatToInt, &[a.id], Ty::Int, span),
            (from, to) => {
                let d = Diagnostic::error("E0203", span, format!("{} cannot become {}", from.name(), to.name()));
                self.error(conversion_help(from, to).into_iter().fold(d, Diagnostic::help))
            }
        }
    }

    fn construct(&mut self, name: TypeName, args: ast::Args, span: Span) -> Typed {
        let ty = Ty::from(name);
        let ids = self.ast.args(args);
        let given: Vec<Typed> = ids.iter().map(|id| self.of(*id)).collect();
        match given[..] {
            [one] => return self.cast(ty, one, span),
            [x, y, z] if ty.is_triple() => {
                let parts = [x, y, z];
                if let Some(i) = parts.iter().position(|part| part.ty.distance(Ty::Float).is_none()) {
                    let message = format!("a component of {} is a float, not {}", ty.name(), parts[i].ty.name());
                    return self.error(Diagnostic::error("E0203", self.span_of(ids[i]), message));
                }
                let floats = parts.map(|part| self.convert(part, Ty::Float, span));
                return self.op(Op::Triple, &floats, ty, span);
            }
            [first, ..] if ty.is_triple() && first.ty == Ty::String => {
                let message = format!("{} with a named space is not supported", ty.name());
                return self.error(Diagnostic::error("E0109", self.span_of(ids[0]), message));
            }
            _ => {}
        }
        let d = Diagnostic::error("E0205", span, format!("{} cannot be made from {} values", ty.name(), given.len()));
        self.error(if ty.is_triple() { d.help("give one value or three") } else { d.help("give one value") })
    }

    fn index(&mut self, a: Typed, i: Typed, at: ast::ExprId, span: Span) -> Typed {
        if a.ty == Ty::Poison || i.ty == Ty::Poison {
            return self.poison();
        }
        if !self.check_index(a.ty, i.ty, at, span) {
            return self.poison();
        }
        self.op(Op::Component, &[a.id, i.id], Ty::Float, span)
    }

    fn check_index(&mut self, ty: Ty, index: Ty, at: ast::ExprId, span: Span) -> bool {
        let at_span = self.span_of(at);
        let d = if !ty.is_triple() {
            Diagnostic::error("E0208", span, format!("{} has no components", ty.name()))
        } else if index != Ty::Int {
            Diagnostic::error("E0208", at_span, format!("an index is an int, not {}", index.name()))
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
        let found = names.iter().position(|n| *n == text);
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

    /// `target = value`; `last` if nothing else is assigned the result.
    fn assignment(
        &mut self,
        op: Option<BinaryOp>,
        target: ast::ExprId,
        value: ast::ExprId,
        span: Span,
        last: bool,
    ) -> Typed {
        let (base, index) = match self.ast.expr(target).kind {
            ast::ExprKind::Index(base, index) => (base, Some(index)),
            ast::ExprKind::Field(base, ..) => (base, Some(target)),
            _ => (target, None),
        };
        let Some((var, ty)) = self.target(base) else { return self.poison() };
        self.assigned_ci |= var == VarId::CI;
        let old = self.push(ExprKind::Var(var), ty, self.span_of(base));
        let Some(at) = index else {
            let new = self.combined(op, old, target, value, span);
            let new = self.initial(new, ty, self.span_of(value), ast::Root { first: value.0, root: value });
            self.assign(var, new);
            return self.push(ExprKind::Var(var), ty, span);
        };
        let Some(index) = self.component_index(ty, target, at) else { return self.poison() };
        let known = match self.body.expr(index).kind {
            ExprKind::Const(cells) => Some(cells[0] as i32),
            _ if !last => {
                let d = Diagnostic::error("E0109", self.span_of(target), "this cannot be part of a chain");
                return self.error(d.help("assign in two statements"));
            }
            _ => None,
        };
        let slot = self.op(Op::Component, &[old.id, index], Ty::Float, span);
        let new = self.combined(op, slot, target, value, span);
        let new = self.initial(new, Ty::Float, self.span_of(value), ast::Root { first: value.0, root: value });
        let whole = self.op(Op::Insert, &[old.id, index, new], ty, span);
        self.assign(var, whole.id);
        let now = self.push(ExprKind::Var(var), ty, span);
        match known {
            Some(i) => {
                let i = self.int(i, span);
                self.op(Op::Component, &[now.id, i.id], Ty::Float, span)
            }
            None => now,
        }
    }

    /// What `op=` assigns: the old value and the new one under the operator.
    fn combined(
        &mut self,
        op: Option<BinaryOp>,
        old: Typed,
        target: ast::ExprId,
        value: ast::ExprId,
        span: Span,
    ) -> Typed {
        let new = self.of(value);
        op.map_or(new, |op| self.binary(op, old, new, span, (target, value)))
    }

    /// The index that an assignment to a component names.
    fn component_index(&mut self, ty: Ty, target: ast::ExprId, at: ast::ExprId) -> Option<ExprId> {
        match self.ast.expr(target).kind {
            ast::ExprKind::Field(_, name, span) => {
                let names: &[&str] = if ty == Ty::Color { &["r", "g", "b"] } else { &["x", "y", "z"] };
                let index = names.iter().position(|n| *n == self.ast.name(name))?;
                ty.is_triple().then(|| self.int(index as i32, span).id)
            }
            _ => {
                let index = self.of(at);
                if !ty.is_triple() || index.ty != Ty::Int {
                    // Reported when the target was checked as a value.
                    return None;
                }
                match self.ast.expr(at).kind {
                    ast::ExprKind::Int(i) => (0..3).contains(&i).then(|| self.int(i, self.span_of(at)).id),
                    // The value assigned is itself an assignment, which ended the run that the index belongs to.
                    _ if index.id.0 < self.run_start => {
                        let d = Diagnostic::error("E0109", self.span_of(target), "this cannot be part of a chain");
                        self.diagnostics.push(d.help("assign in two statements"));
                        None
                    }
                    _ => Some(index.id),
                }
            }
        }
    }

    /// The variable an assignment may write.
    fn target(&mut self, id: ast::ExprId) -> Option<(VarId, Ty)> {
        let ast::Expr { kind, span } = *self.ast.expr(id);
        let ast::ExprKind::Name(sym) = kind else {
            if self.of(id).ty != Ty::Poison {
                let d = Diagnostic::error("E0207", span, "this cannot be assigned to");
                self.diagnostics.push(d.help("assign to a variable or to one of its components"));
            }
            return None;
        };
        let text = self.ast.name(sym);
        if let Some(var) = self.names.get(&sym).copied() {
            let variable = &self.variables[var.index()];
            if variable.access == Access::ReadOnly {
                let d = Diagnostic::error("E0207", span, format!("the parameter `{text}` cannot be assigned to"));
                let d = d.label(variable.span, "declared here");
                self.diagnostics.push(d.help("copy it to a local variable, or declare it `output`"));
                return None;
            }
            return Some((var, self.body.vars[var.index()]));
        }
        match global(text) {
            Some(Global::Ci) => Some((VarId::CI, Ty::Closure)),
            Some(_) => {
                let d = Diagnostic::error("E0207", span, format!("`{text}` cannot be assigned to"));
                self.diagnostics.push(d.help("a surface shader writes `Ci`; copy the rest to local variables"));
                None
            }
            None => None,
        }
    }

    /// Stores arguments of a call.
    pub(super) fn store(&mut self, ids: impl IntoIterator<Item = ExprId>) -> Args {
        self.body.push_args(ids)
    }
}

/// The type in which two operands meet, if there is one.
fn common(op: BinaryOp, a: Ty, b: Ty) -> Option<Ty> {
    if !a.is_numeric() || !b.is_numeric() {
        return None;
    }
    match (a, b) {
        (a, b) if a == b => Some(a),
        (a, b) if a.is_scalar() && b.is_scalar() => Some(Ty::Float),
        (a, b) if b.is_scalar() => Some(a),
        (a, b) if a.is_scalar() => Some(b),
        (Ty::Point, b) | (b, Ty::Point) if b.is_spatial() && matches!(op, BinaryOp::Add | BinaryOp::Sub) => {
            Some(Ty::Point)
        }
        (a, b) if a.is_spatial() && b.is_spatial() => Some(Ty::Vector),
        _ => None,
    }
}

/// How to get from one type to another by hand.
fn conversion_help(from: Ty, to: Ty) -> Option<String> {
    match (from, to) {
        (Ty::Float, Ty::Int) => Some("write `(int) x` to cut off the fraction".to_owned()),
        (Ty::Color, Ty::Float | Ty::Int) => Some("take one component, `c[0]`, or `luminance(c)`".to_owned()),
        (a, Ty::Float | Ty::Int) if a.is_spatial() => Some("take one component, `v[0]`, or `length(v)`".to_owned()),
        (a, b) if a.is_triple() && b.is_triple() => Some(format!("write `({}) x` if that is meant", b.name())),
        (a, Ty::Closure) if a.is_numeric() => Some("scale a closure by it: `x * diffuse(N)`".to_owned()),
        (Ty::Closure, _) => {
            Some("a closure is no value: it can only be added, scaled, layered and assigned".to_owned())
        }
        _ => None,
    }
}
