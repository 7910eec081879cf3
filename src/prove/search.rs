//! Branch and bound: a region whose bound is too large is halved, along the variable that helps most, until every part
//! is bounded or the effort is spent. Deterministic: effort is counted in operations, not in seconds.

use super::energy::{Detail, Energy, Held, Loose, numbers_of, slots_of};
use super::graph::{Cid, Graph, Id, LeafKind, Node};
use super::interval::Interval;
use super::light;
use super::number::{Path, Region};
use super::trace::ENDLESS;
use crate::ir::body::GlobalVar;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// What a verdict of `conserves` allows above 1.
pub const TOLERANCE: f64 = 1e-4;
/// Rounding while a BSDF evaluates: products of a few single-precision factors.
const EVALUATION: f64 = 4e-6;
/// Questions decided along one path.
const DECISIONS: usize = 6;
/// At most this many directions to halve in are compared.
const CANDIDATES: usize = 6;
/// Ranges narrower than this part of the whole are not halved.
const NARROWEST: f64 = 1e-6;

/// A script's closures and what they depend on.
pub struct Problem<'a> {
    /// Numbers and closures.
    pub graph: &'a Graph,
    /// What `Ci` is left with.
    pub root: Cid,
    /// The bounds.
    pub energy: Energy<'a>,
    /// The leaves that matter, by index.
    pub leaves: Vec<u32>,
    /// Whether the closures change with the direction they are seen from.
    pub looks_at_view: bool,
    /// Whether dot(N, I) is the cosine that the bounds go by.
    facing_held: bool,
}

/// Which albedo is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// With the viewer's direction held; where nothing looks at the view and layers dim both sides alike, either.
    View,
    /// With the light's direction held.
    Light,
}

/// A direction to halve a region in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Dim {
    Cos,
    Node(u32),
}

/// The bound of a region.
#[derive(Clone, Debug)]
pub struct Bounded {
    /// The region.
    pub region: Region,
    /// No albedo in it is larger.
    pub upper: f64,
    dims: Vec<Dim>,
}

/// How far a search came.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What is proven: no albedo is larger.
    pub upper: f64,
    /// What that part could not be told apart in: nodes whose range is still wide.
    pub open: Vec<Id>,
}

impl<'a> Problem<'a> {
    /// For the closures below `root`.
    pub fn new(graph: &'a Graph, root: Cid, energy: Energy<'a>) -> Self {
        let leaves: BTreeSet<u32> =
            numbers_of(graph, root).into_iter().flat_map(|id| graph.support(id).to_vec()).collect();
        let leaves: Vec<u32> = leaves.into_iter().collect();
        let kind = |l: &u32| graph.leaves[*l as usize].kind;
        let view = |l: &u32| matches!(kind(l), LeafKind::Facing | LeafKind::Global(GlobalVar::I, _));
        // A normal that turns with the view is reason enough.
        let turned = slots_of(graph, root).into_iter().any(|id| graph.support(id).iter().any(view));
        let looks_at_view = turned || leaves.iter().any(view);
        let from_n = energy.normal().is_none_or(|n| super::trace::global_of(graph, n) == Some(GlobalVar::N));
        Problem { graph, root, energy, leaves, looks_at_view, facing_held: from_n }
    }

    /// Whether weights, parameters other than directions, or conditions read the components of a global.
    pub fn reads_numbers_of(&self, global: GlobalVar) -> bool {
        let of = |id: &Id| {
            self.graph
                .support(*id)
                .iter()
                .any(|l| matches!(self.graph.leaves[*l as usize].kind, LeafKind::Global(g, _) if g == global))
        };
        numbers_of(self.graph, self.root).iter().any(of)
    }

    /// Everything at once.
    pub fn whole(&self) -> Region {
        Region { ranges: BTreeMap::new(), cos: Interval::new(-1.0, 1.0) }
    }

