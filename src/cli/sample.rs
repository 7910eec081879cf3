//! `overcoat sample`.

use super::input::{Evaluate, direction, in_tier};
use super::{Global, Outcome, output};
use crate::engine::Material;
use crate::globals::Globals;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Rows that are held in memory at a time.
const CHUNK: u64 = 4096;

pub fn run(global: &Global, file: &Path, wo: &str, count: u64, seed: u64) -> Outcome {
    let wo = direction("--wo", wo)?;
    let material = global.material(file, &[])?;
    in_tier!(material, draw(global, &material, wo, count, seed))
}

fn draw<S: Evaluate>(global: &Global, material: &Material, wo: [f64; 3], count: u64, seed: u64) -> Outcome {
    let bsdf = S::shade(material, &Globals::default(), wo.map(S::c))?;
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut rows: Vec<Value> = Vec::new();
    let mut text = String::from("wi_x,wi_y,wi_z,f_r,f_g,f_b,pdf,delta\n");
    for index in 0..count {
        let u = std::array::from_fn(|_| S::c(f64::from(rng.random::<f32>())));
        // A lost sample is a row of zeros.
        let (wi, f, pdf, delta) = bsdf.sample(u).map_or(([0.0; 3], [0.0; 3], 0.0, false), |s| {
            (s.wi.map(S::to_f64), s.f_cos.map(S::to_f64), s.pdf.to_f64(), s.flags.delta)
        });
        if global.json {
            let ([wi_x, wi_y, wi_z], [f_r, f_g, f_b]) = (wi, f);
            rows.push(json!({
                "wi_x": wi_x, "wi_y": wi_y, "wi_z": wi_z, "f_r": f_r, "f_g": f_g, "f_b": f_b, "pdf": pdf,
                "delta": u8::from(delta),
            }));
            continue;
        }
        let _ = writeln!(text, "{},{},{},{},{},{},{},{}", wi[0], wi[1], wi[2], f[0], f[1], f[2], pdf, u8::from(delta));
        if index % CHUNK == CHUNK - 1 {
            output::write(&text)?;
            text.clear();
        }
    }
    if global.json { output::json(&json!({ "rows": rows })) } else { output::write(&text) }
}
