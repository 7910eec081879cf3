//! `overcoat furnace`: the albedo over a grid of directions, from both sides; does it exceed one anywhere?

use super::input::{Evaluate, in_tier};
use super::{Failure, Global, Outcome, output};
use crate::audit::campaign::{LIMIT, promises};
use crate::audit::estimate::direction_of;
use crate::audit::{Albedo, Side, Tolerance, albedo_until};
use crate::closure::Bsdf;
use crate::engine::Material;
use crate::globals::Globals;
use clap::Args;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct FurnaceArgs {
    /// The script; `-` reads stdin.
    file: PathBuf,
    /// Cosines of the held direction to N; negative is below the surface.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, value_name = "A,B,…")]
    cos: Vec<f64>,
    /// How many azimuths, evenly about N from dPdu on.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=360))]
    azimuths: u32,
}

const COSINES: [f64; 12] = [1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.003, -0.03, -0.2, -0.6, -1.0];
const SIDES: [Side; 2] = [Side::View, Side::Light];

struct Row {
    side: Side,
    cos: f64,
    phi: f64,
    albedo: Albedo,
}

pub fn run(global: &Global, args: &FurnaceArgs) -> Outcome {
    let cosines = if args.cos.is_empty() { COSINES.to_vec() } else { args.cos.clone() };
    if let Some(bad) = cosines.iter().find(|c| !(-1.0..=1.0).contains(*c)) {
        return Err(Failure::usage(format!("--cos {bad}: a cosine lies between -1 and 1")));
    }
    let material = global.material(&args.file, &[])?;
    let rows = in_tier!(material, measure(&material, &cosines, args.azimuths))?;
    // `view` gains toward the light by design: shown, and not counted.
    let promised = |r: &&Row| promises(material.layering().rule, r.side);
    let over = |r: &Row| r.albedo.max() - r.albedo.error;
    let worst = rows.iter().filter(promised).max_by(|a, b| over(a).total_cmp(&over(b)));
    let gains = worst.is_some_and(|w| over(w) > LIMIT);
    if global.json {
        let rows: Vec<Value> = rows.iter().map(row_json).collect();
        output::json(&json!({ "rows": rows, "worst": worst.map(row_json), "gains": gains }))?;
    } else {
        output::write(&text(&rows, worst, gains))?;
    }
    match worst {
        Some(w) if gains => {
            Err(Failure::Check(format!("the material gains energy: albedo {:.5}, {}", w.albedo.max(), place(w))))
        }
        _ => Ok(()),
    }
}

fn measure<S: Evaluate>(material: &Material, cosines: &[f64], azimuths: u32) -> Result<Vec<Row>, Failure> {
    let globals = Globals::default();
    // Whatever exceeds a budget is told once, before integrating.
    S::shade(material, &globals, [S::zero(), S::zero(), S::one()])?;
    let subject = |wo: [S; 3]| S::shade(material, &globals, wo).unwrap_or_else(|_| Bsdf::black());
    let mut places = Vec::new();
    for side in SIDES {
        for cos in cosines {
            let around = if cos.abs() == 1.0 { 1 } else { azimuths };
            places.extend((0..around).map(|k| (side, *cos, 360.0 * f64::from(k) / f64::from(azimuths))));
        }
    }
    let rows = places.into_par_iter().map(|(side, cos, phi)| {
        let w = direction_of(cos, phi).map(S::c);
        // Three digits to look at; five where it may be one.
        let fine = Tolerance { error: 1e-5, evaluations: 400_000 };
        let enough = |a: &Albedo| a.error <= 5e-4 && a.max() + a.error <= LIMIT;
        Row { side, cos, phi, albedo: albedo_until(&subject, side, w, fine, enough) }
    });
    Ok(rows.collect())
}

fn name(side: Side) -> &'static str {
    match side {
        Side::View => "view",
        Side::Light => "light",
    }
}

fn place(row: &Row) -> String {
    format!("{} side, cosine {}, azimuth {}°", name(row.side), row.cos, row.phi)
}

fn row_json(row: &Row) -> Value {
    json!({
        "side": name(row.side), "cos": row.cos, "phi": row.phi, "dir": direction_of(row.cos, row.phi),
        "albedo": row.albedo.value, "error": row.albedo.error,
    })
}

/// A line per side and cosine, its largest channel at each azimuth.
fn text(rows: &[Row], worst: Option<&Row>, gains: bool) -> String {
    let mut text = String::from("largest channel of the albedo, by cosine and azimuth\n");
    for side in SIDES {
        let _ = write!(text, "\n{} side", name(side));
        let mut last = None;
        for row in rows.iter().filter(|r| r.side == side) {
            if last != Some(row.cos) {
                let _ = write!(text, "\n{:8}", row.cos);
                last = Some(row.cos);
            }
            let _ = write!(text, " {:8.5}", row.albedo.max());
        }
        text.push('\n');
    }
    if let Some(worst) = worst {
        let [r, g, b] = worst.albedo.value;
        let verdict = if gains { "gains" } else { "keeps to one" };
        let _ = writeln!(text, "\n{verdict}: at most {r:.5} {g:.5} {b:.5}, {}", place(worst));
    }
    text
}
