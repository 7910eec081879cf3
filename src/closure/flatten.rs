//! From a tree and one ωo to the list a `Bsdf` walks.
//!
//! One pass, top before base, over an explicit stack. Every lobe is prepared once; lobes that share a normal and a
//! tangent share a frame.

use super::balance::{Balance, Chain};
use super::bsdf::{Bsdf, Op};
use super::layer::{LayerStack, LayeringRule, TintRule, step};
use super::met::{FlatLobe, KNOWN, LayerAlpha, Place};
use super::sites::{Known, Site};
use super::tree::{ClosureTree, MAX_LAYERS, TreeError};
use super::walk::{self, LobeVisit, Stand, Visitor, Weights, first, walk};
use crate::albedo::{AlbedoCurve, Precision, TableSpec};
use crate::globals::Globals;
use crate::lobes::registry::LobeClass;
use crate::lobes::signals::SignalKind;
use crate::lobes::{AimedLobe, AnyLobe, LobeKind, Rgb};
use crate::optics::{Scalar, V3, frame};
use glam::Vec3;
use smallvec::SmallVec;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Tables that materials share: what one has baked, another of the same lobe and parameters takes from here. Keeps no
/// table that nothing uses any more.
#[derive(Debug, Default)]
pub struct TableCache<S>(Mutex<Vec<Shared<S>>>);

/// What a table was baked for, and the table while somebody holds it.
type Shared<S> = (TableSpec, Precision, Weak<AlbedoCurve<S>>);

impl<S: Scalar> TableCache<S> {
    /// The table of `spec`, baked if nobody holds it.
    fn get(&self, spec: &TableSpec, precision: Precision) -> Arc<AlbedoCurve<S>> {
        let held = |tables: &mut Vec<Shared<S>>| {
            tables.retain(|t| t.2.strong_count() > 0);
            tables.iter().find(|t| t.1 == precision && t.0 == *spec).and_then(|t| t.2.upgrade())
        };
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(table) = held(&mut lock()) {
            return table;
        }
        // Not while holding the lock: baking takes up to a second.
        let table = Arc::new(spec.bake(precision));
        lock().push((*spec, precision, Arc::downgrade(&table)));
        table
    }
}

/// The albedo curves of a material, found by the site that constructs the lobe.
#[derive(Clone, Debug)]
pub struct Curves<S: Scalar> {
    baked: Vec<(TableSpec, Arc<AlbedoCurve<S>>)>,
    /// By number; the first is of those that are not there.
    sites: Vec<Known<S>>,
}

impl<S: Scalar> Default for Curves<S> {
    fn default() -> Self {
        Curves { baked: Vec::new(), sites: vec![Known { curve: Arc::default(), site: None }] }
    }
}

impl<S: Scalar> Curves<S> {
    /// Bakes what the lobes of `tree` need, for a tree that is built in code and does not change.
    pub fn for_tree(tree: &ClosureTree, precision: Precision) -> Self {
        let mut curves = Curves::default();
        for (site, kind, values) in tree.lobes() {
            let known: Vec<Option<f32>> = values.iter().map(|v| Some(*v)).collect();
            curves.prepare(site, kind, &known, precision, &TableCache::default());
        }
        curves
    }

    /// The same tables in double precision.
    pub fn in_double(&self) -> Curves<f64> {
        self.cast()
    }

    /// The same tables in another type, rounded to double precision.
    pub fn cast<T: Scalar>(&self) -> Curves<T> {
        let baked: Vec<_> = self.baked.iter().map(|(spec, curve)| (*spec, Arc::new(curve.cast()))).collect();
        let none = Arc::default();
        let known = |known: &Known<S>| {
            let same = self.baked.iter().position(|(_, c)| Arc::ptr_eq(c, &known.curve));
            let curve: Arc<AlbedoCurve<T>> = same.map_or(&none, |i| &baked[i].1).clone();
            let site = known.site.as_ref().and_then(|site| site.cast(&curve));
            Known { curve, site }
        };
        let sites = self.sites.iter().map(known).collect();
        Curves { baked, sites }
    }

