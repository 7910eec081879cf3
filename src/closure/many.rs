//! The BSDFs of one material at many points: eight side by side where the material always makes the same tree.
//!
//! What a lobe holds for ωo is then held for eight points in one vector, so that a direction each costs little more than
//! eight directions at one point. Elsewhere, and on processors without such vectors, there is one BSDF per point.

use super::batch::{BLOCKS, Block, LANES};
use super::bsdf::{Bsdf, Eval, add, unit_or_zero};
use super::flatten::Curves;
use super::met::{FlatLobe, Place};
use super::plan::Plan;
use super::tree::ClosureTree;
use crate::globals::Globals;
use crate::lobes::host::HostSeen;
use crate::lobes::{AimedLobe, AnyLobe, Evaluated, Listed, LobeVisitor, host_again};
use crate::optics::{F32x8, Lanes, Lift, V3, dispatch};
use std::marker::PhantomData;

/// The BSDFs of one material at many points, see [`Material::shade_many`](crate::Material::shade_many). Memory is used again.
///
/// ```
/// # #[cfg(feature = "cloth")] {
/// use overcoat::{Bsdfs, Engine, Globals};
/// let material = Engine::new().material("cloth", "Ci = sheen(diffuse(N), N, 1, 0.3);")?;
/// let points = vec![Globals::default(); 20];
/// let wo = vec![[0.6, 0.0, 0.8]; 20];
/// let mut bsdfs = Bsdfs::new();
/// material.shade_many(&points, &wo, &mut bsdfs)?;
/// let wi = vec![[0.0, 0.6, 0.8]; 20];
/// let mut out = vec![Default::default(); 20];
/// bsdfs.eval(&wi, &mut out);
/// assert_eq!(out[7], material.shade(&points[7], wo[7].into())?.eval(wi[7]));
/// # }
/// # Ok::<(), overcoat::Error>(())
/// ```
#[derive(Debug, Default)]
pub struct Bsdfs<'m> {
    len: usize,
    /// Of points one after the other; those beyond the last repeat it.
    eights: Vec<Bsdf<'m, F32x8>>,
    /// What their lobes do not keep themselves: the same for all.
    rests: Vec<AnyLobe<F32x8>>,
    /// In place of them.
    each: Vec<Bsdf<'m>>,
    /// Which of the two.
    abreast: bool,
    /// That of the point being shaded.
    tree: ClosureTree,
}

impl<'m> Bsdfs<'m> {
    /// None yet.
    pub fn new() -> Self {
        Bsdfs::default()
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether points stand side by side in vectors.
    pub fn abreast(&self) -> bool {
        self.abreast
    }

    /// f·|cos| and pdf of one direction per point: bit for bit what [`Bsdf::eval`] gives there. Like a `zip` it ends with the
    /// shortest of points, directions and room for results.
    pub fn eval(&self, wi: &[[f32; 3]], out: &mut [Eval]) {
        let count = self.len.min(wi.len()).min(out.len());
        let (wi, out) = (&wi[..count], &mut out[..count]);
        if self.abreast {
            dispatch::lanes(Abreast { eights: &self.eights, rests: &self.rests, wi, out });
        } else {
            for ((bsdf, wi), out) in self.each.iter().zip(wi).zip(out) {
                *out = bsdf.eval(*wi);
            }
        }
    }

    /// Turned from a plan at points of the same number as directions.
    pub(crate) fn turn(&mut self, plan: &'m Plan<f32>, curves: &'m Curves<f32>, points: &[Globals], wo: &[[f32; 3]]) {
        (self.len, self.abreast) = (points.len(), true);
        let count = points.len().div_ceil(LANES);
        if self.eights.len() < count {
            self.eights.resize_with(count, Bsdf::black);
        }
        plan.rests(curves, &mut self.rests);
        for (k, eight) in self.eights[..count].iter_mut().enumerate() {
            let at: [usize; LANES] = std::array::from_fn(|i| (k * LANES + i).min(points.len() - 1));
            plan.turn_eight(at.map(|i| &points[i]), at.map(|i| wo[i]), curves, eight);
        }
    }

    /// Room for a BSDF per point, and for a tree.
    pub(crate) fn apart(&mut self, count: usize) -> (&mut [Bsdf<'m>], &mut ClosureTree) {
        (self.len, self.abreast) = (count, false);
        if self.each.len() < count {
            self.each.resize_with(count, Bsdf::black);
        }
        (&mut self.each[..count], &mut self.tree)
    }

    /// None any more.
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }
}

/// The work of [`Bsdfs::eval`].
struct Abreast<'a, 'm> {
    eights: &'a [Bsdf<'m, F32x8>],
    rests: &'a [AnyLobe<F32x8>],
    wi: &'a [[f32; 3]],
    out: &'a mut [Eval],
}

