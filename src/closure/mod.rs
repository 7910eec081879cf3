//! From a closure tree to a BSDF. Never sees a script: trees come from the interpreter or from code.

pub mod balance;
pub mod bsdf;
pub mod flatten;
pub mod layer;
pub mod tree;
mod walk;

pub use balance::{Balance, Balancer, Fate, Unbalanced};
pub use bsdf::{Bsdf, Eval, Sample, SampleFlags, Signal, SubsurfacePart};
pub use flatten::{Curves, Layering, Tables, flatten};
pub use layer::{LayeringRule, TintRule};
pub use tree::{ClosureTree, Node, NodeId, Size, TreeError};