    /// Bakes the curve of one construction site; sites that ask for the same curve share it.
    pub fn set(&mut self, site: u32, spec: Option<TableSpec>, precision: Precision) {
        self.set_shared(site, spec, precision, &TableCache::default());
    }

    /// [`set`](Self::set) with a table that others may hold too.
    pub fn set_shared(&mut self, site: u32, spec: Option<TableSpec>, precision: Precision, cache: &TableCache<S>) {
        let Some(spec) = spec else { return };
        let index = match self.baked.iter().position(|(s, _)| *s == spec) {
            Some(i) => i,
            None => {
                self.baked.push((spec, cache.get(&spec, precision)));
                self.baked.len() - 1
            }
        };
        let curve = self.baked[index].1.clone();
        *self.known(site) = Known { curve, site: None };
    }

    /// [`set_shared`](Self::set_shared) with the table of a lobe whose parameter block is known as far as `known` says,
    /// and all else that can be worked out before shading.
    pub(crate) fn prepare(
        &mut self,
        site: u32,
        kind: LobeKind,
        known: &[Option<f32>],
        precision: Precision,
        cache: &TableCache<S>,
    ) {
        self.set_shared(site, kind.table(known), precision, cache);
        self.known(site).site = Site::new(kind, known, self.of(site));
    }

    fn known(&mut self, site: u32) -> &mut Known<S> {
        let index = site as usize + 1;
        if self.sites.len() <= index {
            self.sites.resize(index + 1, self.sites[0].clone());
        }
        &mut self.sites[index]
    }

    /// Memory the tables take.
    pub fn bytes(&self) -> usize {
        self.baked.iter().map(|(_, c)| c.bytes()).sum()
    }

    pub(super) fn of(&self, site: u32) -> &AlbedoCurve<S> {
        &self.at(site).curve
    }

    /// The curve of a site and what else is known of it.
    #[inline(always)]
    pub(super) fn at(&self, site: u32) -> &Known<S> {
        self.sites.get(site as usize + 1).unwrap_or(&self.sites[0])
    }
}

/// How layers scale: chosen per material, not per shading point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Layering {
    /// How a layer scales its base.
    pub rule: LayeringRule,
    /// Which channels of a top's albedo it answers to.
    pub tint: TintRule,
}

/// The tables of a material that flattening reads.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'m, S: Scalar> {
    /// Albedos by site.
    pub curves: &'m Curves<S>,
    /// Solved scales for [`LayeringRule::Balanced`]; without them that rule is [`LayeringRule::Min`].
    pub balance: Option<&'m Balance<S>>,
}

impl<'m, S: Scalar> From<&'m Curves<S>> for Tables<'m, S> {
    fn from(curves: &'m Curves<S>) -> Self {
        Tables { curves, balance: None }
    }
}

/// Builds the BSDF of `tree` for the direction `wo` (world space; any length).
///
/// # Errors
/// If the tree is beyond [`MAX_LAYERS`] or [`super::tree::MAX_LOBES`].
pub fn flatten<'m, S: Scalar>(
    tree: &ClosureTree,
    globals: &Globals,
    wo: V3<S>,
    layering: Layering,
    tables: impl Into<Tables<'m, S>>,
) -> Result<Bsdf<'m, S>, TreeError> {
    // Written where the caller has room for it: a BSDF with room for eight lobes is too large to pass around.
    let mut flat = Ok(Bsdf::black());
    if let Ok(bsdf) = &mut flat {
        flatten_into(tree, globals, wo, layering, tables, bsdf)?;
    }
    flat
}

