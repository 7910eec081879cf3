//! Pictures of a material.
//!
//! In come a [`Surface`] (any [`Material`](crate::Material) is one) and [`RenderSettings`]; out comes an [`Image`] of
//! linear radiance and the [`Stats`] of making it. A [`Stage`] holds what does not depend on the material – geometry,
//! camera, environment – so that a sweep, a comparison or a watched file pays for it once. [`output`] writes pictures,
//! [`strip`] sets several side by side. Nothing here knows what a script or a closure tree is, or which lobes exist.
//!
//! The world is y-up, in arbitrary units in which the sphere's radius is one. The same settings give the same picture,
//! bit for bit, whatever the number of threads.

mod ball;
mod camera;
mod drape;
mod environment;
mod film;
mod image;
mod integrator;
mod label;
mod mesh;
pub mod output;
pub mod plot;
mod sampler;
mod scene;
mod sphere;
pub mod strip;
mod studio;
mod surface;
mod tone;

pub use ball::ball_mesh;
pub use drape::drape_mesh;
pub use environment::Environment;
pub use image::Image;
pub use mesh::{Mesh, Vertex};
pub use studio::lamp;
pub use surface::{Scatter, Surface};
pub use tone::display;

use crate::engine::ShadeError;
use crate::globals::Globals;
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// What the material is shown on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// A sphere on a neutral floor.
    Sphere,
    /// A ball with two grooves on a foot.
    Ball,
    /// A square cloth hanging over a ball, its corners on the floor.
    Drape,
    /// A sphere in uniform white light, without a floor: a lossless white material cannot be seen.
    Furnace,
}

/// Where a scene is seen from, relative to its own point of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Around the vertical, in radians; positive: the viewer goes to the right.
    pub turn: f32,
    /// Upward, in radians. Ends above the floor and short of straight down.
    pub rise: f32,
    /// Times the scene's own distance, 0.25 to 4.
    pub distance: f32,
}

impl Default for View {
    /// The scene's own.
    fn default() -> Self {
        View { turn: 0.0, rise: 0.0, distance: 1.0 }
    }
}

/// Some of the samples of a picture: pictures of one size and view, each weighted by its number of samples, add up to
/// what [`Stage::render`] makes of all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Where the scene is seen from.
    pub view: View,
    /// Same seed, same picture.
    pub seed: u64,
    /// Which of every pixel's samples to take, at least one.
    pub samples: Range<u32>,
}

/// Everything but the material that decides a picture.
#[derive(Clone, Debug)]
pub struct RenderSettings {
    /// What the material is shown on.
    pub scene: Scene,
    /// A lat-long HDR or EXR picture to light the scene; the built-in studio if none. [`Scene::Furnace`] ignores it.
    pub env: Option<PathBuf>,
    /// Camera samples per pixel, at least 1.
    pub spp: u32,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Same seed, same picture.
    pub seed: u64,
    /// Worker threads; 0 means one per core. Never changes the picture.
    pub threads: usize,
    /// In stops, applied on the way to a display only: an EXR keeps the radiance as it is.
    pub exposure: f32,
    /// How many times a path may scatter, at least 1. 1 is direct light only.
    pub max_depth: u32,
    /// Whether the environment is sampled directly besides sampling the BSDF. Off, the picture has the same mean and
    /// more noise.
    pub sample_env: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            scene: Scene::Sphere,
            env: None,
            spp: 64,
            width: 512,
            height: 512,
            seed: 0,
            threads: 0,
            exposure: 0.0,
            max_depth: 8,
            sample_env: true,
        }
    }
}

/// How a caller follows a render and stops it. Both may be used from any thread.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Told how many of how many equal portions are finished; called by worker threads, `done` not always in order.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
    /// Set it to stop: [`Stage::render`] then returns [`RenderError::Cancelled`] within a fraction of a second.
    pub cancel: &'a AtomicBool,
}

impl Control<'static> {
    /// Tells nobody, never stops.
    pub fn quiet() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Control { progress: &|_, _| {}, cancel: &NEVER }
    }
}

/// A finished picture and what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub image: Image,
    /// What it took.
    pub stats: Stats,
}

/// What a render took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stats {
    /// Wall clock, without preparing the stage.
    pub seconds: f64,
    /// Camera paths.
    pub samples: u64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Paths thrown away because they came back NaN, infinite or negative. Anything but 0 is a bug in the material.
    pub invalid: u64,
}

impl Stats {
    /// Adds up the work of several pictures.
    pub fn plus(self, other: Stats) -> Stats {
        Stats {
            seconds: self.seconds + other.seconds,
            samples: self.samples + other.samples,
            rays: self.rays + other.rays,
            invalid: self.invalid + other.invalid,
        }
    }
}

/// Why there is no picture.
#[derive(Debug)]
pub enum RenderError {
    /// A setting is out of range; the text says which.
    Settings(String),
    /// The environment picture cannot be used.
    Environment {
        /// The picture.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The material failed to shade somewhere.
    Shade(ShadeError),
    /// The worker threads could not be started.
    Threads(String),
    /// [`Control::cancel`] was set.
    Cancelled,
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RenderError::Settings(what) => f.write_str(what),
            RenderError::Environment { path, reason } => {
                write!(f, "cannot use `{}` as environment: {reason}", path.display())
            }
            RenderError::Shade(e) => write!(f, "shading failed: {e}"),
            RenderError::Threads(reason) => write!(f, "cannot start the render threads: {reason}"),
            RenderError::Cancelled => f.write_str("the render was stopped"),
        }
    }
}

