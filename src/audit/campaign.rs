//! Does any random tree gain energy? A campaign measures one albedo of each of many trees: with a random tier, layering
//! rule, tint rule, side and direction; only on sides where the rule promises not to gain.
//!
//! Trees are numbered; [`BLOCK`] of them share a pool of lobes and a tier. What tree number k is and how it is looked
//! at depends on the seed and k alone, not on how many trees there are, on threads or on the order.
//!
//! Most trees are far from one, and a quick estimate says so. Where it may reach one at four standard deviations it is
//! repeated with four times the samples; where that may too, adaptive quadrature decides. Quadrature and sampling
//! must agree, or both stay below the limit: each may miss a narrow peak, but hardly the same one.

use super::cubature::Tolerance;
use super::estimate::{Estimate, direction_of, estimate, held_direction};
use super::furnace::{Albedo, Side, albedo_until};
use super::script::script;
use super::trees::{Pool, Recipe};
use crate::albedo::Precision;
use crate::closure::{
    Balancer, Bsdf, ClosureTree, Curves, Layering, LayeringRule, TableCache, Tables, TintRule, flatten,
};
use crate::engine::Tier;
use crate::globals::Globals;
use crate::optics::{Scalar, V3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Trees that share a pool of lobes and a tier.
pub const BLOCK: u64 = 8192;
/// An albedo above this, by more than its error, is a gain.
pub const LIMIT: f64 = 1.0 + 1e-4;
/// Nodes of the scales that are solved for each tree under `balanced`: fewer than a material has, for speed. Coarse
/// tables are the harder test.
const SCALE_NODES: usize = 24;
/// How many cases a [`Tally`] keeps.
const KEPT: usize = 10;
/// Albedos from which [`Tally::above`] counts.
pub const LEVELS: [f64; 4] = [0.5, 0.9, 0.99, 0.999];
/// Standard deviations that an estimate must stay below one, and that two measurements may lie apart.
const DEVIATIONS: f64 = 4.0;
/// Of the first and the second estimate: 288 samples, 1152 samples.
const EFFORTS: [usize; 2] = [1, 2];
/// What quadrature is to reach; it stops as soon as the albedo and its error are below the limit.
const TOLERANCE: Tolerance = Tolerance { error: 1e-5, evaluations: 600_000 };
/// Where it does not agree with the estimate, both are repeated with more, and without stopping.
const AGAIN: Tolerance = Tolerance { error: 1e-5, evaluations: 4_000_000 };
const EFFORT_AGAIN: usize = 24;
/// Where quadrature does not find what scatters within 1e-4 of the horizon, millions of samples decide.
const EFFORTS_LAST: [usize; 2] = [72, 216];

const SIDES: [Side; 2] = [Side::View, Side::Light];

/// Whether `rule` promises not to gain on `side`.
pub fn promises(rule: LayeringRule, side: Side) -> bool {
    rule != LayeringRule::View || side == Side::View
}

/// Which trees to measure, and in which tiers.
#[derive(Clone, Debug, PartialEq)]
pub struct Campaign {
    /// How many.
    pub trees: u64,
    /// Same seed, same trees.
    pub seed: u64,
    /// The tiers to choose from; at least one.
    pub tiers: Vec<Tier>,
}

impl Campaign {
    /// Blocks of trees.
    pub fn blocks(&self) -> u64 {
        self.trees.div_ceil(BLOCK)
    }

    /// The trees of a block, by number.
    pub fn trees_of(&self, block: u64) -> std::ops::Range<u64> {
        block * BLOCK..self.trees.min((block + 1) * BLOCK)
    }

    /// Draws a block's lobes and bakes their tables: seconds.
    pub fn block(&self, block: u64) -> Block {
        let mut rng = generator(self.seed, 0, block);
        let pool = Pool::random(&mut rng);
        let tier = self.tiers.get(rng.random_range(0..self.tiers.len().max(1))).copied().unwrap_or_default();
        let tables = match tier {
            Tier::Fast => PoolTables::Single(bake(&pool, Precision::FAST)),
            Tier::Standard => PoolTables::Single(bake(&pool, Precision::STANDARD)),
            Tier::Reference => PoolTables::Double(bake(&pool, Precision::REFERENCE)),
        };
        Block { seed: self.seed, tier, pool, tables, balancer: Balancer::with_nodes(SCALE_NODES) }
    }
}

/// A generator for one block (stream 0) or one tree (stream 1).
fn generator(seed: u64, stream: u64, number: u64) -> Pcg64Mcg {
    // Two rounds of SplitMix64, so that neighbouring numbers have nothing in common.
    let mix = |mut x: u64| {
        x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    Pcg64Mcg::seed_from_u64(mix(mix(seed).wrapping_add(2 * number + stream)))
}

fn bake<S: Scalar>(pool: &Pool, precision: Precision) -> Curves<S> {
    let mut curves = Curves::default();
    for (site, entry) in pool.entries().iter().enumerate() {
        curves.prepare(site as u32, entry.kind, &entry.known, precision, &TableCache::default());
    }
    curves
}

#[derive(Debug)]
enum PoolTables {
    Single(Curves<f32>),
    Double(Curves<f64>),
}

/// A pool of lobes with its tables, ready to measure trees from any number of threads.
#[derive(Debug)]
pub struct Block {
    seed: u64,
    tier: Tier,
    pool: Pool,
    tables: PoolTables,
    balancer: Balancer,
}

impl Block {
    /// Measures tree number `tree`, which must be one of this block's.
    pub fn measure(&self, tree: u64) -> Case {
        let mut rng = generator(self.seed, 1, tree);
        let recipe = self.pool.tree(&mut rng);
        let built = recipe.tree();
        let (cos, phi) = held_direction(&mut rng, &normals(&recipe));
        let pairs: Vec<(LayeringRule, Side)> =
            LayeringRule::ALL.iter().flat_map(|r| SIDES.map(|s| (*r, s))).filter(|(r, s)| promises(*r, *s)).collect();
        let (rule, side) = pairs[rng.random_range(0..pairs.len())];
        let mut case = Case {
            tree,
            tier: self.tier,
            layering: Layering { rule, tint: if rng.random() { TintRule::Largest } else { TintRule::Channel } },
            side,
            cos,
            phi,
            lobes: built.size(built.root()).lobes,
            albedo: Albedo { value: [0.0; 3], error: 0.0 },
            method: Method::Sampled,
            verdict: Verdict::Holds,
        };
        match &self.tables {
            PoolTables::Single(curves) => {
                case.settle(&built, curves, &self.balancer, &mut rng, Effort::Once);
                if case.verdict != Verdict::Holds {
                    // A peak α·cos wide, narrower than the directions of single precision lie, is integrated to nothing
                    // or to much: the same tables in double precision decide.
                    case.verdict = Verdict::Holds;
                    case.settle(&built, &curves.in_double(), &self.balancer, &mut rng, Effort::Twice);
                    case.method = Method::InDouble;
                }
            }
            PoolTables::Double(curves) => case.settle(&built, curves, &self.balancer, &mut rng, Effort::Twice),
        }
        case
    }

    /// A script that builds tree number `tree` of this block.
    pub fn script(&self, tree: u64) -> String {
        let built = self.pool.tree(&mut generator(self.seed, 1, tree)).tree();
        script(&built, |site, slot| self.pool.varies(site, slot))
    }
}

/// The normals of a tree's lobes, +z at least.
fn normals(recipe: &Recipe) -> Vec<[f32; 3]> {
    let mut found = vec![[0.0, 0.0, 1.0]];
    let mut waiting = vec![recipe];
    while let Some(next) = waiting.pop() {
        match next {
            Recipe::Lobe { kind, values, .. } => {
                let normal = kind.spec().normal_slot().map(|s| [values[s], values[s + 1], values[s + 2]]);
                found.extend(normal.filter(|n| !found.contains(n)));
            }
            Recipe::Weighted(_, closure) => waiting.push(closure),
            Recipe::Sum { terms, .. } => waiting.extend(terms),
            Recipe::Layer(top, base) => waiting.extend([&**top, &**base]),
        }
    }
    found
}

/// How an albedo was measured last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub enum Method {
    /// By 288 samples.
    Sampled,
    /// By 1152 samples.
    Resampled,
    /// By adaptive quadrature.
    Integrated,
    /// By adaptive quadrature in double precision, because single left no digits.
    InDouble,
}

/// Whether to try again where quadrature and samples disagree: not in single precision, where double will.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Effort {
    Once,
    Twice,
}

