//! Before the grammar: comments become blanks, directives are carried out, macros replaced, and the nesting measured.
//!
//! In: the text, and where included files come from. Out: one text, and a [`Map`] from its places to those of the files
//! it came from. What a macro expands to stands, as a whole, for the place where it was used.

mod blank;
mod condition;
mod macros;
mod map;
mod nesting;

pub use map::Map;
pub use nesting::MAX_DEPTH;

use super::options::Options;
use crate::diag::Diagnostic;
use crate::span::{Source, Span};
use blank::{Blanked, blank};
use macros::{Macros, Piece, Trouble, Use, arguments_of, next_piece};
use nesting::nesting;
use std::collections::HashSet;

/// Headers whose declarations are built in.
pub const HEADERS: &[&str] = &["stdosl.h", "oslutil.h", "stdcycles.h", "mx_funcs.h", "overcoat.h"];

/// Headers that come along as text, unless an include directory has one of that name.
const SHIPPED: &[(&str, &str)] = &[
    ("vector2.h", include_str!("../../../include/osl/vector2.h")),
    ("vector4.h", include_str!("../../../include/osl/vector4.h")),
    ("color2.h", include_str!("../../../include/osl/color2.h")),
    ("color4.h", include_str!("../../../include/osl/color4.h")),
    ("matrix33.h", include_str!("../../../include/osl/matrix33.h")),
];

/// The version of OSL that scripts find defined: major, minor, patch.
const VERSION: (u32, u32, u32) = (1, 15, 0);

/// Text without comments, directives and macros.
#[derive(Debug, Default)]
pub struct Preprocessed {
    /// What the grammar sees.
    pub text: String,
    /// Where it came from.
    pub map: Map,
    /// Included files; the first is file 1 of spans.
    pub sources: Vec<Source>,
    /// `#warning` and the like.
    pub warnings: Vec<Diagnostic>,
}

/// What is wrong, and the included files it may point into.
pub type Wrong = (Vec<Diagnostic>, Vec<Source>);

/// Preprocesses a script called `name`.
pub fn preprocess(name: &str, text: &str, options: &Options) -> Result<Preprocessed, Wrong> {
    let mut run = Run {
        options,
        done: Preprocessed::default(),
        macros: Macros::default(),
        errors: Vec::new(),
        once: HashSet::new(),
        depth: 0,
        included: 0,
        last_line: (0, 0, 1),
    };
    let (major, minor, patch) = VERSION;
    run.macros.define("OSL_VERSION_MAJOR", &major.to_string());
    run.macros.define("OSL_VERSION_MINOR", &minor.to_string());
    run.macros.define("OSL_VERSION_PATCH", &patch.to_string());
    run.macros.define("OSL_VERSION", &(major * 10000 + minor * 100 + patch).to_string());
    for (name, value) in &options.defines {
        run.macros.define(name, value);
    }
    run.done.text.reserve(text.len());
    run.file(0, name, text);
    let Run { done, mut errors, .. } = run;
    if errors.is_empty() {
        errors.extend(nesting(&done.text).map(|d| moved(d, &done.map)));
    }
    if errors.is_empty() { Ok(done) } else { Err((errors, done.sources)) }
}

/// A message about preprocessed text as one about the files it came from.
pub fn moved(mut d: Diagnostic, map: &Map) -> Diagnostic {
    d.span = map.resolve(d.span);
    d.labels.iter_mut().for_each(|label| label.span = map.resolve(label.span));
    d
}

struct Run<'a> {
    options: &'a Options,
    done: Preprocessed,
    macros: Macros,
    errors: Vec<Diagnostic>,
    /// Files that said `#pragma once`.
    once: HashSet<String>,
    depth: usize,
    /// Bytes of included files.
    included: usize,
    /// The last place whose line was counted: file, byte, line.
    last_line: (u32, usize, usize),
}

/// An `#if` that is open.
struct Branch {
    span: Span,
    /// Its text counts.
    active: bool,
    /// One of its branches has counted already.
    taken: bool,
    /// What surrounds it counts.
    outer: bool,
    past_else: bool,
}

/// The file at hand.
struct File<'a> {
    id: u32,
    name: &'a str,
    text: &'a Blanked,
    branches: Vec<Branch>,
}

impl File<'_> {
    fn span(&self, start: usize, end: usize) -> Span {
        Span { file: self.id, ..Span::new(start, end) }
    }

    fn active(&self) -> bool {
        self.branches.last().is_none_or(|b| b.active)
    }
}

