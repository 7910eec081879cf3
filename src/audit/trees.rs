//! Random closure trees that are budgeted: their weights sum to at most one wherever light is shared out.
//!
//! In: a seeded generator and a [`Pool`] of lobes whose albedo tables are baked once for many trees. Out: a [`Recipe`],
//! which builds a [`ClosureTree`]. Every registered lobe takes part, over its whole declared range; sums, layers,
//! weighted layers and sums as tops are nested up to [`MAX_DEPTH`] deep.

use crate::closure::{ClosureTree, NodeId};
use crate::lobes::registry::{LobeClass, ParamSpec, ParamTy};
use crate::lobes::{LobeKind, Rgb32};
use rand::{Rng, RngExt};
use std::f32::consts::TAU;

/// Nodes on the longest way down a random tree.
pub const MAX_DEPTH: u32 = 8;
/// Most lobes of a random tree.
const MAX_TREE_LOBES: u32 = 48;
/// Most terms of a random sum.
const MAX_TERMS: u32 = 40;
/// Instances of each lobe whose table depends on its parameters.
const TABLED: usize = 4;

/// How to build a tree, as a value that can be printed, compared and shrunk.
#[derive(Clone, Debug, PartialEq)]
pub enum Recipe {
    /// A lobe with its parameter block.
    Lobe {
        /// Which lobe.
        kind: LobeKind,
        /// Where its albedo table is kept.
        site: u32,
        /// Its values, in declared order.
        values: Vec<f32>,
    },
    /// A closure scaled per channel.
    Weighted(Rgb32, Box<Recipe>),
    /// Terms added one after the other: from the first on, so that the sum leans left, or from the last.
    Sum {
        /// At least one.
        terms: Vec<Recipe>,
        /// Whether the last two terms are added first.
        leans_right: bool,
    },
    /// The first over the second.
    Layer(Box<Recipe>, Box<Recipe>),
}

impl Recipe {
    /// The tree it describes.
    pub fn tree(&self) -> ClosureTree {
        let mut tree = ClosureTree::new();
        let root = self.build(&mut tree);
        tree.set_root(root);
        tree
    }

    fn build(&self, tree: &mut ClosureTree) -> NodeId {
        match self {
            Recipe::Lobe { kind, site, values } => tree.lobe(*kind, *site, values),
            Recipe::Weighted(weight, closure) => {
                let closure = closure.build(tree);
                tree.mul(*weight, closure)
            }
            Recipe::Sum { terms, leans_right } => {
                let terms: Vec<NodeId> = terms.iter().map(|t| t.build(tree)).collect();
                if *leans_right {
                    terms.iter().rev().fold(tree.zero(), |sum, term| tree.add(*term, sum))
                } else {
                    terms.iter().fold(tree.zero(), |sum, term| tree.add(sum, *term))
                }
            }
            Recipe::Layer(top, base) => {
                let (top, base) = (top.build(tree), base.build(tree));
                tree.layer(top, base)
            }
        }
    }

    /// B, the largest share of the light any channel is given where it meets the tree: a lobe claims 1, a sum the sum
    /// of its terms, a layer what the greater of its parts claims, emission nothing. At most one at the root and at each
    /// layer's top and base makes a tree budgeted.
    pub fn budget(&self) -> [f64; 3] {
        match self {
            Recipe::Lobe { kind, .. } if kind.class() == LobeClass::Emission => [0.0; 3],
            Recipe::Lobe { .. } => [1.0; 3],
            Recipe::Weighted(weight, closure) => {
                let b = closure.budget();
                std::array::from_fn(|c| weight[c] as f64 * b[c])
            }
            Recipe::Sum { terms, .. } => terms.iter().fold([0.0; 3], |sum, term| {
                let b = term.budget();
                std::array::from_fn(|c| sum[c] + b[c])
            }),
            Recipe::Layer(top, base) => {
                let (a, b) = (top.budget(), base.budget());
                std::array::from_fn(|c| a[c].max(b[c]))
            }
        }
    }
}

/// Lobes that trees draw from: their numbers are fixed where an albedo table is made for them, so that one table serves
/// many trees; everything else is drawn for each tree.
#[derive(Clone, Debug)]
pub struct Pool {
    entries: Vec<Entry>,
    /// The entries of each kind, as a range.
    kinds: Vec<std::ops::Range<usize>>,
}

/// A lobe of a pool.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Which lobe.
    pub kind: LobeKind,
    /// Its parameter block: `None` where a tree chooses, as for a parameter that varies over a material.
    pub known: Vec<Option<f32>>,
}

impl Pool {
    /// Draws the lobes; colors, normals and tangents stay open in all of them, numbers in some.
    pub fn random(rng: &mut impl Rng) -> Pool {
        let (mut entries, mut kinds) = (Vec::new(), Vec::new());
        for &kind in LobeKind::ALL {
            let open = vec![None; kind.spec().slot_count()];
            let start = entries.len();
            // A lobe without tables may have any numbers at any time.
            let tabled = !kind.spec().params.is_empty() && needs_table(kind, &open);
            if tabled {
                entries.extend((0..TABLED).map(|k| Entry { kind, known: known_values(kind, k == 0, rng) }));
            } else {
                entries.push(Entry { kind, known: open });
            }
            kinds.push(start..entries.len());
        }
        Pool { entries, kinds }
    }

