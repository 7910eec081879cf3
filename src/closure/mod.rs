//! From a closure tree to a BSDF. Never sees a script: trees come from the interpreter or from code.

pub mod balance;
mod batch;
pub mod bsdf;
pub mod builder;
pub mod flatten;
pub mod layer;
mod many;
mod met;
pub mod parts;
pub(crate) mod plan;
pub mod query;
mod scratch;
mod sites;
pub mod tree;
mod walk;

pub use balance::{Balance, Balancer, Fate, Unbalanced};
pub use bsdf::{Bsdf, Eval, Sample, SampleFlags};
pub use builder::{Builder, Composite};
pub use flatten::{Curves, Layering, TableCache, Tables, flatten, flatten_into};
pub use layer::{LayeringRule, TintRule};
pub use many::Bsdfs;
pub use parts::{Signal, SubsurfacePart};
pub use query::{Scattering, Transport};
pub use scratch::Scratch;
pub use tree::{ClosureTree, Node, NodeId, Size, TreeError};
