//! What a closure is called, what it takes, and what it becomes: the declarations every other part reads.
//!
//! A lobe states its parameters once, with the `closure!` macro; the language takes the
//! signature from it, `overcoat lobes` the documentation, [`crate::closure`] the layout of the values, the laws in
//! `tests/` the ranges to try. A [`Form`] is one way to call a closure from a script: a lobe's own signature, or an
//! alias or wrapper that expands to it.

use super::{LobeKind, tags};

/// The type of a closure parameter, as a script writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParamTy {
    /// One number.
    Float,
    /// A whole number.
    Int,
    /// Linear RGB.
    Color,
    /// A direction, not necessarily unit.
    Vector,
    /// A surface normal, not necessarily unit.
    Normal,
    /// One of [`ParamSpec::options`], stored as its index; free text where there are none.
    String,
    /// `closure color`: only in forms that wrap or layer, never a lobe's own parameter.
    Closure,
}

impl ParamTy {
    /// How many f32 slots a value takes in a [`ClosureTree`](crate::closure::ClosureTree).
    pub const fn slots(self) -> usize {
        match self {
            ParamTy::Float | ParamTy::Int | ParamTy::String => 1,
            ParamTy::Color | ParamTy::Vector | ParamTy::Normal => 3,
            ParamTy::Closure => 0,
        }
    }

    /// The type's name in the language.
    pub const fn name(self) -> &'static str {
        match self {
            ParamTy::Float => "float",
            ParamTy::Int => "int",
            ParamTy::Color => "color",
            ParamTy::Vector => "vector",
            ParamTy::Normal => "normal",
            ParamTy::String => "string",
            ParamTy::Closure => "closure color",
        }
    }
}

/// One declared parameter of a closure.
#[derive(Clone, Copy, Debug)]
pub struct ParamSpec {
    /// As scripts write it.
    pub name: &'static str,
    /// Its type.
    pub ty: ParamTy,
    /// Given as `"name", value` after the positional arguments, and then optional.
    pub keyword: bool,
    /// Slot values when a keyword is left out, and the documented typical value of a positional parameter. Empty for
    /// closures, and for normals and vectors, whose default comes from the shading point.
    pub default: &'static [f32],
    /// Lower end of the range that values are clamped to, per channel, when a lobe is built. Infinite where there is no limit.
    pub min: f32,
    /// Upper end of the range.
    pub max: f32,
    /// The words a string parameter may be; without any it is free text, stored as its number among the [`tags`].
    pub options: &'static [&'static str],
    /// What it does.
    pub doc: &'static str,
}

impl ParamSpec {
    /// A `closure color` parameter, of a form that wraps or layers.
    pub const fn closure(name: &'static str, doc: &'static str) -> ParamSpec {
        ParamSpec {
            name,
            ty: ParamTy::Closure,
            keyword: false,
            default: &[],
            min: f32::NEG_INFINITY,
            max: f32::INFINITY,
            options: &[],
            doc,
        }
    }

    /// A slot value as lobes read it: clamped to the declared range, whole where the type is; NaN becomes the default
    /// (or the lower end without one).
    pub fn clamp(&self, slot: usize, value: f32) -> f32 {
        if value.is_nan() {
            return self.default.get(slot).copied().unwrap_or(if self.min.is_finite() { self.min } else { 0.0 });
        }
        let value = value.clamp(self.min, self.max);
        if matches!(self.ty, ParamTy::Int | ParamTy::String) { value.trunc() } else { value }
    }
}

/// The number a string parameter is stored as: its place among the options, or among the [`tags`] where there are none.
pub fn option_index(options: &[&str], name: &str) -> Option<usize> {
    if options.is_empty() { Some(tags::number(name)) } else { options.iter().position(|o| *o == name) }
}

/// A lobe's declaration.
#[derive(Debug)]
pub struct LobeSpec {
    /// As scripts call it.
    pub name: &'static str,
    /// In declared order, keywords last.
    pub params: &'static [ParamSpec],
    /// What it looks like and what it does.
    pub doc: &'static str,
    /// Paper and equation.
    pub source: &'static str,
    /// Whether f(ωo, ωi) = f(ωi, ωo) at the default parameters.
    pub reciprocal: bool,
    /// How it takes part in a BSDF.
    pub class: LobeClass,
    /// See [`Form::note`].
    pub note: &'static str,
    /// What its parameter block looks like.
    pub layout: Layout,
}

/// A parameter block at a glance; follows from the parameters.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    slots: usize,
    normal: Option<usize>,
    tangent: Option<usize>,
}

impl Layout {
    /// The layout of a block of `params`.
    pub const fn of(params: &[ParamSpec]) -> Layout {
        let mut layout = Layout { slots: 0, normal: None, tangent: None };
        let mut i = 0;
        while i < params.len() {
            match params[i].ty {
                ParamTy::Normal if layout.normal.is_none() => layout.normal = Some(layout.slots),
                ParamTy::Vector if layout.tangent.is_none() => layout.tangent = Some(layout.slots),
                _ => {}
            }
            layout.slots += params[i].ty.slots();
            i += 1;
        }
        layout
    }
}

