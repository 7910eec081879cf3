//! Checking of calls: functions of the script, of the table, and closures.

use super::super::body::{ExprId, ExprKind, GlobalVar, Op};
use super::super::builtins::{self, BUILTINS, Eval};
use super::super::types::Ty;
use super::{Checker, Typed, suggest};
use crate::diag::Diagnostic;
use crate::lobes::registry::Form;
use crate::lobes::{self, families};
use crate::span::Span;
use crate::syntax::ast::{self, Sym};
use std::sync::OnceLock;

/// Every way to call a built-in closure.
fn built_in() -> &'static [Form] {
    static FORMS: OnceLock<Vec<Form>> = OnceLock::new();
    FORMS.get_or_init(|| lobes::forms().collect())
}

/// The arguments of one call.
pub(super) struct Given {
    pub ids: Vec<ast::ExprId>,
    pub typed: Vec<Typed>,
}

impl<'a> Checker<'a> {
    pub(super) fn is_function(&self, name: &str) -> bool {
        !builtins::overloads(name).is_empty() || self.forms().any(|f| f.name == name)
    }

    /// Every way to call a closure.
    fn forms(&self) -> impl Iterator<Item = &'a Form> + use<'a> {
        // The host's first: what it takes over looks the same.
        self.hosts.iter().chain(built_in())
    }

    pub(super) fn call(&mut self, name: Sym, at: Span, args: ast::Args, span: Span, wanted: Option<Ty>) -> Typed {
        let ids = self.ast.args(args).to_vec();
        let typed = ids.iter().map(|id| self.of(*id)).collect();
        let given = Given { ids, typed };
        let text = self.ast.name(name);
        let own = self.function(name, &given, wanted);
        if let (None, Some(number)) = (&own, self.struct_names.get(&name)) {
            return self.make_struct(*number, &given, span);
        }
        if let Some((cost, index, types)) = own {
            // The script's own function goes before one of the table unless that fits better.
            if self.builtin_cost(text, &given).is_none_or(|other| cost <= other * 4 + 3) {
                return self.inline(index, &types, &given, span);
            }
        }
        if let ("faceforward", [a, b]) = (text, &given.typed[..])
            && a.ty.is_spatial()
            && b.ty.is_spatial()
        {
            let (a, b) = (a.id, b.id);
            let ng = self.push(ExprKind::Global(GlobalVar::Ng), Ty::Vector, span);
            let id = self.builtin_by_name(text, &[a, b, ng.id], Ty::Vector, span);
            return Typed { id, ty: Ty::Vector, place: None, temp: None };
        }
        if let Some(done) = self.task(text, &given, span, wanted) {
            return done;
        }
        let candidates: Vec<&'a Form> = self.forms().filter(|f| f.name == text).collect();
        if let Some((_, found)) = self.builtin(text, &given, span, wanted) {
            return found;
        }
        let best =
            candidates.iter().filter_map(|f| Some((self.form_cost(f, &given)?, *f))).min_by_key(|(cost, _)| *cost);
        if let Some((_, form)) = best {
            return self.closure(form, &given, span);
        }
        self.no_match(name, at, &given, &candidates, span)
    }

    /// How well the table fits a call.
    fn builtin_cost(&self, name: &str, given: &Given) -> Option<u32> {
        self.overload(name, given).map(|(cost, ..)| cost)
    }

    fn overload(&self, name: &str, given: &Given) -> Option<(u32, u16, Ty, Vec<Ty>)> {
        let mut best: Option<(u32, u16, Ty, Vec<Ty>)> = None;
        for index in builtins::overloads(name) {
            for (result, params) in BUILTINS[*index as usize].instances() {
                let fits = params.len() == given.typed.len();
                let costs = params.iter().enumerate().map(|(i, param)| self.distance(given, i, *param));
                let cost = fits.then(|| costs.sum::<Option<u32>>()).flatten();
                if cost.is_some_and(|cost| best.as_ref().is_none_or(|b| cost < b.0)) {
                    best = Some((cost?, *index, result, params));
                }
            }
        }
        best
    }

    /// A function of the table on values that need no conversion.
    pub(super) fn builtin_by_name(&mut self, name: &str, args: &[ExprId], ty: Ty, span: Span) -> ExprId {
        let fits = |index: &&u16| {
            let types: Vec<Ty> = args.iter().map(|id| self.body.expr(*id).ty).collect();
            BUILTINS[**index as usize].instances().any(|(result, params)| result == ty && alike(&params, &types))
        };
        match builtins::overloads(name).iter().find(fits) {
            Some(index) => {
                let args = self.store(args.iter().copied());
                self.push(ExprKind::Call(*index, args), ty, span).id
            }
            None => self.zero(ty, span),
        }
    }

