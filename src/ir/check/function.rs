//! Functions of the script: which one is meant, and writing it out where it is called.
//!
//! A call becomes the body of the function over variables of its own. Arguments go by reference, as in OSL: what an
//! `output` parameter is given is what the body writes. A body is looked at only where it is called, so that a library
//! of functions nobody calls costs nothing.

use super::super::body::{ExprId, VarId};
use super::super::types::Ty;
use super::assign::Target;
use super::call::Given;
use super::place::{At, Place};
use super::statement::Scope;
use super::{Access, Binding, Checker, Typed};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::{self, BinaryOp, Function, Length, Sym, UnaryOp};

/// The function being written out, or the shader.
pub(super) struct Frame {
    pub ty: Ty,
    /// Where the result goes.
    pub result: Option<Place>,
    /// 1 until it returns.
    pub live: VarId,
    pub loops: Vec<Scope>,
}

/// How deep calls and the blocks around them may nest.
const MAX_NESTING: usize = 300;

impl<'a> Checker<'a> {
    /// Sorts the functions by name.
    pub(super) fn functions(&mut self) {
        for (i, function) in self.ast.functions.iter().enumerate() {
            self.functions.entry(function.name).or_default().push(i as u32);
            self.has_operators |= self.ast.name(function.name).starts_with("__operator__");
        }
    }

    /// Whether a call of `name` needs statements of its own.
    pub(super) fn needs_statements(&self, name: Sym) -> bool {
        self.functions.contains_key(&name)
            || self.struct_names.contains_key(&name)
            || super::task::is_task(self.ast.name(name))
    }

    /// Types of list arguments, where only one function or struct can be meant.
    pub(super) fn hint_arguments(&mut self, name: Sym, args: ast::Args) {
        let ids = self.ast.args(args).to_vec();
        if !ids.iter().any(|id| matches!(self.ast.expr(*id).kind, ast::ExprKind::List(_))) {
            return;
        }
        let types: Vec<Ty> = match (self.struct_names.get(&name), self.functions.get(&name).map(Vec::as_slice)) {
            (Some(number), _) => self.layouts[usize::from(*number)].fields.iter().map(|(_, ty)| *ty).collect(),
            (None, Some([one])) => {
                let params = &self.ast.functions[*one as usize].params;
                let lengths = ids.iter().map(|id| self.list_length(*id)).collect::<Vec<_>>();
                let known = params.iter().zip(lengths).map(|(p, n)| self.parameter_type(p, n));
                known.collect::<Vec<Option<Ty>>>().into_iter().map(|ty| ty.unwrap_or(Ty::Poison)).collect()
            }
            _ => return,
        };
        for (id, ty) in ids.into_iter().zip(types) {
            self.hints.insert(id.0, ty);
        }
    }

    /// The type of a parameter; `None` if there is no such type. `given`: the length `[]` takes.
    fn parameter_type(&mut self, param: &ast::Param, given: Option<u32>) -> Option<Ty> {
        if let ast::TypeName::Named(sym) = param.ty
            && !self.struct_names.contains_key(&sym)
        {
            return None;
        }
        match param.length {
            Length::Open => {
                let element = self.named_type(param.ty, param.span);
                Some(self.array_of(element, given))
            }
            length => Some(self.array_type(param.ty, length, given, param.span)),
        }
    }

    /// How well a function fits the arguments: conversions first, then the result. `None`: not at all.
    fn fit(&mut self, function: &'a Function, given: &Given, wanted: Option<Ty>) -> Option<(u32, Vec<Ty>)> {
        if function.body.is_none() || function.params.len() != given.typed.len() {
            return None;
        }
        let mut cost = 0;
        let mut types = Vec::new();
        for (i, (param, arg)) in function.params.iter().zip(&given.typed).enumerate() {
            let length = match arg.ty {
                Ty::Array(number) => self.arrays[usize::from(number)].1,
                _ => None,
            };
            let ty = self.parameter_type(param, length)?;
            let distance = match (arg.ty, ty) {
                (Ty::Poison, _) => 0,
                (a, b) if a == b => 0,
                (Ty::Int | Ty::Float, Ty::Matrix) if !param.output => 8,
                (a, b) if param.output => a.distance(b).filter(|d| *d <= 1)?,
                _ => self.distance(given, i, ty)?,
            };
            cost += distance * 4;
            types.push(ty);
        }
        let result = self.result_type(function)?;
        if let Some(wanted) = wanted {
            cost += if result == wanted { 0 } else { result.distance(wanted).map_or(3, |_| 1) };
        }
        Some((cost, types))
    }