/// [`flatten`] into a BSDF whose memory is used again. After an error it is black.
///
/// # Errors
/// If the tree is beyond [`MAX_LAYERS`] or [`super::tree::MAX_LOBES`].
pub fn flatten_into<'m, S: Scalar>(
    tree: &ClosureTree,
    globals: &Globals,
    wo: V3<S>,
    layering: Layering,
    tables: impl Into<Tables<'m, S>>,
    bsdf: &mut Bsdf<'m, S>,
) -> Result<(), TreeError> {
    let layers = tree.size(tree.root()).layers;
    bsdf.reset(frame::normalize_or_zero(wo), V3::from_f32(globals.ng.to_array()), layering, layers);
    bsdf.filled = true;
    tree.within_budget()?;
    let tables = tables.into();
    match layers {
        0..=1 => walk(tree, &mut Flattener::<S, 1>::new(globals, tables, bsdf)),
        2..=4 => walk(tree, &mut Flattener::<S, 4>::new(globals, tables, bsdf)),
        _ => flatten_deep(tree, globals, tables, bsdf),
    }
    bsdf.finish();
    Ok(())
}

/// Apart, because its stack is large.
#[cold]
#[inline(never)]
fn flatten_deep<'m, S: Scalar>(tree: &ClosureTree, globals: &Globals, tables: Tables<'m, S>, bsdf: &mut Bsdf<'m, S>) {
    walk(tree, &mut Flattener::<S, { MAX_LAYERS as usize }>::new(globals, tables, bsdf));
}

struct Flattener<'b, 'm, S: Scalar, const D: usize> {
    globals: &'b Globals,
    curves: &'m Curves<S>,
    balance: Option<&'m Balance<S>>,
    bsdf: &'b mut Bsdf<'m, S>,
    /// The walk for ωo, made while flattening.
    stack: LayerStack<S, D>,
    /// What lies above, for balancing.
    chain: Chain<S>,
    flat: Flat<S>,
    /// Lobes met so far, whether they count or not.
    met: usize,
    /// One per frame.
    standing: SmallVec<[Standing<S>; 8]>,
}

/// What a [`FlatStack`](super::layer::FlatStack) is to do before each lobe, and whether it will do.
struct Flat<S> {
    /// Before the next lobe, and before the top began that is being met.
    steps: u8,
    steps_before: u8,
    /// α toward ωo of the layer whose base begins there.
    alpha_o: S,
    /// Lobes there were when the top began.
    lobes_before: usize,
    /// Layers that are open, and those of them whose base is still to come.
    open: u16,
    tops: u16,
    /// Something has ended in the innermost open layer, which must end as well.
    ended: bool,
}

impl<S: Scalar> Flat<S> {
    fn new() -> Self {
        let alpha_o = S::one();
        Flat { steps: step::NONE, steps_before: step::NONE, alpha_o, lobes_before: 0, open: 0, tops: 0, ended: false }
    }

    fn begin(&mut self, bsdf: &mut Bsdf<'_, S>) {
        bsdf.flat &= self.tops == 0 && !self.ended;
        (self.steps_before, self.lobes_before) = (self.steps, bsdf.lobes.len());
        self.steps |= step::BEGIN;
        self.open += 1;
        self.tops += 1;
    }

    fn middle(&mut self, bsdf: &Bsdf<'_, S>, alpha_o: S) {
        self.tops -= 1;
        if bsdf.lobes.len() == self.lobes_before {
            // A top that came to nothing passes everything.
            self.steps = self.steps_before;
        } else {
            (self.steps, self.alpha_o) = (step::MIDDLE, alpha_o);
        }
    }

    fn end(&mut self) {
        self.open -= 1;
        self.ended = self.open > 0;
        if self.open == 0 {
            self.steps = step::CLEAR;
        }
    }

    fn lobe(&mut self, bsdf: &mut Bsdf<'_, S>) {
        bsdf.flat &= !self.ended;
        self.steps = step::NONE;
    }
}

/// How ωo stands in a frame.
#[derive(Clone, Copy)]
struct Standing<S> {
    /// Normal and tangent as the tree gave them.
    key: (Vec3, Vec3),
    normal: V3<S>,
    /// In the frame.
    wo: V3<S>,
}

impl<'b, 'm, S: Scalar, const D: usize> Flattener<'b, 'm, S, D> {
    fn new(globals: &'b Globals, tables: Tables<'m, S>, bsdf: &'b mut Bsdf<'m, S>) -> Self {
        let balance = tables.balance.filter(|_| bsdf.layering.rule == LayeringRule::Balanced);
        let (stack, chain) = (LayerStack::default(), Chain::default());
        let standing = SmallVec::new();
        Flattener { globals, curves: tables.curves, balance, bsdf, stack, chain, flat: Flat::new(), met: 0, standing }
    }

