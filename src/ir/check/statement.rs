//! Statements, blocks, loops, and ways out of them.
//!
//! The body knows no jumps. What follows a statement that may have left a loop or a function is done only if a variable
//! says that it has not; where one way of an `if` surely leaves, what follows goes into the other way.

use super::super::body::{ExprId, ExprKind, Root, Stmt, VarId};
use super::super::types::Ty;
use super::place::At;
use super::{Access, Binding, Checker, expr};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::{self, Sym};

/// Whether a statement leaves the loop or function it stands in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Flow {
    Goes,
    May,
    Leaves,
}

/// A loop that is open.
#[derive(Clone, Copy)]
pub(super) struct Scope {
    /// 1 until the loop is left.
    live: VarId,
    /// 1 until the round is.
    round: VarId,
}

/// `if` after `if` that are folded into each other, calls included, before variables are used instead.
const MAX_CHAIN: usize = 60;

impl Checker<'_> {
    /// Statements one after the other.
    pub(super) fn list(&mut self, stmts: &[ast::Stmt]) -> Flow {
        let mut flow = Flow::Goes;
        for (i, stmt) in stmts.iter().enumerate() {
            if flow == Flow::Goes {
                let rest = &stmts[i + 1..];
                match self.statement(stmt, rest) {
                    (next, false) => flow = next,
                    (next, true) => return next,
                }
                continue;
            }
            let outer = std::mem::take(&mut self.block);
            let (next, _) = self.statement(stmt, &[]);
            let then = std::mem::replace(&mut self.block, outer);
            if flow == Flow::May {
                let live = self.live();
                self.guarded(live, then);
                flow = if next == Flow::Leaves { Flow::May } else { flow };
            }
        }
        flow
    }

    /// The variable that says whether what follows is reached.
    fn live(&self) -> VarId {
        self.frame.loops.last().map_or(self.frame.live, |scope| scope.round)
    }

    fn guarded(&mut self, live: VarId, then: Vec<Stmt>) {
        if then.is_empty() {
            return;
        }
        let condition = self.read(live);
        self.block.push(Stmt::If { condition, then, other: Vec::new() });
        self.run_start = self.body.exprs.len() as u32;
    }

    fn read(&mut self, var: VarId) -> Root {
        let id = self.body.push(ExprKind::Var(var), Ty::Int, Span::default());
        Root { first: id.0, root: id }
    }

    pub(super) fn set(&mut self, var: VarId, value: i32) {
        self.run_start = self.body.exprs.len() as u32;
        let id = self.int(value, Span::default()).id;
        self.assign(var, id);
    }

    /// One statement; true if `rest` is done with it.
    fn statement(&mut self, stmt: &ast::Stmt, rest: &[ast::Stmt]) -> (Flow, bool) {
        match stmt {
            ast::Stmt::Declare(ty, declarators) => {
                for declarator in declarators {
                    self.local(*ty, declarator);
                }
            }
            ast::Stmt::Expr(root) => self.action(*root),
            ast::Stmt::If { condition, then, other } => {
                return self.conditional(*condition, then, other.as_deref(), rest);
            }
            ast::Stmt::Block(stmts) => {
                let (flow, block) = self.inner_block(stmts);
                self.block.extend(block);
                return (flow, false);
            }
            ast::Stmt::Loop(inner) => return (self.repetition(inner), false),
            ast::Stmt::Break(at) | ast::Stmt::Continue(at) => {
                let Some(scope) = self.frame.loops.last().copied() else {
                    let d = Diagnostic::error("E0211", *at, "there is no loop here to leave");
                    self.diagnostics.push(d);
                    return (Flow::Goes, false);
                };
                if matches!(stmt, ast::Stmt::Break(_)) {
                    self.set(scope.live, 0);
                }
                self.set(scope.round, 0);
                return (Flow::Leaves, false);
            }
            ast::Stmt::Return(value, at) => return (self.leave(*value, *at), false),
        }
        (Flow::Goes, false)
    }

    fn action(&mut self, root: ast::Root) {
        self.discards = true;
        let typed = self.run(root);
        let ast::Expr { kind, span } = *self.ast.expr(root.root);
        let acts = match kind {
            ast::ExprKind::Assign(..) | ast::ExprKind::Step(..) | ast::ExprKind::Comma(..) => true,
            ast::ExprKind::Call(name, ..) => self.needs_statements(name),
            _ => false,
        };
        if !acts && typed.ty != Ty::Poison {
            let d = Diagnostic::warning("W0502", span, "this statement has no effect");
            self.diagnostics.push(match typed.ty {
                Ty::Closure => d.help("to make it part of the material write `Ci = …` or `Ci += …`"),
                _ => d,
            });
        }
    }

    fn conditional(
        &mut self,
        condition: ast::Root,
        then: &ast::Stmt,
        other: Option<&ast::Stmt>,
        rest: &[ast::Stmt],
    ) -> (Flow, bool) {
        let value = self.run(condition);
        let at = self.ast.expr(condition.root).span;
        let root = self.truth(value, at);
        let condition = Root { first: self.run_start, root };
        let (then_flow, mut then) = self.inner_block(within(then));
        let (other_flow, mut other) = match other {
            Some(stmt) => self.inner_block(within(stmt)),
            None => (Flow::Goes, Vec::new()),
        };
        let one_leaves = (then_flow == Flow::Leaves) != (other_flow == Flow::Leaves);
        let other_goes = then_flow == Flow::Goes || other_flow == Flow::Goes;
        let mut flow = match (then_flow, other_flow) {
            (Flow::Goes, Flow::Goes) => Flow::Goes,
            (Flow::Leaves, Flow::Leaves) => Flow::Leaves,
            _ => Flow::May,
        };
        let folds = one_leaves && other_goes && !rest.is_empty() && self.chain < MAX_CHAIN;
        if folds {
            // One way leaves: what follows belongs to the other.
            let goes_on = if then_flow == Flow::Leaves { &mut other } else { &mut then };
            let outer = std::mem::replace(&mut self.block, std::mem::take(goes_on));
            self.chain += 1;
            let after = self.list(rest);
            self.chain -= 1;
            let block = std::mem::replace(&mut self.block, outer);
            if then_flow == Flow::Leaves {
                other = block
            } else {
                then = block
            }
            flow = if after == Flow::Leaves { Flow::Leaves } else { Flow::May };
        }
        self.block.push(Stmt::If { condition, then, other });
        self.run_start = self.body.exprs.len() as u32;
        (flow, folds)
    }

    /// A block of its own names.
    pub(super) fn inner_block(&mut self, stmts: &[ast::Stmt]) -> (Flow, Vec<Stmt>) {
        let outer = std::mem::take(&mut self.block);
        let mark = self.open_scope();
        let flow = self.list(stmts);
        self.close_scope(mark);
        (flow, std::mem::replace(&mut self.block, outer))
    }

    pub(super) fn open_scope(&mut self) -> usize {
        self.depth += 1;
        self.shadowed.len()
    }

    pub(super) fn close_scope(&mut self, mark: usize) {
        self.depth -= 1;
        while self.shadowed.len() > mark {
            match self.shadowed.pop() {
                Some((name, Some(binding))) => self.names.insert(name, binding),
                Some((name, None)) => self.names.remove(&name),
                None => None,
            };
        }
    }

    /// Statements of a piece of the loop, in a list of their own.
    fn piece(&mut self, make: impl FnOnce(&mut Self)) -> Vec<Stmt> {
        let outer = std::mem::take(&mut self.block);
        make(self);
        std::mem::replace(&mut self.block, outer)
    }

    fn repetition(&mut self, inner: &ast::Loop) -> Flow {
        let mark = self.open_scope();
        self.list(&inner.start);
        let exits = Exits::of(&inner.body);
        let scope = Scope { live: self.temporary(Ty::Int), round: self.temporary(Ty::Int) };
        self.set(scope.live, 1);
        self.frame.loops.push(scope);
        let body = self.piece(|c| {
            if exits.any() {
                c.set(scope.round, 1);
            }
            let (_, block) = c.inner_block(within(&inner.body));
            c.block.extend(block);
        });
        let step = self.piece(|c| inner.step.into_iter().for_each(|step| c.action(step)));
        let holds = self.temporary(Ty::Int);
        let test = self.piece(|c| {
            c.run_start = c.body.exprs.len() as u32;
            let truth = match inner.condition {
                Some(condition) => {
                    let value = c.run(condition);
                    c.truth(value, c.ast.expr(condition.root).span)
                }
                None => c.int(1, inner.span).id,
            };
            if c.body.expr(truth).ty != Ty::Poison {
                c.assign(holds, truth);
            }
        });
        self.frame.loops.pop();
        self.close_scope(mark);
        let leaves = exits.breaks || exits.returns;
        // Left in the middle, the loop takes neither its step nor its test.
        let wrapped = |c: &mut Self, stmts: Vec<Stmt>| match leaves {
            true => c.piece(|c| c.guarded(scope.live, stmts)),
            false => stmts,
        };
        let step = wrapped(self, step);
        let test = wrapped(self, test);
        let clear = self.piece(|c| c.set(holds, 0));
        let (before, after) = match inner.body_first {
            true => ([body, step, clear, test].concat(), Vec::new()),
            false => ([clear, test].concat(), [body, step].concat()),
        };
        let condition = self.read(holds);
        self.block.push(Stmt::Loop { before, condition, body: after, span: inner.span });
        self.run_start = self.body.exprs.len() as u32;
        if exits.returns {
            // Out of this loop means out of those around it too.
            Flow::May
        } else {
            Flow::Goes
        }
    }

    fn leave(&mut self, value: Option<ast::Root>, at: Span) -> Flow {
        let wanted = self.frame.ty;
        match (value, self.frame.result) {
            (Some(value), Some(place)) => {
                let typed = self.run_for(value, Some(wanted));
                let span = self.ast.expr(value.root).span;
                self.give(place, wanted, typed, span, value.root);
            }
            (None, Some(_)) => {
                let message = format!("this `return` gives no {}", self.words(wanted));
                self.diagnostics.push(Diagnostic::error("E0203", at, message));
            }
            (Some(value), None) => {
                let typed = self.run(value);
                if typed.ty != Ty::Poison {
                    let d = Diagnostic::error("E0203", at, "there is nothing here that takes a value back");
                    self.diagnostics.push(d);
                }
            }
            (None, None) => {}
        }
        for i in 0..self.frame.loops.len() {
            let scope = self.frame.loops[i];
            self.set(scope.live, 0);
            self.set(scope.round, 0);
        }
        self.set(self.frame.live, 0);
        Flow::Leaves
    }

    fn local(&mut self, name: ast::TypeName, declarator: &ast::Declarator) {
        let given = declarator.init.and_then(|init| self.list_length(init.root));
        let ty = self.array_type(name, declarator.length, given, declarator.span);
        if ty == Ty::Void {
            let d = Diagnostic::error("E0203", declarator.span, "a variable holds something; `void` is for functions");
            self.diagnostics.push(d);
            return;
        }
        let value = declarator.init.map(|init| (init, self.run_for(init, Some(ty))));
        if ty == Ty::Poison {
            // Known by name, so that its uses are not unknown names.
            self.declare(declarator.name, ty, declarator.span, Access::Free);
            return;
        }
        if !ty.is_aggregate() {
            let id = match value {
                Some((init, value)) => self.initial(value, ty, self.ast.expr(init.root).span, init),
                None => {
                    self.run_start = self.body.exprs.len() as u32;
                    self.zero(ty, declarator.span)
                }
            };
            if let Some(place) = self.declare(declarator.name, ty, declarator.span, Access::Free) {
                self.store_at(place, ty, id, declarator.span);
            }
            return;
        }
        let Some(place) = self.declare(declarator.name, ty, declarator.span, Access::Free) else { return };
        match value {
            Some((init, value)) => self.give(place, ty, value, self.ast.expr(init.root).span, init.root),
            None => self.clear(place, ty, declarator.span),
        }
    }

    /// How many values an initialiser gives to `[]`.
    pub(super) fn list_length(&self, id: ast::ExprId) -> Option<u32> {
        match self.ast.expr(id).kind {
            ast::ExprKind::List(args) => Some(args.len.max(1)),
            _ => None,
        }
    }

    /// A new variable, unless this block has one of that name.
    pub(super) fn declare(&mut self, name: Sym, ty: Ty, span: Span, access: Access) -> Option<super::place::Place> {
        let text = self.ast.name(name);
        if let Some(earlier) = self.names.get(&name).map(|b| &self.bindings[*b])
            && earlier.depth == self.depth
        {
            let d = Diagnostic::error("E0202", span, format!("`{text}` is declared twice"));
            self.diagnostics.push(d.label(earlier.span, "first here").help("give one of them another name"));
            return None;
        }
        // Locals may hide globals, as in OSL; parameters of the shader may not.
        if expr::global(text).is_some() && (self.depth == 0 || text == "Ci") {
            let d = Diagnostic::error("E0202", span, format!("`{text}` is a global of every shader"));
            self.diagnostics.push(d.help("give the variable another name"));
            return None;
        }
        let place = match ty {
            Ty::Poison | Ty::Void => super::place::Place { base: VarId::CI, len: 1, at: At::Known(0) },
            ty => self.allocate(ty),
        };
        self.bind(name, Binding { access, span, depth: self.depth, ty, place });
        Some(place)
    }

    /// Lets a name stand for something until its block ends.
    pub(super) fn bind(&mut self, name: Sym, binding: Binding) {
        self.bindings.push(binding);
        self.shadowed.push((name, self.names.insert(name, self.bindings.len() - 1)));
    }

    /// What a variable without a first value holds: zero, black, the empty string.
    pub(super) fn zero(&mut self, ty: Ty, span: Span) -> ExprId {
        let kind = if ty == Ty::Closure { ExprKind::Black } else { ExprKind::Const([0; 3]) };
        self.body.push(kind, ty, span)
    }
}

