//! A script as a graph: every number and every closure it may compute, with branches as choices between values.
//!
//! Equal operations on equal operands are one node, so that two expressions that are sure to have the same value are
//! the same variable to the proof. Operands come before what uses them. Colors and vectors are three nodes.

use crate::ir::body::{GlobalVar, Op};
use crate::ir::builtins::{BUILTINS, Eval};
use crate::ir::ops;
use crate::lobes::LobeKind;
use crate::prove::interval::Interval;
use crate::span::Span;
use std::collections::HashMap;

/// A number in the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub u32);

impl Id {
    /// As an index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A closure in the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cid(pub u32);

/// How two numbers compare.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Order {
    Equal,
    Less,
    AtMost,
}

/// What computes a number. Comparisons and logic give 0 or 1.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A float by its bits.
    Float(u32),
    Int(i32),
    Leaf(u32),
    Neg(Id),
    Add(Id, Id),
    Mul(Id, Id),
    /// a/b with 1/b as a node of its own.
    Div(Id, Id, Id),
    /// 1/b, or 0 where b is 0, not rounded.
    Recip(Id),
    /// `if b > a { b } else { a }`
    Max(Id, Id),
    /// `if b < a { b } else { a }`
    Min(Id, Id),
    Abs(Id),
    /// What a closure's weight becomes: not below 0, NaN 0.
    Weight(Id),
    Compare(Order, Id, Id),
    Not(Id),
    And(Id, Id),
    Or(Id, Id),
    /// Whether it differs from zero.
    Truth(Id),
    Select(Id, Id, Id),
    ToInt(Id),
    /// An int rounded to a float.
    ToFloat(Id),
    /// A function of the table on up to three floats.
    Call(u16, [Id; 3]),
    Dot([Id; 3], [Id; 3]),
    /// Component of a normalised vector.
    Unit(u8, [Id; 3]),
    /// An int operation that is not followed.
    IntOp(Op, [Id; 2]),
    /// Anything, once per place.
    Opaque(u32),
}

impl Node {
    /// Calls `see` for each operand.
    pub fn operands(&self, mut see: impl FnMut(Id)) {
        match *self {
            Node::Float(_) | Node::Int(_) | Node::Leaf(_) | Node::Opaque(_) => {}
            Node::Neg(a) | Node::Recip(a) | Node::Abs(a) | Node::Weight(a) | Node::Not(a) | Node::Truth(a) => see(a),
            Node::ToInt(a) | Node::ToFloat(a) => see(a),
            Node::Add(a, b) | Node::Mul(a, b) | Node::Max(a, b) | Node::Min(a, b) => [a, b].into_iter().for_each(see),
            Node::Compare(_, a, b) | Node::And(a, b) | Node::Or(a, b) => [a, b].into_iter().for_each(see),
            Node::Div(a, b, c) | Node::Select(a, b, c) => [a, b, c].into_iter().for_each(see),
            Node::Call(_, args) | Node::Unit(_, args) => args.into_iter().for_each(see),
            Node::Dot(a, b) => a.into_iter().chain(b).for_each(see),
            Node::IntOp(_, args) => args.into_iter().for_each(see),
        }
    }
}

/// What a leaf stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeafKind {
    /// A channel of a parameter.
    Param(usize, usize),
    /// A component of a global.
    Global(GlobalVar, usize),
    /// dot(N, I).
    Facing,
}

/// A value that is free within its range.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// Of what.
    pub kind: LeafKind,
    /// Its range.
    pub range: Interval,
    /// Whole numbers only.
    pub whole: bool,
    /// Its node.
    pub id: Id,
}

/// A closure.
#[derive(Clone, Debug)]
pub enum Closure {
    /// Black.
    Zero,
    /// A sum.
    Add(Cid, Cid),
    /// Scaled; the weights are [`Node::Weight`]s.
    Mul([Id; 3], Cid),
    /// One over another.
    Layer(Cid, Cid),
    /// One or the other.
    Select(Id, Cid, Cid),
    /// A lobe with the nodes of its slots, and the color its albedo is at most proportional to, between 0 and 1.
    Lobe(LobeKind, Vec<Id>, Option<[Id; 3]>),
}

/// Numbers and closures.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
    /// What is free.
    pub leaves: Vec<Leaf>,
    closures: Vec<(Closure, Span)>,
    /// For each number the leaves it depends on.
    support: Vec<Vec<u32>>,
    /// Where numbers were first written.
    places: Vec<Span>,
    /// Where the expression at hand was written.
    pub here: Span,
}

