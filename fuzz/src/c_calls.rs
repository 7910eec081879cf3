//! Calls of the C interface in any order, with handles that live, are freed, null, of another kind or made up.
//!
//! Pointers to memory are null or good for what is said of them: the interface trusts its caller that far.
#![allow(unsafe_code)]

use super::bytes::Bytes;
use overcoat::Globals;
use overcoat::capi::*;
use std::ffi::{CStr, c_char, c_void};
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Calls that bytes may ask for.
const MAX_CALLS: usize = 64;
/// Most directions of a call.
const MOST: usize = 70;
/// Registered closures are kept until the process ends.
const MAX_REGISTERED: usize = 64;

static REGISTERED: AtomicUsize = AtomicUsize::new(0);

const SCRIPTS: [&str; 8] = [
    "Ci = diffuse(N);",
    "surface s(float r = 0.3, color c = 1, string m = \"x\", int k = 2) { Ci = k * r * c * diffuse(N) + transparent(); }",
    "surface s(float r = 0.3, color c = 1) { Ci = sheen(c * diffuse(N), N, c, r); }",
    "Ci = layer(0.5 * reflection(N), 0.5 * emission() + u * diffuse(N));",
    "Ci = diffuse(normal(0, 0, v)) * color(texture(\"a\", u, v));",
    "Ci = difuse(N);",
    "closure color c = diffuse(N); for (int i = 0; i < 30; i++) c = c + c; Ci = c;",
    "Ci = own(N, 0.5) + own(N, u);",
];

const NAMES: [&CStr; 6] = [c"r", c"c", c"m", c"k", c"", c"\xff"];

/// The handles that calls gave out so far, freed or not.
struct Given {
    handles: Vec<*mut c_void>,
}

impl Given {
    fn pick<T>(&self, bytes: &mut Bytes<'_>) -> *mut T {
        match bytes.byte() {
            250.. => null_mut(),
            // Made up, small and large.
            246.. => (usize::from(bytes.byte()) << (bytes.byte() % 57)) as *mut T,
            // The youngest most often.
            k if !self.handles.is_empty() => {
                self.handles[self.handles.len() - 1 - usize::from(k / 8) % self.handles.len()].cast()
            }
            _ => null_mut(),
        }
    }

    fn keep<T>(&mut self, status: OcStatus, handle: *mut T) {
        assert_eq!(status == OcStatus::OcOk, !handle.is_null(), "{status:?}");
        if !handle.is_null() {
            self.handles.push(handle.cast());
        }
    }
}

/// Makes calls.
pub fn handles(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let mut given = Given { handles: Vec::new() };
    for _ in 0..MAX_CALLS {
        if !bytes.left() {
            break;
        }
        let status = call(&mut bytes, &mut given);
        assert_ne!(status, OcStatus::OcErrorInternal, "{}", message());
    }
    for handle in given.handles {
        // Two of the three are of another kind.
        let freed = [oc_bsdf_free(handle.cast()), oc_material_free(handle.cast()), oc_engine_free(handle.cast())];
        assert!(freed.iter().filter(|s| **s == OcStatus::OcOk).count() <= 1, "{freed:?}");
    }
}

fn message() -> String {
    let mut buffer = vec![0u8; 4000];
    // SAFETY: as long as said.
    unsafe { oc_last_error(buffer.as_mut_ptr().cast(), buffer.len()) };
    CStr::from_bytes_until_nul(&buffer).expect("a closing 0").to_str().expect("UTF-8").to_owned()
}

/// Null now and then.
fn or_null<T>(bytes: &mut Bytes<'_>, pointer: *const T) -> *const T {
    if bytes.byte() > 247 { null() } else { pointer }
}

/// One of some texts, or null.
fn text(bytes: &mut Bytes<'_>, texts: &[&CStr]) -> *const c_char {
    let chosen = texts[bytes.below(texts.len())];
    or_null(bytes, chosen.as_ptr())
}

/// One call. SAFETY, throughout: pointers are null or point to locals of the size the call asks for; handles may be
/// anything.
fn call(bytes: &mut Bytes<'_>, given: &mut Given) -> OcStatus {
    let kind = bytes.byte() % 24;
    match kind {
        0 | 1 => {
            let mut engine = null_mut();
            let status = unsafe { oc_engine_new(&mut engine) };
            given.keep(status, engine);
            status
        }
        2 => oc_engine_free(given.pick(bytes)),
        3 => oc_engine_set_tier(given.pick(bytes), u32::from(bytes.byte() % 4)),
        4 => oc_engine_set_layering(given.pick(bytes), u32::from(bytes.byte() % 5)),
        5..=7 => compile(bytes, given),
        8 => oc_material_free(given.pick(bytes)),
        9..=11 => set(bytes, given),
        12..=14 => shade(bytes, given),
        15 => oc_bsdf_free(given.pick(bytes)),
        16 | 17 => eval(bytes, given),
        18 | 19 => sample(bytes, given),
        20 | 21 => ask(bytes, given),
        22 => register(bytes, given),
        _ => host(bytes, given),
    }
}

