//! The rules of differentiation, one operation or function after another.

use super::super::super::body::{Args, ExprId, ExprKind, Op};
use super::super::super::builtins::{BUILTINS, Eval, overloads};
use super::super::super::functions::noise;
use super::super::super::types::Ty;
use super::{Axis, Derive};
use crate::span::Span;
use std::f32::consts::{LN_2, LN_10};

/// How far a central difference steps to either side.
const STEP: f32 = 1.0 / 256.0;

impl Derive<'_> {
    pub(super) fn op(&mut self, op: Op, ids: &[ExprId], ty: Ty) -> ExprId {
        let mut all = [ExprId(0); 3];
        all[..ids.len()].copy_from_slice(ids);
        self.new.push(ExprKind::Op(op, all), ty, Span::default())
    }

    /// A call of the built-in function with this name and signature.
    pub(super) fn call(&mut self, name: &str, sig: &str, ids: &[ExprId], ty: Ty) -> ExprId {
        let index = overloads(name).iter().copied().find(|index| BUILTINS[*index as usize].sig == sig);
        let args = self.new.push_args(ids.iter().copied());
        self.new.push(ExprKind::Call(index.unwrap_or(0), args), ty, Span::default())
    }

    fn number(&mut self, x: f32, ty: Ty) -> ExprId {
        self.new.push(ExprKind::Const([x.to_bits(); 3]), ty, Span::default())
    }

    /// A float as wide as `ty`.
    fn wide(&mut self, x: ExprId, ty: Ty) -> ExprId {
        if ty.is_triple() { self.op(Op::Splat, &[x], ty) } else { x }
    }

    pub(super) fn sum(&mut self, a: Option<ExprId>, b: Option<ExprId>, ty: Ty) -> Option<ExprId> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.op(Op::AddF, &[a, b], ty)),
            (a, b) => a.or(b),
        }
    }

    fn less(&mut self, a: Option<ExprId>, b: Option<ExprId>, ty: Ty) -> Option<ExprId> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.op(Op::SubF, &[a, b], ty)),
            (None, Some(b)) => Some(self.op(Op::NegF, &[b], ty)),
            (a, None) => a,
        }
    }

    fn times(&mut self, a: Option<ExprId>, b: ExprId, ty: Ty) -> Option<ExprId> {
        a.map(|a| self.op(Op::MulF, &[a, b], ty))
    }

    fn scaled(&mut self, a: Option<ExprId>, x: f32, ty: Ty) -> Option<ExprId> {
        let x = self.number(x, ty);
        self.times(a, x, ty)
    }

    fn over(&mut self, a: Option<ExprId>, b: ExprId, ty: Ty) -> Option<ExprId> {
        a.map(|a| self.op(Op::DivF, &[a, b], ty))
    }

    /// Something, zero if it is nothing.
    fn some(&mut self, a: Option<ExprId>, ty: Ty) -> ExprId {
        a.unwrap_or_else(|| self.number(0.0, ty))
    }

    /// How an operation changes whose value is `value`.
    pub(super) fn of_operation(&mut self, op: Op, ids: [ExprId; 3], value: ExprId, axis: Axis) -> Option<ExprId> {
        let ty = self.new.expr(value).ty;
        let old = |k: usize| ids[k.min(op.arity() - 1)];
        let [a, b] = [0, 1].map(|k| self.of(old(k)));
        let [da, db, dc] = [0, 1, 2].map(|k| self.tangent_of(old(k), axis));
        match op {
            Op::NegF => self.less(None, da, ty),
            Op::AddF => self.sum(da, db, ty),
            Op::SubF => self.less(da, db, ty),
            Op::MulF => {
                let (left, right) = (self.times(da, b, ty), self.times(db, a, ty));
                self.sum(left, right, ty)
            }
            Op::DivF => {
                let right = self.times(db, value, ty);
                let above = self.less(da, right, ty);
                self.over(above, b, ty)
            }
            Op::Splat => da.map(|da| self.op(Op::Splat, &[da], ty)),
            Op::Component => da.map(|da| self.op(Op::Component, &[da, b], ty)),
            Op::Triple if [da, db, dc].iter().any(Option::is_some) => {
                let parts = [da, db, dc].map(|d| self.some(d, Ty::Float));
                Some(self.op(Op::Triple, &parts, ty))
            }
            Op::Insert if da.is_some() || dc.is_some() => {
                let (da, dc) = (self.some(da, ty), self.some(dc, Ty::Float));
                Some(self.op(Op::Insert, &[da, b, dc], ty))
            }
            Op::Select if ty != Ty::Closure && (db.is_some() || dc.is_some()) => {
                let (db, dc) = (self.some(db, ty), self.some(dc, ty));
                Some(self.op(Op::Select, &[a, db, dc], ty))
            }
            _ => None,
        }
    }

    /// How a call changes.
    pub(super) fn of_call(&mut self, index: u16, args: Args, value: ExprId, axis: Axis) -> Option<ExprId> {
        let builtin = &BUILTINS[index as usize];
        let ty = self.new.expr(value).ty;
        if ty != Ty::Float && !ty.is_triple() {
            return None;
        }
        let old = self.old.args(args).to_vec();
        let ids: Vec<ExprId> = old.iter().map(|id| self.of(*id)).collect();
        let d: Vec<Option<ExprId>> = old.iter().map(|id| self.tangent_of(*id, axis)).collect();
        if d.iter().all(Option::is_none) {
            return None;
        }
        match (builtin.eval, builtin.name) {
            (Eval::Noise(..), _) => {
                if self.is_stepped(builtin.eval, &old) {
                    return None;
                }
                self.difference(index, &ids, &d, ty, None)
            }
            (Eval::Derivative(_), _) => None,
            (_, "floor" | "ceil" | "round" | "trunc" | "sign" | "step" | "aastep" | "Dz" | "logb") => None,
            _ => match d[..] {
                [da] => self.of_one(index, ids[0], da, value, ty),
                _ => self.of_several(index, &ids, &d, value, ty),
            },
        }
    }

    /// Whether a noise has steps and no slope.
    fn is_stepped(&self, eval: Eval, args: &[ExprId]) -> bool {
        let named = || match self.old.expr(*args.first()?).kind {
            ExprKind::OptionIndex(options, name) => match self.old.expr(name).kind {
                ExprKind::Const(cells) => {
                    let name = self.old.strings.get(cells[0] as usize)?;
                    options.iter().position(|option| option == name)
                }
                _ => None,
            },
            _ => None,
        };
        let kind = match eval {
            Eval::Noise(Some(kind), _) => Some(kind),
            _ => named(),
        };
        kind.is_some_and(|kind| matches!(noise::KINDS[kind], "cell" | "hash"))
    }

    /// Of functions of one argument.
    fn of_one(&mut self, index: u16, a: ExprId, da: Option<ExprId>, value: ExprId, ty: Ty) -> Option<ExprId> {
        let name = BUILTINS[index as usize].name;
        let one = |d: &mut Self| d.number(1.0, ty);
        match name {
            "sin" | "cos" => {
                let other = self.call(if name == "sin" { "cos" } else { "sin" }, "gg", &[a], ty);
                let slope = self.times(da, other, ty);
                if name == "sin" { slope } else { self.less(None, slope, ty) }
            }
            "tan" | "atan" => {
                let x = if name == "tan" { value } else { a };
                let square = self.op(Op::MulF, &[x, x], ty);
                let one = one(self);
                let by = self.op(Op::AddF, &[one, square], ty);
                if name == "tan" { self.times(da, by, ty) } else { self.over(da, by, ty) }
            }
            "asin" | "acos" => {
                let square = self.op(Op::MulF, &[a, a], ty);
                let one = one(self);
                let rest = self.op(Op::SubF, &[one, square], ty);
                let root = self.call("sqrt", "gg", &[rest], ty);
                let slope = self.over(da, root, ty);
                if name == "asin" { slope } else { self.less(None, slope, ty) }
            }
            "exp" => self.times(da, value, ty),
            "exp2" => {
                let slope = self.times(da, value, ty);
                self.scaled(slope, LN_2, ty)
            }
            "log" => self.over(da, a, ty),
            "log2" | "log10" => {
                let slope = self.over(da, a, ty);
                self.scaled(slope, 1.0 / if name == "log2" { LN_2 } else { LN_10 }, ty)
            }
            "sqrt" => {
                let slope = self.over(da, value, ty);
                self.scaled(slope, 0.5, ty)
            }
            "inversesqrt" => {
                let slope = self.times(da, value, ty);
                let slope = self.over(slope, a, ty);
                self.scaled(slope, -0.5, ty)
            }
            "abs" | "fabs" => {
                let sign = self.call("sign", "gg", &[a], ty);
                self.times(da, sign, ty)
            }
            "radians" => self.scaled(da, 1f32.to_radians(), ty),
            "degrees" => self.scaled(da, 1f32.to_degrees(), ty),
            "luminance" => da.map(|da| self.call("luminance", "fc", &[da], ty)),
            "length" => {
                let along = da.map(|da| self.call("dot", "fvv", &[a, da], Ty::Float));
                self.over(along, value, ty)
            }
            "normalize" => {
                let along = da.map(|da| self.call("dot", "fvv", &[value, da], Ty::Float))?;
                let along = self.wide(along, ty);
                let kept = self.op(Op::MulF, &[value, along], ty);
                let across = self.less(da, Some(kept), ty);
                let length = self.call("length", "fv", &[a], Ty::Float);
                let length = self.wide(length, ty);
                self.over(across, length, ty)
            }
            _ => self.difference(index, &[a], &[da], ty, Some(a)),
        }
    }

    /// Of functions of several arguments.
    fn of_several(
        &mut self,
        index: u16,
        ids: &[ExprId],
        d: &[Option<ExprId>],
        value: ExprId,
        ty: Ty,
    ) -> Option<ExprId> {
        let (a, b) = (ids[0], ids[1]);
        let (da, db) = (d[0], d[1]);
        match (BUILTINS[index as usize].name, ids.len()) {
            ("min", 2) => self.chosen(a, b, [da, db], ty),
            ("max", 2) => self.chosen(b, a, [da, db], ty),
            ("clamp", 3) => {
                let (hi, dhi) = (ids[2], d[2]);
                let above = self.call("max", "ggg", &[a, b], ty);
                let dabove = self.chosen(b, a, [da, db], ty);
                self.chosen(above, hi, [dabove, dhi], ty)
            }
            ("mix", 3) => {
                let (x, dx) = (ids[2], d[2]);
                let one = self.number(1.0, ty);
                let rest = self.op(Op::SubF, &[one, x], ty);
                let apart = self.op(Op::SubF, &[b, a], ty);
                let (left, right, change) =
                    (self.times(da, rest, ty), self.times(db, x, ty), self.times(dx, apart, ty));
                let sum = self.sum(left, right, ty);
                self.sum(sum, change, ty)
            }
            ("select", 3) => {
                let (da, db) = (self.some(da, ty), self.some(db, ty));
                Some(self.call("select", "gggg", &[da, db, ids[2]], ty))
            }
            ("mod" | "fmod", 2) => {
                let whole = self.op(Op::SubF, &[a, value], ty);
                let whole = self.op(Op::DivF, &[whole, b], ty);
                let right = self.times(db, whole, ty);
                self.less(da, right, ty)
            }
            ("pow", 2) => {
                let left = self.times(da, b, ty);
                let left = self.over(left, a, ty);
                let log = self.call("log", "gg", &[a], ty);
                let right = self.times(db, log, ty);
                let sum = self.sum(left, right, ty);
                self.times(sum, value, ty)
            }
            ("atan2", 2) => {
                let (x, y) = (self.op(Op::MulF, &[b, b], ty), self.op(Op::MulF, &[a, a], ty));
                let square = self.op(Op::AddF, &[x, y], ty);
                let (left, right) = (self.times(da, b, ty), self.times(db, a, ty));
                let across = self.less(left, right, ty);
                self.over(across, square, ty)
            }
            ("linearstep" | "smoothstep", 3) => self.ramp(index, ids, d, ty),
            (name @ ("dot" | "cross"), 2) => {
                let sig = if name == "dot" { "fvv" } else { "vvv" };
                let left = da.map(|da| self.call(name, sig, &[da, b], ty));
                let right = db.map(|db| self.call(name, sig, &[a, db], ty));
                self.sum(left, right, ty)
            }
            ("distance", 2) => {
                let apart = self.op(Op::SubF, &[a, b], Ty::Vector);
                let change = self.less(da, db, Ty::Vector);
                let along = change.map(|change| self.call("dot", "fvv", &[apart, change], Ty::Float));
                self.over(along, value, ty)
            }
            ("hypot", _) => {
                let mut sum = None;
                for (x, dx) in ids.iter().zip(d) {
                    let part = self.times(*dx, *x, ty);
                    sum = self.sum(sum, part, ty);
                }
                self.over(sum, value, ty)
            }
            _ => self.difference(index, ids, d, ty, Some(a)),
        }
    }

    /// `da` where `x` is at least `edge`, elsewhere `db`.
    fn chosen(&mut self, edge: ExprId, x: ExprId, [da, db]: [Option<ExprId>; 2], ty: Ty) -> Option<ExprId> {
        if da.is_none() && db.is_none() {
            return None;
        }
        let first = self.call("step", "ggg", &[edge, x], ty);
        let (da, db) = (self.some(da, ty), self.some(db, ty));
        Some(self.call("select", "gggg", &[db, da, first], ty))
    }

    /// Of `linearstep` and `smoothstep`.
    fn ramp(&mut self, index: u16, ids: &[ExprId], d: &[Option<ExprId>], ty: Ty) -> Option<ExprId> {
        let t = self.call("linearstep", "gggg", ids, ty);
        let length = self.op(Op::SubF, &[ids[1], ids[0]], ty);
        let longer = self.less(d[1], d[0], ty);
        let longer = self.times(longer, t, ty);
        let along = self.less(d[2], d[0], ty);
        let change = self.less(along, longer, ty);
        let slope = self.over(change, length, ty)?;
        let one = self.number(1.0, ty);
        let rest = self.op(Op::SubF, &[one, t], ty);
        // Zero beyond the ends.
        let inside = self.op(Op::MulF, &[t, rest], ty);
        if BUILTINS[index as usize].name == "smoothstep" {
            let slope = self.times(Some(slope), inside, ty);
            return self.scaled(slope, 6.0, ty);
        }
        let zero = self.number(0.0, ty);
        Some(self.call("select", "gggg", &[zero, slope, inside], ty))
    }

    /// The central difference along the change of the arguments: (f(a + h·da) − f(a − h·da)) / 2h, with h such that the
    /// arguments move by [`STEP`] in all – times a quarter of the length of `scale` where that is more.
    fn difference(
        &mut self,
        index: u16,
        ids: &[ExprId],
        d: &[Option<ExprId>],
        ty: Ty,
        scale: Option<ExprId>,
    ) -> Option<ExprId> {
        let mut speed = None;
        for d in d.iter().flatten() {
            let size = self.size(*d);
            speed = self.sum(speed, Some(size), Ty::Float);
        }
        let mut step = self.number(STEP, Ty::Float);
        if let Some(scale) = scale {
            let size = self.size(scale);
            let reach = self.scaled(Some(size), 0.25 * STEP, Ty::Float)?;
            step = self.call("max", "ggg", &[step, reach], Ty::Float);
        }
        let h = self.over(Some(step), speed?, Ty::Float)?;
        let ends = [Op::AddF, Op::SubF].map(|op| {
            let moved: Vec<ExprId> = ids
                .iter()
                .zip(d)
                .map(|(id, d)| match d {
                    None => *id,
                    Some(d) => {
                        let ty = self.new.expr(*id).ty;
                        let h = self.wide(h, ty);
                        let way = self.op(Op::MulF, &[*d, h], ty);
                        self.op(op, &[*id, way], ty)
                    }
                })
                .collect();
            let args = self.new.push_args(moved);
            self.new.push(ExprKind::Call(index, args), ty, Span::default())
        });
        let apart = self.op(Op::SubF, &ends, ty);
        let two = self.number(2.0, Ty::Float);
        let both = self.op(Op::MulF, &[h, two], Ty::Float);
        let both = self.wide(both, ty);
        Some(self.op(Op::DivF, &[apart, both], ty))
    }

    /// How large a number or the length of a triple is.
    fn size(&mut self, x: ExprId) -> ExprId {
        let (name, sig) = if self.new.expr(x).ty.is_triple() { ("length", "fv") } else { ("abs", "gg") };
        self.call(name, sig, &[x], Ty::Float)
    }
}
