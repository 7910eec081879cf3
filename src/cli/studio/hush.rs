//! Who edits goes first: pictures rest while a script compiles.
//!
//! Both want all cores, and a person waits for one of them. A picture's material is wrapped in [`Resting`], which holds
//! its worker back at the next shading point as long as something compiles, up to a limit.

use crate::closure::Bsdf;
use crate::engine::{Material, ShadeError};
use crate::globals::Globals;
use crate::preview::Surface;
use glam::Vec3;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// The longest a picture rests for one compilation.
const LONGEST: u64 = 400;

/// How many ask for quiet, and since when.
pub struct Hush {
    asking: AtomicUsize,
    /// Milliseconds from `origin` to the latest request.
    since: AtomicU64,
    origin: Instant,
}

impl Default for Hush {
    fn default() -> Self {
        Hush { asking: AtomicUsize::new(0), since: AtomicU64::new(0), origin: Instant::now() }
    }
}

/// Quiet until it goes.
pub struct Quiet<'h>(&'h Hush);

impl Drop for Quiet<'_> {
    fn drop(&mut self) {
        self.0.asking.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Hush {
    pub fn ask(&self) -> Quiet<'_> {
        self.since.store(self.now(), Ordering::Relaxed);
        self.asking.fetch_add(1, Ordering::Relaxed);
        Quiet(self)
    }

    fn now(&self) -> u64 {
        self.origin.elapsed().as_millis() as u64
    }

    fn wait(&self) {
        while self.asking.load(Ordering::Relaxed) > 0
            && self.now().saturating_sub(self.since.load(Ordering::Relaxed)) < LONGEST
        {
            std::thread::sleep(Duration::from_micros(300));
        }
    }
}

/// A material whose shading waits for quiet to end.
pub struct Resting<'a> {
    pub material: &'a Material,
    pub hush: &'a Hush,
}

impl Surface for Resting<'_> {
    type Scatter<'b>
        = Bsdf<'b>
    where
        Self: 'b;

    fn shade(&self, globals: &Globals, wo: Vec3) -> Result<Bsdf<'_>, ShadeError> {
        if self.hush.asking.load(Ordering::Relaxed) > 0 {
            self.hush.wait();
        }
        self.material.shade(globals, wo)
    }

    fn see_through(&self) -> bool {
        Surface::see_through(self.material)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quiet_ends_with_whoever_asked_or_after_a_while() {
        let hush = Hush::default();
        let quiet = hush.ask();
        let start = Instant::now();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(30));
                drop(quiet);
            });
            hush.wait();
        });
        assert!(start.elapsed() >= Duration::from_millis(25));
        let _quiet = hush.ask();
        let start = Instant::now();
        hush.wait();
        assert!(start.elapsed() >= Duration::from_millis(LONGEST - 20));
    }
}
