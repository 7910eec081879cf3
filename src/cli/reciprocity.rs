//! `overcoat reciprocity`: f(ωo, ωi) against f(ωi, ωo), and on request samples against their density.

use super::input::{Evaluate, in_tier};
use super::{Failure, Global, Outcome, output};
use crate::audit::{Chi2, chi2, reciprocity_error};
use crate::closure::Bsdf;
use crate::engine::{Material, Tier};
use crate::globals::Globals;
use crate::ir::GlobalVar;
use crate::lobes::registry::LobeClass;
use clap::Args;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct ReciprocityArgs {
    /// The script; `-` reads stdin.
    file: PathBuf,
    /// Random pairs of directions, on the whole sphere.
    #[arg(long, default_value_t = 10_000)]
    pairs: usize,
    /// Same seed, same pairs.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Also test whether samples follow their density, from a few directions.
    #[arg(long)]
    chi2: bool,
}

/// Cosines of ωo at which samples are tested, how many samples, and below which probability the test fails.
const COSINES: [f64; 4] = [0.95, 0.5, 0.1, -0.5];
const SAMPLES: usize = 60_000;
const LEVEL: f64 = 1e-5;

struct Found {
    error: f64,
    wo: [f64; 3],
    wi: [f64; 3],
    chi2: Vec<(f64, Chi2)>,
}

pub fn run(global: &Global, args: &ReciprocityArgs) -> Outcome {
    let material = global.material(&args.file, &[])?;
    let reasons = in_tier!(material, reasons(&material))?;
    let found = in_tier!(material, measure(&material, args))?;
    let claims = reasons.is_empty();
    // f itself follows the other way round to single precision at best.
    let limit = if material.tier() == Tier::Reference { 1e-9 } else { 1e-3 };
    let tests: Vec<Value> = found.chi2.iter().map(|(cos, t)| chi2_json(*cos, t)).collect();
    if global.json {
        let mut document = json!({
            "pairs": args.pairs, "seed": args.seed, "error": found.error, "wo": found.wo, "wi": found.wi,
            "claims_reciprocity": claims, "reasons": reasons,
        });
        if args.chi2 {
            document["chi2"] = json!(tests);
        }
        output::json(&document)?;
    } else {
        output::write(&text(&found, &reasons))?;
    }
    if claims && found.error > limit {
        return Err(Failure::Check(format!("claims to be reciprocal and differs by {:.1e}", found.error)));
    }
    match found.chi2.iter().find(|(_, t)| !t.passes(LEVEL)) {
        Some((cos, t)) => Err(Failure::Check(format!("samples do not follow the pdf at cosine {cos}: {t:?}"))),
        None => Ok(()),
    }
}

/// Why the material does not claim to be reciprocal; empty if it does.
fn reasons<S: Evaluate>(material: &Material) -> Result<Vec<String>, Failure> {
    let globals = Globals::default();
    let tree = material.tree(&globals)?;
    let mut reasons: Vec<String> = tree
        .lobes()
        .filter(|(_, kind, values)| kind.class() == LobeClass::Scatter && !kind.reciprocal(values))
        .map(|(_, kind, _)| format!("{} is not reciprocal with these parameters", kind.spec().name))
        .collect();
    reasons.dedup();
    if !S::shade(material, &globals, [S::zero(), S::zero(), S::one()])?.symmetric_layers() {
        reasons.push("the layering rule looks at ωo alone".into());
    }
    if material.program().globals().contains(&GlobalVar::I) {
        reasons.push("the script reads I".into());
    }
    Ok(reasons)
}

fn measure<S: Evaluate>(material: &Material, args: &ReciprocityArgs) -> Result<Found, Failure> {
    let globals = Globals::default();
    S::shade(material, &globals, [S::zero(), S::zero(), S::one()])?;
    let subject = |wo: [S; 3]| S::shade(material, &globals, wo).unwrap_or_else(|_| Bsdf::black());
    let mut rng = Pcg64Mcg::seed_from_u64(args.seed);
    let (error, wo, wi) = reciprocity_error(&subject, args.pairs, &mut rng);
    let cosines = if args.chi2 { &COSINES[..] } else { &[] };
    let test = |cos: &f64| {
        // Off the axes, so that no azimuth is special.
        let sin = (1.0 - cos * cos).sqrt();
        (*cos, chi2(&subject, [0.8 * sin, 0.6 * sin, *cos].map(S::c), SAMPLES, &mut rng))
    };
    let chi2 = cosines.iter().map(test).collect();
    Ok(Found { error, wo: wo.map(S::to_f64), wi: wi.map(S::to_f64), chi2 })
}

fn chi2_json(cos: f64, t: &Chi2) -> Value {
    json!({
        "cos": cos, "p_value": t.p_value, "statistic": t.statistic, "degrees": t.degrees,
        "pdf_integral": t.pdf_integral, "lost": t.lost, "delta": t.delta, "pdf_mismatch": t.pdf_mismatch,
        "passes": t.passes(LEVEL),
    })
}

fn text(found: &Found, reasons: &[String]) -> String {
    let mut text = String::new();
    let triple = |v: [f64; 3]| format!("({:.4}, {:.4}, {:.4})", v[0], v[1], v[2]);
    let _ = writeln!(text, "largest relative difference {:.2e}", found.error);
    if found.error > 0.0 {
        let _ = writeln!(text, "  at ωo {}, ωi {}", triple(found.wo), triple(found.wi));
    }
    match reasons {
        [] => text.push_str("claims to be reciprocal\n"),
        reasons => {
            let _ = writeln!(text, "does not claim to be reciprocal: {}", reasons.join("; "));
        }
    }
    for (cos, t) in &found.chi2 {
        let verdict = if t.passes(LEVEL) { "follow" } else { "do not follow" };
        let _ = writeln!(
            text,
            "cosine {cos}: samples {verdict} the pdf, p = {:.3}, χ² {:.0} of {} degrees, {:.2} % lost",
            t.p_value,
            t.statistic,
            t.degrees,
            100.0 * t.lost
        );
    }
    text
}
