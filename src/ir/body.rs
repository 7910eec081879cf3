//! The typed program between checking and running.
//!
//! Expressions lie in one arena, operands first: the expression of a statement is a contiguous run that refers to
//! nothing outside itself, so that a pass over it is a loop. Conversions are explicit, names are resolved, and values
//! are up to three 32-bit cells (floats and ints by their bits, strings by their number). Statements nest as far as the
//! script's braces do. Nothing here is wrong any more: [`super::check`] has seen to that.

use super::tasks::Task;
use super::types::Ty;
use crate::globals::Globals;
use crate::lobes::LobeKind;
use crate::span::Span;

/// A value other than a closure, by its bits.
pub type Cells = [u32; 3];

/// An expression of a [`Body`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExprId(pub u32);

impl ExprId {
    /// As an index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A variable of a [`Body`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VarId(pub u32);

impl VarId {
    /// The variable that becomes the closure tree.
    pub const CI: VarId = VarId(0);

    /// As an index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A run of expressions, the last of which is the one meant.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// The first of the run.
    pub first: u32,
    /// The last: the whole expression.
    pub root: ExprId,
}

macro_rules! globals {
    ($( $name:ident $text:literal $ty:ident |$g:ident| $read:expr ),* $(,)?) => {
        /// What the host tells about the shading point, as scripts name it.
        #[allow(missing_docs)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum GlobalVar { $( $name ),* }

        impl GlobalVar {
            /// All of them.
            pub const ALL: &[GlobalVar] = &[ $( GlobalVar::$name ),* ];

            /// Its name in scripts.
            pub const fn name(self) -> &'static str {
                match self { $( GlobalVar::$name => $text ),* }
            }

            /// Its type.
            pub const fn ty(self) -> Ty {
                match self { $( GlobalVar::$name => Ty::$ty ),* }
            }

            /// Its value at a point.
            #[inline]
            pub fn read(self, globals: &Globals) -> Cells {
                match self { $( GlobalVar::$name => { let $g = globals; $read } ),* }
            }
        }
    };
}

globals! {
    P "P" Point |g| g.p.to_array().map(f32::to_bits),
    N "N" Normal |g| g.n.to_array().map(f32::to_bits),
    Ng "Ng" Normal |g| g.ng.to_array().map(f32::to_bits),
    I "I" Vector |g| g.i.to_array().map(f32::to_bits),
    U "u" Float |g| [g.u.to_bits(), 0, 0],
    V "v" Float |g| [g.v.to_bits(), 0, 0],
    DPdu "dPdu" Vector |g| g.dpdu.to_array().map(f32::to_bits),
    DPdv "dPdv" Vector |g| g.dpdv.to_array().map(f32::to_bits),
    Time "time" Float |g| [g.time.to_bits(), 0, 0],
    Backfacing "backfacing()" Int |g| [u32::from(g.backfacing), 0, 0],
    DPdx "Dx(P)" Vector |g| g.differentials.dpdx.to_array().map(f32::to_bits),
    DPdy "Dy(P)" Vector |g| g.differentials.dpdy.to_array().map(f32::to_bits),
    DIdx "Dx(I)" Vector |g| g.differentials.didx.to_array().map(f32::to_bits),
    DIdy "Dy(I)" Vector |g| g.differentials.didy.to_array().map(f32::to_bits),
    Dudx "Dx(u)" Float |g| [g.differentials.dudx.to_bits(), 0, 0],
    Dudy "Dy(u)" Float |g| [g.differentials.dudy.to_bits(), 0, 0],
    Dvdx "Dx(v)" Float |g| [g.differentials.dvdx.to_bits(), 0, 0],
    Dvdy "Dy(v)" Float |g| [g.differentials.dvdy.to_bits(), 0, 0],
}

impl GlobalVar {
    /// Directions that only turn the frame of a lobe when used as its normal or tangent.
    pub const fn is_frame(self) -> bool {
        matches!(self, GlobalVar::N | GlobalVar::Ng | GlobalVar::DPdu | GlobalVar::DPdv)
    }
}

/// Operations with operands of fixed types. The suffix names the operands: floats (per component), ints.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Op {
    NegF,
    AddF,
    SubF,
    MulF,
    DivF,
    NegI,
    NotI,
    BitNotI,
    AddI,
    SubI,
    MulI,
    DivI,
    RemI,
    BitAndI,
    BitOrI,
    BitXorI,
    ShlI,
    ShrI,
    EqF,
    NeF,
    LtF,
    LeF,
    GtF,
    GeF,
    EqI,
    NeI,
    LtI,
    LeI,
    GtI,
    GeI,
    /// Whether any component differs from zero.
    TruthF,
    TruthI,
    IntToFloat,
    FloatToInt,
    /// A float in every component.
    Splat,
    /// Three floats as one triple.
    Triple,
    /// Component `b` of `a`, the index limited to 0..=2.
    Component,
    /// `a` with component `b` replaced by `c`.
    Insert,
    /// Evaluates `b` only if `a` is not zero.
    And,
    /// Evaluates `b` only if `a` is zero.
    Or,
    /// Evaluates `b` if `a` is not zero, else `c`.
    Select,
    /// Closure + closure.
    AddC,
    /// Color × closure.
    MulC,
    /// Closure over closure.
    Layer,
}

impl Op {
    /// Whether its value is 0 or 1.
    pub const fn is_truth(self) -> bool {
        use Op::{EqF, EqI, GeF, GeI, GtF, GtI, LeF, LeI, LtF, LtI, NeF, NeI, NotI, TruthF, TruthI};
        matches!(self, EqF | NeF | LtF | LeF | GtF | GeF | EqI | NeI | LtI | LeI | GtI | GeI | NotI | TruthF | TruthI)
    }