impl Run<'_> {
    fn file(&mut self, id: u32, name: &str, text: &str) {
        let limit = self.options.limits.script_bytes;
        if text.len() > limit {
            let message = format!("the script has {} bytes; the limit is {limit}", text.len());
            let d = Diagnostic::error("E0110", Span { file: id, ..Span::new(0, 1) }, message);
            return self.errors.push(d.help("raise `Limits::script_bytes`"));
        }
        let blanked = blank(text, id);
        let mut file = File { id, name, text: &blanked, branches: Vec::new() };
        let mut chunk = 0;
        for (start, end) in &blanked.directives {
            self.chunk(&file, chunk, *start);
            self.directive(&mut file, *start, *end);
            chunk = *end;
        }
        self.chunk(&file, chunk, text.len());
        if let Some(open) = file.branches.last() {
            self.errors.push(Diagnostic::error("E0104", open.span, "this `#if` has no `#endif`"));
        }
        // Keeps what ends one file from running into what follows.
        if id != 0 {
            let end = file.span(text.len(), text.len());
            self.done.map.push(self.done.text.len(), end, false);
            self.done.text.push('\n');
        }
    }

    /// Text between two directives.
    fn chunk(&mut self, file: &File, start: usize, end: usize) {
        if start >= end || !file.active() {
            return;
        }
        let complaints = file.text.complaints.iter();
        self.errors.extend(complaints.filter(|d| (start..end).contains(&(d.span.start as usize))).cloned());
        let text = &file.text.text[..end];
        let (mut at, mut copied) = (start, start);
        while at < end {
            let (piece, kind) = next_piece(&text[at..]);
            let word = at;
            at += piece.len();
            if kind != Piece::Word || !self.macros.is_defined(piece) {
                continue;
            }
            if self.macros.takes_arguments(piece) {
                match arguments_of(&text[at..]) {
                    Ok(Some((_, rest))) => at = end - rest.len(),
                    Ok(None) => continue,
                    Err(_) => at = end,
                }
            }
            self.copy(file, copied, word);
            self.replaced(file, word, at);
            copied = at;
        }
        self.copy(file, copied, end);
    }

    fn copy(&mut self, file: &File, start: usize, end: usize) {
        if start < end {
            self.done.map.push(self.done.text.len(), file.span(start, start), true);
            self.done.text.push_str(&file.text.text[start..end]);
        }
    }

    /// What the macros in a piece of text expand to.
    fn replaced(&mut self, file: &File, start: usize, end: usize) {
        let span = file.span(start, end);
        let text = self.expand(file, &file.text.text[start..end], span).unwrap_or_default();
        self.done.map.push(self.done.text.len(), span, false);
        // Blanks around it: what it expands to does not join its neighbours.
        self.done.text.push(' ');
        self.done.text.push_str(&text.replace('\n', " "));
        self.done.text.push(' ');
    }

    fn expand(&mut self, file: &File, text: &str, span: Span) -> Option<String> {
        let line = self.line(file, span.start as usize);
        let budget = self.options.limits.expanded_bytes;
        let d = match self.macros.expand(text, &Use { line, file: file.name, budget }) {
            Ok(text) => return Some(text),
            Err(Trouble::Wrong(message)) => Diagnostic::error("E0111", span, message),
            Err(Trouble::Budget) => {
                let message = format!("macros expand to more than {budget} bytes, or nest too deep");
                Diagnostic::error("E0111", span, message).help("raise `Limits::expanded_bytes`")
            }
        };
        // One is enough: what follows would go beyond the budget too.
        if !self.errors.iter().any(|e| e.message == d.message) {
            self.errors.push(d);
        }
        None
    }

    /// The line of a place; counted on from the last one asked for.
    fn line(&mut self, file: &File, at: usize) -> usize {
        let (id, from, line) = self.last_line;
        let (from, line) = if id == file.id && from <= at { (from, line) } else { (0, 1) };
        let line = line + file.text.text[from..at].matches('\n').count();
        self.last_line = (file.id, at, line);
        line
    }

    fn directive(&mut self, file: &mut File, start: usize, end: usize) {
        let whole = &file.text.text[start..end];
        let line = whole.trim().trim_start_matches('#').replace("\\\r\n", " ").replace("\\\n", " ");
        let line = line.trim();
        let length = line.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(line.len());
        let (word, rest) = (&line[..length], line[length..].trim());
        let lead = whole.len() - whole.trim_start().len();
        let span = file.span(start + lead, start + lead + whole.trim().len());
        match word {
            "if" | "ifdef" | "ifndef" => {
                let outer = file.active();
                let active = outer && self.condition(file, word, rest, span);
                file.branches.push(Branch { span, active, taken: active, outer, past_else: false });
            }
            "elif" | "else" => self.otherwise(file, word, rest, span),
            "endif" => {
                if file.branches.pop().is_none() {
                    self.errors.push(Diagnostic::error("E0104", span, "this `#endif` has no `#if`"));
                }
            }
            _ if !file.active() => {}
            "include" => self.include(file, rest, span),
            "define" => match self.macros.define_line(rest) {
                Ok(None) => {}
                Ok(Some(name)) => {
                    let d = Diagnostic::warning("W0505", span, format!("`{name}` is defined anew"));
                    self.done.warnings.push(d.help("`#undef` it first if that is meant"));
                }
                Err(message) => self.errors.push(Diagnostic::error("E0104", span, message)),
            },
            "undef" => self.macros.undefine(rest),
            "pragma" if rest == "once" => {
                self.once.insert(file.name.to_owned());
            }
            "error" => self.errors.push(Diagnostic::error("E0104", span, format!("`#error`: {rest}"))),
            "warning" => self.done.warnings.push(Diagnostic::warning("W0505", span, rest.to_owned())),
            "pragma" | "line" | "" => {}
            _ => {
                let message = format!("the directive `#{word}` is not supported");
                self.errors.push(Diagnostic::error("E0104", span, message));
            }
        }
    }

    fn otherwise(&mut self, file: &mut File, word: &str, rest: &str, span: Span) {
        let Some(mut branch) = file.branches.pop().filter(|b| !b.past_else) else {
            let message = format!("this `#{word}` has no `#if`");
            return self.errors.push(Diagnostic::error("E0104", span, message));
        };
        let open = branch.outer && !branch.taken;
        branch.active = open && (word == "else" || self.condition(file, "if", rest, span));
        branch.taken |= branch.active;
        branch.past_else = word == "else";
        file.branches.push(branch);
    }

    fn condition(&mut self, file: &File, word: &str, rest: &str, span: Span) -> bool {
        if word != "if" {
            let (name, _) = next_piece(rest);
            if name.is_empty() {
                self.errors.push(Diagnostic::error("E0104", span, format!("`#{word}` needs a name")));
            }
            return self.macros.is_defined(name) == (word == "ifdef");
        }
        let Some(text) = self.expand(file, &self.without_defined(rest), span) else { return false };
        match condition::value(&text) {
            Ok(value) => value != 0,
            Err(message) => {
                self.errors.push(Diagnostic::error("E0104", span, message));
                false
            }
        }
    }

    /// A condition with every `defined(NAME)` replaced by its value.
    fn without_defined(&self, text: &str) -> String {
        let (mut out, mut rest) = (String::new(), text);
        while !rest.is_empty() {
            let (piece, _) = next_piece(rest);
            rest = &rest[piece.len()..];
            if piece != "defined" {
                out.push_str(piece);
                continue;
            }
            let inner = rest.trim_start();
            let bracket = inner.strip_prefix('(').map(str::trim_start);
            let (name, _) = next_piece(bracket.unwrap_or(inner));
            let after = &bracket.unwrap_or(inner)[name.len()..];
            rest = if bracket.is_some() { after.trim_start().strip_prefix(')').unwrap_or(after) } else { after };
            out.push_str(if self.macros.is_defined(name) { " 1 " } else { " 0 " });
        }
        out
    }

    fn include(&mut self, file: &File, operand: &str, span: Span) {
        let expanded = if operand.starts_with(['<', '"']) { None } else { self.expand(file, operand, span) };
        let operand = expanded.as_deref().unwrap_or(operand).trim();
        let closing = if operand.starts_with('<') { '>' } else { '"' };
        let name = operand.get(1..).and_then(|rest| rest.split_once(closing)).map(|(name, _)| name);
        let Some(name) = name.filter(|_| operand.starts_with(['<', '"'])) else {
            let d = Diagnostic::error("E0103", span, "`#include` needs a header in quotes or angle brackets");
            return self.errors.push(d.help("write `#include \"stdosl.h\"`"));
        };
        let base = name.rsplit('/').next().unwrap_or(name);
        let standard = HEADERS.contains(&base);
        if standard && base != "mx_funcs.h" {
            return;
        }
        let loaded = self.options.includes.as_ref().and_then(|i| i.load(name, file.name));
        let shipped =
            || SHIPPED.iter().find(|(n, _)| *n == base).map(|(n, text)| ((*n).to_owned(), (*text).to_owned()));
        let Some((path, text)) = loaded.or_else(shipped) else {
            if standard {
                return;
            }
            let d = Diagnostic::error("E0103", span, format!("unknown header `{name}`"));
            let builtin = HEADERS.iter().copied().chain(SHIPPED.iter().map(|(n, _)| *n)).collect::<Vec<_>>();
            let d = d.help(format!("these are built in: {}", builtin.join(", ")));
            return self.errors.push(d.help("others are looked for in the include directories: `-I DIR`"));
        };
        if self.once.contains(&path) {
            return;
        }
        let limits = &self.options.limits;
        self.included += text.len() + 1;
        let over = if self.depth >= limits.include_depth {
            Some((format!("`#include` nests deeper than {}", limits.include_depth), "raise `Limits::include_depth`"))
        } else if self.included > limits.expanded_bytes {
            let message = format!("included files come to more than {} bytes", limits.expanded_bytes);
            Some((message, "raise `Limits::expanded_bytes`"))
        } else {
            None
        };
        if let Some((message, help)) = over {
            if !self.errors.iter().any(|e| e.message == message) {
                self.errors.push(Diagnostic::error("E0112", span, message).help(help));
            }
            return;
        }
        self.done.sources.push(Source::new(path.clone(), text.clone()));
        let id = self.done.sources.len() as u32;
        self.depth += 1;
        self.file(id, &path, &text);
        self.depth -= 1;
    }
}
