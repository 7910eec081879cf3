//! The table of handles. A handle is a key of the table and a tag, never an address: keys carry a generation, so that one
//! that was freed finds nothing even after its place is taken.

use super::status::{Failure, OcStatus};
use crate::engine::{Engine, Material, OwnedBsdf};
use sharded_slab::{Config, Entry, Slab};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// An engine, as `oc_engine_new` gives out. Never followed as a pointer.
pub struct OcEngine {
    _opaque: [u8; 0],
}

/// A material, as `oc_material_compile` gives out. Never followed as a pointer.
pub struct OcMaterial {
    _opaque: [u8; 0],
}

/// A BSDF at a shading point, as `oc_shade` gives out. Never followed as a pointer.
pub struct OcBsdf {
    _opaque: [u8; 0],
}

/// What a handle stands for.
pub(super) enum Object {
    Engine(RwLock<Engine>),
    Material(RwLock<Material>),
    Bsdf(Mutex<OwnedBsdf>),
}

/// Leaves the four high bits of keys free for the tag.
struct Keys;

impl Config for Keys {
    const RESERVED_BITS: usize = TAG_BITS as usize;
}

const TAG_BITS: u32 = 4;

static TABLE: LazyLock<Slab<Object, Keys>> = LazyLock::new(Slab::new_with_config::<Keys>);

/// A kind of handle.
pub(super) trait Handle: Sized {
    /// Differs from kind to kind and is not 0, so that no handle is null.
    const TAG: usize;
    /// In messages.
    const NAME: &'static str;
}

impl Handle for OcEngine {
    const TAG: usize = 1;
    const NAME: &'static str = "engine";
}

impl Handle for OcMaterial {
    const TAG: usize = 2;
    const NAME: &'static str = "material";
}

impl Handle for OcBsdf {
    const TAG: usize = 3;
    const NAME: &'static str = "BSDF";
}

fn tag(object: &Object) -> usize {
    match object {
        Object::Engine(_) => OcEngine::TAG,
        Object::Material(_) => OcMaterial::TAG,
        Object::Bsdf(_) => OcBsdf::TAG,
    }
}

/// Gives out a handle.
pub(super) fn insert<H: Handle>(object: Object) -> Result<*mut H, Failure> {
    let full = || Failure::new(OcStatus::OcErrorInternal, "too many handles");
    let key = TABLE.insert(object).ok_or_else(full)?;
    Ok(std::ptr::without_provenance_mut(key << TAG_BITS | H::TAG))
}

fn key<H: Handle>(handle: *const H) -> Result<usize, Failure> {
    match handle.addr() {
        0 => Err(Failure::new(OcStatus::OcErrorNull, format!("the {} is null", H::NAME))),
        address if address & ((1 << TAG_BITS) - 1) == H::TAG => Ok(address >> TAG_BITS),
        _ => Err(bad::<H>()),
    }
}

fn bad<H: Handle>() -> Failure {
    Failure::new(OcStatus::OcErrorBadHandle, format!("no {}: freed, or of another kind", H::NAME))
}

/// An object while a call uses it; it outlives being freed meanwhile.
pub(super) struct Found(Entry<'static, Object, Keys>);

/// Looks up a handle.
pub(super) fn get<H: Handle>(handle: *const H) -> Result<Found, Failure> {
    let entry = TABLE.get(key(handle)?).filter(|entry| tag(entry) == H::TAG).ok_or_else(bad::<H>)?;
    Ok(Found(entry))
}

/// Frees a handle; null is fine.
pub(super) fn free<H: Handle>(handle: *const H) -> Result<(), Failure> {
    if handle.is_null() {
        return Ok(());
    }
    // Looked up first: a key that was made up may be of another kind.
    drop(get(handle)?);
    if TABLE.remove(key(handle)?) { Ok(()) } else { Err(bad::<H>()) }
}

impl Found {
    pub fn engine(&self) -> Result<RwLockReadGuard<'_, Engine>, Failure> {
        match &*self.0 {
            Object::Engine(engine) => Ok(engine.read().unwrap_or_else(PoisonError::into_inner)),
            Object::Material(_) | Object::Bsdf(_) => Err(bad::<OcEngine>()),
        }
    }

    pub fn engine_mut(&self) -> Result<RwLockWriteGuard<'_, Engine>, Failure> {
        match &*self.0 {
            Object::Engine(engine) => Ok(engine.write().unwrap_or_else(PoisonError::into_inner)),
            Object::Material(_) | Object::Bsdf(_) => Err(bad::<OcEngine>()),
        }
    }

    pub fn material(&self) -> Result<RwLockReadGuard<'_, Material>, Failure> {
        match &*self.0 {
            Object::Material(material) => Ok(material.read().unwrap_or_else(PoisonError::into_inner)),
            Object::Engine(_) | Object::Bsdf(_) => Err(bad::<OcMaterial>()),
        }
    }

    pub fn material_mut(&self) -> Result<RwLockWriteGuard<'_, Material>, Failure> {
        match &*self.0 {
            Object::Material(material) => Ok(material.write().unwrap_or_else(PoisonError::into_inner)),
            Object::Engine(_) | Object::Bsdf(_) => Err(bad::<OcMaterial>()),
        }
    }

    pub fn bsdf(&self) -> Result<MutexGuard<'_, OwnedBsdf>, Failure> {
        match &*self.0 {
            Object::Bsdf(bsdf) => Ok(bsdf.lock().unwrap_or_else(PoisonError::into_inner)),
            Object::Engine(_) | Object::Material(_) => Err(bad::<OcBsdf>()),
        }
    }
}