    fn result_type(&mut self, function: &Function) -> Option<Ty> {
        match function.ty {
            ast::TypeName::Named(sym) => self.struct_names.get(&sym).map(|n| Ty::Struct(*n)),
            name => Ty::simple(name),
        }
    }

    /// The function of the script that fits a call best, with what that costs.
    pub(super) fn function(&mut self, name: Sym, given: &Given, wanted: Option<Ty>) -> Option<(u32, u32, Vec<Ty>)> {
        let candidates = self.functions.get(&name)?.clone();
        let mut best: Option<(u32, u32, Vec<Ty>)> = None;
        for index in candidates {
            let function: &'a Function = &self.ast.functions[index as usize];
            if let Some((cost, types)) = self.fit(function, given, wanted)
                && best.as_ref().is_none_or(|(least, ..)| cost < *least)
            {
                best = Some((cost, index, types));
            }
        }
        best
    }

    /// Writes a function out.
    pub(super) fn inline(&mut self, index: u32, types: &[Ty], given: &Given, span: Span) -> Typed {
        let function: &'a Function = &self.ast.functions[index as usize];
        if given.typed.iter().any(|arg| arg.ty == Ty::Poison) {
            return self.poison();
        }
        if let Some(d) = self.refusal(index, function, span) {
            return self.error(d);
        }
        let ty = self.result_type(function).unwrap_or(Ty::Poison);
        self.keep_given(given);
        let Some((bindings, back)) = self.arguments(function, types, given) else {
            self.resume();
            return self.poison();
        };
        let result = (ty != Ty::Void).then(|| self.allocate(ty));
        if let Some(place) = result {
            self.clear(place, ty, span);
        }
        let live = self.temporary(Ty::Int);
        self.set(live, 1);
        let pending = std::mem::take(&mut self.pending);
        let names = std::mem::take(&mut self.names);
        let shadowed = std::mem::take(&mut self.shadowed);
        let frame = std::mem::replace(&mut self.frame, Frame { ty, result, live, loops: Vec::new() });
        self.stack.push(index);
        let mark = self.open_scope();
        for (name, binding) in bindings {
            let depth = self.depth;
            self.bind(name, Binding { depth, ..binding });
        }
        if let Some(body) = &function.body {
            // The parameters are a scope of their own.
            let mark = self.open_scope();
            self.list(body);
            self.close_scope(mark);
        }
        self.close_scope(mark);
        self.stack.pop();
        self.frame = frame;
        self.shadowed = shadowed;
        self.names = names;
        self.pending = pending;
        for (target, var, ty) in back {
            self.run_start = self.body.exprs.len() as u32;
            self.copy_back(&target, var, ty, span);
        }
        self.resume();
        match result {
            Some(place) => self.load(place, ty, span),
            None => Typed { ty: Ty::Void, ..self.poison() },
        }
    }

    /// Why a call cannot be written out.
    fn refusal(&mut self, index: u32, function: &Function, span: Span) -> Option<Diagnostic> {
        let name = self.ast.name(function.name);
        if self.stack.contains(&index) {
            let d = Diagnostic::error("E0210", span, format!("`{name}` calls itself"));
            let d = d.label(function.span, "declared here");
            return Some(d.help("functions are written out where they are called; use a loop"));
        }
        self.calls += 1;
        let (calls, expressions) = (self.limits.calls, self.limits.expressions);
        let what = if self.calls > calls {
            format!("the script comes to more than {calls} calls; raise `Limits::calls`")
        } else if self.body.exprs.len() > expressions {
            format!("the script comes to more than {expressions} expressions; raise `Limits::expressions`")
        } else if self.depth > MAX_NESTING {
            format!("calls and blocks nest deeper than {MAX_NESTING}")
        } else {
            return None;
        };
        if self.over_budget {
            // Said once.
            return Some(Diagnostic::error("E0212", span, ""));
        }
        self.over_budget = true;
        let (message, help) = what.split_once("; ").unwrap_or((&what, "use fewer calls"));
        Some(Diagnostic::error("E0212", span, message).help(help))
    }

