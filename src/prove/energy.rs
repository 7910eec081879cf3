//! How much of the light a closure scatters at most, as polynomials in the script's variables.
//!
//! The bound follows the tree: a lobe has its albedo bound, a sum the sum, a weight multiplies. For a layer, with e the
//! albedo bound of the top that the layering rule reads, what the base scatters is multiplied by at most (1 − e)⁺, from
//! either side, and the top itself scatters E ≤ e. Hence, for T ≥ E and β no less than the base's albedo,
//! E + (1 − e)⁺·β ≤ T + (1 − T)·β where T ≤ 1 and β ≤ 1, because the left side rises with E; for larger β at most
//! T·(β − 1) more. And for any λ ≤ e, λ ≤ 1: at most T + (1 − λ)·β.

use super::graph::{Cid, Closure, Graph, Id, Node};
use super::interval::Interval;
use super::number::Path;
use super::poly::Poly;
use crate::closure::{Layering, LayeringRule, TintRule};
use crate::lobes::LobeKind;
use crate::lobes::limits::{Limits, SlotRange, slices};
use crate::lobes::registry::{LobeClass, ParamTy};
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

/// How closely lobes are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Every lobe scatters at most everything.
    Coarse,
    /// Lobes as their tables and closed forms have them, by angle and parameter.
    Fine,
    /// The same at a point, with tables for just its parameters.
    Exact,
}

/// Which direction is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// The viewer's, or either where the script does not look at the view: the bounds serve both.
    Viewer,
    /// The light's, under `view` layering: nothing is dimmed.
    LightUndimmed,
    /// The light's, where the closures look at the view: a part of what is scattered.
    LightOf(Only),
}

/// A part of what closures scatter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Only {
    /// What known lobes send to viewers in a slice of cosines.
    Slice(usize),
    /// What one lobe scatters.
    Lobe(Cid),
}

/// Bounds on what a closure scatters.
#[derive(Clone, Debug)]
pub struct Bound {
    /// At most this, per channel.
    pub most: [Poly; 3],
    /// The albedo bound that layers read is at least this.
    pub least: [Poly; 3],
    /// Both give or take this.
    pub error: f64,
}

/// What bounds of 1 may be off by in double precision.
const ALMOST: f64 = 1e-9;

/// Where a lobe's normal points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    /// With the normal that cosines are counted from.
    With,
    Against,
    Elsewhere,
}

/// Bounds closures along one path of a region.
pub struct Energy<'a> {
    graph: &'a Graph,
    layering: Layering,
    normal: Option<[Id; 3]>,
    limits: RefCell<HashMap<(Cid, Vec<u64>), Limits>>,
}

/// What the evaluation of a region depended on that a smaller region would tell more about.
pub type Loose = BTreeSet<u32>;

impl<'a> Energy<'a> {
    /// For the closures below `root`; cosines are counted from the normal most of its lobes have.
    pub fn new(graph: &'a Graph, root: Cid, layering: Layering) -> Self {
        let mut counts: Vec<([Id; 3], usize)> = Vec::new();
        for id in reachable(graph, root) {
            if let Closure::Lobe(kind, slots, _) = graph.closure_at(id)
                && let Some(normal) = normal_of(*kind, slots)
            {
                match counts.iter_mut().find(|c| c.0 == normal) {
                    Some(count) => count.1 += 1,
                    None => counts.push((normal, 1)),
                }
            }
        }
        counts.sort_by_key(|c| std::cmp::Reverse(c.1));
        Energy { graph, layering, normal: counts.first().map(|c| c.0), limits: RefCell::default() }
    }

    /// The normal that cosines are counted from.
    pub fn normal(&self) -> Option<[Id; 3]> {
        self.normal
    }

