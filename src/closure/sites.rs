//! What is known of a lobe before any point is shaded, made once per place in the program that constructs one.
//!
//! Where a parameter block turns out to be the one that was prepared for, a lobe is turned toward ωo in place of being
//! made from its parameters. The block is compared each time: nothing here need be told when a tree changes.

use super::walk::Weights;
use crate::albedo::AlbedoCurve;
use crate::lobes::registry::ParamTy;
use crate::lobes::{AnyLobe, LobeKind, Rgb32};
use crate::optics::{Scalar, V3};

/// A lobe whose parameters, but for directions, are known.
#[derive(Clone, Debug)]
pub(super) struct Site<S: Scalar> {
    kind: LobeKind,
    /// Its block, and which bits of each slot count: none of a direction's, which shading may change.
    block: Vec<(u32, u32)>,
    /// Its color.
    weight: Rgb32,
    white: bool,
    /// Prepared for a viewer along the normal.
    lobe: AnyLobe<S>,
}

impl<S: Scalar> Site<S> {
    /// `None` if something but a direction is known only when shading.
    pub fn new(kind: LobeKind, known: &[Option<f32>], curve: &AlbedoCurve<S>) -> Option<Self> {
        let types = kind.spec().params.iter().flat_map(|p| std::iter::repeat_n(p.ty, p.ty.slots()));
        let counts = types.map(|ty| !matches!(ty, ParamTy::Normal | ParamTy::Vector));
        let slots = known.iter().zip(counts).map(|(value, counts)| match (value, counts) {
            (Some(value), true) => Some((value.to_bits(), u32::MAX)),
            (None, true) => None,
            (_, false) => Some((0, 0)),
        });
        let block = slots.collect::<Option<Vec<_>>>()?;
        let values: Vec<f32> = block.iter().map(|(bits, _)| f32::from_bits(*bits)).collect();
        let above = V3::new(S::zero(), S::zero(), S::one());
        let lobe = AnyLobe::new(kind, &values, above, curve);
        let weight = kind.weight(&values);
        Some(Site { kind, block, weight, white: weight == [1.0; 3], lobe })
    }

    /// The same with another table's numbers.
    pub fn cast<T: Scalar>(&self, curve: &AlbedoCurve<T>) -> Option<Site<T>> {
        let known: Vec<_> = self.block.iter().map(|(bits, _)| Some(f32::from_bits(*bits))).collect();
        Site::new(self.kind, &known, curve)
    }

    /// Whether it was prepared for this block.
    #[inline(always)]
    pub fn is_of(&self, kind: LobeKind, values: &[f32]) -> bool {
        let differs = |(value, (bits, counts)): (&f32, &(u32, u32))| (value.to_bits() ^ bits) & counts;
        self.kind == kind && values.iter().zip(&self.block).map(differs).fold(0, |all, d| all | d) == 0
    }

    /// `weights` with the lobe's color, [`LobeKind::weight`], among them.
    #[inline(always)]
    pub fn tinted(&self, weights: Weights<S>) -> Weights<S> {
        if self.white { weights } else { weights.times(self.weight) }
    }

    /// Makes `to` the lobe for another ωo, if there is a shorter way than from its parameters.
    #[inline(always)]
    pub fn turn(&self, wo: V3<S>, curve: &AlbedoCurve<S>, to: &mut AnyLobe<S>) -> bool {
        self.lobe.turn(wo, curve, to)
    }
}
