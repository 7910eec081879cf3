//! Closure trees built in code, for hosts whose materials are not scripts.
//!
//! A [`Builder`] takes closures, weights and layers once; [`Builder::finish`] bakes the albedo tables. The [`Composite`]
//! that results is shaded point by point, with values for whatever was declared as an [`Input`].

use super::balance::{Balance, Balancer};
use super::bsdf::Bsdf;
use super::flatten::{Curves, Layering, TableCache, Tables, flatten, flatten_into};
use super::layer::LayeringRule;
use super::scratch::Scratch;
use super::tree::{ClosureTree, NodeId, TreeError};
use crate::albedo::Precision;
use crate::globals::Globals;
use crate::lobes::registry::{ParamSpec, ParamTy, option_index};
use crate::lobes::{LobeKind, families};
use crate::optics::V3;
use glam::Vec3;
use smallvec::SmallVec;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A closure under construction; belongs to the builder that made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    builder: u64,
    index: u32,
}

/// A value that differs from point to point; belongs to the builder that made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    builder: u64,
    start: u32,
    width: u32,
}

/// A parameter of a closure, or a weight.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Arg {
    /// A number; for a color or a direction, in every component.
    Float(f32),
    /// Linear RGB, or a direction in world space.
    Triple([f32; 3]),
    /// One of the words of a string parameter.
    Word(String),
    /// Given when shading.
    Input(Input),
}

impl From<f32> for Arg {
    fn from(x: f32) -> Arg {
        Arg::Float(x)
    }
}

impl From<[f32; 3]> for Arg {
    fn from(x: [f32; 3]) -> Arg {
        Arg::Triple(x)
    }
}

impl From<Vec3> for Arg {
    fn from(x: Vec3) -> Arg {
        Arg::Triple(x.to_array())
    }
}

impl From<&str> for Arg {
    fn from(word: &str) -> Arg {
        Arg::Word(word.to_owned())
    }
}

impl From<Input> for Arg {
    fn from(input: Input) -> Arg {
        Arg::Input(input)
    }
}

