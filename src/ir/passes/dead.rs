//! Dead code: assignments whose value nothing reads are dropped.
//!
//! Goes through the statements from the last to the first and keeps, for each variable, whether what it holds is still
//! wanted; at the end only `Ci` is. Expressions are left where they are: nothing lowers what no statement uses.

use super::super::body::{Body, ExprKind, Root, Stmt, VarId};
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

    fn reads(&mut self, run: Root) {
        let (wanted, body) = (&mut self.wanted, self.body);
        each_used(body, run, &mut self.used, |_, kind| {
            if let ExprKind::Var(var) = kind {
                wanted.set(var, true);
            }
        });
    }
}
