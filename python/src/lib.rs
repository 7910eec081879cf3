//! The Python module `overcoat._overcoat`: materials and BSDFs with NumPy arrays in and out.
//!
//! Input arrays of float32 in rows of three are read where they are; results are vectors that NumPy takes over. Whatever
//! takes longer than a call runs without the interpreter's lock.

mod bsdf;
mod material;
mod tree;

use overcoat::engine::ScriptError;
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    _overcoat,
    ScriptProblem,
    PyValueError,
    "What is wrong with a script. `places` lists (file, line, column, code, message)."
);

/// A script error as a Python exception with its places.
fn script_problem(py: Python<'_>, e: &ScriptError) -> PyErr {
    let error = ScriptProblem::new_err(e.to_string());
    let places: Vec<(String, usize, usize, &str, String)> =
        e.places().into_iter().map(|p| (p.file, p.at.line, p.at.column, p.code, p.message)).collect();
    match error.value(py).setattr("places", places) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// Any other error.
fn problem(e: impl std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(e.to_string())
}

#[pymodule]
fn _overcoat(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("ScriptError", m.py().get_type::<ScriptProblem>())?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<material::Engine>()?;
    m.add_class::<material::Material>()?;
    m.add_class::<material::Report>()?;
    m.add_class::<bsdf::Bsdf>()?;
    m.add_class::<bsdf::Samples>()?;
    Ok(())
}
