//! A tree written out, top before base: the order that flattening and balancing share.
//!
//! A loop over an explicit stack, because trees may be deep. A node used twice is visited twice.

use super::tree::{ClosureTree, MAX_WEIGHT, Node, NodeId};
use crate::globals::Globals;
use crate::lobes::{LobeKind, Rgb, Rgb32};
use crate::optics::{Frame, Scalar, V3};
use glam::Vec3;
use smallvec::SmallVec;

/// Weights along the way from the root to a node: three channels and an idle one, because four go as one.
#[derive(Clone, Copy)]
pub(super) struct Weights<S> {
    /// From the root.
    pub total: [S; 4],
    /// From the root of the innermost top the node stands in.
    pub in_top: [S; 4],
    /// Whether it stands in a top at all.
    pub inside: bool,
}

impl<S: Scalar> Weights<S> {
    /// Products of weights stay below the largest weight, as each of them does.
    #[inline(always)]
    pub fn times(self, [r, g, b]: Rgb32) -> Self {
        let (weight, limit) = ([r, g, b, b].map(S::from_f32), S::c(MAX_WEIGHT as f64));
        let kept = |x: S| S::select(x.lt(limit), x, limit);
        let product = |a: [S; 4]| std::array::from_fn(|c| kept(a[c] * weight[c]));
        Weights { total: product(self.total), in_top: product(self.in_top), inside: self.inside }
    }
}

/// The three channels.
#[inline(always)]
pub(super) fn first<S: Copy>([r, g, b, _]: [S; 4]) -> Rgb<S> {
    [r, g, b]
}

/// A lobe on the way.
#[derive(Clone, Copy)]
pub(super) struct LobeVisit<'t, S> {
    pub kind: LobeKind,
    pub site: u32,
    /// Its parameter block.
    pub values: &'t [f32],
    /// The lobe's own color is not among them.
    pub weights: Weights<S>,
}

impl<S: Scalar> LobeVisit<'_, S> {
    /// With the lobe's own color, [`LobeKind::weight`], among the weights.
    pub fn tinted(self) -> Self {
        LobeVisit { weights: self.weights.times(self.kind.weight(self.values)), ..self }
    }
}

/// What is done along the way.
pub(super) trait Visitor<S> {
    /// A layer begins, its top first.
    fn begin(&mut self);
    /// A lobe.
    fn lobe(&mut self, lobe: LobeVisit<'_, S>);
    /// The top is complete, the base follows; the weights are the layer's.
    fn middle(&mut self, weights: Weights<S>);
    /// The layer is complete.
    fn end(&mut self);
}

enum Step<S> {
    Visit(NodeId, Weights<S>),
    /// The base of a layer; the weights are the layer's.
    Base(NodeId, Weights<S>),
    End,
}

/// Takes `visitor` through the tree.
pub(super) fn walk<S: Scalar>(tree: &ClosureTree, visitor: &mut impl Visitor<S>) {
    let one = [S::one(); 4];
    let mut steps: SmallVec<[Step<S>; 24]> = SmallVec::new();
    let mut next = Some((tree.root(), Weights { total: one, in_top: one, inside: false }));
    loop {
        // Down the first branch as far as it goes; what stands beside it waits.
        while let Some((id, w)) = next.take() {
            match tree.node(id) {
                Node::Zero => {}
                Node::Add(a, b) => {
                    steps.push(Step::Visit(b, w));
                    next = Some((a, w));
                }
                Node::Mul(weight, c) => next = Some((c, w.times(weight))),
                Node::Layer { top, base } => {
                    steps.push(Step::Base(base, w));
                    next = Some((top, Weights { in_top: one, inside: true, ..w }));
                    visitor.begin();
                }
                Node::Lobe { kind, site, slots } => {
                    let values = tree.values(kind, slots);
                    visitor.lobe(LobeVisit { kind, site, values, weights: w });
                }
            }
        }
        match steps.pop() {
            Some(Step::Visit(id, w)) => next = Some((id, w)),
            Some(Step::Base(id, w)) => {
                visitor.middle(w);
                steps.push(Step::End);
                next = Some((id, w));
            }
            Some(Step::End) => visitor.end(),
            None => return,
        }
    }
}

/// Where a lobe finds the directions its frame is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stand {
    /// First slots of its normal and of its tangent, if it has its own.
    normal: Option<usize>,
    tangent: Option<usize>,
    /// See [`LobeKind::between_media`].
    between_media: bool,
}

impl Stand {
    #[inline]
    pub fn of(kind: LobeKind, values: &[f32]) -> Self {
        let spec = kind.spec();
        let between_media = kind.between_media(values);
        Stand { normal: spec.normal_slot(), tangent: spec.tangent_slot(), between_media }
    }

    /// The normal and the tangent the lobe asks for: its own, or the shading point's.
    #[inline(always)]
    pub fn directions(self, values: &[f32], globals: &Globals) -> (Vec3, Vec3) {
        let vector = |slot: Option<usize>, default: Vec3| {
            slot.and_then(|s| values.get(s..s + 3)).map_or(default, Vec3::from_slice)
        };
        let n = vector(self.normal, globals.n);
        // Seen from inside, N was turned toward the viewer; a lobe between media knows its sides by the outside.
        let n = if globals.backfacing && self.between_media { -n } else { n };
        (n, vector(self.tangent, globals.dpdu))
    }
}

/// [`Stand::directions`] of a lobe met for the first time.
pub(super) fn directions(kind: LobeKind, values: &[f32], globals: &Globals) -> (Vec3, Vec3) {
    Stand::of(kind, values).directions(values, globals)
}

/// The frame that [`directions`] span.
pub(super) fn frame<S: Scalar>((n, t): (Vec3, Vec3), globals: &Globals) -> Frame<S> {
    let v = |v: Vec3| V3::from_f32(v.to_array());
    Frame::new(v(n), v(globals.ng), v(t), v(globals.dpdu))
}
