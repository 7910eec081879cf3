//! Comments become blanks, and directives and what cannot stand in a script are found: one loop over the bytes.

use crate::diag::Diagnostic;
use crate::span::Span;

/// Text without comments, as long as the original so that places stay the same.
pub struct Blanked {
    /// The text.
    pub text: String,
    /// First and one past the last byte of each directive, continued lines included.
    pub directives: Vec<(usize, usize)>,
    /// What is wrong; it matters only where the text counts.
    pub complaints: Vec<Diagnostic>,
}

/// Blanks the comments of a file.
pub fn blank(text: &str, file: u32) -> Blanked {
    let out = text.as_bytes().to_vec();
    let (directives, errors) = (Vec::new(), Vec::new());
    let mut blank = Blanker { text, file, out, at: 0, fresh_line: true, directives, errors };
    blank.run();
    let Blanker { out, directives, errors, .. } = blank;
    // Only whole characters were replaced, so the text is still UTF-8.
    Blanked { text: String::from_utf8(out).unwrap_or_default(), directives, complaints: errors }
}

struct Blanker<'a> {
    text: &'a str,
    file: u32,
    out: Vec<u8>,
    at: usize,
    /// Nothing but blanks so far on this line.
    fresh_line: bool,
    directives: Vec<(usize, usize)>,
    errors: Vec<Diagnostic>,
}

/// How many strange characters are reported one by one.
const MAX_STRANGE: usize = 5;

impl Blanker<'_> {
    fn run(&mut self) {
        let mut strange = 0;
        // Where the directive at hand began.
        let mut directive = None;
        while let Some(&byte) = self.text.as_bytes().get(self.at) {
            let start = self.at;
            match byte {
                b'/' if self.next_is(b'/') => {
                    self.at = self.find("\n", start);
                    self.blank(start);
                    continue;
                }
                b'/' if self.next_is(b'*') => {
                    self.block_comment(start);
                    continue;
                }
                b'"' => {
                    self.string(start);
                    self.fresh_line = false;
                    continue;
                }
                b'#' if self.fresh_line && directive.is_none() => {
                    directive = Some(start);
                    self.fresh_line = false;
                }
                b'#' if directive.is_some() => {}
                // A line break behind a backslash does not count.
                b'\\' if self.line_continues() => {
                    if directive.is_none() {
                        self.out[start] = b' ';
                    }
                    self.at = self.find("\n", start);
                }
                b'\n' => {
                    self.fresh_line = true;
                    self.directives.extend(directive.take().map(|from| (from, start)));
                }
                b' ' | b'\t' | b'\r' | 0xb | 0xc => {}
                b'!'..=b'~' if !matches!(byte, b'#' | b'$' | b'@' | b'\\' | b'`' | b'\'') => self.fresh_line = false,
                _ => {
                    self.at += self.text[start..].chars().next().map_or(1, char::len_utf8);
                    if directive.is_none() {
                        strange += 1;
                        if strange <= MAX_STRANGE {
                            self.strange(start);
                        }
                        self.blank(start);
                    }
                    continue;
                }
            }
            self.at += 1;
        }
        self.directives.extend(directive.map(|from| (from, self.text.len())));
    }

    fn next_is(&self, byte: u8) -> bool {
        self.text.as_bytes().get(self.at + 1) == Some(&byte)
    }

    fn line_continues(&self) -> bool {
        let rest = &self.text.as_bytes()[self.at + 1..];
        rest.starts_with(b"\n") || rest.starts_with(b"\r\n")
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span { file: self.file, ..Span::new(start, end) }
    }

    /// Where `what` is found from `from` on, or the end.
    fn find(&self, what: &str, from: usize) -> usize {
        self.text[from..].find(what).map_or(self.text.len(), |i| from + i)
    }

    fn blank(&mut self, start: usize) {
        for byte in &mut self.out[start..self.at] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
    }

    fn block_comment(&mut self, start: usize) {
        let end = self.find("*/", start + 2);
        if end == self.text.len() {
            let d = Diagnostic::error("E0101", self.span(start, start + 2), "this comment does not end");
            self.errors.push(d.help("close it with `*/`"));
        }
        self.at = (end + 2).min(self.text.len());
        self.blank(start);
    }

    fn string(&mut self, start: usize) {
        let bytes = self.text.as_bytes();
        self.at += 1;
        while let Some(&byte) = bytes.get(self.at) {
            match byte {
                b'"' => {
                    self.at += 1;
                    return;
                }
                b'\n' => break,
                b'\\' if bytes.get(self.at + 1).is_some_and(|b| *b != b'\n' && b.is_ascii()) => self.at += 2,
                _ => self.at += 1,
            }
        }
        let d = Diagnostic::error("E0101", self.span(start, start + 1), "this string does not end on its line");
        self.errors.push(d.help("close it with `\"`; a line break inside a string is written `\\n`"));
    }

    fn strange(&mut self, start: usize) {
        let c = self.text[start..].chars().next().unwrap_or('\0');
        let shown = if c.is_control() { format!("U+{:04X}", c as u32) } else { format!("`{c}`") };
        let d =
            Diagnostic::error("E0106", self.span(start, self.at), format!("the character {shown} cannot stand here"));
        let plain = match c {
            '\u{2018}' | '\u{2019}' | '\u{201c}' | '\u{201d}' | '\'' => Some('"'),
            '\u{2013}' | '\u{2014}' | '\u{2212}' => Some('-'),
            '\u{d7}' | '\u{22c5}' | '\u{b7}' => Some('*'),
            _ => None,
        };
        self.errors.push(match plain {
            Some(plain) => d.help(format!("write `{plain}`")),
            None => d,
        });
    }
}
