//! The syntax tree: what was written, in arenas.
//!
//! Expressions are stored operands first, so that a [`Root`] names a contiguous run whose last entry is the whole
//! expression; a pass over an expression is a loop over its run, however deep the tree. Only statements nest, and the
//! preprocessor has limited how deep. Names are interned. The tree holds no types beyond those written.

use crate::diag::Diagnostic;
use crate::span::{Source, Span};
use std::collections::HashMap;

/// An interned name or string.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sym(pub u32);

/// An expression of an [`Ast`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExprId(pub u32);

/// A run of expressions, the last of which is the one meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Root {
    /// The first of the run.
    pub first: u32,
    /// The last: the whole expression.
    pub root: ExprId,
}

/// A run of entries in [`Ast::args`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Args {
    /// Index of the first.
    pub start: u32,
    /// How many.
    pub len: u32,
}

/// A type as written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TypeName {
    /// `float`
    Float,
    /// `int`
    Int,
    /// `color`
    Color,
    /// `vector`
    Vector,
    /// `normal`
    Normal,
    /// `point`
    Point,
    /// `string`
    String,
    /// `matrix`
    Matrix,
    /// `void`
    Void,
    /// `closure color`
    Closure,
    /// A struct.
    Named(Sym),
}

impl TypeName {
    /// The simple type called `word`.
    pub fn simple(word: &str) -> Option<TypeName> {
        Some(match word {
            "float" => TypeName::Float,
            "int" => TypeName::Int,
            "color" => TypeName::Color,
            "vector" => TypeName::Vector,
            "normal" => TypeName::Normal,
            "point" => TypeName::Point,
            "string" => TypeName::String,
            "matrix" => TypeName::Matrix,
            _ => return None,
        })
    }
}

/// Operators in front of an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnaryOp {
    /// `-`
    Neg,
    /// `+`
    Plus,
    /// `!`
    Not,
    /// `~`
    BitNot,
}

impl UnaryOp {
    /// As written.
    pub const fn text(self) -> &'static str {
        match self {
            UnaryOp::Neg => "-",
            UnaryOp::Plus => "+",
            UnaryOp::Not => "!",
            UnaryOp::BitNot => "~",
        }
    }
}

macro_rules! binary_ops {
    ($( $name:ident $text:literal $level:literal ),* $(,)?) => {
        /// Operators between two operands.
        #[allow(missing_docs)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum BinaryOp { $( $name ),* }

        impl BinaryOp {
            /// As written.
            pub const fn text(self) -> &'static str {
                match self { $( BinaryOp::$name => $text ),* }
            }
            /// How strongly it binds; more binds first.
            pub const fn level(self) -> u8 {
                match self { $( BinaryOp::$name => $level ),* }
            }
            /// The operator written `text`.
            pub fn from_text(text: &str) -> Option<BinaryOp> {
                match text { "and" => Some(BinaryOp::And), "or" => Some(BinaryOp::Or), $( $text => Some(BinaryOp::$name), )* _ => None }
            }
        }
    };
}

binary_ops! {
    Or "||" 4, And "&&" 5, BitOr "|" 6, BitXor "^" 7, BitAnd "&" 8,
    Eq "==" 9, Ne "!=" 9, Lt "<" 10, Le "<=" 10, Gt ">" 10, Ge ">=" 10,
    Shl "<<" 11, Shr ">>" 11, Add "+" 12, Sub "-" 12, Mul "*" 13, Div "/" 13, Rem "%" 13,
}

/// What an expression is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExprKind {
    /// `12`
    Int(i32),
    /// `1.5`
    Float(f32),
    /// `"text"`, escapes resolved.
    String(Sym),
    /// A variable or global.
    Name(Sym),
    /// An operator before its operand.
    Unary(UnaryOp, ExprId),
    /// An operator between its operands.
    Binary(BinaryOp, ExprId, ExprId),
    /// `target = value`, or `target op= value`.
    Assign(Option<BinaryOp>, ExprId, ExprId),
    /// `condition ? yes : no`
    Ternary(ExprId, ExprId, ExprId),
    /// A call; the span covers the name alone.
    Call(Sym, Span, Args),
    /// `color(1, 0, 0)`
    Construct(TypeName, Args),
    /// `(float) x`
    Cast(TypeName, ExprId),
    /// `c[0]`
    Index(ExprId, ExprId),
    /// `c.x`; the span covers the name alone.
    Field(ExprId, Sym, Span),
    /// `{ a, b }`
    List(Args),
    /// `++x`, `x--`
    Step(Step, ExprId),
    /// `a, b`: the value is that of b.
    Comma(ExprId, ExprId),
}

/// How a step counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// `--`
    pub down: bool,
    /// Behind its operand: the value is that before the step.
    pub after: bool,
}

/// An expression and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// What stands in the brackets after a declared name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// No brackets.
    None,
    /// `[]`
    Open,
    /// `[3]`
    Given(Root),
}

/// A declared name with its first value.
#[derive(Clone, Debug)]
pub struct Declarator {
    /// The name.
    pub name: Sym,
    /// Where the name stands.
    pub span: Span,
    /// Whether it is an array.
    pub length: Length,
    /// Its first value.
    pub init: Option<Root>,
}

