//! The C interface, called as C calls it: right, wrong, and from many threads; then from real C and C++ programs.
//!
//! The last tests need a C and a C++ compiler and valgrind.
#![cfg(all(feature = "capi", feature = "cloth", feature = "microfacet", feature = "legacy"))]
#![allow(unsafe_code)]

use overcoat::capi::*;
use overcoat::closure::Eval;
use overcoat::{Engine, Globals};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::ffi::{CStr, CString, c_void};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::ptr::{null, null_mut};

// SAFETY, throughout: pointers are null on purpose, point to locals of the size the call asks for, or are handles, which
// may be anything.

fn message() -> String {
    let mut buffer = vec![0u8; 4000];
    let length = unsafe { oc_last_error(buffer.as_mut_ptr().cast(), buffer.len()) };
    let text = CStr::from_bytes_until_nul(&buffer).expect("a closing 0").to_str().expect("UTF-8");
    assert_eq!(text.len(), length);
    text.to_owned()
}

fn ok(status: OcStatus) {
    assert_eq!(status, OcStatus::OcOk, "{}", message());
}

fn engine() -> *mut OcEngine {
    let mut engine = null_mut();
    ok(unsafe { oc_engine_new(&mut engine) });
    engine
}

fn compile(engine: *mut OcEngine, script: &str) -> (OcStatus, *mut OcMaterial) {
    let mut material = null_mut();
    let name = c"test.osl".as_ptr();
    let status = unsafe { oc_material_compile(engine, script.as_ptr().cast(), script.len(), name, &mut material) };
    (status, material)
}

fn material(engine: *mut OcEngine, script: &str) -> *mut OcMaterial {
    let (status, material) = compile(engine, script);
    ok(status);
    material
}

const WO: [f32; 3] = [0.6, 0.0, 0.8];

fn globals() -> OcGlobals {
    Globals::default().into()
}

fn shade(material: *mut OcMaterial) -> *mut OcBsdf {
    let mut bsdf = null_mut();
    ok(unsafe { oc_shade(material, &globals(), WO.as_ptr(), &mut bsdf) });
    bsdf
}

