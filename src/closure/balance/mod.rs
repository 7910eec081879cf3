//! The `balanced` rule: reciprocal, and lossless where the top is reciprocal.
//!
//! Below layers that pass α(ω), lobe k becomes s(ωo)·s(ωi)·f_k with s solved so that its albedo is exactly
//!
//! s(ω)·∫ f_k(ω, ω′)·s(ω′)·|cos θ′| dω′ = α(ω)·E_k(ω),
//!
//! which is a symmetric scaling of the lobe's kernel to given row sums. Divided by E_k it reads s(ω)·⟨s⟩(ω) = α(ω),
//! where ⟨s⟩(ω) is the mean of s over what the lobe scatters from ω; the iteration s ← s·√(α/(s·⟨s⟩)) finds it (after
//! Sinkhorn & Knopp 1967, kept symmetric). On Lambert s = α/√(mean of α), the product form of Kelemen & Szirmay-Kalos
//! 2001; toward a mirror s = √α. It is linear per lobe, so sums, colors and nesting follow.
//!
//! A table holds s over the cosine. After solving, every node is lowered by what the albedo exceeds its target at the
//! nodes around it and between them: the rule loses a little there, and gains nowhere.
//!
//! A tree that is the same at every point gets a table for each lobe below a layer, however deep. Where trees vary from
//! point to point a lobe gets a table for each single lobe that may be laid over it, over that lobe's weight and over
//! the one parameter of it that varies. What cannot be balanced keeps `min`; [`Unbalanced`] says why.

mod chain;
mod scales;
mod solve;

pub(super) use chain::Chain;
pub(crate) use scales::Balanced;
pub use solve::Kernel;

use super::flatten::Curves;
use super::layer::{LayerStack, LayeringRule, TintRule};
use super::tree::{ClosureTree, MAX_LAYERS};
use super::walk::{self, LobeVisit, Visitor, Weights, first, walk};
use crate::albedo::Precision;
use crate::globals::Globals;
use crate::lobes::registry::{LobeClass, ParamTy};
use crate::lobes::{AnyLobe, LobeKind, Rgb};
use crate::optics::{Scalar, V3};
use scales::Scales;
use solve::{target_cosine, targets};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Why a lobe below a layer keeps the `min` rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unbalanced {
    /// f(ωo, ωi) ≠ f(ωi, ωo): no symmetric scale makes it reciprocal.
    NotReciprocal,
    /// The lobe, or one in a layer above, follows a tangent: its albedo depends on the azimuth.
    Tangent,
    /// The lobe and the layers above it have different normals.
    Normal,
    /// It scatters to the other side, where a one-sided top passes everything: the two sides want different fluxes
    /// through one symmetric kernel.
    /// A lobe that reflects on both sides is not told apart from one that does.
    Crosses,
    /// It scatters so narrowly that sums at the tables' cosines miss it. The cosines of both directions are almost the
    /// same then, and `min` loses almost nothing.
    Narrow,
    /// It scatters into one direction, whose cosine is that of ωo: there `min` is α(ωo) already, and loses nothing.
    Delta,
}

impl Unbalanced {
    /// In words.
    pub fn reason(self) -> &'static str {
        match self {
            Unbalanced::NotReciprocal => "the lobe is not reciprocal",
            Unbalanced::Tangent => "a tangent makes albedos depend on the azimuth",
            Unbalanced::Normal => "its normal is not that of the layers above",
            Unbalanced::Crosses => "it scatters to the other side, or from below",
            Unbalanced::Narrow => "it is too narrow to be solved for",
            Unbalanced::Delta => "one direction needs no balancing",
        }
    }
}

/// What became of a lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fate {
    /// No layer lies above it.
    Uncovered,
    /// Its scale was solved for.
    Balanced,
    /// It keeps `min`.
    Min(Unbalanced),
}

/// Solved scales for the lobes of a tree or of a material.
#[derive(Clone, Debug)]
pub struct Balance<S> {
    scales: Vec<Scales<S>>,
    plan: Plan,
    tint: TintRule,
}