    /// Bounds a region; adds the operations it took to `work`.
    pub fn bound(&self, region: Region, which: Which, detail: Detail, work: &mut usize) -> Bounded {
        let mut loose = Loose::new();
        let upper = match which {
            Which::Light if self.looks_at_view && self.energy.sides_alike() => {
                light::upper(self, &region, detail, &mut loose, work)
            }
            _ => {
                let undimmed = which == Which::Light && !self.energy.sides_alike();
                let held = if undimmed { Held::LightUndimmed } else { Held::Viewer };
                let mut path = Path::new(self.graph, &region, self.facing_held, DECISIONS);
                self.upper(&mut path, detail, held, &mut loose, work)
            }
        };
        let dims = self.dims(&region, &loose, detail);
        Bounded { region, upper: upper * (1.0 + EVALUATION), dims }
    }

    /// The largest bound over all paths and channels.
    pub fn upper(&self, path: &mut Path<'_>, detail: Detail, held: Held, loose: &mut Loose, work: &mut usize) -> f64 {
        let mut upper = 0.0f64;
        loop {
            let bound = self.energy.bound(path, self.root, detail, held, loose);
            if !path.is_impossible() {
                for poly in &bound.most {
                    let most = path.upper(poly) + bound.error;
                    upper = upper.max(if most.is_nan() { f64::INFINITY } else { most });
                    for (v, degree) in poly.degrees() {
                        if degree > 1 || !matches!(self.graph.node(Id(v)), Node::Leaf(_)) {
                            loose.insert(v);
                        }
                    }
                }
                loose.extend(path.questions().map(|q| q.0));
            }
            if !path.next() {
                break;
            }
        }
        *work += path.work;
        upper
    }

    fn dims(&self, region: &Region, loose: &Loose, detail: Detail) -> Vec<Dim> {
        let mut dims = BTreeSet::new();
        if detail == Detail::Fine && region.cos.width() > 1e-4 {
            dims.insert(Dim::Cos);
        }
        for v in loose {
            let support = self.graph.support(Id(*v));
            let endless = support.iter().any(|l| self.is_endless(*l));
            for leaf_index in support {
                let leaf = &self.graph.leaves[*leaf_index as usize];
                let held = leaf.kind == LeafKind::Facing && self.facing_held;
                if held {
                    dims.insert(Dim::Cos);
                } else if !self.is_endless(*leaf_index) {
                    dims.insert(Dim::Node(leaf.id.0));
                }
            }
            if endless && !matches!(self.graph.node(Id(*v)), Node::Leaf(_)) {
                dims.insert(Dim::Node(*v));
            }
        }
        let mut wide: Vec<(f64, Dim)> = dims.into_iter().map(|d| (self.width(region, d), d)).collect();
        wide.retain(|(width, _)| *width > NARROWEST);
        wide.sort_by(|a, b| b.0.total_cmp(&a.0));
        wide.into_iter().take(CANDIDATES).map(|(_, d)| d).collect()
    }

    /// Whether a leaf may be anything.
    fn is_endless(&self, leaf: u32) -> bool {
        self.graph.leaves[leaf as usize].range.width() >= ENDLESS
    }

    fn range(&self, region: &Region, v: u32) -> Interval {
        if let Some(range) = region.ranges.get(&v) {
            return *range;
        }
        match self.graph.node(Id(v)) {
            Node::Leaf(leaf) => self.graph.leaves[leaf as usize].range,
            // What it can be without knowing anything.
            _ => {
                let whole = self.whole();
                Path::new(self.graph, &whole, self.facing_held, 0).number(Id(v)).range
            }
        }
    }

    /// Part of the whole range that is left.
    fn width(&self, region: &Region, dim: Dim) -> f64 {
        match dim {
            Dim::Cos => fourth_root(region.cos.hi) - fourth_root(region.cos.lo),
            Dim::Node(v) => {
                let whole = self.range(&self.whole(), v).width();
                let now = self.range(region, v).width();
                if now.is_finite() && whole > 0.0 { now / whole } else { 0.0 }
            }
        }
    }