/// Why a tree cannot be built.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BuildError {
    /// No closure of this name is built in or registered.
    UnknownClosure(String),
    /// The closure belongs to a family of lobes that this build was made without.
    LeftOut {
        /// The closure.
        closure: String,
        /// The cargo feature that brings it.
        feature: &'static str,
    },
    /// The closure has no such parameter.
    UnknownParameter {
        /// The closure.
        closure: String,
        /// The parameter.
        name: String,
    },
    /// A value does not fit what it is given to.
    WrongValue {
        /// The closure; `weight` for weights.
        closure: String,
        /// The parameter.
        name: String,
        /// What fits.
        expected: String,
    },
    /// A part or an input of another builder.
    Foreign,
    /// The tree goes beyond a budget.
    Tree(TreeError),
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BuildError::UnknownClosure(name) => write!(f, "there is no closure `{name}`"),
            BuildError::LeftOut { closure, feature } => {
                write!(f, "the closure `{closure}` was left out of this build; the cargo feature `{feature}` brings it")
            }
            BuildError::UnknownParameter { closure, name } => write!(f, "`{closure}` has no parameter `{name}`"),
            BuildError::WrongValue { closure, name, expected } => {
                write!(f, "`{name}` of `{closure}` is not {expected}")
            }
            BuildError::Foreign => f.write_str("a part or an input of another builder"),
            BuildError::Tree(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for BuildError {}

impl From<TreeError> for BuildError {
    fn from(e: TreeError) -> BuildError {
        BuildError::Tree(e)
    }
}

/// Where three numbers come from when shading.
#[derive(Clone, Copy, Debug)]
enum From3 {
    Known([f32; 3]),
    Input(Input),
}

/// What fills a slot, or three, of a parameter block when shading.
#[derive(Clone, Copy, Debug)]
enum Open {
    Input(Input),
    Normal,
    Tangent,
}

#[derive(Clone, Debug)]
struct Site {
    kind: LobeKind,
    /// The parameter block; what is open holds zeros.
    block: SmallVec<[f32; 24]>,
    /// The first slot of what is open, how many slots, and what fills them.
    open: SmallVec<[(u32, u32, Open); 2]>,
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Zero,
    Lobe(u32),
    Add(u32, u32),
    Mul(From3, u32),
    Layer { top: u32, base: u32 },
}

/// Composes closures in code. Mistakes are kept and reported by [`finish`](Self::finish).
///
/// ```
/// # #[cfg(feature = "cloth")] {
/// use overcoat::closure::Builder;
/// use overcoat::Globals;
///
/// // Once per material.
/// let mut b = Builder::new();
/// let roughness = b.float(0.3);
/// let ground = b.lobe("diffuse", []);
/// let ground = b.mul([0.6, 0.02, 0.05], ground);
/// let fuzz = b.lobe("sheen_bsdf", [("roughness", roughness.into())]);
/// let cloth = b.layer(fuzz, ground);
/// let cloth = b.finish(cloth)?;
///
/// // Once per point.
/// let mut inputs = cloth.inputs();
/// inputs.set(roughness, 0.5)?;
/// let bsdf = cloth.shade(&Globals::default(), glam::Vec3::new(0.6, 0.0, 0.8), &inputs)?;
/// assert!(bsdf.eval([0.0, 0.6, 0.8]).f_cos[0] > 0.1);
/// # }
/// # Ok::<(), overcoat::Error>(())
/// ```
#[derive(Debug)]
pub struct Builder {
    id: u64,
    layering: Layering,
    precision: Precision,
    hosts: Vec<LobeKind>,
    cache: Arc<TableCache<f32>>,
    steps: Vec<Step>,
    sites: Vec<Site>,
    inputs: Vec<f32>,
    wrong: Option<BuildError>,
}

impl Default for Builder {
    fn default() -> Self {
        Builder::new()
    }
}

impl Builder {
    /// With the built-in closures, tables of the standard tier and the default layering.
    /// [`Engine::builder`](crate::Engine::builder) gives one with an engine's choices.
    pub fn new() -> Self {
        static LAST: AtomicU64 = AtomicU64::new(0);
        Builder {
            id: LAST.fetch_add(1, Ordering::Relaxed),
            layering: Layering::default(),
            precision: Precision::STANDARD,
            hosts: Vec::new(),
            cache: Arc::default(),
            steps: vec![Step::Zero],
            sites: Vec::new(),
            inputs: Vec::new(),
            wrong: None,
        }
    }

    /// Chooses how layers scale. [`LayeringRule::Balanced`] is solved for trees without inputs; others keep
    /// [`LayeringRule::Min`].
    #[must_use]
    pub fn layering(self, layering: Layering) -> Self {
        Builder { layering, ..self }
    }

    /// Chooses how finely tables are baked.
    #[must_use]
    pub fn precision(self, precision: Precision) -> Self {
        Builder { precision, ..self }
    }

    /// With closures of the host, and with tables shared with others.
    pub(crate) fn known(self, hosts: impl Iterator<Item = LobeKind>, cache: Arc<TableCache<f32>>) -> Self {
        Builder { hosts: hosts.collect(), cache, ..self }
    }

    /// A number that differs from point to point. `default` stands until it is set.
    pub fn float(&mut self, default: f32) -> Input {
        self.input(&[default])
    }

    /// A color (linear RGB) or a direction (world space) that differs from point to point.
    pub fn triple(&mut self, default: [f32; 3]) -> Input {
        self.input(&default)
    }

    fn input(&mut self, default: &[f32]) -> Input {
        let start = self.inputs.len() as u32;
        self.inputs.extend(default);
        Input { builder: self.id, start, width: default.len() as u32 }
    }

    /// The closure called `name` with these parameters; the rest have their documented defaults, normals are the shading
    /// point's N and tangents its ∂P/∂u. [`LobeKind::spec`] and `overcoat lobes` list names and ranges; values are
    /// clamped to their ranges.
    pub fn lobe<'a>(&mut self, name: &str, args: impl IntoIterator<Item = (&'a str, Arg)>) -> Part {
        let host = self.hosts.iter().copied().find(|k| k.spec().name == name);
        let Some(kind) = host.or_else(|| LobeKind::by_name(name)) else {
            let closure = name.to_owned();
            return self.refuse(match families::left_out(name) {
                Some(feature) => BuildError::LeftOut { closure, feature },
                None => BuildError::UnknownClosure(closure),
            });
        };
        let mut site = Site { kind, block: SmallVec::new(), open: SmallVec::new() };
        for p in kind.spec().params {
            let (at, width) = (site.block.len() as u32, p.ty.slots());
            site.block.extend((0..width).map(|k| p.default.get(k).copied().unwrap_or(0.0)));
            match p.ty {
                ParamTy::Normal => site.open.push((at, 3, Open::Normal)),
                ParamTy::Vector => site.open.push((at, 3, Open::Tangent)),
                _ => {}
            }
        }
        for (param, arg) in args {
            let found = kind.spec().params.iter().find(|p| p.name == param).zip(kind.spec().slot_of(param));
            let Some((p, at)) = found else {
                let (closure, name) = (name.to_owned(), param.to_owned());
                return self.refuse(BuildError::UnknownParameter { closure, name });
            };
            site.open.retain(|o| o.0 != at as u32);
            match self.numbers(p, &arg) {
                Ok(From3::Known(x)) => site.block[at..at + p.ty.slots()].copy_from_slice(&x[..p.ty.slots()]),
                Ok(From3::Input(i)) => site.open.push((at as u32, p.ty.slots() as u32, Open::Input(i))),
                Err(Some(expected)) => {
                    let (closure, name) = (name.to_owned(), param.to_owned());
                    return self.refuse(BuildError::WrongValue { closure, name, expected });
                }
                Err(None) => return self.refuse(BuildError::Foreign),
            }
        }
        self.sites.push(site);
        self.push(Step::Lobe(self.sites.len() as u32 - 1))
    }

    /// What an argument gives a parameter; otherwise what would fit, or `None` for what belongs to another builder.
    fn numbers(&self, p: &ParamSpec, arg: &Arg) -> Result<From3, Option<String>> {
        let expected = || {
            let words = p.options.join("`, `");
            match p.ty {
                ParamTy::String if p.options.is_empty() => "a word".to_owned(),
                ParamTy::String => format!("one of `{words}`"),
                ty => format!("a {}", ty.name()),
            }
        };
        match arg {
            Arg::Input(i) if i.builder != self.id => Err(None),
            Arg::Word(word) if p.ty == ParamTy::String => {
                let index = option_index(p.options, word).ok_or_else(|| Some(expected()))?;
                Ok(From3::Known([index as f32; 3]))
            }
            Arg::Word(_) => Err(Some(expected())),
            _ if p.ty == ParamTy::String => Err(Some(expected())),
            Arg::Input(i) if i.width as usize > p.ty.slots() => Err(Some(expected())),
            Arg::Triple(_) if p.ty.slots() < 3 => Err(Some(expected())),
            Arg::Input(i) => Ok(From3::Input(*i)),
            Arg::Float(x) => Ok(From3::Known([*x; 3])),
            Arg::Triple(x) => Ok(From3::Known(*x)),
        }
    }

    /// Black.
    pub fn zero(&self) -> Part {
        Part { builder: self.id, index: 0 }
    }

    /// a + b.
    pub fn add(&mut self, a: Part, b: Part) -> Part {
        match (self.own(a), self.own(b)) {
            (Some(a), Some(b)) => self.push(Step::Add(a, b)),
            _ => self.refuse(BuildError::Foreign),
        }
    }

    /// weight · c: a number, a color, or an input. Clamped per channel to [0, 1e30] when shading.
    pub fn mul(&mut self, weight: impl Into<Arg>, c: Part) -> Part {
        let weight = match weight.into() {
            Arg::Float(x) => From3::Known([x; 3]),
            Arg::Triple(x) => From3::Known(x),
            Arg::Input(i) if i.builder == self.id => From3::Input(i),
            Arg::Input(_) => return self.refuse(BuildError::Foreign),
            Arg::Word(name) => {
                let (closure, expected) = ("weight".to_owned(), "a number or a color".to_owned());
                return self.refuse(BuildError::WrongValue { closure, name, expected });
            }
        };
        match self.own(c) {
            Some(c) => self.push(Step::Mul(weight, c)),
            None => self.refuse(BuildError::Foreign),
        }
    }

    /// `top` over `base`, which gets what `top` passes on.
    pub fn layer(&mut self, top: Part, base: Part) -> Part {
        match (self.own(top), self.own(base)) {
            (Some(top), Some(base)) => self.push(Step::Layer { top, base }),
            _ => self.refuse(BuildError::Foreign),
        }
    }

    /// Bakes the tables of everything built so far, with `root` as what the surface does.
    ///
    /// # Errors
    /// The first mistake made while building, or a tree beyond a budget.
    pub fn finish(self, root: Part) -> Result<Composite, BuildError> {
        if let Some(wrong) = self.wrong {
            return Err(wrong);
        }
        let root = self.own(root).ok_or(BuildError::Foreign)?;
        let mut curves = Curves::default();
        for (index, site) in self.sites.iter().enumerate() {
            let mut known: Vec<Option<f32>> = site.block.iter().copied().map(Some).collect();
            for (at, count, _) in &site.open {
                known[*at as usize..(at + count) as usize].fill(None);
            }
            curves.prepare(index as u32, site.kind, &known, self.precision, &self.cache);
        }
        let Builder { id, layering, precision, steps, sites, inputs, .. } = self;
        let plan = Plan { id, layering, steps, sites, inputs, root, curves, balance: None };
        let mut composite = Composite { plan: Arc::new(plan) };
        let mut tree = ClosureTree::new();
        composite.tree(&Globals::apart(), &composite.inputs(), &mut tree);
        tree.within_budget()?;
        let plan = &composite.plan;
        if layering.rule == LayeringRule::Balanced && plan.inputs.is_empty() {
            let solved = Balancer::new(precision).solve(&tree, &Globals::apart(), layering.tint, &plan.curves);
            if let Some(plan) = Arc::get_mut(&mut composite.plan) {
                plan.balance = Some(solved);
            }
        }
        Ok(composite)
    }

    fn own(&self, part: Part) -> Option<u32> {
        (part.builder == self.id && (part.index as usize) < self.steps.len()).then_some(part.index)
    }

    fn push(&mut self, step: Step) -> Part {
        self.steps.push(step);
        Part { builder: self.id, index: self.steps.len() as u32 - 1 }
    }

    fn refuse(&mut self, wrong: BuildError) -> Part {
        self.wrong.get_or_insert(wrong);
        self.zero()
    }
}

