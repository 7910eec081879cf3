//! `overcoat albedo`.

use super::input::{Evaluate, in_tier};
use super::{Failure, Global, Outcome, output};
use crate::audit::{Albedo, Ledger, LobeShare, Side, Tolerance, albedo, breakdown, ledger};
use crate::closure::{Bsdf, ClosureTree};
use crate::engine::Material;
use crate::globals::Globals;
use crate::lobes::registry::LobeClass;
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct AlbedoArgs {
    /// The script; `-` reads stdin.
    file: PathBuf,
    /// Which direction is held: the viewer's, or the light's.
    #[arg(long, value_enum, default_value = "view")]
    side: SideArg,
    /// Cosines of the held direction to N; negative is below the surface.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, value_name = "A,B,…")]
    cos: Vec<f64>,
    /// Azimuth of the held direction from dPdu, in degrees.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_name = "DEGREES")]
    phi: f64,
    /// Also tell where the energy goes, lobe by lobe (with `--side view`).
    #[arg(long)]
    explain: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SideArg {
    View,
    Light,
}

impl SideArg {
    fn name(self) -> &'static str {
        match self {
            SideArg::View => "view",
            SideArg::Light => "light",
        }
    }
}

const DEFAULT_COSINES: [f64; 12] = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.01];
/// More lobes than this are not explained one by one.
const MAX_EXPLAINED: usize = 64;

const TOLERANCE: Tolerance = Tolerance { error: 2e-5, evaluations: 200_000 };

/// One measured direction.
struct Row {
    cos: f64,
    direction: [f64; 3],
    albedo: Albedo,
    explained: Option<Value>,
}

pub fn run(global: &Global, args: &AlbedoArgs) -> Outcome {
    let cosines = if args.cos.is_empty() { DEFAULT_COSINES.to_vec() } else { args.cos.clone() };
    if let Some(bad) = cosines.iter().find(|c| !(-1.0..=1.0).contains(*c)) {
        return Err(Failure::usage(format!("--cos {bad}: a cosine lies between -1 and 1")));
    }
    if !args.phi.is_finite() {
        return Err(Failure::usage(format!("--phi {}: expected an angle in degrees", args.phi)));
    }
    if args.explain && matches!(args.side, SideArg::Light) {
        return Err(Failure::usage("--explain looks at the view side; leave --side light out"));
    }
    let material = global.material(&args.file, &[])?;
    let rows = in_tier!(material, measure(&material, &cosines, args))?;
    if global.json {
        let rows: Vec<Value> = rows.iter().map(row_json).collect();
        return output::json(&json!({ "side": args.side.name(), "rows": rows }));
    }
    let mut text = format!("albedo, {} side\n     cos        r        g        b    error\n", args.side.name());
    for row in &rows {
        let [r, g, b] = row.albedo.value;
        let _ = writeln!(text, "{:8.4} {r:8.5} {g:8.5} {b:8.5}  {:.1e}", row.cos, row.albedo.error);
        if let Some(explained) = &row.explained {
            explain_text(explained, &mut text);
        }
    }
    output::write(&text)
}

fn measure<S: Evaluate>(material: &Material, cosines: &[f64], args: &AlbedoArgs) -> Result<Vec<Row>, Failure> {
    let globals = Globals::default();
    // Budgets depend on the script alone or on few points; whatever fails is told once, before integrating.
    S::shade(material, &globals, [S::zero(), S::zero(), S::one()])?;
    let subject = |wo: [S; 3]| S::shade(material, &globals, wo).unwrap_or_else(|_| crate::closure::Bsdf::black());
    let side = match args.side {
        SideArg::View => Side::View,
        SideArg::Light => Side::Light,
    };
    let tolerance = TOLERANCE;
    let rows = cosines.par_iter().map(|&cos| {
        let (sin, phi) = ((1.0 - cos * cos).max(0.0).sqrt(), args.phi.to_radians());
        let direction = [sin * phi.cos(), sin * phi.sin(), cos];
        let w = direction.map(S::c);
        let albedo = albedo(&subject, side, w, tolerance);
        let explained = args.explain.then(|| explain::<S>(material, &globals, w, &albedo, tolerance));
        Row { cos, direction, albedo, explained }
    });
    Ok(rows.collect())
}

