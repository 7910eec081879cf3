//! Many directions at once: eight side by side, in the widest vectors at hand.

use super::bsdf::{Bsdf, Eval, LayerAlpha, Op, add, finite, unit_or_zero};
use super::layer::{FlatStack, LayerStack, TintRule};
use crate::optics::{F32x8, Lanes, Lift, V3, dispatch};

/// How many layers may be open at once for directions to be worked on side by side.
const DEPTH: usize = 4;
const LANES: usize = F32x8::LANES;

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
        let mut start = 0;
        while start < wi.len() {
            // The last eight may overlap those before: the same again.
            start = start.min(wi.len() - LANES);
            let block = start..start + LANES;
            if let (Some(wi), Some(out)) = (wi[block.clone()].first_chunk(), out[block].first_chunk_mut()) {
                eight::<L>(bsdf, wi, out);
            }
            start += LANES;
        }
    }
}

/// One block. There is one place where lobes are evaluated, because they are a lot of code.
#[inline(always)]
fn eight<L: Lanes>(bsdf: &Bsdf<'_>, wi: &[[f32; 3]; LANES], out: &mut [Eval; LANES]) {
    let wi = unit_or_zero(L::load(wi));
    let (lobes, frames, rule) = (&*bsdf.lobes, &*bsdf.frames, bsdf.layering.rule);
    let mut deep =
        if bsdf.is_flat() { None } else { Some(Deep { bsdf, next: 0, layer: 0, stack: LayerStack::default() }) };
    let (mut frame, mut local) = (u32::MAX, wi);
    let mut stack = FlatStack::<L>::default();
    let mut sum = [L::zero(); 4];
    for (index, l) in lobes.iter().enumerate() {
        if l.frame != frame {
            frame = l.frame;
            local = frames[frame as usize].to_local(wi);
        }
        let scale = match &mut deep {
            None => [stack.step(l.steps, rule, <L as Lift<f32>>::lift(l.alpha_o)); 3],
            Some(deep) => deep.scale(index, &local),
        };
        let e = l.lobe.evaluate_lanes(local, l.curve, l.in_top);
        add(&mut sum, l, scale, local.z, &e);
        if l.in_top {
            let [r, g, b, _] = l.weight_in_top;
            match &mut deep {
                None => stack.lobe(l.weight_in_top, e.bound),
                Some(deep) => deep.stack.lobe([r, g, b], e.bound),
            }
        }
    }
    let [r, g, b, pdf] = sum;
    let rows = L::store([finite(r), finite(g), finite(b), pdf]);
    for (out, [r, g, b, pdf]) in out.iter_mut().zip(rows) {
        *out = Eval { f_cos: [r, g, b], pdf };
    }
}

/// Layers in layers, or layers that were solved for.
struct Deep<'a, 'm, L> {
    bsdf: &'a Bsdf<'m>,
    next: usize,
    layer: usize,
    stack: LayerStack<L, DEPTH, 1>,
}

impl<L: Lanes> Deep<'_, '_, L> {
    /// Goes on to lobe `index`; what the layers above it scale it by.
    #[inline(always)]
    fn scale(&mut self, index: usize, local: &V3<L>) -> [L; 3] {
        let bsdf = self.bsdf;
        for op in &bsdf.ops[self.next..] {
            self.next += 1;
            match *op {
                Op::Lobe => break,
                Op::Begin => self.stack.begin(),
                Op::Middle => {
                    let LayerAlpha { alpha_o, weight } = bsdf.layers[self.layer];
                    self.layer += 1;
                    self.stack.middle(weight, bsdf.layering.rule, bsdf.layering.tint, Some(alpha_o));
                }
                Op::End => self.stack.end(),
            }
        }
        match bsdf.balanced.get(index) {
            Some(Some(balanced)) => balanced.scale(local.z),
            _ => self.stack.scale(),
        }
    }
}
