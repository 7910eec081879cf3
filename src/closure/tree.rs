//! The closure tree a shader leaves at one shading point.
//!
//! A small arena: nodes refer only to nodes made before them, so that every pass over a tree is a loop, never a
//! recursion, and a sum of a hundred thousand terms is as safe as a sum of two. Weights are made sane when a node is
//! built. The tree holds no normals of its own beyond what lobe parameters carry, and knows nothing of directions.

use crate::lobes::{LobeKind, Rgb32};
use smallvec::SmallVec;

/// A node of a [`ClosureTree`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodeId(u32);

impl NodeId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Node {
    /// Black.
    Zero,
    /// The sum of two closures.
    Add(NodeId, NodeId),
    /// A closure scaled per channel; the weight lies in [0, 1e30].
    Mul(Rgb32, NodeId),
    /// `top` over `base`.
    Layer { top: NodeId, base: NodeId },
    /// A lobe. `site` tells which place in the program made it (its albedo curve is kept per site); the parameter
    /// values start at `slots` in [`ClosureTree::slots`].
    Lobe { kind: LobeKind, site: u32, slots: u32 },
}

/// The largest weight a node may carry; anything above is clamped to it.
pub const MAX_WEIGHT: f32 = 1e30;

/// Closures as a shader composes them. Build with the methods below; the last call is to [`set_root`](Self::set_root).
#[derive(Clone, Debug)]
pub struct ClosureTree {
    nodes: SmallVec<[Node; 20]>,
    slots: SmallVec<[f32; 96]>,
    root: NodeId,
}

impl Default for ClosureTree {
    fn default() -> Self {
        ClosureTree::new()
    }
}

impl ClosureTree {
    /// A black tree.
    pub fn new() -> Self {
        let mut nodes = SmallVec::new();
        nodes.push(Node::Zero);
        ClosureTree { nodes, slots: SmallVec::new(), root: NodeId(0) }
    }

    /// Back to black, keeping what memory there is.
    pub fn clear(&mut self) {
        self.nodes.truncate(1);
        self.slots.clear();
        self.root = NodeId(0);
    }

    /// The black closure.
    pub fn zero(&self) -> NodeId {
        NodeId(0)
    }

    /// a + b. Black terms vanish.
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == self.zero() {
            b
        } else if b == self.zero() {
            a
        } else {
            self.push(Node::Add(a, b))
        }
    }

    /// weight · c. The weight is clamped per channel to [0, 1e30], NaN becomes 0. A weight of one is no node, a
    /// weight of zero is black.
    pub fn mul(&mut self, weight: Rgb32, c: NodeId) -> NodeId {
        let weight = weight.map(sane_weight);
        if weight == [0.0; 3] || c == self.zero() {
            self.zero()
        } else if weight == [1.0; 3] {
            c
        } else {
            self.push(Node::Mul(weight, c))
        }
    }

    /// `top` over `base`. A layer over black is its top; black over anything is the base.
    pub fn layer(&mut self, top: NodeId, base: NodeId) -> NodeId {
        if base == self.zero() {
            top
        } else if top == self.zero() {
            base
        } else {
            self.push(Node::Layer { top, base })
        }
    }

    /// A lobe with its parameter values in declared order (see [`LobeKind::spec`]).
    ///
    /// # Panics
    /// If `values` has not [`slot_count`](crate::lobes::registry::LobeSpec::slot_count) entries: a bug in the caller,
    /// not in a script.
    pub fn lobe(&mut self, kind: LobeKind, site: u32, values: &[f32]) -> NodeId {
        assert_eq!(values.len(), kind.spec().slot_count(), "parameter block of `{}`", kind.spec().name);
        let slots = self.slots.len() as u32;
        self.slots.extend_from_slice(values);
        self.push(Node::Lobe { kind, site, slots })
    }

    pub fn set_root(&mut self, root: NodeId) {
        self.root = root;
    }

    pub fn root(&self) -> NodeId {
        self.root
    }

    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// Number of nodes made, reachable or not.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether the root is black.
    pub fn is_empty(&self) -> bool {
        self.root == self.zero()
    }

    /// The parameter block that starts at `start` for a lobe of this kind.
    pub fn values(&self, kind: LobeKind, start: u32) -> &[f32] {
        &self.slots[start as usize..start as usize + kind.spec().slot_count()]
    }

    fn push(&mut self, node: Node) -> NodeId {
        let id = NodeId(self.nodes.len() as u32);
        self.nodes.push(node);
        id
    }
}

/// NaN and negative weights are black, the rest stays below [`MAX_WEIGHT`].
fn sane_weight(w: f32) -> f32 {
    if w > 0.0 { w.min(MAX_WEIGHT) } else { 0.0 }
}
