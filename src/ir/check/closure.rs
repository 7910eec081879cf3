//! Calls of closures, with their keyword arguments.

use super::super::body::{ExprId, ExprKind, GlobalVar, Op};
use super::super::types::Ty;
use super::call::Given;
use super::{Checker, Typed, suggest};
use crate::diag::Diagnostic;
use crate::lobes::LobeKind;
use crate::lobes::registry::{Build, Form, ParamSpec, ParamTy, SlotSource};
use crate::span::Span;
use crate::syntax::ast;

impl Checker<'_> {
    pub(super) fn closure(&mut self, form: &Form, given: &Given, span: Span) -> Typed {
        let positional = form.positional().count();
        let before = self.diagnostics.len();
        let mut values: Vec<Option<ExprId>> = vec![None; form.params.len()];
        let mut args = given.typed.iter().zip(&given.ids);
        for (value, param) in values.iter_mut().zip(form.params).filter(|(_, p)| !p.keyword) {
            let Some((arg, id)) = args.next() else { return self.poison() };
            *value = Some(self.argument(*arg, *id, param));
        }
        self.keywords(form, given, positional, &mut values);
        let poisoned = given.typed.iter().any(|arg| arg.ty == Ty::Poison);
        if poisoned || self.diagnostics.len() > before {
            return self.poison();
        }
        if !form.note.is_empty() {
            let d = Diagnostic::warning("W0507", span, format!("`{}` is not quite what its name says", form.name));
            self.diagnostics.push(d.help(form.note));
        }
        match form.build {
            Build::Lobe { kind, args } => self.lobe(form, kind, args, &values, span),
            Build::Tinted { kind, args, weight } => {
                let lobe = self.lobe(form, kind, args, &values, span);
                let weight = self.value(form, &values, weight, span);
                self.op(Op::MulC, &[weight, lobe.id], Ty::Closure, span)
            }
            Build::Wrap { kind, args, weight, base } => {
                let lobe = self.lobe(form, kind, args, &values, span);
                let (weight, base) = (self.value(form, &values, weight, span), self.value(form, &values, base, span));
                let top = self.op(Op::MulC, &[weight, lobe.id], Ty::Closure, span);
                self.op(Op::Layer, &[top.id, base], Ty::Closure, span)
            }
            Build::Layer => {
                let (top, base) = (self.value(form, &values, 0, span), self.value(form, &values, 1, span));
                self.op(Op::Layer, &[top, base], Ty::Closure, span)
            }
        }
    }

    fn lobe(
        &mut self,
        form: &Form,
        kind: LobeKind,
        sources: &[SlotSource],
        values: &[Option<ExprId>],
        span: Span,
    ) -> Typed {
        let ids = self.sources(form, sources, kind.spec().params, values, span);
        let args = self.store(ids);
        self.push(ExprKind::Lobe(kind, args), Ty::Closure, span)
    }

    /// Reads `"name", value` pairs.
    fn keywords(&mut self, form: &Form, given: &Given, from: usize, values: &mut [Option<ExprId>]) {
        let mut at = from;
        while at < given.ids.len() {
            let (key, at_key) = (given.ids[at], self.span_of(given.ids[at]));
            let ast::ExprKind::String(sym) = self.ast.expr(key).kind else {
                if given.typed[at].ty != Ty::Poison {
                    let d = Diagnostic::error("E0302", at_key, "expected the name of a keyword argument in quotes");
                    self.diagnostics.push(d.help(keyword_list(form)));
                }
                return;
            };
            let name = self.ast.name(sym);
            if name == "label" && given.typed.get(at + 1).is_some_and(|value| value.ty == Ty::String) {
                let d = Diagnostic::warning("W0508", at_key, "the label has no effect");
                self.diagnostics.push(d.help("lobes are told apart by where they stand; to name a value use `debug`"));
                at += 2;
                continue;
            }
            let Some(index) = form.params.iter().position(|p| p.keyword && p.name == name) else {
                let d = Diagnostic::error("E0302", at_key, format!("`{}` has no keyword argument `{name}`", form.name));
                let like = suggest(name, form.keywords().map(|p| p.name));
                let help = like.map_or_else(|| keyword_list(form), |like| format!("did you mean `\"{like}\"`?"));
                self.diagnostics.push(d.help(help));
                at += 2;
                continue;
            };
            let Some(value) = given.ids.get(at + 1).copied() else {
                let message = format!("the keyword argument `{name}` has no value");
                let help = format!("write `\"{name}\", {}`", form.params[index].ty.name());
                self.diagnostics.push(Diagnostic::error("E0304", at_key, message).help(help));
                return;
            };
            if values[index].is_some() {
                let message = format!("the keyword argument `{name}` is given twice");
                self.diagnostics.push(Diagnostic::error("E0304", at_key, message));
            }
            let typed = given.typed[at + 1];
            let param = &form.params[index];
            if typed.ty.distance(Ty::from(param.ty)).is_none() {
                let message = format!("`{name}` is {}, not {}", param.ty.name(), typed.ty.name());
                self.diagnostics.push(Diagnostic::error("E0203", self.span_of(value), message));
            } else {
                values[index] = Some(self.argument(typed, value, param));
            }
            at += 2;
        }
    }

    /// A value for a closure parameter, in the form lobes store: floats, triples, closures.
    fn argument(&mut self, arg: Typed, id: ast::ExprId, param: &ParamSpec) -> ExprId {
        let span = self.span_of(id);
        match param.ty {
            _ if arg.ty == Ty::Poison => arg.id,
            ParamTy::Int => self.op(Op::IntToFloat, &[arg.id], Ty::Float, span).id,
            ParamTy::String => {
                if let ast::ExprKind::String(sym) = self.ast.expr(id).kind
                    && !param.options.is_empty()
                    && !param.options.contains(&self.ast.name(sym))
                {
                    let d = super::super::passes::needs::unknown_option(self.ast.name(sym), param.options, span);
                    return self.error(d).id;
                }
                self.push(ExprKind::OptionIndex(param.options, arg.id), Ty::Float, span).id
            }
            ty => self.convert(arg, Ty::from(ty), span),
        }
    }

    /// One expression per lobe parameter.
    fn sources(
        &mut self,
        form: &Form,
        sources: &[SlotSource],
        params: &'static [ParamSpec],
        values: &[Option<ExprId>],
        span: Span,
    ) -> Vec<ExprId> {
        if sources.is_empty() {
            return (0..params.len()).map(|i| self.value(form, values, i, span)).collect();
        }
        let mut ids = Vec::new();
        for (source, param) in sources.iter().zip(params) {
            ids.push(match source {
                SlotSource::Param(i) => self.value(form, values, *i, span),
                SlotSource::Const(slots) => self.slots(slots, param.ty, span),
                SlotSource::Normal => self.push(ExprKind::Global(GlobalVar::N), Ty::Normal, span).id,
            });
        }
        ids
    }

    /// What a form's parameter was given, or its default.
    fn value(&mut self, form: &Form, values: &[Option<ExprId>], index: usize, span: Span) -> ExprId {
        match values.get(index).copied().flatten() {
            Some(id) => id,
            None => {
                let param = &form.params[index];
                self.slots(param.default, param.ty, span)
            }
        }
    }

    fn slots(&mut self, slots: &[f32], ty: ParamTy, span: Span) -> ExprId {
        let ty = if ty.slots() == 3 { Ty::from(ty) } else { Ty::Float };
        let cell = |i: usize| slots.get(i).or(slots.last()).map_or(0, |x| x.to_bits());
        self.push(ExprKind::Const([cell(0), cell(1), cell(2)]), ty, span).id
    }
}

fn keyword_list(form: &Form) -> String {
    let names: Vec<String> = form.keywords().map(|p| format!("`\"{}\"`", p.name)).collect();
    match names.len() {
        0 => format!("`{}` takes no keyword arguments", form.name),
        _ => format!("`{}` takes {}", form.name, names.join(", ")),
    }
}
