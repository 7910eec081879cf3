//! `overcoat plot`: how a material scatters, keeps and samples light, as curves.

use super::albedo::explain;
use super::input::{Evaluate, in_tier};
use super::reproduce::variances;
use super::{Failure, Global, Outcome, output};
use crate::audit::{Side, Tolerance, albedo};
use crate::closure::Bsdf;
use crate::engine::Material;
use crate::globals::Globals;
use crate::preview::output::replace;
use crate::preview::plot::Plot;
use clap::{Args, ValueEnum};
use glam::{Vec3, vec3};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct PlotArgs {
    /// The script; `-` reads stdin.
    file: PathBuf,
    /// The picture, an SVG.
    #[arg(long, short)]
    output: PathBuf,
    /// What to draw; several are set side by side.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "polar,albedo,furnace,sampling")]
    show: Vec<Curves>,
    /// Angles of the viewer to N in degrees, for the polar curves.
    #[arg(long, value_delimiter = ',', value_name = "A,B,…", default_value = "0,30,60,80")]
    theta: Vec<f64>,
    /// Azimuth of the held direction from dPdu, in degrees.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_name = "DEGREES")]
    phi: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Curves {
    /// f·|cos θi| in the plane of incidence, for several angles of the viewer.
    Polar,
    /// Where the energy goes over the angle: scattered lobe by lobe, kept by layers, absorbed.
    Albedo,
    /// The albedo over the angle from both sides, above and below the surface.
    Furnace,
    /// The noise of sampling: standard deviation of f·cos/pdf over its mean, against uniform directions.
    Sampling,
}

type Series = Vec<(String, Vec<(f64, f64)>)>;

/// Degrees between neighbouring points of curves over the angle.
const STEP: usize = 3;
const TOLERANCE: Tolerance = Tolerance { error: 2e-4, evaluations: 40_000 };
/// Of one chart.
const SIZE: (usize, usize) = (720, 440);

pub fn run(global: &Global, args: &PlotArgs) -> Outcome {
    if args.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("svg")) {
        return Err(Failure::usage(format!("cannot write `{}`: the name must end in .svg", args.output.display())));
    }
    if let Some(bad) = args.theta.iter().chain([&args.phi]).find(|d| !d.is_finite() || d.abs() > 360.0) {
        return Err(Failure::usage(format!("{bad} is no angle in degrees")));
    }
    let material = global.material(&args.file, &[])?;
    // Whatever exceeds a budget is told once, before anything is drawn.
    f32::shade(&material, &Globals::default(), [0.0, 0.0, 1.0])?;
    let mut charts = Vec::new();
    for kind in &args.show {
        charts.push(chart(&material, *kind, args).map_err(Failure::Usage)?);
    }
    let text = sheet(&charts);
    replace(&args.output, text.as_bytes()).map_err(|e| Failure::usage(e.to_string()))?;
    if global.json {
        let file = args.output.display().to_string();
        return output::json(&json!({ "output": file, "charts": charts.len() }));
    }
    Ok(())
}

/// Several charts as one picture, two in a row.
fn sheet(charts: &[String]) -> String {
    let columns = charts.len().min(2);
    let (width, height) = (SIZE.0 * columns, SIZE.1 * charts.len().div_ceil(2));
    let mut text = format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         xmlns=\"http://www.w3.org/2000/svg\">\n"
    );
    for (index, chart) in charts.iter().enumerate() {
        let (x, y) = (SIZE.0 * (index % 2), SIZE.1 * (index / 2));
        text += &chart.replacen("<svg ", &format!("<svg x=\"{x}\" y=\"{y}\" "), 1);
        text.push('\n');
    }
    text + "</svg>\n"
}

