//! Vector code chosen at run time: the one place that asks what the processor can do.
//!
//! A plain build targets the oldest processors of its family. [`widest`] compiles the work it is given a second time, for
//! wider vectors, and runs whichever the machine has. Both do the same operations in the same order – no fused
//! multiply-add – so that results do not depend on the machine.
#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
use super::avx::Avx;
use super::lanes::{F32x8, Lanes};

/// Something to run. `run` and all it calls should be `#[inline(always)]`: what is not inlined stays as narrow as the build.
pub trait Work {
    /// What it gives.
    type Output;
    /// Does it.
    fn run(self) -> Self::Output;
}

/// Work on eight numbers at a time, in lanes to be chosen.
pub(crate) trait LaneWork {
    /// What it gives.
    type Output;
    /// Does it, in `L`. See [`Work::run`].
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Whether the processor has vectors that [`lanes`] has code for.
#[inline]
pub(crate) fn has_lanes() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// Runs `work` in the widest lanes at hand.
#[inline]
pub(crate) fn lanes<W: LaneWork>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2<W: LaneWork>(work: W) -> W::Output {
            work.run::<Avx>()
        }
        if has_lanes() {
            // SAFETY: the processor has just been found to have what `avx2` is compiled for.
            return unsafe { avx2(work) };
        }
    }
    work.run::<F32x8>()
}

/// Runs `work` with the widest vectors at hand.
#[inline]
pub fn widest<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2<W: Work>(work: W) -> W::Output {
            work.run()
        }
        if has_lanes() {
            // SAFETY: the processor has just been found to have what `avx2` is compiled for.
            return unsafe { avx2(work) };
        }
    }
    work.run()
}
