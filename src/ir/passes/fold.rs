//! Constant folding: what is known before shading is computed once.
//!
//! In: a body and the values of some variables. Out: an equal body in which known expressions are constants, variables
//! that hold a known value or a global are replaced by it, branches that are decided are taken, and closures that a
//! weight of zero makes black are gone. The folder walks statements in order and remembers what each variable holds;
//! after a branch it remembers what both ways agree on.

use super::super::body::{
    Args, Body, Cells, Deed, Expr, ExprId, ExprKind, GlobalVar, Op, Root, Stmt, VarId, each_written,
};
use super::super::builtins::{BUILTINS, MAX_ARGS};
use super::super::host::Answers;
use super::super::ops;
use super::super::tasks::{Strings, Surroundings, Task};
use super::super::types::Ty;
use super::env::Env;
use crate::globals::Globals;
use crate::span::Span;

/// Folds a body. `known` holds, by variable, the values of parameters that are set; `answers`: what a host will
/// answer while shading.
pub fn fold(body: &Body, known: &[Option<Cells>], answers: Answers) -> Body {
    let mut folder = Folder::new(body, known);
    folder.answers = answers;
    let stmts = folder.block(&body.stmts);
    folder.new.stmts = stmts;
    folder.new
}

/// Folds a body without using the initial values of the variables in `open`: what is left reads them at every point.
pub fn fold_open(body: &Body, open: &[VarId], answers: Answers) -> Body {
    let mut folder = Folder::new(body, &[]);
    folder.answers = answers;
    folder.open = open.to_vec();
    let stmts = folder.block(&body.stmts);
    folder.new.stmts = stmts;
    folder.new
}

/// The value of one expression that stands alone, if it is constant.
pub fn constant(body: &Body, root: Root) -> Option<Cells> {
    let mut folder = Folder::new(body, &[]);
    let root = folder.run(root);
    match folder.new.expr(root.root).kind {
        ExprKind::Const(cells) => Some(cells),
        _ => None,
    }
}

/// What is known of each variable after the first `count` statements.
pub fn values_after(body: &Body, count: usize) -> Vec<Option<Cells>> {
    let mut folder = Folder::new(body, &[]);
    folder.block(body.stmts.get(..count).unwrap_or(&body.stmts));
    let value = |known: &Option<Known>| match known {
        Some(Known::Const(cells)) => Some(*cells),
        _ => None,
    };
    folder.env.all().iter().map(value).collect()
}

/// What a variable is known to hold.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    Const(Cells),
    Global(GlobalVar),
    Black,
}

struct Folder<'a> {
    old: &'a Body,
    new: Body,
    /// Parameters that are set, until their initialisation has been replaced.
    fixed: Vec<Option<Cells>>,
    /// Parameters whose initial value is not to be used.
    open: Vec<VarId>,
    env: Env<Option<Known>>,
    answers: Answers,
    /// Expressions that may still be looked at for the sake of unrolling.
    unrolling: usize,
    /// The new expression of each old one of the run at hand, from `origin` on.
    map: Vec<ExprId>,
    origin: usize,
}

impl<'a> Folder<'a> {
    fn new(old: &'a Body, fixed: &[Option<Cells>]) -> Self {
        let new = Body { vars: old.vars.clone(), strings: old.strings.clone(), ..Body::default() };
        let mut env = Env::new(old.vars.len(), None);
        env.set(VarId::CI, Some(Known::Black));
        Folder {
            old,
            new,
            fixed: fixed.to_vec(),
            open: Vec::new(),
            env,
            answers: Answers::default(),
            unrolling: MAX_UNROLLING,
            map: Vec::new(),
            origin: 0,
        }
    }

    fn block(&mut self, stmts: &[Stmt]) -> Vec<Stmt> {
        let mut out = Vec::new();
        self.block_into(stmts, &mut out);
        out
    }

