//! From preprocessed text to the syntax tree: the only file that names the grammar's rules.
//!
//! pest finds the structure down to flat lists of operands and operators; this file climbs those lists with explicit
//! stacks and stores what it finds operands first. After a syntax error the statement around it is blanked and the
//! rest is tried again, so that several mistakes are reported in one go. Which names exist and which types fit is not
//! decided here.

use super::ast::{
    Args, Ast, BinaryOp, Declarator, ExprId, ExprKind, Metadatum, Param, Root, Shader, Stmt, Sym, TypeName, UnaryOp,
};
use super::preprocess::preprocess;
use super::recover;
use crate::diag::Diagnostic;
use crate::span::Span;
use pest::Parser;
use pest::error::{ErrorVariant, InputLocation};
use pest::iterators::{Pair, Pairs};

#[derive(pest_derive::Parser)]
#[grammar = "../grammar/osl.pest"]
struct Grammar;

/// How many syntax errors are looked for.
const MAX_ERRORS: usize = 8;

/// Parses a script, or says everything that is wrong with its form.
pub fn parse(text: &str) -> Result<Ast, Vec<Diagnostic>> {
    let mut blanked = preprocess(text)?;
    let mut errors = Vec::new();
    while errors.len() < MAX_ERRORS {
        let failure = match Grammar::parse(Rule::script, &blanked) {
            Ok(pairs) if errors.is_empty() => return Builder::default().script(pairs),
            Ok(_) => break,
            Err(failure) => failure,
        };
        let at = match failure.location {
            InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
        };
        let expected = match &failure.variant {
            ErrorVariant::ParsingError { positives, .. } => expectations(positives),
            ErrorVariant::CustomError { message } => {
                errors.push(Diagnostic::error("E0105", Span::new(at, at + 1), message.clone()));
                break;
            }
        };
        errors.push(recover::explain(&blanked, at, &expected));
        let only_before = recover::missing_semicolon(&blanked, at, &expected);
        if !recover::blank_statement(&mut blanked, at, only_before) {
            break;
        }
    }
    Err(errors)
}

/// The grammar's rules in a reader's words, most telling first.
fn expectations(rules: &[Rule]) -> Vec<&'static str> {
    let words = [
        (Rule::semicolon, "`;`"),
        (Rule::comma, "`,`"),
        (Rule::name, "a name"),
        (Rule::primary, "a value"),
        (Rule::number, "a value"),
        (Rule::group, "a value"),
        (Rule::expression, "a value"),
        (Rule::arguments, "`(`"),
        (Rule::block, "`{`"),
        (Rule::r#type, "a type"),
        (Rule::simple_type, "a type"),
        (Rule::parameter, "a parameter"),
        (Rule::metadatum, "an entry such as `float min = 0`"),
        (Rule::declarator, "a name"),
        (Rule::statement, "a statement"),
        (Rule::shader, "a shader"),
        (Rule::operator, "an operator"),
    ];
    let mut found: Vec<&str> = Vec::new();
    for (rule, word) in words {
        if rules.contains(&rule) && !found.contains(&word) {
            found.push(word);
        }
    }
    // A name is a value wherever both fit.
    found.retain(|word| *word != "a name" || !rules.contains(&Rule::number));
    found
}

fn span(pair: &Pair<Rule>) -> Span {
    let at = pair.as_span();
    Span::new(at.start(), at.end())
}

#[derive(Default)]
struct Builder {
    ast: Ast,
    errors: Vec<Diagnostic>,
    /// The climber's stacks, shared by all expressions that are open.
    operands: Vec<ExprId>,
    operators: Vec<Pending>,
}

/// An operator that waits for its right operand.
#[derive(Clone, Copy, PartialEq)]
enum Pending {
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

impl Builder {
    fn script(mut self, pairs: Pairs<Rule>) -> Result<Ast, Vec<Diagnostic>> {
        let mut loose = Vec::new();
        let mut loose_span = None;
        for pair in pairs.flat_map(Pair::into_inner) {
            match pair.as_rule() {
                Rule::shader => self.shader(pair),
                Rule::statement => {
                    loose_span = loose_span.or(Some(span(&pair)));
                    self.statement(pair, &mut loose);
                }
                _ => {}
            }
        }
        match (&self.ast.shader, loose_span) {
            (None, _) => {
                let (params, metadata) = (Vec::new(), Vec::new());
                self.ast.shader = Some(Shader { name: None, span: Span::default(), metadata, params, body: loose });
            }
            (Some(_), Some(at)) => {
                let d = Diagnostic::error("E0107", at, "this statement stands outside the shader");
                self.errors.push(d.help("move it between the braces of the shader"));
            }
            (Some(_), None) => {}
        }
        if self.errors.is_empty() { Ok(self.ast) } else { Err(self.errors) }
    }

