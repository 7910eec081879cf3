//! `#define` and what becomes of its names.
//!
//! Macros are replaced in text: a name in the text gives way to its body, arguments replaced first, and the result is
//! looked through again with that name left alone. Strings are never looked into. Everything produced on the way counts
//! toward a budget, so that definitions which double each other end in an error.

use std::collections::HashMap;

/// One `#define`.
#[derive(Clone, Debug, PartialEq)]
pub struct Macro {
    /// Names of the arguments; `None`: it takes none and no parentheses.
    params: Option<Vec<String>>,
    /// The last argument takes all that are left.
    variadic: bool,
    body: String,
}

/// Macros that nest deeper are left alone with an error.
const MAX_DEPTH: usize = 128;

/// All definitions at one place of the text.
#[derive(Debug, Default)]
pub struct Macros {
    by_name: HashMap<String, Macro>,
    /// Bytes produced so far.
    spent: usize,
    /// Uses within arguments and bodies of uses that are open.
    depth: usize,
}

/// Where a name is used: for `__LINE__` and `__FILE__`.
pub struct Use<'a> {
    /// Counted from 1.
    pub line: usize,
    /// Name of the file.
    pub file: &'a str,
    /// How many bytes may be produced.
    pub budget: usize,
}

/// Why macros cannot be replaced.
#[derive(Debug, PartialEq)]
pub enum Trouble {
    /// What is wrong with it.
    Wrong(String),
    /// Beyond the budget of bytes, or too deep.
    Budget,
}

impl Macros {
    /// Whether `name` is defined.
    pub fn is_defined(&self, name: &str) -> bool {
        self.by_name.contains_key(name) || matches!(name, "__LINE__" | "__FILE__")
    }

    /// Whether `name` wants arguments in parentheses.
    pub fn takes_arguments(&self, name: &str) -> bool {
        self.by_name.get(name).is_some_and(|m| m.params.is_some())
    }

    /// Defines `name` without arguments.
    pub fn define(&mut self, name: &str, body: &str) {
        let definition = Macro { params: None, variadic: false, body: body.trim().to_owned() };
        self.by_name.insert(name.to_owned(), definition);
    }

    /// Forgets `name`.
    pub fn undefine(&mut self, name: &str) {
        self.by_name.remove(name);
    }

    /// What stands after `#define`. The old definition comes back if there was another one.
    pub fn define_line(&mut self, line: &str) -> Result<Option<String>, String> {
        let line = line.trim_start();
        let end = line.find(|c: char| !is_word(c)).unwrap_or(line.len());
        let (name, rest) = line.split_at(end);
        if name.is_empty() || name.starts_with(|c: char| c.is_ascii_digit()) {
            return Err("`#define` needs a name".to_owned());
        }
        if matches!(name, "defined" | "__LINE__" | "__FILE__") {
            return Err(format!("`{name}` cannot be defined"));
        }
        let mut definition = Macro { params: None, variadic: false, body: String::new() };
        let mut body = rest;
        if let Some(inner) = rest.strip_prefix('(') {
            let Some((list, after)) = inner.split_once(')') else {
                return Err(format!("the parameters of `{name}` are never closed"));
            };
            let mut params = Vec::new();
            for param in list.split(',').map(str::trim) {
                if param == "..." {
                    definition.variadic = true;
                    params.push("__VA_ARGS__".to_owned());
                } else if !param.is_empty() && param.chars().all(is_word) && !definition.variadic {
                    params.push(param.to_owned());
                } else if !(param.is_empty() && list.trim().is_empty()) {
                    return Err(format!("`{param}` cannot be a parameter of `{name}`"));
                }
            }
            definition.params = Some(params);
            body = after;
        }
        definition.body = body.trim().to_owned();
        let differs = self.by_name.get(name).is_some_and(|old| *old != definition);
        self.by_name.insert(name.to_owned(), definition);
        Ok(differs.then(|| name.to_owned()))
    }

    /// Text with every macro in it replaced.
    pub fn expand(&mut self, text: &str, at: &Use) -> Result<String, Trouble> {
        self.expand_within(text, at, &mut Vec::new())
    }

    fn expand_within(&mut self, text: &str, at: &Use, open: &mut Vec<String>) -> Result<String, Trouble> {
        if self.depth >= MAX_DEPTH {
            return Err(Trouble::Budget);
        }
        self.depth += 1;
        let expanded = self.expand_once(text, at, open);
        self.depth -= 1;
        expanded
    }

