//! From the syntax tree to a [`CheckedShader`]: names get their meaning, expressions their types.
//!
//! Every mistake is reported, each once: what is wrong has the type [`Ty::Poison`], which fits everywhere. What comes
//! out has explicit conversions and closure calls resolved to lobes, and later stages take nothing else. Nothing is
//! evaluated here but metadata and defaults.

mod ask;
mod assign;
mod call;
mod closure;
mod expr;
mod function;
mod parts;
mod place;
mod run;
mod statement;
mod suggest;
mod task;

use super::body::{Body, ExprId, ExprKind, Root, Stmt, VarId};
use super::host::{Answers, Subject};
use super::passes::fold;
use super::shader::{CheckedShader, ParamDecl, Value};
use super::types::Ty;
use crate::diag::Diagnostic;
use crate::lobes::registry::Form;
use crate::span::{Source, Span};
use crate::syntax::Limits;
use crate::syntax::ast::{self, Ast, Sym};
use function::Frame;
use place::{At, Layout, Place};
use std::collections::HashMap;
use std::sync::Arc;
pub(super) use suggest::suggest;
#[cfg(feature = "studio")]
pub(crate) use task::TASKS;

/// Checks a parsed script. `answers`: what the host says anything about. Ok: the shader and its warnings.
pub fn check(
    name: &str,
    ast: &Ast,
    hosts: &[Form],
    limits: &Limits,
    answers: Answers,
) -> Result<(CheckedShader, Vec<Diagnostic>), Vec<Diagnostic>> {
    let mut checker = Checker::new(ast, hosts, limits);
    checker.derivatives = answers.on(Subject::Derivatives);
    let shader = checker.shader(name);
    // A function written out twice is wrong twice; that is said once.
    let mut said = Vec::new();
    for d in checker.diagnostics {
        if !d.message.is_empty() && !said.contains(&d) {
            said.push(d);
        }
    }
    let (errors, warnings): (Vec<_>, Vec<_>) = said.into_iter().partition(Diagnostic::is_error);
    match shader {
        Some(shader) if errors.is_empty() => Ok((shader, warnings)),
        _ => Err(errors.into_iter().chain(warnings).collect()),
    }
}

/// An expression with the type it is used as; points, vectors and normals change type without an operation.
#[derive(Clone, Copy)]
struct Typed {
    id: ExprId,
    ty: Ty,
    /// Where it lies, if it lies somewhere; of a value of several parts this is all there is.
    place: Option<Place>,
    /// The variable it has been put aside in.
    temp: Option<VarId>,
}

/// What a script may do with a variable.
#[derive(Clone, Copy, PartialEq)]
enum Access {
    Free,
    /// A parameter that is no output.
    ReadOnly,
}

/// What a name stands for.
#[derive(Clone, Copy)]
struct Binding {
    access: Access,
    span: Span,
    /// Which block declared it, counted from the outermost.
    depth: usize,
    ty: Ty,
    place: Place,
}

struct Checker<'a> {
    ast: &'a Ast,
    /// Closures of the host.
    hosts: &'a [Form],
    limits: Limits,
    /// The host gives derivatives.
    derivatives: bool,
    body: Body,
    diagnostics: Vec<Diagnostic>,
    /// The meaning of each syntax expression of the run at hand.
    typed: Vec<Typed>,
    /// Values that wait for their operator.
    pending: Vec<ast::ExprId>,
    /// Types that places ask for.
    hints: HashMap<u32, Ty>,
    /// What the assignments of the run write.
    targets: HashMap<u32, assign::Target>,
    /// Which variable each name stands for now.
    names: HashMap<Sym, usize>,
    /// What names stood for outside the blocks that are open.
    shadowed: Vec<(Sym, Option<usize>)>,
    bindings: Vec<Binding>,
    layouts: Vec<Layout>,
    struct_names: HashMap<Sym, u16>,
    /// Element and length of each array type.
    arrays: Vec<(Ty, Option<u32>)>,
    functions: HashMap<Sym, Vec<u32>>,
    /// Some function is an operator.
    has_operators: bool,
    frame: Frame,
    /// The functions being written out.
    stack: Vec<u32>,
    calls: usize,
    over_budget: bool,
    /// Nothing uses the value of the run to come.
    discards: bool,
    depth: usize,
    chain: usize,
    /// Statements of the block at hand.
    block: Vec<Stmt>,
    /// First expression of the run at hand.
    run_start: u32,
    string_ids: HashMap<String, u32>,
    assigned_ci: bool,
}

