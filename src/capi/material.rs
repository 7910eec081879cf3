//! Materials and shading points: `oc_material_…`, `oc_globals`, `oc_shade`.

use super::handle::{self, Object, OcBsdf, OcEngine, OcMaterial};
use super::memory;
use super::status::{Failure, OcStatus, guard};
use crate::audit;
use crate::engine::{Error, OwnedBsdf};
use crate::globals::{Differentials, Globals};
use crate::ir::Value;
use glam::Vec3;
use std::ffi::c_char;
use std::sync::{Mutex, RwLock};

/// What changes by one pixel to the right (`x`) and one pixel down (`y`): of the position, of the direction the ray travels,
/// of the surface parameters. Read only where the engine's `oc_host` says so.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OcDifferentials {
    /// Of the position.
    pub dpdx: [f32; 3],
    /// Of the position, downward.
    pub dpdy: [f32; 3],
    /// Of the direction the ray travels.
    pub didx: [f32; 3],
    /// Of the direction the ray travels, downward.
    pub didy: [f32; 3],
    /// Of u.
    pub dudx: f32,
    /// Of u, downward.
    pub dudy: f32,
    /// Of v.
    pub dvdx: f32,
    /// Of v, downward.
    pub dvdy: f32,
}

impl From<Differentials> for OcDifferentials {
    fn from(d: Differentials) -> OcDifferentials {
        let Differentials { dpdx, dpdy, didx, didy, dudx, dudy, dvdx, dvdy } = d;
        let [dpdx, dpdy, didx, didy] = [dpdx, dpdy, didx, didy].map(|v| v.to_array());
        OcDifferentials { dpdx, dpdy, didx, didy, dudx, dudy, dvdx, dvdy }
    }
}

impl From<OcDifferentials> for Differentials {
    fn from(d: OcDifferentials) -> Differentials {
        let OcDifferentials { dpdx, dpdy, didx, didy, dudx, dudy, dvdx, dvdy } = d;
        let [dpdx, dpdy, didx, didy] = [dpdx, dpdy, didx, didy].map(Vec3::from_array);
        Differentials { dpdx, dpdy, didx, didy, dudx, dudy, dvdx, dvdy }
    }
}

/// The shading point, in world space. Fill it with `oc_globals_default` first, then set what is known.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OcGlobals {
    /// Position.
    pub p: [f32; 3],
    /// Shading normal, toward the viewer; its length does not matter. Zero or not finite: `ng` is used.
    pub n: [f32; 3],
    /// Geometric normal, toward the viewer.
    pub ng: [f32; 3],
    /// dP/du: where tangents are measured from.
    pub dpdu: [f32; 3],
    /// dP/dv.
    pub dpdv: [f32; 3],
    /// Surface parameters.
    pub u: f32,
    /// The second surface parameter.
    pub v: f32,
    /// Shutter time in seconds.
    pub time: f32,
    /// Not 0: the ray hit the back of the surface, and the host turned the normals toward the viewer.
    pub backfacing: i32,
    /// How it differs from the points that the neighbouring pixels show.
    pub differentials: OcDifferentials,
}

impl From<Globals> for OcGlobals {
    fn from(g: Globals) -> OcGlobals {
        OcGlobals {
            p: g.p.to_array(),
            n: g.n.to_array(),
            ng: g.ng.to_array(),
            dpdu: g.dpdu.to_array(),
            dpdv: g.dpdv.to_array(),
            u: g.u,
            v: g.v,
            time: g.time,
            backfacing: i32::from(g.backfacing),
            differentials: g.differentials.into(),
        }
    }
}

impl From<OcGlobals> for Globals {
    fn from(g: OcGlobals) -> Globals {
        Globals {
            p: Vec3::from_array(g.p),
            n: Vec3::from_array(g.n),
            ng: Vec3::from_array(g.ng),
            dpdu: Vec3::from_array(g.dpdu),
            dpdv: Vec3::from_array(g.dpdv),
            u: g.u,
            v: g.v,
            time: g.time,
            backfacing: g.backfacing != 0,
            differentials: g.differentials.into(),
            ..Globals::default()
        }
    }
}

/// The origin of a plane with its normal along z and u along x.
///
/// # Safety
/// `globals` is null or has room for an `oc_globals`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_globals_default(globals: *mut OcGlobals) -> OcStatus {
    // SAFETY: the caller promises room.
    guard(|| unsafe { memory::write(globals, Globals::default().into(), "globals") })
}

/// Compiles a script to a material with all parameters at their defaults. To be freed with `oc_material_free`; the engine
/// may be freed before.
///
/// `source`: `len` bytes of UTF-8, no closing 0 needed. `name`: in messages; null: `material`.
///
/// # Safety
/// `source` points to `len` bytes, `name` is null or ends with 0, `material` is null or has room for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_material_compile(
    engine: *mut OcEngine,
    source: *const c_char,
    len: usize,
    name: *const c_char,
    material: *mut *mut OcMaterial,
) -> OcStatus {
    guard(|| {
        let found = handle::get(engine)?;
        let engine = found.engine()?.clone();
        // SAFETY: the caller promises both texts.
        let (source, name) =
            unsafe { (memory::sized_text(source, len, "source")?, memory::c_text_or_empty(name, "name")?) };
        let name = if name.is_empty() { "material" } else { &name };
        if material.is_null() {
            return Err(Failure::new(OcStatus::OcErrorNull, "`material` is null"));
        }
        let compiled = engine.material(name, &source).map_err(Error::Script)?;
        let made = handle::insert::<OcMaterial>(Object::Material(RwLock::new(compiled)))?;
        // SAFETY: not null, and the caller promises room.
        unsafe { memory::write(material, made, "material") }
    })
}

