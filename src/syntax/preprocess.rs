//! Before the grammar: comments and directives become blanks, and the nesting is measured.
//!
//! In: the text. Out: text of the same length, so that every place in it is the same place in the original. Two loops
//! over the bytes, no recursion: after them the grammar may recurse on brackets without running out of stack.

use crate::diag::Diagnostic;
use crate::span::Span;

/// How deep brackets, prefix operators, `? :` and `else if` may nest, all taken together.
pub const MAX_DEPTH: usize = 256;
/// The longest script, in bytes.
pub const MAX_BYTES: usize = 64 << 20;
/// Headers whose declarations are built in.
pub const HEADERS: &[&str] = &["stdosl.h", "oslutil.h", "stdcycles.h", "mx_funcs.h", "overcoat.h"];

/// The text with comments and directives blanked, or everything that is wrong with it.
pub fn preprocess(text: &str) -> Result<String, Vec<Diagnostic>> {
    if text.len() > MAX_BYTES {
        let message = format!("the script has {} bytes; the limit is {MAX_BYTES}", text.len());
        return Err(vec![Diagnostic::error("E0110", Span::new(0, 1), message)]);
    }
    let mut blank = Blanker { text, out: text.as_bytes().to_vec(), at: 0, fresh_line: true, errors: Vec::new() };
    blank.run();
    let Blanker { out, mut errors, .. } = blank;
    // Only whole characters were replaced, so the text is still UTF-8.
    let out = String::from_utf8(out).unwrap_or_default();
    if errors.is_empty() {
        errors.extend(nesting(&out));
    }
    if errors.is_empty() { Ok(out) } else { Err(errors) }
}

struct Blanker<'a> {
    text: &'a str,
    out: Vec<u8>,
    at: usize,
    /// Nothing but blanks so far on this line.
    fresh_line: bool,
    errors: Vec<Diagnostic>,
}

/// How many strange characters are reported one by one.
const MAX_STRANGE: usize = 5;

impl Blanker<'_> {
    fn run(&mut self) {
        let mut strange = 0;
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
                b'#' if self.fresh_line => {
                    self.directive(start);
                    continue;
                }
                b'\n' => self.fresh_line = true,
                b' ' | b'\t' | b'\r' | 0xb | 0xc => {}
                b'!'..=b'~' if !matches!(byte, b'#' | b'$' | b'@' | b'\\' | b'`' | b'\'') => self.fresh_line = false,
                _ => {
                    self.at += self.text[start..].chars().next().map_or(1, char::len_utf8);
                    strange += 1;
                    if strange <= MAX_STRANGE {
                        self.strange(start);
                    }
                    self.blank(start);
                    continue;
                }
            }
            self.at += 1;
        }
    }

    fn next_is(&self, byte: u8) -> bool {
        self.text.as_bytes().get(self.at + 1) == Some(&byte)
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
            let d = Diagnostic::error("E0101", Span::new(start, start + 2), "this comment does not end");
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
        let d = Diagnostic::error("E0101", Span::new(start, start + 1), "this string does not end on its line");
        self.errors.push(d.help("close it with `\"`; a line break inside a string is written `\\n`"));
    }

    fn strange(&mut self, start: usize) {
        let c = self.text[start..].chars().next().unwrap_or('\0');
        let shown = if c.is_control() { format!("U+{:04X}", c as u32) } else { format!("`{c}`") };
        let span = Span::new(start, self.at);
        let d = Diagnostic::error("E0106", span, format!("the character {shown} cannot stand here"));
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

    fn directive(&mut self, start: usize) {
        let mut end = self.find("\n", start);
        while self.text[start..end].trim_end_matches('\r').ends_with('\\') && end < self.text.len() {
            end = self.find("\n", end + 1);
        }
        self.at = end;
        let line = self.text[start + 1..end].trim();
        let word: &str = line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next().unwrap_or("");
        let span = Span::new(start, start + self.text[start..end].trim_end().len());
        match word {
            "include" => self.include(line[word.len()..].trim(), span),
            "pragma" | "" => {}
            _ => {
                let message = format!("the directive `#{word}` is not supported");
                let d = Diagnostic::error("E0104", span, message);
                self.errors.push(d.help("`#include` and `#pragma` are understood"));
            }
        }
        self.blank(start);
    }

    fn include(&mut self, operand: &str, span: Span) {
        let closing = if operand.starts_with('<') { '>' } else { '"' };
        let name = operand.get(1..).and_then(|rest| rest.split_once(closing)).map(|(name, _)| name);
        let Some(name) = name.filter(|_| operand.starts_with(['<', '"'])) else {
            let d = Diagnostic::error("E0103", span, "`#include` needs a header in quotes or angle brackets");
            return self.errors.push(d.help("write `#include \"stdosl.h\"`"));
        };
        let file = name.rsplit('/').next().unwrap_or(name);
        if !HEADERS.contains(&file) {
            let d = Diagnostic::error("E0103", span, format!("unknown header `{name}`"));
            self.errors.push(d.help(format!("these are built in: {}", HEADERS.join(", "))));
        }
    }
}

/// One open bracket and what nests inside it so far.
struct Frame {
    open: u8,
    at: usize,
    /// Prefix operators before the operand to come.
    prefixes: usize,
    /// `?` since the last comma or semicolon.
    ternaries: usize,
    /// The `if`s that the statement to come belongs to.
    conditionals: usize,
    /// Whether the last `;` or `}` ended a statement, so that only `else` continues the conditionals.
    ended: bool,
}

