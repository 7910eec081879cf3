//! Engines: `oc_engine_…`.

use super::handle::{self, Object, OcEngine};
use super::material::OcGlobals;
use super::memory;
use super::status::{Failure, OcStatus, guard};
use crate::closure::LayeringRule;
use crate::engine::{Engine, Tier};
use crate::globals::Globals;
use crate::ir::{Host, Lookup, Subject};
use crate::syntax::Directories;
use std::ffi::{c_char, c_void};
use std::sync::RwLock;

/// Tables and arithmetic for speed: albedos within 1e-2 of the reference.
pub const OC_TIER_FAST: u32 = 0;
/// The default: albedos within 1e-3 of the reference.
pub const OC_TIER_STANDARD: u32 = 1;

/// A layer scales its base by the smaller α of the two directions: reciprocal, loses some energy. The default.
pub const OC_LAYERING_MIN: u32 = 0;
/// By α toward the viewer: loses nothing there, is not reciprocal, may gain toward the light.
pub const OC_LAYERING_VIEW: u32 = 1;
/// Solved for: reciprocal, and lossless below reciprocal tops.
pub const OC_LAYERING_BALANCED: u32 = 2;

/// One lookup of a texture.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct OcLookup {
    /// The file as the script names it: `name_len` bytes of UTF-8, without a closing 0.
    pub name: *const c_char,
    /// Length of `name` in bytes.
    pub name_len: usize,
    /// Coordinates; 0 to 1 spans the picture, t downward.
    pub s: f32,
    /// The second coordinate.
    pub t: f32,
    /// The first channel asked for.
    pub first_channel: i32,
    /// How s and t change by one pixel to the right, then by one pixel down: as the script says, or as they follow from
    /// `differentials`; else 0.
    pub changes: [[f32; 2]; 2],
    /// The shading point.
    pub globals: OcGlobals,
}

/// Looks up a texture: writes linear RGB and alpha to `rgba` and returns 1, or returns 0 if there is no such picture.
/// Called from whatever thread shades; must neither unwind nor call the library.
pub type OcTextureFn = Option<unsafe extern "C" fn(user: *mut c_void, lookup: *const OcLookup, rgba: *mut f32) -> i32>;

/// What a host answers, and gives besides.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct OcHost {
    /// Looks up textures; null: none are found.
    pub texture: OcTextureFn,
    /// Not 0: `differentials` of each `oc_globals` is filled in, and scripts may ask for derivatives.
    pub derivatives: i32,
    /// Handed to every callback.
    pub user: *mut c_void,
}

// SAFETY: `oc_engine_set_host` demands that callback and `user` may be used from any thread.
unsafe impl Send for OcHost {}
// SAFETY: as above.
unsafe impl Sync for OcHost {}

impl Host for OcHost {
    fn answers(&self, subject: Subject) -> bool {
        match subject {
            Subject::Textures => self.texture.is_some(),
            Subject::Derivatives => self.derivatives != 0,
            Subject::Spaces | Subject::Attributes | Subject::Speech => false,
        }
    }

    fn texture(&self, lookup: &Lookup, globals: &Globals) -> Option<[f32; 4]> {
        let asked = OcLookup {
            name: lookup.name.as_ptr().cast(),
            name_len: lookup.name.len(),
            s: lookup.s,
            t: lookup.t,
            first_channel: lookup.first_channel,
            changes: lookup.changes,
            globals: OcGlobals::from(*globals),
        };
        let mut rgba = [0.0; 4];
        // SAFETY: the callback is what `oc_engine_set_host` demands; both pointers live through the call.
        let found = unsafe { self.texture?(self.user, &asked, rgba.as_mut_ptr()) };
        (found != 0).then_some(rgba)
    }
}

/// Makes an engine: standard tier, layering `OC_LAYERING_MIN`. To be freed with `oc_engine_free`.
///
/// # Safety
/// `engine` is null or has room for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_engine_new(engine: *mut *mut OcEngine) -> OcStatus {
    guard(|| {
        let made = handle::insert::<OcEngine>(Object::Engine(RwLock::new(Engine::new())))?;
        // SAFETY: the caller promises room.
        let written = unsafe { memory::write(engine, made, "engine") };
        written.inspect_err(|_| drop(handle::free(made)))
    })
}

/// Frees an engine; null is fine. Its materials stay as they are.
#[unsafe(no_mangle)]
pub extern "C" fn oc_engine_free(engine: *mut OcEngine) -> OcStatus {
    guard(|| handle::free(engine))
}

fn change(engine: *mut OcEngine, f: impl FnOnce(Engine) -> Result<Engine, Failure>) -> OcStatus {
    guard(|| {
        let found = handle::get(engine)?;
        let mut engine = found.engine_mut()?;
        *engine = f(engine.clone())?;
        Ok(())
    })
}

/// Chooses the tier of the materials compiled from here on: `OC_TIER_FAST` or `OC_TIER_STANDARD`.
#[unsafe(no_mangle)]
pub extern "C" fn oc_engine_set_tier(engine: *mut OcEngine, tier: u32) -> OcStatus {
    change(engine, |engine| match tier {
        OC_TIER_FAST => Ok(engine.tier(Tier::Fast)),
        OC_TIER_STANDARD => Ok(engine.tier(Tier::Standard)),
        _ => Err(Failure::new(OcStatus::OcErrorBadValue, format!("{tier} is no tier"))),
    })
}

/// Chooses how layers scale in the materials compiled from here on: one of `OC_LAYERING_…`.
#[unsafe(no_mangle)]
pub extern "C" fn oc_engine_set_layering(engine: *mut OcEngine, rule: u32) -> OcStatus {
    change(engine, |engine| match rule {
        OC_LAYERING_MIN => Ok(engine.layering(LayeringRule::Min)),
        OC_LAYERING_VIEW => Ok(engine.layering(LayeringRule::View)),
        OC_LAYERING_BALANCED => Ok(engine.layering(LayeringRule::Balanced)),
        _ => Err(Failure::new(OcStatus::OcErrorBadValue, format!("{rule} is no layering rule"))),
    })
}

/// Sets the directory in which `#include` looks for files, after that of the script. Replaces the one set before.
///
/// # Safety
/// `path` is null or a text that ends with 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_engine_set_include_dir(engine: *mut OcEngine, path: *const c_char) -> OcStatus {
    change(engine, |engine| {
        // SAFETY: the caller promises a text.
        let path = unsafe { memory::c_text(path, "path") }?;
        Ok(engine.includes(Directories(vec![path.into()])))
    })
}

/// Says what the host answers the scripts compiled from here on. Replaces what was said before.
///
/// # Safety
/// `host` is null, which is an error, or points to an `oc_host` whose callback and `user` may be used from any thread, as
/// long as the process lasts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_engine_set_host(engine: *mut OcEngine, host: *const OcHost) -> OcStatus {
    change(engine, |engine| {
        // SAFETY: the caller promises one.
        let host = unsafe { memory::read(host, "host") }?;
        Ok(engine.host(host))
    })
}