#[derive(Clone, Debug)]
enum Plan {
    /// For a tree that is always the same: the scales of each lobe, in the order they are met.
    Lobes(Vec<(LobeKind, Fate, Option<usize>)>),
    /// For trees that vary.
    Pairs(Vec<Pair>),
}

/// A lobe under one single lobe, by their sites.
#[derive(Clone, Copy, Debug)]
struct Pair {
    top: u32,
    base: u32,
    /// The slot of the top's parameter that varies.
    slot: Option<usize>,
    scales: usize,
}

impl<S: Scalar> Balance<S> {
    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        self.scales.iter().map(Scales::bytes).sum()
    }

    /// The same tables in another type, rounded to double precision.
    pub fn cast<T: Scalar>(&self) -> Balance<T> {
        Balance { scales: self.scales.iter().map(Scales::cast).collect(), plan: self.plan.clone(), tint: self.tint }
    }

    /// For a tree that is the same everywhere: what became of each lobe, in the order they are met, tops first. Empty
    /// for other materials.
    pub fn fates(&self) -> Vec<(LobeKind, Fate)> {
        match &self.plan {
            Plan::Lobes(lobes) => lobes.iter().map(|l| (l.0, l.1)).collect(),
            Plan::Pairs(_) => vec![],
        }
    }

    /// The sites of (top, base) that are balanced, for trees that vary. Empty for a tree that is always the same.
    pub fn pairs(&self) -> Vec<(u32, u32)> {
        match &self.plan {
            Plan::Lobes(_) => vec![],
            Plan::Pairs(pairs) => pairs.iter().map(|p| (p.top, p.base)).collect(),
        }
    }

    /// Whether finding a scale asks what lies above.
    pub(super) fn needs_chain(&self) -> bool {
        matches!(self.plan, Plan::Pairs(_))
    }

    /// The value of the parameter of the lobe made at `site` that varies.
    pub(super) fn parameter(&self, site: u32, values: &[f32]) -> S {
        let Plan::Pairs(pairs) = &self.plan else { return S::zero() };
        let slot = pairs.iter().find(|p| p.top == site).and_then(|p| p.slot);
        slot.and_then(|s| values.get(s)).map_or(S::zero(), |v| S::from_f32(*v))
    }

    /// The scale of the lobe met as number `met`, made at `site`, below `chain`.
    pub(super) fn find(
        &self,
        met: usize,
        site: u32,
        normal: V3<S>,
        chain: &Chain<S>,
        cos_o: S,
    ) -> Option<Balanced<'_, S>> {
        match &self.plan {
            Plan::Lobes(lobes) => {
                let scales = &self.scales[lobes.get(met)?.2?];
                Some(Balanced::new(scales, scales.row(S::zero(), S::zero()), cos_o))
            }
            Plan::Pairs(pairs) => {
                let top = chain.single(normal)?;
                let [r, g, b] = top.weight;
                let pair = pairs.iter().find(|p| p.top == top.site && p.base == site)?;
                let grey = r == g && g == b;
                let w = r.max(g).max(b);
                if w > S::one() || (self.tint == TintRule::Channel && !grey) {
                    return None;
                }
                let scales = &self.scales[pair.scales];
                Some(Balanced::new(scales, scales.row(w, top.param), cos_o))
            }
        }
    }
}

/// What a place in a program makes: a lobe with the values that are known before shading.
#[derive(Clone, Copy, Debug)]
pub struct Construction<'a> {
    /// Which lobe.
    pub kind: LobeKind,
    /// Its parameter block; `None` where the value is not known.
    pub values: &'a [Option<f32>],
}

/// What identifies a kernel: the lobe, its site, and its values.
type KernelKey = (LobeKind, u32, Vec<u32>);

/// Solves for scales, and keeps what solving needs to know of each lobe.
#[derive(Debug)]
pub struct Balancer {
    nodes: usize,
    pair_nodes: usize,
    kernels: Mutex<HashMap<KernelKey, Result<Arc<Kernel>, Unbalanced>>>,
}

