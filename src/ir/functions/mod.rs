//! The longer functions of the table, by subject.

pub mod color;
pub mod noise;
