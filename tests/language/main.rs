//! The language: scripts in; trees, values and messages out.

mod batch;
mod closures;
mod command;
mod derivatives;
mod host;
mod more;
mod print;
mod printer;
mod programs;
mod scripts;
mod table;
mod values;
