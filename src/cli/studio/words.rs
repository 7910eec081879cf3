//! What the editor colours and completes: closures with their signatures, functions, words of the language.

use super::super::lobes::describe;
use crate::ir::builtins::{BUILTINS, CONSTANTS};
use crate::ir::{GlobalVar, TASKS};
use crate::lobes::forms;
use serde_json::{Value, json};
use std::collections::BTreeMap;

const KEYWORDS: &[&str] = &[
    "break", "closure", "continue", "do", "else", "for", "if", "output", "public", "return", "struct", "surface",
    "while",
];
const TYPES: &[&str] = &["color", "float", "int", "matrix", "normal", "point", "string", "vector", "void"];
/// Declarations of metadata that `check` and the sliders read.
const METADATA: &[&str] = &["label", "help", "page", "min", "max", "UImin", "UImax", "options", "widget"];

pub fn words() -> Value {
    let mut functions: BTreeMap<&str, Vec<String>> = TASKS.iter().map(|name| (*name, Vec::new())).collect();
    for builtin in BUILTINS {
        functions.entry(builtin.name).or_default().push(builtin.signature());
    }
    let functions: Vec<Value> =
        functions.iter().map(|(name, signatures)| json!({ "name": name, "signatures": signatures })).collect();
    let mut globals = vec!["Ci"];
    globals.extend(GlobalVar::ALL.iter().map(|g| g.name()).filter(|n| !n.contains('(')));
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "closures": forms().map(|form| describe(&form)).collect::<Vec<_>>(),
        "functions": functions,
        "keywords": KEYWORDS,
        "types": TYPES,
        "metadata": METADATA,
        "globals": globals,
        "constants": CONSTANTS.iter().map(|c| c.0).collect::<Vec<_>>(),
    })
}
