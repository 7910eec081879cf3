//! After a syntax error: saying what is wrong in a writer's words, and getting past it.
//!
//! In: preprocessed text and the place where the grammar could not go on. Out: a message, or the text with the
//! statement around the place blanked so that the grammar can try the rest.

use crate::diag::Diagnostic;
use crate::span::Span;
use std::ops::Range;

/// Words that cannot be names: those of the language, and those that OSL's compilers refuse besides.
pub const RESERVED: &[&str] = &[
    "and",
    "bool",
    "break",
    "case",
    "char",
    "class",
    "closure",
    "color",
    "const",
    "continue",
    "default",
    "do",
    "double",
    "else",
    "enum",
    "extern",
    "false",
    "float",
    "for",
    "friend",
    "if",
    "illuminance",
    "illuminate",
    "inline",
    "int",
    "long",
    "matrix",
    "normal",
    "not",
    "or",
    "output",
    "point",
    "private",
    "protected",
    "public",
    "return",
    "short",
    "signed",
    "sizeof",
    "static",
    "string",
    "struct",
    "switch",
    "template",
    "this",
    "true",
    "typedef",
    "uniform",
    "union",
    "unsigned",
    "varying",
    "vector",
    "virtual",
    "void",
    "while",
];

/// Whether a statement ended before `at` without its `;`: something new begins on another line, or nothing at all.
pub fn missing_semicolon(text: &str, at: usize, expected: &[&str]) -> bool {
    let before = text[..at].trim_end().len();
    expected.contains(&"`;`") && before > 0 && (text[before..at].contains('\n') || token(text, at).is_empty())
}

/// Says what stands at `at` and what could have stood there.
pub fn explain(text: &str, at: usize, expected: &[&str]) -> Diagnostic {
    let before = text[..at].trim_end().len();
    let found = token(text, at);
    if missing_semicolon(text, at, expected) {
        let span = Span::new(before - last_char(&text[..before]), before);
        return Diagnostic::error("E0107", span, "a `;` is missing after this").note("expected `;` here");
    }
    let what = if found.is_empty() { "the end of the script".to_owned() } else { format!("`{found}`") };
    let d = Diagnostic::error("E0107", Span::new(at, at + found.len().max(1)), format!("{what} was not expected here"));
    match expected {
        [] => d,
        [one] => d.note(format!("expected {one}")),
        [many @ .., last] => d.note(format!("expected {} or {last}", many.join(", "))),
    }
}

/// The word or sign at `at`; empty at the end.
fn token(text: &str, at: usize) -> &str {
    let rest = text.get(at..).unwrap_or("");
    let word = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let end = match rest.chars().next() {
        None => 0,
        Some('"') => rest[1..].find('"').map_or(rest.len(), |i| i + 2),
        Some(c) if word == 0 => c.len_utf8(),
        Some(_) => word,
    };
    &rest[..end]
}

fn last_char(text: &str) -> usize {
    text.chars().next_back().map_or(0, char::len_utf8)
}

/// Blanks the statement around `at`, or only what of it comes before `at`; false if nothing is gained by that.
pub fn blank_statement(text: &mut String, at: usize, only_before: bool) -> bool {
    let mut range = statement_around(text, at);
    if only_before {
        range.end = at.max(range.start);
    }
    let statement = &text[range.clone()];
    let word = token(statement, statement.len() - statement.trim_start().len());
    if statement.trim().is_empty() || matches!(word, "surface" | "shader" | "displacement" | "volume" | "light" | "}") {
        return false;
    }
    let blank: String = statement.bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }).collect();
    text.replace_range(range, &blank);
    true
}

/// From after the last `;`, `{` or `}` up to the next `;` (with it) or brace (without), parentheses taken whole.
fn statement_around(text: &str, at: usize) -> Range<usize> {
    let bytes = text.as_bytes();
    let (mut start, mut depth, mut i) = (0, 0usize, 0);
    while i < bytes.len() {
        match bytes[i] {
            b'"' => {
                i += 1;
                while i < bytes.len() && bytes[i] != b'"' {
                    i += if bytes[i] == b'\\' { 2 } else { 1 };
                }
            }
            b'(' | b'[' => depth += 1,
            b')' | b']' => depth = depth.saturating_sub(1),
            b';' if depth == 0 => {
                if i >= at {
                    return start..i + 1;
                }
                start = i + 1;
            }
            b'{' | b'}' if depth == 0 => {
                // A brace where none can stand belongs to what is wrong.
                if i >= at && i > start {
                    return start..i;
                }
                start = i + 1;
            }
            _ => {}
        }
        i += 1;
    }
    start.min(text.len())..text.len()
}