    /// Bounds a closure. Adds to `loose` what made the bound wider than it may have to be.
    pub fn bound(&self, path: &mut Path<'_>, root: Cid, detail: Detail, held: Held, loose: &mut Loose) -> Rc<Bound> {
        let mut done: HashMap<Cid, Rc<Bound>> = HashMap::new();
        let mut waiting = vec![root];
        while let Some(&top) = waiting.last() {
            if done.contains_key(&top) {
                waiting.pop();
                continue;
            }
            let mut need = |c: Cid| {
                if !done.contains_key(&c) {
                    waiting.push(c);
                }
            };
            let bound = match self.graph.closure_at(top) {
                Closure::Zero => Bound::black(),
                Closure::Lobe(kind, slots, tint) => self.lobe(path, top, (*kind, slots, *tint), (detail, held), loose),
                Closure::Add(a, b) => {
                    need(*a);
                    need(*b);
                    match (done.get(a), done.get(b)) {
                        (Some(a), Some(b)) => a.plus(b, path),
                        _ => continue,
                    }
                }
                Closure::Mul(weight, c) => {
                    need(*c);
                    match done.get(c) {
                        Some(c) => weighted(path, *weight, c),
                        None => continue,
                    }
                }
                Closure::Layer(t, b) => {
                    need(*t);
                    need(*b);
                    match (done.get(t), done.get(b)) {
                        (Some(t), Some(b)) => self.layer(path, t, b, held),
                        _ => continue,
                    }
                }
                Closure::Select(c, a, b) => match super::number::decided(path.number(*c).range) {
                    Some(first) => {
                        let chosen = if first { a } else { b };
                        need(*chosen);
                        match done.get(chosen) {
                            Some(bound) => (**bound).clone(),
                            None => continue,
                        }
                    }
                    None => {
                        need(*a);
                        need(*b);
                        match (done.get(a), done.get(b)) {
                            (Some(a), Some(b)) => a.either(b, path),
                            _ => continue,
                        }
                    }
                },
            };
            done.insert(top, Rc::new(bound));
        }
        done.remove(&root).unwrap_or_else(|| Rc::new(Bound::black()))
    }

    fn lobe(
        &self,
        path: &mut Path<'_>,
        id: Cid,
        (kind, slots, tint): (LobeKind, &[Id], Option<[Id; 3]>),
        (detail, held): (Detail, Held),
        loose: &mut Loose,
    ) -> Bound {
        if kind.class() == LobeClass::Emission {
            return Bound::black();
        }
        let limits = match detail {
            Detail::Coarse => Limits { lowest: 0.0, highest: 1.0 },
            Detail::Fine => self.limits(path, id, kind, slots, 1e-5, loose),
            Detail::Exact => self.limits(path, id, kind, slots, 0.0, loose),
        };
        let highest = match held {
            Held::Viewer | Held::LightUndimmed => limits.highest,
            Held::LightOf(Only::Lobe(only)) if only == id => limits.highest,
            Held::LightOf(Only::Slice(k)) if self.is_sliced(kind, slots) => {
                limits.highest.min(self.part(path, kind, slots, k))
            }
            Held::LightOf(_) => 0.0,
        };
        // No number becomes the parameter's default.
        let tint = tint.filter(|tint| tint.iter().all(|t| !path.number(*t).range.nan));
        let constant = |x: f64| [0; 3].map(|_| Poly::constant(x));
        let bound = Bound { most: constant(highest), least: constant(limits.lowest), error: 0.0 };
        match tint {
            Some(tint) => weighted(path, tint, &bound),
            None => bound,
        }
    }

    /// Whether it is known how a lobe spreads light over the cosines.
    fn is_sliced(&self, kind: LobeKind, slots: &[Id]) -> bool {
        let with = normal_of(kind, slots).is_some_and(|n| self.side(n) == Side::With);
        with && (matches!(kind, LobeKind::Diffuse | LobeKind::Translucent) || self.block(kind, slots).is_some())
    }