#[test]
fn it_gives_what_rust_gives() {
    let script = "surface s(color c = 1, float r = 0.5, string model = \"conty_kulla\", int k = 1)
        { Ci = k * sheen(c * diffuse(N) + 0.1 * transparent() + 0.2 * emission(), N, 1, r, \"model\", model); }";
    let (e, tint) = (engine(), [0.3f32, 0.2, 0.1]);
    let m = material(e, script);
    unsafe {
        ok(oc_material_set_color(m, c"c".as_ptr(), tint.as_ptr()));
        ok(oc_material_set_float(m, c"r".as_ptr(), 0.3));
        ok(oc_material_set_string(m, c"model".as_ptr(), c"zeltner".as_ptr()));
        ok(oc_material_set_int(m, c"k".as_ptr(), 1));
    }
    let b = shade(m);
    let mut rust = Engine::new().material("test.osl", script).expect("compiles");
    rust.set_all([("c", tint.into()), ("r", 0.3.into()), ("model", "zeltner".into())]).expect("sets");
    let bsdf = rust.shade(&Globals::default(), WO.into()).expect("shades");
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let numbers: Vec<[f32; 3]> = (0..200).map(|_| [rng.random(), rng.random(), rng.random()]).collect();
    let directions: Vec<[f32; 3]> =
        numbers.iter().map(|n| (glam::Vec3::from_array(*n) - 0.5).normalize_or_zero().to_array()).collect();
    let n = numbers.len();
    let (mut f, mut wi, mut pdf, mut flags) = (vec![[0f32; 3]; n], vec![[0f32; 3]; n], vec![0f32; n], vec![0u32; n]);
    ok(unsafe { oc_bsdf_eval(b, directions.as_ptr().cast(), n, f.as_mut_ptr().cast(), pdf.as_mut_ptr()) });
    for (k, direction) in directions.iter().enumerate() {
        assert_eq!(bsdf.eval(*direction), Eval { f_cos: f[k], pdf: pdf[k] });
    }
    for k in [1, 3] {
        let mut few = [[0f32; 3]; 3];
        ok(unsafe { oc_bsdf_eval(b, directions.as_ptr().cast(), k, few.as_mut_ptr().cast(), pdf.as_mut_ptr()) });
        assert_eq!(few[..k], f[..k], "few are evaluated one by one, to the same bits");
    }
    let (u, fp) = (numbers.as_ptr().cast(), f.as_mut_ptr().cast());
    ok(unsafe { oc_bsdf_sample(b, u, n, wi.as_mut_ptr().cast(), fp, pdf.as_mut_ptr(), flags.as_mut_ptr()) });
    let mut full = vec![OcSample::default(); n];
    ok(unsafe { oc_bsdf_sample_strided(b, u, 12, n, full.as_mut_ptr(), size_of::<OcSample>()) });
    let (mut deltas, mut lost) = (0, 0);
    for k in 0..n {
        let Some(s) = bsdf.sample(numbers[k]) else {
            assert_eq!((pdf[k], flags[k]), (0.0, 0));
            lost += 1;
            continue;
        };
        assert_eq!((s.wi, s.f_cos, s.pdf, s.scattering().bits()), (wi[k], f[k], pdf[k], flags[k]));
        assert_eq!((full[k].wi, full[k].eta, full[k].roughness), (s.wi, s.eta, s.roughness));
        deltas += usize::from(flags[k] & OC_DELTA != 0);
    }
    assert!(deltas > 5 && deltas + lost < n, "{deltas} of {n} delta, {lost} lost");
    let mut out = [0f32; 3];
    let mut ask = |call: unsafe extern "C" fn(*mut OcBsdf, *mut f32) -> OcStatus| {
        ok(unsafe { call(b, out.as_mut_ptr()) });
        out
    };
    assert_eq!(ask(oc_bsdf_albedo), bsdf.albedo());
    assert_eq!(ask(oc_bsdf_emission), bsdf.emission());
    assert_eq!(ask(oc_bsdf_transparency), bsdf.transparency());
    ok(unsafe { oc_bsdf_albedo_bound(b, WO.as_ptr(), out.as_mut_ptr()) });
    assert_eq!(out, bsdf.albedo_bound(WO));
    let mut kinds = 0;
    ok(unsafe { oc_bsdf_flags(b, &mut kinds) });
    assert_eq!(kinds, bsdf.flags().bits());
    assert_eq!(kinds & (OC_EMISSION | OC_NULL), OC_EMISSION | OC_NULL);
    for free in [oc_bsdf_free(b), oc_material_free(m), oc_engine_free(e)] {
        ok(free);
    }
}

#[test]
fn wrong_calls_are_errors() {
    use OcStatus::*;
    let (e, mut out, mut count) = (engine(), [0f32; 300], 0);
    let m = material(e, "surface s(float r = 0.5) { Ci = r * diffuse(N); }");
    let b = shade(m);
    let (o, g) = (out.as_mut_ptr(), globals());
    let name = c"r".as_ptr();
    let mut none: *mut OcBsdf = null_mut();
    let huge = usize::MAX / 4;
    let calls: Vec<(OcStatus, OcStatus)> = unsafe {
        vec![
            (oc_engine_new(null_mut()), OcErrorNull),
            (oc_engine_set_tier(null_mut(), 0), OcErrorNull),
            (oc_engine_set_tier(e, 9), OcErrorBadValue),
            (oc_engine_set_layering(e, 9), OcErrorBadValue),
            (oc_engine_set_include_dir(e, null()), OcErrorNull),
            (oc_engine_set_host(e, null()), OcErrorNull),
            (oc_engine_set_tier(m.cast(), 0), OcErrorBadHandle),
            (oc_globals_default(null_mut()), OcErrorNull),
            (oc_material_compile(e, null(), 3, null(), &mut null_mut()), OcErrorNull),
            (oc_material_compile(e, c"x".as_ptr(), usize::MAX, null(), &mut null_mut()), OcErrorBadLength),
            (oc_material_compile(e, c"\xff".as_ptr(), 1, null(), &mut null_mut()), OcErrorBadText),
            (oc_material_compile(e, c"Ci = 0;".as_ptr(), 7, c"\xff".as_ptr(), &mut null_mut()), OcErrorBadText),
            (oc_material_compile(e, c"Ci = ;".as_ptr(), 6, null(), &mut null_mut()), OcErrorScript),
            (oc_material_compile(e, c"Ci = 0;".as_ptr(), 7, null(), null_mut()), OcErrorNull),
            (oc_material_compile(b.cast(), c"Ci = 0;".as_ptr(), 7, null(), &mut null_mut()), OcErrorBadHandle),
            (oc_material_set_float(m, null(), 1.0), OcErrorNull),
            (oc_material_set_float(m, c"q".as_ptr(), 1.0), OcErrorScript),
            (oc_material_set_string(m, name, c"x".as_ptr()), OcErrorScript),
            (oc_material_set_string(m, name, null()), OcErrorNull),
            (oc_material_set_color(m, name, null()), OcErrorNull),
            (oc_material_set_float(e.cast(), name, 1.0), OcErrorBadHandle),
            (oc_shade(m, null(), WO.as_ptr(), &mut none), OcErrorNull),
            (oc_shade(m, &g, null(), &mut none), OcErrorNull),
            (oc_shade(m, &g, WO.as_ptr(), null_mut()), OcErrorNull),
            (oc_shade(m, &g, WO.as_ptr(), &mut e.cast()), OcErrorBadHandle),
            (oc_shade(b.cast(), &g, WO.as_ptr(), &mut none), OcErrorBadHandle),
            (oc_bsdf_eval(b, null(), 1, o, o), OcErrorNull),
            (oc_bsdf_eval(b, WO.as_ptr(), 1, null_mut(), o), OcErrorNull),
            (oc_bsdf_eval(b, WO.as_ptr(), huge, o, o), OcErrorBadLength),
            (oc_bsdf_eval_strided(b, WO.as_ptr(), 8, 2, o, 12, o, 4), OcErrorBadLength),
            (oc_bsdf_eval_strided(b, WO.as_ptr(), huge, 9, o, 12, o, 4), OcErrorBadLength),
            (oc_bsdf_eval(null_mut(), WO.as_ptr(), 1, o, o), OcErrorNull),
            (oc_bsdf_eval(m.cast(), WO.as_ptr(), 1, o, o), OcErrorBadHandle),
            (oc_bsdf_sample(b, WO.as_ptr(), 1, o, o, null_mut(), null_mut()), OcErrorNull),
            (oc_bsdf_sample_strided(b, WO.as_ptr(), 12, 2, null_mut(), 40), OcErrorNull),
            (oc_bsdf_albedo(b, null_mut()), OcErrorNull),
            (oc_bsdf_albedo_bound(b, null(), o), OcErrorNull),
            (oc_bsdf_flags(b, null_mut()), OcErrorNull),
            (oc_bsdf_flags(e.cast(), &mut count), OcErrorBadHandle),
            (oc_material_audit(b.cast()), OcErrorBadHandle),
            (oc_register_closure(e, null()), OcErrorNull),
        ]
    };
    for (index, (got, wanted)) in calls.iter().enumerate() {
        assert_eq!(got, wanted, "call {index}");
    }
    assert!(none.is_null() && !message().is_empty());
    // Nothing to do is fine, and so is freeing nothing.
    ok(unsafe { oc_bsdf_eval(b, null(), 0, null_mut(), null_mut()) });
    ok(unsafe { oc_bsdf_sample(b, null(), 0, null_mut(), null_mut(), null_mut(), null_mut()) });
    for free in [oc_bsdf_free(null_mut()), oc_material_free(null_mut()), oc_engine_free(null_mut())] {
        ok(free);
    }
    // In any order, once.
    ok(oc_engine_free(e));
    ok(oc_material_free(m));
    ok(unsafe { oc_bsdf_albedo(b, o) });
    ok(oc_bsdf_free(b));
    assert_eq!(oc_bsdf_free(b), OcErrorBadHandle);
    assert_eq!(oc_material_free(m), OcErrorBadHandle);
    assert_eq!(oc_engine_free(e), OcErrorBadHandle);
    assert_eq!(unsafe { oc_bsdf_albedo(b, o) }, OcErrorBadHandle);
    // Its place taken by another, the old handle still finds nothing.
    let again = engine();
    assert_eq!(oc_engine_set_tier(e, 0), OcErrorBadHandle);
    ok(oc_engine_free(again));
}

#[test]
fn made_up_handles_are_errors() {
    let e = engine();
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut odd: Vec<usize> = (0..20_000).map(|_| rng.random::<u64>() as usize >> rng.random_range(0..64)).collect();
    odd.extend((0..4096).chain([usize::MAX, usize::MAX - 1, 1 << 63]));
    odd.extend((0..64).flat_map(|bit| [e.addr() ^ 1 << bit, 1 << bit, (1 << bit) | 1, (1 << bit) | 2]));
    for address in odd.into_iter().filter(|a| *a != 0 && *a != e.addr()) {
        // Other tests of this process hold handles: only those that stand for engines may be found, and only low numbers.
        let handle = std::ptr::without_provenance_mut(address);
        let status = oc_engine_set_tier(handle, OC_TIER_STANDARD);
        assert!(
            status == OcStatus::OcErrorBadHandle || status == OcStatus::OcOk,
            "{address:#x}: {status:?} {}",
            message()
        );
    }
    ok(oc_engine_free(e));
}

#[test]
fn messages_have_places_and_fit() {
    let e = engine();
    let (status, none) = compile(e, "// Ö\nCi = difuse(N);");
    assert_eq!(status, OcStatus::OcErrorScript);
    assert!(none.is_null());
    let whole = message();
    assert!(whole.contains("test.osl:2:6") && whole.contains("did you mean `diffuse`?"), "{whole}");
    for room in 0..whole.len() + 2 {
        let mut buffer = vec![0x55u8; room + 1];
        assert_eq!(unsafe { oc_last_error(buffer.as_mut_ptr().cast(), room) }, whole.len());
        assert_eq!(buffer[room], 0x55, "not a byte beyond the room");
        if room > 0 {
            let text = CStr::from_bytes_until_nul(&buffer).expect("a closing 0").to_str().expect("whole characters");
            assert!(whole.starts_with(text) && text.len() + 4 >= room.min(whole.len()));
        }
    }
    assert_eq!(unsafe { oc_last_error(null_mut(), 0) }, whole.len());
    ok(oc_engine_free(e));
}

/// Lambert with albedo `values[3]`, declared with what `user` points to as its bound.
unsafe extern "C" fn flat(_: *mut c_void, values: *const f32, wo: *const f64, wi: *const f64, out: *mut f64) {
    unsafe {
        let above = *wo.add(2) > 0.0 && *wi.add(2) > 0.0;
        let f = if above { f64::from(*values.add(3)) / std::f64::consts::PI } else { 0.0 };
        out.cast::<[f64; 3]>().write([f; 3]);
    }
}

unsafe extern "C" fn flat_bound(user: *mut c_void, values: *const f32, w: *const f64, out: *mut f64) {
    unsafe {
        let share = *user.cast::<f64>() * f64::from(*values.add(3));
        out.cast::<[f64; 3]>().write([if *w.add(2) > 0.0 { share } else { 0.0 }; 3]);
    }
}

static HONEST: f64 = 1.0;
static BOASTING: f64 = 0.5;

fn flat_closure(name: &CStr, bound: &'static f64, params: &[OcClosureParam]) -> OcClosure {
    OcClosure {
        name: name.as_ptr(),
        doc: null(),
        source: null(),
        params: params.as_ptr(),
        param_count: params.len(),
        not_reciprocal: 0,
        transmits: 0,
        f: Some(flat),
        albedo_bound: Some(flat_bound),
        albedo: None,
        sample: None,
        pdf: None,
        user: std::ptr::from_ref(bound).cast_mut().cast(),
    }
}

#[test]
fn closures_of_the_host_layer_and_are_audited() {
    let param = |name: &'static CStr, kind| OcClosureParam {
        name: name.as_ptr(),
        kind,
        keyword: 0,
        default_value: [0.5; 3],
        min: 0.0,
        max: 1.0,
        doc: null(),
    };
    let params = [param(c"N", OC_PARAM_NORMAL), param(c"w", OC_PARAM_FLOAT)];
    let e = engine();
    let register = |closure: &OcClosure| unsafe { oc_register_closure(e, closure) };
    let honest = flat_closure(c"flat", &HONEST, &params);
    ok(register(&honest));
    ok(register(&flat_closure(c"boaster", &BOASTING, &params)));
    assert_eq!(register(&honest), OcStatus::OcErrorRegister, "taken");
    assert_eq!(register(&OcClosure { f: None, ..honest }), OcStatus::OcErrorNull);
    assert_eq!(register(&OcClosure { albedo_bound: None, ..honest }), OcStatus::OcErrorNull);
    assert!(message().contains("albedo_bound"));
    assert_eq!(register(&OcClosure { name: c"2b".as_ptr(), ..honest }), OcStatus::OcErrorRegister);
    assert_eq!(register(&OcClosure { name: c"b".as_ptr(), transmits: 1, ..honest }), OcStatus::OcErrorNull);
    let odd = [param(c"x", 77)];
    assert_eq!(register(&flat_closure(c"odd", &HONEST, &odd)), OcStatus::OcErrorBadValue);

    // With the bound that it declares it is Lambert, alone and below a layer.
    let same = |ours: &str, builtin: &str| {
        let (a, b) = (material(e, ours), material(e, builtin));
        let (x, y) = (shade(a), shade(b));
        let wi: Vec<f32> = (0..30).flat_map(|k| [(k as f32 * 0.2).sin() * 0.6, 0.0, 0.8]).collect();
        let mut results = [[0f32; 120]; 2];
        for (bsdf, out) in [(x, 0), (y, 1)] {
            let (f, pdf) = results[out].split_at_mut(90);
            ok(unsafe { oc_bsdf_eval(bsdf, wi.as_ptr(), 30, f.as_mut_ptr(), pdf.as_mut_ptr()) });
        }
        for (p, q) in results[0].iter().zip(results[1]) {
            assert!((p - q).abs() < 1e-5, "{ours}: {p} for {q}");
        }
        ok(oc_material_audit(a));
        for free in [oc_bsdf_free(x), oc_bsdf_free(y), oc_material_free(a), oc_material_free(b)] {
            ok(free);
        }
    };
    same("Ci = flat(N, 0.7);", "Ci = 0.7 * diffuse(N);");
    same("Ci = sheen(flat(N, 0.7), N, 1, 0.4);", "Ci = sheen(0.7 * diffuse(N), N, 1, 0.4);");
    // One that claims half of what it reflects is found out.
    let boaster = material(e, "Ci = layer(boaster(N, 1), diffuse(N));");
    assert_eq!(oc_material_audit(boaster), OcStatus::OcErrorGains);
    assert!(message().contains("gains energy"), "{}", message());
    ok(oc_material_free(boaster));
    ok(oc_engine_free(e));
}

unsafe extern "C" fn picture(_: *mut c_void, lookup: *const OcLookup, rgba: *mut f32) -> i32 {
    unsafe {
        let lookup = *lookup;
        let name = std::slice::from_raw_parts(lookup.name.cast::<u8>(), lookup.name_len);
        if name != b"a.png" {
            return 0;
        }
        // By how much the first coordinate moves per pixel: known where the host gave it.
        rgba.cast::<[f32; 4]>().write([lookup.s, lookup.t, lookup.globals.time + lookup.changes[0][0], 1.0]);
        1
    }
}

#[test]
fn textures_and_included_files_come_from_the_host() {
    let folder = std::env::temp_dir().join(format!("overcoat-capi-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("half.h"), "#define HALF 0.5\n").expect("written");
    let path = CString::new(folder.to_str().expect("UTF-8")).expect("no 0");
    let e = engine();
    unsafe {
        ok(oc_engine_set_include_dir(e, path.as_ptr()));
        ok(oc_engine_set_host(e, &OcHost { texture: Some(picture), derivatives: 1, user: null_mut() }));
    }
    let m = material(e, "#include \"half.h\"\nCi = HALF * (color) texture(\"a.png\", u, v) * diffuse(N);");
    let missing =
        material(e, "Ci = (color) texture(\"b.png\", u, v, \"missingcolor\", color(0.1, 0.2, 0.3)) * diffuse(N);");
    let mut at = OcGlobals { u: 0.25, v: 0.75, time: 0.25, ..globals() };
    at.differentials.dudx = 0.25;
    let (mut bsdf, mut albedo) = (null_mut(), [0f32; 3]);
    for (m, wanted) in [(m, [0.125, 0.375, 0.25]), (missing, [0.1, 0.2, 0.3]), (m, [0.125, 0.375, 0.25])] {
        ok(unsafe { oc_shade(m, &at, WO.as_ptr(), &mut bsdf) });
        ok(unsafe { oc_bsdf_albedo(bsdf, albedo.as_mut_ptr()) });
        assert_eq!(albedo, wanted);
    }
    std::fs::remove_dir_all(folder).expect("removed");
    for free in [oc_bsdf_free(bsdf), oc_material_free(m), oc_material_free(missing), oc_engine_free(e)] {
        ok(free);
    }
}

#[test]
fn threads_share_materials_and_bsdfs_while_they_change() {
    let e = engine();
    let m = material(e, "surface s(float r = 0.5) { Ci = r * diffuse(N); }").addr();
    let shared = shade(std::ptr::without_provenance_mut(m)).addr();
    std::thread::scope(|scope| {
        for thread in 0..4u32 {
            scope.spawn(move || {
                let (m, shared) = (std::ptr::without_provenance_mut(m), std::ptr::without_provenance_mut(shared));
                let (mut own, mut albedo) = (null_mut(), [0f32; 3]);
                for k in 0..400u32 {
                    if (k + thread) % 50 == 0 {
                        let r = if thread % 2 == 0 { 0.25 } else { 0.5 };
                        ok(unsafe { oc_material_set_float(m, c"r".as_ptr(), r) });
                    }
                    for bsdf in [&mut own, &mut { shared }] {
                        ok(unsafe { oc_shade(m, &globals(), WO.as_ptr(), bsdf) });
                        ok(unsafe { oc_bsdf_albedo(*bsdf, albedo.as_mut_ptr()) });
                        assert!(albedo == [0.25; 3] || albedo == [0.5; 3], "{albedo:?}");
                    }
                }
                ok(oc_bsdf_free(own));
            });
        }
    });
    // Freed by another thread than made it.
    std::thread::spawn(move || {
        ok(oc_bsdf_free(std::ptr::without_provenance_mut(shared)));
        ok(oc_material_free(std::ptr::without_provenance_mut(m)));
    })
    .join()
    .expect("freed");
    ok(oc_engine_free(e));
}

fn run(command: &mut Command) -> String {
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("the program starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{command:?}: {text}\n{}", String::from_utf8_lossy(&output.stderr));
    text
}

/// Where cargo builds, whichever way it was told.
fn target() -> PathBuf {
    let test = std::env::current_exe().expect("a path");
    test.ancestors().find(|p| p.join("CACHEDIR.TAG").exists()).expect("a target directory").to_owned()
}

/// The hosts of `examples/c` compile without a warning, run, and leave valgrind nothing to say; an installed library is
/// found through pkg-config.
#[test]
fn hosts_in_c_and_cpp_run() {
    let (target, root) = (target(), Path::new(env!("CARGO_MANIFEST_DIR")));
    let text = run(Command::new("sh").args(["examples/c/run.sh", "dev"]).env("CARGO_TARGET_DIR", &target));
    assert!(text.contains("gains nothing") && text.contains("did you mean `diffuse`?"), "{text}");
    let folder = target.join("c-hosts");
    for host in ["host_c", "host_cpp"] {
        let valgrind = ["-q", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=definite"];
        run(Command::new("valgrind").args(valgrind).arg(folder.join(host)));
    }
    let found = Command::new("pkg-config")
        .args(["--cflags", "--libs", "overcoat"])
        .env("PKG_CONFIG_PATH", folder.join("lib/pkgconfig"))
        .output()
        .expect("pkg-config starts");
    let flags = String::from_utf8(found.stdout).expect("text");
    let program = folder.join("found_c");
    run(Command::new("cc").arg(root.join("examples/c/host.c")).arg("-o").arg(&program).args(flags.split_whitespace()));
    assert!(run(Command::new(program).env("LD_LIBRARY_PATH", folder.join("lib"))).contains("gains nothing"));
}
