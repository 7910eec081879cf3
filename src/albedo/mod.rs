//! Directional albedos: tables that are baked once per material and never fall below the truth.
//!
//! In: a lobe's f as a plain function, in double precision. Out: [`AlbedoCurve`], read in shading. Knows no lobe by
//! name.

mod bends;
mod cells;
pub mod curve;
mod facet;
pub mod facets;
pub mod fibre;
mod fill;
mod grid;
mod panels;
pub mod quadrature;
mod visible;

pub use cells::Cells;
pub use curve::{AlbedoCurve, Axis, CurveSpec, Precision};
pub use facets::{Facet, FacetKey, FacetSpec, FacetTables};
pub use fibre::{COMPONENTS, FibreKernel, FibreKey, FibreSpec, FibreTables, HORIZON, OFFSETS, Ridges, TableSpec};