    /// The parameter block of a lobe that looks the same all around its normal, where all of it is known. Tints are 1.
    fn block(&self, kind: LobeKind, slots: &[Id]) -> Option<Vec<f32>> {
        let spec = kind.spec();
        // Phong's highlight is too narrow for the slices' quadrature.
        if spec.class != LobeClass::Scatter || spec.tangent_slot().is_some() || spec.name == "phong" {
            return None;
        }
        let mut block = vec![0.0; slots.len()];
        let mut at = 0;
        for p in spec.params {
            let tint = kind.tint_slot() == Some(at);
            for k in at..at + p.ty.slots() {
                block[k] = match p.ty {
                    ParamTy::Normal => [0.0, 0.0, 1.0][k - at],
                    _ if tint => 1.0,
                    _ => self.graph.value(slots[k])? as f32,
                };
            }
            at += p.ty.slots();
        }
        Some(block)
    }

    /// The part of a sliced lobe's light that goes to viewers in slice `k`.
    fn part(&self, path: &Path<'_>, kind: LobeKind, slots: &[Id], k: usize) -> f64 {
        let (slice, light) = (super::light::slice(k), path.cos());
        let lambert = (slice.hi * slice.hi - slice.lo * slice.lo).abs();
        let above = slice.hi > 0.0;
        let across = if above { light.lo < 0.0 } else { light.hi > 0.0 };
        match (kind, self.block(kind, slots)) {
            (LobeKind::Diffuse, _) if above && light.hi > 0.0 => lambert,
            (LobeKind::Translucent, _) if across => lambert,
            (LobeKind::Diffuse | LobeKind::Translucent, _) => 0.0,
            (_, Some(block)) if above && light.hi > 0.0 => {
                let ends = [slice.lo.sqrt(), slice.hi.sqrt()];
                slices(kind, &block).most((ends[0], ends[1]), (light.lo.max(0.0), light.hi))
            }
            (_, Some(_)) => 0.0,
            (_, None) => 1.0,
        }
    }

    /// The lobes below `root`: those that are not sliced, and those that are.
    pub fn lobes(&self, root: Cid) -> (Vec<Cid>, Vec<Cid>) {
        let sliced = |id: &Cid| match self.graph.closure_at(*id) {
            Closure::Lobe(kind, slots, _) if kind.class() != LobeClass::Emission => Some(self.is_sliced(*kind, slots)),
            _ => None,
        };
        let all: Vec<(Cid, bool)> =
            reachable(self.graph, root).into_iter().filter_map(|id| Some((id, sliced(&id)?))).collect();
        let of = |which: bool| all.iter().filter(|l| l.1 == which).map(|l| l.0).collect();
        (of(false), of(true))
    }

    fn limits(
        &self,
        path: &mut Path<'_>,
        id: Cid,
        kind: LobeKind,
        slots: &[Id],
        apart: f32,
        loose: &mut Loose,
    ) -> Limits {
        let cos = match normal_of(kind, slots).map(|n| self.side(n)) {
            Some(Side::With) => path.cos(),
            Some(Side::Against) => path.cos().negated(),
            Some(Side::Elsewhere) | None => Interval::new(-1.0, 1.0),
        };
        let mut ranges: Vec<SlotRange> = vec![(0.0, 0.0); slots.len()];
        let mut at = 0;
        for p in kind.spec().params {
            let count = p.ty.slots();
            if !matches!(p.ty, ParamTy::Normal | ParamTy::Vector) && kind.tint_slot() != Some(at) {
                for k in at..at + count {
                    let number = path.number(slots[k]);
                    let range = if number.range.nan { Interval::ALL } else { number.range };
                    // What is known only here must not ask for a table of its own.
                    let apart =
                        if self.graph.value(slots[k]).is_none() && p.ty == ParamTy::Float { apart } else { 0.0 };
                    ranges[k] = (range.lo as f32 - apart, range.hi as f32 + apart);
                    if !range.is_point() {
                        loose.insert(slots[k].0);
                    }
                }
            }
            at += count;
        }
        let ends = ranges.iter().flat_map(|r| [r.0.to_bits() as u64, r.1.to_bits() as u64]);
        let key: Vec<u64> = ends.chain([cos.lo.to_bits(), cos.hi.to_bits()]).collect();
        let known = self.limits.borrow().get(&(id, key.clone())).copied();
        known.unwrap_or_else(|| {
            let limits = kind.limits(&ranges, (cos.lo, cos.hi));
            self.limits.borrow_mut().insert((id, key), limits);
            limits
        })
    }

