//! From a typed body to a [`Graph`]: statements are gone through once, both ways of a branch that is not decided are
//! taken, and what they leave in a variable becomes a choice.
//!
//! A new kind of statement needs an arm in [`Tracer::block`]; a new kind of expression one in [`Tracer::expr`].

mod statements;

use super::graph::{Cid, Closure, Graph, Id, LeafKind, Node, Order};
use super::interval::Interval;
use crate::ir::Answers;
use crate::ir::Ty;
use crate::ir::body::{Args, Body, Cells, ExprId, ExprKind, GlobalVar, Op, Root, Stmt, VarId};
use crate::ir::builtins::BUILTINS;
use crate::lobes::registry::option_index;
use statements::MAX_OPEN_ROUNDS;
use std::collections::HashMap;

/// What a parameter is traced with.
#[derive(Clone, Debug)]
pub enum Binding {
    /// Its default.
    Default,
    /// A value.
    Fixed(Cells),
    /// Each channel free within a range; the index of the parameter.
    Free(usize, Vec<Interval>),
}

/// A value other than a closure, or a closure.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Held {
    Cells([Id; 3]),
    Closure(Cid),
}

/// Globals that may be anything are taken up to here: beyond, single precision does not tell neighbours apart.
pub const ENDLESS: f64 = 1e9;
/// More steps than this are not taken: branches multiply.
const MAX_STEPS: usize = 2_000_000;

/// Traces a body. `bindings` by variable; `ranges` limits globals. `None`: too large.
/// `answers`: about what a host may say anything.
pub fn trace(
    body: &Body,
    answers: Answers,
    bindings: HashMap<VarId, Binding>,
    ranges: &[(GlobalVar, Interval)],
) -> Option<(Graph, Cid)> {
    let mut graph = Graph::new();
    let zero = graph.push(Node::Int(0));
    let cells = |ty: &Ty| if *ty == Ty::Closure { Held::Closure(Cid(0)) } else { Held::Cells([zero; 3]) };
    let env = body.vars.iter().map(cells).collect();
    let mut tracer = Tracer { body, answers, graph, bindings, ranges, env, steps: 0, opaque: 0 };
    tracer.block(&body.stmts)?;
    let root = match tracer.env[VarId::CI.index()] {
        Held::Closure(root) => root,
        Held::Cells(_) => Cid(0),
    };
    Some((tracer.graph, root))
}

struct Tracer<'a> {
    body: &'a Body,
    answers: Answers,
    graph: Graph,
    bindings: HashMap<VarId, Binding>,
    ranges: &'a [(GlobalVar, Interval)],
    env: Vec<Held>,
    steps: usize,
    opaque: u32,
}