/// Lobe by lobe what it scatters and what the layers above keep from it, then layer by layer, then what is absorbed.
pub(super) fn explain<S: Evaluate>(
    material: &Material,
    globals: &Globals,
    w: [S; 3],
    total: &Albedo,
    tolerance: Tolerance,
) -> Value {
    let seen = Globals { i: glam::Vec3::from_array(w.map(|x| -x.to_f32())), ..*globals };
    let black = |_| Bsdf::black();
    let Ok(tree) = material.tree(&seen) else { return Value::Null };
    let bsdf = S::shade(material, &seen, w).unwrap_or_else(black);
    if bsdf.lobe_count() > MAX_EXPLAINED {
        return json!({ "note": format!("{} lobes are too many to tell apart", bsdf.lobe_count()) });
    }
    let shares = breakdown(&|_| S::shade(material, &seen, w).unwrap_or_else(black), w, tolerance);
    let part = |tree: &ClosureTree| {
        let measured = |bsdf: &Bsdf<'_, S>| albedo(&|_| bsdf.clone(), Side::View, w, tolerance).value;
        S::with_part(material, tree, &seen, w, measured).unwrap_or_default()
    };
    let ledger = ledger(&tree, part, material.layering());
    explained(&bsdf, &shares, &ledger, total)
}

fn explained<S: Evaluate>(bsdf: &Bsdf<'_, S>, shares: &[LobeShare], ledger: &Ledger, total: &Albedo) -> Value {
    let minus = |a: [f64; 3], b: [f64; 3]| std::array::from_fn::<f64, 3, _>(|c| a[c] - b[c]);
    let lobes: Vec<Value> = shares
        .iter()
        .filter(|s| bsdf.lobe_kind(s.lobe).0.class() != LobeClass::Emission)
        .map(|s| {
            json!({
                "lobe": bsdf.lobe_kind(s.lobe).0.spec().name,
                "scattered": s.scattered.value,
                "kept_by_layers": minus(s.unlayered.value, s.scattered.value),
            })
        })
        .collect();
    let layers: Vec<Value> = ledger
        .layers
        .iter()
        .map(|l| {
            let top: Vec<&str> = l.top.iter().map(|k| k.spec().name).collect();
            json!({"top": top, "offered": l.offered, "taken": l.taken, "tint": l.tint, "lost": l.lost})
        })
        .collect();
    json!({
        "lobes": lobes,
        "layers": layers,
        "absorbed_by_weights": ledger.absorbed_by_weights,
        "absorbed_by_lobes": ledger.absorbed_by_lobes,
        "not_scattered": minus([1.0; 3], total.value),
    })
}

fn explain_text(explained: &Value, text: &mut String) {
    let triple =
        |v: &Value| (0..3).map(|c| format!("{:8.5}", v[c].as_f64().unwrap_or(0.0))).collect::<Vec<_>>().join(" ");
    let mut line = |v: &Value, what: &str| {
        let _ = writeln!(text, "         {} {what}", triple(v));
    };
    for lobe in explained["lobes"].as_array().into_iter().flatten() {
        let name = lobe["lobe"].as_str().unwrap_or("");
        line(&lobe["scattered"], &format!("scattered by {name}"));
        line(&lobe["kept_by_layers"], "  kept from it by the layers above");
    }
    for layer in explained["layers"].as_array().into_iter().flatten() {
        let names: Vec<&str> = layer["top"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let top = names.join(", ");
        line(&layer["tint"], &format!("withheld below {top} by the tint rule"));
        line(&layer["lost"], &format!("lost below {top}: passed by less than 1 - E"));
    }
    if let Some(note) = explained["note"].as_str() {
        let _ = writeln!(text, "         {note}");
    } else {
        line(&explained["absorbed_by_weights"], "absorbed by weights");
        line(&explained["absorbed_by_lobes"], "absorbed by lobes");
    }
}

fn row_json(row: &Row) -> Value {
    let mut value = json!({
        "cos": row.cos, "dir": row.direction, "albedo": row.albedo.value, "error": row.albedo.error,
    });
    if let Some(explained) = &row.explained {
        value["explain"] = explained.clone();
    }
    value
}