impl dispatch::LaneWork for Abreast<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        if !L::VECTORS {
            // Nothing stands abreast without them: no code for that.
            return;
        }
        let Abreast { eights, rests, wi, out } = self;
        let groups = eights.chunks(BLOCKS).zip(wi.chunks(BLOCKS * LANES)).zip(out.chunks_mut(BLOCKS * LANES));
        for ((eights, wi), out) in groups {
            let mut blocks = [Block::<L>::black(); BLOCKS];
            for (block, wi) in blocks.iter_mut().zip(wi.chunks(LANES)) {
                block.wi = unit_or_zero(match wi.first_chunk() {
                    Some(wi) => L::load(wi),
                    // Those beyond the last are not looked at.
                    None => L::load(&std::array::from_fn(|i| wi[i.min(wi.len() - 1)])),
                });
            }
            let count = wi.len().div_ceil(LANES);
            evaluate(&eights[..count], rests, &mut blocks[..count]);
            for (block, out) in blocks.iter().zip(out.chunks_mut(LANES)) {
                match out.first_chunk_mut() {
                    Some(out) => block.store(out),
                    None => {
                        let mut all = [Eval::default(); LANES];
                        block.store(&mut all);
                        out.copy_from_slice(&all[..out.len()]);
                    }
                }
            }
        }
    }
}

/// Adds up every lobe.
#[inline(always)]
fn evaluate<L: Lanes>(eights: &[Bsdf<'_, F32x8>], rests: &[AnyLobe<F32x8>], blocks: &mut [Block<L>]) {
    let Some(first) = eights.first() else { return };
    let rule = first.layering.rule;
    let mut frame = u32::MAX;
    for (index, (place, rest)) in first.places().iter().zip(rests).enumerate() {
        let turns = place.frame != frame;
        frame = place.frame;
        for (block, eight) in blocks.iter_mut().zip(eights) {
            if turns {
                block.local = eight.frames[frame as usize].to_local(block.wi);
            }
            let alpha_o = <L as Lift<F32x8>>::lift(eight.lobes[index].alpha_o);
            block.scale = block.stack.step(place.steps, rule, alpha_o);
        }
        first.lobes[index].lobe.visit(Visit { eights, place, rest, index, blocks: &mut *blocks });
    }
}

/// One lobe of the tree, at all points.
struct Visit<'a, 'm, L> {
    eights: &'a [Bsdf<'m, F32x8>],
    place: &'a Place<f32>,
    rest: &'a AnyLobe<F32x8>,
    index: usize,
    blocks: &'a mut [Block<L>],
}

impl<L: Lanes> Visit<'_, '_, L> {
    #[inline(always)]
    fn add_up(self, lobe: impl Evaluate<L>) {
        let Visit { eights, place, rest, index, blocks } = self;
        for (block, eight) in blocks.iter_mut().zip(eights) {
            let l = &eight.lobes[index];
            // Of one plan, all are of one kind.
            if let Some(e) = lobe.toward(l, rest, block.local, place.in_top) {
                add(&mut block.sum, &l.share, [block.scale; 3], block.local.z, &e);
                if place.in_top {
                    block.stack.lobe(place.weight_in_top, e.bound);
                }
            }
        }
    }
}

/// What a kind of lobe gives toward a direction. No closure, because those cannot be told to be inlined.
trait Evaluate<L> {
    fn toward(&self, l: &FlatLobe<'_, F32x8>, rest: &AnyLobe<F32x8>, wi: V3<L>, bound: bool) -> Option<Evaluated<L>>;
}

/// One of the list.
struct OfList<B>(PhantomData<B>);

impl<L: Lanes, B: Listed<F32x8>> Evaluate<L> for OfList<B> {
    #[inline(always)]
    fn toward(&self, l: &FlatLobe<'_, F32x8>, rest: &AnyLobe<F32x8>, wi: V3<L>, bound: bool) -> Option<Evaluated<L>> {
        Some(B::evaluate_kept(B::kept(&l.lobe)?, || B::listed(rest), wi, &l.known.curve, bound))
    }
}

/// A host's.
struct OfHost;

impl<L: Lanes> Evaluate<L> for OfHost {
    #[inline(always)]
    fn toward(&self, l: &FlatLobe<'_, F32x8>, rest: &AnyLobe<F32x8>, wi: V3<L>, _: bool) -> Option<Evaluated<L>> {
        let AimedLobe::Host(kept) = &l.lobe else { return None };
        let lobe = host_again(kept, || Some(rest))?;
        Some(Evaluated { f: lobe.f(wi), pdf: lobe.pdf(wi), bound: lobe.albedo_bound(wi) })
    }
}

impl<L: Lanes> LobeVisitor<F32x8> for Visit<'_, '_, L> {
    #[inline(always)]
    fn scattering<B: Listed<F32x8>>(self) {
        L::apart(Added { visit: self, lobe: OfList::<B>(PhantomData) });
    }

