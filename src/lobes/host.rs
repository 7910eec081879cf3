//! Lobes that a host brings along.
//!
//! A host declares a closure's signature with a [`ClosureSpec`] and gives its f, and a bound on its albedo, through
//! [`HostLobe`]. From then on it is a lobe like any other: scripts call it, it layers and is layered, is sampled, drawn
//! and audited. Evaluation is in double precision, one direction at a time, in every tier.
//!
//! The bound is what the guarantee rests on. f is divided by max(1, Ē(ωo), Ē(ωi)), so a bound above 1 is allowed; one
//! that is too low is not found out here, but by the audits.

use super::lobe::keeps_seen;
use super::registry::{Form, Layout, LobeClass, LobeSpec, ParamSpec, ParamTy};
use super::{Evaluated, LobeKind, Rgb, Rgb32, Sides};
use crate::optics::{Over, Real, V3, sampling};
use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::{Mutex, PoisonError};

/// What a host's lobe does with light.
///
/// Directions are unit vectors in the lobe's frame: z is its normal, x the tangent of its first `vector` parameter (or
/// ∂P/∂u), and they point away from the surface. `values` holds the parameters in declared order, clamped to their
/// ranges; a float takes one place, a color, vector or normal three. What is negative, infinite or not a number counts
/// as 0.
pub trait HostLobe: Send + Sync {
    /// f(ωo, ωi) per channel, without any cosine.
    fn f(&self, values: &[f32], wo: [f64; 3], wi: [f64; 3]) -> [f64; 3];

    /// Never below ∫ f(ω, ωi)|cos θi| dωi nor ∫ f(ωo, ω)|cos θo| dωo over the whole sphere, per channel.
    fn albedo_bound(&self, values: &[f32], w: [f64; 3]) -> [f64; 3];

    /// Best estimate of ∫ f(ω, ωi)|cos θi| dωi.
    fn albedo(&self, values: &[f32], w: [f64; 3]) -> [f64; 3] {
        self.albedo_bound(values, w)
    }

    /// A direction for two uniform numbers. By default cosine-weighted on ωo's own side, so a lobe that transmits must
    /// give its own.
    fn sample(&self, values: &[f32], wo: [f64; 3], u: [f64; 2]) -> [f64; 3] {
        let _ = values;
        let w = sampling::cosine_hemisphere(u);
        [w.x, w.y, w.z.copysign(wo[2])]
    }

    /// Density over solid angle of [`sample`](Self::sample).
    fn pdf(&self, values: &[f32], wo: [f64; 3], wi: [f64; 3]) -> f64 {
        let _ = values;
        sampling::cosine_hemisphere_pdf(wi[2].copysign(wi[2] * wo[2]))
    }

    /// To which sides it may scatter, for hosts that ask.
    fn sides(&self) -> Sides {
        Sides::REFLECT
    }

    /// How wide it scatters: 0 one direction, 1 as wide as a diffuse surface.
    fn roughness(&self, values: &[f32]) -> f64 {
        let _ = values;
        1.0
    }
}

/// The signature of a closure that a host brings along.
#[derive(Clone, Debug)]
pub struct ClosureSpec {
    name: String,
    params: Vec<ParamSpec>,
    doc: String,
    source: String,
    reciprocal: bool,
    most: f32,
    wrong: Option<RegisterError>,
}

/// Why a closure cannot be registered.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RegisterError {
    /// The name is no identifier of the language.
    BadName(String),
    /// A closure or function of that name with the same parameter types is there already.
    Taken(String),
    /// The parameters take more places than [`MAX_VALUES`].
    TooManyValues(usize),
    /// Two parameters share a name.
    SameName(String),
    /// A default lies outside its range, or a range is empty.
    BadRange(String),
}