    fn side(&self, normal: [Id; 3]) -> Side {
        let Some(main) = self.normal else { return Side::Elsewhere };
        let turned = |a: [Id; 3], b: [Id; 3]| (0..3).all(|k| self.graph.node(a[k]) == Node::Neg(b[k]));
        match () {
            () if normal == main => Side::With,
            () if turned(normal, main) || turned(main, normal) => Side::Against,
            () => Side::Elsewhere,
        }
    }

    fn layer(&self, path: &mut Path<'_>, top: &Bound, base: &Bound, held: Held) -> Bound {
        if held == Held::LightUndimmed {
            return top.plus(base, path);
        }
        let mut most = [Poly::default(), Poly::default(), Poly::default()];
        let mut error = top.error + base.error;
        let tops: [f64; 3] = std::array::from_fn(|c| path.upper(&top.most[c]) + top.error);
        let bases: [f64; 3] = std::array::from_fn(|c| path.upper(&base.most[c]) + base.error);
        let least: [f64; 3] = std::array::from_fn(|c| -path.upper(&top.least[c].scaled(-1.0)));
        for c in 0..3 {
            // α answers to the largest channel of the top: any channel's lower bound will do.
            let darkest = (0..3).fold(c, |best, k| if least[k] > least[best] { k } else { best });
            let from = if self.layering.tint == TintRule::Largest { darkest } else { c };
            let (t, b) = (&top.most[c], &base.most[c]);
            // Parts of what lobes scatter do not make up for what a layer takes away.
            let parts = matches!(held, Held::LightOf(_));
            let most_of_all = if parts { tops[c] + bases[c] } else { tops[c].max(1.0).max(bases[c]) };
            let mut best = (most_of_all, None);
            let mut offer = |path: &mut Path<'_>, poly: Option<Poly>, more: f64| {
                let Some(poly) = poly else { return };
                let upper = path.upper(&poly) + more;
                if upper < best.0 {
                    best = (upper, Some((poly, more)));
                }
            };
            if tops[c] <= 1.0 + ALMOST && !parts {
                let beyond = tops[c].max(0.0) * (bases[c] - 1.0).max(0.0);
                let poly = t.times(b).map(|both| t.plus(b, 1.0).plus(&both, -1.0).plus(&Poly::constant(beyond), 1.0));
                offer(path, poly, (top.error + ALMOST) * (1.0 + bases[c].abs()) + base.error);
                offer(path, Some(Poly::constant(tops[c] + (1.0 - tops[c]).max(0.0) * bases[c] + beyond)), 0.0);
            }
            if path.upper(&top.least[from]) <= 1.0 + ALMOST {
                let poly = top.least[from].times(b).map(|dimmed| t.plus(b, 1.0).plus(&dimmed, -1.0));
                offer(path, poly, (top.error + ALMOST) * (1.0 + bases[c].abs()) + base.error);
            }
            most[c] = match best {
                (_, Some((poly, more))) => {
                    error = f64::max(error, more);
                    poly
                }
                (upper, None) => Poly::constant(upper),
            };
        }
        Bound { most, least: top.least.clone(), error }
    }

    /// Whether the light side follows from the view side: under `min` and `balanced` both are dimmed by at most α.
    pub fn sides_alike(&self) -> bool {
        match self.layering.rule {
            LayeringRule::Min | LayeringRule::Balanced => true,
            LayeringRule::View => false,
        }
    }
}

impl Bound {
    fn black() -> Bound {
        Bound { most: Default::default(), least: Default::default(), error: 0.0 }
    }

