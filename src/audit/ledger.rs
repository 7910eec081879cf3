//! Where the light goes: every part of it accounted for, so that the sum is one.
//!
//! Of the light that is offered to a layer, its top scatters E_top. The rest is offered to the base, except what the
//! tint rule withholds: it dims all channels by the largest. What the base does with it alone is known; what it does
//! under the top is less, because `min` passes less than 1 − E_top and because bounds lie above albedos: that is lost.
//! What a top does not scatter is not absorbed by it; it passes on.

use crate::closure::{ClosureTree, Layering, Node, NodeId, TintRule};
use crate::lobes::registry::LobeClass;
use crate::lobes::{LobeKind, Rgb};

/// What one layer does with the light offered to it. All per channel, as parts of the light that meets the material.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerShare {
    /// The lobes in its top.
    pub top: Vec<LobeKind>,
    /// What is offered to the layer.
    pub offered: Rgb<f64>,
    /// What its top scatters of that: E_top. Part of what the lobes scatter, and none of what is lost.
    pub taken: Rgb<f64>,
    /// Withheld from the base by the tint rule, though the top does not scatter it.
    pub tint: Rgb<f64>,
    /// What the base would scatter if it were given all of 1 − E_top, less what it does.
    pub lost: Rgb<f64>,
}

/// Where the light that meets a material goes. What the lobes scatter (see [`super::breakdown`]), what layers withhold
/// and lose, and what is absorbed add up to one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Layer by layer, from the outermost; not those within a top, whose part is in its E_top.
    pub layers: Vec<LayerShare>,
    /// By weights below one; negative where a tree is over its budget.
    pub absorbed_by_weights: Rgb<f64>,
    /// By lobes whose albedo is below one.
    pub absorbed_by_lobes: Rgb<f64>,
}

/// Accounts for the light that leaves toward one ωo: `albedo` measures E_view there of the tree and of its parts.
pub fn ledger(tree: &ClosureTree, albedo: impl Fn(&ClosureTree) -> Rgb<f64>, layering: Layering) -> Ledger {
    let measure = |node: NodeId| {
        let mut part = tree.clone();
        part.set_root(node);
        albedo(&part)
    };
    let mut keeper = Keeper { tree, measure, layering, ledger: Ledger::default() };
    let mut waiting = vec![(tree.root(), [1.0; 3])];
    while let Some((node, offered)) = waiting.pop() {
        keeper.account(node, offered, &mut waiting);
    }
    keeper.ledger
}

struct Keeper<'t, F> {
    tree: &'t ClosureTree,
    measure: F,
    layering: Layering,
    ledger: Ledger,
}

impl<F: Fn(NodeId) -> Rgb<f64>> Keeper<'_, F> {
    /// Writes down what becomes of `offered` in a node itself; what it offers to others goes to `waiting`.
    fn account(&mut self, node: NodeId, offered: Rgb<f64>, waiting: &mut Vec<(NodeId, Rgb<f64>)>) {
        let times = |a: Rgb<f64>, b: Rgb<f64>| std::array::from_fn(|c| a[c] * b[c]);
        let minus = |a: Rgb<f64>, b: Rgb<f64>| std::array::from_fn(|c| a[c] - b[c]);
        match self.tree.node(node) {
            Node::Zero => self.by_weights(offered),
            Node::Lobe { kind, .. } if kind.class() == LobeClass::Emission => self.by_weights(offered),
            Node::Lobe { kind, slots, .. } => {
                let given = times(offered, kind.weight(self.tree.values(kind, slots)).map(f64::from));
                self.by_weights(minus(offered, given));
                let absorbed = minus(given, times(offered, (self.measure)(node)));
                for c in 0..3 {
                    self.ledger.absorbed_by_lobes[c] += absorbed[c];
                }
            }
            Node::Mul(weight, closure) => {
                let given = times(offered, weight.map(f64::from));
                self.by_weights(minus(offered, given));
                waiting.push((closure, given));
            }
            Node::Add(a, b) => {
                // Both terms account for all of it.
                self.by_weights(offered.map(|x| -x));
                waiting.extend([(b, offered), (a, offered)]);
            }
            Node::Layer { top, base } => {
                let [of_top, of_base, together] = [top, base, node].map(&self.measure);
                let largest = of_top[0].max(of_top[1]).max(of_top[2]);
                let kept: Rgb<f64> = match self.layering.tint {
                    TintRule::Largest => [largest; 3],
                    TintRule::Channel => of_top,
                };
                let passed = kept.map(|e| (1.0 - e).max(0.0));
                let alone = times(passed, of_base);
                self.ledger.layers.push(LayerShare {
                    top: lobes_of(self.tree, top),
                    offered,
                    taken: times(offered, of_top),
                    tint: times(offered, minus(minus([1.0; 3], of_top), passed)),
                    lost: times(offered, minus(alone, minus(together, of_top))),
                });
                waiting.push((base, times(offered, passed)));
            }
        }
    }

    fn by_weights(&mut self, part: Rgb<f64>) {
        for c in 0..3 {
            self.ledger.absorbed_by_weights[c] += part[c];
        }
    }
}

/// The kinds of lobe below a node, each once.
fn lobes_of(tree: &ClosureTree, node: NodeId) -> Vec<LobeKind> {
    let (mut found, mut waiting) = (Vec::new(), vec![node]);
    while let Some(next) = waiting.pop() {
        match tree.node(next) {
            Node::Zero => {}
            Node::Lobe { kind, .. } if found.contains(&kind) => {}
            Node::Lobe { kind, .. } => found.push(kind),
            Node::Mul(_, c) => waiting.push(c),
            Node::Add(a, b) | Node::Layer { top: a, base: b } => waiting.extend([b, a]),
        }
    }
    found
}
