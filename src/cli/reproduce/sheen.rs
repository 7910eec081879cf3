//! Conty & Kulla 2017, figures 1 to 4, and the comparison of Narkowicz 2018.

use super::{Bench, Figure, material};
use crate::albedo::curve::{Kernel, Quadrature, no_cells, no_extra};
use crate::albedo::{AlbedoCurve, CurveSpec, Precision};
use crate::audit::{Side, Tolerance, albedo};
use crate::cli::Failure;
use crate::globals::Globals;
use crate::lobes::charlie::{Fibres, FittedLambda, half_cot2};
use crate::optics::V3;
use crate::preview::plot::Plot;
use crate::preview::{Scene, lamp};
use glam::vec3;

const ROUGHNESSES: [f64; 5] = [0.15, 0.25, 0.4, 0.65, 1.0];

fn over_red(r: f64) -> String {
    format!("Ci = sheen(color(0.55, 0.02, 0.04) * diffuse(N), N, 1, {r});")
}

/// D at an angle to the normal, in radians.
fn sheen_d(r: f64, theta: f64) -> f64 {
    Fibres::new(r).d(theta.tan().powi(-2))
}

/// The largest channel of the albedo of a script at one cosine, from both sides.
fn albedos(script: &str, cos: f32) -> Result<[f64; 2], Failure> {
    let material = material(script)?;
    let globals = Globals::default();
    let subject = |wo: [f32; 3]| material.shade(&globals, wo.into()).unwrap_or_else(|_| crate::closure::Bsdf::black());
    let w = [(1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos];
    Ok([Side::View, Side::Light].map(|side| albedo(&subject, side, w, Tolerance::default()).max()))
}

pub fn roughness_strip(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let stage = bench.stage(&bench.settings(Scene::Sphere), None)?;
    let scripts: Vec<_> = ROUGHNESSES.iter().map(|r| (format!("r = {r}"), over_red(*r))).collect();
    let file = bench.strip("sheen-1-roughness", &stage, &scripts)?;
    let mut rim = Vec::new();
    for r in ROUGHNESSES {
        let [facing, grazing] = [1.0, 0.1].map(|cos| albedos(&format!("Ci = sheen_bsdf(N, 1, {r});"), cos));
        rim.push(format!("r {r}: {:.3} / {:.3}", facing?[0], grazing?[0]));
    }
    Ok(Figure {
        title: "Sheen over red, with increasing roughness (Conty & Kulla 2017, figure 1)",
        says: "low roughness keeps the highlight at the grazing angle; as it grows the sheen dominates.",
        measured: format!("the sheen's albedo facing / at cosine 0.1: {}.", rim.join(", ")),
        files: vec![file],
    })
}

pub fn distribution(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let mut series = Vec::new();
    let mut integrals = 0.0f64;
    for r in [0.1, 0.2, 0.4, 0.7, 1.0] {
        let degrees = (0..=180).map(|k| f64::from(k) * 0.5);
        series.push((format!("r = {r}"), degrees.map(|t| (t, sheen_d(r, t.to_radians()))).collect()));
        // ∫ D cos θ dω by the midpoint rule in sin²θ.
        let n = 20_000;
        let at = |k: i32| ((f64::from(k) + 0.5) / f64::from(n)).sqrt().asin();
        let integral: f64 = (0..n).map(|k| sheen_d(r, at(k)) * std::f64::consts::PI / f64::from(n)).sum();
        integrals = integrals.max((integral - 1.0).abs());
    }
    let plot = Plot { title: "D(θ)", x: "θ, degrees", y: "D, per steradian", series: &series };
    Ok(Figure {
        title: "The fibre distribution D over θ and r (Conty & Kulla 2017, figure 2)",
        says: "the density becomes sharper and more concentrated at the grazing angle as r approaches 0.",
        measured: format!("∫ D cos θ dω differs from 1 by at most {integrals:.0e}, for every r plotted."),
        files: bench.plot("sheen-2-distribution", &plot)?,
    })
}

/// The lobe as printed, without a clamp: key = [roughness, softening].
fn printed(key: &[f64; 4], wo: V3<f64>, wi: &[V3<f64>], out: &mut [f64]) {
    let (fibres, lambda) = (Fibres::new(key[0]), FittedLambda::published(key[0]));
    let towards_viewer = lambda.ln_lambda(wo.z).exp();
    for (out, wi) in out.iter_mut().zip(wi) {
        let softened = 1.0 + key[1] * 2.0 * (1.0 - wi.z).powi(8);
        let shadowing = 1.0 + towards_viewer + (softened * lambda.ln_lambda(wi.z)).exp();
        *out = fibres.d(half_cot2(wo, *wi)) / (4.0 * wo.z * wi.z * shadowing);
    }
}

/// D with the fast visibility term, not divided by anything: key = [roughness].
fn fast(key: &[f64; 4], wo: V3<f64>, wi: &[V3<f64>], out: &mut [f64]) {
    let fibres = Fibres::new(key[0]);
    for (out, wi) in out.iter_mut().zip(wi) {
        *out = fibres.d(half_cot2(wo, *wi)) / (4.0 * (wo.z + wi.z - wo.z * wi.z));
    }
}

/// The largest E_view of a raw lobe for cosines from 1e-3 to 1.
fn largest(kernel: Kernel, key: [f64; 4]) -> f64 {
    let quadrature = Quadrature::new(Precision { polar: 96, azimuth: 64, ..Precision::REFERENCE });
    let spec =
        CurveSpec { kernel, key, axis: None, reciprocal: true, bounded: false, extra: no_extra, cells: no_cells };
    let cosines = (0..=24).map(|k| 10f64.powf(-3.0 + f64::from(k) / 8.0).min(1.0));
    cosines.map(|c| quadrature.albedos(&spec, &AlbedoCurve::<f64>::default(), 0.0, c).view).fold(0.0, f64::max)
}

pub fn energy(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let largest = |r: f64, softening: f64| largest(printed, [r, softening, 0.0, 0.0]);
    let roughnesses: Vec<f64> = (0..=30).map(|k| 10f64.powf(-2.0 + f64::from(k) / 15.0)).collect();
    let curve = |softening: f64| roughnesses.iter().map(|r| (r.log10(), largest(*r, softening))).collect::<Vec<_>>();
    let series = [("as printed, raw".to_owned(), curve(0.0)), ("as printed, softened".to_owned(), curve(1.0))];
    let crossing = |c: &[(f64, f64)]| {
        let at = c.windows(2).find(|w| w[0].1 > 1.0 && w[1].1 <= 1.0);
        at.map_or(f64::NAN, |w| 10f64.powf(w[0].0 + (w[1].0 - w[0].0) * (w[0].1 - 1.0) / (w[0].1 - w[1].1)))
    };
    let (raw, soft) = (crossing(&series[0].1), crossing(&series[1].1));
    let plot = Plot { title: "Largest E for cosines ≥ 1e-3", x: "log10 r", y: "E", series: &series };
    Ok(Figure {
        title: "Does the fitted lobe gain energy? (Conty & Kulla 2017, §5)",
        says: "the closure guarantees that there is no energy gain.",
        measured: format!(
            "as printed E exceeds 1 for r below {raw:.3}, softened below {soft:.3}; the shipped lobe keeps r ≥ 0.07."
        ),
        files: bench.plot("sheen-energy", &plot)?,
    })
}

pub fn against_ashikhmin(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let ground = "color(0.25, 0.01, 0.02) * diffuse(N)";
    let scripts = [
        ("Ashikhmin".to_owned(), format!("Ci = layer(velvet(N, 0.3), {ground});")),
        ("sheen".to_owned(), format!("Ci = sheen({ground}, N, 1, 0.3);")),
    ];
    let mut files = Vec::new();
    for (light, toward) in [("front", vec3(-0.3, 0.5, 1.0)), ("side", vec3(-1.0, 0.35, -0.15))] {
        let stage = bench.stage(&bench.settings(Scene::Sphere), Some(lamp(toward, 4.0)))?;
        let scripts = scripts.clone().map(|(label, script)| (format!("{label}, {light} light"), script));
        files.push(bench.strip(&format!("sheen-3-ashikhmin-{light}"), &stage, &scripts)?);
    }
    let f = |script: &str, cos: f32| -> Result<f32, Failure> {
        let material = material(script)?;
        let sin = (1.0 - cos * cos).sqrt();
        let bsdf = material.shade(&Globals::default(), vec3(sin, 0.0, cos))?;
        // Light from the viewer's own direction: the half vector is that direction.
        Ok(bsdf.eval([sin, 0.0, cos]).f_cos[0] / cos)
    };
    let dark = |script: &str| -> Result<f32, Failure> { Ok(f(script, 1.0)? / f(script, 0.7)?) };
    Ok(Figure {
        title: "Ashikhmin's velvet and the sheen under two lights (Conty & Kulla 2017, figure 3)",
        says: "the dark spot in the light's direction is a common issue with Ashikhmin's distribution; the sine-based \
               one is softer.",
        measured: format!(
            "retroreflection at normal incidence over that at 45° is {:.2} for velvet in its 2007 form, whose constant term \
             fills the spot, and {:.2} for the sheen, which leaves the ground bare there without an edge.",
            dark("Ci = velvet(N, 0.3);")?,
            dark("Ci = sheen_bsdf(N, 1, 0.3);")?
        ),
        files,
    })
}

pub fn softening(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let stage = bench.stage(&bench.settings(Scene::Sphere), Some(lamp(vec3(-1.0, 0.4, 0.25), 3.0)))?;
    let ground = "color(0.25, 0.01, 0.02) * diffuse(N)";
    let scripts = [
        ("softened".to_owned(), format!("Ci = sheen({ground}, N, 1, 0.5);")),
        ("raw".to_owned(), format!("Ci = sheen({ground}, N, 1, 0.5, \"softening\", 0);")),
        ("Ashikhmin".to_owned(), format!("Ci = layer(velvet(N, 0.5), {ground});")),
    ];
    let file = bench.strip("sheen-4-softening", &stage, &scripts)?;
    let [view, light] = albedos("Ci = sheen_bsdf(N, 1, 0.3);", 0.04)?;
    Ok(Figure {
        title: "Terminator softening on, off, and Ashikhmin (Conty & Kulla 2017, figure 4)",
        says: "softening breaks the physical model at this one point and makes it non-reciprocal.",
        measured: format!(
            "at r = 0.3 and cosine 0.04 E_view is {view:.3} and E_light {light:.3}: both bound the layer."
        ),
        files: vec![file],
    })
}

pub fn fast_forms(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let stage = bench.stage(&bench.settings(Scene::Sphere), Some(lamp(vec3(-0.7, 0.6, 0.7), 4.0)))?;
    let scripts = [
        ("Ashikhmin D V".to_owned(), "Ci = velvet(N, 0.5);".to_owned()),
        ("Charlie D V".to_owned(), "Ci = sheen_bsdf(N, 1, 0.5, \"model\", \"charlie_v\");".to_owned()),
    ];
    let file = bench.strip("charlie-ashikhmin-2018", &stage, &scripts)?;
    let mut series = Vec::new();
    for (label, script) in &scripts {
        let points = (1..=40).map(|k| {
            let cos = k as f32 / 40.0;
            albedos(script, cos).map(|a| (f64::from(cos), a[0]))
        });
        series.push((label.clone(), points.collect::<Result<Vec<_>, _>>()?));
    }
    let [narrow, _] = albedos("Ci = sheen_bsdf(N, 1, 0.1, \"model\", \"charlie_v\");", 0.01)?;
    let raw = |r: f64| largest(fast, [r, 0.0, 0.0, 0.0]);
    let velvet = series[0].1.iter().map(|p| p.1).fold(0.0, f64::max);
    let plot = Plot { title: "Directional albedo at r = 0.5", x: "cosine", y: "E", series: &series };
    let mut files = vec![file];
    files.extend(bench.plot("charlie-ashikhmin-2018-albedo", &plot)?);
    Ok(Figure {
        title: "Ashikhmin and Charlie with the fast visibility term (Narkowicz 2018)",
        says: "Charlie with the fast visibility term is a better looking, faster replacement of Ashikhmin's velvet.",
        measured: format!(
            "raw, Charlie's D·V reaches E = {:.2} at r = 0.1, {:.3} at r = 0.2 and {:.3} at r = 0.21; divided by its bound \
             it gives {narrow:.3} at r = 0.1 and cosine 0.01. Ashikhmin's stays below {velvet:.2} here.",
            raw(0.1),
            raw(0.2),
            raw(0.21)
        ),
        files,
    })
}
