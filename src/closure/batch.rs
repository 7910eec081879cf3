//! Many directions at once: eight side by side, in the widest vectors at hand.

use super::bsdf::{Bsdf, Eval, LayerAlpha, Op, add, finite, unit_or_zero};
use super::layer::{FlatStack, LayerStack, TintRule};
use crate::optics::{F32x8, Lift, Real, V3, dispatch};

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
            let zero = F32x8::zero();
            let mut state = State { stack: FlatStack::default(), sum: [zero; 4], local: V3::new(zero, zero, zero) };
            dispatch::widest(Batch { bsdf: self, wi, out, state: &mut state });
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
    state: &'a mut State,
}

/// What goes from lobe to lobe. In the caller's memory: taken apart into single numbers, it would have to be put together
/// again for every vector operation.
struct State {
    stack: FlatStack<F32x8>,
    sum: [F32x8; 4],
    local: V3<F32x8>,
}

impl dispatch::Work for Batch<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Batch { bsdf, wi, out, state } = self;
        let mut start = 0;
        while start < wi.len() {
            // The last eight may overlap those before: the same again.
            start = start.min(wi.len() - LANES);
            let block = start..start + LANES;
            if let (Some(wi), Some(out)) = (wi[block.clone()].first_chunk(), out[block].first_chunk_mut()) {
                eight(bsdf, wi, out, state);
            }
            start += LANES;
        }
    }
}

/// One block. There is one place where lobes are evaluated, because they are a lot of code.
#[inline(always)]
fn eight(bsdf: &Bsdf<'_>, wi: &[[f32; 3]; LANES], out: &mut [Eval; LANES], state: &mut State) {
    let lanes = |c: usize| F32x8(std::array::from_fn(|i| wi[i][c]));
    let wi = unit_or_zero(V3::new(lanes(0), lanes(1), lanes(2)));
    let (lobes, frames, rule) = (&*bsdf.lobes, &*bsdf.frames, bsdf.layering.rule);
    let mut deep =
        if bsdf.is_flat() { None } else { Some(Deep { bsdf, next: 0, layer: 0, stack: LayerStack::default() }) };
    let mut frame = u32::MAX;
    state.stack = FlatStack::default();
    state.sum = [F32x8::zero(); 4];
    for (index, l) in lobes.iter().enumerate() {
        if l.frame != frame {
            frame = l.frame;
            state.local = frames[frame as usize].to_local(wi);
        }
        let scale = match &mut deep {
            None => [state.stack.step(l.steps, rule, F32x8::lift(l.alpha_o)); 3],
            Some(deep) => deep.scale(index, &state.local),
        };
        let e = l.lobe.evaluate_lanes(&state.local, l.curve, l.in_top);
        add(&mut state.sum, l, scale, state.local.z, &e);
        if l.in_top {
            let [r, g, b, _] = l.weight_in_top;
            match &mut deep {
                None => state.stack.lobe(l.weight_in_top, e.bound),
                Some(deep) => deep.stack.lobe([r, g, b], e.bound),
            }
        }
    }
    for f in &mut state.sum[..3] {
        *f = finite(*f);
    }
    let [r, g, b, pdf] = &state.sum;
    for i in 0..LANES {
        out[i] = Eval { f_cos: [r.0[i], g.0[i], b.0[i]], pdf: pdf.0[i] };
    }
}

/// Layers in layers, or layers that were solved for.
struct Deep<'a, 'm> {
    bsdf: &'a Bsdf<'m>,
    next: usize,
    layer: usize,
    stack: LayerStack<F32x8, DEPTH, 1>,
}

impl Deep<'_, '_> {
    /// Goes on to lobe `index`; what the layers above it scale it by.
    #[inline(always)]
    fn scale(&mut self, index: usize, local: &V3<F32x8>) -> [F32x8; 3] {
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