/// Values for the inputs of a [`Composite`]: set them, shade, set them again.
#[derive(Clone, Debug)]
pub struct Inputs {
    builder: u64,
    values: SmallVec<[f32; 24]>,
}

impl Inputs {
    /// Sets an input: a number, or three for one made with [`Builder::triple`].
    ///
    /// # Errors
    /// An input of another builder, or a value of the wrong width.
    pub fn set(&mut self, input: Input, value: impl Into<Arg>) -> Result<(), BuildError> {
        let value = match (value.into(), input.width) {
            (Arg::Float(x), _) => [x; 3],
            (Arg::Triple(x), 3) => x,
            _ => {
                let expected = if input.width == 3 { "three numbers" } else { "a number" }.to_owned();
                let (closure, name) = ("inputs".to_owned(), "value".to_owned());
                return Err(BuildError::WrongValue { closure, name, expected });
            }
        };
        let range = input.start as usize..(input.start + input.width) as usize;
        let slots = self.values.get_mut(range).filter(|_| input.builder == self.builder).ok_or(BuildError::Foreign)?;
        slots.copy_from_slice(&value[..slots.len()]);
        Ok(())
    }

    fn triple(&self, from: From3) -> [f32; 3] {
        match from {
            From3::Known(x) => x,
            From3::Input(i) if i.width == 1 => [self.values[i.start as usize]; 3],
            From3::Input(i) => std::array::from_fn(|k| self.values[i.start as usize + k]),
        }
    }
}

