//! One strip per cloth lobe: low, middle and high values of its main parameter.

use super::{Bench, Figure};
use crate::cli::Failure;
use crate::preview::Scene;

const GROUND: &str = "color(0.25, 0.02, 0.03) * diffuse(N)";

/// File name, label of the parameter, script with `{}` for its value, values.
const STRIPS: &[(&str, &str, &str, &[&str])] = &[
    ("sheen", "roughness", "Ci = sheen(GROUND, N, 1, {});", &["0.1", "0.3", "1"]),
    ("sheen-refit", "roughness", "Ci = sheen(GROUND, N, 1, {}, \"model\", \"refit\");", &["0.1", "0.3", "1"]),
    ("sheen-exact", "roughness", "Ci = sheen(GROUND, N, 1, {}, \"model\", \"exact\");", &["0.1", "0.3", "1"]),
    ("sheen-charlie_v", "roughness", "Ci = sheen(GROUND, N, 1, {}, \"model\", \"charlie_v\");", &["0.1", "0.3", "1"]),
    ("sheen-zeltner", "roughness", "Ci = sheen(GROUND, N, 1, {}, \"model\", \"zeltner\");", &["0.1", "0.3", "1"]),
    ("velvet", "roughness", "Ci = layer(velvet(N, {}), GROUND);", &["0.1", "0.3", "1"]),
    ("fabric", "roughness", "Ci = color(0.7, 0.1, 0.15) * fabric(N, dPdu, {});", &["0", "0.5", "1"]),
    ("thread", "gamma_s", "Ci = thread(N, dPdu, color(0.5, 0.1, 0.1), 1.46, 0.3, {}, 24);", &["3", "12", "30"]),
    (
        "microcylinder",
        "",
        "Ci = 2 * microcylinder(N, dPdu, \"{}\");",
        &["linen", "silk_crepe", "satin", "shot_silk", "velvet"],
    ),
    (
        "microcylinder-offset",
        "offset1",
        "Ci = microcylinder(N, dPdu, color(0.5, 0.1, 0.1), 1.46, 0.2, 5, 10, 0.7, {}, color(0.3), 1.46, 0.5, 12, 24, 0.3, 0);",
        &["0", "25", "60"],
    ),
    ("eon", "roughness", "Ci = eon(N, color(0.6, 0.3, 0.2), {});", &["0", "0.5", "1"]),
    ("oren_nayar", "sigma", "Ci = color(0.6, 0.3, 0.2) * oren_nayar(N, {});", &["0", "0.4", "1.2"]),
];

pub fn strips(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let stage = bench.stage(&bench.settings(Scene::Sphere), None)?;
    let mut files = Vec::new();
    for (name, parameter, script, values) in STRIPS {
        let panels: Vec<(String, String)> = values
            .iter()
            .map(|v| (format!("{parameter} {v}").trim().to_owned(), script.replace("GROUND", GROUND).replace("{}", v)))
            .collect();
        files.push(bench.strip(&format!("lobe-{name}"), &stage, &panels)?);
    }
    Ok(Figure {
        title: "The cloth lobes at low, middle and high values",
        says: "each source shows its lobe at a few values; these are ours, under one light.",
        measured: format!("{} strips.", files.len()),
        files,
    })
}