fn compile(bytes: &mut Bytes<'_>, given: &mut Given) -> OcStatus {
    let engine = given.pick(bytes);
    let script = SCRIPTS[bytes.below(SCRIPTS.len())].as_bytes();
    // Also cut short, also within a character.
    let length = if bytes.byte() > 240 { bytes.below(script.len()) } else { script.len() };
    let (script, name) = (or_null(bytes, script.as_ptr()), text(bytes, &NAMES));
    let mut material = null_mut();
    let status = unsafe { oc_material_compile(engine, script.cast(), length, name, &mut material) };
    given.keep(status, material);
    status
}

fn set(bytes: &mut Bytes<'_>, given: &Given) -> OcStatus {
    let material = given.pick(bytes);
    let name = text(bytes, &NAMES);
    unsafe {
        match bytes.byte() % 4 {
            0 => oc_material_set_float(material, name, bytes.number(0.0, 1.0)),
            1 => oc_material_set_int(material, name, bytes.number(-10.0, 10.0) as i32),
            2 => {
                let color = bytes.numbers(0.0, 1.0);
                oc_material_set_color(material, name, or_null(bytes, color.as_ptr()))
            }
            _ => oc_material_set_string(material, name, text(bytes, &NAMES)),
        }
    }
}

fn shade(bytes: &mut Bytes<'_>, given: &mut Given) -> OcStatus {
    let material = given.pick(bytes);
    let mut globals: OcGlobals = Globals::default().into();
    if bytes.byte() > 128 {
        globals.n = bytes.direction();
        globals.ng = bytes.direction();
        globals.dpdu = bytes.direction();
        [globals.u, globals.v, globals.time] = bytes.numbers(0.0, 1.0);
        globals.backfacing = i32::from(bytes.byte()) - 128;
    }
    let wo = bytes.direction();
    let (globals, wo) = (or_null(bytes, &raw const globals), or_null(bytes, wo.as_ptr()));
    // A handle of one's own, or whatever there is, in place of null.
    let before: *mut OcBsdf = if bytes.byte() > 128 { given.pick(bytes) } else { null_mut() };
    let mut bsdf = before;
    let status = unsafe { oc_shade(material, globals, wo, &mut bsdf) };
    if before.is_null() && !bsdf.is_null() {
        given.handles.push(bsdf.cast());
    }
    assert!(status != OcStatus::OcOk || !bsdf.is_null());
    status
}

fn sane(numbers: &[f32]) {
    assert!(numbers.iter().all(|x| x.is_finite() && *x >= 0.0), "{numbers:?}");
}

fn eval(bytes: &mut Bytes<'_>, given: &Given) -> OcStatus {
    let bsdf = given.pick(bytes);
    let n = bytes.below(MOST);
    let directions: Vec<[f32; 3]> = (0..n.min(6)).map(|_| bytes.direction()).collect();
    let wi: Vec<[f32; 3]> = directions.iter().cycle().take(n).copied().collect();
    // Results as fields of a structure, or dense; also too narrow.
    let stride = [12, 16, 20, 12, 0, 7][bytes.below(6)];
    let mut out = vec![0f32; 5 * MOST + 8];
    let mut pdf = vec![0f32; MOST];
    let wi = or_null(bytes, wi.as_ptr());
    let status = unsafe {
        let f = out.as_mut_ptr();
        oc_bsdf_eval_strided(bsdf, wi.cast(), 12, n, f, stride, pdf.as_mut_ptr(), 4)
    };
    if status == OcStatus::OcOk {
        sane(&out);
        sane(&pdf);
    }
    // A length beyond the address space.
    if bytes.byte() > 250 {
        let (f, pdf) = (out.as_mut_ptr(), pdf.as_mut_ptr());
        let status = unsafe { oc_bsdf_eval(bsdf, wi.cast(), usize::MAX / 2, f, pdf) };
        assert_ne!(status, OcStatus::OcOk);
    }
    status
}

