//! Starts: a variable whose first value is known starts with it, as registers do, and need not be given it at every
//! point.
//!
//! In: a body. Out: an equal one without such assignments outside of branches and loops; [`Body::starts`] has them.

use super::super::body::{Body, ExprKind, Root, Stmt, VarId};
use super::each_used;
use std::collections::HashSet;

/// The body with known first values moved to where it starts.
pub fn take(mut body: Body) -> Body {
    let stmts = std::mem::take(&mut body.stmts);
    let mut starts = Vec::new();
    let mut met = Met { body: &body, vars: vec![false; body.vars.len()], ranges: HashSet::new(), used: Vec::new() };
    let mut kept = Vec::with_capacity(stmts.len());
    for stmt in stmts {
        if let Stmt::Assign(var, root) = stmt
            && let ExprKind::Const(cells) = body.expr(root.root).kind
            && !std::mem::replace(&mut met.vars[var.index()], true)
        {
            starts.push((var, cells));
        } else {
            met.stmt(&stmt);
            kept.push(stmt);
        }
    }
    Body { stmts: kept, starts, ..body }
}

/// What has been read or written so far.
struct Met<'a> {
    body: &'a Body,
    vars: Vec<bool>,
    /// Variables reached by an index: the first, and how many.
    ranges: HashSet<(VarId, u32)>,
    used: Vec<bool>,
}

impl Met<'_> {
    fn stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::Assign(var, root) => {
                self.run(*root);
                self.vars[var.index()] = true;
            }
            Stmt::Store { base, len, index, value } => {
                self.range(*base, *len);
                [index, value].into_iter().for_each(|var| self.vars[var.index()] = true);
            }
            Stmt::Do(deed) => deed.args.iter().chain(&deed.outs).for_each(|var| self.vars[var.index()] = true),
            Stmt::Loop { before: a, condition, body: b, .. } | Stmt::If { condition, then: a, other: b } => {
                self.run(*condition);
                a.iter().chain(b).for_each(|stmt| self.stmt(stmt));
            }
        }
    }

    fn run(&mut self, root: Root) {
        let mut used = std::mem::take(&mut self.used);
        each_used(self.body, root, &mut used, |_, kind| match kind {
            ExprKind::Var(var) => self.vars[var.index()] = true,
            ExprKind::Element(base, len, _) => self.range(base, len),
            _ => {}
        });
        self.used = used;
    }

    fn range(&mut self, base: VarId, len: u32) {
        // Thousands of reads may reach the same thousands of variables.
        if self.ranges.insert((base, len)) {
            self.vars[base.index()..][..len as usize].fill(true);
        }
    }
}
