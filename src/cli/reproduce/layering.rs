//! What each layering rule loses, and what it gains where it may.

use super::{Bench, Figure, engine_material};
use crate::audit::{Side, Tolerance, albedo, reciprocity_error};
use crate::cli::Failure;
use crate::closure::{Bsdf, LayeringRule};
use crate::engine::{Engine, Material};
use crate::globals::Globals;
use crate::preview::plot::Plot;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::fmt::Write;

const TOPS: &[(&str, &str)] = &[
    ("exact, r = 0.1", r#"sheen_bsdf(N, 1, 0.1, "model", "exact")"#),
    ("exact, r = 0.3", r#"sheen_bsdf(N, 1, 0.3, "model", "exact")"#),
    ("exact, r = 1", r#"sheen_bsdf(N, 1, 1, "model", "exact")"#),
    ("fit, unsoftened, r = 0.3", r#"sheen_bsdf(N, 1, 0.3, "softening", 0)"#),
];

const BASES: &[(&str, &str)] = &[
    ("Lambert", "diffuse(N)"),
    ("EON, r = 0.8", "eon(N, 1, 0.8)"),
    ("velvet, r = 0.3", "velvet(N, 0.3)"),
    ("GGX, α = 0.1", "microfacet_ggx(N, 0.1)"),
    ("GGX, α = 0.3", "microfacet_ggx(N, 0.3)"),
    ("GGX, α = 0.8", "microfacet_ggx(N, 0.8)"),
    (
        "EON + Lambert, colored",
        "color(0.5, 0.2, 0) * eon(N, color(1, 0.5, 0.2), 0.5) + color(0.5, 0.8, 1) * diffuse(N)",
    ),
    ("GGX + Lambert, colored", "color(0.5, 0.2, 0) * microfacet_ggx(N, 0.4) + color(0.5, 0.8, 1) * diffuse(N)"),
];

const COSINES: [f64; 12] = [1.0, 0.9, 0.75, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.01, 0.001];
const TOLERANCE: Tolerance = Tolerance { error: 2e-5, evaluations: 60_000 };

fn material(rule: LayeringRule, closure: &str) -> Result<Material, Failure> {
    engine_material(Engine::new().layering(rule), &format!("Ci = {closure};"))
}

/// Per cosine, by the side.
fn curve(material: &Material, side: Side) -> Vec<[f64; 3]> {
    let subject = |wo: [f32; 3]| material.shade(&Globals::default(), wo.into()).unwrap_or_else(|_| Bsdf::black());
    let of = |cos: &f64| {
        let w = [(1.0 - cos * cos).sqrt() as f32, 0.0, *cos as f32];
        albedo(&subject, side, w, TOLERANCE).value
    };
    COSINES.par_iter().map(of).collect()
}

pub fn losses(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let mut page = String::from(
        "| top | base | most lost by `min` | by `balanced` | largest albedo, `balanced` | reciprocity error |\n\
         |---|---|---|---|---|---|\n",
    );
    let (mut worst_min, mut worst_balanced, mut largest) = (0.0f64, 0.0f64, 0.0f64);
    for (top_name, top) in TOPS {
        let e_top = curve(&material(LayeringRule::Min, top)?, Side::View);
        for (base_name, base) in BASES {
            let e_base = curve(&material(LayeringRule::Min, base)?, Side::View);
            let layer = format!("layer({top}, {base})");
            let measure = |rule: LayeringRule| -> Result<(f64, f64, Material), Failure> {
                let material = material(rule, &layer)?;
                let (mut lost, mut most) = (0.0f64, 0.0f64);
                for side in [Side::View, Side::Light] {
                    for (k, e) in curve(&material, side).iter().enumerate() {
                        let alpha = 1.0 - e_top[k][0].max(e_top[k][1]).max(e_top[k][2]);
                        for c in 0..3 {
                            lost = lost.max(e_top[k][c] + alpha * e_base[k][c] - e[c]);
                            most = most.max(e[c]);
                        }
                    }
                }
                Ok((lost, most, material))
            };
            let (min, _, _) = measure(LayeringRule::Min)?;
            let (balanced, most, material) = measure(LayeringRule::Balanced)?;
            let subject =
                |wo: [f32; 3]| material.shade(&Globals::default(), wo.into()).unwrap_or_else(|_| Bsdf::black());
            let (reciprocity, ..) = reciprocity_error(&subject, 10_000, &mut Pcg64Mcg::seed_from_u64(bench.args.seed));
            let _ = writeln!(
                page,
                "| {top_name} | {base_name} | {min:.4} | {balanced:.5} | {most:.5} | {reciprocity:.0e} |"
            );
            worst_min = worst_min.max(min);
            worst_balanced = worst_balanced.max(balanced);
            largest = largest.max(most);
        }
    }
    bench.write("layering-losses.md", &page)?;
    let mut files = plot(bench)?;
    files.push("layering-losses.md".into());
    Ok(Figure {
        title: "What a layer loses (Conty & Kulla 2017, §5; Kelemen & Szirmay-Kalos 2001)",
        says: "scaling the nested lobe by the smaller of two factors keeps energy and reciprocity; what it loses is not \
               told.",
        measured: format!(
            "over {} pairs of a reciprocal top and a base, `min` loses up to {worst_min:.3} and `balanced` up to \
             {worst_balanced:.1e}; the largest albedo under `balanced` is {largest:.5}. The table is in \
             layering-losses.md.",
            TOPS.len() * BASES.len()
        ),
        files,
    })
}

/// Albedo of a white base below the exact sheen, by rule and side.
fn plot(bench: &Bench<'_>) -> Result<Vec<String>, Failure> {
    let layer = r#"layer(sheen_bsdf(N, 1, 0.5, "model", "exact"), diffuse(N))"#;
    let mut series = Vec::new();
    for (name, rule, side) in [
        ("min", LayeringRule::Min, Side::View),
        ("balanced", LayeringRule::Balanced, Side::View),
        ("view, seen from the light", LayeringRule::View, Side::Light),
    ] {
        let values = curve(&material(rule, layer)?, side);
        series.push((name.to_owned(), COSINES.iter().zip(values).map(|(c, e)| (*c, e[0])).collect()));
    }
    let title = "A white base below the exact sheen, r = 0.5";
    bench.plot("layering", &Plot { title, x: "cosine", y: "albedo", series: &series })
}