    fn chained(&mut self, f: impl FnOnce(&mut Chain<S>)) {
        if self.balance.is_some_and(Balance::needs_chain) {
            f(&mut self.chain);
        }
    }

    /// The frame of a lobe.
    #[inline(always)]
    fn frame(&mut self, stand: Stand, values: &[f32]) -> u32 {
        let (n, t) = stand.directions(values, self.globals);
        let same = |a: Vec3, b: Vec3| a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits);
        if let Some(i) = self.standing.iter().position(|s| same(s.key.0, n) && same(s.key.1, t)) {
            return i as u32;
        }
        self.new_frame((n, t))
    }

    #[inline(never)]
    fn new_frame(&mut self, (n, t): (Vec3, Vec3)) -> u32 {
        let frame = walk::frame((n, t), self.globals);
        self.standing.push(Standing { key: (n, t), normal: frame.n, wo: frame.to_local(self.bsdf.wo) });
        self.bsdf.frames.push(frame);
        self.standing.len() as u32 - 1
    }

    /// What was made is no lobe: it gives off light, or tells the renderer something.
    #[cold]
    fn emission(&mut self, made: &AnyLobe<S>, w: Weights<S>, scale: Rgb<S>) {
        let value = std::array::from_fn(|c| w.total[c] * scale[c]);
        if let AnyLobe::Emission(emission) = made {
            for c in 0..3 {
                self.bsdf.emission[c] += value[c] * emission.radiance();
            }
        } else if let Some(kind) = SignalKind::of(made) {
            self.bsdf.signal(kind, value);
        }
    }
}

impl<S: Scalar, const D: usize> Visitor<S> for Flattener<'_, '_, S, D> {
    fn begin(&mut self) {
        self.stack.begin();
        self.chained(Chain::begin);
        self.flat.begin(self.bsdf);
        self.bsdf.ops.push(Op::Begin);
    }

    fn middle(&mut self, w: Weights<S>) {
        let Layering { rule, tint } = self.bsdf.layering;
        let weight = first(w.in_top);
        let alpha = self.stack.middle(weight, rule, tint, None::<Rgb<S>>);
        self.chained(Chain::middle);
        self.flat.middle(self.bsdf, alpha[0]);
        self.bsdf.layers.push(LayerAlpha { alpha_o: alpha, weight });
        self.bsdf.ops.push(Op::Middle);
    }

    fn end(&mut self) {
        self.stack.end();
        self.chained(Chain::end);
        self.flat.end();
        self.bsdf.ops.push(Op::End);
    }

