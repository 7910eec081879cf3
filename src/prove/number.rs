//! What the numbers of a graph can be within a box, along one path of decisions.
//!
//! A number is a polynomial in variables, give or take an error, and lies in a range. Variables are the leaves, and every
//! node that is no sum or product of others: such a node's range comes from those of its operands. Where an operation
//! depends on a question the box leaves open – which of two is larger, whether a condition holds – the path decides and
//! remembers; [`Path::next`] goes through the other answers. Beyond [`Limits::decisions`] questions stay open, and the
//! result is a variable again.

mod operations;

use super::functions;
use super::graph::{Graph, Id, LeafKind, Node};
use super::interval::Interval;
use super::poly::Poly;
use crate::ir::body::{GlobalVar, Op};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Half a unit in the last place of single precision, relatively: what one operation may be off by.
pub const ROUNDING: f64 = 6e-8;
/// A polynomial with a larger error says less than the range of what it stands for.
const MUCH: f64 = 1e-3;
/// A weight this little below zero, if at all, is taken as rounding.
const BARELY_NEGATIVE: f64 = 2e-6;

/// Part of the space of leaves: ranges of nodes, where they are narrower than they have to be.
#[derive(Clone, Debug)]
pub struct Region {
    /// By node.
    pub ranges: BTreeMap<u32, Interval>,
    /// Cosine of the held direction to N.
    pub cos: Interval,
}

/// What a number can be.
#[derive(Clone, Debug)]
pub struct Number {
    /// Holds its value.
    pub range: Interval,
    /// Its value, give or take `error`.
    pub poly: Poly,
    /// Absolute: rounding of the operations that lead here.
    pub error: f64,
    /// The same, relative to the value; infinite where values of both signs met.
    pub relative: f64,
}

#[derive(Clone, Copy, Debug)]
struct Decision {
    node: Id,
    case: u8,
    cases: u8,
}

/// A polynomial that is zero, the term to replace by the rest, and how far from zero it may be.
struct Vanishing {
    poly: Poly,
    lead: usize,
    error: f64,
}

/// One way through the open questions of a region.
pub struct Path<'a> {
    graph: &'a Graph,
    region: &'a Region,
    /// The range of dot(N, I), where that is known.
    facing: Option<Interval>,
    decisions: Vec<Decision>,
    most: usize,
    /// Narrower than the region where decisions say so.
    narrowed: BTreeMap<u32, Interval>,
    numbers: Vec<Option<Rc<Number>>>,
    vanishing: Vec<Vanishing>,
    /// Polynomials that are not above zero on this path.
    below_zero: Vec<Poly>,
    impossible: bool,
    /// Operations so far, on all paths.
    pub work: usize,
}

impl<'a> Path<'a> {
    /// The first path through a region, with up to `most` decisions.
    pub fn new(graph: &'a Graph, region: &'a Region, facing_held: bool, most: usize) -> Self {
        Path {
            graph,
            region,
            facing: facing_held.then(|| region.cos.negated()),
            decisions: Vec::new(),
            most,
            narrowed: BTreeMap::new(),
            numbers: vec![None; graph.len()],
            vanishing: Vec::new(),
            below_zero: Vec::new(),
            impossible: false,
            work: 0,
        }
    }

    /// The first path through a region of directions to the light, for viewers at these cosines.
    pub fn sliced(graph: &'a Graph, region: &'a Region, cos_o: Interval, most: usize) -> Self {
        Path { facing: Some(cos_o.negated()), ..Path::new(graph, region, false, most) }
    }

    /// Goes on to the next path; false if this was the last.
    pub fn next(&mut self) -> bool {
        while self.decisions.last().is_some_and(|d| d.case + 1 == d.cases) {
            self.decisions.pop();
        }
        let Some(last) = self.decisions.last_mut() else { return false };
        last.case += 1;
        self.narrowed.clear();
        self.numbers.fill(None);
        self.vanishing.clear();
        self.below_zero.clear();
        self.impossible = false;
        true
    }

    /// Whether the decisions contradict the region: nothing lies on this path.
    pub fn is_impossible(&self) -> bool {
        self.impossible
    }

    /// What was asked so far on this path.
    pub fn questions(&self) -> impl Iterator<Item = Id> {
        self.decisions.iter().map(|d| d.node)
    }

    /// Where the region's direction lies.
    pub fn cos(&self) -> Interval {
        self.region.cos
    }

