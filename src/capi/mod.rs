//! The C interface: what `include/overcoat.h` declares, and the only unsafe code of the library.
//!
//! A C host holds handles: numbers in the shape of pointers, looked up in a table and never followed, so that a freed
//! or foreign handle is an error and not a crash. Every call returns a status and leaves a message for
//! [`oc_last_error`]. No panic crosses the boundary. What a host passes as a pointer to memory must be what the
//! function says it is: that alone cannot be checked.
//!
//! Any function may be called from any thread. Calls on one BSDF wait for one another; calls on one material, or on one
//! engine, do so only while it is being changed. A BSDF keeps what it needs of its material, and a material of its
//! engine, so they may be freed in any order.
#![allow(unsafe_code)]

mod bsdf;
mod closure;
mod engine;
mod handle;
mod material;
mod memory;
mod status;

pub use bsdf::*;
pub use closure::*;
pub use engine::*;
pub use handle::{OcBsdf, OcEngine, OcMaterial};
pub use material::*;
pub use status::*;

/// Version of this interface. A library with the same number understands every call of this header.
pub const OC_ABI_VERSION: u32 = 1;

/// `OC_ABI_VERSION` of the library that is linked: compare it with the header's before anything else.
#[unsafe(no_mangle)]
pub extern "C" fn oc_abi_version() -> u32 {
    OC_ABI_VERSION
}