#[derive(Debug)]
struct Plan {
    id: u64,
    layering: Layering,
    steps: Vec<Step>,
    sites: Vec<Site>,
    /// Defaults.
    inputs: Vec<f32>,
    root: u32,
    curves: Curves<f32>,
    balance: Option<Balance<f32>>,
}

/// A finished tree with its tables, ready to be shaded from any number of threads. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Composite {
    plan: Arc<Plan>,
}

impl Composite {
    /// The inputs at their defaults.
    pub fn inputs(&self) -> Inputs {
        Inputs { builder: self.plan.id, values: SmallVec::from_slice(&self.plan.inputs) }
    }

    /// The BSDF at a point seen from `wo` (world space, unit, away from the surface).
    ///
    /// # Errors
    /// `inputs` of another composite.
    pub fn shade(&self, globals: &Globals, wo: Vec3, inputs: &Inputs) -> Result<Bsdf<'_>, BuildError> {
        let mut tree = ClosureTree::new();
        self.checked_tree(globals, inputs, &mut tree)?;
        Ok(flatten(&tree, globals, V3::from_f32(wo.to_array()), self.plan.layering, self.tables())?)
    }

    /// [`shade`](Self::shade) into memory that is used again.
    ///
    /// # Errors
    /// `inputs` of another composite.
    pub fn shade_in<'m, 's>(
        &'m self,
        globals: &Globals,
        wo: Vec3,
        inputs: &Inputs,
        scratch: &'s mut Scratch<'m>,
    ) -> Result<&'s Bsdf<'m>, BuildError> {
        let Scratch { tree, bsdf } = scratch;
        self.checked_tree(globals, inputs, tree)?;
        flatten_into(tree, globals, V3::from_f32(wo.to_array()), self.plan.layering, self.tables(), bsdf)?;
        Ok(bsdf)
    }

    fn tables(&self) -> Tables<'_, f32> {
        Tables { curves: &self.plan.curves, balance: self.plan.balance.as_ref() }
    }

    fn checked_tree(&self, globals: &Globals, inputs: &Inputs, tree: &mut ClosureTree) -> Result<(), BuildError> {
        if inputs.builder != self.plan.id {
            return Err(BuildError::Foreign);
        }
        self.tree(globals, inputs, tree);
        Ok(())
    }

    fn tree(&self, globals: &Globals, inputs: &Inputs, tree: &mut ClosureTree) {
        tree.clear();
        let mut nodes: SmallVec<[NodeId; 40]> = SmallVec::new();
        let node = |nodes: &[NodeId], index: u32| nodes[index as usize];
        for step in &self.plan.steps {
            let made = match *step {
                Step::Zero => tree.zero(),
                Step::Add(a, b) => tree.add(node(&nodes, a), node(&nodes, b)),
                Step::Mul(weight, c) => tree.mul(inputs.triple(weight), node(&nodes, c)),
                Step::Layer { top, base } => tree.layer(node(&nodes, top), node(&nodes, base)),
                Step::Lobe(site) => {
                    let Site { kind, block, open } = &self.plan.sites[site as usize];
                    let filled = open.iter().flat_map(|(at, count, what)| {
                        let x = match what {
                            Open::Normal => globals.n.to_array(),
                            Open::Tangent => globals.dpdu.to_array(),
                            Open::Input(input) => inputs.triple(From3::Input(*input)),
                        };
                        (0..*count).map(move |k| (at + k, x[k as usize]))
                    });
                    tree.lobe_from(*kind, site, block, filled)
                }
            };
            nodes.push(made);
        }
        tree.set_root(node(&nodes, self.plan.root));
    }
}
