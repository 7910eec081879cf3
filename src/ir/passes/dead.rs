//! Dead code: assignments whose value nothing reads are dropped.
//!
//! Goes through the statements from the last to the first and keeps, for each variable, whether what it holds is still
//! wanted; at the end only `Ci` is. In a loop a variable stays wanted throughout if it is wanted anywhere. Expressions
//! are left where they are: nothing lowers what no statement uses.

use super::super::body::{Body, ExprKind, Root, Stmt, VarId, each_written};
use super::each_used;
use super::env::Env;

/// The body without statements that change nothing.
pub fn remove(mut body: Body) -> Body {
    let stmts = std::mem::take(&mut body.stmts);
    let mut sweep = Sweep { wanted: Env::new(body.vars.len(), false), used: Vec::new(), body: &body };
    sweep.wanted.set(VarId::CI, true);
    let stmts = sweep.block(stmts);
    body.stmts = stmts;
    body
}

/// Passes over a loop in search of what it needs before it is taken to need everything.
const MAX_PASSES: usize = 40;

struct Sweep<'a> {
    body: &'a Body,
    wanted: Env<bool>,
    used: Vec<bool>,
}

impl Sweep<'_> {
    fn block(&mut self, stmts: Vec<Stmt>) -> Vec<Stmt> {
        let mut kept = Vec::new();
        for stmt in stmts.into_iter().rev() {
            match stmt {
                Stmt::Assign(var, root) => {
                    if self.wanted.get(var) {
                        self.wanted.set(var, false);
                        self.reads(root);
                        kept.push(stmt);
                    }
                }
                Stmt::Store { base, len, index, value } => {
                    if (0..len).any(|i| self.wanted.get(VarId(base.0 + i))) {
                        self.wanted.set(index, true);
                        self.wanted.set(value, true);
                        kept.push(stmt);
                    }
                }
                Stmt::Do(ref deed) => {
                    if deed.task.is_heard() || deed.outs.iter().any(|out| self.wanted.get(*out)) {
                        deed.outs.iter().for_each(|out| self.wanted.set(*out, false));
                        deed.args.iter().for_each(|arg| self.wanted.set(*arg, true));
                        kept.push(stmt);
                    }
                }
                Stmt::Loop { before, condition, body, span } => {
                    let endless =
                        matches!(self.body.expr(condition.root).kind, ExprKind::Const(cells) if cells[0] != 0);
                    if !endless && !self.touches(&before) && !self.touches(&body) {
                        continue;
                    }
                    self.reads(condition);
                    let mut passes = 0;
                    while self.grow(&body, passes > MAX_PASSES) | self.grow(&before, passes > MAX_PASSES) {
                        passes += 1;
                    }
                    let (before, body) = (self.filter(before), self.filter(body));
                    kept.push(Stmt::Loop { before, condition, body, span });
                }
                Stmt::If { condition, then, other } => {
                    let mark = self.wanted.enter();
                    let then = self.block(then);
                    let before_then = self.wanted.leave(mark);
                    let mark = self.wanted.enter();
                    let other = self.block(other);
                    let before_other = self.wanted.leave(mark);
                    self.wanted.join(&before_then, &before_other, |a, b| a || b);
                    if !then.is_empty() || !other.is_empty() {
                        self.reads(condition);
                        kept.push(Stmt::If { condition, then, other });
                    }
                }
            }
        }
        kept.reverse();
        kept
    }

    /// Whether any statement matters to what is wanted now.
    fn touches(&self, stmts: &[Stmt]) -> bool {
        let mut found = false;
        each_written(stmts, &mut |var| found |= self.wanted.get(var));
        found || is_heard(stmts)
    }

    /// Wants what statements need that write what is wanted – or, with `all`, what any of them needs; true if that was
    /// news. Users mostly come after what they use, so the last is looked at first.
    fn grow(&mut self, stmts: &[Stmt], all: bool) -> bool {
        let mut grew = false;
        for stmt in stmts.iter().rev() {
            match stmt {
                Stmt::Assign(var, root) => {
                    if all || self.wanted.get(*var) {
                        grew |= self.reads(*root);
                    }
                }
                Stmt::Store { index, value, .. } => {
                    if self.touches(std::slice::from_ref(stmt)) {
                        grew |= self.want(*index) | self.want(*value);
                    }
                }
                Stmt::Do(deed) => {
                    if self.touches(std::slice::from_ref(stmt)) {
                        for arg in &deed.args {
                            grew |= self.want(*arg);
                        }
                    }
                }
                Stmt::Loop { before: then, condition, body: other, .. } | Stmt::If { condition, then, other } => {
                    if self.touches(then) || self.touches(other) {
                        grew |= self.reads(*condition);
                        grew |= self.grow(other, all) | self.grow(then, all);
                    }
                }
            }
        }
        grew
    }

    /// Statements of a loop without those that matter to nothing wanted.
    fn filter(&self, stmts: Vec<Stmt>) -> Vec<Stmt> {
        let mut kept = Vec::new();
        for stmt in stmts {
            if !self.touches(std::slice::from_ref(&stmt)) {
                continue;
            }
            kept.push(match stmt {
                Stmt::Loop { before, condition, body, span } => {
                    Stmt::Loop { before: self.filter(before), condition, body: self.filter(body), span }
                }
                Stmt::If { condition, then, other } => {
                    Stmt::If { condition, then: self.filter(then), other: self.filter(other) }
                }
                other => other,
            });
        }
        kept
    }

    fn want(&mut self, var: VarId) -> bool {
        let news = !self.wanted.get(var);
        self.wanted.set(var, true);
        news
    }

    /// Wants what a run reads; true if that was news.
    fn reads(&mut self, run: Root) -> bool {
        let (wanted, body) = (&mut self.wanted, self.body);
        let mut news = false;
        let mut want = |var: VarId| {
            news |= !wanted.get(var);
            wanted.set(var, true);
        };
        each_used(body, run, &mut self.used, |_, kind| match kind {
            ExprKind::Var(var) => want(var),
            ExprKind::Element(base, len, _) => (0..len).for_each(|i| want(VarId(base.0 + i))),
            _ => {}
        });
        news
    }
}

/// Whether a statement speaks.
fn is_heard(stmts: &[Stmt]) -> bool {
    stmts.iter().any(|stmt| match stmt {
        Stmt::Do(deed) => deed.task.is_heard(),
        Stmt::Loop { before: a, body: b, .. } | Stmt::If { then: a, other: b, .. } => is_heard(a) || is_heard(b),
        Stmt::Assign(..) | Stmt::Store { .. } => false,
    })
}
