//! From syntax tree to closure tree: check, specialise, shade.
//!
//! [`compile`] turns text into a [`CheckedShader`], or into everything that is wrong with it. A checked shader with
//! some parameters set becomes a [`Program`] ([`CheckedShader::specialise`]): known values are folded, what nothing
//! reads is dropped, and what remains is a list of register instructions that [`Program::shade`] runs at a point.
//! This module knows closures by their signatures only; what a lobe does with light is never seen here.

mod batch;
pub(crate) mod body;
pub(crate) mod builtins;
mod check;
mod functions;
mod host;
mod kept;
mod lower;
mod machine;
pub(crate) mod ops;
mod passes;
mod program;
mod shader;
pub(crate) mod tasks;
mod types;
mod wide;

pub use batch::Batch;
pub use body::GlobalVar;
#[cfg(feature = "studio")]
pub(crate) use check::TASKS;
pub(crate) use host::Answers;
pub use host::{Host, Lookup, Speech, Subject};
pub use program::{Program, ShadeError, Site};
pub use shader::{CheckedShader, ParamDecl, Value};
pub use types::Ty;

use crate::diag::Diagnostic;
use crate::lobes::registry::Form;
use crate::span::Source;
use crate::syntax::Options;
use std::sync::Arc;

/// Compiles a script. `name` names it in messages, and the shader where the script does not.
///
/// Ok: the shader, and warnings about it.
///
/// # Errors
/// All errors found, with warnings after them.
pub fn compile(name: &str, source: &str) -> Result<(CheckedShader, Vec<Diagnostic>), Vec<Diagnostic>> {
    compile_with(name, source, &[], &Options::default(), None)
}

/// The same for a host that brings along closures of its own, include directories, budgets, and answers to questions.
///
/// # Errors
/// All errors found, with warnings after them.
pub fn compile_with(
    name: &str,
    source: &str,
    hosts: &[Form],
    options: &Options,
    host: Option<Arc<dyn Host>>,
) -> Result<(CheckedShader, Vec<Diagnostic>), Vec<Diagnostic>> {
    let ast = crate::syntax::parse_with(name, source, options).map_err(|(d, sources)| placed(d, &sources))?;
    let answers = Answers::of(host.as_deref());
    match check::check(name, &ast, hosts, &options.limits, answers) {
        Ok((checked, warnings)) => {
            let (body, shadows) = passes::derive::derive(checked.body, answers.on(Subject::Derivatives));
            Ok((CheckedShader { host, body, shadows, ..checked }, placed(warnings, &ast.sources)))
        }
        Err(errors) => Err(placed(errors, &ast.sources)),
    }
}

/// Messages about included files carry these along.
fn placed(diagnostics: Vec<Diagnostic>, sources: &[Source]) -> Vec<Diagnostic> {
    if sources.is_empty() {
        return diagnostics;
    }
    let sources: Vec<Arc<Source>> = sources.iter().map(|s| Arc::new(s.clone())).collect();
    diagnostics.into_iter().map(|d| d.among(&sources)).collect()
}
