//! From a closure tree to a BSDF. Never sees a script: trees come from [`crate::ir`] or from code.

pub mod bsdf;
pub mod tree;

pub use bsdf::{Bsdf, Eval, Sample, SampleFlags};
pub use tree::{ClosureTree, Node, NodeId};