    /// Puts aside the arguments of a call and what waits besides. Those of operators are put aside like those of calls.
    fn keep_given(&mut self, given: &Given) {
        let missing: Vec<ast::ExprId> = given.ids.iter().copied().filter(|id| !self.pending.contains(id)).collect();
        let length = self.pending.len();
        self.pending.extend(missing);
        for (id, typed) in given.ids.iter().zip(&given.typed) {
            // An operator may be given another value than the expression stands for, as in `a += b`.
            self.typed[id.0 as usize] = *typed;
        }
        self.spill();
        self.pending.truncate(length);
    }

    /// What the parameters stand for, and what is to be copied back.
    #[allow(clippy::type_complexity)]
    fn arguments(
        &mut self,
        function: &'a Function,
        types: &[Ty],
        given: &Given,
    ) -> Option<(Vec<(Sym, Binding)>, Vec<(Target, VarId, Ty)>)> {
        let (mut bindings, mut back) = (Vec::new(), Vec::new());
        for ((param, ty), id) in function.params.iter().zip(types).zip(&given.ids) {
            let (ty, typed) = (*ty, self.of(*id));
            let at = self.span_of(*id);
            let access = if param.output { Access::Free } else { Access::ReadOnly };
            let place = if param.output {
                let target = self.target(*id)?;
                let direct = target.component.is_none() && (target.ty == ty || target.ty.is_aggregate());
                match (direct, target.place.at) {
                    (true, At::Known(_)) => target.place,
                    (true, _) if ty.is_aggregate() => target.place,
                    _ => {
                        self.run_start = self.body.exprs.len() as u32;
                        let now = self.current(&target, at);
                        let var = self.kept(now.id, ty);
                        back.push((target, var, ty));
                        Place { base: var, len: 1, at: At::Known(0) }
                    }
                }
            } else if ty.is_aggregate() {
                match typed.place {
                    Some(place) if typed.ty.is_aggregate() => place,
                    _ => {
                        let place = self.allocate(ty);
                        self.run_start = self.body.exprs.len() as u32;
                        let value = self.fresh(typed);
                        self.give(place, ty, value, at, *id);
                        place
                    }
                }
            } else {
                let var = match typed.temp {
                    Some(var) if self.body.vars[var.index()] == ty => var,
                    _ => {
                        self.run_start = self.body.exprs.len() as u32;
                        let value = self.fresh(typed);
                        let id: ExprId = self.convert(value, ty, at);
                        self.kept(id, ty)
                    }
                };
                Place { base: var, len: 1, at: At::Known(0) }
            };
            bindings.push((param.name, Binding { access, span: param.span, depth: 0, ty, place }));
        }
        Some((bindings, back))
    }

    pub(super) fn copy_back(&mut self, target: &Target, var: VarId, ty: Ty, span: Span) {
        use super::super::body::{ExprKind, Op};
        let mut new = self.push(ExprKind::Var(var), ty, span).id;
        if let Some(at) = target.component {
            let whole = self.load(target.place, target.ty, span);
            let index = self.index_value(at, span);
            new = self.op(Op::Insert, &[whole.id, index, new], target.ty, span).id;
        }
        self.store_at(target.place, target.ty, new, span);
    }

    /// A call of a struct: its fields in order.
    pub(super) fn make_struct(&mut self, number: u16, given: &Given, span: Span) -> Typed {
        let fields: Vec<Ty> = self.layouts[usize::from(number)].fields.iter().map(|(_, ty)| *ty).collect();
        if let ([one], false) = (&given.typed[..], fields.len() == 1)
            && one.ty == Ty::Struct(number)
        {
            return *one;
        }
        if fields.len() != given.typed.len() {
            let name = self.words(Ty::Struct(number));
            let message = format!("`{name}` has {} fields, not {}", fields.len(), given.typed.len());
            return self.error(Diagnostic::error("E0205", span, message));
        }
        self.keep_given(given);
        let place = self.allocate(Ty::Struct(number));
        for (i, id) in given.ids.iter().enumerate() {
            let (field, ty) = self.field_of(number, place, i);
            self.run_start = self.body.exprs.len() as u32;
            let value = self.fresh(self.of(*id));
            self.give_alone(field, ty, value, *id);
        }
        self.resume();
        Typed { id: ExprId(0), ty: Ty::Struct(number), place: Some(place), temp: None }
    }

    /// Gives a place a value while nothing waits that has not been put aside.
    pub(super) fn give_alone(&mut self, place: Place, ty: Ty, value: Typed, from: ast::ExprId) {
        let pending = std::mem::take(&mut self.pending);
        self.give(place, ty, value, self.span_of(from), from);
        self.pending = pending;
    }

