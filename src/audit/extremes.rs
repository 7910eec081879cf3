//! Numerical stability: every lobe at the ends of its parameters and of its angles, alone and in layers, in every tier.
//!
//! Two questions. Is any result infinite, undefined or negative? And how far does rounding carry f from what the same
//! formulas over the same tables give with more digits: single precision against double, double against
//! [`DoubleDouble`]. What is left of an error after the rounding of the directions is subtracted is the formula's own.
//! Formulas that ask for double precision in every type (see [`Real::by_lane`](crate::optics::Real::by_lane)) are the
//! same in both, so that their own rounding is not seen in the reference tier.

mod draw;

use super::double_double::DoubleDouble;
use super::rounding;
use crate::albedo::Precision;
use crate::closure::{
    Balance, Balancer, Bsdf, ClosureTree, Curves, Eval, Layering, LayeringRule, TableCache, Tables, flatten,
};
use crate::engine::Tier;
use crate::globals::Globals;
use crate::lobes::LobeKind;
use crate::optics::{F32x8, Scalar, V3, frame};
use draw::{Block, Pair};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Pairs of directions that share a block of parameters.
pub const PAIRS: usize = 128;
/// An error counts where the truth is above this part of the largest seen with the same parameters.
pub const FLOOR: f64 = 1e-6;
/// Errors per block, largest first, of which the part that rounding makes is worked out: it takes a dozen evaluations each.
const EXAMINED: usize = 12;
/// Nodes of the scales that are solved for under `balanced`.
const SCALE_NODES: usize = 16;

/// What the lobe under test stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// Nothing but a weight.
    Alone,
    /// A layer over a diffuse surface.
    OverDiffuse,
    /// The base of a sheen.
    BelowSheen,
}

impl Setting {
    /// All of them.
    pub const ALL: [Setting; 3] = [Setting::Alone, Setting::OverDiffuse, Setting::BelowSheen];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Setting::Alone => "alone",
            Setting::OverDiffuse => "over diffuse",
            Setting::BelowSheen => "below sheen",
        }
    }
}

/// Which cases to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extremes {
    /// Same seed, same cases.
    pub seed: u64,
    /// Pairs of directions per row; rounded up to whole blocks of [`PAIRS`].
    pub cases: usize,
}

/// Where something was found.
#[derive(Clone, Debug)]
pub struct Place {
    /// Which result: "f", "pdf", "albedo" and so on.
    pub what: &'static str,
    /// The lobe's parameter block as a script passed it.
    pub values: Vec<f32>,
    /// What multiplies the lobe.
    pub weight: f32,
    /// Toward the viewer; the normal is +z, the tangent +x.
    pub wo: [f64; 3],
    /// Toward the light.
    pub wi: [f64; 3],
    /// What the tier gave; one number three times where the result has no channels.
    pub found: [f64; 3],
    /// What more digits give; NaN where nothing was compared.
    pub truth: [f64; 3],
}

/// The largest of something, and where.
#[derive(Clone, Debug, Default)]
pub struct Worst {
    /// Relative to the truth's brightest channel.
    pub error: f64,
    /// `None` while there is no error.
    pub at: Option<Place>,
}

/// What was found for one lobe, setting, layering rule and tier.
#[derive(Clone, Debug)]
pub struct Row {
    /// The lobe under test.
    pub lobe: LobeKind,
    /// What it stands in.
    pub setting: Setting,
    /// How its layer scales; of no matter to a lobe alone.
    pub rule: LayeringRule,
    /// Precision of arithmetic and tables.
    pub tier: Tier,
    /// Pairs of directions at which everything was evaluated.
    pub evaluations: u64,
    /// Results that are infinite, undefined or negative, one per pair at most, and one more in batches.
    pub faults: u64,
    /// The first of them.
    pub fault: Option<Place>,
    /// Pairs at which f counts as an error's reference; see [`FLOOR`].
    pub compared: u64,
    /// |f − truth|.
    pub error: Worst,
    /// |f − truth| less what [`rounding`] of both directions makes of it, of the largest errors.
    pub beyond: Worst,
}