    fn shader(&mut self, pair: Pair<Rule>) {
        let mut shader =
            Shader { name: None, span: Span::default(), metadata: Vec::new(), params: Vec::new(), body: Vec::new() };
        for part in pair.into_inner() {
            let at = span(&part);
            match part.as_rule() {
                Rule::shader_kind => {
                    let kind = part.as_str();
                    if !matches!(kind, "surface" | "shader") {
                        let d = Diagnostic::error("E0109", at, format!("`{kind}` shaders are not supported"));
                        self.errors.push(d.help("materials are `surface` shaders"));
                    }
                }
                Rule::name => (shader.name, shader.span) = (Some(self.name(&part)), at),
                Rule::metadata => shader.metadata = self.metadata(part),
                Rule::parameter => {
                    let param = self.parameter(part);
                    shader.params.extend(param);
                }
                Rule::block => self.statements(part, &mut shader.body),
                _ => {}
            }
        }
        if let Some(first) = &self.ast.shader {
            let d = Diagnostic::error("E0109", shader.span, "a script holds one shader, this is the second");
            self.errors.push(d.label(first.span, "the first"));
        } else {
            self.ast.shader = Some(shader);
        }
    }

    fn parameter(&mut self, pair: Pair<Rule>) -> Option<Param> {
        let (mut output, mut ty, mut name, mut default, mut metadata) = (false, None, None, None, Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::output => output = true,
                Rule::r#type => ty = self.type_name(part),
                Rule::name => name = Some((self.name(&part), span(&part))),
                Rule::expression => default = Some(self.root(part)),
                Rule::metadata => metadata = self.metadata(part),
                _ => {}
            }
        }
        let (name, span) = name?;
        Some(Param { output, ty: ty?, name, span, default, metadata })
    }

    fn metadata(&mut self, pair: Pair<Rule>) -> Vec<Metadatum> {
        let mut entries = Vec::new();
        for entry in pair.into_inner().filter(|p| p.as_rule() == Rule::metadatum) {
            let at = span(&entry);
            let (mut ty, mut name, mut value) = (None, None, None);
            for part in entry.into_inner() {
                match part.as_rule() {
                    Rule::r#type => ty = self.type_name(part),
                    Rule::name => name = Some(self.name(&part)),
                    Rule::expression => value = Some(self.root(part)),
                    _ => {}
                }
            }
            if let (Some(ty), Some(name), Some(value)) = (ty, name, value) {
                entries.push(Metadatum { ty, name, value, span: at });
            }
        }
        entries
    }

    fn type_name(&mut self, pair: Pair<Rule>) -> Option<TypeName> {
        let inner = pair.into_inner().next()?;
        match inner.as_rule() {
            Rule::closure_type => Some(TypeName::Closure),
            _ => TypeName::simple(inner.as_str()),
        }
    }

    /// Interns a name; a reserved word is an error.
    fn name(&mut self, pair: &Pair<Rule>) -> Sym {
        let text = pair.as_str();
        if recover::RESERVED.contains(&text) {
            let message = format!("`{text}` is a word of the language and cannot be a name");
            self.errors.push(Diagnostic::error("E0107", span(pair), message));
        }
        self.ast.intern(text)
    }

    fn statements(&mut self, block: Pair<Rule>, out: &mut Vec<Stmt>) {
        for statement in block.into_inner() {
            self.statement(statement, out);
        }
    }

    fn statement(&mut self, pair: Pair<Rule>, out: &mut Vec<Stmt>) {
        let Some(inner) = pair.into_inner().next() else { return };
        match inner.as_rule() {
            Rule::block => {
                let mut body = Vec::new();
                self.statements(inner, &mut body);
                out.push(Stmt::Block(body));
            }
            Rule::conditional => self.conditional(inner, out),
            Rule::declaration => self.declaration(inner, out),
            Rule::action => {
                if let Some(expression) = inner.into_inner().next() {
                    let root = self.root(expression);
                    out.push(Stmt::Expr(root));
                }
            }
            _ => {}
        }
    }

