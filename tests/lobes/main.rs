//! Lobes: what holds for each that is registered, and each against its reference values.

#[path = "../common/mod.rs"]
mod common;

mod extremes;
mod fibre_bounds;
mod fibre_tables;
mod fibres;
mod highlights;
mod laws;
mod microfacet;
mod numbers;
mod random;
mod sampling;
mod sheen;
mod sheen_models;
