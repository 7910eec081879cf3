//! What hosts hold and call, in Rust and in C.

#[path = "../common/mod.rs"]
mod common;

mod capi;
mod capi_header;
mod closures;
mod listings;
mod renderer;
