//! The preview renderer: light neither gained nor lost, the same picture every time, sound geometry, safe files.
#![cfg(feature = "cli")]

use glam::Vec3;
use overcoat::Globals;
use overcoat::closure::{Eval, Sample, SampleFlags};
use overcoat::engine::ShadeError;
use overcoat::preview::output::{self, Format};
use overcoat::preview::{
    Control, Environment, Image, Mesh, Pass, RenderError, RenderSettings, Rendered, Scatter, Scene, Stage, Surface,
    View, display, drape_mesh, render, strip,
};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::io::Cursor;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Lambert on one side, Lambert transmission through to the other, and holes: what is known in closed form.
#[derive(Clone, Copy)]
struct Cloth {
    reflect: f32,
    transmit: f32,
    holes: f32,
}

const WHITE: Cloth = Cloth { reflect: 1.0, transmit: 0.0, holes: 0.0 };

struct ClothAt {
    cloth: Cloth,
    n: Vec3,
    wo: Vec3,
}

impl Surface for Cloth {
    type Scatter<'a> = ClothAt;

    fn shade(&self, globals: &Globals, wo: Vec3) -> Result<ClothAt, ShadeError> {
        assert!((globals.n.length() - 1.0).abs() < 1e-4 && (globals.ng.length() - 1.0).abs() < 1e-4);
        assert!(globals.n.dot(wo) > 0.0 && globals.ng.dot(wo) >= 0.0, "normals face the viewer");
        assert!((globals.i + wo).length() < 1e-6);
        assert!((0.0..=1.0).contains(&globals.u) && (0.0..=1.0).contains(&globals.v));
        assert!(globals.dpdu.length() > 1e-6 && globals.dpdu.is_finite());
        Ok(ClothAt { cloth: *self, n: globals.n, wo })
    }

    fn see_through(&self) -> bool {
        self.holes > 0.0
    }
}

impl Scatter for ClothAt {
    fn eval(&self, wi: Vec3) -> Eval {
        let cos = self.n.dot(wi);
        let share = if cos > 0.0 { self.cloth.reflect } else { self.cloth.transmit };
        let v = share * cos.abs() * FRAC_1_PI;
        // Directions are drawn in proportion to what they carry.
        Eval { f_cos: [v; 3], pdf: v }
    }

    fn sample(&self, u: [f32; 3]) -> Option<Sample> {
        let Cloth { reflect, transmit, holes } = self.cloth;
        if u[2] >= reflect + transmit {
            let weight = [1.0; 3];
            let flags = SampleFlags { transmit: true, delta: true, ..SampleFlags::default() };
            let wi = (-self.wo).to_array();
            return (u[2] < reflect + transmit + holes).then_some(Sample {
                wi,
                f_cos: [holes; 3],
                pdf: holes,
                weight,
                flags,
                eta: 1.0,
                roughness: 0.0,
            });
        }
        let n = if u[2] < reflect { self.n } else { -self.n };
        let (t, b) = n.any_orthonormal_pair();
        let (r, phi) = (u[0].sqrt(), u[1] * TAU);
        let wi = t * (r * phi.cos()) + b * (r * phi.sin()) + n * (1.0 - u[0]).sqrt();
        let Eval { f_cos, pdf } = self.eval(wi);
        let flags = SampleFlags { transmit: n.dot(self.n) < 0.0, ..SampleFlags::default() };
        (pdf > 0.0).then_some(Sample {
            wi: wi.to_array(),
            f_cos,
            pdf,
            weight: [1.0; 3],
            flags,
            eta: 1.0,
            roughness: 1.0,
        })
    }

    fn emission(&self) -> [f32; 3] {
        [0.0; 3]
    }

    fn straight(&self) -> [f32; 3] {
        [self.cloth.holes; 3]
    }
}

fn settings(scene: Scene, size: u32, spp: u32) -> RenderSettings {
    RenderSettings { scene, width: size, height: size, spp, threads: 2, ..RenderSettings::default() }
}

fn shown(surface: &impl Surface, settings: &RenderSettings) -> Rendered {
    let rendered = render(surface, settings, Control::quiet()).expect("a picture");
    assert_eq!(rendered.stats.invalid, 0);
    assert!(rendered.image.data().iter().all(|c| c.is_finite() && *c >= 0.0));
    rendered
}

