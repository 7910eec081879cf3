//! `overcoat reproduce`: the figures of the papers this engine rests on, made with its own code, each with one line on
//! what the source says and one on what was measured.

mod fabric;
mod fibre;
mod gallery;
mod layering;
mod sheen;
mod variance;

pub(super) use variance::variances;

use super::{Failure, Global, Outcome, output};
use crate::engine::{Engine, Material};
use crate::preview::output::{replace, save};
use crate::preview::plot::Plot;
use crate::preview::{Control, Environment, Image, RenderSettings, Scene, Stage, Surface, strip};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

#[derive(Args, Debug)]
pub struct ReproduceArgs {
    /// Where pictures, tables and the index page go; made if it does not exist.
    dir: PathBuf,
    /// Samples per pixel of the rendered figures.
    #[arg(long, default_value_t = 64)]
    spp: u32,
    /// Pixels of each rendered picture.
    #[arg(long, default_value_t = 256)]
    size: u32,
    /// Same seed, same pictures.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Only the figures whose name contains this.
    #[arg(long)]
    only: Option<String>,
}

/// A finished figure.
struct Figure {
    title: &'static str,
    /// What the source says.
    says: &'static str,
    /// What came out here.
    measured: String,
    /// Pictures and tables, by file name.
    files: Vec<String>,
}

/// What a figure is made with.
struct Bench<'a> {
    args: &'a ReproduceArgs,
}

type Make = fn(&Bench<'_>) -> Result<Figure, Failure>;

/// Every figure, under the name its files start with.
const FIGURES: &[(&str, Make)] = &[
    ("sheen-1-roughness", sheen::roughness_strip),
    ("sheen-2-distribution", sheen::distribution),
    ("sheen-energy", sheen::energy),
    ("sheen-3-ashikhmin", sheen::against_ashikhmin),
    ("sheen-4-softening", sheen::softening),
    ("charlie-ashikhmin-2018", sheen::fast_forms),
    ("fabric-2-furnace", fabric::furnace),
    ("fabric-3-sampling", fabric::sampling),
    ("thread-reflectance", fibre::total_reflectance),
    ("cylinder-refraction", fibre::refraction),
    ("layering", layering::losses),
    ("sampling-variance", variance::table),
    ("lobes", gallery::strips),
];

pub fn run(global: &Global, args: &ReproduceArgs) -> Outcome {
    let chosen: Vec<_> = FIGURES.iter().filter(|f| args.only.as_ref().is_none_or(|o| f.0.contains(o))).collect();
    if chosen.is_empty() {
        let names: Vec<&str> = FIGURES.iter().map(|f| f.0).collect();
        return Err(Failure::usage(format!("--only: no such figure; there are {}", names.join(", "))));
    }
    std::fs::create_dir_all(&args.dir)
        .map_err(|e| Failure::usage(format!("cannot make `{}`: {e}", args.dir.display())))?;
    let bench = Bench { args };
    let mut figures = Vec::new();
    for (name, make) in chosen {
        if !global.quiet {
            eprintln!("{name} …");
        }
        figures.push((*name, make(&bench)?));
    }
    bench.write("index.md", &index(&figures))?;
    if global.json {
        let rows: Vec<_> = figures
            .iter()
            .map(|(name, f)| json!({"name": name, "says": f.says, "measured": f.measured, "files": f.files}))
            .collect();
        return output::json(&json!({ "figures": rows }));
    }
    let mut text = String::new();
    for (name, f) in &figures {
        let _ = writeln!(text, "{name}: {}", f.measured);
    }
    output::write(&text)
}

fn index(figures: &[(&str, Figure)]) -> String {
    let mut page = String::from("# Figures of the sources, made with overcoat\n\n");
    page.push_str("Made by `overcoat reproduce DIR`. Pictures and the numbers behind them lie beside this page.\n");
    for (_, figure) in figures {
        let _ = write!(page, "\n## {}\n\n", figure.title);
        for file in figure.files.iter().filter(|f| f.ends_with(".png") || f.ends_with(".svg")) {
            let _ = writeln!(page, "![{}]({file})\n", figure.title);
        }
        let _ = writeln!(page, "- The source: {}", figure.says);
        let _ = writeln!(page, "- Measured: {}", figure.measured);
        for file in figure.files.iter().filter(|f| f.ends_with(".csv") || f.ends_with(".md")) {
            let _ = writeln!(page, "- Numbers: [{file}]({file})");
        }
    }
    page
}

impl Bench<'_> {
    fn settings(&self, scene: Scene) -> RenderSettings {
        let ReproduceArgs { spp, size, seed, .. } = *self.args;
        RenderSettings { scene, spp, width: size, height: size, seed, ..RenderSettings::default() }
    }

    fn stage(&self, settings: &RenderSettings, environment: Option<Environment>) -> Result<Stage, Failure> {
        match environment {
            Some(e) => Stage::lit_by(e, settings),
            None => Stage::new(settings),
        }
        .map_err(|e| Failure::usage(e.to_string()))
    }

    fn picture(&self, stage: &Stage, surface: &impl Surface) -> Result<Image, Failure> {
        let cancel = AtomicBool::new(false);
        let rendered = stage.render(surface, Control { progress: &|_, _| {}, cancel: &cancel });
        Ok(rendered.map_err(|e| Failure::usage(e.to_string()))?.image)
    }

    /// One picture per script, side by side.
    fn strip(&self, name: &str, stage: &Stage, scripts: &[(String, String)]) -> Result<String, Failure> {
        let mut images = Vec::new();
        for (label, script) in scripts {
            images.push((self.picture(stage, &material(script)?)?, label));
        }
        let panels: Vec<(&Image, &str)> = images.iter().map(|(i, l)| (i, l.as_str())).collect();
        let strip = strip::strip(&panels, 0.0).ok_or_else(|| Failure::usage("a strip without pictures"))?;
        let file = format!("{name}.png");
        save(&strip, &self.args.dir.join(&file), 0.0).map_err(|e| Failure::usage(e.to_string()))?;
        Ok(file)
    }

    /// Curves as a picture and as a table; the two file names.
    fn plot(&self, name: &str, plot: &Plot<'_>) -> Result<Vec<String>, Failure> {
        let (svg, csv) = (format!("{name}.svg"), format!("{name}.csv"));
        self.write(&svg, &plot.svg().map_err(Failure::usage)?)?;
        let mut table = String::from("curve,x,y\n");
        for (curve, points) in plot.series {
            for (x, y) in points {
                let _ = writeln!(table, "{curve},{x},{y}");
            }
        }
        self.write(&csv, &table)?;
        Ok(vec![svg, csv])
    }

    /// Writes a text file whole, or leaves the old one.
    fn write(&self, file: &str, text: &str) -> Outcome {
        let path = self.args.dir.join(file);
        replace(&path, text.as_bytes()).map_err(|e| Failure::usage(e.to_string()))
    }
}

/// A script of this command; its parameters are at their defaults.
fn material(script: &str) -> Result<Material, Failure> {
    engine_material(Engine::new(), script)
}

/// The same, by an engine of one's choice.
fn engine_material(engine: Engine, script: &str) -> Result<Material, Failure> {
    let broken = |e: crate::engine::ScriptError| Failure::Script(e.to_string());
    engine.compile("figure", script).map_err(broken)?.material(&[]).map_err(broken)
}