    fn host(self, _: &HostSeen<F32x8>) {
        self.add_up(OfHost);
    }
}

/// A kind of lobe added up, in a function of its own.
struct Added<'a, 'm, L, B> {
    visit: Visit<'a, 'm, L>,
    lobe: B,
}

impl<L: Lanes, B: Evaluate<L>> dispatch::Work for Added<'_, '_, L, B> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.visit.add_up(self.lobe);
    }
}

#[cfg(all(test, feature = "cloth"))]
mod tests {
    use super::super::flatten::{Layering, flatten};
    use super::super::plan::{Axes, Direction};
    use super::*;
    use crate::albedo::Precision;
    use crate::lobes::LobeKind;
    use crate::optics::V3;
    use glam::Vec3;

    /// Points seen from all around, the last of them from nowhere.
    fn points() -> (Vec<Globals>, Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let toward = |k: usize, turn: f32| {
            let w = V3::polar((0.37 * k as f32).cos(), turn * k as f32);
            [w.x, w.y, w.z]
        };
        let globals = |k: usize| Globals {
            n: Vec3::new(0.2, 0.1 * k as f32, 1.0),
            dpdu: Vec3::new(1.0, 0.3, 0.1 * k as f32),
            backfacing: k % 3 == 1,
            ..Globals::default()
        };
        let mut wo: Vec<_> = (0..83).map(|k| toward(k, 2.4)).collect();
        wo[81] = [0.0; 3];
        wo[82] = [f32::NAN, 0.0, 1.0];
        ((0..83).map(globals).collect(), wo, (0..83).map(|k| toward(k, 0.9)).collect())
    }

    #[test]
    fn points_abreast_give_what_each_gives_alone() {
        if !dispatch::has_lanes() {
            return;
        }
        let coarse = Precision { cos_nodes: 8, axis_nodes: 8, polar: 8, azimuth: 8, ..Precision::FAST };
        let (points, wo, wi) = points();
        let mut planned = 0;
        let kinds: Vec<_> = LobeKind::ALL
            .iter()
            .map(|kind| {
                let params = kind.spec().params.iter();
                let default = params.flat_map(|p| (0..p.ty.slots()).map(|k| p.default.get(k).copied().unwrap_or(0.0)));
                let mut tree = ClosureTree::new();
                let base = tree.lobe(*kind, 0, &default.collect::<Vec<_>>());
                let top = tree.lobe(LobeKind::Sheen, 1, &[0.0, 0.0, 1.0, 0.4, 0.5, 0.6, 0.4, 0.0, 0.0, 1.0]);
                let root = tree.layer(top, base);
                tree.set_root(root);
                let curves = Curves::for_tree(&tree, coarse);
                (tree, curves)
            })
            .collect();
        let plans: Vec<_> = kinds
            .iter()
            .map(|(tree, curves)| {
                let globals = Globals { backfacing: true, ..Globals::apart() };
                let bsdf = flatten(tree, &globals, V3::new(0.0, 0.0, 1.0), Layering::default(), curves).expect("small");
                Plan::of(&bsdf, curves, |site| {
                    let (_, kind, values) = tree.lobes().find(|l| l.0 == site)?;
                    let (normal, tangent) = (Direction::Normal, Direction::AlongU);
                    Some(Axes { normal, tangent, between_media: kind.between_media(values) })
                })
            })
            .collect();
        let mut bsdfs = Bsdfs::new();
        for (plan, (_, curves)) in plans.iter().zip(&kinds) {
            let Some(plan) = plan else { continue };
            planned += 1;
            for count in [83, 64, 5] {
                bsdfs.turn(plan, curves, &points[..count], &wo[..count]);
                let mut out = vec![Eval::default(); count];
                bsdfs.eval(&wi, &mut out);
                let mut alone = Bsdf::black();
                for k in 0..count {
                    let [x, y, z] = wo[k];
                    plan.turn(&points[k], V3::new(x, y, z), curves, &mut alone);
                    assert_eq!(out[k], alone.eval(wi[k]), "{:?} at point {k} of {count}", alone.lobes[1].lobe.kind());
                }
            }
        }
        assert!(planned >= LobeKind::ALL.len() - 5, "{planned}");
    }
}
