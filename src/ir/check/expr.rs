//! Checking of single expressions: names, operators, conversions, assignments.

use super::super::body::{Args, ExprId, ExprKind, GlobalVar, Op, VarId};
use super::super::builtins::{BUILTINS, CONSTANTS};
use super::super::types::Ty;
use super::call::Given;
use super::function::{binary_name, unary_name};
use super::place::{At, Place};
use super::{Checker, Typed, suggest};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::{self, BinaryOp, Sym, UnaryOp};

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
    /// Checks one expression whose operands have been checked. `last`: nothing uses its value.
    pub(super) fn expression(&mut self, id: ast::ExprId, last: bool) -> Typed {
        let ast::Expr { kind, span } = *self.ast.expr(id);
        match kind {
            ast::ExprKind::Int(value) => self.int(value, span),
            ast::ExprKind::Float(value) => self.push(ExprKind::Const([value.to_bits(), 0, 0]), Ty::Float, span),
            ast::ExprKind::String(sym) => {
                let ast = self.ast;
                let string = self.string(ast.name(sym));
                self.push(ExprKind::Const([string, 0, 0]), Ty::String, span)
            }
            ast::ExprKind::Name(sym) => self.name(sym, span),
            ast::ExprKind::Unary(op, a) => self.unary(op, a, span),
            ast::ExprKind::Binary(op, a, b) => self.binary(op, self.of(a), self.of(b), span, (a, b)),
            ast::ExprKind::Ternary(c, a, b) => {
                let condition = self.truth(self.of(c), self.span_of(c));
                self.choose(condition, (self.of(a), self.span_of(a)), (self.of(b), self.span_of(b)), span)
            }
            ast::ExprKind::Call(name, at, args) => {
                let wanted = self.hints.get(&id.0).copied();
                self.call(name, at, args, span, wanted)
            }
            ast::ExprKind::Construct(ty, args) => self.construct(ty, args, span),
            ast::ExprKind::Cast(ty, a) => match Ty::simple(ty) {
                Some(Ty::Matrix) => {
                    let given = Given { ids: vec![a], typed: vec![self.of(a)] };
                    self.construct_matrix(&given, span)
                }
                ty => self.cast(ty.unwrap_or(Ty::Poison), self.of(a), span),
            },
            ast::ExprKind::Index(a, i) => self.index(self.of(a), self.of(i), i, span),
            ast::ExprKind::Field(a, name, at) => self.field_value(self.of(a), name, at, span),
            ast::ExprKind::List(args) => self.list_value(id, args, span),
            ast::ExprKind::Step(step, target) => self.step(step, target, span, last),
            ast::ExprKind::Comma(_, b) => self.of(b),
            ast::ExprKind::Assign(..) if self.depth == 0 => {
                let d = Diagnostic::error("E0109", span, "an assignment in a default value is not supported");
                self.error(d.help("assign in the body of the shader"))
            }
            ast::ExprKind::Assign(op, target, value) => self.assignment(op, target, value, span, last),
        }
    }

    pub(super) fn of(&self, id: ast::ExprId) -> Typed {
        self.typed[id.0 as usize]
    }

    pub(super) fn span_of(&self, id: ast::ExprId) -> Span {
        self.ast.expr(id).span
    }

    pub(super) fn push(&mut self, kind: ExprKind, ty: Ty, span: Span) -> Typed {
        Typed { id: self.body.push(kind, ty, span), ty, place: None, temp: None }
    }

    pub(super) fn op(&mut self, op: Op, operands: &[ExprId], ty: Ty, span: Span) -> Typed {
        let mut ids = [ExprId(0); 3];
        ids[..operands.len()].copy_from_slice(operands);
        self.push(ExprKind::Op(op, ids), ty, span)
    }

    fn name(&mut self, sym: Sym, span: Span) -> Typed {
        if let Some(binding) = self.names.get(&sym).map(|b| self.bindings[*b]) {
            if binding.ty == Ty::Poison {
                return self.poison();
            }
            return self.load(binding.place, binding.ty, span);
        }
        let text = self.ast.name(sym);
        match global(text) {
            Some(Global::Read(g)) => self.push(ExprKind::Global(g), g.ty(), span),
            Some(Global::Ci) => {
                let place = Place { base: VarId::CI, len: 1, at: At::Known(0) };
                self.load(place, Ty::Closure, span)
            }
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

    fn unary(&mut self, op: UnaryOp, id: ast::ExprId, span: Span) -> Typed {
        let a = self.of(id);
        if let Some(made) = self.overloaded(unary_name(op), &[id], &[a], span) {
            return made;
        }
        match (op, a.ty) {
            (_, Ty::Poison) => a,
            (UnaryOp::Neg, Ty::Matrix) => {
                let given = Given { ids: vec![id], typed: vec![a] };
                self.matrix_negated(&given, span)
            }
            (UnaryOp::Neg, Ty::Int) => self.op(Op::NegI, &[a.id], Ty::Int, span),
            (UnaryOp::Neg, ty) if ty.is_numeric() => self.op(Op::NegF, &[a.id], ty, span),
            (UnaryOp::Plus, ty) if ty.is_numeric() => Typed { place: None, ..a },
            (UnaryOp::Not, ty) if ty.is_numeric() => {
                let truth = self.truth(a, span);
                self.op(Op::NotI, &[truth], Ty::Int, span)
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

    pub(super) fn binary(
        &mut self,
        op: BinaryOp,
        a: Typed,
        b: Typed,
        span: Span,
        ids: (ast::ExprId, ast::ExprId),
    ) -> Typed {
        if a.ty == Ty::Poison || b.ty == Ty::Poison {
            return self.poison();
        }
        if let Some(made) = self.overloaded(binary_name(op), &[ids.0, ids.1], &[a, b], span) {
            return made;
        }
        if a.ty == Ty::Matrix || b.ty == Ty::Matrix {
            let given = Given { ids: vec![ids.0, ids.1], typed: vec![a, b] };
            if let Some(made) = self.matrix_binary(op, &given, span) {
                return made;
            }
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
            let (left, right) = (self.words(a.ty), self.words(b.ty));
            let message = format!("`{}` does not apply to {left} and {right}", op.text());
            let mut d = Diagnostic::error("E0204", span, message);
            d = d.label(self.span_of(ids.0), left).label(self.span_of(ids.1), right);
            if matches!(a.ty, Ty::Struct(_)) || matches!(b.ty, Ty::Struct(_)) {
                d = d.help(format!("a function `{}` would say what it does", binary_name(op)));
            }
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

    /// One of two values.
    pub(super) fn choose(&mut self, condition: ExprId, a: (Typed, Span), b: (Typed, Span), span: Span) -> Typed {
        let ((x, a), (y, b)) = (a, b);
        if x.ty == Ty::Poison || y.ty == Ty::Poison {
            return self.poison();
        }
        if let (Some(from), Some(other)) = (x.place, y.place)
            && x.ty == y.ty
            && x.ty.is_aggregate()
        {
            return self.choose_parts(condition, from, other, x.ty, span);
        }
        let ty = if y.ty.distance(x.ty).is_some() { Some(x.ty) } else { x.ty.distance(y.ty).map(|_| y.ty) };
        let Some(ty) = ty.filter(|ty| *ty != Ty::Void) else {
            let (left, right) = (self.words(x.ty), self.words(y.ty));
            let d = Diagnostic::error("E0203", span, format!("the two values of `? :` are {left} and {right}"));
            let d = d.label(a, left).label(b, right);
            return self.error(d.help("make both the same type"));
        };
        let (x, y) = (self.convert(x, ty, span), self.convert(y, ty, span));
        self.op(Op::Select, &[condition, x, y], ty, span)
    }

    /// One of two values of several parts.
    fn choose_parts(&mut self, condition: ExprId, a: Place, b: Place, ty: Ty, span: Span) -> Typed {
        let condition = self.kept(condition, Ty::Int);
        self.spill();
        let place = self.allocate(ty);
        let (mut to, mut left, mut right) = (Vec::new(), Vec::new(), Vec::new());
        let (a, b) = (self.pinned(a), self.pinned(b));
        self.leaves(place, ty, span, &mut to);
        self.leaves(a, ty, span, &mut left);
        self.leaves(b, ty, span, &mut right);
        for ((to, ty), ((a, _), (b, _))) in to.into_iter().zip(left.into_iter().zip(right)) {
            self.run_start = self.body.exprs.len() as u32;
            let condition = self.push(ExprKind::Var(condition), Ty::Int, span);
            let (a, b) = (self.load(a, ty, span), self.load(b, ty, span));
            let value = self.op(Op::Select, &[condition.id, a.id, b.id], ty, span);
            self.store_at(to, ty, value.id, span);
        }
        self.resume();
        self.load(place, ty, span)
    }

    /// An int that tells whether a value is other than zero.
    pub(super) fn truth(&mut self, a: Typed, span: Span) -> ExprId {
        match a.ty {
            Ty::Poison => a.id,
            Ty::Int => self.op(Op::TruthI, &[a.id], Ty::Int, span).id,
            ty if ty.is_numeric() => self.op(Op::TruthF, &[a.id], Ty::Int, span).id,
            ty => {
                let words = self.words(ty);
                let d = Diagnostic::error("E0209", span, format!("a condition is a number, not {words}"));
                let d = d.note(format!("this is {words}"));
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
            // The literal 0, which stands for a black closure.
            (Ty::Int, Ty::Closure) => self.zero(to, span),
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
        let (wants, has) = (self.words(ty), self.words(value.ty));
        let d = Diagnostic::error("E0203", span, format!("expected {wants}, found {has}"));
        let d = d.note(format!("this is {has}"));
        let d = conversion_help(value.ty, ty).into_iter().fold(d, Diagnostic::help);
        self.error(d).id
    }

    pub(super) fn cast(&mut self, ty: Ty, a: Typed, span: Span) -> Typed {
        match (a.ty, ty) {
            (Ty::Poison, _) => a,
            (from, to) if from.distance(to).is_some() => {
                Typed { id: self.convert(a, to, span), ty: to, place: None, temp: None }
            }
            (from, to) if from.is_triple() && to.is_triple() => Typed { ty: to, place: None, ..a },
            (Ty::Float, Ty::Int) => self.op(Op::FloatToInt, &[a.id], Ty::Int, span),
            (from, to) => {
                let message = format!("{} cannot become {}", self.words(from), self.words(to));
                let d = Diagnostic::error("E0203", span, message);
                self.error(conversion_help(from, to).into_iter().fold(d, Diagnostic::help))
            }
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
