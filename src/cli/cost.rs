//! `overcoat cost`: what the material makes a renderer pay, as it is and before specialisation.

use super::{Failure, Global, Outcome, output};
use crate::audit::clock::{self, nanoseconds};
use crate::closure::{ClosureTree, Scratch};
use crate::engine::Material;
use crate::globals::Globals;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

pub fn run(global: &Global, file: &Path) -> Outcome {
    let shader = global.shader(file)?;
    let mut cost = measure(&global.specialise(&shader, &[])?)?;
    cost["unspecialised"] = measure(&shader.unspecialised())?;
    if global.json {
        return output::json(&cost);
    }
    let mut text = String::new();
    describe(&cost, "specialised", &mut text);
    describe(&cost["unspecialised"], "unspecialised", &mut text);
    output::write(&text)
}

pub(super) fn measure(material: &Material) -> Result<Value, Failure> {
    let program = material.program();
    let lobes: BTreeSet<&str> = program.sites().iter().map(|s| s.kind.spec().name).collect();
    let globals: Vec<&str> = program.globals().iter().map(|g| g.name()).collect();
    let globals_at = Globals { u: 0.3, v: 0.6, ..Globals::default() };
    let wo = glam::vec3(0.48, 0.36, 0.8);
    let bsdf = material.shade(&globals_at, wo)?;

    let mut tree = ClosureTree::new();
    let shade = nanoseconds(|| {
        let _ = black_box(program.shade(black_box(&globals_at), &mut tree));
    });
    // Into memory that is used again, as renderers do.
    let mut scratch = Scratch::new();
    let setup = nanoseconds(|| {
        black_box(material.shade_in(black_box(&globals_at), *black_box(&wo), &mut scratch).is_ok());
    });
    let ((eval, sample), batch) = (clock::calls(&bsdf), clock::batch(&bsdf));
    let round = |x: f64| (x * 10.0).round() / 10.0;
    Ok(json!({
        "constant": program.is_constant(),
        "globals": globals,
        "lobes": lobes,
        "bytes": {"bsdf": bsdf.bytes(), "tables": material.table_bytes()},
        "bake_ms": round(material.bake_time().as_secs_f64() * 1e3),
        "ns": {
            "shade": round(shade), "flatten": round((setup - shade).max(0.0)), "eval": round(eval),
            "sample": round(sample), "eval_batch": round(batch),
        },
    }))
}

fn describe(cost: &Value, title: &str, text: &mut String) {
    let list = |v: &Value| {
        let names: Vec<&str> = v.as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    };
    let (ns, bytes) = (&cost["ns"], &cost["bytes"]);
    let varies = if cost["constant"] == true { "the same tree everywhere" } else { "varies from point to point" };
    let _ = writeln!(text, "{title}: {varies}");
    let _ = writeln!(text, "  lobes    {}", list(&cost["lobes"]));
    let _ = writeln!(text, "  globals  {}", list(&cost["globals"]));
    let _ = writeln!(
        text,
        "  bytes    {} per BSDF, {} of tables, baked in {} ms",
        bytes["bsdf"], bytes["tables"], cost["bake_ms"]
    );
    let _ = writeln!(
        text,
        "  ns       shade {}, flatten {}, eval {}, sample {}, eval in a batch {}",
        ns["shade"], ns["flatten"], ns["eval"], ns["sample"], ns["eval_batch"]
    );
}