#[test]
fn a_white_sphere_vanishes_in_the_furnace() {
    let leaky = Cloth { reflect: 0.5, transmit: 0.3, holes: 0.2 };
    for cloth in [WHITE, leaky] {
        // Light inside the sphere needs many bounces to get out.
        let settings = RenderSettings { max_depth: 400, ..settings(Scene::Furnace, 24, 16) };
        for value in shown(&cloth, &settings).image.data() {
            assert!((value - 1.0).abs() < 1e-3, "{value}");
        }
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    for scene in [Scene::Sphere, Scene::Ball, Scene::Drape] {
        let one = shown(&WHITE, &RenderSettings { threads: 1, ..settings(scene, 20, 4) });
        let two = shown(&WHITE, &RenderSettings { threads: 2, ..settings(scene, 20, 4) });
        assert_eq!(one.image.data(), two.image.data());
        assert_eq!((one.stats.rays, one.stats.samples), (two.stats.rays, two.stats.samples));
        let other = shown(&WHITE, &RenderSettings { seed: 1, ..settings(scene, 20, 4) });
        assert_ne!(one.image.data(), other.image.data());
    }
}

#[test]
fn sampling_the_light_changes_only_the_noise() {
    let gauze = Cloth { reflect: 0.3, transmit: 0.2, holes: 0.4 };
    for (scene, cloth) in [(Scene::Sphere, WHITE), (Scene::Sphere, gauze), (Scene::Drape, gauze)] {
        let both = settings(scene, 16, 256);
        let bsdf_only = RenderSettings { sample_env: false, spp: 4096, ..both.clone() };
        let (a, b) = (shown(&cloth, &both).image.mean(), shown(&cloth, &bsdf_only).image.mean());
        for c in 0..3 {
            assert!((a[c] / b[c] - 1.0).abs() < 0.01, "{scene:?}: {a:?} {b:?}");
        }
    }
}

#[test]
fn passes_add_up_to_the_picture() {
    let stage = Stage::new(&settings(Scene::Ball, 16, 8)).expect("a stage");
    let whole = stage.render(&WHITE, Control::quiet()).expect("a picture").image;
    let pass = |samples| {
        let pass = Pass { width: 16, height: 16, view: View::default(), seed: 0, samples };
        stage.pass(&WHITE, &pass, Control::quiet()).expect("a picture").image
    };
    let (first, rest) = (pass(0..3), pass(3..8));
    for ((a, b), all) in first.data().iter().zip(rest.data()).zip(whole.data()) {
        assert!(((3.0 * a + 5.0 * b) / 8.0 - all).abs() < 1e-4, "{a} {b} {all}");
    }
    let none = Pass { width: 16, height: 16, view: View::default(), seed: 0, samples: 3..3 };
    assert!(stage.pass(&WHITE, &none, Control::quiet()).is_err());
}

#[test]
fn a_scene_is_seen_from_all_around_and_never_from_below_the_floor() {
    let look = |scene, turn: f32, rise: f32, distance: f32, [x, y]: [f32; 2]| {
        let view = View { turn, rise, distance };
        let pass = Pass { width: 16, height: 16, view, seed: 0, samples: 0..1 };
        Stage::new(&settings(scene, 16, 1)).expect("a stage").point(&pass, x, y)
    };
    let middle = [0.5, 0.5];
    for scene in [Scene::Sphere, Scene::Ball, Scene::Drape, Scene::Furnace] {
        let front = look(scene, 0.0, 0.0, 1.0, middle).expect("the subject");
        assert!(front.n.dot(front.i) < 0.0 && (front.n.length() - 1.0).abs() < 1e-4);
        let side = look(scene, 1.0, 0.0, 1.0, middle).expect("the subject");
        let level = |i: Vec3| Vec3::new(i.x, 0.0, i.z).normalize();
        assert!((level(front.i).dot(level(side.i)) - 1f32.cos()).abs() < 1e-3, "{scene:?}");
        let above = look(scene, 0.0, 9.0, 1.0, middle).expect("the subject");
        assert!(above.i.y < -0.99 && above.i.is_finite());
        let below = look(scene, 0.0, -9.0, 1.0, middle).expect("the subject");
        assert!(if scene == Scene::Furnace { below.i.y > 0.99 } else { below.i.y < 0.2 }, "{scene:?}: {}", below.i);
        assert!(look(scene, 0.0, 0.0, 1.0, [0.02, 0.02]).is_none());
    }
    // Closer is larger.
    let corner = [0.2, 0.2];
    assert!(look(Scene::Furnace, 0.0, 0.0, 1.0, corner).is_none());
    assert!(look(Scene::Furnace, 0.0, 0.0, 0.4, corner).is_some());
}

/// A small bright patch, a black half, bad values.
fn lopsided() -> Environment {
    let (width, height) = (32, 16);
    let mut pixels: Vec<Vec3> = (0..width * height)
        .map(|i| if i / width < height / 2 { Vec3::splat(0.1 + (i % 7) as f32) } else { Vec3::ZERO })
        .collect();
    pixels[3 * width + 5] = Vec3::splat(500.0);
    pixels[4 * width] = Vec3::new(f32::NAN, -3.0, 2.0);
    pixels[5 * width + 31] = Vec3::new(f32::INFINITY, 1.0, f32::NEG_INFINITY);
    Environment::from_pixels(width, height, pixels)
}

/// Midpoints of a fine lat-long grid and their solid angles.
fn directions() -> impl Iterator<Item = (Vec3, f64)> {
    const ROWS: usize = 800;
    (0..ROWS * 2 * ROWS).map(|i| {
        let theta = PI * ((i / (2 * ROWS)) as f32 + 0.5) / ROWS as f32;
        let phi = PI * ((i % (2 * ROWS)) as f32 + 0.5) / ROWS as f32;
        let dir = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        (dir, f64::from(theta.sin()) * (std::f64::consts::PI / ROWS as f64).powi(2))
    })
}

#[test]
fn environment_density_integrates_to_one_and_covers_all_light() {
    let env = lopsided();
    let mut total = 0.0;
    for (dir, solid) in directions() {
        let (radiance, pdf) = env.look(dir);
        assert!(radiance.is_finite() && radiance.min_element() >= 0.0);
        assert!(pdf > 0.0 || radiance == Vec3::ZERO, "{dir}: light without density");
        total += f64::from(pdf) * solid;
    }
    assert!((total - 1.0).abs() < 5e-3, "{total}");
}

#[test]
fn environment_samples_carry_their_own_density_and_radiance() {
    let env = lopsided();
    let (mut sum, mut count) = (0.0, 0);
    for i in 0..10_000u32 {
        let u = [sobol_burley::sample(i, 0, 3), sobol_burley::sample(i, 1, 3)];
        let sample = env.sample(u).expect("there is light");
        assert!((sample.dir.length() - 1.0).abs() < 1e-5);
        let agree = (env.pdf(sample.dir) / sample.pdf - 1.0).abs() < 1e-3;
        // On a border between pixels, rounding may tip a direction into the neighbour.
        count += usize::from(!agree);
        sum += f64::from(sample.radiance.y / sample.pdf);
    }
    assert!(count < 20, "{count}");
    let expected: f64 = directions().map(|(dir, solid)| f64::from(env.radiance(dir).y) * solid).sum();
    let estimate = sum / 10_000.0;
    assert!((estimate / expected - 1.0).abs() < 0.01, "{estimate} {expected}");
    assert!(Environment::from_pixels(2, 2, vec![Vec3::ZERO; 4]).sample([0.5, 0.5]).is_none());
}

/// A picture whose header claims more pixels than any memory holds is an error, and nothing is set aside for it.
#[test]
fn environments_that_claim_too_much_are_refused() {
    let claim = |width: i32, height: i32| {
        let mut file = Cursor::new(Vec::new());
        image::DynamicImage::from(image::Rgb32FImage::new(4, 2))
            .write_to(&mut file, image::ImageFormat::OpenExr)
            .unwrap();
        let mut bytes = file.into_inner();
        // An attribute is its name, its type, its size and its numbers.
        let mut set = |name: &str, first: usize, numbers: &[i32]| {
            let at = bytes.windows(name.len()).position(|w| w == name.as_bytes()).expect("an attribute");
            for (k, number) in numbers.iter().enumerate() {
                let at = at + name.len() + 4 + 4 * (first + k);
                bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
            }
        };
        // The last pixel, inclusive, and how many tiles that makes.
        set("dataWindow\0box2i\0", 2, &[width - 1, height - 1]);
        set("displayWindow\0box2i\0", 2, &[width - 1, height - 1]);
        let tiles = (width as u64).div_ceil(64) * (height as u64).div_ceil(64);
        set("chunkCount\0int\0", 0, &[tiles as i32]);
        Environment::from_bytes(&bytes, 1 << 30).err()
    };
    assert_eq!(claim(4, 2), None);
    let refused = claim(100_000, 50_000).expect("60 GB");
    assert!(refused.contains("100000×50000 pixels is beyond the limit"), "{refused}");
    for (width, height) in [(i32::MAX, i32::MAX), (i32::MAX, 2), (4, i32::MAX)] {
        assert!(claim(width, height).is_some(), "{width}×{height}");
    }
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 50000 +X 100000\n";
    let refused = Environment::from_bytes(hdr, 1 << 30).err().expect("60 GB");
    assert!(refused.contains("beyond the limit"), "{refused}");
}

fn drape() -> &'static Mesh {
    static MESH: OnceLock<Mesh> = OnceLock::new();
    MESH.get_or_init(|| drape_mesh(128))
}

