//! What a material makes a renderer provide: the globals its live code reads, and how.

use super::super::body::{Body, ExprId, ExprKind, GlobalVar, Root, Stmt};
use super::super::check::suggest;
use super::super::host::Answers;
use super::each_used;
use crate::diag::Diagnostic;
use crate::lobes::registry::ParamTy;
use crate::span::Span;
use std::collections::BTreeSet;

/// What live code needs.
#[derive(Debug, Default)]
pub struct Needs {
    /// Every global that is read.
    pub globals: BTreeSet<GlobalVar>,
    /// Whether a global is read for more than the frame of a lobe.
    pub varying: bool,
    /// What the host answers.
    pub answers: Answers,
    /// Whether live code asks it anything.
    pub asks: bool,
    /// Which expressions live code uses, by index.
    pub used: Vec<bool>,
    /// Options that turned out to be unknown.
    pub errors: Vec<Diagnostic>,
}

/// Looks through live code.
pub fn needs(body: &Body, answers: Answers) -> Needs {
    let mut needs = Needs { used: vec![false; body.exprs.len()], answers, ..Needs::default() };
    // Uses of each expression other than as the normal or tangent of a lobe.
    let mut valued = vec![false; body.exprs.len()];
    let mut scratch = Vec::new();
    look(body, &body.stmts, &mut needs, &mut valued, &mut scratch);
    // What a host answers may differ from point to point.
    needs.varying |= needs.asks;
    needs
}

fn look(body: &Body, stmts: &[Stmt], needs: &mut Needs, valued: &mut [bool], scratch: &mut Vec<bool>) {
    for stmt in stmts {
        match stmt {
            Stmt::Assign(_, root) => run(body, *root, needs, valued, scratch),
            Stmt::Store { .. } => {}
            Stmt::Do(deed) => needs.asks |= deed.task.asks(needs.answers),
            Stmt::Loop { before, condition, body: inner, .. } => {
                look(body, before, needs, valued, scratch);
                run(body, *condition, needs, valued, scratch);
                look(body, inner, needs, valued, scratch);
            }
            Stmt::If { condition, then, other } => {
                run(body, *condition, needs, valued, scratch);
                look(body, then, needs, valued, scratch);
                look(body, other, needs, valued, scratch);
            }
        }
    }
}

fn run(body: &Body, root: Root, needs: &mut Needs, valued: &mut [bool], scratch: &mut Vec<bool>) {
    valued[root.root.index()] = true;
    each_used(body, root, scratch, |id, kind| {
        needs.used[id.index()] = true;
        match kind {
            ExprKind::Global(g) => {
                needs.globals.insert(g);
                needs.varying |= valued[id.index()];
            }
            ExprKind::Lobe(lobe, args) => {
                for (arg, param) in body.args(args).iter().zip(lobe.spec().params) {
                    let direction = matches!(param.ty, ParamTy::Normal | ParamTy::Vector);
                    valued[arg.index()] |= !(direction && is_frame(body, *arg));
                }
            }
            ExprKind::OptionIndex(options, name) => {
                if let ExprKind::Const(cells) = body.expr(name).kind {
                    let name = body.strings.get(cells[0] as usize).map_or("", String::as_str);
                    needs.errors.push(unknown_option(name, options, body.expr(id).span));
                }
                valued[name.index()] = true;
            }
            _ => body.operands(id, |operand| valued[operand.index()] = true),
        }
    });
}

fn is_frame(body: &Body, id: ExprId) -> bool {
    matches!(body.expr(id).kind, ExprKind::Global(g) if g.is_frame())
}

/// A string that is none of a parameter's options.
pub fn unknown_option(name: &str, options: &[&str], span: Span) -> Diagnostic {
    let d = Diagnostic::error("E0303", span, format!("there is no option `{name}` here"));
    match suggest(name, options.iter().copied()) {
        Some(like) => d.help(format!("did you mean `\"{like}\"`?")),
        None => d.help(format!("the options are `\"{}\"`", options.join("\"`, `\""))),
    }
}
