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
    Layer {
        /// What light meets first.
        top: NodeId,
        /// What it scales.
        base: NodeId,
    },
    /// A lobe. `site` tells which place in the program made it (its albedo curve is kept per site); the parameter
    /// values are [`ClosureTree::values`] from `slots` on.
    Lobe {
        /// Which lobe.
        kind: LobeKind,
        /// The place that made it.
        site: u32,
        /// Where its values start.
        slots: u32,
    },
}

/// The largest weight a node may carry; anything above is clamped to it.
pub const MAX_WEIGHT: f32 = 1e30;

/// Closures as a shader composes them. Build with the methods below; the last call is to [`set_root`](Self::set_root).
#[derive(Clone, Debug)]
pub struct ClosureTree {
    /// With what each comes to.
    nodes: SmallVec<[(Node, Size); 40]>,
    slots: SmallVec<[f32; 96]>,
    root: NodeId,
    /// The number of the tree this is a copy of but for directions; 0 once it is changed otherwise.
    copy_of: u64,
}

/// How much a node comes to when it is written out in full: a node may be used twice, so a tree of sixty nodes can
/// stand for 2⁶⁰ lobes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Lobes, saturating.
    pub lobes: u32,
    /// Layers on the longest way down, saturating.
    pub layers: u16,
    /// Nodes on the longest way down, where a sum of sums counts as one; saturating.
    pub depth: u32,
}

impl Size {
    fn beside(self, o: Size) -> Size {
        Size {
            lobes: self.lobes.saturating_add(o.lobes),
            layers: self.layers.max(o.layers),
            depth: self.depth.max(o.depth),
        }
    }

    fn below(self, nodes: u32) -> Size {
        Size { depth: self.depth.saturating_add(nodes), ..self }
    }
}

/// Most lobes a tree may come to.
pub const MAX_LOBES: u32 = 1 << 20;
/// Most layers on any way from the root to a lobe.
pub const MAX_LAYERS: u16 = 256;

/// A tree that goes beyond a budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeError {
    /// More than [`MAX_LOBES`] lobes.
    TooManyLobes,
    /// Layers nested deeper than [`MAX_LAYERS`].
    TooDeep,
}

impl std::fmt::Display for TreeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            TreeError::TooManyLobes => write!(f, "the closure comes to more than {MAX_LOBES} lobes"),
            TreeError::TooDeep => write!(f, "layers are nested deeper than {MAX_LAYERS}"),
        }
    }
}

impl std::error::Error for TreeError {}

impl Default for ClosureTree {
    fn default() -> Self {
        ClosureTree::new()
    }
}

impl ClosureTree {
    /// A black tree.
    pub fn new() -> Self {
        let mut tree = ClosureTree { nodes: SmallVec::new(), slots: SmallVec::new(), root: NodeId(0), copy_of: 0 };
        tree.push(Node::Zero);
        tree
    }

    /// Back to black, keeping what memory there is.
    pub fn clear(&mut self) {
        self.nodes.truncate(1);
        self.slots.clear();
        self.root = NodeId(0);
        self.copy_of = 0;
    }

    /// Becomes a copy of the tree with this number; nothing is to do if it is one already.
    pub(crate) fn become_copy(&mut self, id: u64, other: &ClosureTree) {
        if self.copy_of == id {
            return;
        }
        self.clear();
        self.nodes.clear();
        self.nodes.extend_from_slice(&other.nodes);
        self.slots.extend_from_slice(&other.slots);
        self.root = other.root;
        self.copy_of = id;
    }

    /// Changes a direction among the parameters of a lobe.
    pub(crate) fn set_direction(&mut self, slot: u32, value: [f32; 3]) {
        self.slots[slot as usize..slot as usize + 3].copy_from_slice(&value);
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
        } else if let Node::Mul(inner, c) = self.node(c) {
            // Both are sane already, and so is their product: one node in place of two.
            self.mul(std::array::from_fn(|i| weight[i] * inner[i]), c)
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
        self.lobe_from(kind, site, values, std::iter::empty())
    }

