//! Energy and consistency of whole materials, measured: white furnace from both sides, reciprocity, chi-square.
//!
//! In: a [`Subject`], anything that gives a BSDF for a direction, or a whole
//! [`Material`](crate::engine::Material). Out: numbers with error estimates. Everything here
//! is deterministic, or takes a seeded generator.

pub mod campaign;
pub mod chi2;
pub mod clock;
pub mod cubature;
#[cfg(feature = "cli")]
pub mod double_double;
pub mod estimate;
#[cfg(feature = "cli")]
pub mod extremes;
pub mod furnace;
mod gain;
mod ledger;
mod rounding;
mod script;
#[cfg(feature = "proptest")]
pub mod strategy;
pub mod tradeoff;
pub mod trees;

pub use campaign::{Campaign, Tally};
pub use chi2::{Chi2, chi2, reciprocity_error};
pub use cubature::Tolerance;
pub use estimate::{Estimate, estimate};
pub use furnace::{Albedo, LobeShare, Side, albedo, albedo_until, breakdown};
pub use gain::{Gain, assert_no_gain};
pub use ledger::{LayerShare, Ledger, ledger};
pub use rounding::rounding;
pub use script::script;

use crate::closure::Bsdf;
use crate::optics::Scalar;

/// What an audit looks at: a BSDF for every ωo (world space, unit). Any `Fn([S; 3]) -> Bsdf<S>` is one.
pub trait Subject<'m, S: Scalar> {
    /// The BSDF seen from `wo`.
    fn bsdf(&self, wo: [S; 3]) -> Bsdf<'m, S>;
}

impl<'m, S: Scalar, F: Fn([S; 3]) -> Bsdf<'m, S>> Subject<'m, S> for F {
    fn bsdf(&self, wo: [S; 3]) -> Bsdf<'m, S> {
        self(wo)
    }
}

fn dot<S: Scalar>(a: [S; 3], b: [S; 3]) -> f64 {
    (0..3).map(|i| a[i].to_f64() * b[i].to_f64()).sum()
}