    fn expand_once(&mut self, text: &str, at: &Use, open: &mut Vec<String>) -> Result<String, Trouble> {
        let mut out = String::with_capacity(text.len());
        let mut rest = text;
        while !rest.is_empty() {
            let (piece, kind) = next_piece(rest);
            rest = &rest[piece.len()..];
            if kind != Piece::Word || open.iter().any(|name| name == piece) || !self.is_defined(piece) {
                out.push_str(piece);
                continue;
            }
            let mut arguments = None;
            if self.takes_arguments(piece) {
                let Some((given, after)) = arguments_of(rest)? else {
                    // Without parentheses it is a name like any other.
                    out.push_str(piece);
                    continue;
                };
                (arguments, rest) = (Some(given), after);
            }
            let replaced = self.replace(piece, arguments.as_deref(), at, open)?;
            self.spend(replaced.len(), at)?;
            out.push_str(&replaced);
        }
        Ok(out)
    }

    fn spend(&mut self, bytes: usize, at: &Use) -> Result<(), Trouble> {
        self.spent += bytes + 1;
        if self.spent > at.budget { Err(Trouble::Budget) } else { Ok(()) }
    }

    /// What one use of a macro gives way to.
    fn replace(
        &mut self,
        name: &str,
        given: Option<&[String]>,
        at: &Use,
        open: &mut Vec<String>,
    ) -> Result<String, Trouble> {
        match name {
            "__LINE__" => return Ok(at.line.to_string()),
            "__FILE__" => return Ok(format!("{:?}", at.file)),
            _ => {}
        }
        let Some(definition) = self.by_name.get(name).cloned() else { return Ok(name.to_owned()) };
        let body = match (&definition.params, given) {
            (Some(params), Some(given)) => self.filled(name, &definition, params, given, at, open)?,
            _ => joined(&definition.body),
        };
        self.spend(body.len(), at)?;
        open.push(name.to_owned());
        let expanded = self.expand_within(&body, at, open);
        open.pop();
        expanded
    }

    /// The body with its arguments in place.
    fn filled(
        &mut self,
        name: &str,
        definition: &Macro,
        params: &[String],
        given: &[String],
        at: &Use,
        open: &mut Vec<String>,
    ) -> Result<String, Trouble> {
        let mut given = given.to_vec();
        if definition.variadic && given.len() >= params.len() {
            let rest = given.split_off(params.len() - 1).join(",");
            given.push(rest);
        } else if definition.variadic && given.len() + 1 == params.len() {
            given.push(String::new());
        }
        if params.is_empty() && given.len() == 1 && given[0].trim().is_empty() {
            given.clear();
        }
        if given.len() != params.len() {
            let (wants, has) = (params.len(), given.len());
            return Err(Trouble::Wrong(format!("the macro `{name}` takes {wants} arguments, not {has}")));
        }
        let mut expanded: Vec<Option<String>> = vec![None; given.len()];
        let mut out = String::new();
        let mut rest = definition.body.as_str();
        let mut pasting = false;
        while !rest.is_empty() {
            let (piece, kind) = next_piece(rest);
            rest = &rest[piece.len()..];
            let paste_follows = rest.trim_start().starts_with("##");
            if rest_is_paste(piece, rest) {
                rest = &rest[1..];
                out.truncate(out.trim_end().len());
                rest = rest.trim_start();
                pasting = true;
                continue;
            }
            let index = if kind == Piece::Word { params.iter().position(|p| p == piece) } else { None };
            if piece == "#" {
                let after = rest.trim_start();
                let (next, _) = next_piece(after);
                if let Some(index) = params.iter().position(|p| p == next) {
                    out.push_str(&format!("{:?}", given[index].trim()));
                    rest = &after[next.len()..];
                    pasting = false;
                    continue;
                }
            }
            match index {
                // Operands of `##` go in as they are.
                Some(index) if pasting || paste_follows => out.push_str(given[index].trim()),
                Some(index) => {
                    if expanded[index].is_none() {
                        let text = self.expand_within(given[index].trim(), at, open)?;
                        self.spend(text.len(), at)?;
                        expanded[index] = Some(text);
                    }
                    let text = expanded[index].as_deref().unwrap_or("");
                    self.spend(text.len(), at)?;
                    out.push_str(text);
                }
                None => out.push_str(piece),
            }
            pasting = pasting && piece.trim().is_empty();
        }
        Ok(out)
    }
}

/// Whether `##` begins here.
fn rest_is_paste(piece: &str, rest: &str) -> bool {
    piece == "#" && rest.starts_with('#')
}