impl fmt::Display for RegisterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RegisterError::BadName(name) => write!(f, "`{name}` is not a name: expected letters, digits, underscores"),
            RegisterError::Taken(name) => write!(f, "a closure `{name}` with these parameters is there already"),
            RegisterError::TooManyValues(n) => write!(f, "the parameters take {n} places; {MAX_VALUES} are allowed"),
            RegisterError::SameName(name) => write!(f, "two parameters are called `{name}`"),
            RegisterError::BadRange(name) => write!(f, "the default of `{name}` lies outside its range"),
        }
    }
}

impl std::error::Error for RegisterError {}

/// Most places the parameters of a host's closure may take.
pub const MAX_VALUES: usize = 24;

impl ClosureSpec {
    /// A closure called `name`, so far without parameters, reciprocal, its albedo at most 1.
    pub fn new(name: impl Into<String>) -> Self {
        ClosureSpec {
            name: name.into(),
            params: vec![],
            doc: String::new(),
            source: String::new(),
            reciprocal: true,
            most: 1.0,
            wrong: None,
        }
    }

    /// What it looks like and does, and where it comes from (paper, equation).
    pub fn doc(self, doc: impl Into<String>, source: impl Into<String>) -> Self {
        ClosureSpec { doc: doc.into(), source: source.into(), ..self }
    }

    /// f(ωo, ωi) ≠ f(ωi, ωo).
    pub fn not_reciprocal(self) -> Self {
        ClosureSpec { reciprocal: false, ..self }
    }

    /// The bound on its albedo over all parameters and directions, if that is less than 1: what a proof may use.
    pub fn albedo_at_most(self, most: f32) -> Self {
        ClosureSpec { most: if most >= 0.0 { most.min(1.0) } else { 1.0 }, ..self }
    }

    /// The shading normal of its frame.
    pub fn normal(self, name: &str, doc: &str) -> Self {
        self.param(name, ParamTy::Normal, vec![], (f32::NEG_INFINITY, f32::INFINITY), doc)
    }

    /// The tangent of its frame.
    pub fn vector(self, name: &str, doc: &str) -> Self {
        self.param(name, ParamTy::Vector, vec![], (f32::NEG_INFINITY, f32::INFINITY), doc)
    }

    /// A float with its usual value and its range.
    pub fn float(self, name: &str, default: f32, range: std::ops::RangeInclusive<f32>, doc: &str) -> Self {
        self.param(name, ParamTy::Float, vec![default], (*range.start(), *range.end()), doc)
    }

    /// An int with its usual value and its range.
    pub fn int(self, name: &str, default: i32, range: std::ops::RangeInclusive<i32>, doc: &str) -> Self {
        self.param(name, ParamTy::Int, vec![default as f32], (*range.start() as f32, *range.end() as f32), doc)
    }

    /// A color, linear RGB, with its usual value; the range is per channel.
    pub fn color(self, name: &str, default: Rgb32, range: std::ops::RangeInclusive<f32>, doc: &str) -> Self {
        self.param(name, ParamTy::Color, default.to_vec(), (*range.start(), *range.end()), doc)
    }

    /// The parameter declared last is given as `"name", value` after all others, and may be left out.
    pub fn keyword(mut self) -> Self {
        if let Some(last) = self.params.last_mut() {
            last.keyword = true;
        }
        self
    }

    fn param(mut self, name: &str, ty: ParamTy, default: Vec<f32>, (min, max): (f32, f32), doc: &str) -> Self {
        if !is_name(name) {
            self.wrong.get_or_insert(RegisterError::BadName(name.to_owned()));
        }
        if self.params.iter().any(|p| p.name == name) {
            self.wrong.get_or_insert(RegisterError::SameName(name.to_owned()));
        }
        if min.is_nan() || max.is_nan() || min > max || default.iter().any(|d| !(min..=max).contains(d)) {
            self.wrong.get_or_insert(RegisterError::BadRange(name.to_owned()));
        }
        self.params.push(ParamSpec {
            name: leak(name),
            ty,
            keyword: false,
            default: default.leak(),
            min,
            max,
            options: &[],
            doc: leak(doc),
        });
        self
    }
}