/// The statements of a block, or the one there is.
fn within(stmt: &ast::Stmt) -> &[ast::Stmt] {
    match stmt {
        ast::Stmt::Block(stmts) => stmts,
        other => std::slice::from_ref(other),
    }
}

/// How a statement may leave what it stands in.
#[derive(Clone, Copy, Default)]
struct Exits {
    breaks: bool,
    continues: bool,
    returns: bool,
}

impl Exits {
    fn of(stmt: &ast::Stmt) -> Exits {
        match stmt {
            ast::Stmt::Break(_) => Exits { breaks: true, ..Exits::default() },
            ast::Stmt::Continue(_) => Exits { continues: true, ..Exits::default() },
            ast::Stmt::Return(..) => Exits { returns: true, ..Exits::default() },
            ast::Stmt::Block(stmts) => stmts.iter().map(Exits::of).fold(Exits::default(), Exits::and),
            ast::Stmt::If { then, other, .. } => {
                let other = other.as_deref().map_or(Exits::default(), Exits::of);
                Exits::of(then).and(other)
            }
            // Its own `break` and `continue` stay within.
            ast::Stmt::Loop(inner) => Exits { returns: Exits::of(&inner.body).returns, ..Exits::default() },
            ast::Stmt::Declare(..) | ast::Stmt::Expr(_) => Exits::default(),
        }
    }

    fn and(self, other: Exits) -> Exits {
        Exits {
            breaks: self.breaks || other.breaks,
            continues: self.continues || other.continues,
            returns: self.returns || other.returns,
        }
    }

    fn any(self) -> bool {
        self.breaks || self.continues || self.returns
    }
}
