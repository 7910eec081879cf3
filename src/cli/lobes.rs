//! `overcoat lobes`.

use super::output::{number, numbers};
use super::{Failure, Global, Outcome, output};
use crate::lobes::forms;
use crate::lobes::registry::{Form, ParamSpec, ParamTy};
use serde_json::{Value, json};
use std::fmt::Write;

pub fn run(global: &Global, name: Option<&str>) -> Outcome {
    let chosen: Vec<Form> = forms().filter(|f| name.is_none_or(|n| f.name == n)).collect();
    if let (Some(name), true) = (name, chosen.is_empty()) {
        let nearest = forms()
            .map(|f| f.name)
            .max_by(|a, b| strsim::jaro_winkler(a, name).total_cmp(&strsim::jaro_winkler(b, name)));
        let hint = nearest.map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
        return Err(Failure::usage(format!("there is no closure called `{name}`{hint}")));
    }
    if global.json {
        return output::json(&Value::Array(chosen.iter().map(describe).collect()));
    }
    let mut text = String::new();
    for form in &chosen {
        let _ = writeln!(text, "{}", form.signature());
        if name.is_some() {
            let _ = writeln!(text, "\n{}\nSource: {}", paragraph(form.doc), form.source);
            if !form.note.is_empty() {
                let _ = writeln!(text, "Note: {}", form.note);
            }
            let _ = writeln!(text, "Reciprocal at its defaults: {}\n", if form.reciprocal { "yes" } else { "no" });
            for p in form.params {
                let _ = writeln!(text, "  {} {}{}\n      {}", p.ty.name(), p.name, range(p), paragraph(p.doc));
            }
            text.push('\n');
        } else {
            let first = paragraph(form.doc);
            let sentence = first.split_inclusive(". ").next().unwrap_or("").trim();
            let _ = writeln!(text, "    {sentence}");
        }
    }
    output::write(&text)
}

/// Closures that stdosl.h declares itself, with these arguments.
const STANDARD: &[&str] = &[
    "background",
    "burley_diffuse_bsdf",
    "conductor_bsdf",
    "debug",
    "dielectric_bsdf",
    "diffuse",
    "emission",
    "generalized_schlick_bsdf",
    "holdout",
    "layer",
    "microfacet",
    "oren_nayar",
    "oren_nayar_diffuse_bsdf",
    "phong",
    "reflection",
    "refraction",
    "sheen_bsdf",
    "subsurface",
    "subsurface_bssrdf",
    "translucent",
    "translucent_bsdf",
    "transparent",
    "transparent_bsdf",
    "uniform_edf",
    "ward",
];

/// The header for other compilers, made from the registry.
pub fn header() -> Outcome {
    let mut text = String::from(
        "// The closures that stdosl.h lacks. Made by `overcoat lobes --header`; do not edit.\n\n\
         #ifndef OVERCOAT_H\n#define OVERCOAT_H\n\n\
         #ifndef BUILTIN\n#define BUILTIN [[ int builtin = 1 ]]\n#endif\n\n",
    );
    for form in forms().filter(|f| !STANDARD.contains(&f.name)) {
        let first = paragraph(form.doc);
        let _ = writeln!(text, "// {}", first.split_inclusive(". ").next().unwrap_or("").trim());
        let params: Vec<String> = form.positional().map(|p| format!("{} {}", p.ty.name(), p.name)).collect();
        let _ = writeln!(text, "closure color {}({}) BUILTIN;", form.name, params.join(", "));
    }
    text.push_str("\n#endif\n");
    output::write(&text)
}

pub(super) fn describe(form: &Form) -> Value {
    let params: Vec<Value> = form
        .params
        .iter()
        .map(|p| {
            let mut row = json!({
                "name": p.name, "type": p.ty.name(), "default": default(p),
                "min": limit(p, p.min), "max": limit(p, p.max), "doc": paragraph(p.doc), "keyword": p.keyword,
            });
            if !p.options.is_empty() {
                row["options"] = json!(p.options);
            }
            row
        })
        .collect();
    json!({
        "name": form.name, "signature": form.signature(), "params": params, "source": form.source,
        "reciprocal": form.reciprocal, "doc": paragraph(form.doc), "note": form.note,
    })
}

fn default(p: &ParamSpec) -> Value {
    match (p.ty, p.default) {
        (_, []) => Value::Null,
        (ParamTy::String, _) if p.options.is_empty() => Value::Null,
        (ParamTy::String, [index]) => json!(p.options.get(*index as usize)),
        (ParamTy::Int, [x]) => json!(*x as i64),
        (_, [x]) => number(*x),
        (_, xs) => numbers(xs),
    }
}

/// `null` where there is no limit, and for strings.
fn limit(p: &ParamSpec, x: f32) -> Value {
    match p.ty {
        ParamTy::String => Value::Null,
        ParamTy::Int if x.is_finite() => json!(x as i64),
        _ => number(x),
    }
}

pub(super) fn range(p: &ParamSpec) -> String {
    let mut text = String::new();
    if !p.options.is_empty() {
        let _ = write!(text, ", one of {}", p.options.join(", "));
    } else if p.ty != ParamTy::String && (p.min.is_finite() || p.max.is_finite()) {
        let _ = write!(text, ", {} to {}", p.min, p.max);
    }
    if let (false, Value::String(s)) = (p.default.is_empty(), default(p)) {
        let _ = write!(text, ", default {s}");
    } else if !p.default.is_empty() {
        let _ = write!(text, ", default {}", default(p));
    }
    text
}

/// A doc comment as one paragraph.
pub(super) fn paragraph(doc: &str) -> String {
    doc.split_whitespace().collect::<Vec<_>>().join(" ")
}