fn sample(bytes: &mut Bytes<'_>, given: &Given) -> OcStatus {
    let bsdf = given.pick(bytes);
    let n = bytes.below(12);
    let u: Vec<[f32; 3]> = (0..n).map(|_| bytes.numbers(0.0, 1.0)).collect();
    let mut samples = vec![OcSample::default(); n];
    let size = size_of::<OcSample>();
    let u = or_null(bytes, u.as_ptr());
    let status = unsafe { oc_bsdf_sample_strided(bsdf, u.cast(), 12, n, samples.as_mut_ptr(), size) };
    for s in &samples {
        sane(&s.f_cos);
        sane(&[s.pdf, s.eta, s.roughness]);
        assert!(s.wi.iter().all(|x| x.is_finite()), "{s:?}");
    }
    let (mut wi, mut f, mut pdf, mut flags) = ([0f32; 36], [0f32; 36], [0f32; 12], [0u32; 12]);
    let flags = if bytes.byte() > 128 { flags.as_mut_ptr() } else { null_mut() };
    let again = unsafe { oc_bsdf_sample(bsdf, u.cast(), n, wi.as_mut_ptr(), f.as_mut_ptr(), pdf.as_mut_ptr(), flags) };
    assert_eq!(again, status);
    if status == OcStatus::OcOk {
        assert!(samples.iter().zip(&pdf).all(|(s, pdf)| s.pdf == *pdf));
    }
    status
}

fn ask(bytes: &mut Bytes<'_>, given: &Given) -> OcStatus {
    let bsdf = given.pick(bytes);
    let (mut rgb, mut flags, w) = ([0f32; 3], 0u32, bytes.direction());
    let out = or_null(bytes, rgb.as_mut_ptr()).cast_mut();
    let status = unsafe {
        match bytes.byte() % 5 {
            0 => oc_bsdf_albedo(bsdf, out),
            1 => oc_bsdf_albedo_bound(bsdf, or_null(bytes, w.as_ptr()), out),
            2 => oc_bsdf_emission(bsdf, out),
            3 => oc_bsdf_transparency(bsdf, out),
            _ => oc_bsdf_flags(bsdf, &mut flags),
        }
    };
    sane(&rgb);
    status
}

unsafe extern "C" fn flat(_: *mut c_void, _: *const f32, _: *const f64, _: *const f64, out: *mut f64) {
    // SAFETY: three numbers are asked for.
    unsafe { out.cast::<[f64; 3]>().write([0.3; 3]) };
}

unsafe extern "C" fn below_one(_: *mut c_void, _: *const f32, _: *const f64, out: *mut f64) {
    // SAFETY: three numbers are asked for.
    unsafe { out.cast::<[f64; 3]>().write([0.95; 3]) };
}

fn register(bytes: &mut Bytes<'_>, given: &Given) -> OcStatus {
    let engine = given.pick(bytes);
    let names = [c"own", c"own", c"own", c"diffuse", c"", c"a b", c"\xff", c"N", c"r"];
    let mut param = |kind: u32| OcClosureParam {
        name: text(bytes, &names),
        kind,
        keyword: i32::from(bytes.byte() > 200),
        default_value: bytes.numbers(0.0, 1.0),
        min: bytes.number(0.0, 0.0),
        max: bytes.number(1.0, 1.0),
        doc: null(),
    };
    let params: Vec<OcClosureParam> = (0..4).map(|k| param(if k == 0 { OC_PARAM_NORMAL } else { k - 1 })).collect();
    let closure = OcClosure {
        name: text(bytes, &names),
        doc: null(),
        source: null(),
        params: or_null(bytes, params.as_ptr()),
        param_count: bytes.below(params.len() + 1),
        not_reciprocal: i32::from(bytes.byte() > 200),
        transmits: i32::from(bytes.byte() > 200),
        f: (bytes.byte() < 240).then_some(flat),
        albedo_bound: (bytes.byte() < 240).then_some(below_one),
        albedo: None,
        sample: None,
        pdf: None,
        user: null_mut(),
    };
    if REGISTERED.load(Ordering::Relaxed) >= MAX_REGISTERED {
        return OcStatus::OcOk;
    }
    let status = unsafe { oc_register_closure(engine, or_null(bytes, &raw const closure)) };
    REGISTERED.fetch_add(usize::from(status == OcStatus::OcOk), Ordering::Relaxed);
    status
}

unsafe extern "C" fn checkers(user: *mut c_void, lookup: *const OcLookup, rgba: *mut f32) -> i32 {
    // SAFETY: both live through the call; there is room for four.
    unsafe {
        let lookup = lookup.read();
        rgba.cast::<[f32; 4]>().write([lookup.s, lookup.t, f32::NAN, -1.0]);
    }
    i32::from(user.is_null())
}

fn host(bytes: &mut Bytes<'_>, given: &Given) -> OcStatus {
    let host = OcHost {
        texture: (bytes.byte() > 40).then_some(checkers),
        derivatives: i32::from(bytes.byte() & 1),
        user: or_null(bytes, &raw const REGISTERED).cast_mut().cast(),
    };
    unsafe { oc_engine_set_host(given.pick(bytes), or_null(bytes, &raw const host)) }
}