    /// The range of a variable.
    pub fn variable(&self, v: u32) -> Interval {
        let own = match (self.graph.node(Id(v)), &self.numbers[v as usize]) {
            (Node::Leaf(leaf), _) => self.leaf_range(leaf),
            (_, Some(number)) => number.range,
            _ => Interval::ALL,
        };
        self.limited(Id(v), own)
    }

    fn leaf_range(&self, leaf: u32) -> Interval {
        let leaf = &self.graph.leaves[leaf as usize];
        match leaf.kind {
            LeafKind::Facing => self.facing.unwrap_or(leaf.range),
            _ => leaf.range,
        }
    }

    fn limited(&self, id: Id, range: Interval) -> Interval {
        let mut range = range;
        for narrower in [self.region.ranges.get(&id.0), self.narrowed.get(&id.0)].into_iter().flatten() {
            range = range.narrowed(*narrower);
        }
        range
    }

    /// An upper bound of a polynomial on this path.
    pub fn upper(&mut self, poly: &Poly) -> f64 {
        self.work += 1 + poly.terms().len();
        let (reduced, error) = self.reduced(poly);
        let of = |v: u32| self.variable(v);
        let bound = reduced.upper(&of).min(self.upper_by_decisions(&reduced)) + error;
        if bound.is_finite() {
            bound
        } else {
            bound.min(poly.upper(&of)).min(self.upper_by_quotients(&reduced) + error)
        }
    }

    /// Takes out what is known to vanish.
    fn reduced(&self, poly: &Poly) -> (Poly, f64) {
        let (mut poly, mut error) = (poly.clone(), 0.0);
        for zero in &self.vanishing {
            let after = poly.reduced(&zero.poly, zero.lead);
            if after != poly {
                let size: f64 = poly.terms().iter().map(|(_, c)| c.abs()).sum();
                error += size * zero.error;
                poly = after;
            }
        }
        (poly, error)
    }

    /// P ≤ P − k·g where g ≤ 0 and k ≥ 0: with k such that a term of g vanishes from P.
    fn upper_by_decisions(&self, poly: &Poly) -> f64 {
        let of = |v: u32| self.variable(v);
        let (mut best, mut bound) = (poly.clone(), poly.upper(&of));
        for g in &self.below_zero {
            for (monomial, c) in g.terms().iter().filter(|(m, c)| !m.is_empty() && *c != 0.0) {
                let own = best.terms().iter().find(|(m, _)| m == monomial).map_or(0.0, |(_, c)| *c);
                if own / c > 0.0 {
                    let with = best.plus(g, -own / c);
                    let upper = with.upper(&of);
                    if upper < bound {
                        (best, bound) = (with, upper);
                    }
                }
            }
        }
        bound
    }

    /// For what is left of 1/q where q may be tiny: A/q ≤ k if A ≤ k·q.
    fn upper_by_quotients(&self, poly: &Poly) -> f64 {
        let of = |v: u32| self.variable(v);
        let (mut poly, mut sum) = (poly.clone(), 0.0);
        for (v, _) in poly.degrees() {
            let Node::Recip(b) = self.graph.node(Id(v)) else { continue };
            let Some((a, rest)) = poly.linear_in(v) else { continue };
            let Some(q) = &self.numbers[b.index()] else { continue };
            let holds = |k: f64| a.plus(&q.poly, -k).upper(&of) <= 1e-9;
            let most = a.terms().iter().map(|(_, c)| *c).fold(0.0, f64::max);
            let k = (0..=16).map(|i| most * i as f64 / 16.0).find(|k| holds(*k));
            if let Some(k) = k.filter(|_| q.range.lo >= 0.0) {
                sum += k * (1.0 + q.relative.min(1.0));
                poly = rest;
            }
        }
        poly.upper(&of) + sum
    }

    /// The number a node computes.
    pub fn number(&mut self, id: Id) -> Rc<Number> {
        let mut waiting = vec![id];
        while let Some(&top) = waiting.last() {
            if self.numbers[top.index()].is_some() {
                waiting.pop();
            } else if let Some(needed) = self.missing(top) {
                waiting.push(needed);
            } else {
                self.work += 1;
                let number = self.compute(top);
                self.numbers[top.index()] = Some(Rc::new(number));
            }
        }
        self.of(id)
    }

