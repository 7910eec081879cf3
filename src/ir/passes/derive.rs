//! Derivatives: `Dx` and its kin become expressions of how fast the globals change from pixel to pixel.
//!
//! Forward differentiation of the program. Each variable that depends on a global which changes gets two shadows, what
//! it changes by one pixel to the right and one pixel down, assigned wherever the variable is; a shadow that nothing
//! reads is dead code and goes with it. The rules of arithmetic are exact; noise and a few rare functions are
//! differentiated by a central difference along the direction in question. What a branch decides does not change with
//! the pixel, as in OSL, and second derivatives are zero.

mod rules;

use super::super::body::{Args, Body, Deed, ExprId, ExprKind, GlobalVar, Op, Root, Stmt, VarId};
use super::super::builtins::{BUILTINS, Eval, Slope};
use super::super::functions::matrix::Kind;
use super::super::tasks::Task;
use super::super::types::Ty;
use crate::span::Span;

/// The direction of a derivative: 0 to the right, 1 down.
type Axis = usize;

/// The body without derivatives to take, and how many variables it had: the shadows of variable `v` are `v` plus once
/// and twice that. `None` in its place if nothing asks for derivatives. Unless the host gives them (`given`) all are
/// zero.
pub fn derive(body: Body, given: bool) -> (Body, Option<u32>) {
    let asked = body.exprs.iter().any(|expr| slope(expr.kind).is_some()) || given && has_texture(&body.stmts);
    if !asked {
        return (body, None);
    }
    let n = body.vars.len();
    let vars = [&body.vars[..]; 3].concat();
    let new = Body { vars, strings: body.strings.clone(), ..Body::default() };
    let active = if given { active(&body) } else { vec![false; n] };
    let mut derive = Derive { old: &body, new, active, given, map: Vec::new(), origin: 0 };
    let stmts = derive.block(&body.stmts);
    (Body { stmts, ..derive.new }, Some(n as u32))
}

fn slope(kind: ExprKind) -> Option<Slope> {
    match kind {
        ExprKind::Call(index, _) => match BUILTINS[index as usize].eval {
            Eval::Derivative(slope) => Some(slope),
            _ => None,
        },
        _ => None,
    }
}

fn has_texture(stmts: &[Stmt]) -> bool {
    stmts.iter().any(|stmt| match stmt {
        Stmt::Do(deed) => deed.task == Task::Texture,
        Stmt::Loop { before: a, body: b, .. } | Stmt::If { then: a, other: b, .. } => has_texture(a) || has_texture(b),
        Stmt::Assign(..) | Stmt::Store { .. } => false,
    })
}

/// The global that tells how another changes.
fn change(global: GlobalVar, axis: Axis) -> Option<GlobalVar> {
    use GlobalVar as G;
    let pair = match global {
        G::P => [G::DPdx, G::DPdy],
        G::I => [G::DIdx, G::DIdy],
        G::U => [G::Dudx, G::Dudy],
        G::V => [G::Dvdx, G::Dvdy],
        _ => return None,
    };
    Some(pair[axis])
}

/// Which argument of a task its first result depends on smoothly, and how it changes with it.
fn linear(task: Task) -> Option<(usize, Task)> {
    // Places change as directions do.
    let turned = |kind| if kind == Kind::Point { Kind::Vector } else { kind };
    match task {
        Task::Between(kind) => Some((2, Task::Between(turned(kind)))),
        Task::Transform(kind) => Some((16, Task::Transform(turned(kind)))),
        _ => None,
    }
}

/// Passes over the program in search of what changes before every number is taken to.
const MAX_PASSES: usize = 40;

/// The variables that may change from pixel to pixel.
fn active(body: &Body) -> Vec<bool> {
    let mut active = vec![false; body.vars.len()];
    for _ in 0..MAX_PASSES {
        if !spread(body, &body.stmts, &mut active) {
            return active;
        }
    }
    body.vars.iter().map(|ty| *ty == Ty::Float || ty.is_triple()).collect()
}

/// Marks what statements make change; true if that was news.
fn spread(body: &Body, stmts: &[Stmt], active: &mut [bool]) -> bool {
    let mut news = false;
    let mark = |var: VarId, active: &mut [bool]| !std::mem::replace(&mut active[var.index()], true);
    for stmt in stmts {
        match stmt {
            Stmt::Assign(var, root) => {
                let ty = body.vars[var.index()];
                if (ty == Ty::Float || ty.is_triple()) && changes(body, *root, active) {
                    news |= mark(*var, active);
                }
            }
            Stmt::Store { base, len, value, .. } => {
                if active[value.index()] {
                    (0..*len).for_each(|i| news |= mark(VarId(base.0 + i), active));
                }
            }
            Stmt::Do(deed) => {
                if linear(deed.task).is_some_and(|(arg, _)| active[deed.args[arg].index()]) {
                    news |= mark(deed.outs[0], active);
                }
            }
            Stmt::Loop { before: a, body: b, .. } | Stmt::If { then: a, other: b, .. } => {
                news |= spread(body, a, active) | spread(body, b, active);
            }
        }
    }
    news
}