impl Extremes {
    /// Measures one lobe: a row per setting, layering rule and tier. Seconds.
    pub fn measure(&self, kind: LobeKind) -> Vec<Row> {
        let number = LobeKind::ALL.iter().position(|k| *k == kind).unwrap_or(LobeKind::ALL.len());
        let mut rng =
            Pcg64Mcg::seed_from_u64(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number as u64));
        let mut rows = rows(kind);
        let shelf = Shelf::default();
        let mut kept = Vec::new();
        for _ in 0..self.cases.div_ceil(PAIRS) {
            let block = Block::random(kind, PAIRS, &mut rng);
            for row in &mut rows {
                let precision = if row.tier == Tier::Fast { Precision::FAST } else { Precision::STANDARD };
                let built = shelf.build(&block, row, precision);
                match row.tier {
                    Tier::Fast | Tier::Standard => {
                        row.look(&built, &built.cast::<f64>(), &block);
                        row.batches(&built, &block);
                    }
                    Tier::Reference => row.look(&built.cast::<f64>(), &built.cast::<DoubleDouble>(), &block),
                }
                // While somebody holds a table, others of the same lobe take it from the shelf.
                kept.push(built.curves);
            }
        }
        rows
    }
}

fn rows(kind: LobeKind) -> Vec<Row> {
    let mut rows = Vec::new();
    for setting in Setting::ALL {
        let rules = if setting == Setting::Alone { &LayeringRule::ALL[..1] } else { &LayeringRule::ALL[..] };
        for rule in rules {
            for tier in [Tier::Fast, Tier::Standard, Tier::Reference] {
                rows.push(Row {
                    lobe: kind,
                    setting,
                    rule: *rule,
                    tier,
                    evaluations: 0,
                    faults: 0,
                    fault: None,
                    compared: 0,
                    error: Worst::default(),
                    beyond: Worst::default(),
                });
            }
        }
    }
    rows
}

/// Tables that rows share.
#[derive(Default)]
struct Shelf {
    tables: TableCache<f32>,
}

impl Shelf {
    fn build(&self, block: &Block, row: &Row, precision: Precision) -> Built<f32> {
        let tree = block.tree(row.lobe, row.setting);
        let mut curves = Curves::default();
        for (site, kind, values) in tree.lobes() {
            curves.prepare(site, kind, &block.known(site, kind, values), precision, &self.tables);
        }
        let layering = Layering { rule: row.rule, ..Layering::default() };
        let solve = || Balancer::with_nodes(SCALE_NODES).solve(&tree, &Globals::default(), layering.tint, &curves);
        let balance = (row.rule == LayeringRule::Balanced).then(solve);
        Built { tree, curves, balance, layering }
    }
}

/// A tree with its tables in one number type.
struct Built<S: Scalar> {
    tree: ClosureTree,
    curves: Curves<S>,
    balance: Option<Balance<S>>,
    layering: Layering,
}

impl<S: Scalar> Built<S> {
    fn cast<T: Scalar>(&self) -> Built<T> {
        Built {
            tree: self.tree.clone(),
            curves: self.curves.cast(),
            balance: self.balance.as_ref().map(Balance::cast),
            layering: self.layering,
        }
    }

    /// Trees here are far below every budget; beyond one they would be black.
    fn bsdf(&self, wo: [S; 3]) -> Bsdf<'_, S> {
        let tables = Tables { curves: &self.curves, balance: self.balance.as_ref() };
        let wo = V3::new(wo[0], wo[1], wo[2]);
        flatten(&self.tree, &Globals::default(), wo, self.layering, tables).unwrap_or_else(|_| Bsdf::black())
    }

    /// Of directions that are made unit in this type, as the ones under test were in theirs: flattening does so with ωo,
    /// and a length that differs from ωi's would move a mirror's half vector out of a narrow peak.
    fn f(&self, wo: [S; 3], wi: [S; 3]) -> [S; 3] {
        let [x, y, z] = wi;
        let wi = frame::normalize(V3::new(x, y, z)).map_or(wi, |w| [w.x, w.y, w.z]);
        self.bsdf(wo).f(wi)
    }
}

/// An error worth looking into.
struct Candidate<'p> {
    pair: &'p Pair,
    channel: usize,
    error: f64,
    bright: f64,
    found: [f64; 3],
    truth: [f64; 3],
}