    /// The next operand that has to be known first. Of a choice only the condition, and then what it chooses.
    fn missing(&self, id: Id) -> Option<Id> {
        let unknown = |id: Id| self.numbers[id.index()].is_none().then_some(id);
        let truth = |id: Id| self.numbers[id.index()].as_ref().and_then(|n| decided(n.range));
        match self.graph.node(id) {
            Node::Select(c, a, b) => unknown(c).or_else(|| match truth(c) {
                Some(true) => unknown(a),
                Some(false) => unknown(b),
                None => unknown(a).or_else(|| unknown(b)),
            }),
            Node::And(a, b) => unknown(a).or_else(|| if truth(a) == Some(false) { None } else { unknown(b) }),
            Node::Or(a, b) => unknown(a).or_else(|| if truth(a) == Some(true) { None } else { unknown(b) }),
            node => {
                let mut first = None;
                node.operands(|o| first = first.or_else(|| unknown(o)));
                first
            }
        }
    }

    fn of(&self, id: Id) -> Rc<Number> {
        match &self.numbers[id.index()] {
            Some(number) => number.clone(),
            None => Rc::new(Number::everything(id)),
        }
    }

    fn compute(&mut self, id: Id) -> Number {
        match self.graph.node(id) {
            Node::Float(bits) => Number::exactly(f32::from_bits(bits) as f64),
            Node::Int(i) => Number::exactly(i as f64),
            Node::Leaf(leaf) => self.atom(id, self.leaf_range(leaf)),
            Node::Neg(a) => self.of(a).negated(),
            Node::Add(a, b) => self.sum(id, a, b),
            Node::Mul(a, b) => self.product(id, a, b),
            Node::Div(a, b, r) => self.quotient(id, a, b, r),
            Node::Recip(b) => self.reciprocal(id, b),
            Node::Max(a, b) => self.larger(id, a, b, 1.0),
            Node::Min(a, b) => self.larger(id, a, b, -1.0),
            Node::Abs(a) => self.absolute(id, a),
            Node::Weight(a) => self.weight(id, a),
            Node::Compare(order, a, b) => self.comparison(id, order, a, b),
            Node::Truth(a) => self.truth(id, a),
            Node::Not(a) => Number::logic(decided(self.of(a).range).map(|t| !t), id),
            Node::And(a, b) => {
                let a = decided(self.of(a).range);
                let b = if a == Some(false) { a } else { decided(self.of(b).range) };
                Number::logic(if b == Some(false) { b } else { a.and(b) }, id)
            }
            Node::Or(a, b) => {
                let a = decided(self.of(a).range);
                let b = if a == Some(true) { a } else { decided(self.of(b).range) };
                Number::logic(if b == Some(true) { b } else { a.and(b) }, id)
            }
            Node::Select(c, a, b) => match decided(self.of(c).range) {
                Some(true) => (*self.of(a)).clone(),
                Some(false) => (*self.of(b)).clone(),
                None => self.atom(id, self.of(a).range.hull(self.of(b).range)),
            },
            Node::ToInt(a) => self.atom(id, functions::whole(self.of(a).range)),
            Node::ToFloat(a) => {
                let a = self.of(a);
                let error = ROUNDING * a.range.magnitude();
                Number { error: if a.range.magnitude() < 16_777_216.0 { 0.0 } else { error }, ..(*a).clone() }
            }
            Node::Call(index, args) => self.call(id, index, args),
            Node::Dot(a, b) => {
                let mut range = Interval::point(0.0);
                for k in 0..3 {
                    range = range.plus(self.of(a[k]).range.times(self.of(b[k]).range));
                }
                let unit = self.is_unit(a) && self.is_unit(b);
                self.atom(id, if unit { range.narrowed(Interval::new(-1.0, 1.0)) } else { range })
            }
            Node::Unit(..) => self.atom(id, Interval::new(-1.0, 1.0)),
            Node::IntOp(op, [a, b]) => {
                let (a, b) = (self.of(a).range, self.of(b).range);
                self.atom(id, int_range(op, a, b))
            }
            Node::Opaque(_) => Number::everything(id),
        }
    }

    fn is_unit(&self, v: [Id; 3]) -> bool {
        (0..3).all(|k| match self.graph.node(v[k]) {
            Node::Unit(j, _) => j as usize == k,
            Node::Leaf(leaf) => {
                let kind = self.graph.leaves[leaf as usize].kind;
                matches!(kind, LeafKind::Global(GlobalVar::N | GlobalVar::Ng | GlobalVar::I, _))
            }
            _ => false,
        })
    }

