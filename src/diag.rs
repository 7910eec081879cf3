//! Messages about scripts: what is wrong, where, and what to do instead.
//!
//! Every stage of the front end returns [`Diagnostic`]s as plain data; only this file turns them into text, either as
//! a picture of the source with carets ([`Diagnostic::render`]) or as one line ([`Diagnostic::line`]). Rendering never
//! panics, whatever the spans, and its cost and its output do not grow with the length of a source line.

use crate::span::{Source, Span};
use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Origin, Renderer, Snippet, Title};
use std::ops::Range;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The script runs, perhaps not as meant.
    Warning,
    /// The script does not run.
    Error,
}

impl Severity {
    /// `error` or `warning`.
    pub const fn name(self) -> &'static str {
        match self {
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// A second place that a message refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// Where.
    pub span: Span,
    /// What is there.
    pub text: String,
}

/// One message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// One of [`CODES`].
    pub code: &'static str,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// Where.
    pub span: Span,
    /// Stands beside the caret: what was found there, what was expected.
    pub note: String,
    /// Other places.
    pub labels: Vec<Label>,
    /// What to do instead.
    pub help: Vec<String>,
}

impl Diagnostic {
    /// An error with one of the codes `E….`
    pub fn error(code: &'static str, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Error, code, span, message)
    }

    /// A warning with one of the codes `W….`
    pub fn warning(code: &'static str, span: Span, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Warning, code, span, message)
    }

    fn new(severity: Severity, code: &'static str, span: Span, message: impl Into<String>) -> Diagnostic {
        debug_assert!(CODES.iter().any(|(c, _)| *c == code), "{code} is not in the table of codes");
        let (note, labels, help) = (String::new(), Vec::new(), Vec::new());
        Diagnostic { severity, code, message: message.into(), span, note, labels, help }
    }

    /// With words beside the caret.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Diagnostic {
        self.note = note.into();
        self
    }

    /// Pointing at a second place.
    #[must_use]
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Diagnostic {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// With advice.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help.push(help.into());
        self
    }

    /// Whether this is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// `file:line:column: error[E0201]: message`
    pub fn line(&self, source: &Source) -> String {
        let at = source.line_column(self.span.start as usize);
        let (severity, code) = (self.severity.name(), self.code);
        format!("{}:{}:{}: {severity}[{code}]: {}", source.name, at.line, at.column, clip(&self.message))
    }

    /// The message with the lines of source it is about. `color`: with terminal escapes.
    pub fn render(&self, source: &Source, color: bool) -> String {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let group = level.primary_title(clip(&self.message)).id(self.code);
        let group = match self.excerpt(source) {
            Some(snippet) => group.element(snippet),
            None => self.windowed(source, group),
        };
        let group = self.help.iter().fold(group, |group, help| group.element(Level::HELP.message(clip(help))));
        let renderer = if color { Renderer::styled() } else { Renderer::plain() };
        let mut text = renderer.render(&[group]);
        text.push('\n');
        text
    }

    /// The places with what to write beside them, the primary one first.
    fn places<'a>(&'a self, source: &Source) -> Vec<Mark<'a>> {
        let primary = std::iter::once((self.span, self.note.as_str(), true));
        let labels = self.labels.iter().take(MAX_LABELS).map(|l| (l.span, l.text.as_str(), false));
        let mark = |(span, text, primary): (Span, &'a str, bool)| {
            let start = source.floor(span.start as usize);
            // One line each: what goes on is clear from where it begins.
            let end = source.floor(span.end as usize).clamp(start, source.line_range(start).end);
            Mark { range: start..end, text, primary }
        };
        primary.chain(labels).map(mark).collect()
    }

    /// All places in one piece of source, if it is short enough to show as it is.
    fn excerpt<'a>(&'a self, source: &'a Source) -> Option<Snippet<'a, Annotation<'a>>> {
        let places = self.places(source);
        let lines = places.iter().map(|mark| source.line_range(mark.range.start));
        let (mut start, mut end) = (usize::MAX, 0);
        for line in lines {
            if line.len() > MAX_LINE {
                return None;
            }
            (start, end) = (start.min(line.start), end.max(line.end));
        }
        let text = source.text.get(start..end).filter(|text| text.len() <= MAX_EXCERPT)?;
        let plain = |c: char| !c.is_control() || matches!(c, '\n' | '\t');
        if text.lines().any(|line| line.len() > MAX_LINE) || !text.chars().all(plain) {
            return None;
        }
        let line = source.line_column(start).line;
        let marks = places.into_iter().map(|mark| mark.annotation(start));
        Some(Snippet::source(text).path(source.name.as_str()).line_start(line).annotations(marks))
    }

    /// Each place in a window of its own.
    fn windowed<'a>(&'a self, source: &'a Source, group: Title<'a>) -> Group<'a> {
        let at = source.line_column(self.span.start as usize);
        let origin = Origin::path(source.name.as_str()).line(at.line).char_column(at.column);
        let mut windows: Vec<Window> = Vec::new();
        for mark in self.places(source) {
            let line = source.line_column(mark.range.start).line;
            let shown = windows.iter().position(|w| w.line == line && w.covers(&mark.range));
            let index = shown.unwrap_or_else(|| {
                windows.push(Window::around(source, line, &mark.range));
                windows.len() - 1
            });
            windows[index].mark(mark);
        }
        windows.into_iter().fold(group.element(origin), |group, window| {
            let marks = window.marks.into_iter().map(|mark| mark.annotation(0));
            group.element(Snippet::source(window.text).line_start(window.line).annotations(marks))
        })
    }
}

