//! Diagnostics and parameters as the page reads them. Places are in UTF-16 units, which browsers count in.

use super::super::output::{number, numbers};
use crate::diag::Diagnostic;
use crate::ir::{self, ParamDecl, Ty};
use crate::span::{Source, Span};
use serde_json::{Value, json};

/// More messages than anyone reads.
const MAX_MESSAGES: usize = 200;

pub fn diagnostics(diagnostics: &[Diagnostic], source: &Source) -> Vec<Value> {
    diagnostics.iter().take(MAX_MESSAGES).map(|d| diagnostic(d, source)).collect()
}

fn diagnostic(d: &Diagnostic, source: &Source) -> Value {
    let labels: Vec<Value> = d
        .labels
        .iter()
        .map(|l| {
            let [start, end] = place(source, l.span);
            json!({ "start": start, "end": end, "text": l.text })
        })
        .collect();
    // A place in an included file cannot be shown in this one.
    let here = d.origin.is_none() || d.span.file == 0;
    let shown = d.origin.as_deref().filter(|_| !here).unwrap_or(source);
    let at = shown.line_column(d.span.start as usize);
    let [start, end] = if here { place(source, d.span) } else { [0, 0] };
    json!({
        "severity": d.severity.name(), "code": d.code, "message": d.message, "note": d.note, "help": d.help,
        "here": here, "file": shown.name, "line": at.line, "column": at.column,
        "start": start, "end": end, "labels": if here { labels } else { Vec::new() },
    })
}

/// Start and end of a span; at least one character, for something to underline.
fn place(source: &Source, span: Span) -> [usize; 2] {
    let units = |at: usize| source.text[..source.floor(at)].encode_utf16().count();
    let (start, end) = (units(span.start as usize), units(span.end as usize));
    [start, end.max(start + 1)]
}

/// A parameter with what a control for it needs: `kind` is the control, `min` and `max` its range.
pub fn parameter(param: &ParamDecl) -> Value {
    let text = |names: [&str; 2]| match names.iter().find_map(|n| param.meta(n)) {
        Some(ir::Value::String(text)) => Some(text.clone()),
        _ => None,
    };
    let limit = |names: [&str; 2]| names.iter().find_map(|n| param.meta(n)).and_then(|v| v.numbers().first().copied());
    let options: Vec<String> =
        text(["options", "options"]).map(|o| o.split('|').map(str::to_owned).collect()).unwrap_or_default();
    let widget = text(["widget", "widget"]).unwrap_or_default();
    let kind = match param.ty {
        Ty::Int if widget == "checkBox" || widget == "boolean" => "switch",
        Ty::Int => "int",
        Ty::Float => "float",
        Ty::Color => "color",
        Ty::String if !options.is_empty() => "choice",
        Ty::String => "text",
        ty if ty.is_triple() => "triple",
        _ => "none",
    };
    json!({
        "name": param.name, "type": param.ty.name(), "kind": kind,
        "label": text(["label", "UIlabel"]), "help": text(["help", "UIhelp"]),
        "page": text(["page", "UIpage"]), "options": options,
        "default": param.default.as_ref().map(value),
        "min": limit(["min", "UImin"]).map(number), "max": limit(["max", "UImax"]).map(number),
    })
}

fn value(value: &ir::Value) -> Value {
    match (value, value.numbers().as_slice()) {
        (ir::Value::String(text), _) => json!(text),
        (ir::Value::Int(i), _) => json!(i),
        (_, [x]) => number(*x),
        (_, xs) => numbers(xs),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_as_browsers_do() {
        let source = Source::new("a", "é😀x");
        assert_eq!(place(&source, Span::new(6, 7)), [3, 4]);
        assert_eq!(place(&source, Span::new(99, 99)), [4, 5]);
    }
}