    /// A variable of its own.
    fn atom(&self, id: Id, range: Interval) -> Number {
        let range = self.limited(id, range);
        if range.is_point() {
            return Number::exactly(range.lo);
        }
        Number { range, poly: Poly::var(id.0), error: 0.0, relative: 0.0 }
    }

    /// A polynomial, or a variable where that has become too much.
    fn settled(&self, id: Id, range: Interval, poly: Option<Poly>, error: f64, relative: f64) -> Number {
        let poly = poly.filter(|p| !p.is_large() && error < MUCH && !range.nan);
        let Some(poly) = poly else { return self.atom(id, range) };
        let mut range = self.limited(id, range);
        if poly.terms().len() > 1 {
            let seen = poly.range(&|v| self.variable(v));
            range = range.narrowed(Interval::new(seen.lo - error, seen.hi + error));
        }
        if range.is_point() {
            return Number::exactly(range.lo);
        }
        Number { range, poly, error, relative }
    }

    fn args_of(&self, id: Id) -> [Id; 3] {
        match self.graph.node(id) {
            Node::Call(_, args) => args,
            _ => [id; 3],
        }
    }

    /// Answers an open question, unless too many have been.
    fn choose(&mut self, node: Id, cases: u8) -> Option<u8> {
        if let Some(known) = self.decisions.iter().find(|d| d.node == node) {
            return Some(known.case);
        }
        if self.decisions.len() >= self.most {
            return None;
        }
        self.decisions.push(Decision { node, case: 0, cases });
        Some(0)
    }

    /// Draws conclusions from poly ≤ error (`at_most`) or poly ≥ −error: variables that occur in it once, with a number
    /// as their factor.
    fn narrow(&mut self, poly: &Poly, error: f64, at_most: bool) {
        let poly = if at_most { poly.clone() } else { poly.scaled(-1.0) };
        let slack = error + 1e-9;
        if poly.terms().len() > 1 && poly.as_var().is_none() && slack < 1e-4 {
            self.below_zero.push(poly.plus(&Poly::constant(slack), -1.0));
        }
        for (v, _) in poly.degrees() {
            let Some((factor, rest)) = poly.linear_in(v) else { continue };
            let Some(k) = factor.as_constant().filter(|k| *k != 0.0) else { continue };
            let least = -rest.scaled(-1.0).upper(&|v| self.variable(v));
            let end = (slack - least) / k;
            if end.is_nan() {
                continue;
            }
            let limit = match k > 0.0 {
                true => Interval::new(f64::NEG_INFINITY, end),
                false => Interval::new(end, f64::INFINITY),
            };
            match self.variable(v).meet(limit) {
                Some(range) => {
                    self.narrowed.insert(v, range);
                }
                None => self.impossible = true,
            }
        }
    }
}

impl Number {
    fn exactly(x: f64) -> Number {
        Number { range: Interval::point(x), poly: Poly::constant(x), error: 0.0, relative: 0.0 }
    }

    fn everything(id: Id) -> Number {
        Number { range: Interval::ALL, poly: Poly::var(id.0), error: 0.0, relative: 0.0 }
    }

    fn logic(known: Option<bool>, id: Id) -> Number {
        match known {
            Some(known) => Number::exactly(f64::from(u8::from(known))),
            None => Number { range: Interval::new(0.0, 1.0), ..Number::everything(id) },
        }
    }

    fn negated(&self) -> Number {
        Number { range: self.range.negated(), poly: self.poly.scaled(-1.0), ..*self }
    }
}

/// Whether a condition holds.
pub fn decided(range: Interval) -> Option<bool> {
    match () {
        () if range.nan => None,
        () if range.lo > 0.0 || range.hi < 0.0 => Some(true),
        () if range.is_point() => Some(false),
        () => None,
    }
}

fn int_range(op: Op, a: Interval, b: Interval) -> Interval {
    let all = Interval::new(i32::MIN as f64, i32::MAX as f64);
    let range = match op {
        Op::NegI => a.negated(),
        Op::AddI => Interval::new(a.lo + b.lo, a.hi + b.hi),
        Op::SubI => Interval::new(a.lo - b.hi, a.hi - b.lo),
        Op::MulI => a.times(b),
        Op::RemI if b.is_point() && a.lo >= 0.0 => Interval::new(0.0, (b.lo.abs() - 1.0).max(0.0)),
        _ => all,
    };
    // What overflows wraps around.
    if range.lo >= all.lo && range.hi <= all.hi { range } else { all }
}