fn is_name(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

fn leak(text: &str) -> &'static str {
    text.to_owned().leak()
}

/// A registered closure. Kept until the process ends, like the built-in ones.
struct HostClosure {
    spec: LobeSpec,
    most: f32,
    lobe: Box<dyn HostLobe>,
}

/// Names a registered closure.
#[derive(Clone, Copy)]
pub struct HostKind(&'static HostClosure);

impl HostKind {
    /// Makes a closure out of a signature and what it does. `taken` are the forms it must not be mistaken for.
    pub(crate) fn register(
        mut spec: ClosureSpec,
        lobe: Box<dyn HostLobe>,
        taken: impl Iterator<Item = Form>,
    ) -> Result<HostKind, RegisterError> {
        if !is_name(&spec.name) {
            return Err(RegisterError::BadName(spec.name));
        }
        if let Some(wrong) = spec.wrong {
            return Err(wrong);
        }
        let values = spec.params.iter().map(|p| p.ty.slots()).sum();
        if values > MAX_VALUES {
            return Err(RegisterError::TooManyValues(values));
        }
        // Keywords last, as every form has them.
        spec.params.sort_by_key(|p| p.keyword);
        let types = |params: &[ParamSpec]| params.iter().filter(|p| !p.keyword).map(|p| p.ty).collect::<Vec<_>>();
        if taken.into_iter().any(|f| f.name == spec.name && types(f.params) == types(&spec.params)) {
            return Err(RegisterError::Taken(spec.name));
        }
        let params: &'static [ParamSpec] = spec.params.leak();
        let spec_of = LobeSpec {
            name: spec.name.leak(),
            params,
            layout: Layout::of(params),
            doc: spec.doc.leak(),
            source: spec.source.leak(),
            reciprocal: spec.reciprocal,
            class: LobeClass::Scatter,
            note: "",
        };
        /// So that tools that look for leaks find all of them held.
        static KEPT: Mutex<Vec<HostKind>> = Mutex::new(Vec::new());
        let kind = HostKind(Box::leak(Box::new(HostClosure { spec: spec_of, most: spec.most, lobe })));
        KEPT.lock().unwrap_or_else(PoisonError::into_inner).push(kind);
        Ok(kind)
    }

    /// A closure with the signature of a built-in one.
    pub(crate) fn in_place_of(spec: &'static LobeSpec, lobe: Box<dyn HostLobe>) -> HostKind {
        let LobeSpec { name, params, doc, source, reciprocal, layout, .. } = *spec;
        let spec = LobeSpec { name, params, doc, source, reciprocal, class: LobeClass::Scatter, note: "", layout };
        HostKind(Box::leak(Box::new(HostClosure { spec, most: 1.0, lobe })))
    }

    /// Its declaration.
    pub fn spec(self) -> &'static LobeSpec {
        &self.0.spec
    }

    /// The bound on its albedo over all parameters and directions.
    pub fn albedo_at_most(self) -> f32 {
        self.0.most
    }

    /// How scripts call it.
    pub(crate) fn form(self) -> Form {
        Form::of_lobe(LobeKind::Host(self), self.spec())
    }
}

impl PartialEq for HostKind {
    fn eq(&self, o: &Self) -> bool {
        std::ptr::eq(self.0, o.0)
    }
}

impl Eq for HostKind {}

impl Hash for HostKind {
    fn hash<H: Hasher>(&self, state: &mut H) {
        std::ptr::from_ref(self.0).hash(state);
    }
}

impl fmt::Debug for HostKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "HostKind({})", self.0.spec.name)
    }
}

/// A host's lobe prepared for one ωo.
#[derive(Clone, Copy, Debug)]
pub struct Host<S> {
    values: [f32; MAX_VALUES],
    seen: HostSeen<S>,
}

/// What of a [`Host`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct HostSeen<S> {
    kind: HostKind,
    wo: V3<S>,
}

impl<S> HostSeen<S> {
    /// What it is.
    pub(super) fn kind(&self) -> HostKind {
        self.kind
    }
}

