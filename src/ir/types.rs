//! The types of values, and which become which without being asked.

use crate::lobes::registry::ParamTy;
use crate::syntax::ast::TypeName;

/// The type of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ty {
    /// 32-bit signed integer; also the result of comparisons.
    Int,
    /// 32-bit float.
    Float,
    /// Linear RGB.
    Color,
    /// A direction with a length.
    Vector,
    /// A surface normal.
    Normal,
    /// A position.
    Point,
    /// Text.
    String,
    /// Sixteen floats in four rows; held as so many variables.
    Matrix,
    /// A struct, by its number; held as its fields.
    Struct(u16),
    /// An array, by its number; held as its elements.
    Array(u16),
    /// What a function returns that returns nothing.
    Void,
    /// What a surface does to light.
    Closure,
    /// Follows an error; fits everywhere, so that one mistake is reported once.
    Poison,
}

impl Ty {
    /// As a script writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Ty::Int => "int",
            Ty::Float => "float",
            Ty::Color => "color",
            Ty::Vector => "vector",
            Ty::Normal => "normal",
            Ty::Point => "point",
            Ty::String => "string",
            Ty::Closure => "closure color",
            Ty::Matrix => "matrix",
            Ty::Struct(_) => "struct",
            Ty::Array(_) => "array",
            Ty::Void => "void",
            Ty::Poison => "unknown",
        }
    }

    /// How many 32-bit cells a value takes; closures live apart.
    pub const fn cells(self) -> usize {
        match self {
            Ty::Int | Ty::Float | Ty::String => 1,
            Ty::Color | Ty::Vector | Ty::Normal | Ty::Point => 3,
            Ty::Closure | Ty::Poison | Ty::Matrix | Ty::Struct(_) | Ty::Array(_) | Ty::Void => 0,
        }
    }

    /// Colors, points, vectors and normals.
    pub const fn is_triple(self) -> bool {
        self.cells() == 3
    }

    /// Points, vectors and normals, which stand for one another.
    pub const fn is_spatial(self) -> bool {
        matches!(self, Ty::Vector | Ty::Normal | Ty::Point)
    }

    /// Whether it is held as several variables.
    pub const fn is_aggregate(self) -> bool {
        matches!(self, Ty::Matrix | Ty::Struct(_) | Ty::Array(_))
    }

    /// Ints and floats.
    pub const fn is_scalar(self) -> bool {
        matches!(self, Ty::Int | Ty::Float)
    }

    /// Everything arithmetic works on.
    pub const fn is_numeric(self) -> bool {
        self.is_scalar() || self.is_triple()
    }

    /// How far a value is from the type `to`: 0 the same, more for each step away; `None` if it does not convert by
    /// itself. Ints become floats, scalars become triples, points, vectors and normals each other.
    pub fn distance(self, to: Ty) -> Option<u32> {
        match (self, to) {
            (a, b) if a == b => Some(0),
            (Ty::Poison, _) | (_, Ty::Poison) => Some(0),
            (a, b) if a.is_spatial() && b.is_spatial() => Some(1),
            (Ty::Int, Ty::Float) => Some(2),
            (Ty::Float, b) if b.is_triple() => Some(4),
            (Ty::Int, b) if b.is_triple() => Some(6),
            _ => None,
        }
    }
}

impl Ty {
    /// The type of a name other than a struct's.
    pub const fn simple(name: TypeName) -> Option<Ty> {
        Some(match name {
            TypeName::Float => Ty::Float,
            TypeName::Int => Ty::Int,
            TypeName::Color => Ty::Color,
            TypeName::Vector => Ty::Vector,
            TypeName::Normal => Ty::Normal,
            TypeName::Point => Ty::Point,
            TypeName::String => Ty::String,
            TypeName::Closure => Ty::Closure,
            TypeName::Matrix => Ty::Matrix,
            TypeName::Void => Ty::Void,
            TypeName::Named(_) => return None,
        })
    }
}

impl From<ParamTy> for Ty {
    fn from(ty: ParamTy) -> Ty {
        match ty {
            ParamTy::Float => Ty::Float,
            ParamTy::Int => Ty::Int,
            ParamTy::Color => Ty::Color,
            ParamTy::Vector => Ty::Vector,
            ParamTy::Normal => Ty::Normal,
            ParamTy::String => Ty::String,
            ParamTy::Closure => Ty::Closure,
        }
    }
}
