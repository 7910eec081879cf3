//! `overcoat gallery`: every script of a folder on every scene, as one page.

use super::check::{collect, judge};
use super::render::{SceneArg, render_failed};
use super::{Failure, Global, Outcome, output};
use crate::engine::{Material, Shader};
use crate::preview::output::{png, replace};
use crate::preview::{Control, RenderSettings, Stage};
use crate::prove::Options;
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Args, Debug)]
pub struct GalleryArgs {
    /// Folder of scripts (`*.osl`, at any depth).
    dir: PathBuf,
    /// Where `index.html` and the pictures go; made if it does not exist.
    #[arg(long, short, default_value = "gallery")]
    output: PathBuf,
    /// What the materials are shown on.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "sphere,ball,drape")]
    scenes: Vec<SceneArg>,
    /// Pixels of a side of each picture.
    #[arg(long, default_value_t = 240, value_parser = clap::value_parser!(u32).range(16..=2048))]
    size: u32,
    /// Samples per pixel.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Same seed, same pictures.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// A script on its way to the page.
struct Entry {
    /// Its path without extension, in one word.
    name: String,
    shader: Shader,
    material: Material,
    verdict: &'static str,
    pictures: Vec<String>,
}

pub fn run(global: &Global, args: &GalleryArgs) -> Outcome {
    let mut files = Vec::new();
    collect(&args.dir, &mut files)?;
    if files.is_empty() || !args.dir.is_dir() {
        return Err(Failure::usage(format!("there is no `*.osl` file in `{}`", args.dir.display())));
    }
    let mut entries = Vec::new();
    for file in &files {
        entries.push(entry(global, &args.dir, file)?);
    }
    entries.par_iter_mut().for_each(|e| {
        e.verdict = judge(&e.shader, &Options::default()).map_or("error", |report| report.verdict.name());
    });
    std::fs::create_dir_all(&args.output)
        .map_err(|e| Failure::usage(format!("cannot make `{}`: {e}", args.output.display())))?;
    for scene in &args.scenes {
        let settings = RenderSettings {
            scene: scene.scene(),
            spp: args.spp,
            width: args.size,
            height: args.size,
            seed: args.seed,
            ..RenderSettings::default()
        };
        let stage = Stage::new(&settings).map_err(render_failed)?;
        for entry in &mut entries {
            let name = format!("{}-{}.png", entry.name, scene.name());
            if !global.quiet {
                eprintln!("{name}");
            }
            let rendered = stage.render(&entry.material, Control::quiet()).map_err(render_failed)?;
            let bytes = png(&rendered.image, 0.0).map_err(|e| Failure::usage(e.to_string()))?;
            save(&args.output.join(&name), &bytes)?;
            entry.pictures.push(name);
        }
    }
    let index = args.output.join("index.html");
    save(&index, page(&entries, args.size).as_bytes())?;
    if global.json {
        let rows: Vec<Value> =
            entries.iter().map(|e| json!({ "name": e.name, "verdict": e.verdict, "pictures": e.pictures })).collect();
        return output::json(&json!({ "output": index.display().to_string(), "materials": rows }));
    }
    Ok(())
}

fn save(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    replace(path, bytes).map_err(|e| Failure::usage(e.to_string()))
}

fn entry(global: &Global, dir: &Path, file: &Path) -> Result<Entry, Failure> {
    let shader = global.shader(file)?;
    let material = global.specialise(&shader, &[])?;
    let relative = file.strip_prefix(dir).unwrap_or(file).with_extension("");
    let word = |c: char| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '-' };
    let name = relative.to_string_lossy().chars().map(word).collect();
    Ok(Entry { name, shader, material, verdict: "", pictures: Vec::new() })
}

impl SceneArg {
    fn name(self) -> String {
        self.to_possible_value().map_or(String::new(), |v| v.get_name().to_owned())
    }
}

const STYLE: &str = "body{margin:2rem auto;max-width:64rem;padding:0 1rem;background:#1b1c1e;color:#e4e6e8;\
    font:15px/1.5 system-ui,sans-serif}section{margin:2.2rem 0}h2{margin:0}p{margin:.2rem 0 .7rem;color:#9aa1a9}\
    b{font-weight:600;font-size:.8em;margin-left:.6em;color:#4cc38a}b.gains,b.error{color:#ff6b6b}\
    b.undecided{color:#e5b567}div{display:flex;gap:.5rem;flex-wrap:wrap}img{border-radius:6px}";

fn page(entries: &[Entry], size: u32) -> String {
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Materials</title>\n<style>{STYLE}</style>\n\
         <h1>Materials</h1>\n"
    );
    for entry in entries {
        let name = escaped(entry.shader.name());
        let _ = writeln!(text, "<section><h2>{name}<b class=\"{0}\">{0}</b></h2>", entry.verdict);
        let _ = writeln!(text, "<p>{}</p>\n<div>", escaped(&story(&entry.shader.source().text)));
        for picture in &entry.pictures {
            let _ = writeln!(
                text,
                "<img src=\"{picture}\" width=\"{size}\" height=\"{size}\" alt=\"{name}\" loading=\"lazy\">"
            );
        }
        text.push_str("</div></section>\n");
    }
    text
}

/// The comment a script opens with, on one line.
fn story(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.trim().strip_prefix("//"));
    lines.map(str::trim).collect::<Vec<_>>().join(" ")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
