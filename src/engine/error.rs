//! What can go wrong between a host and the library.

use crate::closure::builder::BuildError;
use crate::diag::{Diagnostic, render_all};
use crate::ir::ShadeError;
use crate::lobes::host::RegisterError;
use crate::span::{LineColumn, Source};
use std::fmt;
use std::sync::Arc;

/// Any error of the library, for hosts that handle them in one place. Each arrives by `?`.
///
/// ```
/// use overcoat::{Engine, Error, Globals};
/// fn albedo(script: &str) -> Result<[f32; 3], Error> {
///     let material = Engine::new().material("cloth.osl", script)?;
///     Ok(material.shade(&Globals::default(), glam::Vec3::Z)?.albedo())
/// }
/// assert!(albedo("Ci = diffuse(N);").is_ok());
/// let error = albedo("Ci =\n  difuse(N);").unwrap_err();
/// let place = &error.places()[0];
/// assert_eq!((place.file.as_str(), place.at.line, place.at.column, place.code), ("cloth.osl", 2, 3, "E0206"));
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Error {
    /// A script, or a value for one of its parameters, is wrong.
    Script(ScriptError),
    /// Shading went beyond a budget.
    Shade(ShadeError),
    /// A closure of the host cannot be registered.
    Register(RegisterError),
    /// A closure tree cannot be built in code.
    Build(BuildError),
}

impl Error {
    /// The places in scripts it is about; none for errors that have no script.
    pub fn places(&self) -> Vec<Place> {
        match self {
            Error::Script(e) => e.places(),
            Error::Shade(_) | Error::Register(_) | Error::Build(_) => Vec::new(),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Script(e) => e.fmt(f),
            Error::Shade(e) => e.fmt(f),
            Error::Register(e) => e.fmt(f),
            Error::Build(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for Error {}

impl From<ScriptError> for Error {
    fn from(e: ScriptError) -> Error {
        Error::Script(e)
    }
}

impl From<ShadeError> for Error {
    fn from(e: ShadeError) -> Error {
        Error::Shade(e)
    }
}

impl From<RegisterError> for Error {
    fn from(e: RegisterError) -> Error {
        Error::Register(e)
    }
}

impl From<BuildError> for Error {
    fn from(e: BuildError) -> Error {
        Error::Build(e)
    }
}

/// A place in a script, and what is wrong there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The script or the file it includes.
    pub file: String,
    /// Line and column, counted from 1.
    pub at: LineColumn,
    /// One of [`CODES`](crate::diag::CODES).
    pub code: &'static str,
    /// What is wrong, in one sentence.
    pub message: String,
}

/// What is wrong with a script.
#[derive(Clone, Debug)]
pub struct ScriptError {
    /// The script.
    pub source: Arc<Source>,
    /// All that is wrong, with places.
    pub diagnostics: Vec<Diagnostic>,
}

impl ScriptError {
    /// The messages with their source lines; `color` adds terminal colours.
    pub fn render(&self, color: bool) -> String {
        render_all(&self.diagnostics, &self.source, color)
    }

    /// The places alone, in the order of the messages.
    pub fn places(&self) -> Vec<Place> {
        let place = |d: &Diagnostic| {
            let source = d.origin.as_deref().unwrap_or(&self.source);
            let at = source.line_column(d.span.start as usize);
            Place { file: source.name.clone(), at, code: d.code, message: d.message.clone() }
        };
        self.diagnostics.iter().map(place).collect()
    }
}

impl fmt::Display for ScriptError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for ScriptError {}
