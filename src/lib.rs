#![deny(unsafe_code)]
pub mod albedo;
pub mod audit;
pub mod closure;
pub mod diag;
pub mod engine;
pub mod globals;
pub mod ir;
pub mod lobes;
pub mod optics;
#[cfg(feature = "cli")]
pub mod preview;
pub mod span;
pub mod syntax;

pub use engine::Material;
pub use globals::Globals;
