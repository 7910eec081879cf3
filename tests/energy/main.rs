//! Energy of trees: the layering rules, what the audit measures, what the proof says.

#[path = "../common/mod.rs"]
mod common;

mod audit;
mod balanced;
mod check;
mod gained;
mod layering;