impl<'a> Checker<'a> {
    fn new(ast: &'a Ast, hosts: &'a [Form], limits: &Limits) -> Self {
        let vars = vec![Ty::Closure, Ty::Int];
        let body = Body { vars, strings: vec![String::new()], ..Body::default() };
        let mut checker = Checker {
            ast,
            hosts,
            limits: *limits,
            derivatives: false,
            body,
            diagnostics: Vec::new(),
            typed: Vec::new(),
            pending: Vec::new(),
            hints: HashMap::new(),
            targets: HashMap::new(),
            names: HashMap::new(),
            shadowed: Vec::new(),
            bindings: Vec::new(),
            layouts: Vec::new(),
            struct_names: HashMap::new(),
            arrays: Vec::new(),
            functions: HashMap::new(),
            has_operators: false,
            frame: Frame { ty: Ty::Void, result: None, live: VarId(1), loops: Vec::new() },
            stack: Vec::new(),
            calls: 0,
            over_budget: false,
            discards: false,
            depth: 0,
            chain: 0,
            block: Vec::new(),
            run_start: 0,
            string_ids: HashMap::from([(String::new(), 0)]),
            assigned_ci: false,
        };
        let poison = checker.body.push(ExprKind::Black, Ty::Poison, Span::default());
        checker.typed = vec![Typed { id: poison, ty: Ty::Poison, place: None, temp: None }; ast.exprs.len()];
        checker
    }

    fn shader(&mut self, file: &str) -> Option<CheckedShader> {
        let ast = self.ast;
        let shader = ast.shader.as_ref()?;
        self.diagnostics.extend(ast.warnings.iter().cloned());
        self.structs();
        self.functions();
        let metadata = self.metadata(&shader.metadata);
        let mut params = Vec::new();
        let mut closures = Vec::new();
        for param in &shader.params {
            self.parameter(param, &mut params, &mut closures);
        }
        let count = self.block.len();
        self.set(self.frame.live, 1);
        self.depth = 1;
        self.list(&shader.body);
        self.depth = 0;
        self.result_of(&closures);
        self.body.stmts = std::mem::take(&mut self.block);
        let name = match shader.name {
            Some(name) => self.ast.name(name).to_owned(),
            None => stem(file).to_owned(),
        };
        if !self.assigned_ci {
            let d = Diagnostic::warning("W0501", shader.span, "`Ci` is never assigned: the material is black");
            self.diagnostics.push(d.help("assign a closure, for example `Ci = diffuse(N);`"));
        }
        if self.diagnostics.iter().any(Diagnostic::is_error) {
            return None;
        }
        let body = std::mem::take(&mut self.body);
        let sources = ast.sources.iter().map(|s: &Source| Arc::new(s.clone())).collect();
        let (host, iterations) = (None, self.limits.iterations);
        let span = shader.span;
        let mut checked =
            CheckedShader { name, span, params, metadata, body, shadows: None, sources, host, iterations };
        let known = fold::values_after(&checked.body, count);
        for param in checked.params.iter_mut().filter(|p| p.ty != Ty::Closure) {
            param.default =
                known[param.var.index()].map(|cells| Value::from_cells(param.ty, cells, &checked.body.strings));
        }
        Some(checked)
    }

    /// A shader that leaves its closure in a parameter: the first such is the material if nothing writes `Ci`.
    fn result_of(&mut self, closures: &[(VarId, bool)]) {
        let Some((var, _)) = closures.iter().find(|(_, output)| *output).filter(|_| !self.assigned_ci) else { return };
        self.run_start = self.body.exprs.len() as u32;
        let value = self.push(ExprKind::Var(*var), Ty::Closure, Span::default());
        self.assign(VarId::CI, value.id);
        self.assigned_ci = true;
    }