impl LobeSpec {
    /// Number of f32 slots of a parameter block.
    #[inline(always)]
    pub const fn slot_count(&self) -> usize {
        self.layout.slots
    }

    /// Where the lobe's own shading normal starts in its block: its first `normal` parameter.
    #[inline(always)]
    pub const fn normal_slot(&self) -> Option<usize> {
        self.layout.normal
    }

    /// Where the lobe's tangent starts in its block: its first `vector` parameter.
    #[inline(always)]
    pub const fn tangent_slot(&self) -> Option<usize> {
        self.layout.tangent
    }

    /// The first slot of the parameter called `name`.
    pub fn slot_of(&self, name: &str) -> Option<usize> {
        let mut at = 0;
        for p in self.params {
            if p.name == name {
                return Some(at);
            }
            at += p.ty.slots();
        }
        None
    }
}

/// How a lobe takes part in a BSDF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeClass {
    /// Has a density over directions.
    Scatter,
    /// Sends all it scatters into one direction.
    Delta,
    /// Adds light of its own.
    Emission,
}

/// Where a lobe's slot values come from when a script calls a [`Form`].
#[derive(Clone, Copy, Debug)]
pub enum SlotSource {
    /// The form's parameter with this index.
    Param(usize),
    /// Fixed by the form.
    Const(&'static [f32]),
    /// The shading point's normal.
    Normal,
}

/// What calling a [`Form`] builds.
#[derive(Clone, Copy, Debug)]
pub enum Build {
    /// A lobe; one source per lobe parameter, in the lobe's order; none at all means the form's parameters are the
    /// lobe's.
    Lobe {
        /// Which one.
        kind: LobeKind,
        /// Where its values come from.
        args: &'static [SlotSource],
    },
    /// `layer(weight * lobe, base)`: a lobe, tinted by the color parameter `weight`, over the closure parameter `base`.
    Wrap {
        /// The lobe on top.
        kind: LobeKind,
        /// Where its values come from.
        args: &'static [SlotSource],
        /// Index of the color parameter that tints it.
        weight: usize,
        /// Index of the closure parameter below it.
        base: usize,
    },
    /// `weight * lobe`: a lobe scaled by the color parameter `weight`.
    Tinted {
        /// Which one.
        kind: LobeKind,
        /// Where its values come from.
        args: &'static [SlotSource],
        /// Index of the color parameter that scales it.
        weight: usize,
    },
    /// `layer(top, base)` of the closure parameters 0 and 1.
    Layer,
}

/// One callable signature.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// As scripts call it.
    pub name: &'static str,
    /// In order, keywords last.
    pub params: &'static [ParamSpec],
    /// What it does.
    pub doc: &'static str,
    /// Paper and equation.
    pub source: &'static str,
    /// Whether what it builds is reciprocal at the default parameters.
    pub reciprocal: bool,
    /// What a call becomes.
    pub build: Build,
    /// How it differs from what other renderers mean by the name: said wherever it is called. Empty if it does not.
    pub note: &'static str,
}

impl Form {
    /// The form that calls a lobe by its own name and parameters.
    pub const fn of_lobe(kind: LobeKind, spec: &'static LobeSpec) -> Form {
        Form {
            name: spec.name,
            params: spec.params,
            doc: spec.doc,
            source: spec.source,
            reciprocal: spec.reciprocal,
            build: Build::Lobe { kind, args: &[] },
            note: spec.note,
        }
    }

    /// Another name for a lobe, with parameters of its own.
    pub const fn alias(
        name: &'static str,
        params: &'static [ParamSpec],
        doc: &'static str,
        spec: &'static LobeSpec,
        build: Build,
    ) -> Form {
        Form { name, params, doc, source: spec.source, reciprocal: spec.reciprocal, build, note: "" }
    }

    /// The same form with a [`note`](Form::note).
    pub const fn noted(self, note: &'static str) -> Form {
        Form { note, ..self }
    }

    /// The parameters given by position.
    pub fn positional(&self) -> impl Iterator<Item = &'static ParamSpec> {
        self.params.iter().filter(|p| !p.keyword)
    }

    /// The parameters given by name.
    pub fn keywords(&self) -> impl Iterator<Item = &'static ParamSpec> {
        self.params.iter().filter(|p| p.keyword)
    }

    /// As a script would declare it: `sheen(closure color base, normal N, …, ["softening", int])`.
    pub fn signature(&self) -> String {
        let positional = self.positional().map(|p| format!("{} {}", p.ty.name(), p.name));
        let keywords = self.keywords().map(|p| format!("[\"{}\", {}]", p.name, p.ty.name()));
        format!("{}({})", self.name, positional.chain(keywords).collect::<Vec<_>>().join(", "))
    }
}

