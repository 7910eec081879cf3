//! Numbers, vectors, frames, sampling and surface optics: what lobe maths stands on. Knows no lobe.

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
pub use real::{Lift, Real, Scalar};
pub use vec3::V3;