    fn plus(&self, o: &Bound, path: &mut Path<'_>) -> Bound {
        let sum = |a: &[Poly; 3], b: &[Poly; 3]| std::array::from_fn(|c| a[c].plus(&b[c], 1.0));
        let error = (self.error + o.error) * (1.0 + 1e-7);
        let mut bound = Bound { most: sum(&self.most, &o.most), least: sum(&self.least, &o.least), error };
        bound.shrink(path);
        bound
    }

    /// Large polynomials become numbers.
    fn shrink(&mut self, path: &mut Path<'_>) {
        for c in 0..3 {
            if self.most[c].is_large() {
                self.most[c] = Poly::constant(path.upper(&self.most[c]));
            }
            if self.least[c].is_large() {
                self.least[c] = Poly::default();
            }
        }
    }

    /// Holds for both.
    fn either(&self, o: &Bound, path: &mut Path<'_>) -> Bound {
        let mut upper = |c: usize| path.upper(&self.most[c]).max(path.upper(&o.most[c]));
        let most =
            [0, 1, 2].map(|c| if self.most[c] == o.most[c] { self.most[c].clone() } else { Poly::constant(upper(c)) });
        Bound { most, least: Default::default(), error: self.error.max(o.error) }
    }
}

fn weighted(path: &mut Path<'_>, weight: [Id; 3], bound: &Bound) -> Bound {
    let weights = weight.map(|w| path.number(w));
    let mut made = Bound::black();
    for c in 0..3 {
        let w = &weights[c];
        let upper = path.upper(&bound.most[c]).max(0.0);
        let largest = w.range.hi.max(0.0);
        made.most[c] = match w.poly.times(&bound.most[c]) {
            Some(product) => product,
            None => Poly::constant(largest * upper),
        };
        if !w.range.nan {
            made.least[c] = w.poly.times(&bound.least[c]).unwrap_or_default();
        }
        let error = w.error * (upper + bound.error) + bound.error * largest;
        made.error = made.error.max(if error.is_nan() { f64::INFINITY } else { error });
    }
    made
}

fn normal_of(kind: LobeKind, slots: &[Id]) -> Option<[Id; 3]> {
    let at = kind.spec().normal_slot()?;
    slots.get(at..at + 3).map(|n| [n[0], n[1], n[2]])
}

/// The closures below `root`, each once.
pub fn reachable(graph: &Graph, root: Cid) -> Vec<Cid> {
    let mut seen = vec![false; graph.closure_count()];
    let (mut found, mut waiting) = (Vec::new(), vec![root]);
    while let Some(id) = waiting.pop() {
        if std::mem::replace(&mut seen[id.0 as usize], true) {
            continue;
        }
        found.push(id);
        match graph.closure_at(id) {
            Closure::Zero | Closure::Lobe(..) => {}
            Closure::Add(a, b) | Closure::Layer(a, b) | Closure::Select(_, a, b) => waiting.extend([*b, *a]),
            Closure::Mul(_, c) => waiting.push(*c),
        }
    }
    found
}

/// All slots of lobes below `root`, directions too.
pub fn slots_of(graph: &Graph, root: Cid) -> Vec<Id> {
    let slots = |id: Cid| match graph.closure_at(id) {
        Closure::Lobe(_, slots, _) => slots.clone(),
        _ => Vec::new(),
    };
    reachable(graph, root).into_iter().flat_map(slots).collect()
}

/// The numbers that closures below `root` depend on: weights, slots that are no directions, conditions.
pub fn numbers_of(graph: &Graph, root: Cid) -> Vec<Id> {
    let mut ids = Vec::new();
    for id in reachable(graph, root) {
        match graph.closure_at(id) {
            Closure::Mul(weight, _) => ids.extend(weight),
            Closure::Select(c, ..) => ids.push(*c),
            Closure::Lobe(kind, slots, _) => {
                let mut at = 0;
                for p in kind.spec().params {
                    if !matches!(p.ty, ParamTy::Normal | ParamTy::Vector) {
                        ids.extend(&slots[at..at + p.ty.slots()]);
                    }
                    at += p.ty.slots();
                }
            }
            _ => {}
        }
    }
    ids
}
