//! `overcoat render`.

use super::input::name_and_value;
use super::{Failure, Global, Outcome, output};
use crate::engine::{Material, Shader};
use crate::preview::output::{check, save};
use crate::preview::{Control, Image, RenderError, RenderSettings, Scene, Stage, Stats, strip};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use notify::{EventKind, RecursiveMode, Watcher};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

#[derive(Args, Debug)]
pub struct RenderArgs {
    /// The script; `-` reads stdin.
    file: PathBuf,
    /// The picture; its name ends in .png or .exr.
    #[arg(long, short)]
    output: PathBuf,
    /// What the material is shown on.
    #[arg(long, value_enum, default_value = "sphere")]
    scene: SceneArg,
    /// A lat-long HDR or EXR picture that lights the scene, in place of the built-in studio.
    #[arg(long, value_name = "PICTURE")]
    env: Option<PathBuf>,
    /// Samples per pixel.
    #[arg(long, default_value_t = 64)]
    spp: u32,
    /// Pixels: one number for a square, or WIDTHxHEIGHT; of each picture in a strip.
    #[arg(long, default_value = "512", value_name = "SIZE")]
    size: String,
    /// Same seed, same picture, whatever the number of threads.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Worker threads; 0: one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Brightness in stops; a PNG only, an EXR keeps the radiance.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_name = "STOPS")]
    exposure: f32,
    /// Most times a path scatters.
    #[arg(long, default_value_t = 8)]
    depth: u32,
    /// Render again whenever a script changes, until interrupted.
    #[arg(long)]
    watch: bool,
    /// A second script, shown beside the first.
    #[arg(long, value_name = "OTHER", conflicts_with = "sweep")]
    compare: Option<PathBuf>,
    /// A strip of pictures, one per value: `roughness=0.15,0.25,0.4`; colors are separated by `;`.
    #[arg(long, value_name = "NAME=VALUES")]
    sweep: Option<String>,
}