#[test]
fn the_drape_is_a_sound_mesh() {
    let vertices = drape().vertices();
    for v in vertices {
        assert!(v.p.is_finite() && v.dpdu.is_finite() && v.dpdv.is_finite());
        assert!((v.n.length() - 1.0).abs() < 1e-4);
        assert!((0.0..=1.0).contains(&v.u) && (0.0..=1.0).contains(&v.v));
        assert!(v.dpdu.normalize().dot(v.n).abs() < 1e-3, "dPdu lies in the surface");
        assert!(v.dpdu.cross(v.dpdv).dot(v.n) > 0.0, "dPdu × dPdv is the front");
        assert!(v.p.y > 0.0, "above the floor");
    }
    for triangle in drape().triangles() {
        let [a, b, c] = triangle.map(|i| vertices[i as usize]);
        let cross = (b.p - a.p).cross(c.p - a.p);
        assert!(cross.length() > 1e-6, "degenerate at ({}, {})", a.u, a.v);
        assert!(cross.normalize().dot(a.n) > 0.0, "winding at ({}, {})", a.u, a.v);
    }
}

#[test]
fn the_drapes_tangent_follows_the_warp() {
    let vertices = drape().vertices();
    for triangle in drape().triangles() {
        let [a, b, c] = triangle.map(|i| vertices[i as usize]);
        // The gradient of P by u from the corners.
        let (du1, dv1, du2, dv2) = (b.u - a.u, b.v - a.v, c.u - a.u, c.v - a.v);
        let along = ((b.p - a.p) * dv2 - (c.p - a.p) * dv1) / (du1 * dv2 - du2 * dv1);
        let middle = a.dpdu + b.dpdu + c.dpdu;
        assert!(along.normalize().dot(middle.normalize()) > 0.9, "at ({}, {})", a.u, a.v);
    }
}