    fn block_into(&mut self, stmts: &[Stmt], out: &mut Vec<Stmt>) {
        for stmt in stmts {
            match stmt {
                Stmt::Assign(var, root) => {
                    let fixed = self.fixed.get_mut(var.index()).and_then(Option::take);
                    let root = match fixed {
                        Some(cells) => self.fixed_value(*root, cells),
                        None => self.run(*root),
                    };
                    let known = match self.new.expr(root.root).kind {
                        ExprKind::Const(cells) => Some(Known::Const(cells)),
                        ExprKind::Global(g) => Some(Known::Global(g)),
                        ExprKind::Black => Some(Known::Black),
                        _ => None,
                    };
                    let open = self.open.iter().position(|v| v == var).map(|at| self.open.swap_remove(at));
                    self.env.set(*var, if open.is_some() { None } else { known });
                    out.push(Stmt::Assign(*var, root));
                }
                Stmt::Store { base, len, index, value } => self.store(stmt, *base, *len, *index, *value, out),
                Stmt::Do(deed) => self.deed(deed, out),
                Stmt::Loop { before, condition, body, span } => {
                    if !self.unrolled(before, *condition, body, out) {
                        let (before, condition, body) = self.repeated(before, *condition, body);
                        out.push(Stmt::Loop { before, condition, body, span: *span });
                    }
                }
                Stmt::If { condition, then, other } => {
                    let condition = self.run(*condition);
                    match self.new.expr(condition.root).kind {
                        ExprKind::Const(cells) => self.block_into(if cells[0] != 0 { then } else { other }, out),
                        _ => out.push(self.branch(condition, then, other)),
                    }
                }
            }
        }
    }

    fn store(&mut self, stmt: &Stmt, base: VarId, len: u32, index: VarId, value: VarId, out: &mut Vec<Stmt>) {
        if let Some(Known::Const(cells)) = self.env.get(index) {
            let at = (cells[0] as i32).clamp(0, len as i32 - 1) as u32;
            let known = self.env.get(value);
            let root = self.read(value, known);
            self.env.set(VarId(base.0 + at), known);
            return out.push(Stmt::Assign(VarId(base.0 + at), root));
        }
        (0..len).for_each(|i| self.env.set(VarId(base.0 + i), None));
        out.push(stmt.clone());
    }

    /// A run that reads one variable.
    fn read(&mut self, var: VarId, known: Option<Known>) -> Root {
        let kind = match known {
            Some(Known::Const(cells)) => ExprKind::Const(cells),
            Some(Known::Global(g)) => ExprKind::Global(g),
            Some(Known::Black) => ExprKind::Black,
            None => ExprKind::Var(var),
        };
        let root = self.new.push(kind, self.new.vars[var.index()], Span::default());
        Root { first: root.0, root }
    }

    fn deed(&mut self, deed: &Deed, out: &mut Vec<Stmt>) {
        if deed.task.is_heard() && !deed.task.asks(self.answers) {
            return;
        }
        let asked = deed.task.asks(self.answers);
        if let (Task::Between(_), false) = (deed.task, asked) {
            // Without a host every space is the same.
            let known = self.env.get(deed.args[2]);
            let root = self.read(deed.args[2], known);
            self.env.set(deed.outs[0], known);
            return out.push(Stmt::Assign(deed.outs[0], root));
        }
        let known: Option<Vec<(Ty, Cells)>> = deed
            .args
            .iter()
            .map(|arg| match self.env.get(*arg) {
                Some(Known::Const(cells)) => Some((self.new.vars[arg.index()], cells)),
                _ => None,
            })
            .collect();
        let known = known.filter(|_| !asked);
        let Some(args) = known else {
            deed.outs.iter().for_each(|var| self.env.set(*var, None));
            return out.push(Stmt::Do(Box::new(deed.clone())));
        };
        let mut results: Vec<(Ty, Cells)> = deed.outs.iter().map(|var| (self.new.vars[var.index()], [0; 3])).collect();
        let known_strings = std::mem::take(&mut self.new.strings);
        let mut strings = Strings::new(&known_strings);
        match deed.task {
            // All that is known is constant.
            Task::IsConstant => results[0].1 = [1, 0, 0],
            task => {
                let globals = Globals::default();
                task.run(
                    &args,
                    &mut Surroundings { strings: &mut strings, host: None, globals: &globals },
                    &mut results,
                );
            }
        }
        let made = strings.into_made();
        self.new.strings = known_strings;
        self.new.strings.extend(made);
        for (var, (ty, cells)) in deed.outs.iter().zip(results) {
            let root = self.new.push(ExprKind::Const(cells), ty, deed.span);
            self.env.set(*var, Some(Known::Const(cells)));
            out.push(Stmt::Assign(*var, Root { first: root.0, root }));
        }
    }

