//! From text to syntax tree.
//!
//! Text goes through [`preprocess`] (comments, directives, nesting limits) and [`parse`] (the grammar in
//! `grammar/osl.pest`) and comes out as an [`ast::Ast`], an arena whose every pass is a loop. Nothing here knows what a
//! name stands for or which types fit; that is [`crate::ir`].

pub mod ast;
mod parse;
pub mod preprocess;
mod recover;

pub use parse::parse;