#[test]
fn the_drape_hardly_stretches_and_has_folds() {
    let lengths: Vec<f32> = drape().vertices().iter().map(|v| v.dpdu.length()).collect();
    let mean = lengths.iter().sum::<f32>() / lengths.len() as f32;
    let off = lengths.iter().filter(|l| (*l / mean - 1.0).abs() > 0.2).count();
    assert!(off * 50 < lengths.len(), "{off} of {} stretched", lengths.len());
    // Along the hem the cloth rises and falls.
    let hem: Vec<f32> = drape().vertices().iter().filter(|v| v.v == 0.0).map(|v| v.p.y).collect();
    assert!(hem.iter().cloned().fold(0.0, f32::max) > 0.2 && hem[0] < 0.1);
}

#[test]
fn progress_is_told_and_a_render_can_be_stopped() {
    let (calls, last) = (AtomicU64::new(0), AtomicU64::new(0));
    let progress = |done: u64, total: u64| {
        assert!(done <= total);
        calls.fetch_add(1, Ordering::Relaxed);
        last.fetch_max(done, Ordering::Relaxed);
    };
    let stage = Stage::new(&settings(Scene::Sphere, 12, 1)).expect("a stage");
    stage.render(&WHITE, Control { progress: &progress, cancel: &AtomicBool::new(false) }).expect("a picture");
    assert_eq!((calls.into_inner(), last.into_inner()), (12, 12));
    let stopped = stage.render(&WHITE, Control { cancel: &AtomicBool::new(true), ..Control::quiet() });
    assert!(matches!(stopped, Err(RenderError::Cancelled)));
}

#[test]
fn wrong_settings_are_named() {
    let message = |s: RenderSettings| Stage::new(&s).err().expect("an error").to_string();
    let base = RenderSettings::default();
    assert!(message(RenderSettings { width: 0, ..base.clone() }).contains("0×512"));
    assert!(message(RenderSettings { width: 99_999, ..base.clone() }).contains("16384"));
    assert!(message(RenderSettings { spp: 0, ..base.clone() }).contains("samples"));
    assert!(message(RenderSettings { max_depth: 0, ..base.clone() }).contains("depth"));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sky.hdr");
    let with = |path: &std::path::Path| message(RenderSettings { env: Some(path.to_owned()), ..base.clone() });
    assert!(with(&path).contains("sky.hdr"));
    std::fs::write(&path, b"neither one nor the other").expect("a file");
    assert!(with(&path).contains("sky.hdr"));
    let png = folder.path().join("sky.png");
    output::save(&Image::filled(8, 4, [0.5; 3]), &png, 0.0).expect("saved");
    assert!(with(&png).contains("HDR"));
}

