//! Numbers, vectors, frames, sampling and surface optics: what lobe maths stands on. Knows no lobe.

#[cfg(target_arch = "x86_64")]
mod avx;
pub mod dispatch;
pub mod elementary;
pub mod film;
pub mod frame;
pub mod fresnel;
pub mod lanes;
pub mod microfacet;
pub(crate) mod octaves;
pub mod real;
pub mod sampling;
pub mod vec3;

pub use frame::Frame;
pub use lanes::F32x8;
pub(crate) use lanes::Lanes;
pub(crate) use real::rgb;
pub use real::{Lift, Over, Real, Scalar, array, lifted};
pub use vec3::V3;
