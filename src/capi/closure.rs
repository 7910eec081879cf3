//! Closures that a C host brings along: `oc_register_closure`.

use super::handle::{self, OcEngine};
use super::memory;
use super::status::{Failure, OcStatus, guard};
use crate::engine::Error;
use crate::lobes::Sides;
use crate::lobes::host::{ClosureSpec, HostLobe};
use std::ffi::{c_char, c_void};

/// A float.
pub const OC_PARAM_FLOAT: u32 = 0;
/// An int.
pub const OC_PARAM_INT: u32 = 1;
/// Linear RGB.
pub const OC_PARAM_COLOR: u32 = 2;
/// A tangent; the first one turns the frame the callbacks see.
pub const OC_PARAM_VECTOR: u32 = 3;
/// A normal; the first one is the z axis of that frame.
pub const OC_PARAM_NORMAL: u32 = 4;

/// One parameter of a closure.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct OcClosureParam {
    /// As scripts write it.
    pub name: *const c_char,
    /// One of `OC_PARAM_…`.
    pub kind: u32,
    /// Not 0: given as `"name", value` after the others, and may be left out.
    pub keyword: i32,
    /// Its usual value: one number, or three for a color. Not used for vectors and normals.
    pub default_value: [f32; 3],
    /// Values are clamped to this range, per channel.
    pub min: f32,
    /// Upper end of the range.
    pub max: f32,
    /// What it is, or null.
    pub doc: *const c_char,
}

/// Writes three numbers for a pair of directions. `values`: the parameters in declared order, clamped; a float or int takes
/// one place, the rest three. Directions are unit vectors away from the surface in the frame of the normal (z) and tangent
/// (x).
pub type OcPairFn =
    Option<unsafe extern "C" fn(user: *mut c_void, values: *const f32, wo: *const f64, wi: *const f64, out: *mut f64)>;

/// Writes three numbers for one direction: see `oc_pair_fn`.
pub type OcDirectionFn =
    Option<unsafe extern "C" fn(user: *mut c_void, values: *const f32, w: *const f64, out: *mut f64)>;

/// Writes a direction for two uniform numbers `u`: see `oc_pair_fn`.
pub type OcSampleFn =
    Option<unsafe extern "C" fn(user: *mut c_void, values: *const f32, wo: *const f64, u: *const f64, wi: *mut f64)>;

/// Returns the density over solid angle of sampling `wi`: see `oc_pair_fn`.
pub type OcPdfFn =
    Option<unsafe extern "C" fn(user: *mut c_void, values: *const f32, wo: *const f64, wi: *const f64) -> f64>;

/// A closure that the host brings along. Set everything to 0 first; what stays null is left out.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct OcClosure {
    /// As scripts call it. Required.
    pub name: *const c_char,
    /// What it looks like and does, or null.
    pub doc: *const c_char,
    /// Where it comes from (paper, equation), or null.
    pub source: *const c_char,
    /// `param_count` parameters, or null if there are none.
    pub params: *const OcClosureParam,
    /// How many.
    pub param_count: usize,
    /// Not 0: f(wo, wi) differs from f(wi, wo).
    pub not_reciprocal: i32,
    /// Not 0: it scatters to the other side too, and has a `sample` of its own.
    pub transmits: i32,
    /// f per channel, without any cosine. Required.
    pub f: OcPairFn,
    /// Never below the integral of f·|cos| over the other direction, with `w` the viewer's or the light's, per channel.
    /// Required: layering rests on it. May exceed 1, f is then divided; one that is too low is found by `oc_material_audit`.
    pub albedo_bound: OcDirectionFn,
    /// The best estimate of that integral with `w` the viewer's; null: the bound.
    pub albedo: OcDirectionFn,
    /// Draws directions; null: cosine-weighted on `wo`'s side. Needs `pdf`.
    pub sample: OcSampleFn,
    /// The density of `sample`.
    pub pdf: OcPdfFn,
    /// Handed to every callback.
    pub user: *mut c_void,
}

/// The host's callbacks as a lobe.
struct Callbacks {
    closure: OcClosure,
    f: unsafe extern "C" fn(*mut c_void, *const f32, *const f64, *const f64, *mut f64),
    bound: unsafe extern "C" fn(*mut c_void, *const f32, *const f64, *mut f64),
}

// SAFETY: `oc_register_closure` demands that the callbacks and `user` may be used from any thread; the other pointers are
// not read after registering.
unsafe impl Send for Callbacks {}
// SAFETY: as above.
unsafe impl Sync for Callbacks {}

impl HostLobe for Callbacks {
    fn f(&self, values: &[f32], wo: [f64; 3], wi: [f64; 3]) -> [f64; 3] {
        let mut out = [0.0; 3];
        // SAFETY: a callback as `oc_register_closure` demands; the arrays live through the call.
        unsafe { (self.f)(self.closure.user, values.as_ptr(), wo.as_ptr(), wi.as_ptr(), out.as_mut_ptr()) };
        out
    }

    fn albedo_bound(&self, values: &[f32], w: [f64; 3]) -> [f64; 3] {
        let mut out = [0.0; 3];
        // SAFETY: as above.
        unsafe { (self.bound)(self.closure.user, values.as_ptr(), w.as_ptr(), out.as_mut_ptr()) };
        out
    }