#[test]
fn an_exr_lights_the_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("white.exr");
    output::save(&Image::filled(8, 4, [1.0; 3]), &path, 0.0).expect("saved");
    let lit = RenderSettings { env: Some(path), ..settings(Scene::Sphere, 8, 64) };
    let image = shown(&WHITE, &lit).image;
    // High on the sphere a white surface sees mostly light, some of it reflected by the floor.
    let top = image.pixel(4, 2)[1];
    assert!(top > 0.8 && top < 1.02, "{top}");
}

#[test]
fn exr_round_trip_is_exact() {
    let data: Vec<f32> = (0..7 * 5 * 3).map(|i| (i as f32 * 0.37).sin().abs() * 10f32.powi(i % 9 - 4)).collect();
    let image = Image::from_vec(7, 5, data.clone()).expect("sizes agree");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("picture.EXR");
    output::save(&image, &path, 3.0).expect("saved");
    let bytes = std::fs::read(&path).expect("a file");
    let read = image::load_from_memory_with_format(&bytes, image::ImageFormat::OpenExr).expect("an EXR").into_rgb32f();
    assert_eq!((read.width(), read.height(), read.into_raw()), (7, 5, data));
}

#[test]
fn a_failed_save_leaves_the_old_file() {
    let image = Image::filled(4, 4, [0.5; 3]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("picture.png");
    output::save(&image, &path, 0.0).expect("saved");
    let old = std::fs::read(&path).expect("a file");

    // No pixels make no PNG.
    let empty = Image::filled(0, 0, [0.0; 3]);
    assert!(output::save(&empty, &path, 0.0).is_err());
    assert_eq!(std::fs::read(&path).expect("still there"), old);

    assert!(output::save(&image, &folder.path().join("picture.jpg"), 0.0).is_err());
    let nowhere = output::save(&image, &folder.path().join("no/such/picture.png"), 0.0).expect_err("no folder");
    assert!(nowhere.to_string().contains("picture.png"), "{nowhere}");
    let directory = folder.path().join("directory.png");
    std::fs::create_dir(&directory).expect("a folder");
    assert!(output::check(&directory).is_err());
    assert_eq!(output::check(&path).expect("writable"), Format::Png);
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").flatten().map(|e| e.file_name()).collect();
    assert_eq!(left.len(), 2, "nothing half-written stays behind: {left:?}");
}

#[cfg(unix)]
#[test]
fn a_picture_has_the_permissions_of_any_new_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let mode = |path: &std::path::Path| std::fs::metadata(path).expect("a file").permissions().mode();
    let plain = folder.path().join("plain");
    std::fs::write(&plain, b"").expect("a file");
    let path = folder.path().join("picture.png");
    output::save(&Image::filled(1, 1, [0.5; 3]), &path, 0.0).expect("saved");
    assert_eq!(mode(&path), mode(&plain));
}

#[test]
fn the_tone_curve_keeps_midtones_and_never_clips_hard() {
    let linear = |x: f32| display([x; 3], 0.0)[0];
    // sRGB of 0.18 is 0.4613.
    assert!((linear(0.18) - 0.4613).abs() < 1e-3);
    assert!((display([0.09; 3], 1.0)[0] - 0.4613).abs() < 1e-3);
    let mut last = -1.0;
    for i in 0..200 {
        let shown = linear(i as f32 * 0.02);
        assert!(shown > last && shown <= 1.0);
        last = shown;
    }
    for odd in [f32::NAN, -1.0, f32::INFINITY] {
        assert!((0.0..=1.0).contains(&linear(odd)), "{odd}");
    }
}

#[test]
fn a_strip_sets_pictures_side_by_side_with_their_texts() {
    let (red, blue) = (Image::filled(64, 64, [1.0, 0.0, 0.0]), Image::filled(64, 32, [0.0, 0.0, 1.0]));
    let both = strip::strip(&[(&red, "r 0.3"), (&blue, "")], 0.0).expect("two pictures");
    assert!(both.width() > 128 && both.height() > 64);
    assert_eq!(both.pixel(10, 10), [1.0, 0.0, 0.0]);
    assert_eq!(both.pixel(both.width() - 10, 10), [0.0, 0.0, 1.0]);
    let written = (64..both.height()).flat_map(|y| (0..64).map(move |x| (x, y)));
    assert!(written.filter(|&(x, y)| both.pixel(x, y)[0] > 0.5).count() > 20, "a text below the first");
    let bare = strip::strip(&[(&red, ""), (&blue, "")], 0.0).expect("two pictures");
    assert_eq!(bare.height(), 64);
    assert!(strip::strip(&[], 0.0).is_none());
}