/// What a measurement says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing is gained.
    Holds,
    /// Sampling and quadrature disagree, or the error is too large to tell.
    Unresolved,
    /// Albedo − error > 1 + 1e-4.
    Gains,
}

/// One tree and how it was looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Its number.
    pub tree: u64,
    /// Precision of arithmetic and tables.
    pub tier: Tier,
    /// Rules of its layers.
    pub layering: Layering,
    /// Which direction is held.
    pub side: Side,
    /// Cosine of the held direction to Ng = +z.
    pub cos: f64,
    /// Its azimuth, in degrees from +x.
    pub phi: f64,
    /// Number of lobes.
    pub lobes: u32,
    /// What was measured; the error of a sampled albedo is one standard deviation.
    pub albedo: Albedo,
    /// How.
    pub method: Method,
    /// What it says.
    pub verdict: Verdict,
}

impl Case {
    fn settle<S: Scalar>(
        &mut self,
        tree: &ClosureTree,
        curves: &Curves<S>,
        balancer: &Balancer,
        rng: &mut Pcg64Mcg,
        effort: Effort,
    ) {
        let (globals, layering) = (Globals::default(), self.layering);
        let balanced = layering.rule == LayeringRule::Balanced;
        let balance = balanced.then(|| balancer.solve(tree, &globals, layering.tint, curves));
        let tables = Tables::<S> { curves, balance: balance.as_ref() };
        let subject = |wo: [S; 3]| {
            let wo = V3::new(wo[0], wo[1], wo[2]);
            // Random trees are far below any budget.
            flatten(tree, &globals, wo, layering, tables).unwrap_or_else(|_| Bsdf::black())
        };
        let w = direction_of(self.cos, self.phi).map(S::c);
        for (effort, method) in EFFORTS.into_iter().zip([Method::Sampled, Method::Resampled]) {
            let e = estimate(&subject, self.side, w, effort, rng);
            self.albedo = Albedo { value: e.value, error: e.sigma.into_iter().fold(0.0, f64::max) };
            self.method = method;
            if !e.may_reach_one(DEVIATIONS) {
                return;
            }
            if method == Method::Resampled {
                self.integrate(&subject, w, e, TOLERANCE, |a| a.max() + a.error <= LIMIT);
            }
        }
        if self.verdict == Verdict::Unresolved && effort == Effort::Twice {
            let e = estimate(&subject, self.side, w, EFFORT_AGAIN, rng);
            self.integrate(&subject, w, e, AGAIN, |_| false);
            for effort in EFFORTS_LAST {
                if self.verdict == Verdict::Unresolved {
                    self.judge(estimate(&subject, self.side, w, effort, rng), AGAIN);
                }
            }
        }
    }