    fn lobe(&mut self, visit: LobeVisit<'_, S>) {
        let at = self.curves.at(visit.site);
        let LobeVisit { kind, site, values, weights: w } = visit;
        let known = at.site.as_ref().filter(|k| k.is_of(kind, values));
        let (tint, stand, class) = match known {
            Some(known) => (known.tint, known.stand, known.class),
            None => (Some(kind.weight(values)), Stand::of(kind, values), kind.class()),
        };
        let w = if let Some(tint) = tint { w.times(tint) } else { w };
        let met = self.met;
        self.met += 1;
        if first(w.total).iter().all(|w| *w <= S::zero()) && !w.inside {
            return;
        }
        let frame = self.frame(stand, values);
        let Standing { normal, wo, .. } = self.standing[frame as usize];
        let scale = self.stack.scale();
        // Under `view` α is 1 − E_view(ωo), so the walk for ωo sums bounds on that side alone.
        let view = self.bsdf.layering.rule == LayeringRule::View;
        let balanced = self.balance.and_then(|b| b.find(met, site, normal, &self.chain, wo.z));
        let (in_top, delta) = (w.inside && !view, class == LobeClass::Delta);
        let (steps, alpha_o) = (self.flat.steps, self.flat.alpha_o);
        let (zero, lobe) = ([S::zero(); 3], AimedLobe::nothing());
        self.bsdf.lobes.push(FlatLobe { share: w.total, albedo: zero, alpha_o, known: at, lobe });
        let Some(l) = self.bsdf.lobes.last_mut() else { return };
        let (mut rest, curve) = (KNOWN, &*at.curve);
        // Made where it stays: what has just been stored in parts would have to be waited for.
        let [albedo, bound] = match known.and_then(|k| k.turn(wo, curve, in_top, &mut l.lobe)) {
            Some(albedos) => albedos,
            None => {
                let made = AnyLobe::new(kind, values, wo, curve);
                if class == LobeClass::Emission {
                    self.bsdf.lobes.pop();
                    self.emission(&made, w, scale);
                    return;
                }
                l.lobe = AimedLobe::of(&made);
                if known.is_none() && made.is_kept_apart() {
                    rest = self.bsdf.rests.len() as u32;
                    self.bsdf.rests.push(made);
                }
                made.albedos(wo, curve, in_top)
            }
        };
        l.weigh(scale, albedo);
        self.bsdf.places.push(Place {
            weight_in_top: w.in_top,
            site,
            frame,
            rest,
            steps,
            inside: w.inside,
            in_top,
            delta,
        });
        if w.inside {
            let bound = if in_top { bound } else { self.bsdf.lobe(self.bsdf.lobes.len() - 1).view_bound(wo) };
            self.stack.lobe(first(w.in_top), bound);
        }
        if let Some(param) = self.balance.map(|b| b.parameter(site, values)) {
            self.chained(|chain| chain.lobe(&LobeVisit { weights: w, ..visit }, normal, param));
        }
        if self.balance.is_some() {
            self.bsdf.balanced.push(balanced);
        }
        self.flat.lobe(self.bsdf);
        self.bsdf.ops.push(Op::Lobe);
    }
}