    /// Writes out the rounds of a loop whose number is known; false, and nothing done, if it is not known or too large.
    fn unrolled(&mut self, before: &[Stmt], condition: Root, body: &[Stmt], out: &mut Vec<Stmt>) -> bool {
        if self.unrolling == 0 {
            // Trying costs as much as doing, and loops nest.
            return false;
        }
        let (mark, length) = (self.env.enter(), out.len());
        let (exprs, args) = (self.new.exprs.len(), self.new.args.len());
        for _ in 0..MAX_ROUNDS {
            self.block_into(before, out);
            let condition = self.run(condition);
            match self.new.expr(condition.root).kind {
                ExprKind::Const(cells) if cells[0] == 0 => return true,
                ExprKind::Const(_) => self.block_into(body, out),
                _ => break,
            }
            if self.unrolling == 0 || self.new.exprs.len() - exprs > MAX_UNROLLED {
                break;
            }
        }
        self.env.leave(mark);
        out.truncate(length);
        self.new.exprs.truncate(exprs);
        self.new.args.truncate(args);
        false
    }

    /// A loop with any number of rounds: what it writes is unknown at the start of each.
    fn repeated(&mut self, before: &[Stmt], condition: Root, body: &[Stmt]) -> (Vec<Stmt>, Root, Vec<Stmt>) {
        for part in [before, body] {
            each_written(part, &mut |var| self.env.set(var, None));
        }
        let before = self.block(before);
        let condition = self.run(condition);
        let mark = self.env.enter();
        let body = self.block(body);
        self.env.leave(mark);
        (before, condition, body)
    }

    /// A parameter that is set has that value in place of its default.
    fn fixed_value(&mut self, old: Root, cells: Cells) -> Root {
        let Expr { ty, span, .. } = *self.old.expr(old.root);
        let root = self.new.push(ExprKind::Const(cells), ty, span);
        Root { first: root.0, root }
    }

    fn branch(&mut self, condition: Root, then: &[Stmt], other: &[Stmt]) -> Stmt {
        let mark = self.env.enter();
        let then = self.block(then);
        let after_then = self.env.leave(mark);
        let mark = self.env.enter();
        let other = self.block(other);
        let after_other = self.env.leave(mark);
        self.env.join(&after_then, &after_other, |a, b| if a == b { a } else { None });
        Stmt::If { condition, then, other }
    }

    fn run(&mut self, run: Root) -> Root {
        let first = self.new.exprs.len() as u32;
        self.unrolling = self.unrolling.saturating_sub((run.root.0 - run.first.min(run.root.0)) as usize + 1);
        self.origin = run.first as usize;
        self.map.clear();
        for id in run.first..=run.root.0 {
            let new = self.expr(ExprId(id));
            self.map.push(new);
        }
        Root { first, root: self.of(run.root) }
    }

    fn of(&self, old: ExprId) -> ExprId {
        self.map[old.index() - self.origin]
    }

    fn expr(&mut self, id: ExprId) -> ExprId {
        let Expr { kind, ty, span } = *self.old.expr(id);
        let kind = match kind {
            ExprKind::Const(_) | ExprKind::Black | ExprKind::Global(_) => kind,
            ExprKind::Var(var) => match self.env.get(var) {
                Some(Known::Const(cells)) => ExprKind::Const(cells),
                Some(Known::Global(g)) => ExprKind::Global(g),
                Some(Known::Black) => ExprKind::Black,
                None => kind,
            },
            ExprKind::Op(op, ids) => {
                let mut new = [ExprId(0); 3];
                for (new, old) in new.iter_mut().zip(&ids[..op.arity()]) {
                    *new = self.of(*old);
                }
                match self.op(op, new, ty) {
                    Folded::Same(id) => return id,
                    Folded::Kind(kind) => kind,
                }
            }
            ExprKind::Call(index, args) => self.call(index, args, ty),
            ExprKind::OptionIndex(options, name) => {
                let name = self.of(name);
                let known = self.value(name).and_then(|cells| self.option(options, cells));
                known.map_or(ExprKind::OptionIndex(options, name), |i| ExprKind::Const([(i as f32).to_bits(), 0, 0]))
            }
            ExprKind::Lobe(kind, args) => ExprKind::Lobe(kind, self.args(args)),
            ExprKind::Element(base, len, index) => {
                let index = self.of(index);
                match self.value(index) {
                    Some(cells) => {
                        let var = VarId(base.0 + (cells[0] as i32).clamp(0, len as i32 - 1) as u32);
                        match self.env.get(var) {
                            Some(Known::Const(cells)) => ExprKind::Const(cells),
                            Some(Known::Global(g)) => ExprKind::Global(g),
                            Some(Known::Black) => ExprKind::Black,
                            None => ExprKind::Var(var),
                        }
                    }
                    None => ExprKind::Element(base, len, index),
                }
            }
        };
        self.new.push(kind, ty, span)
    }

