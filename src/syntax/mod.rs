//! From text to syntax tree.
//!
//! Text goes through [`preprocess`] (comments, directives, macros, nesting limits) and [`parse`] (the grammar in
//! `grammar/osl.pest`) and comes out as an [`ast::Ast`], an arena whose every pass is a loop. Nothing here knows what a
//! name stands for or which types fit; that is [`crate::ir`].

pub mod ast;
mod options;
mod parse;
pub mod preprocess;
mod recover;

pub use options::{Directories, Includes, Limits, Options};
pub use parse::{parse, parse_with};