fn chart(material: &Material, kind: Curves, args: &PlotArgs) -> Result<String, String> {
    let name = material.name();
    let angle = "angle to N, degrees";
    match kind {
        Curves::Polar => {
            let series = polar(material, args);
            let title = format!("{name}: scattering in the plane of incidence");
            let (x, y) = ("opposite the viewer", "f·|cos|, along N");
            Plot { title: &title, x, y, series: &series }.svg_to_scale()
        }
        Curves::Albedo => {
            let series = in_tier!(material, shares(material, args.phi));
            let title = format!("{name}: where the energy goes");
            Plot { title: &title, x: angle, y: "part of the light, mean of the channels", series: &series }.svg()
        }
        Curves::Furnace => {
            let series = in_tier!(material, furnace(material, args.phi));
            let title = format!("{name}: albedo in a white furnace");
            let x = "angle to N, degrees; beyond 90 below the surface";
            Plot { title: &title, x, y: "albedo, largest channel", series: &series }.svg()
        }
        Curves::Sampling => {
            let series = sampling(material, args.phi);
            let title = format!("{name}: noise of one sample");
            Plot { title: &title, x: angle, y: "standard deviation / mean", series: &series }.svg()
        }
    }
}

fn direction(theta: f64, phi: f64) -> Vec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    vec3((sin * cos_phi) as f32, (sin * sin_phi) as f32, cos as f32)
}

fn polar(material: &Material, args: &PlotArgs) -> Series {
    let globals = Globals::default();
    let of = |theta: &f64| {
        let bsdf = material.shade(&globals, direction(*theta, args.phi)).unwrap_or_else(|_| Bsdf::black());
        let value = |degrees: f32| {
            let f = bsdf.eval(direction(-f64::from(degrees), args.phi).to_array()).f_cos;
            f[0].max(f[1]).max(f[2])
        };
        let at = |(degrees, value): (f32, f32)| {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            (f64::from(value) * sin, f64::from(value) * cos)
        };
        (format!("viewer at {theta}°"), around(&value).into_iter().map(at).collect())
    };
    args.theta.iter().map(of).collect()
}

fn furnace<S: Evaluate>(material: &Material, phi: f64) -> Series {
    let globals = Globals::default();
    let subject = |wo: [S; 3]| S::shade(material, &globals, wo).unwrap_or_else(|_| Bsdf::black());
    let curve = |side: Side| -> Vec<(f64, f64)> {
        let at = |theta: f64| {
            let w = direction(theta, phi).to_array().map(|x| S::c(f64::from(x)));
            (theta, albedo(&subject, side, w, TOLERANCE).max())
        };
        // Close to the horizon on both sides, where much changes; on it half the material is another one.
        let above = (0..90 / STEP).map(|k| (k * STEP) as f64).chain([88.5, 89.5, 89.9]);
        let angles: Vec<f64> = above.clone().chain(above.map(|theta| 180.0 - theta)).collect();
        let mut curve: Vec<(f64, f64)> = angles.into_par_iter().map(at).collect();
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        curve
    };
    vec![
        ("held at the viewer".into(), curve(Side::View)),
        ("held at the light".into(), curve(Side::Light)),
        ("all light".into(), vec![(0.0, 1.0), (180.0, 1.0)]),
    ]
}

