//! Checking of calls: functions of the table, and closures with their keyword arguments.

use super::super::body::{ExprId, ExprKind, Op};
use super::super::builtins::{self, BUILTINS, Eval};
use super::super::types::Ty;
use super::{Checker, Typed, suggest};
use crate::diag::Diagnostic;
use crate::lobes;
use crate::lobes::registry::{Build, Form, ParamSpec, ParamTy, SlotSource};
use crate::span::Span;
use crate::syntax::ast::{self, Sym};
use std::sync::OnceLock;

/// Every way to call a built-in closure.
fn built_in() -> &'static [Form] {
    static FORMS: OnceLock<Vec<Form>> = OnceLock::new();
    FORMS.get_or_init(|| lobes::forms().collect())
}

/// The arguments of one call.
struct Given {
    ids: Vec<ast::ExprId>,
    typed: Vec<Typed>,
}

impl<'a> Checker<'a> {
    pub(super) fn is_function(&self, name: &str) -> bool {
        !builtins::overloads(name).is_empty() || self.forms().any(|f| f.name == name)
    }

    /// Every way to call a closure.
    fn forms(&self) -> impl Iterator<Item = &'a Form> + use<'a> {
        built_in().iter().chain(self.hosts)
    }

    pub(super) fn call(&mut self, name: Sym, at: Span, args: ast::Args, span: Span) -> Typed {
        let ids = self.ast.args(args).to_vec();
        let typed = ids.iter().map(|id| self.of(*id)).collect();
        let given = Given { ids, typed };
        let text = self.ast.name(name);
        let candidates: Vec<&'a Form> = self.forms().filter(|f| f.name == text).collect();
        if let Some(found) = self.builtin(text, &given, span) {
            return found;
        }
        let best =
            candidates.iter().filter_map(|f| Some((self.form_cost(f, &given)?, *f))).min_by_key(|(cost, _)| *cost);
        if let Some((_, form)) = best {
            return self.closure(form, &given, span);
        }
        self.no_match(text, at, &given, &candidates, span)
    }

    /// A call of the overload that fits best.
    fn builtin(&mut self, name: &str, given: &Given, span: Span) -> Option<Typed> {
        let mut best: Option<(u32, u16, Ty, Vec<Ty>)> = None;
        for index in builtins::overloads(name) {
            for (result, params) in BUILTINS[*index as usize].instances() {
                let fits = params.len() == given.typed.len();
                let costs = given.typed.iter().zip(&params).map(|(arg, param)| arg.ty.distance(*param));
                let cost = costs.sum::<Option<u32>>().filter(|_| fits);
                if cost.is_some_and(|cost| best.as_ref().is_none_or(|b| cost < b.0)) {
                    best = Some((cost?, *index, result, params));
                }
            }
        }
        let (_, index, ty, params) = best?;
        if given.typed.iter().any(|arg| arg.ty == Ty::Poison) {
            return Some(self.poison());
        }
        let mut converted: Vec<ExprId> =
            given.typed.iter().zip(params).map(|(arg, param)| self.convert(*arg, param, span)).collect();
        for (at, value) in converted.iter_mut().enumerate() {
            if let Some(options) = BUILTINS[index as usize].options(at) {
                let span = self.span_of(given.ids[at]);
                if let ast::ExprKind::String(sym) = self.ast.expr(given.ids[at]).kind
                    && !options.contains(&self.ast.name(sym))
                {
                    let d = super::super::passes::needs::unknown_option(self.ast.name(sym), options, span);
                    return Some(self.error(d));
                }
                *value = self.push(ExprKind::OptionIndex(options, *value), Ty::Float, span).id;
            }
        }
        Some(match BUILTINS[index as usize].eval {
            Eval::Global(g) => self.push(ExprKind::Global(g), ty, span),
            Eval::MixClosures => self.mix(converted[0], converted[1], converted[2], span),
            _ => {
                let args = self.store(converted);
                self.push(ExprKind::Call(index, args), ty, span)
            }
        })
    }