#[cfg(feature = "cloth")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::lobes::Rgb32;

    const UP: [f32; 3] = [0.0, 0.0, 1.0];

    /// Trees by shape: how their layers stand, and whether they count as flat.
    fn shapes() -> Vec<(&'static str, ClosureTree, bool)> {
        let sheen = |t: &mut ClosureTree, weight: Rgb32| {
            let lobe = t.lobe(LobeKind::Sheen, 0, &[0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.4, 0.0, 0.0, 1.0]);
            t.mul(weight, lobe)
        };
        let build = |f: &dyn Fn(&mut ClosureTree) -> super::super::tree::NodeId| {
            let mut tree = ClosureTree::new();
            let root = f(&mut tree);
            tree.set_root(root);
            tree
        };
        let tint = [0.3, 0.8, 0.5];
        vec![
            (
                "a layer in a base",
                build(&|t| {
                    let base = t.lobe(LobeKind::Diffuse, 1, &UP);
                    let [inner, outer] = [sheen(t, tint), sheen(t, [0.9; 3])];
                    let base = t.layer(inner, base);
                    t.layer(outer, base)
                }),
                true,
            ),
            (
                "a sum below two layers, and something beside them",
                build(&|t| {
                    let [a, b, c] = [1, 2, 3].map(|site| t.lobe(LobeKind::Diffuse, site, &UP));
                    let [inner, outer, other] = [sheen(t, tint), sheen(t, [0.9; 3]), sheen(t, [0.4; 3])];
                    let (a, b) = (t.mul([0.3; 3], a), t.mul([0.2, 0.1, 0.4], b));
                    let base = t.add(a, b);
                    let base = t.layer(inner, base);
                    let layered = t.layer(outer, base);
                    let beside = t.layer(other, c);
                    let (layered, beside) = (t.mul([0.5; 3], layered), t.mul([0.5; 3], beside));
                    t.add(layered, beside)
                }),
                true,
            ),
            (
                "a top that gives off light alone",
                build(&|t| {
                    let (base, light) = (t.lobe(LobeKind::Diffuse, 1, &UP), t.lobe(LobeKind::Emission, 2, &[]));
                    let [inner, outer] = [sheen(t, tint), sheen(t, [0.9; 3])];
                    let base = t.layer(inner, base);
                    let base = t.layer(light, base);
                    t.layer(outer, base)
                }),
                true,
            ),
            (
                "light above something, beside a layer",
                build(&|t| {
                    let [a, b] = [1, 2].map(|site| t.lobe(LobeKind::Diffuse, site, &UP));
                    let (coat, light) = (sheen(t, tint), t.lobe(LobeKind::Emission, 3, &[]));
                    let (a, b) = (t.mul([0.5; 3], a), t.mul([0.5; 3], b));
                    let (layered, beside) = (t.layer(coat, a), t.layer(light, b));
                    t.add(layered, beside)
                }),
                true,
            ),
            (
                "a layer in a top",
                build(&|t| {
                    let [a, b] = [1, 2].map(|site| t.lobe(LobeKind::Diffuse, site, &UP));
                    let coat = sheen(t, tint);
                    let a = t.mul([0.5; 3], a);
                    let top = t.layer(coat, a);
                    t.layer(top, b)
                }),
                false,
            ),
            (
                "something beside a layer in a base",
                build(&|t| {
                    let [a, b] = [1, 2].map(|site| t.lobe(LobeKind::Diffuse, site, &UP));
                    let [inner, outer] = [sheen(t, tint), sheen(t, [0.9; 3])];
                    let layered = t.layer(inner, a);
                    let (layered, b) = (t.mul([0.5; 3], layered), t.mul([0.5; 3], b));
                    let base = t.add(layered, b);
                    t.layer(outer, base)
                }),
                false,
            ),
        ]
    }

    #[test]
    fn flat_trees_give_what_the_full_walk_gives() {
        for (shape, tree, flat) in shapes() {
            let curves = Curves::for_tree(&tree, Precision::FAST);
            for rule in [LayeringRule::Min, LayeringRule::View] {
                let layering = Layering { rule, ..Layering::default() };
                for wo in [V3::polar(0.7f32, 0.4), V3::polar(0.05, 2.0), V3::polar(-0.3, 1.0)] {
                    let mut bsdf = flatten(&tree, &Globals::default(), wo, layering, &curves).expect("small");
                    assert_eq!(bsdf.is_flat(), flat, "{shape}");
                    let directions = [0.9f32, 0.5, 0.1, 0.01, -0.5].map(|cos| V3::polar(cos, 5.0 * cos));
                    let evaluate = |bsdf: &Bsdf<f32>| directions.map(|w| bsdf.eval([w.x, w.y, w.z]));
                    let found = evaluate(&bsdf);
                    bsdf.flat = false;
                    assert_eq!(found, evaluate(&bsdf), "{shape}, {rule:?}, from {wo:?}");
                }
            }
        }
    }

    #[test]
    fn of_very_many_lobes_each_has_its_own_rest() {
        let mut tree = ClosureTree::new();
        let block = |k: u32| [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.1 + 1e-5 * k as f32, 0.0, 0.0, 1.0];
        let mut root = tree.lobe(LobeKind::Sheen, 0, &block(0));
        for k in 1..70_000 {
            let lobe = tree.lobe(LobeKind::Sheen, 0, &block(k));
            root = tree.add(root, lobe);
        }
        tree.set_root(root);
        let (curves, wo) = (Curves::<f32>::default(), V3::polar(0.7, 0.4));
        let bsdf = flatten(&tree, &Globals::default(), wo, Layering::default(), &curves).expect("within budget");
        for k in [0, 1, 65_535, 65_536, 69_999] {
            let local = bsdf.lobe_frame(k).to_local(wo);
            let alone = AnyLobe::new(LobeKind::Sheen, &block(k as u32), local, &curves.at(0).curve);
            let whole = bsdf.lobe(k).whole();
            let wi = V3::polar(0.3, 2.0);
            assert_eq!(whole.f(wi, &curves.at(0).curve), alone.f(wi, &curves.at(0).curve), "{k}");
        }
    }
}