/// A parameter block read from slots: implemented by the `closure!` macro.
pub trait ClosureParams: Sized + Copy {
    /// The declaration.
    const SPEC: &'static LobeSpec;
    /// Reads the block; every value is clamped to its declared range.
    fn from_slots(slots: &[f32]) -> Self;
}

/// A value that slots hold.
pub(crate) trait SlotValue: Sized {
    fn read(spec: &ParamSpec, slots: &[f32]) -> Self;
}

impl SlotValue for f32 {
    fn read(spec: &ParamSpec, slots: &[f32]) -> f32 {
        spec.clamp(0, slots[0])
    }
}

impl SlotValue for [f32; 3] {
    fn read(spec: &ParamSpec, slots: &[f32]) -> [f32; 3] {
        [0, 1, 2].map(|i| spec.clamp(i, slots[i]))
    }
}

/// Ints and string options.
impl SlotValue for u32 {
    fn read(spec: &ParamSpec, slots: &[f32]) -> u32 {
        spec.clamp(0, slots[0]) as u32
    }
}

/// Declares a lobe's parameters. Each line is `type name = default, in (min, max);`, a keyword parameter starts with
/// `keyword`, a string lists its options with `of [..]`; the `///` lines are the documentation users see.
macro_rules! closure {
    (
        $(#[doc = $doc:literal])*
        closure $name:literal as $Params:ident {
            $( $(#[doc = $pdoc:literal])* $( @ $kw:ident )? $ty:ident $p:ident $(= $default:expr)? $(, in ($lo:expr, $hi:expr))? $(, of [$($opt:literal),*])? ; )*
        }
        source: $source:literal,
        reciprocal: $rec:literal,
        class: $class:ident,
        $( note: $note:expr, )?
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(non_snake_case)]
        pub struct $Params { $( $(#[doc = $pdoc])* pub $p: $crate::lobes::registry::rust_type!($ty), )* }

        impl $crate::lobes::registry::ClosureParams for $Params {
            const SPEC: &'static $crate::lobes::registry::LobeSpec = {
                const PARAMS: &[$crate::lobes::registry::ParamSpec] = &[ $( $crate::lobes::registry::ParamSpec {
                    name: stringify!($p),
                    ty: $crate::lobes::registry::param_ty!($ty),
                    keyword: $crate::lobes::registry::is_keyword!($($kw)?),
                    default: $crate::lobes::registry::default_slots!($ty $($default)?),
                    min: $crate::lobes::registry::or_else!($($lo)?, f32::NEG_INFINITY),
                    max: $crate::lobes::registry::or_else!($($hi)?, f32::INFINITY),
                    options: &[$($($opt),*)?],
                    doc: concat!($($pdoc, "\n"),*),
                } ),* ];
                &$crate::lobes::registry::LobeSpec {
                    name: $name,
                    params: PARAMS,
                    doc: concat!($($doc, "\n"),*),
                    source: $source,
                    reciprocal: $rec,
                    class: $crate::lobes::registry::LobeClass::$class,
                    note: $crate::lobes::registry::or_else!($($note)?, ""),
                    layout: $crate::lobes::registry::Layout::of(PARAMS),
                }
            };

            #[allow(unused_assignments, unused_variables, unused_mut, non_snake_case)]
            fn from_slots(slots: &[f32]) -> Self {
                let mut at = 0;
                let mut index = 0;
                $(
                    let spec = &Self::SPEC.params[index];
                    let $p = $crate::lobes::registry::SlotValue::read(spec, &slots[at..]);
                    at += spec.ty.slots();
                    index += 1;
                )*
                $Params { $($p),* }
            }
        }
    };
}

macro_rules! rust_type {
    (float) => {
        f32
    };
    (int) => {
        u32
    };
    (string) => {
        u32
    };
    ($other:ident) => {
        [f32; 3]
    };
}

macro_rules! param_ty {
    (float) => {
        $crate::lobes::registry::ParamTy::Float
    };
    (int) => {
        $crate::lobes::registry::ParamTy::Int
    };
    (string) => {
        $crate::lobes::registry::ParamTy::String
    };
    (color) => {
        $crate::lobes::registry::ParamTy::Color
    };
    (vector) => {
        $crate::lobes::registry::ParamTy::Vector
    };
    (normal) => {
        $crate::lobes::registry::ParamTy::Normal
    };
}

macro_rules! is_keyword {
    () => {
        false
    };
    (keyword) => {
        true
    };
}

macro_rules! default_slots {
    ($ty:ident) => {
        &[]
    };
    (color $e:expr) => {
        &$e
    };
    (vector $e:expr) => {
        &$e
    };
    ($ty:ident $e:expr) => {
        &[$e]
    };
}

macro_rules! or_else {
    (, $d:expr) => {
        $d
    };
    ($e:expr, $d:expr) => {
        $e
    };
}

pub(crate) use {closure, default_slots, is_keyword, or_else, param_ty, rust_type};