    fn halves(&self, region: &Region, dim: Dim) -> [Region; 2] {
        let mut halves = [region.clone(), region.clone()];
        match dim {
            Dim::Cos => {
                let Interval { lo, hi, .. } = region.cos;
                let root = 0.5 * (fourth_root(lo) + fourth_root(hi));
                let at = if lo < 0.0 && hi > 0.0 { 0.0 } else { root.signum() * root.powi(4) };
                halves[0].cos = Interval::new(lo, at);
                halves[1].cos = Interval::new(at, hi);
            }
            Dim::Node(v) => {
                let range = self.range(region, v);
                let whole = matches!(self.graph.node(Id(v)), Node::Leaf(l) if self.graph.leaves[l as usize].whole);
                let at = if whole { range.middle().floor() } else { range.middle() };
                let above = if whole { at + 1.0 } else { at };
                halves[0].ranges.insert(v, Interval::new(range.lo, at));
                halves[1].ranges.insert(v, Interval::new(above.min(range.hi), range.hi));
            }
        }
        halves
    }

    /// Bounds the whole domain with an effort of about `most` operations. `probe` is called with the worst region now
    /// and then, and ends the search by returning true.
    pub fn search(&self, which: Which, detail: Detail, most: usize, mut probe: impl FnMut(&Region) -> bool) -> Outcome {
        let mut work = 0;
        let mut heap = BinaryHeap::from([self.bound(self.whole(), which, detail, &mut work)]);
        // Parts that cannot be halved any more.
        let mut stuck: Vec<Bounded> = Vec::new();
        let mut round = 0usize;
        while let Some(worst) = heap.pop() {
            let done = worst.upper <= 1.0 + 0.5 * TOLERANCE;
            if done || work > most || ((round == 0 || round.is_power_of_two()) && probe(&worst.region)) {
                heap.push(worst);
                break;
            }
            round += 1;
            match self.best_halves(&worst, which, detail, &mut work) {
                Some(halves) => heap.extend(halves),
                None => {
                    let give_up = worst.upper > 1.0 + TOLERANCE;
                    stuck.push(worst);
                    if give_up {
                        break;
                    }
                }
            }
        }
        let worst = heap.into_iter().chain(stuck).max();
        match worst {
            Some(worst) => Outcome { upper: worst.upper, open: self.open(&worst) },
            None => Outcome { upper: 0.0, open: vec![] },
        }
    }

    fn open(&self, worst: &Bounded) -> Vec<Id> {
        let node = |d: &Dim| match d {
            Dim::Node(v) => Some(Id(*v)),
            Dim::Cos => None,
        };
        worst.dims.iter().filter_map(node).collect()
    }

    /// The halves along the dimension that lowers the bound most.
    fn best_halves(&self, worst: &Bounded, which: Which, detail: Detail, work: &mut usize) -> Option<[Bounded; 2]> {
        let mut best: Option<((f64, f64), [Bounded; 2])> = None;
        for dim in &worst.dims {
            let halves = self.halves(&worst.region, *dim).map(|h| self.bound(h, which, detail, work));
            let bounds = [halves[0].upper, halves[1].upper].map(|u| u.min(worst.upper));
            let key = (bounds[0].max(bounds[1]), bounds[0] + bounds[1]);
            if best.as_ref().is_none_or(|b| key < b.0) {
                best = Some((key, halves));
            }
            // Good enough: compare no more.
            if key.0 <= 1.0 + 0.5 * TOLERANCE {
                break;
            }
        }
        best.map(|(_, halves)| halves)
    }
}

fn fourth_root(x: f64) -> f64 {
    x.signum() * x.abs().powf(0.25)
}

impl PartialEq for Bounded {
    fn eq(&self, o: &Self) -> bool {
        self.cmp(o).is_eq()
    }
}
impl Eq for Bounded {}
impl PartialOrd for Bounded {
    fn partial_cmp(&self, o: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Bounded {
    fn cmp(&self, o: &Self) -> std::cmp::Ordering {
        let size = |b: &Bounded| b.region.ranges.values().map(|r| r.width()).sum::<f64>() + b.region.cos.width();
        self.upper.total_cmp(&o.upper).then_with(|| size(self).total_cmp(&size(o)))
    }
}