    /// Types for the elements of a list whose own type is known.
    pub(super) fn hint_elements(&mut self, id: u32, args: ast::Args) {
        let Some(ty) = self.hints.get(&id).copied() else { return };
        let ids = self.ast.args(args).to_vec();
        let fields: Vec<Ty> = match ty {
            Ty::Struct(number) => self.layouts[usize::from(number)].fields.iter().map(|(_, ty)| *ty).collect(),
            Ty::Array(number) => vec![self.arrays[usize::from(number)].0; ids.len()],
            _ => return,
        };
        for (id, ty) in ids.into_iter().zip(fields) {
            self.hints.insert(id.0, ty);
        }
    }

    /// `{ a, b }` as the type its place asks for.
    pub(super) fn list_value(&mut self, id: ast::ExprId, args: ast::Args, span: Span) -> Typed {
        let ids = self.ast.args(args).to_vec();
        let typed = ids.iter().map(|id| self.of(*id)).collect();
        let given = Given { ids, typed };
        match self.hints.get(&id.0).copied() {
            Some(Ty::Struct(number)) => self.make_struct(number, &given, span),
            Some(ty @ Ty::Array(_)) => {
                let (element, count) = self.elements(ty).unwrap_or((Ty::Poison, 0));
                if given.ids.len() as u32 > count {
                    let message = format!("{} values for {}", given.ids.len(), self.words(ty));
                    return self.error(Diagnostic::error("E0205", span, message));
                }
                self.keep_given(&given);
                let place = self.allocate(ty);
                self.clear(place, ty, span);
                for (i, id) in given.ids.iter().enumerate() {
                    let to = self.element_of(place, count, At::Known(i as u32), span);
                    self.run_start = self.body.exprs.len() as u32;
                    let value = self.fresh(self.of(*id));
                    self.give_alone(to, element, value, *id);
                }
                self.resume();
                Typed { id: ExprId(0), ty, place: Some(place), temp: None }
            }
            Some(ty) if ty != Ty::Poison && !ty.is_aggregate() => self.construct_simple(ty, &given, span),
            Some(Ty::Matrix) => self.construct_matrix(&given, span),
            Some(_) => self.poison(),
            None => {
                let d = Diagnostic::error("E0203", span, "nothing here says what these values make");
                self.error(d.help("name the type: `float a[2] = { 1, 2 };`, or call the struct"))
            }
        }
    }

    /// An operator that the script defines for its structs.
    pub(super) fn overloaded(&mut self, name: &str, ids: &[ast::ExprId], typed: &[Typed], span: Span) -> Option<Typed> {
        if !self.has_operators || !typed.iter().any(|t| matches!(t.ty, Ty::Struct(_))) {
            return None;
        }
        let sym = self.ast.find(name)?;
        let given = Given { ids: ids.to_vec(), typed: typed.to_vec() };
        let (_, index, types) = self.function(sym, &given, None)?;
        Some(self.inline(index, &types, &given, span))
    }
}

/// What the function for an operator between operands is called.
pub(super) fn binary_name(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "__operator__add__",
        BinaryOp::Sub => "__operator__sub__",
        BinaryOp::Mul => "__operator__mul__",
        BinaryOp::Div => "__operator__div__",
        BinaryOp::Rem => "__operator__mod__",
        BinaryOp::BitAnd => "__operator__bitand__",
        BinaryOp::BitOr => "__operator__bitor__",
        BinaryOp::BitXor => "__operator__xor__",
        BinaryOp::Shl => "__operator__shl__",
        BinaryOp::Shr => "__operator__shr__",
        BinaryOp::Eq => "__operator__eq__",
        BinaryOp::Ne => "__operator__ne__",
        BinaryOp::Lt => "__operator__lt__",
        BinaryOp::Le => "__operator__le__",
        BinaryOp::Gt => "__operator__gt__",
        BinaryOp::Ge => "__operator__ge__",
        BinaryOp::And => "__operator__and__",
        BinaryOp::Or => "__operator__or__",
    }
}

/// The same for one in front.
pub(super) fn unary_name(op: UnaryOp) -> &'static str {
    match op {
        UnaryOp::Neg => "__operator__neg__",
        UnaryOp::Plus => "__operator__pos__",
        UnaryOp::Not => "__operator__not__",
        UnaryOp::BitNot => "__operator__compl__",
    }
}