    fn integrate<'m, S: Scalar>(
        &mut self,
        subject: &impl super::Subject<'m, S>,
        w: [S; 3],
        rough: Estimate,
        tolerance: Tolerance,
        enough: impl Fn(&Albedo) -> bool,
    ) {
        self.method = Method::Integrated;
        self.albedo = albedo_until(subject, self.side, w, tolerance, enough);
        self.judge(rough, tolerance);
    }

    /// What quadrature and samples say together.
    fn judge(&mut self, rough: Estimate, tolerance: Tolerance) {
        let Albedo { value, error } = self.albedo;
        let largest = self.albedo.max();
        // As exact as was asked for, and the limit lies within the error: no gain as far as can be told. A difference
        // below the limit's own slack decides nothing.
        let known = error <= tolerance.error || largest + error <= LIMIT || largest - error > LIMIT;
        let agrees = rough.agrees(value, error + (LIMIT - 1.0), 1.5 * DEVIATIONS);
        // Where they differ one of them is wrong; if nothing is gained by either, nothing is.
        let neither = largest + error <= LIMIT && rough.at_most(1.5 * DEVIATIONS) <= LIMIT;
        self.verdict = match known && (agrees || neither) {
            true if largest - error > LIMIT => Verdict::Gains,
            true => Verdict::Holds,
            false => Verdict::Unresolved,
        };
    }

    /// The arguments of `overcoat` that measure this case again, for a script in `file`.
    pub fn command(&self, file: &str) -> String {
        let lower = |name: String| name.to_lowercase();
        format!(
            "albedo {file} --tier {} --layering {} --tint-rule {} --side {} --cos={} --phi={}",
            lower(format!("{:?}", self.tier)),
            lower(format!("{:?}", self.layering.rule)),
            lower(format!("{:?}", self.layering.tint)),
            lower(format!("{:?}", self.side)),
            self.cos,
            self.phi
        )
    }

    /// Larger is worse: first what gains, then what cannot be told, then the larger albedo; ties by number.
    fn rank(&self) -> (u8, u8, f64) {
        let verdict = match self.verdict {
            Verdict::Gains => 2,
            Verdict::Unresolved => 1,
            Verdict::Holds => 0,
        };
        // A sampled albedo is only a rough one.
        (verdict, u8::from(self.method >= Method::Integrated), self.albedo.max() - self.albedo.error)
    }
}