impl Graph {
    /// An empty graph; its first closure is black.
    pub fn new() -> Graph {
        let mut graph = Graph::default();
        graph.closure(Closure::Zero, Span::default());
        graph
    }

    /// What computes `id`.
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.index()]
    }

    /// The node that computes just this, if there is one.
    pub fn find(&self, node: Node) -> Option<Id> {
        self.known.get(&node).copied()
    }

    /// How many numbers there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Where `id` was first written.
    pub fn place(&self, id: Id) -> Span {
        self.places[id.index()]
    }

    /// The leaves `id` depends on, by index.
    pub fn support(&self, id: Id) -> &[u32] {
        &self.support[id.index()]
    }

    /// A closure.
    pub fn closure_at(&self, id: Cid) -> &Closure {
        &self.closures[id.0 as usize].0
    }

    /// Where it was written.
    pub fn closure_place(&self, id: Cid) -> Span {
        self.closures[id.0 as usize].1
    }

    /// How many closures there are.
    pub fn closure_count(&self) -> usize {
        self.closures.len()
    }

    /// Adds a closure.
    pub fn closure(&mut self, closure: Closure, span: Span) -> Cid {
        self.closures.push((closure, span));
        Cid(self.closures.len() as u32 - 1)
    }

    /// A float.
    pub fn float(&mut self, x: f32) -> Id {
        self.push(Node::Float(x.to_bits()))
    }

    /// A new leaf, or the one there is for `kind`.
    pub fn leaf(&mut self, kind: LeafKind, range: Interval, whole: bool) -> Id {
        if let Some(leaf) = self.leaves.iter().find(|l| l.kind == kind) {
            return leaf.id;
        }
        if range.is_point() {
            let x = range.lo as f32;
            return if whole { self.push(Node::Int(x as i32)) } else { self.float(x) };
        }
        let id = self.push(Node::Leaf(self.leaves.len() as u32));
        self.leaves.push(Leaf { kind, range, whole, id });
        id
    }

    /// The value of a constant, as a float or an int.
    pub fn value(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Float(bits) => Some(f32::from_bits(bits) as f64),
            Node::Int(i) => Some(i as f64),
            _ => None,
        }
    }

    /// The bits of a constant.
    pub fn bits(&self, id: Id) -> Option<u32> {
        match self.node(id) {
            Node::Float(bits) => Some(bits),
            Node::Int(i) => Some(i as u32),
            _ => None,
        }
    }

    /// The node that computes `node`, simplified where that changes no bit.
    pub fn push(&mut self, node: Node) -> Id {
        let node = match self.simpler(node) {
            Simpler::Id(id) => return id,
            Simpler::Node(node) => node,
        };
        if let Some(id) = self.known.get(&node) {
            return *id;
        }
        let id = Id(self.nodes.len() as u32);
        let mut support: Vec<u32> = Vec::new();
        node.operands(|o| support.extend(&self.support[o.index()]));
        if let Node::Leaf(leaf) = node {
            support.push(leaf);
        }
        support.sort_unstable();
        support.dedup();
        self.nodes.push(node);
        self.support.push(support);
        self.places.push(self.here);
        self.known.insert(node, id);
        id
    }

    fn simpler(&mut self, node: Node) -> Simpler {
        // Addition and multiplication do not care about order.
        let node = match node {
            Node::Add(a, b) if b < a => Node::Add(b, a),
            Node::Mul(a, b) if b < a => Node::Mul(b, a),
            other => other,
        };
        if let Some(id) = self.folded(node) {
            return Simpler::Id(id);
        }
        let is = |id: Id, x: f32| self.bits(id) == Some(x.to_bits()) && matches!(self.node(id), Node::Float(_));
        match node {
            Node::Mul(a, b) if is(a, 1.0) => Simpler::Id(b),
            Node::Mul(a, b) if is(b, 1.0) => Simpler::Id(a),
            Node::Div(a, b, _) if is(b, 1.0) => Simpler::Id(a),
            Node::Neg(a) => match self.node(a) {
                Node::Neg(inner) => Simpler::Id(inner),
                _ => Simpler::Node(node),
            },
            Node::Truth(a) if self.is_logic(a) => Simpler::Id(a),
            Node::Select(_, a, b) if a == b => Simpler::Id(a),
            Node::Select(c, a, b) => match self.value(c) {
                Some(x) => Simpler::Id(if x != 0.0 { a } else { b }),
                None => match self.node(c) {
                    Node::Not(inner) => Simpler::Node(Node::Select(inner, b, a)),
                    _ => Simpler::Node(node),
                },
            },
            Node::Max(a, b) | Node::Min(a, b) if a == b => Simpler::Id(a),
            Node::Weight(a) if matches!(self.node(a), Node::Weight(_)) => Simpler::Id(a),
            // A choice of weights is a choice of what they become; the same for functions of one choice.
            _ => Simpler::Node(node),
        }
    }

    fn is_logic(&self, id: Id) -> bool {
        matches!(self.node(id), Node::Compare(..) | Node::Not(_) | Node::And(..) | Node::Or(..) | Node::Truth(_))
    }

    /// The constant it comes to, by the operations the shader itself would use.
    fn folded(&mut self, node: Node) -> Option<Id> {
        let f = |id: Id| match self.node(id) {
            Node::Float(bits) => Some(f32::from_bits(bits)),
            _ => None,
        };
        let x = |id: Id| self.value(id);
        let float = match node {
            Node::Neg(a) => -f(a)?,
            Node::Add(a, b) => f(a)? + f(b)?,
            Node::Mul(a, b) => f(a)? * f(b)?,
            Node::Div(a, b, _) => ops::divide(f(a)?, f(b)?),
            Node::Max(a, b) => {
                let (a, b) = (f(a)?, f(b)?);
                if b > a { b } else { a }
            }
            Node::Min(a, b) => {
                let (a, b) = (f(a)?, f(b)?);
                if b < a { b } else { a }
            }
            Node::Abs(a) => f(a)?.abs(),
            Node::Weight(a) => {
                let w = f(a)?;
                if w > 0.0 { w.min(crate::closure::tree::MAX_WEIGHT) } else { 0.0 }
            }
            Node::ToFloat(a) => match self.node(a) {
                Node::Int(i) => i as f32,
                _ => return None,
            },
            Node::Call(index, args) => {
                let cells = args.map(|a| f(a).map(|x| [x.to_bits(), 0, 0]));
                let known = cells.iter().flatten().copied().collect::<Vec<_>>();
                if known.len() < args.len() {
                    return None;
                }
                f32::from_bits(BUILTINS[index as usize].apply(1, &known)[0])
            }
            Node::Compare(..) | Node::Not(_) | Node::And(..) | Node::Or(..) | Node::Truth(_) | Node::ToInt(_) => {
                let int = match node {
                    Node::Compare(order, a, b) => i32::from(order.holds(x(a)?, x(b)?)),
                    Node::Not(a) => i32::from(x(a)? == 0.0),
                    Node::And(a, b) => match (x(a), x(b)) {
                        (Some(0.0), _) | (_, Some(0.0)) => 0,
                        (a, b) => i32::from(a? != 0.0 && b? != 0.0),
                    },
                    Node::Or(a, b) => match (x(a), x(b)) {
                        (Some(a), _) if a != 0.0 => 1,
                        (_, Some(b)) if b != 0.0 => 1,
                        (a, b) => i32::from(a? != 0.0 || b? != 0.0),
                    },
                    Node::Truth(a) => i32::from(x(a)? != 0.0),
                    _ => {
                        let Node::ToInt(a) = node else { return None };
                        f(a)? as i32
                    }
                };
                return Some(self.push(Node::Int(int)));
            }
            Node::IntOp(op, args) => {
                let bits = args.map(|a| self.bits(a));
                let int = ops::apply(op, 1, [bits[0]?, 0, 0], [bits[1]?, 0, 0], [0; 3])[0];
                return Some(self.push(Node::Int(int as i32)));
            }
            _ => return None,
        };
        Some(self.float(float))
    }
}

impl Order {
    /// Whether it holds.
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Order::Equal => a == b,
            Order::Less => a < b,
            Order::AtMost => a <= b,
        }
    }
}

enum Simpler {
    Id(Id),
    Node(Node),
}

/// How a function works on floats, one component at a time.
pub fn componentwise(index: u16) -> bool {
    matches!(BUILTINS[index as usize].eval, Eval::F1(_) | Eval::F2(_) | Eval::F3(_))
}