    /// How many operands it has.
    pub const fn arity(self) -> usize {
        match self {
            Op::NegF | Op::NegI | Op::NotI | Op::BitNotI | Op::TruthF | Op::TruthI => 1,
            Op::IntToFloat | Op::FloatToInt | Op::Splat => 1,
            Op::Triple | Op::Insert | Op::Select => 3,
            _ => 2,
        }
    }
}

/// A run of entries in [`Body::args`].
#[derive(Clone, Copy, Debug)]
pub struct Args {
    /// Index of the first.
    pub start: u32,
    /// How many.
    pub len: u32,
}

/// What an expression is.
#[derive(Clone, Copy, Debug)]
pub enum ExprKind {
    /// A known value.
    Const(Cells),
    /// The black closure.
    Black,
    /// The value of a variable.
    Var(VarId),
    /// One of so many variables that follow each other, by an index that is limited to what there is.
    Element(VarId, u32, ExprId),
    /// A fact about the shading point.
    Global(GlobalVar),
    /// An operation; operands beyond its arity are unused.
    Op(Op, [ExprId; 3]),
    /// A function of the table, by its index there.
    Call(u16, Args),
    /// The number of an option that a string names.
    OptionIndex(&'static [&'static str], ExprId),
    /// A lobe; one argument per declared parameter, each a float or a triple.
    Lobe(LobeKind, Args),
}

/// An expression.
#[derive(Clone, Copy, Debug)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// The type of its value.
    pub ty: Ty,
    /// Where it was written.
    pub span: Span,
}

/// A statement.
#[derive(Clone, Debug)]
pub enum Stmt {
    /// `var = value`
    Assign(VarId, Root),
    /// `value` into one of `len` variables that follow each other from `base` on; the index is limited to what there is.
    Store {
        /// The first.
        base: VarId,
        /// How many.
        len: u32,
        /// An int.
        index: VarId,
        /// Of the type of the variables.
        value: VarId,
    },
    /// Something with any number of results.
    Do(Box<Deed>),
    /// `before`, then, if the condition holds, `body` and once more from the start.
    Loop {
        /// Done before each test.
        before: Vec<Stmt>,
        /// An int.
        condition: Root,
        /// Done after it if it is not zero.
        body: Vec<Stmt>,
        /// Where the loop begins.
        span: Span,
    },
    /// Two ways to go on.
    If {
        /// An int.
        condition: Root,
        /// If it is not zero.
        then: Vec<Stmt>,
        /// If it is.
        other: Vec<Stmt>,
    },
}

/// What a statement does that has any number of results.
#[derive(Clone, Debug)]
pub struct Deed {
    /// What is done.
    pub task: Task,
    /// What it is done with.
    pub args: Vec<VarId>,
    /// What it writes.
    pub outs: Vec<VarId>,
    /// Where the call stands.
    pub span: Span,
}

/// Calls `see` for each variable that statements may write.
pub fn each_written(stmts: &[Stmt], see: &mut impl FnMut(VarId)) {
    for stmt in stmts {
        match stmt {
            Stmt::Assign(var, _) => see(*var),
            Stmt::Store { base, len, .. } => (0..*len).for_each(|i| see(VarId(base.0 + i))),
            Stmt::Do(deed) => deed.outs.iter().for_each(|out| see(*out)),
            Stmt::Loop { before, body, .. } => {
                each_written(before, see);
                each_written(body, see);
            }
            Stmt::If { then, other, .. } => {
                each_written(then, see);
                each_written(other, see);
            }
        }
    }
}

/// A program.
#[derive(Clone, Debug, Default)]
pub struct Body {
    /// All expressions.
    pub exprs: Vec<Expr>,
    /// Arguments of calls and lobes.
    pub args: Vec<ExprId>,
    /// The type of each variable; the first is `Ci`.
    pub vars: Vec<Ty>,
    /// Strings by their number; the first is empty.
    pub strings: Vec<String>,
    /// What variables hold before the first statement, where that is not zero.
    pub starts: Vec<(VarId, Cells)>,
    /// What to do.
    pub stmts: Vec<Stmt>,
}

impl Body {
    /// The expression `id`.
    pub fn expr(&self, id: ExprId) -> &Expr {
        &self.exprs[id.index()]
    }

    /// The arguments of a call or lobe.
    pub fn args(&self, args: Args) -> &[ExprId] {
        &self.args[args.start as usize..(args.start + args.len) as usize]
    }

    /// Appends an expression whose operands are there already.
    pub fn push(&mut self, kind: ExprKind, ty: Ty, span: Span) -> ExprId {
        self.exprs.push(Expr { kind, ty, span });
        ExprId(self.exprs.len() as u32 - 1)
    }

    /// Stores arguments.
    pub fn push_args(&mut self, ids: impl IntoIterator<Item = ExprId>) -> Args {
        let start = self.args.len() as u32;
        self.args.extend(ids);
        Args { start, len: self.args.len() as u32 - start }
    }

    /// Calls `see` for each operand of an expression.
    pub fn operands(&self, id: ExprId, mut see: impl FnMut(ExprId)) {
        match self.expr(id).kind {
            ExprKind::Const(_) | ExprKind::Black | ExprKind::Var(_) | ExprKind::Global(_) => {}
            ExprKind::Op(op, ids) => ids[..op.arity()].iter().copied().for_each(see),
            ExprKind::Call(_, args) | ExprKind::Lobe(_, args) => self.args(args).iter().copied().for_each(see),
            ExprKind::OptionIndex(_, id) | ExprKind::Element(_, _, id) => see(id),
        }
    }
}
