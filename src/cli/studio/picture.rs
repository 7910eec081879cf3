//! A picture that refines while it is looked at.
//!
//! First a small one with a sample a pixel, then the whole size with more and more samples, each sent as 8-bit RGBA. It
//! ends when all samples are in, or the page asks for another.

use super::http::{Refusal, Stream};
use super::hush::Resting;
use super::material::{Compiled, Script};
use super::server::guarded;
use super::workshop::Workshop;
use crate::preview::{Control, Image, Pass, RenderError, Rendered, Scene, Stage, View, display};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Pixels of the first, small picture: what is there within a few hundredths of a second.
const FIRST_PIXELS: f64 = 24_000.0;
/// The longest a pass should take, in seconds: how long a viewer waits for the next improvement.
const PASS_SECONDS: f64 = 0.35;
const MAX_SIDE: u32 = 2048;
const MAX_SAMPLES: u32 = 4096;

/// Where and how a material is shown.
pub struct Scenery {
    pub stage: Arc<Stage>,
    pub pass: Pass,
}

impl Scenery {
    pub fn read(workshop: &Workshop, body: &Value) -> Result<Scenery, Refusal> {
        let scene = match body["scene"].as_str() {
            None | Some("sphere") => Scene::Sphere,
            Some("ball") => Scene::Ball,
            Some("drape") => Scene::Drape,
            Some("furnace") => Scene::Furnace,
            Some(other) => return Err(Refusal::bad(format!("there is no scene `{other}`"))),
        };
        let number = |key: &str, default: f64| body[key].as_f64().filter(|x| x.is_finite()).unwrap_or(default);
        let side = |key: &str| (number(key, 320.0) as u32).clamp(8, MAX_SIDE);
        let view = View {
            turn: number("turn", 0.0) as f32,
            rise: number("rise", 0.0) as f32,
            distance: number("distance", 1.0) as f32,
        };
        let stage = workshop.stage(scene, body["light"].as_str().unwrap_or("studio"))?;
        let samples = (number("samples", 64.0) as u32).clamp(1, MAX_SAMPLES);
        let pass = Pass { width: side("width"), height: side("height"), view, seed: 0, samples: 0..samples };
        Ok(Scenery { stage, pass })
    }
}

/// What the page asks for.
pub struct Wish {
    script: Script,
    scenery: Scenery,
    exposure: f32,
    stop: Arc<AtomicBool>,
    started: Instant,
}

impl Wish {
    pub fn read(workshop: &Workshop, body: &Value) -> Result<Wish, Refusal> {
        let started = Instant::now();
        let script = Script::read(body)?;
        let slot = format!("picture {}", body["slot"].as_str().unwrap_or(""));
        // Before anything that takes time: what is under way is out of date.
        let stop = workshop.begin(&slot);
        let exposure = body["exposure"].as_f64().map_or(0.0, |x| x.clamp(-10.0, 10.0) as f32);
        Ok(Wish { script, scenery: Scenery::read(workshop, body)?, exposure, stop, started })
    }
}

/// Compiles, tells, and shows.
pub fn show(workshop: &Workshop, wish: &Wish, mut stream: Stream<'_>) {
    guarded(&mut stream, |stream| {
        let compiled: Arc<Compiled> = workshop.material(&wish.script);
        if stream.send(&compiled.told(), &[]).is_err() {
            return;
        }
        let Some(material) = compiled.material() else { return };
        let material = Resting { material, hush: &workshop.hush };
        if let Err(Stopped::Failed(message)) = refine(&material, wish, stream) {
            let _ = stream.send(&json!({ "kind": "failed", "message": message }), &[]);
        }
    });
}

/// Why a picture is not finished.
enum Stopped {
    /// Nobody waits for it any more.
    Unwanted,
    Failed(String),
}

fn refine(material: &Resting<'_>, wish: &Wish, stream: &mut Stream<'_>) -> Result<(), Stopped> {
    let whole = &wish.scenery.pass;
    let pixels = f64::from(whole.width) * f64::from(whole.height);
    let shrink = (pixels / FIRST_PIXELS).sqrt();
    if shrink > 1.2 {
        let side = |x: u32| ((f64::from(x) / shrink) as u32).max(4);
        let small = Pass { width: side(whole.width), height: side(whole.height), samples: 0..1, ..whole.clone() };
        let first = expose(material, wish, &small)?;
        send(&first.image, wish, [0, whole.samples.end], stream)?;
    }
    let mut sum = vec![0.0f32; 3 * whole.width as usize * whole.height as usize];
    let (mut done, mut count) = (0, 1);
    while done < whole.samples.end {
        let samples = done..(done + count).min(whole.samples.end);
        let taken = samples.len() as f32;
        let pass = expose(material, wish, &Pass { samples: samples.clone(), ..whole.clone() })?;
        done = samples.end;
        sum.par_iter_mut().zip(pass.image.data()).for_each(|(sum, x)| *sum += x * taken);
        let mean: Vec<f32> = sum.par_iter().map(|x| x / done as f32).collect();
        let Some(image) = Image::from_vec(whole.width, whole.height, mean) else { return Err(Stopped::Unwanted) };
        send(&image, wish, [done, whole.samples.end], stream)?;
        // As many again, as long as that does not take too long.
        let affordable = PASS_SECONDS / (pass.stats.seconds / f64::from(samples.len() as u32)).max(1e-6);
        count = done.min(affordable as u32).max(1);
    }
    Ok(())
}

fn expose(material: &Resting<'_>, wish: &Wish, pass: &Pass) -> Result<Rendered, Stopped> {
    let control = Control { progress: &|_, _| {}, cancel: &wish.stop };
    wish.scenery.stage.pass(material, pass, control).map_err(|e| match e {
        RenderError::Cancelled => Stopped::Unwanted,
        other => Stopped::Failed(other.to_string()),
    })
}

fn send(image: &Image, wish: &Wish, [samples, of]: [u32; 2], stream: &mut Stream<'_>) -> Result<(), Stopped> {
    if wish.stop.load(Ordering::Relaxed) {
        return Err(Stopped::Unwanted);
    }
    let mut bytes = vec![255u8; 4 * image.width() as usize * image.height() as usize];
    bytes.par_chunks_mut(4 * image.width() as usize).zip(image.data().par_chunks(3 * image.width() as usize)).for_each(
        |(row, values)| {
            for (pixel, rgb) in row.chunks_exact_mut(4).zip(values.chunks_exact(3)) {
                let shown = display([rgb[0], rgb[1], rgb[2]], wish.exposure);
                pixel[..3].copy_from_slice(&shown.map(|c| (c * 255.0 + 0.5) as u8));
            }
        },
    );
    let head = json!({
        "kind": "frame", "width": image.width(), "height": image.height(), "samples": samples, "of": of,
        "milliseconds": wish.started.elapsed().as_secs_f64() * 1e3,
    });
    stream.send(&head, &bytes).map_err(|_| Stopped::Unwanted)
}
