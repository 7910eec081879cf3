//! What a host holds at a shading point.

use crate::lobes::Rgb32;
use glam::Vec3;
use std::marker::PhantomData;

/// f·|cos| per channel and the density of sampling that direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eval {
    /// Σ w·f·|N·ωi| per channel, without delta lobes.
    pub f_cos: Rgb32,
    /// Density over solid angle of [`Bsdf::sample`] choosing this direction, without delta lobes.
    pub pdf: f32,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// World space, unit, away from the surface.
    pub wi: Vec3,
    /// f·|cos| per channel; for a delta sample its weight times `pdf`.
    pub f_cos: Rgb32,
    /// Density over solid angle, or the discrete probability of a delta sample.
    pub pdf: f32,
    /// `f_cos / pdf`.
    pub weight: Rgb32,
    pub flags: SampleFlags,
}

/// What kind of scattering a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SampleFlags {
    /// ωi lies on the other side of the geometric surface than ωo.
    pub transmit: bool,
    pub delta: bool,
}

/// The BSDF at one point for one ωo.
#[derive(Clone, Debug)]
pub struct Bsdf<'m> {
    n: Vec3,
    wo: Vec3,
    marker: PhantomData<&'m ()>,
}

impl<'m> Bsdf<'m> {
    pub(crate) fn stub(n: Vec3, wo: Vec3) -> Self {
        Bsdf { n, wo, marker: PhantomData }
    }
    /// f·|cos| and pdf of one direction (unit, away from the surface).
    pub fn eval(&self, wi: Vec3) -> Eval {
        let c = self.n.dot(wi);
        if c <= 0.0 || self.n.dot(self.wo) <= 0.0 {
            return Eval { f_cos: [0.0; 3], pdf: 0.0 };
        }
        let v = c * std::f32::consts::FRAC_1_PI;
        Eval { f_cos: [v * 0.8, v * 0.1, v * 0.1], pdf: v }
    }
    /// Draws a direction; `None` where the sample is lost (nothing to scatter, below the horizon).
    pub fn sample(&self, u: [f32; 3]) -> Option<Sample> {
        let (t, b) = self.n.any_orthonormal_pair();
        let r = u[0].sqrt();
        let p = u[1] * std::f32::consts::TAU;
        let wi = t * (r * p.cos()) + b * (r * p.sin()) + self.n * (1.0 - u[0]).max(0.0).sqrt();
        let e = self.eval(wi);
        (e.pdf > 0.0).then(|| Sample {
            wi,
            f_cos: e.f_cos,
            pdf: e.pdf,
            weight: e.f_cos.map(|f| f / e.pdf),
            flags: SampleFlags::default(),
        })
    }
    /// Radiance given off toward ωo.
    pub fn emission(&self) -> Rgb32 {
        [0.0; 3]
    }
}