impl Row {
    fn look<S: Scalar, T: Scalar>(&mut self, built: &Built<S>, truth: &Built<T>, block: &Block) {
        let single = size_of::<S>() == size_of::<f32>();
        // Below, results have lost digits for being small, whatever was computed.
        let smallest = if single { f64::from(f32::MIN_POSITIVE) * 1e3 } else { f64::MIN_POSITIVE * 1e20 };
        let mut candidates = Vec::new();
        let mut peak = 0.0f64;
        for pair in &block.pairs {
            let [wo, wi] = [pair.wo, pair.wi].map(|w| w.map(S::c));
            let bsdf = built.bsdf(wo);
            self.evaluations += 1;
            if let Some((what, found)) = fault(&bsdf, wi, pair.u.map(S::c)) {
                self.faults += 1;
                self.fault.get_or_insert_with(|| block.place(what, pair, found, [f64::NAN; 3]));
                continue;
            }
            if pair.odd {
                continue;
            }
            let f = bsdf.f(wi);
            let [a, b] = [wo, wi].map(|w| w.map(|x| T::c(x.to_f64())));
            let exact = truth.f(a, b);
            let bright = exact[0].max(exact[1]).max(exact[2]).to_f64();
            if !bright.is_finite() || bright < smallest {
                continue;
            }
            peak = peak.max(bright);
            let off = |c: usize| (T::c(f[c].to_f64()) - exact[c]).abs().to_f64();
            let channel = (0..3).fold(0, |worst, c| if off(c) > off(worst) { c } else { worst });
            let (found, truth) = (f.map(Scalar::to_f64), exact.map(Scalar::to_f64));
            candidates.push(Candidate { pair, channel, error: off(channel), bright, found, truth });
        }
        candidates.retain(|c| c.bright > FLOOR * peak);
        self.compared += candidates.len() as u64;
        candidates.sort_by(|a, b| (b.error / b.bright).total_cmp(&(a.error / a.bright)));
        if let Some(c) = candidates.first() {
            self.error.raise(c.error / c.bright, || block.place("f", c.pair, c.found, c.truth));
        }
        let step = if single { f64::from(f32::EPSILON) } else { f64::EPSILON };
        for c in candidates.iter().take(EXAMINED) {
            if c.error / c.bright <= self.beyond.error {
                break;
            }
            let [a, b] = [c.pair.wo, c.pair.wi].map(|w| w.map(|x| T::c(S::c(x).to_f64())));
            let unavoidable = rounding(step, |a, b| truth.f(a, b)[c.channel], a, b);
            // Both directions are rounded.
            let left = (c.error - 2.0 * unavoidable) / c.bright;
            self.beyond.raise(left, || block.place("f", c.pair, c.found, c.truth));
        }
    }
}

impl Row {
    /// Batches of directions are another path through the same formulas.
    fn batches(&mut self, built: &Built<f32>, block: &Block) {
        for pairs in block.pairs.chunks(F32x8::LANES) {
            let wi: Vec<[f32; 3]> = pairs.iter().map(|p| p.wi.map(|x| x as f32)).collect();
            let mut out = vec![Eval { f_cos: [0.0; 3], pdf: 0.0 }; wi.len()];
            built.bsdf(pairs[0].wo.map(|x| x as f32)).eval_batch(&wi, &mut out);
            for (pair, eval) in pairs.iter().zip(&out) {
                let [r, g, b] = eval.f_cos;
                if [r, g, b, eval.pdf].iter().any(|x| !(x.is_finite() && *x >= 0.0)) {
                    self.faults += 1;
                    let at = Pair { wo: pairs[0].wo, ..*pair };
                    let found = eval.f_cos.map(f64::from);
                    self.fault.get_or_insert_with(|| block.place("batched f·cos or pdf", &at, found, [f64::NAN; 3]));
                }
            }
        }
    }
}

impl Worst {
    fn raise(&mut self, error: f64, at: impl FnOnce() -> Place) {
        if error > self.error {
            *self = Worst { error, at: Some(at()) };
        }
    }
}

/// The first result that is infinite, undefined or negative.
fn fault<S: Scalar>(bsdf: &Bsdf<'_, S>, wi: [S; 3], u: [S; 3]) -> Option<(&'static str, [f64; 3])> {
    let eval = bsdf.eval(wi);
    let mut results = vec![
        ("f·cos", eval.f_cos),
        ("pdf", [eval.pdf; 3]),
        ("f", bsdf.f(wi)),
        ("adjoint f·cos", bsdf.eval_adjoint(wi)),
        ("albedo", bsdf.albedo()),
        ("bound", bsdf.albedo_bound(wi)),
        ("emission", bsdf.emission()),
    ];
    if let Some(s) = bsdf.sample(u) {
        let [x, y, z] = s.wi;
        results.extend([
            ("sample f·cos", s.f_cos),
            ("sample weight", s.weight),
            ("sample pdf, η, roughness", [s.pdf, s.eta, s.roughness]),
            // A direction may be negative.
            ("sample direction", [x.abs(), y.abs(), z.abs()]),
        ]);
    }
    let bad = |x: &S| !(x.is_finite() && *x >= S::zero());
    let (what, found) = results.into_iter().find(|r| r.1.iter().any(bad))?;
    Some((what, found.map(Scalar::to_f64)))
}
