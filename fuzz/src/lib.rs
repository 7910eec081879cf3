//! What each target does with its bytes. Stated once: the targets in `fuzz_targets/` call it with what the fuzzer thinks
//! of, and `tests/fuzz_replay.rs` includes this file and calls it with the corpora that are kept.
//!
//! Bytes that run out are zeros, so that any bytes stand for something. A target returns or panics; what it panics about
//! is a fault of the library.

mod bytes;
mod closures;
mod scripts;

#[cfg(feature = "capi")]
mod c_calls;
#[cfg(feature = "studio")]
mod pages;
#[cfg(feature = "studio")]
mod pictures;

#[cfg(feature = "capi")]
pub use c_calls::handles;
pub use closures::trees;
#[cfg(feature = "studio")]
pub use pages::studio;
#[cfg(feature = "studio")]
pub use pictures::light;
pub use scripts::{front_end, parse};
