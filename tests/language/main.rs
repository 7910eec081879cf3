//! The language: scripts in; trees, values and messages out.

mod batch;
mod closures;
mod command;
mod derivatives;
mod host;
mod more;
mod print;
#[cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]
mod printer;
#[cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]
mod programs;
mod scripts;
mod table;
mod values;