/// Counts over the trees measured so far. Tallies of disjoint sets of trees can be merged in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Trees measured.
    pub trees: u64,
    /// Their lobes.
    pub lobes: u64,
    /// Measured with 1152 samples.
    pub resampled: u64,
    /// Measured by quadrature.
    pub integrated: u64,
    /// Of these, in double precision.
    pub in_double: u64,
    /// Where sampling and quadrature disagree or the error is too large.
    pub unresolved: u64,
    /// Gains.
    pub violations: u64,
    /// Trees whose albedo is above each of [`LEVELS`].
    pub above: [u64; LEVELS.len()],
    /// The worst, worst first.
    pub worst: Vec<Found>,
}

/// A case worth keeping.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The case.
    pub case: Case,
    /// The script that builds its tree.
    pub script: String,
}

impl Tally {
    /// Counts a case; `script` gives its script if it is one of the worst.
    pub fn add(&mut self, case: Case, script: impl FnOnce() -> String) {
        self.trees += 1;
        self.lobes += u64::from(case.lobes);
        self.resampled += u64::from(case.method != Method::Sampled);
        self.integrated += u64::from(case.method >= Method::Integrated);
        self.in_double += u64::from(case.method == Method::InDouble);
        self.unresolved += u64::from(case.verdict == Verdict::Unresolved);
        self.violations += u64::from(case.verdict == Verdict::Gains);
        for (count, level) in self.above.iter_mut().zip(LEVELS) {
            *count += u64::from(case.albedo.max() > level);
        }
        if self.worst.len() < KEPT || self.worst.last().is_some_and(|w| worse(&case, &w.case).is_lt()) {
            self.keep(Found { script: script(), case });
        }
    }

    /// Adds what another tally counted.
    pub fn merge(&mut self, other: Tally) {
        self.trees += other.trees;
        self.lobes += other.lobes;
        self.resampled += other.resampled;
        self.integrated += other.integrated;
        self.in_double += other.in_double;
        self.unresolved += other.unresolved;
        self.violations += other.violations;
        for (count, more) in self.above.iter_mut().zip(other.above) {
            *count += more;
        }
        other.worst.into_iter().for_each(|found| self.keep(found));
    }

    fn keep(&mut self, found: Found) {
        self.worst.push(found);
        self.worst.sort_by(|a, b| worse(&a.case, &b.case));
        self.worst.truncate(KEPT);
    }
}

/// The worse one first.
fn worse(a: &Case, b: &Case) -> std::cmp::Ordering {
    let (x, y) = (a.rank(), b.rank());
    y.0.cmp(&x.0).then(y.1.cmp(&x.1)).then(y.2.total_cmp(&x.2)).then(a.tree.cmp(&b.tree))
}