impl std::error::Error for RenderError {}

/// Prepares a stage and renders one picture on it.
pub fn render<S: Surface>(
    surface: &S,
    settings: &RenderSettings,
    control: Control<'_>,
) -> Result<Rendered, RenderError> {
    Stage::new(settings)?.render(surface, control)
}

/// Geometry, camera and light, ready to show materials.
pub struct Stage {
    settings: RenderSettings,
    world: scene::World,
    pool: rayon::ThreadPool,
}

impl Stage {
    /// Checks the settings, loads the environment and lays out the scene.
    pub fn new(settings: &RenderSettings) -> Result<Stage, RenderError> {
        let environment = match (settings.scene, &settings.env) {
            (Scene::Furnace, _) => Environment::uniform(1.0),
            (_, Some(path)) => {
                Environment::open(path).map_err(|reason| RenderError::Environment { path: path.clone(), reason })?
            }
            (_, None) => studio::environment(),
        };
        Stage::lit_by(environment, settings)
    }

    /// Like [`new`](Self::new), lit by `environment` whatever the settings say.
    pub fn lit_by(environment: Environment, settings: &RenderSettings) -> Result<Stage, RenderError> {
        check(settings)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads)
            .build()
            .map_err(|e| RenderError::Threads(e.to_string()))?;
        Ok(Stage { settings: settings.clone(), world: scene::World::new(settings.scene, environment), pool })
    }

    /// Shows one material.
    pub fn render<S: Surface>(&self, surface: &S, control: Control<'_>) -> Result<Rendered, RenderError> {
        let RenderSettings { width, height, seed, spp, .. } = self.settings;
        self.pass(surface, &Pass { width, height, view: View::default(), seed, samples: 0..spp }, control)
    }

    /// Shows one material from anywhere, with some of the samples: for pictures that refine while they are looked at.
    /// Of the stage's settings it uses neither size nor seed nor number of samples.
    ///
    /// # Errors
    /// As for [`render`](Self::render).
    pub fn pass<S: Surface>(&self, surface: &S, pass: &Pass, control: Control<'_>) -> Result<Rendered, RenderError> {
        check_size(pass.width, pass.height)?;
        if pass.samples.is_empty() {
            return Err(RenderError::Settings("a pass without samples".into()));
        }
        let start = Instant::now();
        let tracer = integrator::Tracer::new(&self.world, surface, &self.settings);
        let camera = self.camera(pass);
        let (image, tally) = self.pool.install(|| film::expose(pass, &camera, &tracer, control))?;
        let stats = Stats {
            seconds: start.elapsed().as_secs_f64(),
            samples: pass.samples.len() as u64 * u64::from(image.width()) * u64::from(image.height()),
            rays: tally.rays,
            invalid: tally.invalid,
        };
        Ok(Rendered { image, stats })
    }

    /// What is seen at a place of the picture, `x` and `y` from 0 to 1 from the upper left corner: the shading point,
    /// its normals toward the viewer. `None` beside the subject.
    pub fn point(&self, pass: &Pass, x: f32, y: f32) -> Option<Globals> {
        let ray = self.camera(pass).ray(x, y);
        match self.world.hit(ray) {
            scene::Hit::Subject(point) => Some(integrator::face(&point, -ray.dir).0),
            scene::Hit::Floor { .. } | scene::Hit::Nothing => None,
        }
    }

    fn camera(&self, pass: &Pass) -> camera::Camera {
        scene::camera(self.settings.scene, pass.view, pass.width as f32 / pass.height as f32)
    }
}

/// The largest width or height, in pixels.
pub const MAX_SIZE: u32 = 16_384;
/// The most pixels of one picture.
pub const MAX_PIXELS: u64 = 1 << 26;

fn check_size(width: u32, height: u32) -> Result<(), RenderError> {
    let wrong = |what: String| Err(RenderError::Settings(what));
    if width == 0 || height == 0 || width > MAX_SIZE || height > MAX_SIZE {
        return wrong(format!("a picture of {width}×{height} pixels: each side must lie in 1 to {MAX_SIZE}"));
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return wrong(format!("a picture of {width}×{height} pixels is larger than {MAX_PIXELS} pixels"));
    }
    Ok(())
}

fn check(s: &RenderSettings) -> Result<(), RenderError> {
    let wrong = |what: String| Err(RenderError::Settings(what));
    check_size(s.width, s.height)?;
    if s.spp == 0 {
        return wrong("0 samples per pixel: at least 1 is needed".into());
    }
    if s.max_depth == 0 {
        return wrong("a path depth of 0 shows no light: at least 1 is needed".into());
    }
    if s.threads > 1024 {
        return wrong(format!("{} threads: at most 1024", s.threads));
    }
    Ok(())
}
