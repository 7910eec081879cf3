//! What is known of a lobe before any point is shaded, made once per place in the program that constructs one.
//!
//! Where a parameter block turns out to be the one that was prepared for, a lobe is turned toward ωo in place of being
//! made from its parameters. The block is compared each time: nothing here need be told when a tree changes.

use super::walk::Stand;
use crate::albedo::AlbedoCurve;
use crate::lobes::registry::{LobeClass, ParamTy};
use crate::lobes::{AimedLobe, AnyLobe, LobeKind, Rgb, Rgb32};
use crate::optics::{Scalar, V3};
use std::sync::Arc;

/// What is known of a site before shading.
#[derive(Clone, Debug)]
pub(crate) struct Known<S: Scalar> {
    /// The table of its lobe.
    pub curve: Arc<AlbedoCurve<S>>,
    pub site: Option<Site<S>>,
}

impl<S: Scalar> Known<S> {
    /// Its lobe, prepared for some ωo.
    #[inline(always)]
    pub fn lobe(&self) -> Option<&AnyLobe<S>> {
        self.site.as_ref().map(Site::lobe)
    }
}

/// A lobe whose parameters, but for directions, are known.
#[derive(Clone, Debug)]
pub(crate) struct Site<S: Scalar> {
    kind: LobeKind,
    /// Its block; 0 where a direction's slots are.
    values: Vec<f32>,
    /// The block's bits, and which bits of each slot count: none of a direction's, which shading may change.
    block: Vec<(u32, u32)>,
    /// Its color, [`LobeKind::weight`]; `None` if white.
    pub tint: Option<Rgb32>,
    pub stand: Stand,
    pub class: LobeClass,
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
        let tint = (weight != [1.0; 3]).then_some(weight);
        let stand = Stand::of(kind, &values);
        Some(Site { kind, values, block, tint, stand, class: kind.class(), lobe })
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

    /// Its parameters; 0 for directions.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Prepared for some ωo.
    #[inline(always)]
    pub fn lobe(&self) -> &AnyLobe<S> {
        &self.lobe
    }

    /// Makes `to` the lobe for another ωo, if there is a shorter way than from its parameters. Gives what
    /// [`AnyLobe::albedos`] would.
    #[inline(always)]
    pub fn turn(&self, wo: V3<S>, curve: &AlbedoCurve<S>, bound: bool, to: &mut AimedLobe<S>) -> Option<[Rgb<S>; 2]> {
        self.lobe.turn(wo, curve, bound, to)
    }
}

#[cfg(feature = "cloth")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::albedo::Precision;

    /// Blocks of every lobe: its defaults, and for sheens every model.
    fn blocks() -> impl Iterator<Item = (LobeKind, Vec<f32>)> {
        let defaults = |kind: LobeKind| {
            let params = kind.spec().params.iter();
            let values = params.flat_map(|p| (0..p.ty.slots()).map(|k| p.default.get(k).copied().unwrap_or(0.0)));
            values.collect::<Vec<_>>()
        };
        LobeKind::ALL.iter().flat_map(move |kind| {
            let models = if *kind == LobeKind::Sheen { 0..6 } else { 0..1 };
            models.map(move |model| {
                let mut values = defaults(*kind);
                if *kind == LobeKind::Sheen {
                    values[8] = model as f32;
                }
                (*kind, values)
            })
        })
    }

    #[test]
    fn a_lobe_turned_is_the_lobe_made_from_its_parameters() {
        let coarse = Precision { cos_nodes: 8, axis_nodes: 8, polar: 8, azimuth: 8, ..Precision::FAST };
        let mut turned = 0;
        for (kind, values) in blocks() {
            let known: Vec<_> = values.iter().copied().map(Some).collect();
            let curve = kind.table(&known).map_or_else(AlbedoCurve::<f32>::default, |spec| spec.bake(coarse));
            let site = Site::new(kind, &known, &curve).expect("all is known");
            assert!(site.is_of(kind, &values), "{kind:?}");
            for cos in [0.9f32, 0.3, 1e-3, -0.2] {
                let wo = V3::polar(cos, 0.7);
                let made = AnyLobe::new(kind, &values, wo, &curve);
                // What is kept of one, with the rest of another: as if nothing had been taken apart.
                let mut lobe = AimedLobe::of(&made);
                let whole = lobe.whole(Some(&site.lobe)).expect("of one kind");
                assert_eq!(format!("{whole:?}"), format!("{made:?}"));
                let Some(albedos) = site.turn(wo, &curve, true, &mut lobe) else { continue };
                turned += 1;
                assert_eq!(albedos, made.albedos(wo, &curve, true), "{kind:?} {values:?} {cos}");
                for wi in [V3::polar(0.8, 2.0), V3::polar(0.05, -1.0), V3::polar(-0.4, 0.3)] {
                    let [a, b] =
                        [lobe, AimedLobe::of(&made)].map(|l| l.evaluate(|| Some(&site.lobe), wi, &curve, true));
                    assert_eq!((a.f, a.pdf, a.bound), (b.f, b.pdf, b.bound), "{kind:?} {values:?} {cos} {wi:?}");
                }
                assert_eq!(
                    lobe.sample(|| Some(&site.lobe), [0.3, 0.6]),
                    made.sample([0.3, 0.6]),
                    "{kind:?} {values:?} {cos}"
                );
            }
        }
        assert!(turned >= 4 * 8, "{turned}");
    }

    #[test]
    fn another_block_is_told_apart_and_another_direction_is_not() {
        let kind = LobeKind::OrenNayar;
        let site = Site::<f32>::new(kind, &[None, None, None, Some(0.4)], &AlbedoCurve::default());
        let site = site.expect("directions need not be known");
        assert!(site.is_of(kind, &[0.0, 0.6, 0.8, 0.4]));
        assert!(!site.is_of(kind, &[0.0, 0.6, 0.8, 0.3]));
        assert!(!site.is_of(LobeKind::Sheen, &[0.0, 0.6, 0.8, 0.4]));
        assert!(Site::<f32>::new(kind, &[Some(0.0), None, None, None], &AlbedoCurve::default()).is_none());
    }
}