    /// The lobes; a tree's site is an index into this.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Whether a number of a parameter block is left open by the lobe's table.
    pub fn varies(&self, site: u32, slot: usize) -> bool {
        self.entries.get(site as usize).is_some_and(|e| e.known[slot].is_none())
    }

    /// Whether a lobe needs no table: most of those reflect or pass all light at every angle.
    fn always_white(&self, site: u32) -> bool {
        let kind = self.entries[site as usize].kind;
        let one = LobeKind::ALL.iter().zip(&self.kinds).any(|(k, entries)| *k == kind && entries.len() == 1);
        kind.class() != LobeClass::Emission && one
    }

    /// A tree of this pool's lobes, with the shading normals within 60° of +z.
    pub fn tree(&self, rng: &mut impl Rng) -> Recipe {
        let mut draw = Draw::new(self, rng);
        let depth = draw.rng.random_range(1..=MAX_DEPTH);
        let tree = draw.node(depth);
        match draw.rng.random_range(0..4) {
            0 => Recipe::Weighted(draw.color(), Box::new(tree)),
            _ => tree,
        }
    }
}

/// Whether a table is made when all numbers are known or when none are.
fn needs_table(kind: LobeKind, open: &[Option<f32>]) -> bool {
    let lowest: Vec<Option<f32>> =
        kind.spec().params.iter().flat_map(|p| (0..p.ty.slots()).map(|_| Some(p.min.max(0.0)))).collect();
    kind.table(&lowest).is_some() || kind.table(open).is_some()
}

/// A block whose switches are chosen, and whose numbers are too unless it `varies`: then one is left open, or all.
fn known_values(kind: LobeKind, varies: bool, rng: &mut impl Rng) -> Vec<Option<f32>> {
    let params = kind.spec().params;
    let floats: Vec<usize> = (0..params.len()).filter(|i| params[*i].ty == ParamTy::Float).collect();
    let all = rng.random_range(0..4) == 0;
    let one = if floats.is_empty() { None } else { Some(floats[rng.random_range(0..floats.len())]) };
    let mut known = Vec::new();
    for (i, p) in params.iter().enumerate() {
        match p.ty {
            ParamTy::Float if varies && (all || one == Some(i)) => known.push(None),
            ParamTy::Float | ParamTy::Int | ParamTy::String => known.push(Some(value(p, rng))),
            _ => known.extend(vec![None; p.ty.slots()]),
        }
    }
    known
}

/// A number in the declared range: anywhere, close to its lower end, or at an end or the default.
fn value(p: &ParamSpec, rng: &mut impl Rng) -> f32 {
    if p.ty == ParamTy::String && p.options.is_empty() {
        // A name is as good as any other.
        return p.default.first().copied().unwrap_or(0.0);
    }
    let (lo, hi) = (p.min.max(-10.0), p.max.min(1e3));
    if matches!(p.ty, ParamTy::Int | ParamTy::String) {
        return lo + (rng.random::<f32>() * (hi - lo + 1.0)).floor().min(hi - lo);
    }
    let t = match rng.random_range(0..8) {
        0 => 0.0,
        1 => 1.0,
        2 | 3 => rng.random::<f32>().powi(6),
        4 => return p.default.first().copied().unwrap_or(lo),
        _ => rng.random(),
    };
    p.clamp(0, lo + (hi - lo) * t)
}

/// What one tree is drawn with.
struct Draw<'p, 'r, R> {
    pool: &'p Pool,
    rng: &'r mut R,
    /// A few of each, shared by the lobes of a tree as the layers of a material share them.
    normals: Vec<[f32; 3]>,
    tangents: Vec<[f32; 3]>,
    /// Weights are white and use the whole budget: the hardest case.
    white: bool,
    lobes: u32,
}

impl<'p, 'r, R: Rng> Draw<'p, 'r, R> {
    fn new(pool: &'p Pool, rng: &'r mut R) -> Self {
        let count = rng.random_range(1..4);
        let mut normals = vec![[0.0, 0.0, 1.0]];
        let mut tangents = vec![[1.0, 0.0, 0.0]];
        for _ in 1..count {
            let (cos, phi): (f32, f32) = (0.5 + 0.5 * rng.random::<f32>(), TAU * rng.random::<f32>());
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            normals.push([sin * phi.cos(), sin * phi.sin(), cos]);
            tangents.push(std::array::from_fn(|_| 2.0 * rng.random::<f32>() - 1.0));
        }
        let white = rng.random_range(0..2) == 0;
        Draw { pool, rng, normals, tangents, white, lobes: 0 }
    }