/// A statement.
#[derive(Clone, Debug)]
pub enum Stmt {
    /// `float a = 1, b;`
    Declare(TypeName, Vec<Declarator>),
    /// An expression for its effect.
    Expr(Root),
    /// `if … else …`
    If {
        /// The condition.
        condition: Root,
        /// When it holds.
        then: Box<Stmt>,
        /// When it does not.
        other: Option<Box<Stmt>>,
    },
    /// `{ … }`
    Block(Vec<Stmt>),
    /// `for`, `while`, `do`
    Loop(Box<Loop>),
    /// `break;`
    Break(Span),
    /// `continue;`
    Continue(Span),
    /// `return x;`
    Return(Option<Root>, Span),
}

/// A loop.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Where its first word stands.
    pub span: Span,
    /// What is done first.
    pub start: Vec<Stmt>,
    /// Goes on while it holds; `None`: for ever.
    pub condition: Option<Root>,
    /// The body comes before the first test.
    pub body_first: bool,
    /// After each round.
    pub step: Option<Root>,
    /// What is repeated.
    pub body: Stmt,
}

/// A function of the script.
#[derive(Clone, Debug)]
pub struct Function {
    /// Its name.
    pub name: Sym,
    /// Where the name stands.
    pub span: Span,
    /// What it returns.
    pub ty: TypeName,
    /// Its parameters in order; without defaults.
    pub params: Vec<Param>,
    /// What it does; `None` for a declaration.
    pub body: Option<Vec<Stmt>>,
}

/// A struct of the script.
#[derive(Clone, Debug)]
pub struct Struct {
    /// Its name.
    pub name: Sym,
    /// Where the name stands.
    pub span: Span,
    /// Its fields in order.
    pub fields: Vec<(TypeName, Declarator)>,
}

/// The word a shader begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaderKind {
    /// `surface`
    Surface,
    /// `shader`
    Generic,
    /// `displacement`
    Displacement,
    /// `volume`
    Volume,
    /// `light`
    Light,
}

/// One entry of metadata.
#[derive(Clone, Debug)]
pub struct Metadatum {
    /// Its type.
    pub ty: TypeName,
    /// Its name.
    pub name: Sym,
    /// Its value.
    pub value: Root,
    /// Where it stands.
    pub span: Span,
}

/// A declared parameter of a shader or function.
#[derive(Clone, Debug)]
pub struct Param {
    /// Declared `output`.
    pub output: bool,
    /// Its type.
    pub ty: TypeName,
    /// Its name.
    pub name: Sym,
    /// Where the name stands.
    pub span: Span,
    /// Whether it is an array.
    pub length: Length,
    /// Its default value.
    pub default: Option<Root>,
    /// What `[[ ]]` holds.
    pub metadata: Vec<Metadatum>,
}

/// A shader.
#[derive(Clone, Debug)]
pub struct Shader {
    /// What it computes.
    pub kind: ShaderKind,
    /// Its name; `None` for bare statements.
    pub name: Option<Sym>,
    /// Where the name stands.
    pub span: Span,
    /// What `[[ ]]` after the name holds.
    pub metadata: Vec<Metadatum>,
    /// Its parameters in order.
    pub params: Vec<Param>,
    /// What it does.
    pub body: Vec<Stmt>,
}

/// A parsed script.
#[derive(Clone, Debug, Default)]
pub struct Ast {
    /// All expressions, operands first.
    pub exprs: Vec<Expr>,
    /// Arguments of calls and constructors.
    pub args: Vec<ExprId>,
    /// The shader.
    pub shader: Option<Shader>,
    /// Functions in order.
    pub functions: Vec<Function>,
    /// Structs in order.
    pub structs: Vec<Struct>,
    /// Included files; the first is file 1 of spans.
    pub sources: Vec<Source>,
    /// What the preprocessor warns of.
    pub warnings: Vec<Diagnostic>,
    names: Vec<Box<str>>,
    by_name: HashMap<Box<str>, Sym>,
}

impl Ast {
    /// The expression `id`.
    pub fn expr(&self, id: ExprId) -> &Expr {
        &self.exprs[id.0 as usize]
    }

    /// The arguments of a call.
    pub fn args(&self, args: Args) -> &[ExprId] {
        &self.args[args.start as usize..(args.start + args.len) as usize]
    }

    /// The text of a name or string.
    pub fn name(&self, sym: Sym) -> &str {
        &self.names[sym.0 as usize]
    }

    /// The [`Sym`] of a text that stands somewhere in the script.
    pub fn find(&self, text: &str) -> Option<Sym> {
        self.by_name.get(text).copied()
    }

    /// The one [`Sym`] of a text.
    pub fn intern(&mut self, text: &str) -> Sym {
        if let Some(sym) = self.by_name.get(text) {
            return *sym;
        }
        let sym = Sym(self.names.len() as u32);
        self.names.push(text.into());
        self.by_name.insert(text.into(), sym);
        sym
    }

    /// Appends an expression whose operands are there already.
    pub fn push(&mut self, kind: ExprKind, span: Span) -> ExprId {
        self.exprs.push(Expr { kind, span });
        ExprId(self.exprs.len() as u32 - 1)
    }
}