keeps_seen!(Host, HostSeen);

fn sane(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x } else { 0.0 }
}

impl<S: Real> Host<S> {
    /// Prepares the lobe; `slots` is its parameter block.
    pub(super) fn prepare(kind: HostKind, slots: &[f32], wo: V3<S>) -> Self {
        let mut values = [0.0; MAX_VALUES];
        let mut at = 0;
        for p in kind.spec().params {
            for k in 0..p.ty.slots() {
                values[at] = p.clamp(k, slots.get(at).copied().unwrap_or(f32::NAN));
                at += 1;
            }
        }
        Host { values, seen: HostSeen { kind, wo } }
    }

    fn bound_at(&self, w: [f64; 3]) -> [f64; 3] {
        self.seen.kind.0.lobe.albedo_bound(&self.values, w).map(sane)
    }

    /// Calls `f` with ωo and ωi, lane by lane.
    #[inline(always)]
    fn lanes<L: Over<S>>(&self, wi: V3<L>, f: impl Fn([f64; 3], [f64; 3]) -> [f64; 3]) -> [L; 3] {
        let wo = V3::<L>::lift(self.seen.wo);
        L::by_lane([wo.x, wo.y, wo.z, wi.x, wi.y, wi.z], |[a, b, c, x, y, z]| f([a, b, c], [x, y, z]))
    }
}

impl<S: Real> Host<S> {
    #[inline(never)]
    pub(super) fn evaluate(&self, wi: V3<S>, bound: bool) -> Evaluated<S> {
        let bound = if bound { self.albedo_bound(wi) } else { [S::zero(); 3] };
        Evaluated { f: self.f(wi), pdf: self.pdf(wi), bound }
    }

    /// See [`super::Lobe::f`].
    #[inline(always)]
    pub fn f<L: Over<S>>(&self, wi: V3<L>) -> Rgb<L> {
        self.lanes(wi, |wo, wi| {
            let f = self.seen.kind.0.lobe.f(&self.values, wo, wi).map(sane);
            let (o, i) = (self.bound_at(wo), self.bound_at(wi));
            std::array::from_fn(|c| f[c] / o[c].max(i[c]).max(1.0))
        })
    }

    /// See [`super::Lobe::pdf`].
    #[inline(always)]
    pub fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.lanes(wi, |wo, wi| [sane(self.seen.kind.0.lobe.pdf(&self.values, wo, wi)), 0.0, 0.0])[0]
    }

    /// See [`super::Lobe::sample`].
    pub fn sample(&self, u: [S; 2]) -> V3<S> {
        let wo = self.seen.wo;
        let [x, y, z] = S::by_lane([wo.x, wo.y, wo.z, u[0], u[1]], |[a, b, c, u, v]| {
            self.seen.kind.0.lobe.sample(&self.values, [a, b, c], [u, v])
        });
        V3::new(x, y, z)
    }

    /// See [`super::Lobe::sides`].
    pub fn sides(&self) -> Sides {
        self.seen.kind.0.lobe.sides()
    }

    /// See [`super::Lobe::roughness`].
    pub fn roughness(&self) -> S {
        S::c(sane(self.seen.kind.0.lobe.roughness(&self.values)).min(1.0))
    }

    /// See [`super::Lobe::albedo`].
    pub fn albedo(&self, w: V3<S>) -> Rgb<S> {
        S::by_lane([w.x, w.y, w.z], |w| {
            let bound = self.bound_at(w);
            let albedo = self.seen.kind.0.lobe.albedo(&self.values, w).map(sane);
            std::array::from_fn(|c| albedo[c].min(bound[c]).min(1.0))
        })
    }

    /// See [`super::Lobe::albedo_bound`].
    #[inline(always)]
    pub fn albedo_bound<L: Over<S>>(&self, w: V3<L>) -> Rgb<L> {
        L::by_lane([w.x, w.y, w.z], |w| self.bound_at(w).map(|e| e.min(1.0)))
    }
}
