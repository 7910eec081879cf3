//! From the flat expressions of the syntax tree to runs of the body.
//!
//! Expressions come operands first. Where one of them needs statements – a call that is written out, an assignment in
//! the middle – the values that wait for their operator are put aside in variables, the run ends, and a new one goes on.
//! Operands that may not be reached at all (`&&`, `||`, `? :`) and need statements become branches.

use super::super::body::{ExprKind, Op, Root, Stmt, VarId};
use super::super::types::Ty;
use super::place::At;
use super::{Checker, Typed};
use crate::syntax::ast::{self, BinaryOp};
use std::collections::HashMap;

/// What a run of syntax needs besides its expressions.
#[derive(Default)]
struct Plan {
    /// For the target of each assignment or step the value, if any.
    targets: HashMap<u32, Option<u32>>,
    /// Operands that are branches, by their first expression: which operand.
    branches: HashMap<u32, u8>,
    /// Operators whose operands are branches.
    lazy: Vec<u32>,
}

/// A branch that is open.
struct Open {
    condition: VarId,
    outer: Vec<Stmt>,
    /// The first way, done, and its value.
    then: Option<(Vec<Stmt>, Typed)>,
}

impl Checker<'_> {
    /// Checks the expressions of a run in order and returns the last.
    pub(super) fn run(&mut self, run: ast::Root) -> Typed {
        self.run_for(run, None)
    }

    /// The same where the place asks for a type.
    pub(super) fn run_for(&mut self, run: ast::Root, wanted: Option<Ty>) -> Typed {
        let outer = std::mem::take(&mut self.pending);
        let discarded = std::mem::take(&mut self.discards);
        self.run_start = self.body.exprs.len() as u32;
        if let Some(ty) = wanted {
            self.hints.insert(run.root.0, ty);
        }
        let plan = self.plan(run);
        let mut open: Vec<Open> = Vec::new();
        for id in run.first..=run.root.0 {
            if let Some(which) = plan.branches.get(&id) {
                self.begin_branch(*which, &mut open);
            }
            let id = ast::ExprId(id);
            let lazy = plan.lazy.binary_search(&id.0).is_ok();
            let typed =
                if lazy { self.end_branch(id, &mut open) } else { self.expression(id, discarded && id == run.root) };
            self.typed[id.0 as usize] = typed;
            if !lazy {
                let operands = self.operand_count(id);
                self.pending.truncate(self.pending.len().saturating_sub(operands));
            }
            match plan.targets.get(&id.0) {
                Some(value) => self.pin_target(id, *value),
                None => self.pending.push(id),
            }
        }
        self.pending = outer;
        self.typed[run.root.0 as usize]
    }

    /// How many values an expression takes from those that wait; targets of assignments never wait.
    fn operand_count(&self, id: ast::ExprId) -> usize {
        use ast::ExprKind as K;
        match self.ast.expr(id).kind {
            K::Int(_) | K::Float(_) | K::String(_) | K::Name(_) | K::Step(..) => 0,
            K::Unary(..) | K::Cast(..) | K::Field(..) | K::Assign(..) => 1,
            K::Binary(..) | K::Index(..) | K::Comma(..) => 2,
            K::Ternary(..) => 3,
            K::Call(_, _, args) | K::Construct(_, args) | K::List(args) => args.len as usize,
        }
    }

    fn plan(&mut self, run: ast::Root) -> Plan {
        use ast::ExprKind as K;
        let mut plan = Plan::default();
        let (mut lazy, mut effects) = (false, false);
        for id in (run.first..=run.root.0).rev() {
            match self.ast.expr(ast::ExprId(id)).kind {
                K::Assign(_, target, value) => {
                    plan.targets.insert(target.0, Some(value.0));
                    effects = true;
                }
                K::Step(_, target) => {
                    plan.targets.insert(target.0, None);
                    effects = true;
                }
                K::Ternary(..) | K::Binary(BinaryOp::And | BinaryOp::Or, ..) => lazy = true,
                K::Cast(ty, inner) => {
                    if let Some(ty) = Ty::simple(ty) {
                        self.hints.insert(inner.0, ty);
                    }
                }
                K::List(args) => {
                    effects = true;
                    self.hint_elements(id, args);
                }
                K::Call(name, _, args) => {
                    effects |= self.needs_statements(name);
                    self.hint_arguments(name, args);
                }
                K::Construct(..) | K::Binary(..) | K::Unary(..) => effects |= self.has_operators,
                _ => {}
            }
        }
        if lazy && effects {
            self.plan_branches(run, &mut plan);
        }
        plan
    }

    fn plan_branches(&self, run: ast::Root, plan: &mut Plan) {
        use ast::ExprKind as K;
        let mut starts: Vec<u32> = Vec::new();
        let mut effects: Vec<bool> = Vec::new();
        for id in run.first..=run.root.0 {
            let at = |e: ast::ExprId| (e.0 - run.first) as usize;
            let kind = self.ast.expr(ast::ExprId(id)).kind;
            let operands: Vec<ast::ExprId> = match kind {
                K::Unary(_, a) | K::Cast(_, a) | K::Field(a, ..) | K::Step(_, a) => vec![a],
                K::Binary(_, a, b) | K::Index(a, b) | K::Comma(a, b) | K::Assign(_, a, b) => vec![a, b],
                K::Ternary(a, b, c) => vec![a, b, c],
                K::Call(_, _, args) | K::Construct(_, args) | K::List(args) => self.ast.args(args).to_vec(),
                _ => Vec::new(),
            };
            let own = match kind {
                K::Assign(..) | K::Step(..) | K::List(_) => true,
                K::Call(name, ..) => self.needs_statements(name),
                _ => false,
            };
            let start = operands.first().map_or(id, |first| starts[at(*first)]);
            let lazy = match kind {
                K::Ternary(_, a, b) => effects[at(a)] || effects[at(b)],
                K::Binary(BinaryOp::And | BinaryOp::Or, _, b) => effects[at(b)],
                _ => false,
            };
            if lazy {
                plan.lazy.push(id);
                for (which, operand) in operands[1..].iter().enumerate() {
                    plan.branches.insert(starts[at(*operand)], which as u8);
                }
            }
            let any = own || operands.iter().any(|o| effects[at(*o)]);
            starts.push(start);
            effects.push(any);
        }
    }

    fn begin_branch(&mut self, which: u8, open: &mut Vec<Open>) {
        let Some(value) = self.pending.pop() else { return };
        let span = self.span_of(value);
        if which == 1 {
            // The first way is done: its value is put aside, the second begins.
            let typed = self.put_aside(value);
            if let Some(last) = open.last_mut() {
                last.then = Some((std::mem::take(&mut self.block), typed));
            }
            return;
        }
        let truth = self.truth(self.of(value), span);
        let condition = self.temporary(Ty::Int);
        if self.body.expr(truth).ty != Ty::Poison {
            self.keep(condition, truth);
        }
        self.spill();
        open.push(Open { condition, outer: std::mem::take(&mut self.block), then: None });
    }

    /// A value that outlives the run: in a variable, or at its place.
    fn put_aside(&mut self, id: ast::ExprId) -> Typed {
        let typed = self.of(id);
        if typed.ty.is_aggregate() {
            let place = self.allocate(typed.ty);
            if let Some(from) = typed.place {
                let from = self.pinned(from);
                self.copy(place, from, typed.ty, self.span_of(id));
            }
            return Typed { place: Some(place), ..typed };
        }
        if matches!(typed.ty, Ty::Poison | Ty::Void) {
            return typed;
        }
        let var = self.temporary(typed.ty);
        self.assign(var, typed.id);
        Typed { temp: Some(var), ..typed }
    }

    fn end_branch(&mut self, id: ast::ExprId, open: &mut Vec<Open>) -> Typed {
        let span = self.span_of(id);
        let (Some(value), Some(branch)) = (self.pending.pop(), open.pop()) else { return self.poison() };
        let Open { condition, outer, then } = branch;
        let kind = self.ast.expr(id).kind;
        let second = match kind {
            ast::ExprKind::Ternary(..) => self.put_aside(value),
            _ => {
                let truth = self.truth(self.of(value), self.span_of(value));
                let var = self.temporary(Ty::Int);
                let ty = self.body.expr(truth).ty;
                if ty != Ty::Poison {
                    self.assign(var, truth);
                }
                Typed { id: truth, ty, place: None, temp: Some(var) }
            }
        };
        let block = std::mem::replace(&mut self.block, outer);
        let (then, other, first) = match (then, kind) {
            (Some((then, first)), _) => (then, block, Some(first)),
            (None, ast::ExprKind::Binary(BinaryOp::Or, ..)) => (Vec::new(), block, None),
            (None, _) => (block, Vec::new(), None),
        };
        // A variable that only one way writes has a value either way.
        if let Some(var) = second.temp.filter(|_| first.is_none()) {
            self.run_start = self.body.exprs.len() as u32;
            let zero = self.int(0, span);
            self.assign(var, zero.id);
        }
        self.run_start = self.body.exprs.len() as u32;
        let root = self.push(ExprKind::Var(condition), Ty::Int, span);
        self.block.push(Stmt::If { condition: Root { first: root.id.0, root: root.id }, then, other });
        self.resume();
        let condition = self.push(ExprKind::Var(condition), Ty::Int, span).id;
        let again = |checker: &mut Self, typed: Typed| match typed.temp {
            Some(var) if typed.ty != Ty::Poison => checker.push(ExprKind::Var(var), typed.ty, span),
            _ => typed,
        };
        let second = again(self, second);
        match (first, kind) {
            (Some(first), ast::ExprKind::Ternary(_, a, b)) => {
                let first = again(self, first);
                self.choose(condition, (first, self.span_of(a)), (second, self.span_of(b)), span)
            }
            (_, ast::ExprKind::Binary(op, ..)) if second.ty != Ty::Poison => {
                let op = if op == BinaryOp::Or { Op::Or } else { Op::And };
                self.op(op, &[condition, second.id], Ty::Int, span)
            }
            _ => self.poison(),
        }
    }

    /// Ends the run: values that wait are put aside in variables.
    pub(super) fn spill(&mut self) {
        for i in 0..self.pending.len() {
            let id = self.pending[i];
            let mut typed = self.of(id);
            if let Some(place) = typed.place
                && let At::Expr(index) = place.at
            {
                let var = self.temporary(Ty::Int);
                self.keep(var, index);
                typed.place = Some(super::place::Place { at: At::Var(var), ..place });
            }
            let simple = !typed.ty.is_aggregate() && !matches!(typed.ty, Ty::Poison | Ty::Void);
            let known = matches!(self.body.expr(typed.id).kind, ExprKind::Const(_) | ExprKind::Black);
            if simple && typed.temp.is_none() && !known {
                let var = self.temporary(typed.ty);
                self.keep(var, typed.id);
                typed.temp = Some(var);
            }
            self.typed[id.0 as usize] = typed;
        }
        self.run_start = self.body.exprs.len() as u32;
    }

    /// An assignment that leaves the run open.
    pub(super) fn keep(&mut self, var: VarId, value: super::ExprId) {
        self.block.push(Stmt::Assign(var, Root { first: self.run_start, root: value }));
    }

    /// Starts a run in which the values that wait are at hand again.
    pub(super) fn resume(&mut self) {
        self.run_start = self.body.exprs.len() as u32;
        for i in 0..self.pending.len() {
            let id = self.pending[i];
            let again = self.fresh(self.of(id));
            self.typed[id.0 as usize] = again;
        }
    }

    /// A value that was put aside, in the run at hand.
    pub(super) fn fresh(&mut self, typed: Typed) -> Typed {
        if typed.ty.is_aggregate() || matches!(typed.ty, Ty::Poison | Ty::Void) {
            return typed;
        }
        let expr = *self.body.expr(typed.id);
        let kind = match (typed.temp, expr.kind) {
            (Some(var), _) => ExprKind::Var(var),
            (None, ExprKind::Const(_) | ExprKind::Black) => expr.kind,
            // What has been used up already; nothing reads it again.
            (None, _) => ExprKind::Const([0; 3]),
        };
        Typed { id: self.body.push(kind, expr.ty, expr.span), ..typed }
    }
}
