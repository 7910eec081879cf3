//! What hosts ask of a BSDF besides `eval` and `sample`: what kind of scattering to expect, what light goes straight
//! through, and what changes when light is traced instead of the view.

use super::bsdf::{Bsdf, Eval, Sample, finite, is_unit, vector};
use super::met::Met;
use crate::lobes::Rgb;
use crate::optics::{Scalar, V3};
use bitflags::bitflags;

bitflags! {
    /// Kinds of scattering, as a set: of a whole BSDF ([`Bsdf::flags`]) or of one sample ([`Sample::scattering`]).
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Scattering: u32 {
        /// To the side ωo is on.
        const REFLECT = 1;
        /// To the other side.
        const TRANSMIT = 2;
        /// As wide as a diffuse surface: roughness 1.
        const DIFFUSE = 4;
        /// Narrower than that, and not a delta.
        const GLOSSY = 8;
        /// Into one direction; `eval` does not see it.
        const DELTA = 16;
        /// Straight through, unbent: [`Bsdf::transparency`] is not black.
        const NULL = 32;
        /// Light is given off: [`Bsdf::emission`] is not black. Never set for a sample.
        const EMISSION = 64;
    }
}

/// What is carried along the path that is traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Transport {
    /// Radiance, from the light along ωi to the eye along ωo: paths that start at the eye.
    #[default]
    Radiance,
    /// Importance, the adjoint: ωi and ωo change places.
    Importance,
}

fn kind<S: Scalar>(delta: bool, roughness: S) -> Scattering {
    match () {
        () if delta => Scattering::DELTA,
        () if roughness < S::one() => Scattering::GLOSSY,
        () => Scattering::DIFFUSE,
    }
}

impl<S: Scalar> Sample<S> {
    /// What kind of scattering it is: a side, and one of diffuse, glossy and delta.
    pub fn scattering(&self) -> Scattering {
        let side = if self.flags.transmit { Scattering::TRANSMIT } else { Scattering::REFLECT };
        side | kind(self.flags.delta, self.roughness)
    }
}

/// Cosine beyond which two directions are one.
const SAME: f64 = 1.0 - 2e-6;

impl<S: Scalar> Bsdf<'_, S> {
    /// Every kind of scattering that some lobe may show, as seen from its own side of its own normal.
    pub fn flags(&self) -> Scattering {
        let mut flags = Scattering::empty();
        for l in self.met() {
            let lobe = l.whole();
            let sides = lobe.sides();
            flags.set(Scattering::REFLECT, flags.contains(Scattering::REFLECT) || sides.reflect);
            flags.set(Scattering::TRANSMIT, flags.contains(Scattering::TRANSMIT) || sides.transmit);
            flags |= kind(l.place.delta, lobe.roughness());
        }
        let any = |c: Rgb<S>| c.iter().any(|x| *x > S::zero());
        flags.set(Scattering::NULL, any(self.transparency()));
        flags.set(Scattering::EMISSION, any(self.emission()));
        flags
    }

    /// Whether all lobes are delta lobes: `eval` is black everywhere, and a light sample is wasted. False for a black BSDF.
    pub fn is_delta(&self) -> bool {
        !self.lobes.is_empty() && self.places().iter().all(|p| p.delta)
    }

    /// Density over solid angle of [`sample`](Self::sample) choosing `wi`, all lobes together; delta lobes left out.
    /// [`eval`](Self::eval) gives it too, at no extra price; alone it costs less, because no lobe's f is asked for.
    pub fn pdf(&self, wi: impl Into<[S; 3]>) -> S {
        let wi = vector(wi.into());
        if !is_unit(wi) {
            return S::zero();
        }
        let local = |l: &Met<'_, '_, S>| self.frames[l.place.frame as usize].to_local(wi);
        finite(self.met().fold(S::zero(), |sum, l| sum + l.flat.probability() * l.pdf(local(&l))))
    }

    /// The part of the light that arrives along −ωo and goes straight on, per channel: what a shadow ray is multiplied
    /// by. Layers above dim it.
    pub fn transparency(&self) -> Rgb<S> {
        if !self.places().iter().any(|p| p.delta) {
            return [S::zero(); 3];
        }
        let straight = |wi: [S; 3]| -V3::new(wi[0], wi[1], wi[2]).dot(self.wo) > S::c(SAME);
        let parts = self.delta_parts().filter(|(wi, _)| straight(*wi));
        parts.fold([S::zero(); 3], |sum, (_, part)| std::array::from_fn(|c| sum[c] + part[c]))
    }

    /// [`eval`](Self::eval) for what is carried. For [`Transport::Importance`] f_cos is what a light path that comes in
    /// along ωi passes on to ωo ([`eval_adjoint`](Self::eval_adjoint)); the pdf is that of sampling ωi either way.
    pub fn eval_for(&self, wi: [S; 3], transport: Transport) -> Eval<S> {
        let eval = self.eval(wi);
        match transport {
            Transport::Radiance => eval,
            Transport::Importance => Eval { f_cos: self.eval_adjoint(wi), ..eval },
        }
    }

    /// ∫ f·|cos| dωi estimated by sampling with each of `u`, delta lobes included: unbiased, where
    /// [`albedo`](Self::albedo) is quick. Black without `u`.
    pub fn rho(&self, u: &[[S; 3]]) -> Rgb<S> {
        let mut sum = [S::zero(); 3];
        for sample in u.iter().filter_map(|u| self.sample(*u)) {
            for c in 0..3 {
                sum[c] += sample.weight[c];
            }
        }
        sum.map(|s| if u.is_empty() { s } else { s / S::c(u.len() as f64) })
    }
}
