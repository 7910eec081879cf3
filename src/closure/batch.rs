//! Many directions at once: eight side by side, in the widest vectors at hand, and several eights per lobe.
//!
//! Each lobe is gone to once for up to [`BLOCKS`] eights, so that what it is and what it holds is looked up once, and one
//! eight's arithmetic goes on while another's waits. What goes from lobe to lobe is kept per eight.

use super::bsdf::{Bsdf, Eval, Op, add, finite, unit_or_zero};
use super::flatten::Layering;
use super::layer::{FlatStack, LayerStack, TintRule};
use super::met::{LayerAlpha, Met};
use crate::albedo::AlbedoCurve;
use crate::lobes::host::{Host, HostSeen};
use crate::lobes::{AnyLobe, Evaluated, Listed, Lobe, LobeVisitor, host_again};
use crate::optics::{F32x8, Lanes, Lift, V3, array, dispatch};

/// How many layers may be open at once for directions to be worked on side by side.
const DEPTH: usize = 4;
pub(super) const LANES: usize = F32x8::LANES;
/// Eights per visit of a lobe.
pub(super) const BLOCKS: usize = 8;

impl Bsdf<'_, f32> {
    /// [`eval`](Self::eval) of many directions at once. Gives bit for bit what `eval` gives, however many there are. Like a
    /// `zip` it ends with the shorter of the two slices.
    pub fn eval_batch(&self, wi: &[[f32; 3]], out: &mut [Eval]) {
        let count = wi.len().min(out.len());
        let (wi, out) = (&wi[..count], &mut out[..count]);
        // Rare trees are not worth code of their own.
        if count >= LANES && usize::from(self.depth) <= DEPTH && self.layering.tint == TintRule::Largest {
            dispatch::lanes(Batch { bsdf: self, wi, out });
        } else {
            out.iter_mut().zip(wi).for_each(|(out, wi)| *out = self.eval(*wi));
        }
    }
}

#[cfg(all(test, feature = "cloth", feature = "microfacet", feature = "legacy"))]
impl Bsdf<'_, f32> {
    /// [`eval_batch`](Self::eval_batch) in arrays, as on a processor without vectors of its own; for eight directions or more.
    pub(crate) fn eval_batch_in_arrays(&self, wi: &[[f32; 3]], out: &mut [Eval]) {
        dispatch::LaneWork::run::<F32x8>(Batch { bsdf: self, wi, out });
    }
}

/// The work of [`Bsdf::eval_batch`], compiled for each instruction set that is chosen from at run time.
struct Batch<'a, 'm> {
    bsdf: &'a Bsdf<'m>,
    wi: &'a [[f32; 3]],
    out: &'a mut [Eval],
}

impl dispatch::LaneWork for Batch<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Batch { bsdf, wi, out } = self;
        let (mut blocks, mut starts) = ([Block::<L>::black(); BLOCKS], [0; BLOCKS]);
        let (mut count, mut start) = (0, 0);
        while start < wi.len() {
            // The last eight may overlap those before: the same again.
            start = start.min(wi.len() - LANES);
            if let Some(wi) = wi[start..].first_chunk() {
                blocks[count] = Block { wi: unit_or_zero(L::load(wi)), ..Block::black() };
                starts[count] = start;
            }
            (count, start) = (count + 1, start + LANES);
            if count == BLOCKS || start >= wi.len() {
                evaluate(bsdf, &mut blocks[..count]);
                for (block, start) in blocks[..count].iter().zip(starts) {
                    if let Some(out) = out[start..].first_chunk_mut() {
                        block.store(out);
                    }
                }
                count = 0;
            }
        }
    }
}

/// What goes from lobe to lobe of eight directions.
#[derive(Clone, Copy)]
pub(super) struct Block<L> {
    pub wi: V3<L>,
    /// In the frame of the lobe.
    pub local: V3<L>,
    pub stack: FlatStack<L>,
    /// What the layers above the lobe leave of it.
    pub scale: L,
    pub sum: [L; 4],
}

impl<L: Lanes> Block<L> {
    #[inline(always)]
    pub fn black() -> Self {
        let nowhere = V3::new(L::zero(), L::zero(), L::zero());
        Block { wi: nowhere, local: nowhere, stack: FlatStack::default(), scale: L::one(), sum: [L::zero(); 4] }
    }

    #[inline(always)]
    pub fn store(&self, out: &mut [Eval; LANES]) {
        let rows = L::store(array(|k| finite(self.sum[k])));
        for i in 0..LANES {
            let [r, g, b, pdf] = rows[i];
            out[i] = Eval { f_cos: [r, g, b], pdf };
        }
    }
}

/// Adds up every lobe.
#[inline(always)]
fn evaluate<L: Lanes>(bsdf: &Bsdf<'_>, blocks: &mut [Block<L>]) {
    let (frames, rule) = (&*bsdf.frames, bsdf.layering.rule);
    let mut deep = if bsdf.is_flat() { None } else { Some(Deep::new(bsdf)) };
    let mut frame = u32::MAX;
    for (index, l) in bsdf.met().enumerate() {
        if l.place.frame != frame {
            frame = l.place.frame;
            for block in &mut *blocks {
                block.local = frames[frame as usize].to_local(block.wi);
            }
        }
        match &mut deep {
            None => {
                for block in &mut *blocks {
                    block.scale = block.stack.step(l.place.steps, rule, <L as Lift<f32>>::lift(l.flat.alpha_o));
                }
            }
            Some(deep) => deep.go_on(blocks, index),
        }
        let stacks = deep.as_mut().map(|d| &mut d.stacks);
        l.flat.lobe.visit(Visit { bsdf, index, l, blocks: &mut *blocks, stacks });
    }
}