impl RenderArgs {
    /// Small pictures for a gallery.
    pub(super) fn small(file: &Path, output: &Path, sweep: Option<String>) -> Self {
        RenderArgs {
            file: file.to_owned(),
            output: output.to_owned(),
            scene: SceneArg::Sphere,
            env: None,
            spp: 64,
            size: "120".into(),
            seed: 0,
            threads: 0,
            exposure: 0.0,
            depth: 8,
            watch: false,
            compare: None,
            sweep,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum SceneArg {
    /// A sphere on a neutral floor.
    Sphere,
    /// A ball with two grooves on a foot.
    Ball,
    /// A cloth hanging over a ball.
    Drape,
    /// A sphere in uniform white light: a lossless white material cannot be seen.
    Furnace,
}

impl SceneArg {
    pub(super) fn scene(self) -> Scene {
        match self {
            SceneArg::Sphere => Scene::Sphere,
            SceneArg::Ball => Scene::Ball,
            SceneArg::Drape => Scene::Drape,
            SceneArg::Furnace => Scene::Furnace,
        }
    }
}

pub fn run(global: &Global, args: &RenderArgs) -> Outcome {
    let settings = settings(args)?;
    check(&args.output).map_err(|e| Failure::usage(e.to_string()))?;
    let stage = Stage::new(&settings).map_err(render_failed)?;
    if args.watch {
        return watch(global, args, &stage);
    }
    once(global, args, &stage, &AtomicBool::new(false))
}

fn settings(args: &RenderArgs) -> Result<RenderSettings, Failure> {
    let (width, height) = size(&args.size)?;
    if !args.exposure.is_finite() {
        return Err(Failure::usage(format!("--exposure {}: expected a number of stops", args.exposure)));
    }
    Ok(RenderSettings {
        scene: args.scene.scene(),
        env: args.env.clone(),
        spp: args.spp,
        width,
        height,
        seed: args.seed,
        threads: args.threads,
        exposure: args.exposure,
        max_depth: args.depth,
        ..RenderSettings::default()
    })
}

fn size(text: &str) -> Result<(u32, u32), Failure> {
    let parsed = match text.split_once(['x', '×']) {
        Some((w, h)) => w.trim().parse().ok().zip(h.trim().parse().ok()),
        None => text.trim().parse().ok().map(|n| (n, n)),
    };
    parsed.ok_or_else(|| Failure::usage(format!("--size {text}: expected pixels, as in 512 or 640x360")))
}

pub(super) fn render_failed(e: RenderError) -> Failure {
    match e {
        RenderError::Shade(e) => Failure::from(e),
        other => Failure::usage(other.to_string()),
    }
}

/// Compiles, renders and saves one picture or strip.
fn once(global: &Global, args: &RenderArgs, stage: &Stage, cancel: &AtomicBool) -> Outcome {
    let panels = panels(global, args)?;
    let bar = progress_bar(global, panels.len());
    let mut pictures = Vec::new();
    let mut stats = Stats::default();
    for (index, (material, label)) in panels.iter().enumerate() {
        // Every picture fills its share of the bar.
        let progress = |done: u64, total: u64| {
            let share = BAR_STEPS / panels.len() as u64;
            bar.set_position(index as u64 * share + done * share / total.max(1));
        };
        let rendered = stage.render(material, Control { progress: &progress, cancel }).map_err(|e| {
            bar.finish_and_clear();
            render_failed(e)
        })?;
        stats = stats.plus(rendered.stats);
        pictures.push((rendered.image, label.clone()));
    }
    bar.finish_and_clear();
    let picture = assemble(pictures, args.exposure);
    save(&picture, &args.output, args.exposure).map_err(|e| Failure::usage(e.to_string()))?;
    report(global, args, &picture, &stats)
}

fn assemble(mut pictures: Vec<(Image, String)>, exposure: f32) -> Image {
    let labelled: Vec<(&Image, &str)> = pictures.iter().map(|(image, label)| (image, label.as_str())).collect();
    match strip::strip(&labelled, exposure) {
        Some(strip) if pictures.len() > 1 => strip,
        _ => pictures.swap_remove(0).0,
    }
}

/// The materials to show, each with its label.
fn panels(global: &Global, args: &RenderArgs) -> Result<Vec<(Material, String)>, Failure> {
    let shader = global.shader(&args.file)?;
    if let Some(other) = &args.compare {
        let shaders = [shader, global.shader(other)?];
        let set = global.shared_set(&shaders)?;
        let paths = [&args.file, other];
        return shaders
            .iter()
            .zip(set)
            .zip(paths)
            .map(|((shader, set), path)| Ok((Global { set, ..global.clone() }.specialise(shader, &[])?, stem(path))))
            .collect();
    }
    let Some(sweep) = &args.sweep else {
        return Ok(vec![(global.specialise(&shader, &[])?, String::new())]);
    };
    let (name, values) = name_and_value(sweep)?;
    let separator = if values.contains(';') { ';' } else { ',' };
    let panel = |value: &str| {
        let value = value.trim().to_owned();
        let label = format!("{name} {value}");
        Ok((global.specialise(&shader, &[(name.clone(), value)])?, label))
    };
    values.split(separator).map(panel).collect()
}

impl Global {
    /// The settings of `--set` for each of several shaders: those it has a parameter for. One that none has is an
    /// error.
    fn shared_set(&self, shaders: &[Shader; 2]) -> Result<[Vec<String>; 2], Failure> {
        let has = |shader: &Shader, name: &str| shader.params().iter().any(|p| p.name == name);
        for given in &self.set {
            let (name, _) = name_and_value(given)?;
            if !shaders.iter().any(|s| has(s, &name)) {
                return Err(Failure::usage(format!("--set {given}: neither shader has a parameter `{name}`")));
            }
        }
        let of = |shader: &Shader| {
            let known = |given: &&String| name_and_value(given).is_ok_and(|(name, _)| has(shader, &name));
            self.set.iter().filter(known).cloned().collect()
        };
        Ok([of(&shaders[0]), of(&shaders[1])])
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "stdin".into(), |s| s.to_string_lossy().into_owned())
}

const BAR_STEPS: u64 = 10_000;

/// With the time left; only where someone watches a terminal.
fn progress_bar(global: &Global, panels: usize) -> ProgressBar {
    let target = if global.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(Some(BAR_STEPS / panels as u64 * panels as u64), target);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {eta} left") {
        bar.set_style(style);
    }
    bar
}

fn report(global: &Global, args: &RenderArgs, picture: &Image, stats: &Stats) -> Outcome {
    if stats.invalid > 0 {
        eprintln!("warning: {} paths came back invalid and were thrown away", stats.invalid);
    }
    let file = args.output.display().to_string();
    let (width, height) = (picture.width(), picture.height());
    if global.json {
        return output::json(&json!({
            "output": file, "width": width, "height": height, "spp": args.spp, "seed": args.seed,
            "seconds": stats.seconds, "samples": stats.samples, "rays": stats.rays, "invalid": stats.invalid,
        }));
    }
    if !global.quiet {
        let rate = stats.rays as f64 / stats.seconds.max(1e-9) / 1e6;
        eprintln!("{file}: {width}×{height}, {} spp, {:.2} s, {rate:.1} million rays/s", args.spp, stats.seconds);
    }
    Ok(())
}

/// Renders, then again after every change, interrupting what is under way.
fn watch(global: &Global, args: &RenderArgs, stage: &Stage) -> Outcome {
    let files: Vec<PathBuf> = [Some(&args.file), args.compare.as_ref()].into_iter().flatten().cloned().collect();
    if files.iter().any(|f| f == Path::new("-")) {
        return Err(Failure::usage("--watch needs a file; stdin cannot change"));
    }
    let (changes, _watcher) = watch_files(&files)?;
    loop {
        let cancel = AtomicBool::new(false);
        let changed = std::thread::scope(|scope| {
            let render = scope.spawn(|| once(global, args, stage, &cancel));
            let changed = loop {
                match changes.recv_timeout(Duration::from_millis(20)) {
                    Ok(()) => {
                        cancel.store(true, Ordering::Relaxed);
                        break true;
                    }
                    Err(RecvTimeoutError::Disconnected) => break false,
                    Err(RecvTimeoutError::Timeout) if render.is_finished() => break false,
                    Err(RecvTimeoutError::Timeout) => {}
                }
            };
            let outcome = render.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            match outcome {
                Err(Failure::Script(messages)) => eprintln!("{}", messages.trim_end()),
                // A file may be missing for a moment while an editor replaces it.
                Err(Failure::Usage(message)) if !changed => eprintln!("error: {message}"),
                _ => {}
            }
            changed
        });
        if !changed && changes.recv().is_err() {
            return Ok(());
        }
        // Editors write in several steps.
        while changes.recv_timeout(Duration::from_millis(60)).is_ok() {}
    }
}

/// Tells of changes to any of `files`. Their folders are watched, because editors replace files.
fn watch_files(files: &[PathBuf]) -> Result<(Receiver<()>, impl Watcher + use<>), Failure> {
    let (tell, changes) = channel();
    let names: Vec<_> = files.iter().filter_map(|f| f.file_name().map(ToOwned::to_owned)).collect();
    let failed = |e: notify::Error| Failure::usage(format!("cannot watch for changes: {e}"));
    let mut watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
        let Ok(event) = event else { return };
        let relevant = !matches!(event.kind, EventKind::Access(_))
            && event.paths.iter().any(|p| p.file_name().is_some_and(|n| names.iter().any(|m| m == n)));
        if relevant {
            // The receiver is gone only when the program ends.
            let _ = tell.send(());
        }
    })
    .map_err(failed)?;
    for file in files {
        let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        watcher.watch(folder, RecursiveMode::NonRecursive).map_err(failed)?;
    }
    Ok((changes, watcher))
}
