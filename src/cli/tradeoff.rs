//! `overcoat tradeoff`: what speed costs in accuracy, for each lobe and for layered materials.

use super::extremes::chosen;
use super::input::read;
use super::{Failure, Global, Outcome, output};
use crate::audit;
use crate::audit::tradeoff::{COSINES, Choice, Point, TableSize, measure};
use crate::closure::ClosureTree;
use crate::engine::{Engine, Tier};
use crate::lobes::LobeKind;
use crate::lobes::registry::{LobeClass, ParamTy};
use crate::preview::output::{check_writable, replace};
use crate::preview::plot::Scatter;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Args, Debug)]
pub struct TradeoffArgs {
    /// Scripts to measure, with their parameters at the defaults or as `--set` has them; `-` reads stdin. Without any:
    /// every lobe at its defaults, and a few stacks of layers.
    files: Vec<PathBuf>,
    /// Only this lobe. Repeatable.
    #[arg(long, value_name = "NAME", conflicts_with = "files")]
    lobe: Vec<String>,
    /// Also write a picture of error against time.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// Layers that are typical, and dearer from one to the next.
const STACKS: [(&str, &str); 3] = [
    ("sheen / diffuse", "Ci = sheen(diffuse(N), N, 1, 0.3);"),
    ("sheen / oren_nayar", "Ci = sheen(oren_nayar(N, 0.4), N, 1, 0.3);"),
    (
        "sheen / dielectric / oren_nayar",
        "Ci = layer(dielectric_bsdf(N, dPdu, 1, 0, 0.2, 0.2, 1.5, \"ggx\"), oren_nayar(N, 0.4));
         Ci = sheen(Ci, N, 1, 0.3);",
    ),
];

/// What is measured: its name, whether it is a stack, its points.
struct Measured {
    name: String,
    layered: bool,
    points: Vec<Point>,
}

pub fn run(global: &Global, args: &TradeoffArgs) -> Outcome {
    if let Some(file) = &args.svg {
        check_writable(file).map_err(|e| Failure::usage(e.to_string()))?;
    }
    let mut all = Vec::new();
    for file in &args.files {
        all.push(of_file(global, file)?);
    }
    if args.files.is_empty() {
        let scatters = |k: &LobeKind| matches!(k.class(), LobeClass::Scatter | LobeClass::Delta);
        for kind in chosen(&args.lobe)?.into_iter().filter(scatters) {
            all.push(of_script(global, kind.spec().name, &script(kind))?);
        }
        let stacks: &[_] = if args.lobe.is_empty() { &STACKS } else { &[] };
        for (name, text) in stacks {
            all.push(of_script(global, name, text)?);
        }
    }
    if let Some(file) = &args.svg {
        let svg = picture(&all).map_err(Failure::usage)?;
        replace(file, svg.as_bytes()).map_err(|e| Failure::usage(e.to_string()))?;
    }
    if global.json {
        let subjects: Vec<Value> = all.iter().map(subject_json).collect();
        return output::json(&json!({ "cosines": COSINES, "subjects": subjects }));
    }
    output::write(&table(&all))
}

/// The engine as a choice has it; one of its own, so that what it bakes is baked, and timed, each time.
fn engine(engine: Engine, choice: Choice) -> Engine {
    engine.tier(choice.tier).layering(choice.rule).precision(choice.precision())
}

fn of_file(global: &Global, file: &Path) -> Result<Measured, Failure> {
    let (name, text) = read(file)?;
    // Messages once, not for every variant.
    global.material(file, &[])?;
    let quiet = Global { quiet: true, ..global.clone() };
    let points = measure(|choice| {
        let shader = engine(quiet.engine_for(file), choice).compile(&name, &text);
        let shader = shader.map_err(|e| Failure::Script(e.render(false)))?;
        quiet.specialise(&shader, &[])
    })?;
    Ok(measured(name, points))
}

fn of_script(global: &Global, name: &str, text: &str) -> Result<Measured, Failure> {
    let points = measure(|choice| {
        let made = engine(global.engine(), choice).material(name, text);
        made.map_err(|e| Failure::Script(e.render(false)))
    })?;
    Ok(measured(name.to_owned(), points))
}

fn measured(name: String, points: Vec<Point>) -> Measured {
    let layered = points.iter().any(|p| p.choice.rule != points[0].choice.rule);
    Measured { name, layered, points }
}

/// A script with this lobe alone, at its defaults.
fn script(kind: LobeKind) -> String {
    let mut values = Vec::new();
    for p in kind.spec().params {
        match p.ty {
            ParamTy::Normal => values.extend([0.0, 0.0, 1.0]),
            ParamTy::Vector => values.extend([1.0, 0.0, 0.0]),
            _ => values.extend(p.default),
        }
    }
    let mut tree = ClosureTree::new();
    let lobe = tree.lobe(kind, 0, &values);
    tree.set_root(lobe);
    audit::script(&tree, |_, _| false)
}

fn rule(m: &Measured, p: &Point) -> String {
    if m.layered { output::word(p.choice.rule) } else { "-".to_owned() }
}

fn table(all: &[Measured]) -> String {
    let cosines: Vec<String> = COSINES.iter().map(|c| format!("{:>7}", format!("μ {c}"))).collect();
    let mut text = format!(
        "{:<32} {:<9} {:<9} {:<6} {:>7} {:>7} {:>7} {:>7} {:>8} {:>8} {} {:>8} {:>6} {:>7}\n",
        "ns per call, % of energy lost",
        "layering",
        "tier",
        "tables",
        "eval",
        "batch",
        "sample",
        "setup",
        "max err",
        "rms err",
        cosines.join(" "),
        "tables B",
        "BSDF B",
        "bake ms"
    );
    for m in all {
        for p in &m.points {
            let lost: Vec<String> =
                p.lost.iter().map(|l| format!("{:>7.2}", (1e4 * l).round() / 100.0 + 0.0)).collect();
            let _ = writeln!(
                text,
                "{}{:<31} {:<9} {:<9} {:<6} {:>7.1} {:>7} {:>7.1} {:>7.1} {:>8.1e} {:>8.1e} {} {:>8} {:>6} {:>7.1}",
                if p.on_front { '*' } else { ' ' },
                m.name,
                rule(m, p),
                output::word(p.choice.tier),
                output::word(p.choice.tables),
                p.eval,
                p.batch.map_or("-".to_owned(), |b| format!("{b:.1}")),
                p.sample,
                p.setup,
                p.max_error,
                p.rms_error,
                lost.join(" "),
                p.table_bytes,
                p.bsdf_bytes,
                p.bake,
            );
        }
    }
    text.push_str(
        "\n* nothing with the same layering rule is both faster (batch, else eval) and closer to the reference (max err)\n",
    );
    text
}

fn subject_json(m: &Measured) -> Value {
    let round = |x: f64| (x * 10.0).round() / 10.0;
    let point = |p: &Point| {
        json!({
            "tier": output::word(p.choice.tier), "layering": rule(m, p), "tables": output::word(p.choice.tables),
            "ns": {
                "eval": round(p.eval), "eval_batch": p.batch.map(round), "sample": round(p.sample), "setup": round(p.setup),
            },
            "bake_ms": round(p.bake), "max_error": p.max_error, "rms_error": p.rms_error, "energy_lost": p.lost,
            "bytes": { "tables": p.table_bytes, "bsdf": p.bsdf_bytes }, "front": p.on_front,
        })
    };
    json!({ "name": m.name, "points": m.points.iter().map(point).collect::<Vec<_>>() })
}

/// Below, an error is drawn as this: a logarithm has no zero.
const LEAST: f64 = 1e-8;

/// Error against time: a colour per tier and size of tables, a line along each front.
fn picture(all: &[Measured]) -> Result<String, String> {
    let place = |p: &Point| (p.fastest(), p.max_error.max(LEAST));
    let points = || all.iter().flat_map(|m| &m.points);
    let mut groups = Vec::new();
    for tier in [Tier::Fast, Tier::Standard, Tier::Reference] {
        for tables in TableSize::ALL {
            let of = |p: &&Point| (p.choice.tier, p.choice.tables) == (tier, tables);
            let found: Vec<_> = points().filter(of).map(place).collect();
            if !found.is_empty() {
                groups.push((format!("{}, {} tables", output::word(tier), output::word(tables)), found));
            }
        }
    }
    let mut fronts = Vec::new();
    for m in all {
        for rule in crate::closure::LayeringRule::ALL {
            let on = m.points.iter().filter(|p| p.on_front && p.choice.rule == rule);
            let mut line: Vec<_> = on.map(place).collect();
            line.sort_by(|a, b| a.0.total_cmp(&b.0));
            fronts.push(line);
        }
    }
    let y = format!("largest error of f·cos, relative to the brightest ({LEAST:e}: none)");
    let title = "What speed costs: every variant of every material";
    Scatter { title, x: "ns per direction (in a batch, where there is one)", y: &y, groups: &groups, lines: &fronts }
        .svg()
}