    /// A closure that claims at most one in every channel.
    fn node(&mut self, depth: u32) -> Recipe {
        if depth <= 1 || self.lobes + 2 > MAX_TREE_LOBES {
            return self.lobe();
        }
        match self.rng.random_range(0..16) {
            0 | 1 => self.lobe(),
            2 => Recipe::Weighted(self.color(), Box::new(self.node(depth - 1))),
            3..=6 => self.sum(depth - 1),
            _ => {
                let (upper, lower) = self.depths(depth - 1);
                let mut top = self.node(upper);
                // White paint in full weight hides its base.
                let hides = matches!(&top, Recipe::Lobe { site, .. } if self.pool.always_white(*site));
                if hides && self.rng.random_range(0..8) > 0 {
                    top = Recipe::Weighted([self.rng.random(); 3], Box::new(top));
                } else if self.rng.random_range(0..4) == 0 {
                    top = Recipe::Weighted(self.color(), Box::new(top));
                }
                Recipe::Layer(Box::new(top), Box::new(self.node(lower)))
            }
        }
    }

    /// Depths of two parts: one is as deep as can be, the other rarely.
    fn depths(&mut self, depth: u32) -> (u32, u32) {
        let other = if self.rng.random_range(0..6) == 0 { depth } else { depth.min(2) };
        if self.rng.random_range(0..3) == 0 { (depth, other) } else { (other, depth) }
    }

    /// Terms that share the whole budget, or a random part of it, channel by channel.
    fn sum(&mut self, depth: u32) -> Recipe {
        let room = MAX_TREE_LOBES - self.lobes;
        let most = if self.rng.random_range(0..12) == 0 { MAX_TERMS } else { 4 };
        let count = self.rng.random_range(2..=most.min(room).max(2)) as usize;
        let budget: Rgb32 = if self.white { [1.0; 3] } else { self.color() };
        let mut weights = vec![[0.0f32; 3]; count];
        let same = self.white || self.rng.random();
        let mut shares = Vec::new();
        for c in 0..3 {
            if shares.is_empty() || !same {
                shares = self.shares(count);
            }
            for (w, share) in weights.iter_mut().zip(&shares) {
                w[c] = budget[c] * share;
            }
        }
        // One term is as deep as can be.
        let deep = self.rng.random_range(0..count);
        let term = |(k, w)| {
            let depth = if k == deep { depth } else { self.depths(depth).0.min(if count > 6 { 1 } else { 2 }) };
            Recipe::Weighted(w, Box::new(self.node(depth)))
        };
        let terms = weights.into_iter().enumerate().map(term).collect();
        Recipe::Sum { terms, leans_right: self.rng.random_range(0..3) == 0 }
    }

    /// Numbers that sum to one, some of them zero.
    fn shares(&mut self, count: usize) -> Vec<f32> {
        let mut parts: Vec<f64> = (0..count)
            .map(|_| if self.rng.random_range(0..10) == 0 { 0.0 } else { self.rng.random::<f64>() + 1e-3 })
            .collect();
        let total: f64 = parts.iter().sum();
        if total <= 0.0 {
            parts[0] = 1.0;
        }
        let total = total.max(1e-3);
        parts.iter().map(|p| (p / total).min(1.0) as f32).collect()
    }

    fn lobe(&mut self) -> Recipe {
        self.lobes += 1;
        // What passes all light, or none, makes poor trees: a quarter as often as the rest.
        let site = loop {
            let kind = &self.pool.kinds[self.rng.random_range(0..self.pool.kinds.len())];
            let site = self.rng.random_range(kind.clone());
            let scatters = self.pool.entries[site].kind.class() == LobeClass::Scatter;
            if scatters || self.rng.random_range(0..4) == 0 {
                break site;
            }
        };
        let entry = &self.pool.entries[site];
        let mut values = Vec::with_capacity(entry.known.len());
        for p in entry.kind.spec().params {
            match p.ty {
                ParamTy::Normal => values.extend(self.normals[self.rng.random_range(0..self.normals.len())]),
                ParamTy::Vector => values.extend(self.tangents[self.rng.random_range(0..self.tangents.len())]),
                ParamTy::Color => {
                    let color = self.color();
                    values.extend((0..3).map(|c| p.clamp(c, color[c])));
                }
                _ => match entry.known[values.len()] {
                    Some(v) => values.push(v),
                    None => values.push(value(p, self.rng)),
                },
            }
        }
        Recipe::Lobe { kind: entry.kind, site: site as u32, values }
    }

    /// In [0, 1] per channel: often white in white trees, sometimes with channels of zero.
    fn color(&mut self) -> Rgb32 {
        let white = if self.white { 5 } else { 1 };
        match self.rng.random_range(0..6) {
            k if k < white => [1.0; 3],
            4 => std::array::from_fn(|_| if self.rng.random() { 1.0 } else { 0.0 }),
            5 => [self.rng.random(); 3],
            _ => std::array::from_fn(|_| self.rng.random()),
        }
    }
}
