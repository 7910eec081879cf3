//! The fabric talk of 2017, figures 2 and 3.

use super::{Bench, Figure, material};
use crate::audit::{Side, Tolerance, albedo};
use crate::cli::Failure;
use crate::closure::{Bsdf, Eval, Sample, SampleFlags};
use crate::engine::{Material, ShadeError};
use crate::globals::Globals;
use crate::lobes::Rgb32;
use crate::lobes::fabric::normalization;
use crate::preview::plot::Plot;
use crate::preview::{Image, RenderSettings, Scatter, Scene, Surface, lamp};
use glam::{Vec3, vec3};

fn exponent(alpha: f64) -> f64 {
    1.0 + 29.0 * (1.0 - alpha) * (1.0 - alpha)
}

pub fn furnace(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let mut series: Vec<(String, Vec<(f64, f64)>)> = vec![
        ("raw, facing".into(), vec![]),
        ("raw, 60° along the thread".into(), vec![]),
        ("normalised, facing".into(), vec![]),
        ("normalised, 60° along the thread".into(), vec![]),
    ];
    let globals = Globals::default();
    for step in 0..=16 {
        let alpha = 0.2 + 0.05 * f64::from(step);
        let material = material(&format!("Ci = fabric(N, dPdu, {alpha});"))?;
        let subject = |wo: [f32; 3]| material.shade(&globals, wo.into()).unwrap_or_else(|_| Bsdf::black());
        let angles = [0.0f32, 60.0].map(f32::to_radians);
        for (k, angle) in angles.into_iter().enumerate() {
            let e = albedo(&subject, Side::View, [angle.sin(), 0.0, angle.cos()], Tolerance::default()).max();
            // The lobe divides by its constant; multiplying brings the raw one back.
            series[k].1.push((alpha, e * normalization(exponent(alpha))));
            series[2 + k].1.push((alpha, e));
        }
    }
    let span = |s: &[(f64, f64)]| {
        let values = || s.iter().map(|p| p.1);
        (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max))
    };
    let (before, after) = (span(&series[0].1), span(&series[2].1));
    let plot = Plot { title: "Furnace", x: "roughness α", y: "directional albedo", series: &series };
    Ok(Figure {
        title: "Fabric in the furnace, before and after normalisation (fabric talk 2017, figure 2)",
        says: "reflected energy grows with roughness without normalisation, and is consistent with it.",
        measured: format!(
            "facing, {:.2} to {:.2} before and {:.2} to {:.2} after; the constant includes the cosine, which the talk's \
             leaves out.",
            before.0, before.1, after.0, after.1
        ),
        files: bench.plot("fabric-2-furnace", &plot)?,
    })
}

/// A material whose every direction is drawn uniformly over the hemisphere.
struct Uniformly<'a>(&'a Material);

struct UniformScatter<'a> {
    bsdf: Bsdf<'a>,
    n: Vec3,
}

impl Surface for Uniformly<'_> {
    type Scatter<'b>
        = UniformScatter<'b>
    where
        Self: 'b;

    fn shade(&self, globals: &Globals, wo: Vec3) -> Result<UniformScatter<'_>, ShadeError> {
        Ok(UniformScatter { bsdf: self.0.shade(globals, wo)?, n: globals.n })
    }

    fn see_through(&self) -> bool {
        false
    }
}

impl Scatter for UniformScatter<'_> {
    fn eval(&self, wi: Vec3) -> Eval {
        let pdf = if wi.dot(self.n) > 0.0 { 0.5 * std::f32::consts::FRAC_1_PI } else { 0.0 };
        Eval { pdf, ..self.bsdf.eval(wi) }
    }

    fn sample(&self, u: [f32; 3]) -> Option<Sample> {
        let (t, b) = self.n.any_orthonormal_pair();
        let (sin, cos) = (std::f32::consts::TAU * u[1]).sin_cos();
        let r = (1.0 - u[0] * u[0]).max(0.0).sqrt();
        let wi = t * (r * cos) + b * (r * sin) + self.n * u[0];
        let Eval { f_cos, pdf } = self.eval(wi);
        let weight = f_cos.map(|f| f / pdf);
        (pdf > 0.0).then(|| Sample { wi: wi.into(), f_cos, pdf, weight, flags: SampleFlags::default(), eta: 1.0 })
    }

    fn emission(&self) -> Rgb32 {
        [0.0; 3]
    }

    fn straight(&self) -> Rgb32 {
        [0.0; 3]
    }
}

/// Mean squared error of a pixel, from two pictures that differ in their seed only.
fn noise(a: &Image, b: &Image) -> f64 {
    let squares = a.data().iter().zip(b.data()).map(|(a, b)| f64::from(a - b) * f64::from(a - b));
    squares.sum::<f64>() / (2 * a.data().len()) as f64
}

pub fn sampling(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let mut ratios = Vec::new();
    let mut files = Vec::new();
    for alpha in [0.0, 0.2, 0.5] {
        let material = material(&format!("Ci = fabric(N, dPdu, {alpha});"))?;
        let mut noises = [0.0; 2];
        let mut shown = Vec::new();
        for seed in 0..2 {
            let settings = RenderSettings {
                spp: bench.args.spp.min(16),
                seed: bench.args.seed + seed,
                // The lights are found by the material's own samples alone.
                sample_env: false,
                max_depth: 1,
                ..bench.settings(Scene::Sphere)
            };
            let stage = bench.stage(&settings, Some(lamp(vec3(-0.5, 0.7, 0.7), 25.0)))?;
            shown.push([bench.picture(&stage, &Uniformly(&material))?, bench.picture(&stage, &material)?]);
        }
        for k in 0..2 {
            noises[k] = noise(&shown[0][k], &shown[1][k]);
        }
        ratios.push(format!("{:.1} at α = {alpha}", noises[0] / noises[1]));
        let panels = [(&shown[0][0], "uniform"), (&shown[0][1], "importance")];
        let strip = crate::preview::strip::strip(&panels, 0.0).ok_or_else(|| Failure::usage("no pictures"))?;
        let file = format!("fabric-3-sampling-{alpha}.png");
        crate::preview::output::save(&strip, &bench.args.dir.join(&file), 0.0)
            .map_err(|e| Failure::usage(e.to_string()))?;
        files.push(file);
    }
    Ok(Figure {
        title: "Uniform against importance sampling, equal samples (fabric talk 2017, figure 3)",
        says: "uniform sampling needs 6 to 8 times the samples for a clean render at low roughness.",
        measured: format!("samples for equal noise, uniform over importance: {}.", ratios.join(", ")),
        files,
    })
}
