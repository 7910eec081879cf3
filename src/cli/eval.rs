//! `overcoat eval`.

use super::input::{Evaluate, direction, in_tier};
use super::{Failure, Global, Outcome, output};
use crate::closure::Eval;
use crate::engine::Material;
use crate::globals::Globals;
use serde_json::{Value, json};
use std::path::Path;

pub fn run(global: &Global, file: &Path, wo: &str, wi: &[String]) -> Outcome {
    let wo = direction("--wo", wo)?;
    let wi = wi.iter().map(|w| direction("--wi", w)).collect::<Result<Vec<_>, _>>()?;
    let material = global.material(file, &[])?;
    let rows = in_tier!(material, evaluate(&material, wo, &wi))?;
    if global.json {
        let mut rows: Vec<Value> = rows.iter().map(|e| json!({"f_cos": e.f_cos, "pdf": e.pdf})).collect();
        return output::json(&if rows.len() == 1 { rows.remove(0) } else { json!({ "rows": rows }) });
    }
    let lines = rows.iter().map(|e| {
        let [r, g, b] = e.f_cos;
        format!("f·cos {r:.6} {g:.6} {b:.6}   pdf {:.6}\n", e.pdf)
    });
    output::write(&lines.collect::<String>())
}

fn evaluate<S: Evaluate>(material: &Material, wo: [f64; 3], wi: &[[f64; 3]]) -> Result<Vec<Eval<f64>>, Failure> {
    let bsdf = S::shade(material, &Globals::default(), wo.map(S::c))?;
    Ok(wi
        .iter()
        .map(|w| {
            let e = bsdf.eval(w.map(S::c));
            Eval { f_cos: e.f_cos.map(S::to_f64), pdf: e.pdf.to_f64() }
        })
        .collect())
}