    fn parameter(&mut self, param: &ast::Param, out: &mut Vec<ParamDecl>, closures: &mut Vec<(VarId, bool)>) {
        let name = self.ast.name(param.name).to_owned();
        let given = param.default.and_then(|default| self.list_length(default.root));
        let ty = self.array_type(param.ty, param.length, given.or(Some(1)), param.span);
        let value = param.default.map(|default| (default, self.run_for(default, Some(ty))));
        if param.default.is_none() && !param.output && ty != Ty::Poison {
            let d = Diagnostic::error("E0203", param.span, format!("the parameter `{name}` has no default"));
            self.diagnostics.push(d.help(format!("give it one: `{} {name} = …`", self.words(ty))));
        }
        let access = if param.output { Access::Free } else { Access::ReadOnly };
        if ty == Ty::Void {
            let d = Diagnostic::error("E0203", param.span, "a parameter holds something; `void` is for functions");
            self.diagnostics.push(d);
            return;
        }
        let simple = match value {
            Some((default, value)) if !ty.is_aggregate() => {
                Some(self.initial(value, ty, self.ast.expr(default.root).span, default))
            }
            None if !ty.is_aggregate() => {
                self.run_start = self.body.exprs.len() as u32;
                Some(self.zero(ty, param.span))
            }
            _ => None,
        };
        let place = self.declare(param.name, ty, param.span, access);
        if let Some(place) = place {
            match (simple, value) {
                (Some(id), _) => self.store_at(place, ty, id, param.span),
                (None, Some((default, value))) => {
                    self.give(place, ty, value, self.ast.expr(default.root).span, default.root);
                }
                (None, None) => self.clear(place, ty, param.span),
            }
        }
        let metadata = self.metadata(&param.metadata);
        let Some(place) = place.filter(|_| ty != Ty::Poison) else { return };
        let mut parts = Vec::new();
        self.named_parts(&name, place, ty, &mut parts);
        for (name, var, ty) in parts {
            if ty == Ty::Closure {
                closures.push((var, param.output));
            }
            let (metadata, span, output) = (metadata.clone(), param.span, param.output);
            out.push(ParamDecl { name, ty, default: None, output, metadata, span, var });
        }
    }

    /// The simple parts of a parameter with their names: `a`, `s.x`, `v[2]`.
    fn named_parts(&mut self, name: &str, place: Place, ty: Ty, out: &mut Vec<(String, VarId, Ty)>) {
        match ty {
            Ty::Struct(number) => {
                for i in 0..self.layouts[usize::from(number)].fields.len() {
                    let field = self.ast.name(self.layouts[usize::from(number)].fields[i].0);
                    let (inner, ty) = self.field_of(number, place, i);
                    self.named_parts(&format!("{name}.{field}"), inner, ty, out);
                }
            }
            Ty::Matrix | Ty::Array(_) => {
                let Some((element, count)) = self.elements(ty) else { return };
                for i in 0..count {
                    let inner = self.element_of(place, count, At::Known(i), Span::default());
                    self.named_parts(&format!("{name}[{i}]"), inner, element, out);
                }
            }
            simple => {
                if let At::Known(i) = place.at {
                    out.push((name.to_owned(), VarId(place.base.0 + i), simple));
                }
            }
        }
    }

    fn metadata(&mut self, entries: &[ast::Metadatum]) -> Vec<(String, Value)> {
        let mut values = Vec::new();
        for entry in entries {
            let ty = self.named_type(entry.ty, entry.span);
            if matches!(self.ast.expr(entry.value.root).kind, ast::ExprKind::List(_)) || ty.is_aggregate() {
                // Lists in metadata are for user interfaces.
                continue;
            }
            let typed = self.run(entry.value);
            let at = self.ast.expr(entry.value.root).span;
            let value = self.initial(typed, ty, at, entry.value);
            let root = Root { first: self.run_start, root: value };
            let name = self.ast.name(entry.name).to_owned();
            if self.body.expr(value).ty == Ty::Poison {
                continue;
            }
            match fold::constant(&self.body, root) {
                Some(cells) if ty != Ty::Closure => {
                    values.push((name, Value::from_cells(ty, cells, &self.body.strings)));
                }
                _ => {
                    let message = format!("the metadata `{name}` is not a constant");
                    self.diagnostics.push(Diagnostic::error("E0203", at, message));
                }
            }
        }
        values
    }

    fn assign(&mut self, var: VarId, value: ExprId) {
        self.block.push(Stmt::Assign(var, Root { first: self.run_start, root: value }));
        self.run_start = self.body.exprs.len() as u32;
    }

    fn string(&mut self, text: &str) -> u32 {
        if let Some(id) = self.string_ids.get(text) {
            return *id;
        }
        let id = self.body.strings.len() as u32;
        self.body.strings.push(text.to_owned());
        self.string_ids.insert(text.to_owned(), id);
        id
    }

    fn error(&mut self, diagnostic: Diagnostic) -> Typed {
        self.diagnostics.push(diagnostic);
        self.poison()
    }

    fn poison(&self) -> Typed {
        Typed { id: ExprId(0), ty: Ty::Poison, place: None, temp: None }
    }
}

/// The file name without directories and extension.
fn stem(file: &str) -> &str {
    let base = file.rsplit(['/', '\\']).next().unwrap_or(file);
    match base.split_once('.') {
        Some((stem, _)) if !stem.is_empty() => stem,
        _ => base,
    }
}
