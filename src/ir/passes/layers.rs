//! Which lobes a script may lay over which.

use super::super::body::{Body, ExprId, ExprKind, Op, Root, Stmt};
use super::super::types::Ty;
use super::each_used;
use super::env::Env;
use std::cell::RefCell;
use std::collections::{BTreeSet, HashSet};

/// Values looked at in search of pairs, at most: every layer looks through its whole base.
const BUDGET: usize = 1 << 16;

/// What a closure value is made of; values by their number.
#[derive(Clone, Copy)]
enum Value {
    Black,
    Lobe(ExprId),
    Weighted(usize),
    Sum(usize, usize),
    /// What either of two ways leaves.
    Either(usize, usize),
    Layer(usize, usize),
}

/// The closure values of a body.
pub struct Layers {
    values: Vec<Value>,
    /// Top and base of each layer.
    layers: Vec<(usize, usize)>,
}

/// Follows the closures of a body from statement to statement.
pub fn layers(body: &Body) -> Layers {
    let mut trace = Trace {
        body,
        values: RefCell::new(vec![Value::Black]),
        layers: vec![],
        of_expr: vec![0; body.exprs.len()],
        vars: Env::new(body.vars.len(), 0),
        scratch: vec![],
    };
    trace.block(&body.stmts);
    Layers { values: trace.values.into_inner(), layers: trace.layers }
}

struct Trace<'a> {
    body: &'a Body,
    values: RefCell<Vec<Value>>,
    layers: Vec<(usize, usize)>,
    of_expr: Vec<usize>,
    /// The value of each closure variable.
    vars: Env<usize>,
    scratch: Vec<bool>,
}

impl Trace<'_> {
    fn block(&mut self, stmts: &[Stmt]) {
        for stmt in stmts {
            match stmt {
                Stmt::Assign(var, root) => {
                    if self.body.vars[var.index()] == Ty::Closure {
                        self.run(*root);
                        self.vars.set(*var, self.of_expr[root.root.index()]);
                    }
                }
                Stmt::If { then, other, .. } => {
                    let [then, other] = [then, other].map(|way| {
                        let mark = self.vars.enter();
                        self.block(way);
                        self.vars.leave(mark)
                    });
                    let values = &self.values;
                    let join = |a, b| if a == b { a } else { push(values, Value::Either(a, b)) };
                    self.vars.join(&then, &other, join);
                }
            }
        }
    }

    fn run(&mut self, root: Root) {
        let mut used = Vec::new();
        each_used(self.body, root, &mut self.scratch, |id, kind| used.push((id, kind)));
        // Operands first.
        for (id, kind) in used.into_iter().rev() {
            if self.body.expr(id).ty == Ty::Closure {
                self.of_expr[id.index()] = self.value(id, kind);
            }
        }
    }

    fn value(&mut self, id: ExprId, kind: ExprKind) -> usize {
        let at = |id: ExprId| self.of_expr[id.index()];
        let value = match kind {
            ExprKind::Var(var) => return self.vars.get(var),
            ExprKind::Lobe(..) => Value::Lobe(id),
            ExprKind::Op(Op::MulC, [_, c, _]) => Value::Weighted(at(c)),
            ExprKind::Op(Op::AddC, [a, b, _]) => Value::Sum(at(a), at(b)),
            ExprKind::Op(Op::Select, [_, a, b]) => Value::Either(at(a), at(b)),
            ExprKind::Op(Op::Layer, [top, base, _]) => {
                self.layers.push((at(top), at(base)));
                Value::Layer(at(top), at(base))
            }
            _ => return 0,
        };
        push(&self.values, value)
    }
}

fn push(values: &RefCell<Vec<Value>>, value: Value) -> usize {
    let mut values = values.borrow_mut();
    values.push(value);
    values.len() - 1
}

impl Layers {
    /// Every lobe that may stand in the top of a layer.
    pub fn tops(&self) -> Vec<ExprId> {
        let tops: Vec<usize> = self.layers.iter().map(|l| l.0).collect();
        self.reach(&tops, &mut usize::MAX.clone(), |value| match value {
            Value::Black | Value::Lobe(_) => [0; 2],
            Value::Weighted(c) => [c, 0],
            Value::Sum(a, b) | Value::Either(a, b) | Value::Layer(a, b) => [a, b],
        })
    }

    /// Every pair (top, base) of lobes such that one may be a whole top, and the other lie below it and below no other
    /// layer. May name pairs that never come about. A pair is missing where it rests on a term that happens to be
    /// black, or in scripts of very many layers.
    pub fn pairs(&self) -> Vec<(ExprId, ExprId)> {
        let mut budget = BUDGET;
        let mut pairs = BTreeSet::new();
        for (top, base) in &self.layers {
            let tops = self.reach(&[*top], &mut budget, |value| match value {
                Value::Weighted(c) => [c, 0],
                Value::Either(a, b) => [a, b],
                _ => [0; 2],
            });
            let bases = self.reach(&[*base], &mut budget, |value| match value {
                Value::Weighted(c) => [c, 0],
                Value::Sum(a, b) | Value::Either(a, b) => [a, b],
                Value::Layer(top, _) => [top, 0],
                _ => [0; 2],
            });
            pairs.extend(tops.iter().flat_map(|t| bases.iter().map(|b| (t.0, b.0))));
            if budget == 0 {
                break;
            }
        }
        pairs.into_iter().map(|(t, b)| (ExprId(t), ExprId(b))).collect()
    }

    /// The lobes among the values reachable from `from`, going on as `follow` says; 0 leads nowhere.
    fn reach(&self, from: &[usize], budget: &mut usize, follow: impl Fn(Value) -> [usize; 2]) -> Vec<ExprId> {
        let mut seen: HashSet<usize> = from.iter().copied().collect();
        let mut waiting: Vec<usize> = seen.iter().copied().collect();
        let mut lobes = BTreeSet::new();
        while let Some(at) = waiting.pop() {
            *budget = budget.saturating_sub(1);
            if *budget == 0 {
                break;
            }
            if let Value::Lobe(id) = self.values[at] {
                lobes.insert(id.0);
            }
            waiting.extend(follow(self.values[at]).into_iter().filter(|v| *v != 0 && seen.insert(*v)));
        }
        lobes.into_iter().map(ExprId).collect()
    }
}
