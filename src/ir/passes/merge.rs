//! Merging: what is worked out for one variable and only handed on to another is worked out for that other.
//!
//! In: a body without dead code. Out: an equal one with fewer copies: `t = a + b; x = t;` becomes `x = a + b;` where
//! nothing else reads `t` and nothing meets `x` in between. The same for an `if` both ways of which end with `t`.

use super::super::body::{Body, ExprKind, Root, Stmt, VarId};
use super::{each_used, indexed};

/// The body without such copies.
pub fn merge(mut body: Body) -> Body {
    let stmts = std::mem::take(&mut body.stmts);
    let count = body.vars.len();
    let mut merger = Merger {
        indexed: indexed(&body, &stmts),
        body: &body,
        reads: vec![0; count],
        writes: vec![0; count],
        met: vec![0; count],
        made: vec![None; count],
        now: 0,
        blocks: 0,
        used: Vec::new(),
    };
    merger.count(&stmts);
    let stmts = merger.block(stmts);
    Body { stmts, ..body }
}

/// Where a variable gets all its values.
#[derive(Clone, Copy)]
struct Made {
    /// The block, and the statement in it.
    block: u32,
    place: usize,
    /// When that statement was done with.
    time: u32,
}

struct Merger<'a> {
    body: &'a Body,
    indexed: Vec<bool>,
    /// How often each variable is read, in the text of the program.
    reads: Vec<u32>,
    /// How often it is written.
    writes: Vec<u32>,
    /// When each variable was last read or written.
    met: Vec<u32>,
    made: Vec<Option<Made>>,
    /// Counts statements.
    now: u32,
    blocks: u32,
    used: Vec<bool>,
}

impl Merger<'_> {
    fn count(&mut self, stmts: &[Stmt]) {
        for stmt in stmts {
            match stmt {
                Stmt::Assign(var, root) => {
                    self.writes[var.index()] += 1;
                    self.reads(*root, |merger, var| merger.reads[var.index()] += 1);
                }
                Stmt::Store { index, value, .. } => {
                    [index, value].into_iter().for_each(|var| self.reads[var.index()] += 1);
                }
                Stmt::Do(deed) => {
                    deed.args.iter().for_each(|var| self.reads[var.index()] += 1);
                    deed.outs.iter().for_each(|var| self.writes[var.index()] += 1);
                }
                Stmt::Loop { before: a, condition, body: b, .. } | Stmt::If { condition, then: a, other: b } => {
                    self.reads(*condition, |merger, var| merger.reads[var.index()] += 1);
                    self.count(a);
                    self.count(b);
                }
            }
        }
    }

    fn block(&mut self, stmts: Vec<Stmt>) -> Vec<Stmt> {
        self.blocks += 1;
        let block = self.blocks;
        let mut out: Vec<Stmt> = Vec::with_capacity(stmts.len());
        for stmt in stmts {
            if let Some((to, made)) = self.handed_on(&stmt, block) {
                self.now += 1;
                self.met[to.index()] = self.now;
                redirect(&mut out[made.place], to);
                continue;
            }
            let stmt = self.stmt(stmt);
            if let Some((var, writes)) = ends_with(&stmt)
                && self.writes[var.index()] == writes
            {
                self.made[var.index()] = Some(Made { block, place: out.len(), time: self.now });
            }
            out.push(stmt);
        }
        out
    }

    /// If a statement is a copy that can be done without: to what, and where its value is made.
    fn handed_on(&mut self, stmt: &Stmt, block: u32) -> Option<(VarId, Made)> {
        let Stmt::Assign(to, root) = *stmt else { return None };
        let ExprKind::Var(from) = self.body.expr(root.root).kind else { return None };
        let made = self.made[from.index()].filter(|made| made.block == block)?;
        let free = |var: VarId| !self.indexed[var.index()];
        if from == VarId::CI || self.reads[from.index()] != 1 || !free(from) || !free(to) {
            return None;
        }
        if self.met[to.index()] > made.time {
            return None;
        }
        if self.writes[to.index()] == 1 {
            self.writes[to.index()] = self.writes[from.index()];
            self.made[to.index()] = Some(made);
        }
        Some((to, made))
    }

    /// A statement with its blocks merged; everything it reads or writes is met.
    fn stmt(&mut self, stmt: Stmt) -> Stmt {
        self.now += 1;
        match stmt {
            Stmt::Assign(var, root) => {
                self.meet(root);
                self.met[var.index()] = self.now;
                stmt
            }
            Stmt::Store { index, value, .. } => {
                // What it writes is indexed, and left alone.
                [index, value].into_iter().for_each(|var| self.met[var.index()] = self.now);
                stmt
            }
            Stmt::Do(ref deed) => {
                deed.args.iter().chain(&deed.outs).for_each(|var| self.met[var.index()] = self.now);
                stmt
            }
            Stmt::Loop { before, condition, body, span } => {
                let before = self.block(before);
                self.now += 1;
                self.meet(condition);
                Stmt::Loop { before, condition, body: self.block(body), span }
            }
            Stmt::If { condition, then, other } => {
                self.meet(condition);
                Stmt::If { condition, then: self.block(then), other: self.block(other) }
            }
        }
    }

    fn meet(&mut self, root: Root) {
        self.reads(root, |merger, var| merger.met[var.index()] = merger.now);
    }

    /// Calls `see` for each variable that a run reads by name.
    fn reads(&mut self, root: Root, see: impl Fn(&mut Self, VarId)) {
        let mut used = std::mem::take(&mut self.used);
        each_used(self.body, root, &mut used, |_, kind| {
            if let ExprKind::Var(var) = kind {
                see(self, var);
            }
        });
        self.used = used;
    }
}

/// The variable that every way through a statement assigns last of all, and how many assignments that are.
fn ends_with(stmt: &Stmt) -> Option<(VarId, u32)> {
    match stmt {
        Stmt::Assign(var, _) => Some((*var, 1)),
        Stmt::If { then, other, .. } => {
            let (a, b) = (ends_with(then.last()?)?, ends_with(other.last()?)?);
            (a.0 == b.0).then_some((a.0, a.1 + b.1))
        }
        Stmt::Store { .. } | Stmt::Do(_) | Stmt::Loop { .. } => None,
    }
}

/// Lets those assignments go to another variable.
fn redirect(stmt: &mut Stmt, to: VarId) {
    match stmt {
        Stmt::Assign(var, _) => *var = to,
        Stmt::If { then, other, .. } => {
            [then, other].into_iter().filter_map(|way| way.last_mut()).for_each(|last| redirect(last, to));
        }
        Stmt::Store { .. } | Stmt::Do(_) | Stmt::Loop { .. } => {}
    }
}
