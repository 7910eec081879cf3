//! Expressions: flat lists of operands and operators, climbed with explicit stacks and stored operands first.

use super::super::ast::{Args, BinaryOp, ExprId, ExprKind, Root, Step, TypeName, UnaryOp};
use super::{Builder, Pair, Rule};
use crate::diag::Diagnostic;
use crate::span::Span;

/// An operator that waits for its right operand.
#[derive(Clone, Copy, PartialEq)]
pub enum Pending {
    Binary(BinaryOp),
    Assign(Option<BinaryOp>),
    /// `?`, waiting for its `:`; nothing below it can be reduced before that.
    Question(Span),
    Colon,
}

impl Pending {
    fn level(self) -> u8 {
        match self {
            Pending::Binary(op) => op.level(),
            Pending::Colon => 3,
            Pending::Assign(_) => 1,
            Pending::Question(_) => 0,
        }
    }
}

impl Builder<'_> {
    pub(super) fn root(&mut self, expression: Pair) -> Root {
        let first = self.ast.exprs.len() as u32;
        let root = self.sequence(expression);
        Root { first, root }
    }

    /// Expressions separated by commas, or one alone.
    fn sequence(&mut self, pair: Pair) -> ExprId {
        if pair.as_rule() != Rule::sequence {
            return self.expression(pair);
        }
        let at = self.span(&pair);
        let mut last = None;
        for part in pair.into_inner().filter(|p| p.as_rule() == Rule::expression) {
            let next = self.expression(part);
            last = Some(match last {
                None => next,
                Some(before) => self.ast.push(ExprKind::Comma(before, next), at),
            });
        }
        last.unwrap_or_else(|| self.ast.push(ExprKind::Int(0), at))
    }

    /// Builds one flat list of operands and operators: a shunting yard over shared stacks, of which this call uses
    /// what lies above its own base.
    fn expression(&mut self, pair: Pair) -> ExprId {
        let whole = self.span(&pair);
        let base = self.operators.len();
        let bottom = self.operands.len();
        let mut prefixes = Vec::new();
        for part in pair.into_inner() {
            let at = self.span(&part);
            match part.as_rule() {
                Rule::prefix => prefixes.push((part.as_str().to_owned(), at)),
                Rule::operator => {
                    self.apply_prefixes(&mut prefixes);
                    self.operator(part.as_str(), at, base);
                }
                Rule::index | Rule::field | Rule::step => self.postfix(part),
                _ => {
                    let negated = prefixes.last().is_some_and(|(text, _)| text == "-");
                    let operand = self.operand(part, negated);
                    self.operands.push(operand);
                }
            }
        }
        self.apply_prefixes(&mut prefixes);
        while self.operators.len() > base {
            if let Some(Pending::Question(at)) = self.operators.last().copied() {
                let d = Diagnostic::error("E0107", at, "this `?` has no `:`");
                self.errors.push(d.help("write `condition ? value : other_value`"));
                self.operators.pop();
                self.operands.pop();
                continue;
            }
            self.reduce();
        }
        let root = if self.operands.len() > bottom { self.operands.pop() } else { None };
        self.operands.truncate(bottom);
        root.unwrap_or_else(|| self.ast.push(ExprKind::Int(0), whole))
    }

    fn apply_prefixes(&mut self, prefixes: &mut Vec<(String, Span)>) {
        while let Some((text, at)) = prefixes.pop() {
            let Some(operand) = self.operands.pop() else { return };
            let whole = at.to(self.ast.expr(operand).span);
            let kind = match text.as_str() {
                "-" => ExprKind::Unary(UnaryOp::Neg, operand),
                "+" => ExprKind::Unary(UnaryOp::Plus, operand),
                "!" | "not" => ExprKind::Unary(UnaryOp::Not, operand),
                "++" | "--" => ExprKind::Step(Step { down: text == "--", after: false }, operand),
                "~" => ExprKind::Unary(UnaryOp::BitNot, operand),
                cast => {
                    let word = cast.trim_matches(|c: char| !c.is_ascii_alphanumeric());
                    ExprKind::Cast(TypeName::simple(word).unwrap_or(TypeName::Float), operand)
                }
            };
            let id = self.ast.push(kind, whole);
            self.operands.push(id);
        }
    }

    fn operator(&mut self, text: &str, at: Span, base: usize) {
        let (pending, keeps) = match text {
            "?" => (Pending::Question(at), 3),
            ":" => return self.colon(at, base),
            "=" => (Pending::Assign(None), 1),
            _ => match (BinaryOp::from_text(text), text.strip_suffix('=').and_then(BinaryOp::from_text)) {
                (Some(op), _) => (Pending::Binary(op), op.level() - 1),
                (None, op) => (Pending::Assign(op), 1),
            },
        };
        // `keeps`: pending operators up to this level wait; left-associative ones keep one level less than their own.
        while self.operators.len() > base && self.operators.last().is_some_and(|op| op.level() > keeps) {
            self.reduce();
        }
        self.operators.push(pending);
    }

    fn colon(&mut self, at: Span, base: usize) {
        while self.operators.len() > base && !matches!(self.operators.last(), Some(Pending::Question(_))) {
            self.reduce();
        }
        if self.operators.len() > base {
            self.operators.pop();
            self.operators.push(Pending::Colon);
        } else {
            self.errors.push(Diagnostic::error("E0107", at, "this `:` has no `?`"));
            self.operands.pop();
        }
    }

    /// Joins the last operator with its operands.
    fn reduce(&mut self) {
        let (Some(op), Some(right), Some(left)) = (self.operators.pop(), self.operands.pop(), self.operands.pop())
        else {
            return;
        };
        let mut whole = self.ast.expr(left).span.to(self.ast.expr(right).span);
        let kind = match op {
            Pending::Binary(op) => ExprKind::Binary(op, left, right),
            Pending::Assign(op) => ExprKind::Assign(op, left, right),
            Pending::Colon | Pending::Question(_) => {
                let Some(condition) = self.operands.pop() else { return };
                whole = self.ast.expr(condition).span.to(whole);
                ExprKind::Ternary(condition, left, right)
            }
        };
        let id = self.ast.push(kind, whole);
        self.operands.push(id);
    }

    fn operand(&mut self, pair: Pair, negated: bool) -> ExprId {
        let at = self.span(&pair);
        match pair.as_rule() {
            Rule::group => match pair.into_inner().next() {
                Some(inner) => self.sequence(inner),
                None => self.ast.push(ExprKind::Int(0), at),
            },
            Rule::number => {
                let kind = self.number(pair.as_str(), at, negated);
                self.ast.push(kind, at)
            }
            Rule::text => {
                let text: String = pair.into_inner().map(|part| unescape(part.as_str())).collect();
                let sym = self.ast.intern(&text);
                self.ast.push(ExprKind::String(sym), at)
            }
            Rule::list => {
                let args = self.arguments(pair);
                self.ast.push(ExprKind::List(args), at)
            }
            _ => self.call_or_name(pair, at),
        }
    }

    fn call_or_name(&mut self, pair: Pair, at: Span) -> ExprId {
        let mut parts = pair.into_inner();
        let (name, arguments) = (parts.next(), parts.next());
        let Some(name) = name else { return self.ast.push(ExprKind::Int(0), at) };
        let (text, name_at) = (name.as_str(), self.span(&name));
        match (TypeName::simple(text), arguments) {
            (Some(ty), Some(arguments)) => {
                let args = self.arguments(arguments);
                self.ast.push(ExprKind::Construct(ty, args), at)
            }
            (None, Some(arguments)) => {
                let sym = self.name(&name);
                let args = self.arguments(arguments);
                self.ast.push(ExprKind::Call(sym, name_at, args), at)
            }
            (_, None) => {
                let sym = self.name(&name);
                self.ast.push(ExprKind::Name(sym), name_at)
            }
        }
    }

    fn arguments(&mut self, pair: Pair) -> Args {
        let inner = pair.into_inner().filter(|p| p.as_rule() == Rule::expression);
        let ids: Vec<ExprId> = inner.map(|e| self.expression(e)).collect();
        let args = Args { start: self.ast.args.len() as u32, len: ids.len() as u32 };
        self.ast.args.extend(ids);
        args
    }

    fn postfix(&mut self, pair: Pair) {
        let Some(operand) = self.operands.pop() else { return };
        let whole = self.ast.expr(operand).span.to(self.span(&pair));
        let rule = pair.as_rule();
        if rule == Rule::step {
            let step = Step { down: pair.as_str() == "--", after: true };
            let id = self.ast.push(ExprKind::Step(step, operand), whole);
            return self.operands.push(id);
        }
        let Some(inner) = pair.into_inner().next() else { return };
        let kind = if rule == Rule::index {
            ExprKind::Index(operand, self.sequence(inner))
        } else {
            let sym = self.ast.intern(inner.as_str());
            ExprKind::Field(operand, sym, self.span(&inner))
        };
        let id = self.ast.push(kind, whole);
        self.operands.push(id);
    }

    fn number(&mut self, text: &str, at: Span, negated: bool) -> ExprKind {
        let too_large = || {
            Diagnostic::error("E0108", at, format!("`{text}` does not fit an int"))
                .help("write it with a point to make it a float")
        };
        if let Some(digits) = text.strip_prefix("0x").or(text.strip_prefix("0X")) {
            // Hexadecimal names the bits.
            return ExprKind::Int(u32::from_str_radix(digits, 16).map_or_else(
                |_| {
                    self.errors.push(too_large());
                    0
                },
                |bits| bits as i32,
            ));
        }
        if text.bytes().all(|b| b.is_ascii_digit()) {
            // −2147483648 is an int although 2147483648 is none; negating the wrapped value gives it back.
            let limit = if negated { 1 << 31 } else { (1 << 31) - 1 };
            return ExprKind::Int(match text.parse::<i64>() {
                Ok(value) if value <= limit => value as i32,
                _ => {
                    self.errors.push(too_large());
                    0
                }
            });
        }
        let value = text.trim_end_matches(['f', 'F']).parse::<f32>().unwrap_or(f32::NAN);
        if !value.is_finite() {
            self.errors.push(Diagnostic::error("E0108", at, "this number does not fit a float"));
        }
        ExprKind::Float(value)
    }
}

/// The text between the quotes with its escapes resolved.
fn unescape(quoted: &str) -> String {
    let inner = quoted.get(1..quoted.len().saturating_sub(1)).unwrap_or("");
    let mut out = String::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        match c {
            '\\' => out.extend(chars.next().map(|escaped| match escaped {
                'n' => '\n',
                't' => '\t',
                'r' => '\r',
                other => other,
            })),
            c => out.push(c),
        }
    }
    out
}