    /// A call of the overload that fits best.
    pub(super) fn builtin(
        &mut self,
        name: &str,
        given: &Given,
        span: Span,
        wanted: Option<Ty>,
    ) -> Option<(u32, Typed)> {
        let (cost, index, ty, params) = self.overload(name, given)?;
        if given.typed.iter().any(|arg| arg.ty == Ty::Poison) {
            return Some((cost, self.poison()));
        }
        let builtin = &BUILTINS[index as usize];
        // A noise is as many numbers as its place asks for.
        let ty = wanted.filter(|wanted| builtin.result_follows_use() && wanted.is_triple()).unwrap_or(ty);
        if let Some(warning) = builtins::warning(name, self.derivatives) {
            self.diagnostics.push(Diagnostic::warning("W0506", span, warning));
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
                    return Some((cost, self.error(d)));
                }
                *value = self.push(ExprKind::OptionIndex(options, *value), Ty::Float, span).id;
            }
        }
        let made = match builtin.eval {
            Eval::Global(g) => self.push(ExprKind::Global(g), ty, span),
            Eval::MixClosures => self.mix(converted[0], converted[1], converted[2], span),
            _ => {
                let args = self.store(converted);
                self.push(ExprKind::Call(index, args), ty, span)
            }
        };
        Some((cost, made))
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
        form.positional().enumerate().map(|(i, p)| self.distance(given, i, Ty::from(p.ty))).sum()
    }

    /// How far an argument is from a type. The literal 0 is a closure too.
    pub(super) fn distance(&self, given: &Given, index: usize, to: Ty) -> Option<u32> {
        let zero = || matches!(self.ast.expr(given.ids[index]).kind, ast::ExprKind::Int(0));
        let black = || (to == Ty::Closure && zero()).then_some(2);
        given.typed.get(index)?.ty.distance(to).or_else(black)
    }

    /// Explains why a call fits nothing.
    fn no_match(&mut self, sym: Sym, at: Span, given: &Given, forms: &[&Form], span: Span) -> Typed {
        let name = self.ast.name(sym);
        let overloads = builtins::overloads(name);
        let own: Vec<u32> = self.functions.get(&sym).cloned().unwrap_or_default();
        if given.typed.iter().any(|arg| arg.ty == Ty::Poison) && !(overloads.is_empty() && forms.is_empty()) {
            return self.poison();
        }
        if overloads.is_empty() && forms.is_empty() && own.is_empty() && !super::task::is_task(name) {
            return self.unknown_function(name, at);
        }
        let found: Vec<String> = given.typed.iter().map(|arg| self.words(arg.ty)).collect();
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
        let d =
            own.iter().take(6).fold(d, |d, index| d.label(self.ast.functions[*index as usize].span, "declared here"));
        self.error(signatures.iter().fold(d, |d, s| d.help(format!("there is {s}"))))
    }

    /// The first argument that does not fit the only form there is.
    fn misfit(&self, form: &Form, given: &Given) -> Option<Diagnostic> {
        for (i, param) in form.positional().enumerate() {
            let (arg, id) = (given.typed.get(i)?, given.ids[i]);
            if self.distance(given, i, Ty::from(param.ty)).is_none() {
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
        if let Some((_, why)) = builtins::UNSUPPORTED.iter().find(|(n, _)| *n == name) {
            return self.error(Diagnostic::error("E0109", at, format!("`{name}()` is not supported: {why}")));
        }
        if let Some(feature) = families::left_out(name) {
            let d = Diagnostic::error("E0305", at, format!("the closure `{name}` was left out of this build"));
            return self.error(d.help(format!("the cargo feature `{feature}` of overcoat brings it")));
        }
        let d = Diagnostic::error("E0206", at, format!("unknown function `{name}`"));
        let own = self.functions.keys().map(|sym| self.ast.name(*sym));
        let names = self.forms().map(|f| f.name).chain(BUILTINS.iter().map(|b| b.name)).chain(own);
        let like = suggest(name, names).map(|like| format!("did you mean `{like}`?"));
        self.error(like.into_iter().fold(d, Diagnostic::help))
    }
}

/// Whether values of the one types stand for the others as they are.
fn alike(params: &[Ty], types: &[Ty]) -> bool {
    let fits = |(a, b): (&Ty, &Ty)| b.distance(*a).is_some_and(|d| d <= 1);
    params.len() == types.len() && params.iter().zip(types).all(fits)
}
