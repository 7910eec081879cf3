//! Closure trees as Python dictionaries.

use crate::problem;
use overcoat::closure::{ClosureTree, Node, NodeId};
use overcoat::lobes::LobeKind;
use overcoat::lobes::registry::ParamTy;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Python itself overflows on printing deeper dictionaries.
const MAX_DEPTH: u32 = 500;

/// The tree below its root.
pub fn dictionary<'py>(py: Python<'py>, tree: &ClosureTree) -> PyResult<Bound<'py, PyDict>> {
    let depth = tree.size(tree.root()).depth;
    if depth > MAX_DEPTH {
        return Err(problem(format!("the closure tree is {depth} nodes deep; up to {MAX_DEPTH} can be shown")));
    }
    node(py, tree, tree.root())
}

fn node<'py>(py: Python<'py>, tree: &ClosureTree, id: NodeId) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    match tree.node(id) {
        Node::Zero => dict.set_item("kind", "zero")?,
        Node::Lobe { kind, slots, .. } => {
            dict.set_item("kind", "lobe")?;
            dict.set_item("name", kind.spec().name)?;
            dict.set_item("params", params(py, kind, tree.values(kind, slots))?)?;
        }
        Node::Mul(weight, c) => {
            dict.set_item("kind", "mul")?;
            dict.set_item("weight", weight.to_vec())?;
            dict.set_item("closure", node(py, tree, c)?)?;
        }
        Node::Layer { top, base } => {
            dict.set_item("kind", "layer")?;
            dict.set_item("top", node(py, tree, top)?)?;
            dict.set_item("base", node(py, tree, base)?)?;
        }
        Node::Add(..) => {
            dict.set_item("kind", "add")?;
            let terms: PyResult<Vec<_>> = tree.terms(id).into_iter().map(|t| node(py, tree, t)).collect();
            dict.set_item("terms", terms?)?;
        }
    }
    Ok(dict)
}

fn params<'py>(py: Python<'py>, kind: LobeKind, values: &[f32]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let mut at = 0;
    for p in kind.spec().params {
        let slots = &values[at..at + p.ty.slots()];
        at += p.ty.slots();
        match (p.ty, slots) {
            (ParamTy::String, [x]) => dict.set_item(p.name, p.options.get(p.clamp(0, *x) as usize).copied())?,
            (ParamTy::Int, [x]) => dict.set_item(p.name, *x as i64)?,
            (_, [x]) => dict.set_item(p.name, x)?,
            (_, xs) => dict.set_item(p.name, xs.to_vec())?,
        }
    }
    Ok(dict)
}
