//! From the syntax tree to a [`CheckedShader`]: names get their meaning, expressions their types.
//!
//! Every mistake is reported, each once: what is wrong has the type [`Ty::Poison`], which fits everywhere. What comes
//! out has explicit conversions and closure calls resolved to lobes, and later stages take nothing else. Nothing is
//! evaluated here but metadata and defaults.

mod call;
mod expr;
mod suggest;

use super::body::{Body, ExprId, ExprKind, Root, Stmt, VarId};
use super::passes::fold;
use super::shader::{CheckedShader, ParamDecl, Value};
use super::types::Ty;
use crate::diag::Diagnostic;
use crate::lobes::registry::Form;
use crate::span::Span;
use crate::syntax::ast::{self, Ast, Sym};
use std::collections::HashMap;
pub(super) use suggest::suggest;

/// Checks a parsed script. Ok: the shader and its warnings.
pub fn check(name: &str, ast: &Ast, hosts: &[Form]) -> Result<(CheckedShader, Vec<Diagnostic>), Vec<Diagnostic>> {
    let mut checker = Checker::new(ast, hosts);
    let shader = checker.shader(name);
    let (errors, warnings): (Vec<_>, Vec<_>) = checker.diagnostics.into_iter().partition(Diagnostic::is_error);
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
}

/// What a script may do with a variable.
#[derive(Clone, Copy, PartialEq)]
enum Access {
    Free,
    /// A parameter that is no output.
    ReadOnly,
}

struct Variable {
    access: Access,
    span: Span,
    /// Which block declared it, counted from the outermost.
    depth: usize,
}

struct Checker<'a> {
    ast: &'a Ast,
    /// Closures of the host.
    hosts: &'a [Form],
    body: Body,
    diagnostics: Vec<Diagnostic>,
    /// The meaning of each syntax expression of the run at hand.
    typed: Vec<Typed>,
    /// Which variable each name stands for now.
    names: HashMap<Sym, VarId>,
    /// What names stood for outside the blocks that are open.
    shadowed: Vec<(Sym, Option<VarId>)>,
    variables: Vec<Variable>,
    depth: usize,
    /// Statements of the block at hand.
    block: Vec<Stmt>,
    /// First expression of the run at hand.
    run_start: u32,
    string_ids: HashMap<String, u32>,
    assigned_ci: bool,
}

impl<'a> Checker<'a> {
    fn new(ast: &'a Ast, hosts: &'a [Form]) -> Self {
        let body = Body { vars: vec![Ty::Closure], strings: vec![String::new()], ..Body::default() };
        let variables = vec![Variable { access: Access::Free, span: Span::default(), depth: 0 }];
        Checker {
            ast,
            hosts,
            body,
            diagnostics: Vec::new(),
            typed: Vec::new(),
            names: HashMap::new(),
            shadowed: Vec::new(),
            variables,
            depth: 0,
            block: Vec::new(),
            run_start: 0,
            string_ids: HashMap::from([(String::new(), 0)]),
            assigned_ci: false,
        }
    }

    fn shader(&mut self, file: &str) -> Option<CheckedShader> {
        let shader = self.ast.shader.as_ref()?;
        let poison = self.body.push(ExprKind::Black, Ty::Poison, Span::default());
        self.typed = vec![Typed { id: poison, ty: Ty::Poison }; self.ast.exprs.len()];
        let metadata = self.metadata(&shader.metadata);
        let mut params = Vec::new();
        for param in &shader.params {
            params.extend(self.parameter(param));
        }
        self.depth = 1;
        for stmt in &shader.body {
            self.statement(stmt);
        }
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
        let mut checked =
            CheckedShader { name, span: shader.span, params, metadata, body: std::mem::take(&mut self.body) };
        let known = fold::values_after(&checked.body, checked.params.len());
        for param in &mut checked.params {
            param.default =
                known[param.var.index()].map(|cells| Value::from_cells(param.ty, cells, &checked.body.strings));
        }
        Some(checked)
    }

    fn parameter(&mut self, param: &ast::Param) -> Option<ParamDecl> {
        let ty = Ty::from(param.ty);
        let name = self.ast.name(param.name).to_owned();
        let value = match param.default {
            Some(default) => {
                let value = self.run(default);
                let at = self.ast.expr(default.root).span;
                self.initial(value, ty, at, default)
            }
            None => {
                if !param.output {
                    let d = Diagnostic::error("E0203", param.span, format!("the parameter `{name}` has no default"));
                    self.diagnostics.push(d.help(format!("give it one: `{} {name} = …`", ty.name())));
                }
                self.zero(ty, param.span)
            }
        };
        let access = if param.output { Access::Free } else { Access::ReadOnly };
        let var = self.declare(param.name, ty, param.span, access);
        if let Some(var) = var {
            self.assign(var, value);
        }
        let metadata = self.metadata(&param.metadata);
        let var = var?;
        Some(ParamDecl { name, ty, default: None, output: param.output, metadata, span: param.span, var })
    }

