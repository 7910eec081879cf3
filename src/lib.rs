#![deny(unsafe_code)]
pub mod albedo;
pub mod audit;
#[cfg(feature = "cli")]
pub mod cli;
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

pub use engine::{Engine, Material, Shader};
pub use globals::Globals;