fn changes(body: &Body, root: Root, active: &[bool]) -> bool {
    let mut found = false;
    super::each_used(body, root, &mut Vec::new(), |_, kind| {
        found |= match kind {
            ExprKind::Var(var) => active[var.index()],
            ExprKind::Element(base, len, _) => (0..len).any(|i| active[base.index() + i as usize]),
            ExprKind::Global(global) => change(global, 0).is_some(),
            _ => false,
        }
    });
    found
}

struct Derive<'a> {
    old: &'a Body,
    new: Body,
    active: Vec<bool>,
    given: bool,
    /// Of each expression of the run at hand, from `origin` on: what it is now, and how it changes along each axis.
    map: Vec<(ExprId, [Option<ExprId>; 2])>,
    origin: usize,
}

impl Derive<'_> {
    fn shadow(&self, var: VarId, axis: Axis) -> VarId {
        VarId(var.0 + (axis as u32 + 1) * self.old.vars.len() as u32)
    }

    fn is_active(&self, var: VarId, len: u32) -> bool {
        (0..len).any(|i| self.active[var.index() + i as usize])
    }

    fn block(&mut self, stmts: &[Stmt]) -> Vec<Stmt> {
        let mut out = Vec::new();
        for stmt in stmts {
            match stmt {
                Stmt::Assign(var, root) => self.assign(*var, *root, &mut out),
                Stmt::Store { base, len, index, value } => {
                    for axis in 0..2 {
                        if self.is_active(*base, *len) {
                            let (base, value) = (self.shadow(*base, axis), self.shadow(*value, axis));
                            out.push(Stmt::Store { base, len: *len, index: *index, value });
                        }
                    }
                    out.push(stmt.clone());
                }
                Stmt::Do(deed) => self.deed(deed, &mut out),
                Stmt::Loop { before, condition, body, span } => {
                    let before = self.block(before);
                    let condition = self.run(*condition, None);
                    let body = self.block(body);
                    out.push(Stmt::Loop { before, condition, body, span: *span });
                }
                Stmt::If { condition, then, other } => {
                    let condition = self.run(*condition, None);
                    let (then, other) = (self.block(then), self.block(other));
                    out.push(Stmt::If { condition, then, other });
                }
            }
        }
        out
    }

    fn assign(&mut self, var: VarId, root: Root, out: &mut Vec<Stmt>) {
        let value = self.run(root, None);
        if !self.active[var.index()] {
            return out.push(Stmt::Assign(var, value));
        }
        // The value may read the shadows, and they the variable: all three are worked out before any is written.
        let ty = self.old.vars[var.index()];
        let targets = [var, self.shadow(var, 0), self.shadow(var, 1)];
        let values = [value, self.run(root, Some(0)), self.run(root, Some(1))];
        let mut written = Vec::new();
        for (target, value) in targets.into_iter().zip(values) {
            let aside = VarId(self.new.vars.len() as u32);
            self.new.vars.push(ty);
            out.push(Stmt::Assign(aside, value));
            let read = self.new.push(ExprKind::Var(aside), ty, Span::default());
            written.push(Stmt::Assign(target, Root { first: read.0, root: read }));
        }
        out.extend(written);
    }

    fn deed(&mut self, deed: &Deed, out: &mut Vec<Stmt>) {
        let mut after = Vec::new();
        for axis in 0..2 {
            for (k, var) in deed.outs.iter().enumerate().filter(|(_, var)| self.active[var.index()]) {
                let shadow = self.shadow(*var, axis);
                match linear(deed.task) {
                    Some((arg, task)) if k == 0 => {
                        let mut args = deed.args.clone();
                        args[arg] = self.shadow(args[arg], axis);
                        out.push(Stmt::Do(Box::new(Deed { task, args, outs: vec![shadow], span: deed.span })));
                    }
                    _ => {
                        let zero = self.new.push(ExprKind::Const([0; 3]), self.old.vars[var.index()], deed.span);
                        after.push(Stmt::Assign(shadow, Root { first: zero.0, root: zero }));
                    }
                }
            }
        }
        let mut deed = deed.clone();
        if self.given && deed.task == Task::Texture && deed.args.len() == Task::TEXTURE_ARGS {
            // How far the pixel reaches in the picture.
            let (s, t) = (deed.args[1], deed.args[2]);
            deed.args.extend((0..2).flat_map(|axis| [self.shadow(s, axis), self.shadow(t, axis)]));
        }
        out.push(Stmt::Do(Box::new(deed)));
        out.extend(after);
    }

    /// The value of a run, or how it changes along an axis.
    fn run(&mut self, run: Root, axis: Option<Axis>) -> Root {
        let first = self.new.exprs.len() as u32;
        let ids = run.first.min(run.root.0)..=run.root.0;
        let asks = self.given && ids.clone().any(|id| slope(self.old.exprs[id as usize].kind).is_some());
        self.origin = *ids.start() as usize;
        self.map.clear();
        for id in ids {
            let last = id == run.root.0;
            let new = self.expr(ExprId(id));
            let tangents = [0, 1].map(|a| {
                let wanted = self.given && if last { axis == Some(a) } else { asks || axis == Some(a) };
                if wanted { self.tangent(ExprId(id), new, a) } else { None }
            });
            self.map.push((new, tangents));
        }
        let (value, tangents) = self.map[run.root.index() - self.origin];
        let root = match axis {
            None => value,
            Some(a) => {
                let ty = self.old.expr(run.root).ty;
                tangents[a].unwrap_or_else(|| self.new.push(ExprKind::Const([0; 3]), ty, Span::default()))
            }
        };
        Root { first, root }
    }

    fn of(&self, old: ExprId) -> ExprId {
        self.map[old.index() - self.origin].0
    }

    fn tangent_of(&self, old: ExprId, axis: Axis) -> Option<ExprId> {
        self.map[old.index() - self.origin].1[axis]
    }

    /// An expression as it was, but for derivatives.
    fn expr(&mut self, id: ExprId) -> ExprId {
        let expr = *self.old.expr(id);
        let kind = match expr.kind {
            ExprKind::Op(op, ids) => {
                let mut new = [ExprId(0); 3];
                for (new, old) in new.iter_mut().zip(&ids[..op.arity()]) {
                    *new = self.of(*old);
                }
                ExprKind::Op(op, new)
            }
            ExprKind::Call(_, args) if slope(expr.kind).is_some() => return self.slope(expr.kind, args, expr.ty),
            ExprKind::Call(index, args) => ExprKind::Call(index, self.args(args)),
            ExprKind::Lobe(kind, args) => ExprKind::Lobe(kind, self.args(args)),
            ExprKind::OptionIndex(options, name) => ExprKind::OptionIndex(options, self.of(name)),
            ExprKind::Element(base, len, index) => ExprKind::Element(base, len, self.of(index)),
            ExprKind::Const(_) | ExprKind::Black | ExprKind::Var(_) | ExprKind::Global(_) => expr.kind,
        };
        self.new.push(kind, expr.ty, expr.span)
    }

    fn args(&mut self, args: Args) -> Args {
        let ids: Vec<ExprId> = self.old.args(args).iter().map(|id| self.of(*id)).collect();
        self.new.push_args(ids)
    }

    /// How an expression changes along an axis; `None`: not at all. `value` is what it is.
    fn tangent(&mut self, id: ExprId, value: ExprId, axis: Axis) -> Option<ExprId> {
        let expr = *self.old.expr(id);
        let kind = match expr.kind {
            ExprKind::Global(global) => ExprKind::Global(change(global, axis)?),
            ExprKind::Var(var) if self.active[var.index()] => ExprKind::Var(self.shadow(var, axis)),
            ExprKind::Element(base, len, index) if self.is_active(base, len) => {
                ExprKind::Element(self.shadow(base, axis), len, self.of(index))
            }
            ExprKind::Op(op, ids) => return self.of_operation(op, ids, value, axis),
            ExprKind::Call(index, args) => return self.of_call(index, args, value, axis),
            _ => return None,
        };
        Some(self.new.push(kind, expr.ty, expr.span))
    }

    /// What a derivative is worked out from.
    fn slope(&mut self, kind: ExprKind, args: Args, ty: Ty) -> ExprId {
        let arg = |k: usize| self.old.args(args)[k.min(args.len as usize - 1)];
        let zero = |d: &mut Self| d.new.push(ExprKind::Const([0; 3]), ty, Span::default());
        let first = arg(0);
        match slope(kind) {
            Some(Slope::Along(axis)) => self.tangent_of(first, axis).unwrap_or_else(|| zero(self)),
            Some(Slope::Width) => self.width(first, ty).unwrap_or_else(|| zero(self)),
            Some(slope @ (Slope::Area | Slope::Normal)) => {
                let (Some(x), Some(y)) = (self.tangent_of(first, 0), self.tangent_of(first, 1)) else {
                    return zero(self);
                };
                let across = self.call("cross", "vvv", &[x, y], Ty::Vector);
                if slope == Slope::Area { self.call("length", "fv", &[across], Ty::Float) } else { across }
            }
            Some(Slope::Step) | None => {
                let (edge, x) = (arg(0), arg(1));
                let of_edge = self.width(edge, ty).unwrap_or_else(|| zero(self));
                let of_x = match args.len {
                    3 => self.of(arg(2)),
                    _ => self.width(x, ty).unwrap_or_else(|| zero(self)),
                };
                let args = [self.of(edge), self.of(x), of_edge, of_x];
                self.call("aastep", "fffff", &args, Ty::Float)
            }
        }
    }

    /// sqrt(Dx² + Dy²), component by component.
    fn width(&mut self, arg: ExprId, ty: Ty) -> Option<ExprId> {
        let squares = [0, 1].map(|axis| {
            let d = self.tangent_of(arg, axis)?;
            Some(self.op(Op::MulF, &[d, d], ty))
        });
        let sum = self.sum(squares[0], squares[1], ty)?;
        Some(self.call("sqrt", "gg", &[sum], ty))
    }
}
