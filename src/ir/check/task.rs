//! Calls that become statements: matrices, strings, messages, questions to the host.

use super::super::body::{Deed, ExprId, ExprKind, Op, Stmt, VarId};
use super::super::functions::matrix::Kind;
use super::super::host::Speech;
use super::super::tasks::Task;
use super::super::types::Ty;
use super::call::Given;
use super::place::{At, Place};
use super::{Checker, Typed};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast;

/// What is called by these names becomes statements.
pub(crate) const TASKS: &[&str] = &[
    "arraylength",
    "concat",
    "determinant",
    "endswith",
    "error",
    "format",
    "fresnel",
    "getattribute",
    "getchar",
    "getmatrix",
    "gettextureinfo",
    "hash",
    "isconnected",
    "isconstant",
    "printf",
    "raytype",
    "sincos",
    "spline",
    "splineinverse",
    "split",
    "startswith",
    "stof",
    "stoi",
    "strlen",
    "substr",
    "texture",
    "transform",
    "transpose",
    "warning",
    "exit",
    "inverse",
    "artistic_ior",
];

/// Whether a call of `name` may become statements.
pub(super) fn is_task(name: &str) -> bool {
    TASKS.contains(&name)
}

impl Checker<'_> {
    /// A call that becomes statements; `None` if it is none, or fits none.
    pub(super) fn task(&mut self, name: &str, given: &Given, span: Span, wanted: Option<Ty>) -> Option<Typed> {
        if !is_task(name) {
            return None;
        }
        if given.typed.iter().any(|arg| arg.ty == Ty::Poison) {
            return Some(self.poison());
        }
        let types: Vec<Ty> = given.typed.iter().map(|arg| arg.ty).collect();
        use Ty::{Float, Int, Matrix, String as Text};
        let simple = |task, wants: &[Ty], result| Some((task, wants.to_vec(), result));
        let found: Option<(Task, Vec<Ty>, Ty)> = match (name, &types[..]) {
            ("strlen", [Text]) => simple(Task::Length, &[Text], Int),
            ("startswith", [Text, Text]) => simple(Task::StartsWith, &[Text, Text], Int),
            ("endswith", [Text, Text]) => simple(Task::EndsWith, &[Text, Text], Int),
            ("stoi", [Text]) => simple(Task::ToInt, &[Text], Int),
            ("stof", [Text]) => simple(Task::ToFloat, &[Text], Float),
            ("getchar", [Text, Int]) => simple(Task::Char, &[Text, Int], Int),
            ("hash", [Text]) => simple(Task::Hash, &[Text], Int),
            ("substr", [Text, Int]) => {
                // To the end: no string is longer.
                self.aside(given);
                let (text, start) = (self.value_of(given, 0, Text), self.value_of(given, 1, Int));
                let all = self.number(i32::MAX as f32, Int, span);
                return Some(self.result(Task::Part, vec![text, start, all], Text, span));
            }
            ("substr", [Text, Int, Int]) => simple(Task::Part, &[Text, Int, Int], Text),
            ("raytype", [Text]) => simple(Task::RayType, &[Text], Int),
            ("determinant", [Matrix]) => simple(Task::Determinant, &[Matrix], Float),
            ("transpose", [Matrix]) => simple(Task::Transpose, &[Matrix], Matrix),
            ("inverse", [Matrix]) => simple(Task::Inverse, &[Matrix], Matrix),
            ("transform", [Matrix, triple]) if triple.is_spatial() => {
                simple(Task::Transform(kind(*triple)), &[Matrix, *triple], *triple)
            }
            ("transform", [Text, Text, triple]) if triple.is_spatial() => {
                simple(Task::Between(kind(*triple)), &[Text, Text, *triple], *triple)
            }
            ("concat" | "format", [Text, ..]) => {
                let task = if name == "concat" { Task::Concat } else { Task::Format };
                (name == "format" || types.iter().all(|ty| *ty == Text)).then(|| (task, types.clone(), Text))
            }
            ("printf" | "warning" | "error", [Text, ..]) => {
                let speech = match name {
                    "printf" => Speech::Print,
                    "warning" => Speech::Warning,
                    _ => Speech::Error,
                };
                Some((Task::Say(speech), types.clone(), Ty::Void))
            }
            ("isconstant", [one]) if !one.is_aggregate() => Some((Task::IsConstant, types.clone(), Int)),
            _ => None,
        };
        if let Some((task, wants, result)) = found {
            return Some(self.plain(task, given, &wants, result, span));
        }
        self.odd_task(name, given, &types, span, wanted)
    }

    fn odd_task(&mut self, name: &str, given: &Given, types: &[Ty], span: Span, wanted: Option<Ty>) -> Option<Typed> {
        use Ty::{Float, Int, Matrix, String as Text};
        match (name, types) {
            ("arraylength", [Ty::Array(number)]) => {
                let length = self.arrays[usize::from(*number)].1.unwrap_or(0);
                Some(self.int(length as i32, span))
            }
            ("isconnected", [_]) => {
                let name = match self.ast.expr(given.ids[0]).kind {
                    ast::ExprKind::Name(sym) => self.ast.name(sym).to_owned(),
                    _ => String::new(),
                };
                self.spill();
                let name = self.text(&name, span);
                Some(self.result(Task::IsConnected, vec![name], Int, span))
            }
            ("transform", [Text, triple]) if triple.is_spatial() => {
                self.aside(given);
                let from = self.text("common", span);
                let to = self.value_of(given, 0, Text);
                let value = self.value_of(given, 1, *triple);
                Some(self.result(Task::Between(kind(*triple)), vec![from, to, value], *triple, span))
            }
            ("getmatrix", [Text, Matrix] | [Text, Text, Matrix]) => Some(self.matrix_between(given, types.len(), span)),
            ("sincos", [angle, sin, cos]) if angle == sin && sin == cos && (angle.is_triple() || *angle == Float) => {
                self.aside(given);
                let ty = *angle;
                for (function, target) in [("sin", 1), ("cos", 2)] {
                    self.run_start = self.body.exprs.len() as u32;
                    let value = self.fresh(self.of(given.ids[0]));
                    let id = self.builtin_by_name(function, &[value.id], ty, span);
                    let var = self.kept(id, ty);
                    self.write_result(given.ids[target], at(var), ty, span);
                }
                self.resume();
                Some(Typed { ty: Ty::Void, ..self.poison() })
            }
            ("artistic_ior", [r, g, Ty::Color, Ty::Color])
                if [r, g].iter().all(|t| t.distance(Ty::Color).is_some()) =>
            {
                self.aside(given);
                let args = vec![self.value_of(given, 0, Ty::Color), self.value_of(given, 1, Ty::Color)];
                let outs = [self.temporary(Ty::Color), self.temporary(Ty::Color)];
                self.deed(Task::ArtisticIor, args, outs.to_vec(), span);
                for (target, var) in [(2, outs[0]), (3, outs[1])] {
                    self.write_result(given.ids[target], at(var), Ty::Color, span);
                }
                self.resume();
                Some(Typed { ty: Ty::Void, ..self.poison() })
            }
            ("split", [Text, Ty::Array(number), rest @ ..])
                if self.arrays[usize::from(*number)].0 == Text && matches!(rest, [] | [Text] | [Text, Int]) =>
            {
                Some(self.split(given, types, span))
            }
            ("getattribute", [Text, ..]) => self.attribute(given, types, span),
            ("spline" | "splineinverse", [Text, _, ..]) => self.spline(name, given, types, span),
            ("fresnel", [i, n, eta, rest @ ..])
                if i.is_spatial() && n.is_spatial() && eta.is_scalar() && matches!(rest.len(), 2 | 4) =>
            {
                Some(self.fresnel(given, types, span))
            }
            ("gettextureinfo", [Text, Text, _]) => self.texture_info(given, types, span),
            ("texture", [Text, _, _, ..]) => Some(self.texture(given, types, span, wanted)),
            ("exit", []) if self.stack.is_empty() => {
                let d = Diagnostic::error("E0109", span, "`exit()` is not supported: use `return`");
                Some(self.error(d))
            }
            _ => None,
        }
    }

    /// `getmatrix(from, M)`, `getmatrix(from, to, M)`.
    fn matrix_between(&mut self, given: &Given, count: usize, span: Span) -> Typed {
        self.aside(given);
        let from = self.value_of(given, 0, Ty::String);
        let to = if count == 3 { self.value_of(given, 1, Ty::String) } else { self.text("common", span) };
        let out = self.allocate(Ty::Matrix);
        let found = self.temporary(Ty::Int);
        let outs = std::iter::once(found).chain((0..16).map(|i| VarId(out.base.0 + i))).collect();
        self.deed(Task::Spaces, vec![from, to], outs, span);
        self.write_result(given.ids[count - 1], out, Ty::Matrix, span);
        self.back(found, Ty::Int, span)
    }

    /// A task of converted arguments with one result.
    fn plain(&mut self, task: Task, given: &Given, wants: &[Ty], result: Ty, span: Span) -> Typed {
        self.aside(given);
        let mut args = Vec::new();
        for (i, ty) in wants.iter().enumerate() {
            self.variables(given, i, *ty, span, &mut args);
        }
        self.result(task, args, result, span)
    }

    /// Puts aside the arguments of a call; those of operators wait like those of calls.
    pub(super) fn aside(&mut self, given: &Given) {
        let length = self.pending.len();
        let missing: Vec<_> = given.ids.iter().copied().filter(|id| !self.pending.contains(id)).collect();
        self.pending.extend(missing);
        self.spill();
        self.pending.truncate(length);
    }

    /// The variables that hold an argument, part by part.
    pub(super) fn variables(&mut self, given: &Given, index: usize, ty: Ty, span: Span, out: &mut Vec<VarId>) {
        let typed = self.of(given.ids[index]);
        match typed.place {
            Some(place) if typed.ty.is_aggregate() => {
                let mut parts = Vec::new();
                self.leaves(place, typed.ty, span, &mut parts);
                for (part, ty) in parts {
                    self.run_start = self.body.exprs.len() as u32;
                    let value = self.load(part, ty, span);
                    let var = self.kept(value.id, ty);
                    out.push(var);
                }
            }
            _ if typed.ty.is_aggregate() || matches!(typed.ty, Ty::Void | Ty::Closure) => {}
            _ => out.push(self.value_of(given, index, ty)),
        }
    }

    /// An argument as a `ty`, in a variable.
    pub(super) fn value_of(&mut self, given: &Given, index: usize, ty: Ty) -> VarId {
        let id = given.ids[index];
        let typed = self.of(id);
        if let Some(var) = typed.temp.filter(|var| self.body.vars[var.index()] == ty) {
            return var;
        }
        self.run_start = self.body.exprs.len() as u32;
        let value = self.fresh(typed);
        let value = self.convert(value, ty, self.span_of(id));
        self.kept(value, ty)
    }

    pub(super) fn text(&mut self, text: &str, span: Span) -> VarId {
        self.run_start = self.body.exprs.len() as u32;
        let number = self.string(text);
        let id = self.push(ExprKind::Const([number, 0, 0]), Ty::String, span).id;
        self.kept(id, Ty::String)
    }

    pub(super) fn number(&mut self, value: f32, ty: Ty, span: Span) -> VarId {
        self.run_start = self.body.exprs.len() as u32;
        let bits = if ty == Ty::Int { value as i32 as u32 } else { value.to_bits() };
        let id = self.push(ExprKind::Const([bits; 3]), ty, span).id;
        self.kept(id, ty)
    }

    pub(super) fn deed(&mut self, task: Task, args: Vec<VarId>, outs: Vec<VarId>, span: Span) {
        self.block.push(Stmt::Do(Box::new(Deed { task, args, outs, span })));
        self.run_start = self.body.exprs.len() as u32;
    }

    /// Does it and reads its result.
    pub(super) fn result(&mut self, task: Task, args: Vec<VarId>, ty: Ty, span: Span) -> Typed {
        if ty == Ty::Void {
            self.deed(task, args, Vec::new(), span);
            self.resume();
            return Typed { ty, ..self.poison() };
        }
        let place = self.allocate(ty);
        let outs = (0..self.parts(ty) as u32).map(|i| VarId(place.base.0 + i)).collect();
        self.deed(task, args, outs, span);
        self.resume();
        self.load(place, ty, span)
    }

    pub(super) fn back(&mut self, var: VarId, ty: Ty, span: Span) -> Typed {
        self.resume();
        self.push(ExprKind::Var(var), ty, span)
    }

    /// Writes what was found to the variable that a call names for it.
    pub(super) fn write_result(&mut self, to: ast::ExprId, from: Place, ty: Ty, span: Span) {
        let Some(target) = self.target(to) else { return };
        self.run_start = self.body.exprs.len() as u32;
        match target.ty.is_aggregate() {
            true => self.copy(target.place, from, ty, span),
            false => self.copy_back(&target, from.base, ty, span),
        }
    }

    fn split(&mut self, given: &Given, types: &[Ty], span: Span) -> Typed {
        self.aside(given);
        let Some((_, length)) = self.elements(types[1]) else { return self.poison() };
        let source = self.value_of(given, 0, Ty::String);
        let separator = if types.len() > 2 { self.value_of(given, 2, Ty::String) } else { self.text("", span) };
        let most = match types.len() {
            4 => self.value_of(given, 3, Ty::Int),
            _ => self.number(length as f32, Ty::Int, span),
        };
        let count = self.temporary(Ty::Int);
        let pieces = self.allocate(types[1]);
        let outs = std::iter::once(count).chain((0..length).map(|i| VarId(pieces.base.0 + i))).collect();
        self.deed(Task::Split, vec![source, separator, most], outs, span);
        self.write_result(given.ids[1], pieces, types[1], span);
        self.back(count, Ty::Int, span)
    }

    /// Operators of matrices.
    pub(super) fn matrix_binary(&mut self, op: ast::BinaryOp, given: &Given, span: Span) -> Option<Typed> {
        use ast::BinaryOp as B;
        let types = (given.typed[0].ty, given.typed[1].ty);
        self.aside(given);
        let inverse = |c: &mut Self, index: usize| {
            let mut parts = Vec::new();
            c.variables(given, index, Ty::Matrix, span, &mut parts);
            let place = c.allocate(Ty::Matrix);
            let outs: Vec<VarId> = (0..16).map(|i| VarId(place.base.0 + i)).collect();
            c.deed(Task::Inverse, parts, outs.clone(), span);
            outs
        };
        let found = match (op, types) {
            (B::Mul | B::Div, (Ty::Matrix, Ty::Matrix)) => {
                let mut args = Vec::new();
                self.variables(given, 0, Ty::Matrix, span, &mut args);
                if op == B::Mul {
                    self.variables(given, 1, Ty::Matrix, span, &mut args);
                } else {
                    args.extend(inverse(self, 1));
                }
                self.result(Task::Multiply, args, Ty::Matrix, span)
            }
            (B::Mul | B::Div, (Ty::Matrix, ty)) if ty.is_scalar() => {
                let mut parts = Vec::new();
                self.variables(given, 0, Ty::Matrix, span, &mut parts);
                let by = self.value_of(given, 1, Ty::Float);
                let op = if op == B::Mul { Op::MulF } else { Op::DivF };
                self.scaled(op, &parts, by, span)
            }
            (B::Mul | B::Div, (ty, Ty::Matrix)) if ty.is_scalar() => {
                let mut parts = Vec::new();
                if op == B::Mul {
                    self.variables(given, 1, Ty::Matrix, span, &mut parts);
                } else {
                    parts = inverse(self, 1);
                }
                let by = self.value_of(given, 0, Ty::Float);
                self.scaled(Op::MulF, &parts, by, span)
            }
            (B::Eq | B::Ne, (Ty::Matrix, Ty::Matrix)) => self.matrices_equal(op == B::Eq, given, span),
            _ => {
                self.resume();
                return None;
            }
        };
        Some(found)
    }

    fn matrices_equal(&mut self, equal: bool, given: &Given, span: Span) -> Typed {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        self.variables(given, 0, Ty::Matrix, span, &mut a);
        self.variables(given, 1, Ty::Matrix, span, &mut b);
        self.resume();
        let mut all: Option<ExprId> = None;
        for (a, b) in a.into_iter().zip(b) {
            let (a, b) = (self.push(ExprKind::Var(a), Ty::Float, span), self.push(ExprKind::Var(b), Ty::Float, span));
            let same = self.op(Op::EqF, &[a.id, b.id], Ty::Int, span).id;
            all = Some(all.map_or(same, |all| self.op(Op::BitAndI, &[all, same], Ty::Int, span).id));
        }
        let all = all.unwrap_or(ExprId(0));
        if equal {
            Typed { id: all, ty: Ty::Int, place: None, temp: None }
        } else {
            self.op(Op::NotI, &[all], Ty::Int, span)
        }
    }

    /// Every part with a number.
    fn scaled(&mut self, op: Op, parts: &[VarId], by: VarId, span: Span) -> Typed {
        let place = self.allocate(Ty::Matrix);
        for (i, part) in parts.iter().enumerate() {
            self.run_start = self.body.exprs.len() as u32;
            let (a, b) =
                (self.push(ExprKind::Var(*part), Ty::Float, span), self.push(ExprKind::Var(by), Ty::Float, span));
            let value = self.op(op, &[a.id, b.id], Ty::Float, span);
            self.assign(VarId(place.base.0 + i as u32), value.id);
        }
        self.resume();
        self.load(place, Ty::Matrix, span)
    }

    /// −m
    pub(super) fn matrix_negated(&mut self, given: &Given, span: Span) -> Typed {
        self.aside(given);
        let mut parts = Vec::new();
        self.variables(given, 0, Ty::Matrix, span, &mut parts);
        let by = self.number(-1.0, Ty::Float, span);
        self.scaled(Op::MulF, &parts, by, span)
    }

    /// `matrix(1)`, `matrix("space", 1)`, `matrix("from", "to")`, sixteen numbers, or those after a space.
    pub(super) fn construct_matrix(&mut self, given: &Given, span: Span) -> Typed {
        let types: Vec<Ty> = given.typed.iter().map(|t| t.ty).collect();
        if let [Ty::Matrix] = types[..] {
            return given.typed[0];
        }
        self.aside(given);
        let named = usize::from(types.first() == Some(&Ty::String));
        let place = self.allocate(Ty::Matrix);
        let outs: Vec<VarId> = (0..16).map(|i| VarId(place.base.0 + i)).collect();
        match &types[named..] {
            [Ty::String] if named == 1 => {
                let (from, to) = (self.value_of(given, 0, Ty::String), self.value_of(given, 1, Ty::String));
                let found = self.temporary(Ty::Int);
                self.deed(Task::Spaces, vec![from, to], std::iter::once(found).chain(outs).collect(), span);
                self.resume();
                return self.load(place, Ty::Matrix, span);
            }
            [one] if one.is_scalar() => {
                let value = self.value_of(given, named, Ty::Float);
                self.diagonal(place, value, span);
            }
            all if all.len() == 16 && all.iter().all(|ty| ty.is_scalar()) => {
                for (i, out) in outs.iter().enumerate() {
                    let value = self.value_of(given, named + i, Ty::Float);
                    self.run_start = self.body.exprs.len() as u32;
                    let id = self.push(ExprKind::Var(value), Ty::Float, span).id;
                    self.assign(*out, id);
                }
            }
            _ => {
                self.resume();
                let d = Diagnostic::error("E0205", span, format!("matrix cannot be made from {} values", types.len()));
                return self.error(d.help("give one number, sixteen, or two names of spaces"));
            }
        }
        if named == 0 {
            self.resume();
            return self.load(place, Ty::Matrix, span);
        }
        // What is said in a space is brought to the common one.
        let (from, to) = (self.value_of(given, 0, Ty::String), self.text("common", span));
        let (found, space) = (self.temporary(Ty::Int), self.allocate(Ty::Matrix));
        let spaces: Vec<VarId> = (0..16).map(|i| VarId(space.base.0 + i)).collect();
        self.deed(Task::Spaces, vec![from, to], std::iter::once(found).chain(spaces.iter().copied()).collect(), span);
        self.result(Task::Multiply, outs.into_iter().chain(spaces).collect(), Ty::Matrix, span)
    }

    /// `point("space", x, y, z)` and its kin.
    pub(super) fn in_space(&mut self, given: &Given, ty: Ty, span: Span) -> Typed {
        self.aside(given);
        let from = self.value_of(given, 0, Ty::String);
        let to = self.text("common", span);
        self.run_start = self.body.exprs.len() as u32;
        let mut parts = [ExprId(0); 3];
        for (i, part) in parts.iter_mut().enumerate() {
            let value = self.fresh(self.of(given.ids[i + 1]));
            *part = self.convert(value, Ty::Float, span);
        }
        let triple = self.op(Op::Triple, &parts, ty, span);
        let value = self.kept(triple.id, ty);
        self.result(Task::Between(kind(ty)), vec![from, to, value], ty, span)
    }
}

pub(super) fn at(var: VarId) -> Place {
    Place { base: var, len: 1, at: At::Known(0) }
}

fn kind(ty: Ty) -> Kind {
    match ty {
        Ty::Point => Kind::Point,
        Ty::Normal => Kind::Normal,
        _ => Kind::Vector,
    }
}