    /// A lobe whose parameter block is `known` but for the slots in `open`.
    pub(crate) fn lobe_from(
        &mut self,
        kind: LobeKind,
        site: u32,
        known: &[f32],
        open: impl Iterator<Item = (u32, f32)>,
    ) -> NodeId {
        let start = self.slots.len();
        // A block is short: `extend_from_slice` would call to copy it.
        self.slots.extend(known.iter().copied());
        let slots = &mut self.slots[start..];
        for (slot, value) in open {
            slots[slot as usize] = value;
        }
        self.push(Node::Lobe { kind, site, slots: start as u32 })
    }

    /// Makes `root` the closure the tree stands for.
    pub fn set_root(&mut self, root: NodeId) {
        self.copy_of = 0;
        self.root = root;
    }

    /// The closure the tree stands for.
    pub fn root(&self) -> NodeId {
        self.root
    }

    /// What a node is.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()].0
    }

    /// The node made at this place, counted from the black one.
    pub(crate) fn id_at(&self, index: usize) -> NodeId {
        NodeId(index as u32)
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

    /// Every lobe node made: its site, kind and parameter block.
    pub fn lobes(&self) -> impl Iterator<Item = (u32, LobeKind, &[f32])> {
        self.nodes.iter().filter_map(|(n, _)| match *n {
            Node::Lobe { kind, site, slots } => Some((site, kind, self.values(kind, slots))),
            _ => None,
        })
    }

    /// Of every lobe node made: its site and where its values start.
    pub(crate) fn lobe_slots(&self) -> impl Iterator<Item = (u32, u32)> {
        self.nodes.iter().filter_map(|(n, _)| match *n {
            Node::Lobe { site, slots, .. } => Some((site, slots)),
            _ => None,
        })
    }

    /// The terms of a sum, in order, sums within it dissolved; of anything else that alone. Not recursive: a long sum is not
    /// a deep one.
    pub fn terms(&self, id: NodeId) -> Vec<NodeId> {
        let (mut found, mut waiting) = (Vec::new(), vec![id]);
        while let Some(id) = waiting.pop() {
            match self.node(id) {
                Node::Add(a, b) => waiting.extend([b, a]),
                _ => found.push(id),
            }
        }
        found
    }

    /// What a node comes to, written out.
    pub fn size(&self, id: NodeId) -> Size {
        self.nodes[id.index()].1
    }

    /// Whether the tree is within [`MAX_LOBES`] and [`MAX_LAYERS`].
    pub fn within_budget(&self) -> Result<(), TreeError> {
        let size = self.size(self.root);
        if size.layers > MAX_LAYERS {
            Err(TreeError::TooDeep)
        } else if size.lobes > MAX_LOBES {
            Err(TreeError::TooManyLobes)
        } else {
            Ok(())
        }
    }

    fn push(&mut self, node: Node) -> NodeId {
        let id = NodeId(self.nodes.len() as u32);
        let size = match node {
            Node::Zero => Size::default(),
            Node::Lobe { .. } => Size { lobes: 1, layers: 0, depth: 1 },
            Node::Mul(_, c) => self.size(c).below(1),
            Node::Add(a, b) => {
                let is_sum = |id| matches!(self.node(id), Node::Add(..));
                let part = |id| self.size(id).below(u32::from(!is_sum(id)));
                part(a).beside(part(b))
            }
            Node::Layer { top, base } => {
                let size = self.size(top).beside(self.size(base)).below(1);
                Size { layers: size.layers.saturating_add(1), ..size }
            }
        };
        self.nodes.push((node, size));
        self.copy_of = 0;
        id
    }
}

/// NaN and negative weights are black, the rest stays below [`MAX_WEIGHT`].
fn sane_weight(w: f32) -> f32 {
    if w > 0.0 { w.min(MAX_WEIGHT) } else { 0.0 }
}