/// How much of a long line is shown on each side of the place in question.
const MARGIN: usize = 80;
/// How much of the place itself is underlined.
const MAX_UNDERLINE: usize = 80;
/// A line longer than this is shown in part.
const MAX_LINE: usize = 240;
/// The longest piece of source that is handed to the renderer.
const MAX_EXCERPT: usize = 64 << 10;
/// How many secondary places a message shows.
const MAX_LABELS: usize = 6;
/// The longest text a message quotes.
const MAX_TEXT: usize = 400;

/// The part of one source line that is shown.
struct Window<'a> {
    line: usize,
    text: String,
    /// Bytes of the source that `text` shows.
    shown: Range<usize>,
    /// Length of the dots in front.
    lead: usize,
    marks: Vec<Mark<'a>>,
}

struct Mark<'a> {
    range: Range<usize>,
    text: &'a str,
    primary: bool,
}

impl<'a> Mark<'a> {
    /// For a text that begins at byte `start`.
    fn annotation(self, start: usize) -> Annotation<'a> {
        let kind = if self.primary { AnnotationKind::Primary } else { AnnotationKind::Context };
        let text = Some(clip(self.text)).filter(|t| !t.is_empty());
        kind.span(self.range.start - start..self.range.end - start).label(text)
    }
}

impl<'a> Window<'a> {
    fn around(source: &Source, line: usize, place: &Range<usize>) -> Window<'a> {
        let whole = source.line_range(place.start);
        let start = source.floor(place.start.saturating_sub(MARGIN)).max(whole.start);
        let end = source.floor(place.end.min(place.start + MAX_UNDERLINE) + MARGIN).clamp(start, whole.end);
        let (before, after) = (start > whole.start, end < whole.end);
        let dots = |show: bool| if show { "..." } else { "" };
        // Control characters would upset the terminal; as many bytes of blanks keep the marks in place.
        let mut body = String::new();
        for c in source.text[start..end].chars() {
            match c.is_control() && c != '\t' {
                true => body.extend(std::iter::repeat_n(' ', c.len_utf8())),
                false => body.push(c),
            }
        }
        let text = format!("{}{body}{}", dots(before), dots(after));
        Window { line, text, shown: start..end, lead: dots(before).len(), marks: Vec::new() }
    }

    fn covers(&self, place: &Range<usize>) -> bool {
        self.shown.start <= place.start && place.start <= self.shown.end
    }

    fn mark(&mut self, mark: Mark<'a>) {
        let start = mark.range.start - self.shown.start + self.lead;
        let end = mark.range.end.min(mark.range.start + MAX_UNDERLINE).clamp(mark.range.start, self.shown.end);
        let mut end = end - self.shown.start + self.lead;
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        self.marks.push(Mark { range: start..end.max(start), ..mark });
    }
}

/// Cuts what a message quotes from a script to a length a person reads.
fn clip(text: &str) -> String {
    match text.char_indices().nth(MAX_TEXT) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text.to_owned(),
    }
}

/// Renders all messages, one after the other.
pub fn render_all(diagnostics: &[Diagnostic], source: &Source, color: bool) -> String {
    diagnostics.iter().map(|d| d.render(source, color)).collect::<Vec<_>>().join("\n")
}

/// What each code stands for.
pub const CODES: &[(&str, &str)] = &[
    ("E0101", "a comment or a string does not end"),
    ("E0102", "a bracket has no partner"),
    ("E0103", "an `#include` names an unknown header"),
    ("E0104", "a preprocessor directive is not supported"),
    ("E0105", "nested deeper than 256 levels"),
    ("E0106", "a character that cannot stand in a script"),
    ("E0107", "the text does not follow the grammar"),
    ("E0108", "a number does not fit its type"),
    ("E0109", "a part of the language that is not supported"),
    ("E0110", "the script is too large"),
    ("E0201", "an unknown name"),
    ("E0202", "a name is declared twice"),
    ("E0203", "a value has the wrong type"),
    ("E0204", "an operator does not take these types"),
    ("E0205", "a function does not take these arguments"),
    ("E0206", "an unknown function"),
    ("E0207", "something that cannot be assigned to"),
    ("E0208", "a component that the value does not have"),
    ("E0209", "a condition that is no number"),
    ("E0301", "closures are added and scaled, nothing else"),
    ("E0302", "an unknown keyword argument of a closure"),
    ("E0303", "an unknown option"),
    ("E0304", "a keyword argument is given twice or without a value"),
    ("E0401", "an unknown parameter"),
    ("E0402", "a value does not fit a parameter"),
    ("E0701", "the material gains energy"),
    ("W0501", "`Ci` is never assigned"),
    ("W0502", "a statement without effect"),
    ("W0503", "a parameter lies outside its declared range"),
    ("W0504", "the top of a layer transmits"),
    ("W0702", "whether the material gains energy could not be decided"),
    ("W0703", "a weight can be negative"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_span_renders() {
        let text = "é = 1;\r\n\tb = \u{85}\0ü;\n".repeat(3);
        let source = Source::new("a.osl", text.clone());
        for start in 0..text.len() + 3 {
            for end in 0..text.len() + 3 {
                let span = Span { file: 0, start: start as u32, end: end as u32 };
                let other = Span::new(end, start);
                let d = Diagnostic::error("E0201", span, "m").note("n").label(other, "l").help("h");
                d.render(&source, false);
                d.line(&source);
            }
        }
        Diagnostic::error("E0201", Span::new(0, 9), "m").render(&Source::new("a", ""), true);
    }

    #[test]
    fn a_long_line_is_shown_in_part() {
        let source = Source::new("a.osl", "x".repeat(1 << 20));
        let d = Diagnostic::error("E0201", Span::new(500_000, 900_000), "m").label(Span::new(3, 9), "there");
        assert!(d.render(&source, false).len() < 2000);
    }
}