/// Kernels kept at a time; a host that composes trees without end starts over.
const MAX_KERNELS: usize = 2048;

/// Rows over the weight of a top, and over a parameter of it that varies.
const WEIGHTS: usize = 8;
const PARAMS: usize = 32;

impl Balancer {
    /// Tables as fine as the precision asks for.
    pub fn new(precision: Precision) -> Self {
        Balancer::with_nodes(precision.scale_nodes)
    }

    /// Tables of `nodes` cosines (at least 8). Coarser ones lose more and gain no more.
    pub fn with_nodes(nodes: usize) -> Self {
        let nodes = nodes.max(8);
        Balancer { nodes, pair_nodes: nodes.min(64), kernels: Mutex::default() }
    }

    /// Scales for `tree`, wherever it is shaded with normals and tangents that are equal where those of `globals` are.
    pub fn solve<S: Scalar>(
        &self,
        tree: &ClosureTree,
        globals: &Globals,
        tint: TintRule,
        curves: &Curves<S>,
    ) -> Balance<S> {
        let nodes = self.nodes;
        let mut planner = Planner { globals, curves, chain: Chain::default(), lobes: vec![], balancer: self };
        walk(tree, &mut planner);
        let lobes = planner.lobes;
        // One walk per cosine gives α there for every lobe.
        let alphas: Vec<Vec<Rgb<f64>>> = (0..targets(nodes))
            .map(|k| {
                let wo = V3::polar(S::c(target_cosine(k, nodes)), S::zero());
                let mut passed = Passed { wo, tint, curves, stack: Box::default(), passed: vec![] };
                walk(tree, &mut passed);
                passed.passed
            })
            .collect();
        let mut balance = Balance { scales: vec![], plan: Plan::Lobes(vec![]), tint };
        let found = lobes.into_iter().enumerate().map(|(met, (kind, kernel))| {
            let kernel = match kernel {
                None => return (kind, Fate::Uncovered, None),
                Some(Err(why)) => return (kind, Fate::Min(why), None),
                Some(Ok(kernel)) => kernel,
            };
            let alpha = |c: usize| alphas.iter().map(|a| a[met][c]).collect::<Vec<f64>>();
            let colors = [alpha(0), alpha(1), alpha(2)];
            let grey = kernel.channels.len() == 1 && colors[0] == colors[1] && colors[0] == colors[2];
            let channels = if grey { 1 } else { 3 };
            let solved = (0..channels).flat_map(|c| kernel.solve_row(c.min(kernel.channels.len() - 1), &colors[c]));
            let values = solved.map(S::c).collect();
            let (lo, inv_range) = (S::zero(), S::zero());
            balance.scales.push(Scales { values, nodes, weights: 1, params: 1, channels, lo, inv_range });
            (kind, Fate::Balanced, Some(balance.scales.len() - 1))
        });
        let found = found.collect();
        Balance { plan: Plan::Lobes(found), ..balance }
    }

