#![deny(unsafe_code)]
pub mod albedo;
pub mod audit;
pub mod closure;
pub mod engine;
pub mod globals;
pub mod lobes;
pub mod optics;
#[cfg(feature = "cli")]
pub mod preview;

pub use engine::Material;
pub use globals::Globals;
