//! Layered, energy-conserving BSDFs from scripts in the style of Open Shading Language.
//!
//! A script builds a closure tree; the tree becomes a BSDF that a renderer evaluates, samples and integrates. A layer
//! scales what lies below it by what it passes on, so that no composition gains energy: in
//! `Ci = sheen(Ci, N, tint, roughness)` a cloth lobe lies over whatever `Ci` already holds.
//!
//! Compile once, shade per point:
//!
//! ```
//! # #[cfg(feature = "cloth")] {
//! use overcoat::{Engine, Globals, ir::Value};
//!
//! let script = "
//!     surface velvet(color ground = color(0.6, 0.02, 0.05), float roughness = 0.3)
//!     {
//!         Ci = ground * diffuse(N);
//!         Ci = sheen(Ci, N, color(1), roughness);
//!     }";
//! let shader = Engine::new().compile("velvet", script)?;
//! let material = shader.material(&[("roughness".into(), Value::Float(0.4))])?;
//!
//! let wo = glam::Vec3::new(0.6, 0.0, 0.8);
//! let bsdf = material.shade(&Globals::default(), wo)?;
//! let eval = bsdf.eval([0.0, 0.6, 0.8]);
//! let sample = bsdf.sample([0.3, 0.6, 0.9]).expect("this lobe loses no samples");
//! assert!(eval.f_cos[0] > eval.f_cos[1] && sample.pdf > 0.0);
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Does the material keep energy? Put it in a white furnace, from both sides:
//!
//! ```
//! # #[cfg(feature = "cloth")] {
//! # use overcoat::{Engine, Globals};
//! use overcoat::audit::{self, Side};
//! # let shader = Engine::new().compile("white", "Ci = sheen(diffuse(N), N, 1, 0.5);")?;
//! # let material = shader.material(&[])?;
//! let globals = Globals::default();
//! let subject = |wo: [f32; 3]| material.shade(&globals, wo.into()).expect("a small tree");
//! for side in [Side::View, Side::Light] {
//!     let albedo = audit::albedo(&subject, side, [0.6, 0.0, 0.8], Default::default());
//!     assert!(albedo.max() <= 1.0001);
//! }
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Mistakes are told with their place:
//!
//! ```
//! let error = overcoat::Engine::new().compile("typo", "Ci = difuse(N);").unwrap_err();
//! assert!(error.to_string().contains("did you mean `diffuse`?"));
//! ```
//!
//! Without scripts, a host composes closures in code: [`closure::Builder`].

pub mod albedo;
pub mod audit;
#[cfg(feature = "capi")]
pub mod capi;
#[cfg(feature = "cli")]
pub mod cli;
pub mod closure;
pub mod diag;
pub mod engine;
pub mod globals;
pub mod ir;
pub mod lobes;
pub mod optics;
#[cfg(feature = "preview")]
pub mod preview;
pub mod prove;
pub mod span;
pub mod syntax;

pub use closure::Bsdfs;
pub use engine::{Engine, Error, Material, OwnedBsdf, Scratch, Shader};
pub use globals::{Differentials, Globals};
