//! `overcoat explain`.

use super::{Failure, Global, Outcome, output};
use crate::diag::{CODES, Code};
use serde_json::json;
use std::fmt::Write;

pub fn run(global: &Global, code: Option<&str>) -> Outcome {
    let chosen: Vec<&Code> =
        CODES.iter().filter(|c| code.is_none_or(|code| c.code.eq_ignore_ascii_case(code))).collect();
    if let (Some(code), true) = (code, chosen.is_empty()) {
        return Err(Failure::usage(format!("there is no code `{code}`; `overcoat explain` lists them")));
    }
    if global.json {
        let rows = chosen.iter().map(|c| json!({ "code": c.code, "title": c.title, "text": c.text }));
        return output::json(&json!(rows.collect::<Vec<_>>()));
    }
    let mut text = String::new();
    for c in chosen {
        let _ = match code {
            Some(_) => writeln!(text, "{}: {}\n\n{}", c.code, c.title, c.text),
            None => writeln!(text, "{}  {}", c.code, c.title),
        };
    }
    output::write(&text)
}