fn shares<S: Evaluate>(material: &Material, phi: f64) -> Series {
    let globals = Globals::default();
    let subject = |wo: [S; 3]| S::shade(material, &globals, wo).unwrap_or_else(|_| Bsdf::black());
    let mean = |v: &Value| (0..3).map(|c| v[c].as_f64().unwrap_or(0.0)).sum::<f64>() / 3.0;
    let at = |k: usize| -> (f64, BTreeMap<(u8, String), f64>) {
        let theta = ((k * STEP) as f64).min(89.0);
        let w = direction(theta, phi).to_array().map(|x| S::c(f64::from(x)));
        let total = albedo(&subject, Side::View, w, TOLERANCE);
        let explained = explain::<S>(material, &globals, w, &total, TOLERANCE);
        let mut parts: BTreeMap<(u8, String), f64> = BTreeMap::new();
        let mut add = |rank: u8, name: String, share: f64| *parts.entry((rank, name)).or_default() += share;
        for lobe in explained["lobes"].as_array().into_iter().flatten() {
            add(0, lobe["lobe"].as_str().unwrap_or("").to_owned(), mean(&lobe["scattered"]));
        }
        for layer in explained["layers"].as_array().into_iter().flatten() {
            add(1, "lost or withheld below layers".into(), mean(&layer["lost"]) + mean(&layer["tint"]));
        }
        add(2, "absorbed".into(), mean(&explained["absorbed_by_weights"]) + mean(&explained["absorbed_by_lobes"]));
        (theta, parts)
    };
    let rows: Vec<_> = (0..=90 / STEP).into_par_iter().map(at).collect();
    let mut series: BTreeMap<(u8, String), Vec<(f64, f64)>> = BTreeMap::new();
    for (theta, parts) in rows {
        for (name, share) in parts {
            series.entry(name).or_default().push((theta, share));
        }
    }
    series.into_iter().map(|((_, name), points)| (name, points)).collect()
}

fn sampling(material: &Material, phi: f64) -> Series {
    let globals = Globals::default();
    let at = |k: usize| {
        let theta = ((k * STEP) as f64).min(89.0);
        let bsdf = material.shade(&globals, direction(theta, phi)).unwrap_or_else(|_| Bsdf::black());
        (theta, variances(&bsdf).map(f64::sqrt))
    };
    let rows: Vec<(f64, [f64; 2])> = (0..=90 / STEP).into_par_iter().map(at).collect();
    let curve = |which: usize| rows.iter().map(|(theta, v)| (*theta, v[which])).collect();
    vec![("the material's own sampling".into(), curve(0)), ("uniform over the hemisphere".into(), curve(1))]
}

/// Degrees between neighbouring directions at first.
const APART: f32 = 2.0;
/// How often the distance between neighbours is halved where the value changes quickly.
const MAX_HALVINGS: u32 = 6;
/// (angle in degrees, value) all around, closer together where the value changes quickly: peaks may be a fraction of a
/// degree wide.
pub(super) fn around(f: &dyn Fn(f32) -> f32) -> Vec<(f32, f32)> {
    let sane = |angle: f32| Some(f(angle)).filter(|y| y.is_finite()).unwrap_or(0.0);
    let coarse: Vec<(f32, f32)> = (0..=(360.0 / APART) as u32)
        .map(|k| {
            let angle = -180.0 + APART * k as f32;
            (angle, sane(angle))
        })
        .collect();
    let mut points = vec![coarse[0]];
    for pair in coarse.windows(2) {
        refine(&sane, pair[0], pair[1], MAX_HALVINGS, &mut points);
    }
    points
}

/// Appends what lies behind `a` up to `b`.
fn refine(f: &dyn Fn(f32) -> f32, a: (f32, f32), b: (f32, f32), halvings: u32, points: &mut Vec<(f32, f32)>) {
    let middle = 0.5 * (a.0 + b.0);
    let value = f(middle);
    let off = (value - 0.5 * (a.1 + b.1)).abs();
    if halvings > 0 && off > 0.02 * (a.1.max(b.1).max(value)) + 1e-6 {
        refine(f, a, (middle, value), halvings - 1, points);
        refine(f, (middle, value), b, halvings - 1, points);
    } else {
        points.push(b);
    }
}

#[cfg(test)]
mod tests {
    use super::around;

    #[test]
    fn narrow_peaks_are_found_and_smooth_curves_stay_short() {
        let peak = around(&|angle| 100.0 * (-((angle - 30.4) / 0.3).powi(2)).exp() + 1.0);
        let highest = peak.iter().map(|p| p.1).fold(0.0, f32::max);
        assert!(highest > 90.0, "{highest}");
        let smooth = around(&|angle| angle.to_radians().cos().max(0.0));
        assert!(smooth.len() < 220, "{}", smooth.len());
        assert!(smooth.windows(2).all(|w| w[0].0 < w[1].0));
    }
}