    fn option(&self, options: &[&str], name: Cells) -> Option<usize> {
        let name = self.new.strings.get(name[0] as usize)?;
        options.iter().position(|option| option == name)
    }

    fn value(&self, id: ExprId) -> Option<Cells> {
        match self.new.expr(id).kind {
            ExprKind::Const(cells) => Some(cells),
            _ => None,
        }
    }

    fn args(&mut self, args: Args) -> Args {
        let ids: Vec<ExprId> = self.old.args(args).iter().map(|id| self.of(*id)).collect();
        self.new.push_args(ids)
    }

    fn call(&mut self, index: u16, args: Args, ty: Ty) -> ExprKind {
        let old = self.old.args(args);
        let mut values = [[0; 3]; MAX_ARGS];
        let known = old.iter().zip(&mut values).all(|(id, value)| match self.value(self.of(*id)) {
            Some(cells) => {
                *value = cells;
                true
            }
            None => false,
        });
        if known {
            return ExprKind::Const(BUILTINS[index as usize].apply(ty.cells(), &values[..old.len()]));
        }
        ExprKind::Call(index, self.args(args))
    }

    fn op(&mut self, op: Op, ids: [ExprId; 3], ty: Ty) -> Folded {
        let black = |id: ExprId| matches!(self.new.expr(id).kind, ExprKind::Black);
        let value = |id: ExprId| self.value(id);
        match op {
            Op::AddC if black(ids[0]) => return Folded::Same(ids[1]),
            Op::AddC if black(ids[1]) => return Folded::Same(ids[0]),
            Op::Layer if black(ids[0]) => return Folded::Same(ids[1]),
            Op::Layer if black(ids[1]) => return Folded::Same(ids[0]),
            Op::MulC if black(ids[1]) => return Folded::Kind(ExprKind::Black),
            Op::MulC => {
                let weight = value(ids[0]).map(|cells| cells.map(f32::from_bits));
                // Weights are limited to what is not negative when the tree is built, and NaN is zero.
                if weight.is_some_and(|w| w.iter().all(|w| w.is_nan() || *w <= 0.0)) {
                    return Folded::Kind(ExprKind::Black);
                }
                if weight == Some([1.0; 3]) {
                    return Folded::Same(ids[1]);
                }
            }
            Op::Select => match value(ids[0]) {
                Some(cells) => return Folded::Same(if cells[0] != 0 { ids[1] } else { ids[2] }),
                None if black(ids[1]) && black(ids[2]) => return Folded::Same(ids[1]),
                None => {}
            },
            // Comparisons give 0 or 1 already.
            Op::TruthI if matches!(self.new.expr(ids[0]).kind, ExprKind::Op(op, _) if op.is_truth()) => {
                return Folded::Same(ids[0]);
            }
            Op::And if value(ids[0]).is_some_and(|a| a[0] == 0) => return Folded::Kind(ExprKind::Const([0; 3])),
            Op::Or if value(ids[0]).is_some_and(|a| a[0] != 0) => return Folded::Kind(ExprKind::Const([1, 0, 0])),
            _ => {}
        }
        if ty == Ty::Closure {
            return Folded::Kind(ExprKind::Op(op, ids));
        }
        let mut values = [[0; 3]; 3];
        for (cells, id) in values.iter_mut().zip(&ids[..op.arity()]) {
            match value(*id) {
                Some(known) => *cells = known,
                None => return Folded::Kind(ExprKind::Op(op, ids)),
            }
        }
        let n = self.new.expr(ids[0]).ty.cells();
        Folded::Kind(ExprKind::Const(ops::apply(op, n, values[0], values[1], values[2])))
    }
}

/// Rounds of a loop that are written out, at most.
const MAX_ROUNDS: usize = 256;
/// Expressions that one loop may come to when written out.
const MAX_UNROLLED: usize = 1 << 13;
/// Expressions looked at with a view to writing out loops, in one program.
const MAX_UNROLLING: usize = 1 << 18;

enum Folded {
    /// An expression that is there already.
    Same(ExprId),
    Kind(ExprKind),
}