/// Frees a material; null is fine. BSDFs shaded from it stay as they are.
#[unsafe(no_mangle)]
pub extern "C" fn oc_material_free(material: *mut OcMaterial) -> OcStatus {
    guard(|| handle::free(material))
}

/// Sets a parameter, specialises the script again and bakes the tables that no other material of the engine holds.
///
/// # Safety
/// `name` is null or ends with 0.
unsafe fn set(material: *mut OcMaterial, name: *const c_char, value: Result<Value, Failure>) -> OcStatus {
    guard(|| {
        let found = handle::get(material)?;
        // SAFETY: the caller promises a text.
        let name = unsafe { memory::c_text(name, "name") }?;
        let value = value?;
        // Not while others shade: they go on with the material as it was.
        let mut changed = found.material()?.clone();
        changed.set(&name, value).map_err(Error::Script)?;
        *found.material_mut()? = changed;
        Ok(())
    })
}

/// Sets a float parameter, or every component of a color or vector. Costs milliseconds, not nanoseconds: once per
/// edit, not per point. Of two threads that set parameters of one material at once, one may undo what the other did.
///
/// # Safety
/// `name` is null or ends with 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_material_set_float(material: *mut OcMaterial, name: *const c_char, value: f32) -> OcStatus {
    // SAFETY: passed on.
    unsafe { set(material, name, Ok(Value::Float(value))) }
}

/// Sets an int parameter: see `oc_material_set_float`.
///
/// # Safety
/// `name` is null or ends with 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_material_set_int(material: *mut OcMaterial, name: *const c_char, value: i32) -> OcStatus {
    // SAFETY: passed on.
    unsafe { set(material, name, Ok(Value::Int(value))) }
}

/// Sets a color parameter (linear RGB), or a vector, normal or point: see `oc_material_set_float`.
///
/// # Safety
/// `name` is null or ends with 0; `value` is null or points to three floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_material_set_color(
    material: *mut OcMaterial,
    name: *const c_char,
    value: *const f32,
) -> OcStatus {
    // SAFETY: the caller promises three floats and a text.
    unsafe { set(material, name, memory::read(value.cast::<[f32; 3]>(), "value").map(Value::Color)) }
}

/// Sets a string parameter: see `oc_material_set_float`.
///
/// # Safety
/// `name` and `value` are null or end with 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_material_set_string(
    material: *mut OcMaterial,
    name: *const c_char,
    value: *const c_char,
) -> OcStatus {
    // SAFETY: the caller promises texts.
    unsafe { set(material, name, memory::c_text(value, "value").map(Value::String)) }
}

/// Measures the material in white surroundings from thirty directions, seen from the viewer and from the light:
/// `OC_ERROR_GAINS` if it gives back more than it receives, with the direction in the message. Takes seconds. The test for
/// closures of your own, whose bound on the albedo is otherwise taken on trust.
#[unsafe(no_mangle)]
pub extern "C" fn oc_material_audit(material: *mut OcMaterial) -> OcStatus {
    guard(|| {
        let found = handle::get(material)?;
        let material = found.material()?.clone();
        audit::assert_no_gain(&material).map_err(|gain| Failure::new(OcStatus::OcErrorGains, gain.to_string()))
    })
}

/// The BSDF of a material at a point, seen from `wo` (world space, unit, away from the surface).
///
/// If `*bsdf` is null a BSDF is made, to be freed with `oc_bsdf_free`; otherwise the one that is there is used again,
/// which saves the allocation. Keep one per thread. After `OC_ERROR_BUDGET` it is black.
///
/// # Safety
/// `globals` points to an `oc_globals`, `wo` to three floats, `bsdf` to a handle or null. Each may be null itself, which
/// is an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_shade(
    material: *mut OcMaterial,
    globals: *const OcGlobals,
    wo: *const f32,
    bsdf: *mut *mut OcBsdf,
) -> OcStatus {
    guard(|| {
        let found = handle::get(material)?;
        // SAFETY: the caller promises what they point to.
        let (globals, wo, handle) = unsafe {
            let globals: Globals = memory::read(globals, "globals")?.into();
            (globals, memory::read(wo.cast::<[f32; 3]>(), "wo")?, memory::read(bsdf.cast_const(), "bsdf")?)
        };
        let wo = Vec3::from_array(wo);
        let material = found.material()?;
        if !handle.is_null() {
            let found = handle::get(handle)?;
            return Ok(found.bsdf()?.shade(&material, &globals, wo).map_err(Error::Shade)?);
        }
        let mut shaded = OwnedBsdf::new(material.clone());
        shaded.shade(&material, &globals, wo).map_err(Error::Shade)?;
        let made = handle::insert::<OcBsdf>(Object::Bsdf(Mutex::new(shaded)))?;
        // SAFETY: read above, so it is not null.
        unsafe { memory::write(bsdf, made, "bsdf") }
    })
}
