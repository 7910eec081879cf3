//! From preprocessed text to the syntax tree: the only file that names the grammar's rules.
//!
//! pest finds the structure down to flat lists of operands and operators; this file climbs those lists with explicit
//! stacks and stores what it finds operands first. After a syntax error the statement around it is blanked and the
//! rest is tried again, so that several mistakes are reported in one go. Which names exist and which types fit is not
//! decided here.

mod expression;

use super::ast::{
    Ast, Declarator, ExprId, Function, Length, Loop, Metadatum, Param, Root, Shader, ShaderKind, Stmt, Struct, Sym,
    TypeName,
};
use super::options::Options;
use super::preprocess::{Map, Wrong, moved, preprocess};
use super::recover;
use crate::diag::Diagnostic;
use crate::span::Span;
use expression::Pending;
use pest::Parser;
use pest::error::{ErrorVariant, InputLocation};

type Pair<'a> = pest::iterators::Pair<'a, Rule>;
type Pairs<'a> = pest::iterators::Pairs<'a, Rule>;

#[derive(pest_derive::Parser)]
#[grammar = "../grammar/osl.pest"]
struct Grammar;

/// How many syntax errors are looked for.
const MAX_ERRORS: usize = 8;

/// Parses a script, or says everything that is wrong with its form.
///
/// # Errors
/// All mistakes found, with their places.
pub fn parse(text: &str) -> Result<Ast, Vec<Diagnostic>> {
    parse_with("script", text, &Options::default()).map_err(|(diagnostics, _)| diagnostics)
}