/// A body without arguments, its `##` carried out.
fn joined(body: &str) -> String {
    if !body.contains("##") {
        return body.to_owned();
    }
    body.split("##").map(str::trim).collect()
}

/// What a piece of text is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// A name.
    Word,
    /// A number, a string, a sign, blanks.
    Other,
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The name, number, string, or other character that text begins with.
pub fn next_piece(text: &str) -> (&str, Piece) {
    let bytes = text.as_bytes();
    let word = |from: usize| bytes[from..].iter().position(|b| !is_word(*b as char)).map_or(text.len(), |n| from + n);
    match bytes.first() {
        None => ("", Piece::Other),
        Some(b) if b.is_ascii_alphabetic() || *b == b'_' => (&text[..word(0)], Piece::Word),
        Some(b) if b.is_ascii_digit() => {
            let mut end = word(0);
            while bytes.get(end) == Some(&b'.') {
                end = word(end + 1);
            }
            (&text[..end], Piece::Other)
        }
        Some(b'"') => {
            let mut end = 1;
            while end < bytes.len() && bytes[end] != b'"' && bytes[end] != b'\n' {
                end += if bytes[end] == b'\\' { 2 } else { 1 };
            }
            let mut end = (end + 1).min(bytes.len());
            while !text.is_char_boundary(end) {
                end += 1;
            }
            (&text[..end], Piece::Other)
        }
        Some(_) => {
            let plain = text.find(|c: char| is_word(c) || c == '"' || c == '#').unwrap_or(text.len());
            let first = text.chars().next().map_or(0, char::len_utf8);
            (&text[..plain.max(first)], Piece::Other)
        }
    }
}

/// The arguments in the parentheses that follow, and what comes after them; `None` if no parenthesis follows.
#[allow(clippy::type_complexity)]
pub fn arguments_of(text: &str) -> Result<Option<(Vec<String>, &str)>, Trouble> {
    let open = text.trim_start();
    let Some(mut rest) = open.strip_prefix('(') else { return Ok(None) };
    let (mut given, mut now, mut depth) = (Vec::new(), String::new(), 0usize);
    while !rest.is_empty() {
        if rest.starts_with(|c| c == '"' || is_word(c)) {
            let (piece, _) = next_piece(rest);
            now.push_str(piece);
            rest = &rest[piece.len()..];
            continue;
        }
        let c = rest.chars().next().unwrap_or(' ');
        rest = &rest[c.len_utf8()..];
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' if depth == 0 => {
                given.push(now);
                return Ok(Some((given, rest)));
            }
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                given.push(std::mem::take(&mut now));
                continue;
            }
            _ => {}
        }
        now.push(c);
    }
    Err(Trouble::Wrong("the arguments of this macro are never closed".to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expand(lines: &[&str], text: &str) -> Result<String, Trouble> {
        let mut macros = Macros::default();
        for line in lines {
            macros.define_line(line).unwrap();
        }
        macros.expand(text, &Use { line: 7, file: "a.osl", budget: 10_000 })
    }

    #[test]
    fn macros_are_replaced() {
        let twice = ["TWICE(x) ((x) + (x))", "A 3", "CAT(a, b) a ## b", "STR(a) #a", "SELF SELF + 1"];
        for (text, want) in [
            ("TWICE(A)", "((3) + (3))"),
            ("TWICE", "TWICE"),
            ("TWICE (f(1, 2))", "((f(1, 2)) + (f(1, 2)))"),
            ("CAT(A, 1) CAT(x, _y)", "A1 x_y"),
            ("\"A\" A AB", "\"A\" 3 AB"),
            ("STR(a b)", "\"a b\""),
            ("SELF", "SELF + 1"),
            ("__LINE__ __FILE__", "7 \"a.osl\""),
            ("TWICE(TWICE(1))", "((((1) + (1))) + (((1) + (1))))"),
        ] {
            assert_eq!(expand(&twice, text).unwrap(), want, "{text}");
        }
        assert!(matches!(expand(&twice, "CAT(1)"), Err(Trouble::Wrong(_))));
        assert!(matches!(expand(&twice, "CAT(1, (2"), Err(Trouble::Wrong(_))));
        assert_eq!(expand(&["V(a, ...) f(a, __VA_ARGS__)"], "V(1, 2, 3)").unwrap(), "f(1, 2, 3)");
    }

    #[test]
    fn doubling_ends_in_an_error() {
        let lines: Vec<String> = (0..60).map(|i| format!("M{} M{i} M{i}", i + 1)).collect();
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        assert_eq!(expand(&lines, "M60"), Err(Trouble::Budget));
    }
}