    fn metadata(&mut self, entries: &[ast::Metadatum]) -> Vec<(String, Value)> {
        let mut values = Vec::new();
        for entry in entries {
            let ty = Ty::from(entry.ty);
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

    fn statement(&mut self, stmt: &ast::Stmt) {
        match stmt {
            ast::Stmt::Declare(ty, declarators) => {
                for declarator in declarators {
                    self.local(Ty::from(*ty), declarator);
                }
            }
            ast::Stmt::Expr(root) => {
                let typed = self.run(*root);
                let ast::Expr { kind, span } = *self.ast.expr(root.root);
                if !matches!(kind, ast::ExprKind::Assign(..)) && typed.ty != Ty::Poison {
                    let d = Diagnostic::warning("W0502", span, "this statement has no effect");
                    self.diagnostics.push(match typed.ty {
                        Ty::Closure => d.help("to make it part of the material write `Ci = …` or `Ci += …`"),
                        _ => d,
                    });
                }
            }
            ast::Stmt::If { condition, then, other } => {
                let value = self.run(*condition);
                let at = self.ast.expr(condition.root).span;
                let root = self.truth(value, at);
                let condition = Root { first: self.run_start, root };
                let then = self.inner_block(std::slice::from_ref(&**then));
                let other = other.as_deref().map_or_else(Vec::new, |s| self.inner_block(std::slice::from_ref(s)));
                self.block.push(Stmt::If { condition, then, other });
            }
            ast::Stmt::Block(stmts) => {
                let block = self.inner_block(stmts);
                self.block.extend(block);
            }
        }
    }

    fn inner_block(&mut self, stmts: &[ast::Stmt]) -> Vec<Stmt> {
        let outer = std::mem::take(&mut self.block);
        let mark = self.shadowed.len();
        self.depth += 1;
        for stmt in stmts {
            self.statement(stmt);
        }
        self.depth -= 1;
        while self.shadowed.len() > mark {
            match self.shadowed.pop() {
                Some((name, Some(var))) => self.names.insert(name, var),
                Some((name, None)) => self.names.remove(&name),
                None => None,
            };
        }
        std::mem::replace(&mut self.block, outer)
    }

    fn local(&mut self, ty: Ty, declarator: &ast::Declarator) {
        let value = match declarator.init {
            Some(init) => {
                let value = self.run(init);
                let at = self.ast.expr(init.root).span;
                self.initial(value, ty, at, init)
            }
            None => {
                self.run_start = self.body.exprs.len() as u32;
                self.zero(ty, declarator.span)
            }
        };
        if let Some(var) = self.declare(declarator.name, ty, declarator.span, Access::Free) {
            self.assign(var, value);
        }
    }

    /// A new variable, unless this block has one of that name.
    fn declare(&mut self, name: Sym, ty: Ty, span: Span, access: Access) -> Option<VarId> {
        let text = self.ast.name(name);
        if let Some(earlier) = self.names.get(&name).map(|v| &self.variables[v.index()])
            && earlier.depth == self.depth
        {
            let d = Diagnostic::error("E0202", span, format!("`{text}` is declared twice"));
            self.diagnostics.push(d.label(earlier.span, "first here").help("give one of them another name"));
            return None;
        }
        if expr::global(text).is_some() {
            let d = Diagnostic::error("E0202", span, format!("`{text}` is a global of every shader"));
            self.diagnostics.push(d.help("give the variable another name"));
            return None;
        }
        let var = VarId(self.body.vars.len() as u32);
        self.body.vars.push(ty);
        self.variables.push(Variable { access, span, depth: self.depth });
        self.shadowed.push((name, self.names.insert(name, var)));
        Some(var)
    }

    fn assign(&mut self, var: VarId, value: ExprId) {
        self.block.push(Stmt::Assign(var, Root { first: self.run_start, root: value }));
        self.run_start = self.body.exprs.len() as u32;
    }

    /// What a variable without a first value holds: zero, black, the empty string.
    fn zero(&mut self, ty: Ty, span: Span) -> ExprId {
        let kind = if ty == Ty::Closure { ExprKind::Black } else { ExprKind::Const([0; 3]) };
        self.body.push(kind, ty, span)
    }

    /// Checks the expressions of a run in order and returns the last.
    fn run(&mut self, run: ast::Root) -> Typed {
        self.run_start = self.body.exprs.len() as u32;
        let statement_level = self.assignment_chain(run);
        for id in run.first..=run.root.0 {
            let typed = self.expression(ast::ExprId(id), &statement_level);
            self.typed[id as usize] = typed;
        }
        self.typed[run.root.0 as usize]
    }

    /// The assignments of `a = b = c`, which may stand where a statement does.
    fn assignment_chain(&self, run: ast::Root) -> Vec<ast::ExprId> {
        let mut chain = Vec::new();
        if self.depth == 0 {
            // Defaults and metadata are values.
            return chain;
        }
        let mut at = run.root;
        while let ast::ExprKind::Assign(_, _, value) = self.ast.expr(at).kind {
            chain.push(at);
            at = value;
        }
        chain.reverse();
        chain
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
        Typed { id: ExprId(0), ty: Ty::Poison }
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