/// The same for a script called `name`, with includes, macros and budgets.
///
/// # Errors
/// All mistakes found, with their places, and the included files these may lie in.
pub fn parse_with(name: &str, text: &str, options: &Options) -> Result<Ast, Wrong> {
    let done = preprocess(name, text, options)?;
    let mut blanked = done.text;
    let mut errors = Vec::new();
    while errors.len() < MAX_ERRORS {
        let failure = match Grammar::parse(Rule::script, &blanked) {
            Ok(pairs) if errors.is_empty() => {
                let mut builder = Builder::new(&done.map);
                builder.ast.warnings = done.warnings;
                return match builder.script(pairs) {
                    Ok(mut ast) => {
                        ast.sources = done.sources;
                        Ok(ast)
                    }
                    Err(errors) => Err((errors, done.sources)),
                };
            }
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
    Err((errors.into_iter().map(|d| moved(d, &done.map)).collect(), done.sources))
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
        (Rule::member, "a field"),
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

struct Builder<'m> {
    ast: Ast,
    map: &'m Map,
    errors: Vec<Diagnostic>,
    /// The climber's stacks, shared by all expressions that are open.
    operands: Vec<ExprId>,
    operators: Vec<Pending>,
}

impl<'m> Builder<'m> {
    fn new(map: &'m Map) -> Self {
        Builder { ast: Ast::default(), map, errors: Vec::new(), operands: Vec::new(), operators: Vec::new() }
    }

    fn span(&self, pair: &Pair) -> Span {
        let at = pair.as_span();
        self.map.span(at.start(), at.end())
    }

    fn script(mut self, pairs: Pairs) -> Result<Ast, Vec<Diagnostic>> {
        let mut loose = Vec::new();
        let mut loose_span = None;
        for pair in pairs.flat_map(Pair::into_inner) {
            match pair.as_rule() {
                Rule::shader => self.shader(pair),
                Rule::structure => self.structure(pair),
                Rule::statement => {
                    let before = loose.len();
                    let at = self.span(&pair);
                    self.statement(pair, &mut loose);
                    if loose.len() > before {
                        loose_span = loose_span.or(Some(at));
                    }
                }
                _ => {}
            }
        }
        match (&self.ast.shader, loose_span) {
            (None, _) => {
                self.ast.shader = Some(Shader { body: loose, ..empty() });
            }
            (Some(_), Some(at)) => {
                let d = Diagnostic::error("E0107", at, "this statement stands outside the shader");
                self.errors.push(d.help("move it between the braces of the shader"));
            }
            (Some(_), None) => {}
        }
        if self.errors.is_empty() { Ok(self.ast) } else { Err(self.errors) }
    }

    fn shader(&mut self, pair: Pair) {
        let mut shader = empty();
        for part in pair.into_inner() {
            let at = self.span(&part);
            match part.as_rule() {
                Rule::shader_kind => shader.kind = self.kind(part.as_str(), at),
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

    fn kind(&mut self, word: &str, at: Span) -> ShaderKind {
        match word {
            "surface" => ShaderKind::Surface,
            "volume" => ShaderKind::Volume,
            "light" => ShaderKind::Light,
            "displacement" => {
                let d = Diagnostic::error("E0109", at, "`displacement` shaders are not supported");
                self.errors.push(d.help("they move points and leave no closure; materials are `surface` shaders"));
                ShaderKind::Displacement
            }
            _ => ShaderKind::Generic,
        }
    }

    fn structure(&mut self, pair: Pair) {
        let mut found = None;
        let mut fields = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => found = Some((self.name(&part), self.span(&part))),
                Rule::member => {
                    let mut ty = None;
                    for inner in part.into_inner() {
                        match inner.as_rule() {
                            Rule::r#type => ty = self.type_name(inner),
                            Rule::declarator => {
                                let declarator = self.declarator(inner);
                                fields.extend(ty.zip(declarator));
                            }
                            _ => {}
                        }
                    }
                }
                _ => {}
            }
        }
        if let Some((name, span)) = found {
            self.ast.structs.push(Struct { name, span, fields });
        }
    }

    fn parameter(&mut self, pair: Pair) -> Option<Param> {
        let (mut output, mut ty, mut name, mut default, mut metadata) = (false, None, None, None, Vec::new());
        let mut length = Length::None;
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::output => output = true,
                Rule::r#type => ty = self.type_name(part),
                Rule::name => name = Some((self.name(&part), self.span(&part))),
                Rule::array => length = self.length(part),
                Rule::expression => default = Some(self.root(part)),
                Rule::metadata => metadata = self.metadata(part),
                _ => {}
            }
        }
        let (name, span) = name?;
        Some(Param { output, ty: ty?, name, span, length, default, metadata })
    }

    fn metadata(&mut self, pair: Pair) -> Vec<Metadatum> {
        let mut entries = Vec::new();
        for entry in pair.into_inner().filter(|p| p.as_rule() == Rule::metadatum) {
            let at = self.span(&entry);
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

    fn type_name(&mut self, pair: Pair) -> Option<TypeName> {
        let inner = pair.into_inner().next()?;
        match inner.as_rule() {
            Rule::closure_type => Some(TypeName::Closure),
            Rule::void_word => Some(TypeName::Void),
            Rule::named_type => inner.into_inner().next().map(|name| TypeName::Named(self.name(&name))),
            _ => TypeName::simple(inner.as_str()),
        }
    }

    fn length(&mut self, pair: Pair) -> Length {
        match pair.into_inner().next() {
            Some(expression) => Length::Given(self.root(expression)),
            None => Length::Open,
        }
    }

    /// Interns a name; a reserved word is an error.
    fn name(&mut self, pair: &Pair) -> Sym {
        let text = pair.as_str();
        if recover::RESERVED.contains(&text) {
            let message = format!("`{text}` is a word of the language and cannot be a name");
            self.errors.push(Diagnostic::error("E0107", self.span(pair), message));
        }
        self.ast.intern(text)
    }

    fn statements(&mut self, block: Pair, out: &mut Vec<Stmt>) {
        for statement in block.into_inner() {
            self.statement(statement, out);
        }
    }

    fn statement(&mut self, pair: Pair, out: &mut Vec<Stmt>) {
        let Some(inner) = pair.into_inner().next() else { return };
        match inner.as_rule() {
            Rule::block => {
                let mut body = Vec::new();
                self.statements(inner, &mut body);
                out.push(Stmt::Block(body));
            }
            Rule::conditional => self.conditional(inner, out),
            Rule::for_loop | Rule::while_loop | Rule::do_loop => self.repetition(inner, out),
            Rule::jump => self.jump(inner, out),
            Rule::declaration => self.declaration(inner, out),
            Rule::action => {
                if let Some(sequence) = inner.into_inner().next() {
                    let root = self.root(sequence);
                    out.push(Stmt::Expr(root));
                }
            }
            _ => {}
        }
    }

    fn conditional(&mut self, pair: Pair, out: &mut Vec<Stmt>) {
        let mut condition = None;
        let mut branches = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::sequence => condition = Some(self.root(part)),
                Rule::statement => branches.push(self.inner(part)),
                _ => {}
            }
        }
        let mut branches = branches.into_iter();
        if let (Some(condition), Some(then)) = (condition, branches.next()) {
            out.push(Stmt::If { condition, then: Box::new(then), other: branches.next().map(Box::new) });
        }
    }

    /// A statement below another, as a block.
    fn inner(&mut self, statement: Pair) -> Stmt {
        let mut body = Vec::new();
        self.statement(statement, &mut body);
        match &mut body[..] {
            // Braces are a block already.
            [Stmt::Block(inner)] => Stmt::Block(std::mem::take(inner)),
            _ => Stmt::Block(body),
        }
    }

    fn repetition(&mut self, pair: Pair, out: &mut Vec<Stmt>) {
        let span = self.span(&pair);
        let body_first = pair.as_rule() == Rule::do_loop;
        let (mut start, mut condition, mut step, mut body) = (Vec::new(), None, None, Stmt::Block(Vec::new()));
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::declaration => self.declaration(part, &mut start),
                Rule::for_start => {
                    for sequence in part.into_inner().filter(|p| p.as_rule() == Rule::sequence) {
                        let root = self.root(sequence);
                        start.push(Stmt::Expr(root));
                    }
                }
                Rule::for_condition => condition = part.into_inner().next().map(|p| self.root(p)),
                Rule::for_step => step = part.into_inner().next().map(|p| self.root(p)),
                Rule::sequence => condition = Some(self.root(part)),
                Rule::statement => body = self.inner(part),
                _ => {}
            }
        }
        let span = Span { end: span.start + 3, ..span };
        out.push(Stmt::Loop(Box::new(Loop { span, start, condition, body_first, step, body })));
    }

    fn jump(&mut self, pair: Pair, out: &mut Vec<Stmt>) {
        let (mut word, mut value) = (None, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::jump_word => word = Some((part.as_str() == "break", self.span(&part))),
                Rule::return_word => value = Some((None, self.span(&part))),
                Rule::sequence => value = value.map(|(_, at)| (Some(self.root(part)), at)),
                _ => {}
            }
        }
        out.extend(word.map(|(leaves, at)| if leaves { Stmt::Break(at) } else { Stmt::Continue(at) }));
        out.extend(value.map(|(value, at)| Stmt::Return(value, at)));
    }

    /// Variables, or a function.
    fn declaration(&mut self, pair: Pair, out: &mut Vec<Stmt>) {
        let mut ty = None;
        let mut name = None;
        let mut declarators = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::r#type => ty = self.type_name(part),
                Rule::name => name = Some((self.name(&part), self.span(&part))),
                Rule::first => {
                    if let Some((name, span)) = name {
                        let (length, init) = self.first(part);
                        declarators.push(Declarator { name, span, length, init });
                    }
                }
                Rule::declarator => declarators.extend(self.declarator(part)),
                Rule::function => {
                    if let (Some(ty), Some((name, span))) = (ty, name) {
                        self.function(ty, name, span, part);
                    }
                    return;
                }
                _ => {}
            }
        }
        out.extend(ty.map(|ty| Stmt::Declare(ty, declarators)));
    }

    fn declarator(&mut self, pair: Pair) -> Option<Declarator> {
        let mut parts = pair.into_inner();
        let (name, first) = (parts.next()?, parts.next()?);
        let (name, span) = (self.name(&name), self.span(&name));
        let (length, init) = self.first(first);
        Some(Declarator { name, span, length, init })
    }

    fn first(&mut self, pair: Pair) -> (Length, Option<Root>) {
        let (mut length, mut init) = (Length::None, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::array => length = self.length(part),
                Rule::expression => init = Some(self.root(part)),
                _ => {}
            }
        }
        (length, init)
    }

    fn function(&mut self, ty: TypeName, name: Sym, span: Span, pair: Pair) {
        let mut function = Function { name, span, ty, params: Vec::new(), body: None };
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::parameter => {
                    let param = self.parameter(part);
                    function.params.extend(param);
                }
                Rule::metadata => drop(self.metadata(part)),
                Rule::block => {
                    let mut body = Vec::new();
                    self.statements(part, &mut body);
                    function.body = Some(body);
                }
                _ => {}
            }
        }
        self.ast.functions.push(function);
    }
}

/// A shader of bare statements.
fn empty() -> Shader {
    let kind = ShaderKind::Surface;
    Shader { kind, name: None, span: Span::default(), metadata: Vec::new(), params: Vec::new(), body: Vec::new() }
}
