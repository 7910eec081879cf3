//! From places in preprocessed text to places in the files it came from.

use crate::span::Span;

/// A run of output that came from one place.
#[derive(Clone, Copy, Debug)]
struct Segment {
    /// Where it begins in the output.
    out: u32,
    /// What it came from.
    from: Span,
    /// Byte for byte; else all of it stands for the whole of `from`, as what a macro expands to does.
    exact: bool,
}

/// The places of preprocessed text.
#[derive(Clone, Debug, Default)]
pub struct Map {
    segments: Vec<Segment>,
}

impl Map {
    /// From `out` on the output is a copy of what begins at `from`, or stands for it as a whole.
    pub fn push(&mut self, out: usize, from: Span, exact: bool) {
        let out = u32::try_from(out).unwrap_or(u32::MAX);
        if self.segments.last().is_some_and(|last| last.out == out) {
            self.segments.pop();
        }
        self.segments.push(Segment { out, from, exact });
    }

    /// Where bytes `start..end` of the output came from.
    pub fn span(&self, start: usize, end: usize) -> Span {
        let first = self.at(start);
        let last = self.at(end.saturating_sub(1).max(start));
        let end = if last.file == first.file { last.end.max(first.start) } else { first.end };
        Span { end, ..first }
    }

    /// Where one byte came from.
    fn at(&self, out: usize) -> Span {
        let out = u32::try_from(out).unwrap_or(u32::MAX);
        let index = self.segments.partition_point(|s| s.out <= out);
        let Some(segment) = index.checked_sub(1).and_then(|i| self.segments.get(i)) else { return Span::default() };
        match segment.exact {
            true => {
                let start = segment.from.start + (out - segment.out);
                Span { start, end: start + 1, ..segment.from }
            }
            false => segment.from,
        }
    }

    /// A span of output as a span of a file.
    pub fn resolve(&self, span: Span) -> Span {
        self.span(span.start as usize, span.end as usize)
    }
}
