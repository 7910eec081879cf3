//! How much noise each lobe's sampling leaves, against directions drawn uniformly over the hemisphere.

use super::{Bench, Figure, material};
use crate::cli::Failure;
use crate::closure::Bsdf;
use crate::globals::Globals;
use std::fmt::Write;

/// Scripts with a `{}` for the parameter that is varied, and its values.
const LOBES: &[(&str, &str, &[f64])] = &[
    ("diffuse", "Ci = diffuse(N);", &[0.0]),
    ("oren_nayar", "Ci = oren_nayar(N, {});", &[0.3, 1.0]),
    ("eon", "Ci = eon(N, 1, {});", &[0.3, 1.0]),
    ("sheen conty_kulla", "Ci = sheen_bsdf(N, 1, {});", &[0.1, 0.3, 1.0]),
    ("sheen refit", "Ci = sheen_bsdf(N, 1, {}, \"model\", \"refit\");", &[0.1, 0.3, 1.0]),
    ("sheen exact", "Ci = sheen_bsdf(N, 1, {}, \"model\", \"exact\");", &[0.1, 0.3, 1.0]),
    ("sheen charlie_v", "Ci = sheen_bsdf(N, 1, {}, \"model\", \"charlie_v\");", &[0.1, 0.3, 1.0]),
    ("sheen zeltner", "Ci = sheen_bsdf(N, 1, {}, \"model\", \"zeltner\");", &[0.1, 0.3, 1.0]),
    ("velvet", "Ci = velvet(N, {});", &[0.1, 0.3, 1.0]),
    ("fabric", "Ci = fabric(N, dPdu, {});", &[0.0, 0.5, 1.0]),
    ("thread", "Ci = thread(N, dPdu, color(0.3), 1.46, 0.3, {}, 20);", &[5.0, 12.0, 30.0]),
    (
        "microcylinder, flat, gamma_v1",
        "Ci = microcylinder(N, dPdu, color(0.3), 1.46, 0.3, 5, {}, 0.5, 0, color(0.3), 1.46, 0.3, 12, 24, 0.5, 0);",
        &[5.0, 24.0],
    ),
    ("microcylinder linen", "Ci = microcylinder(N, dPdu, \"linen\");", &[0.0]),
    ("microcylinder satin", "Ci = microcylinder(N, dPdu, \"satin\");", &[0.0]),
    ("microcylinder shot_silk", "Ci = microcylinder(N, dPdu, \"shot_silk\");", &[0.0]),
];

const DEGREES: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 87.0];

pub fn table(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let mut csv = String::from("lobe,parameter,degrees,variance,variance_uniform,ratio\n");
    let mut page = String::from("| lobe | parameter |");
    DEGREES.iter().for_each(|d| {
        let _ = write!(page, " {d}° |");
    });
    let _ = write!(page, "\n|---|---|{}\n", "---|".repeat(DEGREES.len()));
    let mut better = (0, 0);
    for (lobe, script, values) in LOBES {
        for value in *values {
            let material = material(&script.replace("{}", &value.to_string()))?;
            let _ = write!(page, "| {lobe} | {} |", if script.contains("{}") { value.to_string() } else { "–".into() });
            for degrees in DEGREES {
                let (sin, cos) = (degrees.to_radians() as f32).sin_cos();
                let bsdf = material.shade(&Globals::default(), glam::vec3(sin * 0.8, sin * 0.6, cos))?;
                let [own, uniform] = variances(&bsdf);
                better = (better.0 + usize::from(own <= uniform), better.1 + 1);
                let ratio = if own > 1e-9 * uniform.max(1e-3) { format!("{:.1}", uniform / own) } else { "∞".into() };
                let _ = write!(page, " {ratio} |");
                let _ = writeln!(csv, "{lobe},{value},{degrees},{own},{uniform},{}", uniform / own.max(1e-12));
            }
            page.push('\n');
        }
    }
    bench.write("sampling-variance.csv", &csv)?;
    bench.write("sampling-variance.md", &page)?;
    Ok(Figure {
        title: "Variance of f·cos/pdf: uniform hemisphere sampling over the lobe's own",
        says: "plain uniform sampling of the upper hemisphere is more effective for sheen than sampling micronormals \
               (Conty & Kulla 2017, §2).",
        measured: format!(
            "the lobes' own sampling has the smaller variance in {} of {} cases; the table is in sampling-variance.md.",
            better.0, better.1
        ),
        files: vec!["sampling-variance.csv".into()],
    })
}

/// Relative variance of f·cos/pdf under the lobe's own sampling and under uniform sampling of the hemisphere.
pub(in crate::cli) fn variances(bsdf: &Bsdf<'_>) -> [f64; 2] {
    const SIDE: u32 = 256;
    let (mut own, mut uniform) = (Moments::default(), Moments::default());
    // A rank-1 lattice fills the unit square evenly; the third number chooses among lobes.
    let count = SIDE * SIDE;
    for k in 0..count {
        let (a, b) = ((k as f64 + 0.5) / f64::from(count), (f64::from(k) * 0.618_033_988_749_895).fract());
        let chosen = (f64::from(k) * 0.754_877_666_246_693).fract().min(1.0 - 1e-7);
        let weight = bsdf.sample([a as f32, b as f32, chosen as f32]).map_or(0.0, |s| f64::from(s.weight[0]));
        own.add(weight);
        let (z, phi) = (a, std::f64::consts::TAU * b);
        let r = (1.0 - z * z).sqrt();
        let f = bsdf.eval([(r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32]).f_cos[0];
        uniform.add(f64::from(f) * std::f64::consts::TAU);
    }
    [own.relative_variance(), uniform.relative_variance()]
}

#[derive(Default)]
struct Moments {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, x: f64) {
        self.count += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    fn relative_variance(&self) -> f64 {
        let mean = self.sum / self.count;
        if mean <= 0.0 { 0.0 } else { (self.squares / self.count / (mean * mean) - 1.0).max(0.0) }
    }
}
