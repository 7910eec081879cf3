//! From syntax tree to closure tree: check, specialise, shade.
//!
//! [`compile`] turns text into a [`CheckedShader`], or into everything that is wrong with it. A checked shader with
//! some parameters set becomes a [`Program`] ([`CheckedShader::specialise`]): known values are folded, what nothing
//! reads is dropped, and what remains is a list of register instructions that [`Program::shade`] runs at a point.
//! This module knows closures by their signatures only; what a lobe does with light is never seen here.

pub(crate) mod body;
pub(crate) mod builtins;
mod check;
mod functions;
mod lower;
pub(crate) mod ops;
mod passes;
mod program;
mod shader;
mod types;

pub use body::GlobalVar;
pub use program::{Program, ShadeError, Site};
pub use shader::{CheckedShader, ParamDecl, Value};
pub use types::Ty;

use crate::diag::Diagnostic;
use crate::lobes::registry::Form;

/// Compiles a script. `name` names it in messages, and the shader where the script does not.
///
/// Ok: the shader, and warnings about it.
///
/// # Errors
/// All errors found, with warnings after them.
pub fn compile(name: &str, source: &str) -> Result<(CheckedShader, Vec<Diagnostic>), Vec<Diagnostic>> {
    compile_with(name, source, &[])
}

/// The same for a host that brings along closures of its own.
///
/// # Errors
/// All errors found, with warnings after them.
pub fn compile_with(
    name: &str,
    source: &str,
    hosts: &[Form],
) -> Result<(CheckedShader, Vec<Diagnostic>), Vec<Diagnostic>> {
    let ast = crate::syntax::parse(source)?;
    check::check(name, &ast, hosts)
}