/// One lobe, for all blocks.
struct Visit<'a, 'm, L: Lanes> {
    bsdf: &'a Bsdf<'m>,
    index: usize,
    l: Met<'a, 'm, f32>,
    blocks: &'a mut [Block<L>],
    /// Of a tree that is not flat.
    stacks: Option<&'a mut [Stack<L>; BLOCKS]>,
}

impl<L: Lanes> Visit<'_, '_, L> {
    #[inline(always)]
    fn add_up(self, lobe: impl Evaluate<L>) {
        let Visit { bsdf, index, l, blocks, mut stacks } = self;
        let balanced = bsdf.balanced.get(index).and_then(Option::as_ref);
        for (k, block) in blocks.iter_mut().enumerate() {
            let local = block.local;
            let e = lobe.toward(local);
            match balanced {
                Some(balanced) => add(&mut block.sum, &l.flat.share, balanced.scale(local.z), local.z, &e),
                // Each channel alike: the compiler is told.
                None => add(&mut block.sum, &l.flat.share, [block.scale; 3], local.z, &e),
            }
            if l.place.in_top {
                let [r, g, b, _] = l.place.weight_in_top;
                match &mut stacks {
                    None => block.stack.lobe(l.place.weight_in_top, e.bound),
                    Some(stacks) => stacks[k].lobe([r, g, b], e.bound),
                }
            }
        }
    }
}

/// What a lobe gives toward a direction. No closure, because those cannot be told to be inlined.
trait Evaluate<L> {
    fn toward(&self, wi: V3<L>) -> Evaluated<L>;
}

/// A lobe of the list as it is kept, with its rest, its table and whether its bound is asked for.
struct AtCurve<'a, B: Lobe<f32>> {
    kept: &'a B::Aimed,
    rest: Option<&'a AnyLobe<f32>>,
    curve: &'a AlbedoCurve<f32>,
    bound: bool,
}

impl<L: Lanes, B: Listed<f32>> Evaluate<L> for AtCurve<'_, B> {
    #[inline(always)]
    fn toward(&self, wi: V3<L>) -> Evaluated<L> {
        B::evaluate_kept(self.kept, || self.rest.and_then(B::listed), wi, self.curve, self.bound)
    }
}

impl<L: Lanes> Evaluate<L> for &Host<f32> {
    #[inline(always)]
    fn toward(&self, wi: V3<L>) -> Evaluated<L> {
        Evaluated { f: self.f(wi), pdf: self.pdf(wi), bound: self.albedo_bound(wi) }
    }
}

/// A lobe added up, in a function of its own.
struct Added<'a, 'm, L: Lanes, B> {
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

impl<L: Lanes> LobeVisitor<f32> for Visit<'_, '_, L> {
    #[inline(always)]
    fn scattering<B: Listed<f32>>(self) {
        let (curve, bound, rest) = (self.l.curve(), self.l.place.in_top, self.l.rest());
        let Some(kept) = B::kept(&self.l.flat.lobe) else { return };
        L::apart(Added { visit: self, lobe: AtCurve::<B> { kept, rest, curve, bound } });
    }

    #[inline(always)]
    fn host(self, kept: &HostSeen<f32>) {
        let Some(lobe) = host_again(kept, || self.l.rest()) else { return };
        L::apart(Added { visit: self, lobe: &lobe });
    }
}

type Stack<L> = LayerStack<L, DEPTH, 1>;

/// Layers in layers, or layers that were solved for. All channels are dimmed alike.
struct Deep<'a, 'm, L> {
    bsdf: &'a Bsdf<'m>,
    next: usize,
    layer: usize,
    stacks: [Stack<L>; BLOCKS],
}

impl<'a, 'm, L: Lanes> Deep<'a, 'm, L> {
    #[inline(always)]
    fn new(bsdf: &'a Bsdf<'m>) -> Self {
        Deep { bsdf, next: 0, layer: 0, stacks: [LayerStack::default(); BLOCKS] }
    }

    /// Goes on to the next lobe, which is `lobe`, and leaves what the layers above it scale it by.
    #[inline(always)]
    fn go_on(&mut self, blocks: &mut [Block<L>], lobe: usize) {
        let bsdf = self.bsdf;
        let stacks = &mut self.stacks[..blocks.len()];
        for op in &bsdf.ops()[self.next..] {
            self.next += 1;
            match *op {
                Op::Lobe => break,
                Op::Begin => stacks.iter_mut().for_each(LayerStack::begin),
                Op::Middle => {
                    let LayerAlpha { alpha_o, weight } = bsdf.layer(self.layer, lobe);
                    let Layering { rule, tint } = bsdf.layering;
                    self.layer += 1;
                    for stack in &mut *stacks {
                        stack.middle(weight, rule, tint, Some(alpha_o));
                    }
                }
                Op::End => stacks.iter_mut().for_each(LayerStack::end),
            }
        }
        for (block, stack) in blocks.iter_mut().zip(stacks) {
            block.scale = stack.scale()[0];
        }
    }
}