impl Frame {
    fn new(open: u8, at: usize) -> Frame {
        Frame { open, at, prefixes: 0, ternaries: 0, conditionals: 0, ended: false }
    }

    fn depth(&self) -> usize {
        1 + self.prefixes + self.ternaries + self.conditionals
    }

    fn word(&mut self, word: &[u8]) {
        match word {
            b"else" => {}
            b"if" => {
                if self.ended {
                    self.conditionals = 0;
                }
                self.conditionals += 1;
            }
            _ if self.ended => self.conditionals = 0,
            _ => {}
        }
        self.ended = false;
        self.prefixes = 0;
    }

    fn end_statement(&mut self) {
        (self.prefixes, self.ternaries, self.ended) = (0, 0, true);
    }
}

/// Checks that brackets pair and that nothing nests deeper than [`MAX_DEPTH`].
fn nesting(text: &str) -> Option<Diagnostic> {
    let bytes = text.as_bytes();
    let mut frames = vec![Frame::new(0, 0)];
    // Depth of all frames but the last.
    let mut outer = 0;
    let mut after_operand = false;
    let mut at = 0;
    while at < bytes.len() {
        let byte = bytes[at];
        let start = at;
        at += 1;
        let top = frames.last_mut()?;
        match byte {
            b'"' => {
                at = string_end(bytes, start);
                top.word(b"");
                after_operand = true;
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' | b'0'..=b'9' => {
                at = word_end(bytes, start);
                top.word(&bytes[start..at]);
                after_operand = true;
            }
            b'(' | b'[' | b'{' => {
                match (byte == b'(' && !after_operand).then(|| cast_end(bytes, at)).flatten() {
                    Some(end) => {
                        top.prefixes += 1;
                        at = end;
                    }
                    None => {
                        if byte == b'{' && top.ended {
                            top.conditionals = 0;
                        }
                        outer += top.depth();
                        frames.push(Frame::new(byte, start));
                    }
                }
                after_operand = false;
            }
            b')' | b']' | b'}' => {
                let open = frames.pop()?;
                let Some(top) = frames.last_mut().filter(|_| pairs(open.open, byte)) else {
                    return Some(unpaired(byte, start, &open));
                };
                outer -= top.depth();
                top.prefixes = 0;
                after_operand = byte != b'}';
                if byte == b'}' {
                    top.end_statement();
                }
            }
            b';' => {
                top.end_statement();
                after_operand = false;
            }
            b',' => {
                (top.prefixes, top.ternaries) = (0, 0);
                after_operand = false;
            }
            b'?' => {
                top.ternaries += 1;
                after_operand = false;
            }
            b'-' | b'+' | b'!' | b'~' if !after_operand => top.prefixes += 1,
            b' ' | b'\t' | b'\r' | b'\n' | 0xb | 0xc => continue,
            _ => after_operand = false,
        }
        let depth = outer + frames.last()?.depth();
        if depth > MAX_DEPTH + 1 {
            let message = format!("nested deeper than {MAX_DEPTH} levels");
            let help = "give parts of the expression names of their own";
            return Some(Diagnostic::error("E0105", Span::new(start, at), message).help(help));
        }
    }
    let open = frames.pop().filter(|f| f.open != 0)?;
    let message = format!("this `{}` is never closed", open.open as char);
    Some(Diagnostic::error("E0102", Span::new(open.at, open.at + 1), message))
}

fn pairs(open: u8, close: u8) -> bool {
    matches!((open, close), (b'(', b')') | (b'[', b']') | (b'{', b'}'))
}

fn unpaired(close: u8, at: usize, open: &Frame) -> Diagnostic {
    let span = Span::new(at, at + 1);
    let partner = match open.open {
        b'(' => ')',
        b'[' => ']',
        b'{' => '}',
        _ => return Diagnostic::error("E0102", span, format!("this `{}` closes nothing", close as char)),
    };
    let d = Diagnostic::error("E0102", span, format!("expected `{partner}` before this `{}`", close as char));
    d.label(Span::new(open.at, open.at + 1), format!("this `{}` is still open", open.open as char))
}

fn string_end(bytes: &[u8], start: usize) -> usize {
    let mut at = start + 1;
    while at < bytes.len() && bytes[at] != b'"' {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(bytes.len())
}

/// End of a word or number; `1e-5` is one number.
fn word_end(bytes: &[u8], start: usize) -> usize {
    let number = bytes[start].is_ascii_digit();
    let mut at = start + 1;
    while let Some(byte) = bytes.get(at) {
        let exponent = number && matches!(byte, b'+' | b'-') && matches!(bytes[at - 1], b'e' | b'E');
        if !(byte.is_ascii_alphanumeric() || *byte == b'_' || exponent) {
            break;
        }
        at += 1;
    }
    at
}

/// Where a cast such as `(float)` ends whose parenthesis was opened just before `at`.
fn cast_end(bytes: &[u8], at: usize) -> Option<usize> {
    let skip = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        at
    };
    let start = skip(at);
    let end = bytes.get(start).filter(|b| b.is_ascii_lowercase()).map(|_| word_end(bytes, start))?;
    super::ast::TypeName::simple(std::str::from_utf8(&bytes[start..end]).ok()?)?;
    let close = skip(end);
    (bytes.get(close) == Some(&b')')).then_some(close + 1)
}