    /// Scales for a material whose trees vary: for each of `pairs` (sites of top and base) whose top is a lobe without
    /// unknowns but its weight and one parameter, and whose base has none but its weight.
    pub fn solve_pairs<S: Scalar>(
        &self,
        sites: &[Construction<'_>],
        pairs: &[(u32, u32)],
        tint: TintRule,
        curves: &Curves<S>,
    ) -> Balance<S> {
        let mut balance = Balance { scales: vec![], plan: Plan::Pairs(vec![]), tint };
        let mut found = Vec::new();
        for &(top, base) in pairs.iter().take(MAX_PAIRS) {
            let solved = self.solve_pair(sites, top, base, curves);
            if let Some((slot, scales)) = solved {
                found.push(Pair { top, base, slot, scales: balance.scales.len() });
                balance.scales.push(scales);
            }
        }
        balance.plan = Plan::Pairs(found);
        balance
    }

    fn solve_pair<S: Scalar>(
        &self,
        sites: &[Construction<'_>],
        top: u32,
        base: u32,
        curves: &Curves<S>,
    ) -> Option<(Option<usize>, Scales<S>)> {
        let (t, b) = (sites.get(top as usize)?, sites.get(base as usize)?);
        let (t_values, varying) = known(t)?;
        let (b_values, none) = known(b)?;
        // A width that varies may differ from the other one.
        let tangent = varying.is_some() && t.kind.spec().tangent_slot().is_some();
        if tangent || t.kind.follows_tangent(&t_values) || none.is_some() || t.kind.class() != LobeClass::Scatter {
            return None;
        }
        let nodes = self.pair_nodes;
        let kernel = self.kernel(b.kind, base, &b_values, curves, nodes).ok()?;
        let (lo, hi) = varying.as_ref().map_or((0.0, 0.0), |v| (v.lo.sqrt(), v.hi.sqrt()));
        let curve = curves.of(top);
        let bound_of = |y: f64, cos: f64| {
            let mut values = t_values.clone();
            if let Some(v) = &varying {
                values[v.slot] = (lo + (hi - lo) * y).powi(2) as f32;
            }
            let w = V3::polar(S::c(cos), S::zero());
            AnyLobe::<S>::new(t.kind, &values, w, curve).albedo_bound(w, curve).map(|e| e.to_f64())
        };
        let grey = |[r, g, b]: [f64; 3]| r == g && g == b;
        if kernel.channels.len() > 1 || ![0.1, 0.7].iter().all(|cos| grey(bound_of(0.5, *cos))) {
            return None;
        }
        let params = if varying.is_some() { PARAMS } else { 1 };
        let values = kernel.solve_rows(WEIGHTS, params, |y, cos| bound_of(y, cos)[0]).into_iter().map(S::c).collect();
        let scales = Scales {
            values,
            nodes,
            weights: WEIGHTS,
            params,
            channels: 1,
            lo: S::c(lo),
            inv_range: S::c(1.0 / (hi - lo).max(1e-30)),
        };
        Some((varying.map(|v| v.slot), scales))
    }

    /// The kernel of a lobe, or why it cannot be balanced.
    fn kernel<S: Scalar>(
        &self,
        kind: LobeKind,
        site: u32,
        values: &[f32],
        curves: &Curves<S>,
        nodes: usize,
    ) -> Result<Arc<Kernel>, Unbalanced> {
        if kind.class() == LobeClass::Delta {
            return Err(Unbalanced::Delta);
        }
        if kind.follows_tangent(values) {
            return Err(Unbalanced::Tangent);
        }
        if !kind.reciprocal(values) {
            return Err(Unbalanced::NotReciprocal);
        }
        // Normals turn the frame, and colors that only weigh the lobe leave its means as they are.
        let mut plain = values.to_vec();
        let mut at = 0;
        for p in kind.spec().params {
            if p.ty == ParamTy::Normal || (p.ty == ParamTy::Color && is_weight(kind, at, values)) {
                plain[at..at + p.ty.slots()].fill(1.0);
            }
            at += p.ty.slots();
        }
        let bits = plain.iter().map(|v| v.to_bits()).chain([nodes as u32]).collect();
        let key: KernelKey = (kind, site, bits);
        let known = self.known().get(&key).cloned();
        known.unwrap_or_else(|| {
            let kernel = Kernel::new(kind, &plain, curves.of(site), nodes).map(Arc::new);
            let mut kernels = self.known();
            if kernels.len() >= MAX_KERNELS {
                kernels.clear();
            }
            kernels.insert(key, kernel.clone());
            kernel
        })
    }

    fn known(&self) -> MutexGuard<'_, HashMap<KernelKey, Result<Arc<Kernel>, Unbalanced>>> {
        self.kernels.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// More pairs of sites than this keep `min`: solving takes tens of milliseconds and up to 64 KiB each.
pub const MAX_PAIRS: usize = 8;

/// The parameter of a top that varies, and its declared range.
struct Varying {
    slot: usize,
    lo: f64,
    hi: f64,
}

/// The values of a construction, if nothing that matters to f is unknown but one float. Normals, and colors that only
/// weigh the lobe, do not matter.
fn known(site: &Construction<'_>) -> Option<(Vec<f32>, Option<Varying>)> {
    let mut values = Vec::new();
    let mut varying = None;
    // Whether a color is a weight may depend on other parameters, but not on those that may be unknown.
    let guess: Vec<f32> = site.values.iter().map(|v| v.unwrap_or_default()).collect();
    for p in site.kind.spec().params {
        let given = &site.values[values.len()..values.len() + p.ty.slots()];
        if given.iter().all(Option::is_some) {
            values.extend(given.iter().flatten());
            continue;
        }
        match p.ty {
            ParamTy::Normal => values.extend([0.0, 0.0, 1.0]),
            ParamTy::Color if is_weight(site.kind, values.len(), &guess) => values.extend([1.0; 3]),
            ParamTy::Float if varying.is_none() && p.min >= 0.0 && p.max.is_finite() => {
                varying = Some(Varying { slot: values.len(), lo: p.min.into(), hi: p.max.into() });
                values.push(p.min);
            }
            _ => return None,
        }
    }
    Some((values, varying))
}

/// Whether the color in these slots is the lobe's weight, the other parameters as in `values`.
fn is_weight(kind: LobeKind, slot: usize, values: &[f32]) -> bool {
    let probe = [0.25, 0.5, 0.75];
    let mut values = values.to_vec();
    values[slot..slot + 3].copy_from_slice(&probe);
    kind.weight(&values) == probe
}

/// The kernel of a lobe, or why it is not balanced; `None` where no layer lies above.
type Planned = Option<Result<Arc<Kernel>, Unbalanced>>;

/// Finds out which lobes can be balanced.
struct Planner<'a, S: Scalar> {
    globals: &'a Globals,
    curves: &'a Curves<S>,
    chain: Chain<S>,
    lobes: Vec<(LobeKind, Planned)>,
    balancer: &'a Balancer,
}

impl<S: Scalar> Visitor<S> for Planner<'_, S> {
    fn begin(&mut self) {
        self.chain.begin();
    }

    fn middle(&mut self, _: Weights<S>) {
        self.chain.middle();
    }

    fn end(&mut self) {
        self.chain.end();
    }

    fn lobe(&mut self, visit: LobeVisit<'_, S>) {
        let visit = visit.tinted();
        let LobeVisit { kind, site, values, .. } = visit;
        if kind.class() == LobeClass::Emission {
            self.lobes.push((kind, None));
            return;
        }
        let normal = walk::frame(walk::directions(kind, values, self.globals), self.globals).n;
        let fate = self.chain.has_layers().then(|| {
            self.chain.fits(normal)?;
            self.balancer.kernel(kind, site, values, self.curves, self.balancer.nodes)
        });
        self.lobes.push((kind, fate));
        self.chain.lobe(&visit, normal, S::zero());
    }
}

/// What the layers above pass on to each lobe, toward one direction in the frame they share.
struct Passed<'a, S: Scalar> {
    wo: V3<S>,
    tint: TintRule,
    curves: &'a Curves<S>,
    stack: Box<LayerStack<S, { MAX_LAYERS as usize }>>,
    passed: Vec<Rgb<f64>>,
}

impl<S: Scalar> Visitor<S> for Passed<'_, S> {
    fn begin(&mut self) {
        self.stack.begin();
    }

    fn middle(&mut self, w: Weights<S>) {
        self.stack.middle(first(w.in_top), LayeringRule::Balanced, self.tint, None::<Rgb<S>>);
    }

    fn end(&mut self) {
        self.stack.end();
    }

    fn lobe(&mut self, visit: LobeVisit<'_, S>) {
        let LobeVisit { kind, site, values, weights } = visit.tinted();
        self.passed.push(self.stack.scale().map(S::to_f64));
        if kind.class() != LobeClass::Emission {
            let curve = self.curves.of(site);
            let bound = AnyLobe::<S>::new(kind, values, self.wo, curve).albedo_bound(self.wo, curve);
            self.stack.lobe(first(weights.in_top), bound);
        }
    }
}