    fn conditional(&mut self, pair: Pair<Rule>, out: &mut Vec<Stmt>) {
        let mut condition = None;
        let mut branches = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::expression => condition = Some(self.root(part)),
                Rule::statement => {
                    let mut body = Vec::new();
                    self.statement(part, &mut body);
                    branches.push(Stmt::Block(body));
                }
                _ => {}
            }
        }
        let mut branches = branches.into_iter();
        if let (Some(condition), Some(then)) = (condition, branches.next()) {
            out.push(Stmt::If { condition, then: Box::new(then), other: branches.next().map(Box::new) });
        }
    }

    fn declaration(&mut self, pair: Pair<Rule>, out: &mut Vec<Stmt>) {
        let mut ty = None;
        let mut declarators = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::r#type => ty = self.type_name(part),
                Rule::declarator => {
                    let mut parts = part.into_inner();
                    if let Some(name) = parts.next() {
                        let (at, sym) = (span(&name), self.name(&name));
                        let init = parts.next().map(|e| self.root(e));
                        declarators.push(Declarator { name: sym, span: at, init });
                    }
                }
                _ => {}
            }
        }
        out.extend(ty.map(|ty| Stmt::Declare(ty, declarators)));
    }

    fn root(&mut self, expression: Pair<Rule>) -> Root {
        let first = self.ast.exprs.len() as u32;
        let root = self.expression(expression);
        Root { first, root }
    }

    /// Builds one flat list of operands and operators: a shunting yard over shared stacks, of which this call uses
    /// what lies above its own base.
    fn expression(&mut self, pair: Pair<Rule>) -> ExprId {
        let whole = span(&pair);
        let base = self.operators.len();
        let bottom = self.operands.len();
        let mut prefixes = Vec::new();
        for part in pair.into_inner() {
            let at = span(&part);
            match part.as_rule() {
                Rule::prefix => prefixes.push((part.as_str().to_owned(), at)),
                Rule::operator => {
                    self.apply_prefixes(&mut prefixes);
                    self.operator(part.as_str(), at, base);
                }
                Rule::index | Rule::field => self.postfix(part),
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
                "!" => ExprKind::Unary(UnaryOp::Not, operand),
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

    fn operand(&mut self, pair: Pair<Rule>, negated: bool) -> ExprId {
        let at = span(&pair);
        match pair.as_rule() {
            Rule::group => match pair.into_inner().next() {
                Some(inner) => self.expression(inner),
                None => self.ast.push(ExprKind::Int(0), at),
            },
            Rule::number => {
                let kind = self.number(pair.as_str(), at, negated);
                self.ast.push(kind, at)
            }
            Rule::string => {
                let text = unescape(pair.as_str());
                let sym = self.ast.intern(&text);
                self.ast.push(ExprKind::String(sym), at)
            }
            _ => self.call_or_name(pair, at),
        }
    }

    fn call_or_name(&mut self, pair: Pair<Rule>, at: Span) -> ExprId {
        let mut parts = pair.into_inner();
        let (name, arguments) = (parts.next(), parts.next());
        let Some(name) = name else { return self.ast.push(ExprKind::Int(0), at) };
        let (text, name_at) = (name.as_str(), span(&name));
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

    fn arguments(&mut self, pair: Pair<Rule>) -> Args {
        let inner = pair.into_inner().filter(|p| p.as_rule() == Rule::expression);
        let ids: Vec<ExprId> = inner.map(|e| self.expression(e)).collect();
        let args = Args { start: self.ast.args.len() as u32, len: ids.len() as u32 };
        self.ast.args.extend(ids);
        args
    }

    fn postfix(&mut self, pair: Pair<Rule>) {
        let Some(operand) = self.operands.pop() else { return };
        let whole = self.ast.expr(operand).span.to(span(&pair));
        let rule = pair.as_rule();
        let Some(inner) = pair.into_inner().next() else { return };
        let kind = if rule == Rule::index {
            ExprKind::Index(operand, self.expression(inner))
        } else {
            let sym = self.ast.intern(inner.as_str());
            ExprKind::Field(operand, sym, span(&inner))
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
