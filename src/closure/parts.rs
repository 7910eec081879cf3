//! A BSDF lobe by lobe: what audits integrate, and what a material asks of the renderer beside scattering.

use super::bsdf::{Bsdf, finite, unit_or_zero};
use super::met::Met;
use crate::lobes::signals::SignalKind;
use crate::lobes::{AimedLobe, LobeKind, Rgb};
use crate::optics::{Frame, Scalar, V3};

/// Something a material tells the renderer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal<S = f32> {
    /// What it stands for.
    pub kind: SignalKind,
    /// Its weight, dimmed by the layers above it.
    pub value: Rgb<S>,
}

/// Scattering below the surface that a material asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubsurfacePart<S = f32> {
    /// What comes back of white light from all around, weights and layers toward ωo included.
    pub albedo: Rgb<S>,
    /// The shading normal, world space.
    pub normal: [S; 3],
    /// Mean free path per channel, in the scene's unit.
    pub radius: [f32; 3],
    /// Mean cosine of scattering, in [−1, 1].
    pub anisotropy: f32,
    /// Index of refraction of the medium.
    pub ior: f32,
}

/// Which cosine multiplies f.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cosine {
    /// |N·ωi|: light arriving from ωi, seen from ωo.
    Light,
    /// |N·ωo|: the adjoint, f·(ηo/ηi)².
    View,
    /// None: f·ηo/ηi, which is symmetric where f is reciprocal.
    None,
}

impl<'m, S: Scalar> Bsdf<'m, S> {
    /// What the material tells the renderer beside light: `holdout`, `background` and `debug`, one entry per kind and name.
    pub fn signals(&self) -> &[Signal<S>] {
        &self.signals
    }

    pub(crate) fn signal(&mut self, kind: SignalKind, value: Rgb<S>) {
        match self.signals.iter_mut().find(|s| s.kind == kind) {
            Some(s) => s.value = std::array::from_fn(|c| s.value[c] + value[c]),
            None => self.signals.push(Signal { kind, value }),
        }
    }

    /// What is to be scattered below the surface, for a renderer that does so itself. The BSDF counts it as diffuse.
    pub fn subsurface(&self) -> impl Iterator<Item = SubsurfacePart<S>> {
        self.met().filter_map(|l| match &l.flat.lobe {
            AimedLobe::Subsurface(lobe) => {
                let (radius, anisotropy, ior) = lobe.medium();
                let n = self.frames[l.place.frame as usize].n;
                Some(SubsurfacePart { albedo: l.flat.albedo, normal: [n.x, n.y, n.z], radius, anisotropy, ior })
            }
            _ => None,
        })
    }

    /// What the delta lobes scatter, exactly: the part of the albedo that `eval` leaves out.
    pub fn delta_albedo(&self) -> Rgb<S> {
        self.delta_parts().fold([S::zero(); 3], |sum, (_, part)| std::array::from_fn(|c| sum[c] + part[c]))
    }

    /// The delta lobes: the direction each scatters to (world space) and how much, weights and layers included.
    pub fn delta_parts(&self) -> impl Iterator<Item = ([S; 3], Rgb<S>)> {
        (0..self.lobes.len()).filter_map(|i| Some((self.lobe_delta_direction(i)?, self.lobe_delta(i, true)?)))
    }

    /// The direction delta lobe `index` scatters to, in world space; `None` for other lobes.
    pub(crate) fn lobe_delta_direction(&self, index: usize) -> Option<[S; 3]> {
        let l = self.lobe(index);
        let (local, _) = l.delta()?;
        let wi = self.lobe_frame(index).to_world(local);
        Some([wi.x, wi.y, wi.z])
    }

    /// The direction lobe `index` scatters to for two uniform numbers, in world space, and its density over solid angle;
    /// `None` for delta lobes, where it scatters nothing that way, and for lobes that do not count.
    pub(crate) fn lobe_sample(&self, index: usize, u: [S; 2]) -> Option<(V3<S>, S)> {
        let l = self.lobe(index);
        if l.place.delta || l.flat.probability() <= S::zero() {
            return None;
        }
        let local = l.sample(u);
        let pdf = l.pdf(local);
        (pdf > S::zero()).then(|| (self.lobe_frame(index).to_world(local), pdf))
    }

    /// What delta lobe `index` scatters, with or without the layers above it (which look at ωo and at its own
    /// direction); `None` for other lobes.
    pub(crate) fn lobe_delta(&self, index: usize, layered: bool) -> Option<Rgb<S>> {
        let l = self.lobe(index);
        let (local, part) = l.delta()?;
        let wi = self.lobe_frame(index).to_world(local);
        let mut scale = [S::one(); 3];
        if layered {
            self.walk(wi, false, |i, l: Met<'_, 'm, S>, s: Rgb<S>, local: V3<S>, bound| {
                if i == index {
                    scale = s
                }
                l.bound(local, bound)
            });
        }
        Some(std::array::from_fn(|c| l.flat.share[c] * scale[c] * part[c]))
    }

    /// w·f·|cos θi| of lobe `index` alone, with or without the layers above it.
    pub(crate) fn lobe_part(&self, index: usize, wi: V3<S>, layered: bool) -> Rgb<S> {
        let mut result = [S::zero(); 3];
        self.walk(unit_or_zero(wi), false, |i, l: Met<'_, 'm, S>, scale: Rgb<S>, local: V3<S>, bound| {
            if i == index {
                let scale = if layered { scale } else { [S::one(); 3] };
                result = weighted(l, scale, local, Cosine::Light, self.cos_o(l));
            }
            l.bound(local, bound)
        });
        result
    }

    /// Like `eval`, its cosine chosen, with only the lobes whose frame and kind `pick` accepts.
    pub(crate) fn part(&self, wi: V3<S>, cosine: Cosine, pick: impl Fn(&Frame<S>, LobeKind) -> bool) -> Rgb<S> {
        let mut sum = [S::zero(); 3];
        self.walk(unit_or_zero(wi), false, |_, l: Met<'_, 'm, S>, scale: Rgb<S>, local: V3<S>, bound| {
            if pick(&self.frames[l.place.frame as usize], l.flat.lobe.kind()) {
                let part = weighted(l, scale, local, cosine, self.cos_o(l));
                for c in 0..3 {
                    sum[c] += part[c];
                }
            }
            l.bound(local, bound)
        });
        sum.map(finite)
    }

    /// |N·ωo| of a lobe.
    fn cos_o(&self, l: Met<'_, 'm, S>) -> S {
        self.frames[l.place.frame as usize].n.dot(self.wo).abs().min(S::one())
    }

    /// The frames in use, one per distinct normal and tangent.
    pub fn frames(&self) -> &[Frame<S>] {
        &self.frames
    }

    /// The frame of lobe `index`.
    pub fn lobe_frame(&self, index: usize) -> &Frame<S> {
        &self.frames[self.places()[index].frame as usize]
    }

    /// What lobe `index` is, and the place in the program that made it.
    pub fn lobe_kind(&self, index: usize) -> (LobeKind, u32) {
        (self.lobes[index].lobe.kind(), self.places()[index].site)
    }
}

fn weighted<S: Scalar>(l: Met<'_, '_, S>, scale: Rgb<S>, local: V3<S>, cosine: Cosine, cos_o: S) -> Rgb<S> {
    let f = l.f(local);
    let cos = match cosine {
        Cosine::Light => local.z.abs().min(S::one()),
        Cosine::View => cos_o * l.relative_eta(local).sq(),
        Cosine::None => l.relative_eta(local),
    };
    std::array::from_fn(|c| l.flat.share[c] * scale[c] * f[c] * cos)
}