    fn mix(&mut self, a: ExprId, b: ExprId, x: ExprId, span: Span) -> Typed {
        let one = self.push(ExprKind::Const([1.0f32.to_bits(); 3]), Ty::Color, span);
        let rest = self.op(Op::SubF, &[one.id, x], Ty::Color, span);
        let left = self.op(Op::MulC, &[rest.id, a], Ty::Closure, span);
        let right = self.op(Op::MulC, &[x, b], Ty::Closure, span);
        self.op(Op::AddC, &[left.id, right.id], Ty::Closure, span)
    }

    /// How many conversions a form needs, or `None` if it does not fit. Keyword arguments are looked at later.
    fn form_cost(&self, form: &Form, given: &Given) -> Option<u32> {
        let positional = form.positional().count();
        let rest = given.typed.get(positional..)?;
        if rest.first().is_some_and(|arg| arg.ty != Ty::String && arg.ty != Ty::Poison) {
            return None;
        }
        form.positional().zip(&given.typed).map(|(p, arg)| arg.ty.distance(Ty::from(p.ty))).sum()
    }

    fn closure(&mut self, form: &Form, given: &Given, span: Span) -> Typed {
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
        match form.build {
            Build::Lobe { kind, args } => {
                let params = kind.spec().params;
                let ids = self.sources(form, args, params, &values, span);
                let args = self.store(ids);
                self.push(ExprKind::Lobe(kind, args), Ty::Closure, span)
            }
            Build::Wrap { kind, args, weight, base } => {
                let params = kind.spec().params;
                let ids = self.sources(form, args, params, &values, span);
                let args = self.store(ids);
                let lobe = self.push(ExprKind::Lobe(kind, args), Ty::Closure, span);
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

    /// Explains why a call fits nothing.
    fn no_match(&mut self, name: &str, at: Span, given: &Given, forms: &[&Form], span: Span) -> Typed {
        let overloads = builtins::overloads(name);
        if overloads.is_empty() && forms.is_empty() {
            return self.unknown_function(name, at);
        }
        let found: Vec<&str> = given.typed.iter().map(|arg| arg.ty.name()).collect();
        if let ([form], true) = (forms, overloads.is_empty())
            && let Some(d) = self.misfit(form, given)
        {
            return self.error(d.help(format!("declared as `{}`", form.signature())));
        }
        let message = format!("`{name}` does not take ({})", found.join(", "));
        let signatures: Vec<String> = forms
            .iter()
            .map(|f| f.signature())
            .chain(overloads.iter().map(|i| BUILTINS[*i as usize].signature()))
            .map(|s| format!("`{s}`"))
            .collect();
        let d = Diagnostic::error("E0205", span, message);
        self.error(signatures.iter().fold(d, |d, s| d.help(format!("there is {s}"))))
    }

    /// The first argument that does not fit the only form there is.
    fn misfit(&self, form: &Form, given: &Given) -> Option<Diagnostic> {
        for (i, param) in form.positional().enumerate() {
            let (arg, id) = (given.typed.get(i)?, given.ids[i]);
            if arg.ty.distance(Ty::from(param.ty)).is_none() {
                let message =
                    format!("`{}` of `{}` is {}, not {}", param.name, form.name, param.ty.name(), arg.ty.name());
                let d = Diagnostic::error("E0205", self.span_of(id), message);
                return Some(d.note(format!("expected {}, found {}", param.ty.name(), arg.ty.name())));
            }
        }
        let extra = *given.ids.get(form.positional().count())?;
        Some(Diagnostic::error("E0205", self.span_of(extra), format!("too many arguments for `{}`", form.name)))
    }

    fn unknown_function(&mut self, name: &str, at: Span) -> Typed {
        if builtins::UNSUPPORTED.contains(&name) {
            return self.error(Diagnostic::error("E0109", at, format!("`{name}()` is not supported")));
        }
        let d = Diagnostic::error("E0206", at, format!("unknown function `{name}`"));
        let names = self.forms().map(|f| f.name).chain(BUILTINS.iter().map(|b| b.name));
        let like = suggest(name, names).map(|like| format!("did you mean `{like}`?"));
        self.error(like.into_iter().fold(d, Diagnostic::help))
    }
}

fn keyword_list(form: &Form) -> String {
    let names: Vec<String> = form.keywords().map(|p| format!("`\"{}\"`", p.name)).collect();
    match names.len() {
        0 => format!("`{}` takes no keyword arguments", form.name),
        _ => format!("`{}` takes {}", form.name, names.join(", ")),
    }
}