    fn albedo(&self, values: &[f32], w: [f64; 3]) -> [f64; 3] {
        let Some(albedo) = self.closure.albedo else { return self.albedo_bound(values, w) };
        let mut out = [0.0; 3];
        // SAFETY: as above.
        unsafe { albedo(self.closure.user, values.as_ptr(), w.as_ptr(), out.as_mut_ptr()) };
        out
    }

    fn sample(&self, values: &[f32], wo: [f64; 3], u: [f64; 2]) -> [f64; 3] {
        let Some(sample) = self.closure.sample else { return CosineWeighted.sample(values, wo, u) };
        let mut wi = [0.0; 3];
        // SAFETY: as above.
        unsafe { sample(self.closure.user, values.as_ptr(), wo.as_ptr(), u.as_ptr(), wi.as_mut_ptr()) };
        wi
    }

    fn pdf(&self, values: &[f32], wo: [f64; 3], wi: [f64; 3]) -> f64 {
        let Some(pdf) = self.closure.pdf else { return CosineWeighted.pdf(values, wo, wi) };
        // SAFETY: as above.
        unsafe { pdf(self.closure.user, values.as_ptr(), wo.as_ptr(), wi.as_ptr()) }
    }

    fn sides(&self) -> Sides {
        if self.closure.transmits != 0 { Sides::BOTH } else { Sides::REFLECT }
    }
}

/// How lobes are sampled that have no way of their own.
struct CosineWeighted;

impl HostLobe for CosineWeighted {
    fn f(&self, _: &[f32], _: [f64; 3], _: [f64; 3]) -> [f64; 3] {
        [0.0; 3]
    }

    fn albedo_bound(&self, _: &[f32], _: [f64; 3]) -> [f64; 3] {
        [0.0; 3]
    }
}

/// Declares a parameter.
///
/// # Safety
/// Its texts are null or end with 0.
unsafe fn declare(spec: ClosureSpec, p: &OcClosureParam) -> Result<ClosureSpec, Failure> {
    // SAFETY: the caller promises texts.
    let (name, doc) = unsafe { (memory::c_text(p.name, "param name")?, memory::c_text_or_empty(p.doc, "param doc")?) };
    let (min, max) = (p.min, p.max);
    let spec = match p.kind {
        OC_PARAM_FLOAT => spec.float(&name, p.default_value[0], min..=max, &doc),
        OC_PARAM_INT => spec.int(&name, p.default_value[0] as i32, min as i32..=max as i32, &doc),
        OC_PARAM_COLOR => spec.color(&name, p.default_value, min..=max, &doc),
        OC_PARAM_VECTOR => spec.vector(&name, &doc),
        OC_PARAM_NORMAL => spec.normal(&name, &doc),
        other => return Err(Failure::new(OcStatus::OcErrorBadValue, format!("{other} is no kind of parameter"))),
    };
    Ok(if p.keyword != 0 { spec.keyword() } else { spec })
}

/// Lets the scripts compiled from here on call a closure of the host. It parses, layers, is sampled and audited like a
/// built-in one, and is kept until the process ends: register once, not per scene. The texts and parameters are copied.
///
/// # Safety
/// `closure` is null or points to an `oc_closure` whose texts end with 0 and whose `params` has `param_count` elements. Its
/// callbacks and `user` may be used from any thread as long as the process lasts; they write no more than they are asked
/// for, and neither unwind nor call the library.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_register_closure(engine: *mut OcEngine, closure: *const OcClosure) -> OcStatus {
    guard(|| {
        let found = handle::get(engine)?;
        // SAFETY: the caller promises one.
        let closure = unsafe { memory::read(closure, "closure") }?;
        let missing = |what: &str| Failure::new(OcStatus::OcErrorNull, format!("`{what}` is required"));
        let f = closure.f.ok_or_else(|| missing("f"))?;
        let bound = closure.albedo_bound.ok_or_else(|| missing("albedo_bound"))?;
        if closure.sample.is_some() != closure.pdf.is_some() {
            return Err(missing(if closure.pdf.is_none() { "pdf" } else { "sample" }));
        }
        if closure.transmits != 0 && closure.sample.is_none() {
            return Err(missing("sample"));
        }
        // SAFETY: the caller promises texts.
        let (name, doc, source) = unsafe {
            let name = memory::c_text(closure.name, "name")?;
            (name, memory::c_text_or_empty(closure.doc, "doc")?, memory::c_text_or_empty(closure.source, "source")?)
        };
        let mut spec = ClosureSpec::new(name).doc(doc, source);
        // SAFETY: the caller promises that many.
        for p in unsafe { memory::slice(closure.params, closure.param_count, "params") }? {
            // SAFETY: the caller promises texts.
            spec = unsafe { declare(spec, p) }?;
        }
        if closure.not_reciprocal != 0 {
            spec = spec.not_reciprocal();
        }
        let mut engine = found.engine_mut()?;
        *engine = engine.clone().register(spec, Callbacks { closure, f, bound }).map_err(Error::Register)?;
        Ok(())
    })
}
