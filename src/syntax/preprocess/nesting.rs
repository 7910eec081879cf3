//! How deep brackets, prefix operators, `? :` and `else if` nest: one loop over the bytes, so that after it the grammar
//! may recurse on brackets without running out of stack.

use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::TypeName;

/// How deep brackets, prefix operators, `? :` and `else if` may nest, all taken together.
pub const MAX_DEPTH: usize = 256;

/// One open bracket and what nests inside it so far.
struct Frame {
    open: u8,
    at: usize,
    /// Prefix operators before the operand to come.
    prefixes: usize,
    /// `?` since the last comma or semicolon.
    ternaries: usize,
    /// The `if`s and loops that the statement to come belongs to.
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
            b"if" | b"for" | b"while" | b"do" => {
                if self.ended {
                    self.conditionals = 0;
                }
                self.conditionals += 1;
            }
            b"not" => {
                self.prefixes += 1;
                return;
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
pub fn nesting(text: &str) -> Option<Diagnostic> {
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
    TypeName::simple(std::str::from_utf8(&bytes[start..end]).ok()?)?;
    let close = skip(end);
    (bytes.get(close) == Some(&b')')).then_some(close + 1)
}
