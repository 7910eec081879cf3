//! The longer functions of the table, by subject.

pub mod color;
pub mod matrix;
pub mod near;
pub mod noise;
pub mod text;
