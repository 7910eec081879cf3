//! `overcoat extremes`: numerical stability of every lobe at the ends of its parameters and of its angles.

use super::{Failure, Global, Outcome, output};
use crate::audit::extremes::{Extremes, Place, Row, Setting};
use crate::lobes::LobeKind;
use crate::lobes::registry::ParamTy;
use clap::Args;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fmt::Write;

#[derive(Args, Debug)]
pub struct ExtremesArgs {
    /// Same seed, same cases.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Pairs of directions per lobe, setting, layering rule and tier; rounded up to whole blocks of 128.
    #[arg(long, default_value_t = 1024)]
    cases: usize,
    /// Only this lobe. Repeatable.
    #[arg(long, value_name = "NAME")]
    lobe: Vec<String>,
}

pub fn run(global: &Global, args: &ExtremesArgs) -> Outcome {
    let kinds = chosen(&args.lobe)?;
    let campaign = Extremes { seed: args.seed, cases: args.cases };
    let rows: Vec<Row> = kinds.par_iter().flat_map_iter(|k| campaign.measure(*k)).collect();
    let faults: u64 = rows.iter().map(|r| r.faults).sum();
    if global.json {
        let rows: Vec<Value> = rows.iter().map(row_json).collect();
        output::json(&json!({ "seed": args.seed, "cases": args.cases, "faults": faults, "rows": rows }))?;
    } else {
        output::write(&table(&rows))?;
    }
    match faults {
        0 => Ok(()),
        n => Err(Failure::Check(format!("{n} results are infinite, undefined or negative"))),
    }
}

/// The lobes of these names; all if there are none.
pub fn chosen(names: &[String]) -> Result<Vec<LobeKind>, Failure> {
    if names.is_empty() {
        return Ok(LobeKind::ALL.to_vec());
    }
    let find = |name: &String| {
        LobeKind::by_name(name).ok_or_else(|| {
            let likely = LobeKind::ALL.iter().map(|k| k.spec().name);
            let likely = likely.max_by(|a, b| strsim::jaro_winkler(a, name).total_cmp(&strsim::jaro_winkler(b, name)));
            Failure::usage(format!("no lobe `{name}`; did you mean `{}`?", likely.unwrap_or_default()))
        })
    };
    names.iter().map(find).collect()
}

fn rule(row: &Row) -> String {
    if row.setting == Setting::Alone { "-".to_owned() } else { output::word(row.rule) }
}

fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<27} {:<13} {:<9} {:<10} {:>7} {:>7} {:>8} {:>9} {:>9}\n",
        "lobe", "setting", "layering", "tier", "pairs", "faults", "compared", "error", "beyond"
    );
    for r in rows {
        let _ = writeln!(
            text,
            "{:<27} {:<13} {:<9} {:<10} {:>7} {:>7} {:>8} {:>9.1e} {:>9.1e}",
            r.lobe.spec().name,
            r.setting.name(),
            rule(r),
            output::word(r.tier),
            r.evaluations,
            r.faults,
            r.compared,
            r.error.error,
            r.beyond.error,
        );
    }
    text.push_str(
        "\nerror: |f - truth| over the brightest channel; beyond: less what rounding the directions makes of it\n",
    );
    for r in rows {
        if let Some(place) = &r.fault {
            let _ = writeln!(text, "\nFAULT {}", described(r, place));
        }
    }
    // Of each lobe the row that is off by most, for single and for double precision.
    for kind in LobeKind::ALL {
        for double in [false, true] {
            let of = |r: &&Row| r.lobe == *kind && (r.tier == crate::engine::Tier::Reference) == double;
            let worst = rows.iter().filter(of).max_by(|a, b| a.beyond.error.total_cmp(&b.beyond.error));
            if let Some((r, place)) = worst.and_then(|r| Some((r, r.beyond.at.as_ref()?))) {
                let _ = writeln!(text, "\n{:.1e} beyond rounding: {}", r.beyond.error, described(r, place));
            }
        }
    }
    text
}

fn described(r: &Row, place: &Place) -> String {
    let Place { what, weight, wo, wi, found, truth, .. } = place;
    let parameters: Vec<String> = parameters(r, place).into_iter().map(|(name, v)| format!("{name} {v:?}")).collect();
    format!(
        "{} {}, {}, {}\n  {what} {found:?} for {truth:?}\n  weight {weight:e}, {}\n  wo {wo:?}\n  wi {wi:?}",
        r.lobe.spec().name,
        r.setting.name(),
        rule(r),
        output::word(r.tier),
        parameters.join(", ")
    )
}

/// What the lobe was given, without its directions.
fn parameters<'p>(r: &Row, place: &'p Place) -> Vec<(&'static str, &'p [f32])> {
    let mut start = 0;
    let mut named = Vec::new();
    for p in r.lobe.spec().params {
        let values = &place.values[start..start + p.ty.slots()];
        start += p.ty.slots();
        if !matches!(p.ty, ParamTy::Normal | ParamTy::Vector) {
            named.push((p.name, values));
        }
    }
    named
}

fn row_json(r: &Row) -> Value {
    // JSON knows neither infinity nor NaN: parameters that are, and what came of them, become words.
    let number = |x: f64| if x.is_finite() { json!(x) } else { json!(x.to_string()) };
    let single = |x: f32| if x.is_finite() { output::number(x) } else { json!(x.to_string()) };
    let place = |p: &Place| {
        let given: serde_json::Map<String, Value> = parameters(r, p)
            .into_iter()
            .map(|(name, v)| (name.to_owned(), v.iter().map(|x| single(*x)).collect::<Vec<_>>().into()))
            .collect();
        json!({
            "what": p.what, "params": given, "weight": single(p.weight), "wo": p.wo.map(number), "wi": p.wi.map(number),
            "found": p.found.map(number), "truth": p.truth.map(number),
        })
    };
    json!({
        "lobe": r.lobe.spec().name, "setting": r.setting.name(), "layering": rule(r), "tier": output::word(r.tier),
        "pairs": r.evaluations, "faults": r.faults, "fault": r.fault.as_ref().map(place), "compared": r.compared,
        "error": r.error.error, "error_at": r.error.at.as_ref().map(place),
        "beyond_rounding": r.beyond.error, "beyond_rounding_at": r.beyond.at.as_ref().map(place),
    })
}
