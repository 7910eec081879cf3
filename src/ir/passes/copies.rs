//! Copies: a variable that holds what another holds is read as that other.
//!
//! In: a folded body. Out: an equal one in which such reads go to where the value was first put, so that nothing reads
//! most copies any more and [`dead`](super::dead) drops them. Calls that are written out leave many: their parameters
//! and results.

use super::super::body::{Body, Deed, ExprKind, Root, Stmt, VarId, each_written};
use super::env::{Env, Outcome};
use super::{each_used, indexed};
use std::cell::Cell;

/// The body with reads of copies replaced by reads of what they are copies of.
pub fn read_through(mut body: Body) -> Body {
    let stmts = std::mem::take(&mut body.stmts);
    let env = Env::new(body.vars.len(), Holds { version: 0, copy_of: None });
    let indexed = indexed(&body, &stmts);
    let mut reader = Reader { env, indexed, last: Cell::new(0), used: Vec::new(), body };
    let stmts = reader.block(stmts);
    Body { stmts, ..reader.body }
}

/// What a variable holds.
#[derive(Clone, Copy, PartialEq)]
struct Holds {
    /// Changes with each write.
    version: u32,
    /// The variable this was copied from, and what version that had; it counts as long as it still has it.
    copy_of: Option<(VarId, u32)>,
}

struct Reader {
    body: Body,
    env: Env<Holds>,
    /// Of these nothing is known: one store may write thousands.
    indexed: Vec<bool>,
    last: Cell<u32>,
    used: Vec<bool>,
}

impl Reader {
    fn block(&mut self, stmts: Vec<Stmt>) -> Vec<Stmt> {
        stmts.into_iter().filter_map(|stmt| self.stmt(stmt)).collect()
    }

    /// The statement that takes the place of another, if any has to.
    fn stmt(&mut self, stmt: Stmt) -> Option<Stmt> {
        Some(match stmt {
            Stmt::Assign(var, root) => {
                self.run(root);
                let from = match self.body.expr(root.root).kind {
                    ExprKind::Var(from) => Some(from),
                    _ => None,
                };
                if from == Some(var) {
                    return None;
                }
                self.written(var, from);
                stmt
            }
            Stmt::Store { base, len, index, value } => {
                Stmt::Store { base, len, index: self.source(index), value: self.source(value) }
            }
            Stmt::Do(deed) => {
                let args = deed.args.iter().map(|arg| self.alike(*arg)).collect();
                deed.outs.iter().for_each(|out| self.written(*out, None));
                Stmt::Do(Box::new(Deed { args, ..*deed }))
            }
            Stmt::Loop { before, condition, body, span } => {
                // What a round writes is unknown where a round starts.
                for part in [&before, &body] {
                    each_written(part, &mut |var| self.written(var, None));
                }
                let before = self.block(before);
                self.run(condition);
                let (body, _) = self.way(body);
                Stmt::Loop { before, condition, body, span }
            }
            Stmt::If { condition, then, other } => {
                self.run(condition);
                let (then, after_then) = self.way(then);
                let (other, after_other) = self.way(other);
                let last = &self.last;
                self.env.join(&after_then, &after_other, |a, b| match a == b {
                    true => a,
                    false => Holds { version: next(last), copy_of: a.copy_of.filter(|_| a.copy_of == b.copy_of) },
                });
                Stmt::If { condition, then, other }
            }
        })
    }

    /// One of several ways to go on, and what it leaves.
    fn way(&mut self, stmts: Vec<Stmt>) -> (Vec<Stmt>, Outcome<Holds>) {
        let mark = self.env.enter();
        let stmts = self.block(stmts);
        (stmts, self.env.leave(mark))
    }

    fn run(&mut self, run: Root) {
        let mut reads = Vec::new();
        each_used(&self.body, run, &mut self.used, |id, kind| {
            if let ExprKind::Var(var) = kind {
                reads.push((id, var));
            }
        });
        for (id, var) in reads {
            self.body.exprs[id.index()].kind = ExprKind::Var(self.source(var));
        }
    }

    /// Where the value that `var` holds was first put and still is.
    fn source(&self, var: VarId) -> VarId {
        match self.env.get(var).copy_of {
            Some((from, version)) if self.env.get(from).version == version => from,
            _ => var,
        }
    }

    /// The same for a task, which goes by the types of its variables.
    fn alike(&self, var: VarId) -> VarId {
        let (source, vars) = (self.source(var), &self.body.vars);
        if vars[source.index()] == vars[var.index()] { source } else { var }
    }

    /// A variable is written, with what `from` holds if that is known.
    fn written(&mut self, var: VarId, from: Option<VarId>) {
        if !self.indexed[var.index()] {
            let from = from.filter(|from| !self.indexed[from.index()]);
            let copy_of = from.map(|from| (from, self.env.get(from).version));
            self.env.set(var, Holds { version: next(&self.last), copy_of });
        }
    }
}

/// A version that nothing has yet.
fn next(last: &Cell<u32>) -> u32 {
    last.set(last.get() + 1);
    last.get()
}