impl Tracer<'_> {
    fn block(&mut self, stmts: &[Stmt]) -> Option<()> {
        for stmt in stmts {
            match stmt {
                Stmt::Assign(var, root) => {
                    let value = self.bound(*var).or_else(|| self.run(*root))?;
                    self.env[var.index()] = value;
                }
                Stmt::Store { base, len, index, value } => self.store(*base, *len, *index, *value)?,
                Stmt::Do(deed) => self.deed(deed),
                Stmt::Loop { before, condition, body, .. } => self.rounds(before, *condition, body, MAX_OPEN_ROUNDS)?,
                Stmt::If { condition, then, other } => {
                    let Held::Cells([condition, ..]) = self.run(*condition)? else { return None };
                    match self.graph.value(condition) {
                        Some(x) => self.block(if x != 0.0 { then } else { other })?,
                        None => self.branch(condition, then, other)?,
                    }
                }
            }
        }
        Some(())
    }

    /// The first assignment to a parameter is its default; a binding takes its place.
    fn bound(&mut self, var: VarId) -> Option<Held> {
        let ty = self.body.vars[var.index()];
        match self.bindings.remove(&var)? {
            Binding::Default => None,
            Binding::Fixed(cells) => Some(self.constant(cells, ty)),
            Binding::Free(param, ranges) => {
                let whole = ty == Ty::Int;
                let mut ids = [Id(0); 3];
                for (channel, id) in ids.iter_mut().enumerate().take(ty.cells()) {
                    *id = self.graph.leaf(LeafKind::Param(param, channel), ranges[channel], whole);
                }
                Some(Held::Cells(ids))
            }
        }
    }

    fn branch(&mut self, condition: Id, then: &[Stmt], other: &[Stmt]) -> Option<()> {
        self.steps += 2 * self.env.len();
        if self.steps > MAX_STEPS {
            return None;
        }
        let before = self.env.clone();
        let assumed = self.assume(condition, true);
        self.block(then)?;
        self.unassume(assumed);
        let after = std::mem::replace(&mut self.env, before);
        let assumed = self.assume(condition, false);
        self.block(other)?;
        self.unassume(assumed);
        for (var, then) in after.into_iter().enumerate() {
            let other = self.env[var];
            if then != other {
                self.env[var] = self.choice(condition, then, other);
            }
        }
        Some(())
    }

    fn choice(&mut self, condition: Id, a: Held, b: Held) -> Held {
        match (a, b) {
            (Held::Cells(a), Held::Cells(b)) => {
                Held::Cells(std::array::from_fn(|k| self.graph.push(Node::Select(condition, a[k], b[k]))))
            }
            (Held::Closure(a), Held::Closure(b)) if a != b => {
                Held::Closure(self.graph.closure(Closure::Select(condition, a, b), self.graph.here))
            }
            (a, _) => a,
        }
    }

    fn run(&mut self, run: Root) -> Option<Held> {
        self.steps += (run.root.0 - run.first.min(run.root.0)) as usize + 1;
        if self.steps > MAX_STEPS {
            return None;
        }
        let mut values: Vec<Held> = Vec::new();
        for id in run.first..=run.root.0 {
            let value = self.expr(ExprId(id), &|e: ExprId| values[(e.0 - run.first) as usize]);
            values.push(value);
        }
        values.pop()
    }

    fn constant(&mut self, cells: Cells, ty: Ty) -> Held {
        let whole = matches!(ty, Ty::Int | Ty::String);
        let node = |bits: u32| if whole { Node::Int(bits as i32) } else { Node::Float(bits) };
        Held::Cells(cells.map(|bits| self.graph.push(node(bits))))
    }

    fn expr(&mut self, id: ExprId, of: &impl Fn(ExprId) -> Held) -> Held {
        let expr = *self.body.expr(id);
        self.graph.here = expr.span;
        let cells = |e: ExprId| match of(e) {
            Held::Cells(ids) => ids,
            Held::Closure(_) => [Id(0); 3],
        };
        match expr.kind {
            ExprKind::Const(bits) => self.constant(bits, expr.ty),
            ExprKind::Black => Held::Closure(Cid(0)),
            ExprKind::Var(var) => self.env[var.index()],
            ExprKind::Element(base, len, index) => self.element(base, len, cells(index)[0]),
            ExprKind::Global(global) => Held::Cells(self.global(global)),
            ExprKind::Op(op, ids) => match op {
                Op::AddC | Op::MulC | Op::Layer => self.closure(op, of(ids[0]), of(ids[1])),
                Op::Select => self.choice(cells(ids[0])[0], of(ids[1]), of(ids[2])),
                _ => {
                    let n = self.body.expr(ids[0]).ty.cells();
                    let mut operands = [[Id(0); 3]; 3];
                    for (operand, id) in operands.iter_mut().zip(&ids[..op.arity()]) {
                        *operand = cells(*id);
                    }
                    Held::Cells(self.op(op, n, operands))
                }
            },
            ExprKind::Call(index, args) => Held::Cells(self.call(index, args, expr.ty, &cells)),
            ExprKind::OptionIndex(options, name) => Held::Cells(self.option(options, cells(name)[0])),
            ExprKind::Lobe(kind, args) => {
                let mut slots = Vec::new();
                for arg in self.body.args(args) {
                    slots.extend(&cells(*arg)[..self.body.expr(*arg).ty.cells()]);
                }
                let tint = kind.tint_slot().and_then(|at| slots.get(at..at + 3)).map(|t| [t[0], t[1], t[2]]);
                let tint = tint.map(|t| t.map(|id| self.fraction(id)));
                Held::Closure(self.graph.closure(Closure::Lobe(kind, slots, tint), expr.span))
            }
        }
    }

    /// Limited to 0..=1, as lobes read colors.
    fn fraction(&mut self, id: Id) -> Id {
        let (zero, one) = (self.graph.float(0.0), self.graph.float(1.0));
        let above = self.graph.push(Node::Max(id, zero));
        self.graph.push(Node::Min(above, one))
    }

    fn closure(&mut self, op: Op, a: Held, b: Held) -> Held {
        let span = self.graph.here;
        let black = |c: Cid, graph: &Graph| matches!(graph.closure_at(c), Closure::Zero);
        let made = match (op, a, b) {
            (Op::MulC, Held::Cells(weight), Held::Closure(c)) => {
                let weight = weight.map(|w| self.graph.push(Node::Weight(w)));
                let values = weight.map(|w| self.graph.value(w));
                match values {
                    _ if black(c, &self.graph) => Closure::Zero,
                    [Some(0.0), Some(0.0), Some(0.0)] => Closure::Zero,
                    _ => Closure::Mul(weight, c),
                }
            }
            (_, Held::Closure(a), Held::Closure(b)) if black(a, &self.graph) => return Held::Closure(b),
            (_, Held::Closure(a), Held::Closure(b)) if black(b, &self.graph) => return Held::Closure(a),
            (Op::AddC, Held::Closure(a), Held::Closure(b)) => Closure::Add(a, b),
            (_, Held::Closure(a), Held::Closure(b)) => Closure::Layer(a, b),
            _ => Closure::Zero,
        };
        Held::Closure(self.graph.closure(made, span))
    }

    fn global(&mut self, global: GlobalVar) -> [Id; 3] {
        let free = self.ranges.iter().find(|(g, _)| *g == global).map(|(_, range)| *range);
        let range = match global {
            GlobalVar::N | GlobalVar::Ng | GlobalVar::I => Interval::new(-1.0, 1.0),
            GlobalVar::Backfacing => Interval::new(0.0, 1.0),
            _ => free.unwrap_or(Interval::new(-ENDLESS, ENDLESS)),
        };
        let whole = global.ty() == Ty::Int;
        let n = global.ty().cells();
        let mut ids = [Id(0); 3];
        for (k, id) in ids.iter_mut().enumerate().take(n) {
            *id = self.graph.leaf(LeafKind::Global(global, k), range, whole);
        }
        ids
    }

    fn op(&mut self, op: Op, n: usize, [a, b, c]: [[Id; 3]; 3]) -> [Id; 3] {
        let g = &mut self.graph;
        let mut each = |f: &mut dyn FnMut(&mut Graph, Id, Id) -> Id| {
            let mut out = a;
            for k in 0..n {
                out[k] = f(g, a[k], b[k]);
            }
            out
        };
        match op {
            Op::NegF => each(&mut |g, a, _| g.push(Node::Neg(a))),
            Op::AddF => each(&mut |g, a, b| g.push(Node::Add(a, b))),
            Op::SubF => each(&mut minus),
            Op::MulF => each(&mut |g, a, b| g.push(Node::Mul(a, b))),
            Op::DivF => each(&mut divide),
            Op::EqF | Op::NeF => {
                let mut all = g.push(Node::Int(1));
                for k in 0..n {
                    let one = g.push(Node::Compare(Order::Equal, a[k], b[k]));
                    all = g.push(Node::And(all, one));
                }
                one(if op == Op::EqF { all } else { g.push(Node::Not(all)) })
            }
            Op::LtF | Op::LtI => one(g.push(Node::Compare(Order::Less, a[0], b[0]))),
            Op::LeF | Op::LeI => one(g.push(Node::Compare(Order::AtMost, a[0], b[0]))),
            Op::GtF | Op::GtI => one(g.push(Node::Compare(Order::Less, b[0], a[0]))),
            Op::GeF | Op::GeI => one(g.push(Node::Compare(Order::AtMost, b[0], a[0]))),
            Op::EqI => one(g.push(Node::Compare(Order::Equal, a[0], b[0]))),
            Op::NeI => {
                let equal = g.push(Node::Compare(Order::Equal, a[0], b[0]));
                one(g.push(Node::Not(equal)))
            }
            Op::TruthF => {
                let mut any = g.push(Node::Int(0));
                for k in 0..n {
                    let one = g.push(Node::Truth(a[k]));
                    any = g.push(Node::Or(any, one));
                }
                one(any)
            }
            Op::TruthI => one(g.push(Node::Truth(a[0]))),
            Op::NotI => one(g.push(Node::Not(a[0]))),
            Op::And => one(g.push(Node::And(a[0], b[0]))),
            Op::Or => one(g.push(Node::Or(a[0], b[0]))),
            Op::IntToFloat => one(g.push(Node::ToFloat(a[0]))),
            Op::FloatToInt => one(g.push(Node::ToInt(a[0]))),
            Op::Splat => [a[0]; 3],
            Op::Triple => [a[0], b[0], c[0]],
            Op::Component => one(self.component(a, b[0])),
            Op::Insert => self.insert(a, b[0], c[0]),
            Op::NegI | Op::BitNotI => one(g.push(Node::IntOp(op, [a[0], a[0]]))),
            Op::AddI | Op::SubI | Op::MulI | Op::DivI | Op::RemI => one(g.push(Node::IntOp(op, [a[0], b[0]]))),
            Op::BitAndI | Op::BitOrI | Op::BitXorI | Op::ShlI | Op::ShrI => one(g.push(Node::IntOp(op, [a[0], b[0]]))),
            Op::Select | Op::AddC | Op::MulC | Op::Layer => a,
        }
    }

    /// A component by an index that may not be known.
    fn component(&mut self, a: [Id; 3], index: Id) -> Id {
        if let Some(i) = self.graph.value(index) {
            return a[i.clamp(0.0, 2.0) as usize];
        }
        let (first, second) = self.index_is(index);
        let rest = self.graph.push(Node::Select(second, a[1], a[2]));
        self.graph.push(Node::Select(first, a[0], rest))
    }

    fn insert(&mut self, a: [Id; 3], index: Id, value: Id) -> [Id; 3] {
        if let Some(i) = self.graph.value(index) {
            let mut out = a;
            out[i.clamp(0.0, 2.0) as usize] = value;
            return out;
        }
        let (first, second) = self.index_is(index);
        let g = &mut self.graph;
        let up_to = g.push(Node::Or(first, second));
        let x = g.push(Node::Select(first, value, a[0]));
        let only_second = g.push(Node::Not(first));
        let only_second = g.push(Node::And(second, only_second));
        let y = g.push(Node::Select(only_second, value, a[1]));
        [x, y, g.push(Node::Select(up_to, a[2], value))]
    }

    /// Whether an index means the first component, and whether it means the second or the first.
    fn index_is(&mut self, index: Id) -> (Id, Id) {
        let g = &mut self.graph;
        let (zero, one) = (g.push(Node::Int(0)), g.push(Node::Int(1)));
        (g.push(Node::Compare(Order::AtMost, index, zero)), g.push(Node::Compare(Order::AtMost, index, one)))
    }

    fn option(&mut self, options: &[&str], name: Id) -> [Id; 3] {
        let index = |text: &str| option_index(options, text);
        match self.graph.node(name) {
            Node::Int(i) => {
                let text = self.body.strings.get(i as usize).map_or("", String::as_str);
                one(self.graph.float(index(text).unwrap_or(0) as f32))
            }
            Node::Select(c, a, b) => {
                let (a, b) = (self.option(options, a)[0], self.option(options, b)[0]);
                one(self.graph.push(Node::Select(c, a, b)))
            }
            _ => one(self.opaque()),
        }
    }

    fn opaque(&mut self) -> Id {
        self.opaque += 1;
        self.graph.push(Node::Opaque(self.opaque))
    }

    fn call(&mut self, index: u16, args: Args, ty: Ty, cells: &impl Fn(ExprId) -> [Id; 3]) -> [Id; 3] {
        let ids = self.body.args(args);
        let values: Vec<[Id; 3]> = ids.iter().map(|id| cells(*id)).collect();
        let known: Option<Vec<Cells>> = values
            .iter()
            .zip(ids)
            .map(|(v, id)| {
                let n = self.body.expr(*id).ty.cells();
                let mut bits = [0; 3];
                for k in 0..n {
                    bits[k] = self.graph.bits(v[k])?;
                }
                Some(bits)
            })
            .collect();
        let builtin = &BUILTINS[index as usize];
        if let Some(known) = known {
            let result = builtin.apply(ty.cells(), &known);
            return match self.constant(result, ty) {
                Held::Cells(ids) => ids,
                Held::Closure(_) => [Id(0); 3],
            };
        }
        if super::graph::componentwise(index) && ty != Ty::Int {
            let mut out = [Id(0); 3];
            for k in 0..ty.cells() {
                let args: Vec<Id> = values.iter().map(|v| v[k]).collect();
                out[k] = self.scalar(index, builtin.name, &args);
            }
            return out;
        }
        self.whole(builtin.name, &values).unwrap_or_else(|| [self.opaque(), self.opaque(), self.opaque()])
    }

    /// A function on one component; those that are sums and products are written as such.
    fn scalar(&mut self, index: u16, name: &str, args: &[Id]) -> Id {
        let g = &mut self.graph;
        match (name, args) {
            ("abs" | "fabs", [a]) => g.push(Node::Abs(*a)),
            ("max", [a, b]) => g.push(Node::Max(*a, *b)),
            ("min", [a, b]) => g.push(Node::Min(*a, *b)),
            ("clamp", [x, lo, hi]) => {
                let above = g.push(Node::Max(*x, *lo));
                g.push(Node::Min(above, *hi))
            }
            ("mix", [a, b, x]) => {
                let one = g.float(1.0);
                let rest = minus(g, one, *x);
                let (left, right) = (g.push(Node::Mul(*a, rest)), g.push(Node::Mul(*b, *x)));
                g.push(Node::Add(left, right))
            }
            ("select", [a, b, x]) => {
                let truth = g.push(Node::Truth(*x));
                g.push(Node::Select(truth, *b, *a))
            }
            ("step", [edge, x]) => {
                let below = g.push(Node::Compare(Order::Less, *x, *edge));
                let (zero, one) = (g.float(0.0), g.float(1.0));
                g.push(Node::Select(below, zero, one))
            }
            ("radians", [a]) => {
                let k = g.float(std::f32::consts::PI / 180.0);
                g.push(Node::Mul(*a, k))
            }
            _ => {
                let zero = g.float(0.0);
                let mut three = [zero; 3];
                three.iter_mut().zip(args).for_each(|(to, from)| *to = *from);
                g.push(Node::Call(index, three))
            }
        }
    }

    /// Functions on whole vectors.
    fn whole(&mut self, name: &str, values: &[[Id; 3]]) -> Option<[Id; 3]> {
        Some(match (name, values) {
            ("dot", [a, b]) => one(self.dot(*a, *b)),
            ("luminance", [a]) => {
                let w = [0.2126f32, 0.7152, 0.0722].map(|x| self.graph.float(x));
                let parts: [Id; 3] = std::array::from_fn(|k| self.graph.push(Node::Mul(a[k], w[k])));
                let sum = self.graph.push(Node::Add(parts[0], parts[1]));
                one(self.graph.push(Node::Add(sum, parts[2])))
            }
            ("normalize", [a]) => match self.is_unit(*a) {
                true => *a,
                false => std::array::from_fn(|k| self.graph.push(Node::Unit(k as u8, *a))),
            },
            ("reflect", [i, n]) => {
                let d = self.dot(*n, *i);
                let two = self.graph.float(2.0);
                let d = self.graph.push(Node::Mul(two, d));
                std::array::from_fn(|k| {
                    let along = self.graph.push(Node::Mul(d, n[k]));
                    minus(&mut self.graph, i[k], along)
                })
            }
            ("faceforward", [n, i, reference]) => {
                let d = self.dot(*i, *reference);
                let zero = self.graph.float(0.0);
                let facing = self.graph.push(Node::Compare(Order::Less, d, zero));
                std::array::from_fn(|k| {
                    let turned = self.graph.push(Node::Neg(n[k]));
                    self.graph.push(Node::Select(facing, n[k], turned))
                })
            }
            _ => return None,
        })
    }

    fn dot(&mut self, a: [Id; 3], b: [Id; 3]) -> Id {
        let turned = |v: [Id; 3], g: &Graph| {
            let inner = v.map(|id| match g.node(id) {
                Node::Neg(inner) => Some(inner),
                _ => None,
            });
            Some([inner[0]?, inner[1]?, inner[2]?])
        };
        if let Some(a) = turned(a, &self.graph) {
            let d = self.dot(a, b);
            return self.graph.push(Node::Neg(d));
        }
        if let Some(b) = turned(b, &self.graph) {
            let d = self.dot(a, b);
            return self.graph.push(Node::Neg(d));
        }
        match (self.direction(a), self.direction(b)) {
            (Some(GlobalVar::N), Some(GlobalVar::I)) | (Some(GlobalVar::I), Some(GlobalVar::N)) => {
                self.graph.leaf(LeafKind::Facing, Interval::new(-1.0, 1.0), false)
            }
            (Some(x), Some(y)) if x == y => self.graph.float(1.0),
            _ if b < a => self.graph.push(Node::Dot(b, a)),
            _ => self.graph.push(Node::Dot(a, b)),
        }
    }

    fn is_unit(&self, v: [Id; 3]) -> bool {
        self.direction(v).is_some()
            || (0..3).all(|k| matches!(self.graph.node(v[k]), Node::Unit(j, _) if j as usize == k))
    }

    /// The unit global that three nodes are.
    fn direction(&self, v: [Id; 3]) -> Option<GlobalVar> {
        global_of(&self.graph, v).filter(|g| matches!(g, GlobalVar::N | GlobalVar::Ng | GlobalVar::I))
    }
}

/// The global whose components three nodes are.
pub fn global_of(graph: &Graph, v: [Id; 3]) -> Option<GlobalVar> {
    let at = |k: usize| match graph.node(v[k]) {
        Node::Leaf(leaf) => match graph.leaves[leaf as usize].kind {
            LeafKind::Global(g, component) if component == k => Some(g),
            _ => None,
        },
        _ => None,
    };
    let first = at(0)?;
    (at(1)? == first && at(2)? == first).then_some(first)
}

fn one(id: Id) -> [Id; 3] {
    [id; 3]
}

fn minus(g: &mut Graph, a: Id, b: Id) -> Id {
    let b = g.push(Node::Neg(b));
    g.push(Node::Add(a, b))
}

fn divide(g: &mut Graph, a: Id, b: Id) -> Id {
    match g.bits(b).map(f32::from_bits) {
        Some(0.0) => g.float(0.0),
        _ => {
            let r = g.push(Node::Recip(b));
            g.push(Node::Div(a, b, r))
        }
    }
}
