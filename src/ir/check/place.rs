//! Structs, arrays and matrices: where their parts lie.
//!
//! A value of several parts is held as one variable for each part that is simple. An array of structs is held field by
//! field, so that whatever an index picks lies in one run of variables of one type.

use super::super::body::{ExprId, ExprKind, Op, Root, Stmt, VarId};
use super::super::types::Ty;
use super::{Checker, Typed};
use crate::diag::Diagnostic;
use crate::span::Span;
use crate::syntax::ast::{self, Length, Sym, TypeName};

/// Which of the values that share a run of variables is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum At {
    Known(u32),
    /// An int of the run at hand.
    Expr(ExprId),
    /// An int that stays what it is.
    Var(VarId),
}

/// Where a value lies: `len` values of its type lie interleaved from `base` on, and it is one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub base: VarId,
    pub len: u32,
    pub at: At,
}

/// A struct of the script.
pub(super) struct Layout {
    pub name: Sym,
    pub fields: Vec<(Sym, Ty)>,
}

/// The most simple parts a variable may have.
const MAX_PARTS: usize = 1 << 16;

impl Checker<'_> {
    /// Resolves the structs of the script; those that are wrong are reported where they are used.
    pub(super) fn structs(&mut self) {
        let ast = self.ast;
        for declared in &ast.structs {
            let mut fields = Vec::new();
            for (ty, declarator) in &declared.fields {
                let ty = self.array_type(*ty, declarator.length, None, declarator.span);
                fields.push((declarator.name, ty));
            }
            if let Some(earlier) = self.struct_names.get(&declared.name) {
                // The same header twice is fine.
                if self.layouts[usize::from(*earlier)].fields != fields {
                    let message = format!("the struct `{}` is declared twice", ast.name(declared.name));
                    self.diagnostics.push(Diagnostic::error("E0202", declared.span, message));
                }
                continue;
            }
            self.struct_names.insert(declared.name, self.layouts.len() as u16);
            self.layouts.push(Layout { name: declared.name, fields });
        }
    }

    /// The type of a name.
    pub(super) fn named_type(&mut self, name: TypeName, span: Span) -> Ty {
        match (Ty::simple(name), name) {
            (Some(ty), _) => ty,
            (None, TypeName::Named(sym)) => match self.struct_names.get(&sym) {
                Some(number) => Ty::Struct(*number),
                None => {
                    let d = Diagnostic::error("E0201", span, format!("unknown type `{}`", self.ast.name(sym)));
                    self.diagnostics.push(d.help("declare it: `struct NAME { … };`"));
                    Ty::Poison
                }
            },
            (None, _) => Ty::Poison,
        }
    }

    /// The type of a declared name with what stands in its brackets. `given`: how many values `[]` is given.
    pub(super) fn array_type(&mut self, name: TypeName, length: Length, given: Option<u32>, span: Span) -> Ty {
        let element = self.named_type(name, span);
        let length = match length {
            Length::None => return element,
            Length::Open => given,
            Length::Given(root) => match self.constant_int(root) {
                Some(n) if n > 0 => Some(n as u32),
                _ => {
                    let at = self.ast.expr(root.root).span;
                    let d = Diagnostic::error("E0208", at, "the length of an array is a constant above zero");
                    self.diagnostics.push(d);
                    return Ty::Poison;
                }
            },
        };
        if element == Ty::Poison {
            return element;
        }
        let parts = self.parts(element).saturating_mul(length.unwrap_or(0) as usize);
        if parts > MAX_PARTS {
            let d = Diagnostic::error("E0212", span, format!("this array has more than {MAX_PARTS} parts"));
            self.diagnostics.push(d);
            return Ty::Poison;
        }
        self.array_of(element, length)
    }

    /// The type of arrays of `length`, or of any length.
    pub(super) fn array_of(&mut self, element: Ty, length: Option<u32>) -> Ty {
        let found = self.arrays.iter().position(|a| *a == (element, length));
        Ty::Array(found.unwrap_or_else(|| {
            self.arrays.push((element, length));
            self.arrays.len() - 1
        }) as u16)
    }

    /// The type of the elements and how many there are: of arrays, and of matrices as four rows.
    pub(super) fn elements(&mut self, ty: Ty) -> Option<(Ty, u32)> {
        match ty {
            Ty::Array(number) => {
                let (element, length) = self.arrays[usize::from(number)];
                Some((element, length.unwrap_or(0)))
            }
            Ty::Matrix => Some((self.array_of(Ty::Float, Some(4)), 4)),
            _ => None,
        }
    }

    /// How many variables hold a value.
    pub(super) fn parts(&self, ty: Ty) -> usize {
        match ty {
            Ty::Matrix => 16,
            Ty::Void => 0,
            Ty::Array(number) => {
                let (element, length) = self.arrays[usize::from(number)];
                self.parts(element).saturating_mul(length.unwrap_or(0) as usize)
            }
            Ty::Struct(number) => {
                let fields = &self.layouts[usize::from(number)].fields;
                fields.iter().fold(0usize, |n, (_, ty)| n.saturating_add(self.parts(*ty)))
            }
            _ => 1,
        }
    }

    fn lay_out(&mut self, ty: Ty, count: usize) {
        match ty {
            Ty::Matrix => self.lay_out(Ty::Float, 16 * count),
            Ty::Array(number) => {
                let (element, length) = self.arrays[usize::from(number)];
                self.lay_out(element, count * length.unwrap_or(0) as usize);
            }
            Ty::Struct(number) => {
                for i in 0..self.layouts[usize::from(number)].fields.len() {
                    let ty = self.layouts[usize::from(number)].fields[i].1;
                    self.lay_out(ty, count);
                }
            }
            simple => self.body.vars.extend(std::iter::repeat_n(simple, count)),
        }
    }

    /// New variables for one value.
    pub(super) fn allocate(&mut self, ty: Ty) -> Place {
        let base = VarId(self.body.vars.len() as u32);
        if self.parts(ty) <= MAX_PARTS {
            self.lay_out(ty, 1);
        }
        Place { base, len: 1, at: At::Known(0) }
    }

    /// A new variable for a simple value.
    pub(super) fn temporary(&mut self, ty: Ty) -> VarId {
        self.body.vars.push(ty);
        VarId(self.body.vars.len() as u32 - 1)
    }

    /// A field of a struct.
    pub(super) fn field_of(&self, number: u16, place: Place, index: usize) -> (Place, Ty) {
        let fields = &self.layouts[usize::from(number)].fields;
        let before: usize = fields[..index].iter().map(|(_, ty)| self.parts(*ty)).sum();
        let base = VarId(place.base.0 + before as u32 * place.len);
        (Place { base, ..place }, fields[index].1)
    }

    /// An element of what lies at `place`, of which there are `count`.
    pub(super) fn element_of(&mut self, place: Place, count: u32, index: At, span: Span) -> Place {
        let len = place.len * count;
        let at = match (place.at, index) {
            (At::Known(a), At::Known(i)) => At::Known(a * count + i),
            (At::Known(0), index) if place.len == 1 => index,
            (outer, inner) => {
                let (outer, inner) = (self.index_value(outer, span), self.index_value(inner, span));
                let count_value = self.int(count as i32, span);
                let last = self.int(count as i32 - 1, span);
                let zero = self.int(0, span);
                // Each index is limited to its own range.
                let inner = self.builtin_by_name("clamp", &[inner, zero.id, last.id], Ty::Int, span);
                let start = self.op(Op::MulI, &[outer, count_value.id], Ty::Int, span);
                At::Expr(self.op(Op::AddI, &[start.id, inner], Ty::Int, span).id)
            }
        };
        Place { base: place.base, len, at }
    }

    pub(super) fn index_value(&mut self, at: At, span: Span) -> ExprId {
        match at {
            At::Known(i) => self.int(i as i32, span).id,
            At::Expr(id) => id,
            At::Var(var) => self.push(ExprKind::Var(var), Ty::Int, span).id,
        }
    }

    /// The value at a place; of one with parts only the place.
    pub(super) fn load(&mut self, place: Place, ty: Ty, span: Span) -> Typed {
        if ty.is_aggregate() || ty == Ty::Void {
            return Typed { id: ExprId(0), ty, place: Some(place), temp: None };
        }
        let kind = match place.at {
            At::Known(i) => ExprKind::Var(VarId(place.base.0 + i)),
            at => ExprKind::Element(place.base, place.len, self.index_value(at, span)),
        };
        Typed { place: Some(place), ..self.push(kind, ty, span) }
    }

    /// The simple parts of a value, in order. Emits statements where an index is not known.
    pub(super) fn leaves(&mut self, place: Place, ty: Ty, span: Span, out: &mut Vec<(Place, Ty)>) {
        match ty {
            Ty::Struct(number) => {
                for i in 0..self.layouts[usize::from(number)].fields.len() {
                    let (field, ty) = self.field_of(number, place, i);
                    self.leaves(field, ty, span, out);
                }
            }
            Ty::Matrix | Ty::Array(_) => {
                let Some((element, count)) = self.elements(ty) else { return };
                for i in 0..count {
                    let inner = self.element_of(place, count, At::Known(i), span);
                    let inner = self.pinned(inner);
                    self.leaves(inner, element, span, out);
                }
            }
            Ty::Void | Ty::Poison => {}
            simple => out.push((place, simple)),
        }
    }

    /// A place whose index stays what it is from statement to statement.
    pub(super) fn pinned(&mut self, place: Place) -> Place {
        let At::Expr(id) = place.at else { return place };
        let var = self.temporary(Ty::Int);
        self.keep(var, id);
        Place { at: At::Var(var), ..place }
    }

    /// Stores a simple value of the run at hand.
    pub(super) fn store_at(&mut self, place: Place, ty: Ty, value: ExprId, span: Span) {
        match self.pinned_known(place) {
            Ok(var) => self.assign(var, value),
            Err((at, len)) => {
                let temp = self.temporary(ty);
                self.assign(temp, value);
                let index = match at {
                    At::Var(var) => var,
                    other => {
                        // Only variables stay; what is pinned is one.
                        let id = self.index_value(other, span);
                        let var = self.temporary(Ty::Int);
                        self.assign(var, id);
                        var
                    }
                };
                self.block.push(Stmt::Store { base: place.base, len, index, value: temp });
            }
        }
    }

    fn pinned_known(&self, place: Place) -> Result<VarId, (At, u32)> {
        match place.at {
            At::Known(i) => Ok(VarId(place.base.0 + i)),
            at => Err((at, place.len)),
        }
    }

    /// Copies a value of several parts. What is pending must have been put aside.
    pub(super) fn copy(&mut self, to: Place, from: Place, ty: Ty, span: Span) {
        let (mut targets, mut sources) = (Vec::new(), Vec::new());
        self.leaves(to, ty, span, &mut targets);
        self.leaves(from, ty, span, &mut sources);
        for ((to, ty), (from, _)) in targets.into_iter().zip(sources) {
            self.run_start = self.body.exprs.len() as u32;
            let value = self.load(from, ty, span);
            self.store_at(to, ty, value.id, span);
        }
    }

    /// Makes every part of a value zero, black, or empty.
    pub(super) fn clear(&mut self, place: Place, ty: Ty, span: Span) {
        let mut parts = Vec::new();
        self.leaves(place, ty, span, &mut parts);
        for (part, ty) in parts {
            self.run_start = self.body.exprs.len() as u32;
            let zero = self.zero(ty, span);
            self.store_at(part, ty, zero, span);
        }
    }

    /// A matrix with one number on its diagonal.
    pub(super) fn diagonal(&mut self, place: Place, value: VarId, span: Span) {
        for i in 0..16u32 {
            self.run_start = self.body.exprs.len() as u32;
            let id = match i % 5 {
                0 => self.push(ExprKind::Var(value), Ty::Float, span).id,
                _ => self.zero(Ty::Float, span),
            };
            self.store_at(Place { base: VarId(place.base.0 + i), ..place }, Ty::Float, id, span);
        }
    }

    /// The words for a type in messages.
    pub(super) fn words(&self, ty: Ty) -> String {
        match ty {
            Ty::Struct(number) => self.ast.name(self.layouts[usize::from(number)].name).to_owned(),
            Ty::Array(number) => {
                let (element, length) = self.arrays[usize::from(number)];
                format!("{}[{}]", self.words(element), length.map_or(String::new(), |n| n.to_string()))
            }
            simple => simple.name().to_owned(),
        }
    }

    fn constant_int(&mut self, root: ast::Root) -> Option<i32> {
        if let ast::ExprKind::Int(value) = self.ast.expr(root.root).kind {
            return Some(value);
        }
        // A length may be looked up in the middle of another run, which goes on.
        let start = self.run_start;
        let value = self.run(root);
        let run = Root { first: self.run_start, root: value.id };
        self.run_start = start;
        if value.ty != Ty::Int {
            return None;
        }
        super::super::passes::fold::constant(&self.body, run).map(|cells| cells[0] as i32)
    }
}
