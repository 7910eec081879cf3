//! The way a host goes through the library: [`Engine`] → [`Shader`] → [`Material`] → [`Bsdf`].
//!
//! An engine holds the choices that are the same for a whole scene. It compiles text to a shader; a shader with its
//! parameters set becomes a material, and only then are the albedo tables baked, for the lobes that are left. A
//! material is shared between threads and shaded point by point; shading never bakes.

mod baked;
mod error;
mod owned;
mod parts;
#[cfg(test)]
mod tests;
mod values;

pub use crate::closure::Scratch;
pub use crate::ir::ShadeError;
pub use error::{Error, Place, ScriptError};
pub use owned::OwnedBsdf;

use self::baked::Baked;
use crate::Globals;
use crate::albedo::Precision;
use crate::closure::{
    Balance, Bsdf, Bsdfs, Builder, ClosureTree, Layering, LayeringRule, TableCache, Tables, TintRule, flatten,
    flatten_into,
};
use crate::diag::Diagnostic;
use crate::ir::{self, Batch, CheckedShader, Host, ParamDecl, Program, Value};
use crate::lobes::host::{ClosureSpec, HostKind, HostLobe, RegisterError};
use crate::lobes::registry::{Build, ClosureParams, Form};
use crate::lobes::subsurface::{self, SubsurfaceParams};
use crate::lobes::{self, LobeKind};
use crate::optics::{Scalar, V3, dispatch};
use crate::span::Source;
use crate::syntax::{Includes, Limits, Options};
use glam::Vec3;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// What speed is traded for. The model is the same in every tier, and every tier conserves energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tier {
    /// `f32`, small tables: albedos within 1e-2 of the reference.
    Fast,
    /// `f32`: albedos within 1e-3 of the reference.
    #[default]
    Standard,
    /// `f64` throughout, with finely integrated albedos: [`Material::shade_reference`].
    Reference,
}

impl Tier {
    /// How finely the tables of the single precision path are baked.
    pub fn precision(self) -> Precision {
        match self {
            Tier::Fast => Precision::FAST,
            Tier::Standard | Tier::Reference => Precision::STANDARD,
        }
    }
}

/// Compiles scripts. Holds what is the same for a whole scene: tier, layering rule, closures of the host, where
/// included files and textures come from. Cheap to clone; clones share the albedo tables that their materials bake, for
/// as long as a material uses them. Any thread may use it.
///
/// ```
/// # #[cfg(feature = "cloth")] {
/// use overcoat::{Engine, Globals};
/// let shader = Engine::new().compile("velvet", "Ci = sheen(color(0.6, 0, 0.05) * diffuse(N), N, 1, 0.3);")?;
/// let material = shader.material(&[])?;
/// let bsdf = material.shade(&Globals::default(), glam::Vec3::Z)?;
/// assert!(bsdf.eval([0.0, 0.6, 0.8]).f_cos[0] > 0.1);
/// # }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Engine {
    tier: Tier,
    /// In place of what the tier asks for.
    precision: Option<Precision>,
    layering: Layering,
    /// Closures of the host, as scripts call them.
    hosts: Arc<[Form]>,
    options: Options,
    host: Option<Arc<dyn Host>>,
    caches: Arc<Caches>,
}

/// Tables in use by materials of an engine and its clones.
#[derive(Debug, Default)]
struct Caches {
    single: Arc<TableCache<f32>>,
    double: TableCache<f64>,
}

impl Engine {
    /// The standard tier, layers scaled by the smaller α.
    pub fn new() -> Self {
        Engine::default()
    }

    /// Chooses the tier of the materials made from here on.
    pub fn tier(self, tier: Tier) -> Self {
        Engine { tier, ..self }
    }

    /// Chooses how finely the tables of the single precision path are baked, in place of what the tier asks for. Coarser
    /// ones are smaller and lose more; none gains.
    pub fn precision(self, precision: Precision) -> Self {
        Engine { precision: Some(precision), ..self }
    }

    fn precision_of(&self) -> Precision {
        self.precision.unwrap_or(self.tier.precision())
    }

    /// Chooses how layers scale what lies below them.
    pub fn layering(self, rule: LayeringRule) -> Self {
        Engine { layering: Layering { rule, ..self.layering }, ..self }
    }

    /// Chooses which channels of a top's albedo a layer answers to.
    pub fn tint_rule(self, tint: TintRule) -> Self {
        Engine { layering: Layering { tint, ..self.layering }, ..self }
    }

    /// Lets scripts call a closure that the host brings along. It is kept until the process ends, so register once, not
    /// per scene.
    ///
    /// ```
    /// use overcoat::Engine;
    /// use overcoat::lobes::host::{ClosureSpec, HostLobe};
    ///
    /// /// A flat fuzz: f = w/π on the normal's side.
    /// struct Fuzz;
    /// impl HostLobe for Fuzz {
    ///     fn f(&self, values: &[f32], wo: [f64; 3], wi: [f64; 3]) -> [f64; 3] {
    ///         let above = wo[2] > 0.0 && wi[2] > 0.0;
    ///         [if above { f64::from(values[3]) / std::f64::consts::PI } else { 0.0 }; 3]
    ///     }
    ///     fn albedo_bound(&self, values: &[f32], w: [f64; 3]) -> [f64; 3] {
    ///         [if w[2] > 0.0 { f64::from(values[3]) } else { 0.0 }; 3]
    ///     }
    /// }
    ///
    /// let spec = ClosureSpec::new("fuzz").normal("N", "Shading normal.").float("w", 0.5, 0.0..=1.0, "Albedo.");
    /// let engine = Engine::new().register(spec, Fuzz)?;
    /// let shader = engine.compile("dusty", "Ci = layer(fuzz(N, 0.3), diffuse(N));")?;
    /// # let _ = shader;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// If the signature is malformed, or taken.
    pub fn register(self, spec: ClosureSpec, lobe: impl HostLobe + 'static) -> Result<Self, RegisterError> {
        let taken = lobes::forms().chain(self.hosts.iter().copied());
        let kind = HostKind::register(spec, Box::new(lobe), taken)?;
        let hosts = self.hosts.iter().copied().chain([kind.form()]).collect();
        Ok(Engine { hosts, ..self })
    }

    /// Takes over what scripts ask to be scattered below the surface: `subsurface_bssrdf`, `subsurface` and `bssrdf` become
    /// this lobe, in place of a diffuse one of the same albedo. Its values are N, albedo, radius (a color), anisotropy and
    /// the index of refraction, as `overcoat lobes subsurface_bssrdf` lists them; f is what it makes of them at a point.
    /// A renderer that walks through the object itself needs none: it reads [`Bsdf::subsurface`].
    pub fn subsurface(self, lobe: impl HostLobe + 'static) -> Self {
        let kind = HostKind::in_place_of(SubsurfaceParams::SPEC, Box::new(lobe));
        let forms = std::iter::once(kind.form()).chain(subsurface::forms(LobeKind::Host(kind), ""));
        let hosts = forms.chain(self.hosts.iter().copied()).collect();
        Engine { hosts, ..self }
    }

    /// Sets the budgets of scripts.
    pub fn limits(mut self, limits: Limits) -> Self {
        self.options.limits = limits;
        self
    }

    /// Chooses where `#include` finds files that are not built in: for example [`Directories`](crate::syntax::Directories).
    pub fn includes(mut self, includes: impl Includes + 'static) -> Self {
        self.options.includes = Some(Arc::new(includes));
        self
    }

    /// Defines a macro before the first line of every script.
    pub fn define(mut self, name: impl Into<String>, text: impl Into<String>) -> Self {
        self.options.defines.push((name.into(), text.into()));
        self
    }

    /// Lets scripts ask the host: for textures, attributes, spaces, kinds of rays, and to print.
    ///
    /// ```
    /// use overcoat::{Engine, Globals, ir::{Host, Lookup}};
    /// struct Gray;
    /// impl Host for Gray {
    ///     fn texture(&self, lookup: &Lookup, _: &Globals) -> Option<[f32; 4]> {
    ///         Some([lookup.s, lookup.t, 0.5, 1.0])
    ///     }
    /// }
    /// let shader = Engine::new().host(Gray).compile("a", "Ci = (color)texture(\"a.png\", 0.25, v) * diffuse(N);")?;
    /// let tree = shader.material(&[])?.tree(&Globals::default())?;
    /// assert_eq!(tree.size(tree.root()).lobes, 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn host(self, host: impl Host + 'static) -> Self {
        Engine { host: Some(Arc::new(host)), ..self }
    }

    pub(crate) fn layering_of(&self) -> Layering {
        self.layering
    }

    /// Compiles a script and makes a material with every parameter at its default: [`compile`](Self::compile), then
    /// [`Shader::material`].
    ///
    /// # Errors
    /// Everything that is wrong with the script, with its places.
    pub fn material(&self, name: &str, text: &str) -> Result<Material, ScriptError> {
        self.compile(name, text)?.material(&[])
    }

    /// Builds closure trees in code, without a script, from the built-in closures and those registered here, with this
    /// engine's tier and layering rule.
    pub fn builder(&self) -> Builder {
        let hosts = self.hosts.iter().filter_map(|form| match form.build {
            Build::Lobe { kind, .. } => Some(kind),
            Build::Wrap { .. } | Build::Tinted { .. } | Build::Layer => None,
        });
        let builder = Builder::new().layering(self.layering).precision(self.precision_of());
        builder.known(hosts, self.caches.single.clone())
    }

    /// Compiles a script. `name` names it in messages, and the shader if the script does not.
    ///
    /// # Errors
    /// Everything that is wrong with the script, with its places.
    pub fn compile(&self, name: &str, text: &str) -> Result<Shader, ScriptError> {
        let source = Arc::new(Source::new(name, text));
        match ir::compile_with(name, text, &self.hosts, &self.options, self.host.clone()) {
            Ok((checked, warnings)) => {
                Ok(Shader { engine: self.clone(), source, checked: Arc::new(checked), warnings })
            }
            Err(diagnostics) => Err(ScriptError { source, diagnostics }),
        }
    }
}

/// A script without mistakes: parameters with defaults, waiting to be set.
#[derive(Clone, Debug)]
pub struct Shader {
    engine: Engine,
    source: Arc<Source>,
    checked: Arc<CheckedShader>,
    warnings: Vec<Diagnostic>,
}

impl Shader {
    /// Its name; the script’s file name if the script does not name it.
    pub fn name(&self) -> &str {
        self.checked.name()
    }

    /// The declared parameters, in order.
    pub fn params(&self) -> &[ParamDecl] {
        self.checked.params()
    }

    pub(crate) fn engine(&self) -> &Engine {
        &self.engine
    }

    pub(crate) fn checked(&self) -> &CheckedShader {
        &self.checked
    }

    /// The script, for showing messages.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// What looked wrong while compiling and is not an error.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }

    /// Sets parameters, folds the script to what is left, and bakes the albedo tables it needs.
    ///
    /// # Errors
    /// Unknown parameters and values of the wrong type.
    pub fn material(&self, set: &[(String, Value)]) -> Result<Material, ScriptError> {
        let program = self
            .checked
            .specialise(set)
            .map_err(|diagnostics| ScriptError { source: self.source.clone(), diagnostics })?;
        Ok(self.finished(program, set))
    }

    /// The material with every parameter left open, read at every point: what specialising is measured against.
    pub fn unspecialised(&self) -> Material {
        self.finished(self.checked.unspecialised(), &[])
    }

    fn finished(&self, program: Program, set: &[(String, Value)]) -> Material {
        let start = Instant::now();
        let engine = &self.engine;
        let tables = Baked::new(&program, engine.layering, engine.precision_of(), &engine.caches.single);
        program.kept();
        let inner = Inner {
            shader: self.clone(),
            set: set.to_vec(),
            program,
            tables,
            baked_in: start.elapsed(),
            reference: OnceLock::new(),
        };
        let material = Material { inner: Arc::new(inner) };
        if self.engine.tier == Tier::Reference {
            material.reference_tables();
        }
        material
    }
}

/// A specialised shader, ready to be shaded from any number of threads. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Material {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    shader: Shader,
    set: Vec<(String, Value)>,
    program: Program,
    tables: Baked<f32>,
    baked_in: Duration,
    reference: OnceLock<Baked<f64>>,
}

impl Material {
    /// The name of the shader it came from.
    pub fn name(&self) -> &str {
        self.shader().name()
    }

    /// The shader it came from: what parameters there are.
    pub fn shader(&self) -> &Shader {
        &self.inner.shader
    }

    /// Sets one more parameter; those set before keep their values. Specialises again, and bakes tables that no other
    /// material of the engine holds: a matter of once per edit, not per point. Clones made before stay as they were.
    ///
    /// ```
    /// use overcoat::{Engine, Globals};
    /// let red = Engine::new().material("a", "surface a(color c = color(1, 0, 0)) { Ci = c * diffuse(N); }")?;
    /// let mut blue = red.clone();
    /// blue.set("c", [0.0, 0.0, 1.0])?;
    /// assert_eq!(blue.shade(&Globals::default(), glam::Vec3::Z)?.albedo(), [0.0, 0.0, 1.0]);
    /// assert!(blue.set("d", 0.5).unwrap_err().to_string().contains("no parameter `d`"));
    /// # Ok::<(), overcoat::Error>(())
    /// ```
    ///
    /// # Errors
    /// An unknown parameter (E0401), a value of the wrong type (E0402), an unknown word; the material stays as it was.
    pub fn set(&mut self, name: &str, value: impl Into<Value>) -> Result<(), ScriptError> {
        self.set_all([(name, value.into())])
    }

    /// [`set`](Self::set) for several parameters at the price of one.
    ///
    /// # Errors
    /// As for [`set`](Self::set), all at once.
    pub fn set_all<'n>(&mut self, set: impl IntoIterator<Item = (&'n str, Value)>) -> Result<(), ScriptError> {
        let mut all = self.inner.set.clone();
        for (name, value) in set {
            all.retain(|(n, _)| n != name);
            all.push((name.to_owned(), value));
        }
        *self = self.shader().material(&all)?;
        Ok(())
    }

    /// Whether `other` is a clone of this one: they share their tables.
    pub fn is_same(&self, other: &Material) -> bool {
        Arc::ptr_eq(&self.inner, &other.inner)
    }

    fn engine(&self) -> &Engine {
        &self.inner.shader.engine
    }

    /// The tier of the engine that made it.
    pub fn tier(&self) -> Tier {
        self.engine().tier
    }

    /// How its layers scale.
    pub fn layering(&self) -> Layering {
        self.engine().layering
    }

    /// The parameters that were set, and to what.
    pub fn params(&self) -> &[(String, Value)] {
        &self.inner.set
    }

    /// What looked wrong while specialising and is not an error.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.inner.program.warnings
    }

    /// The compiled script: which globals it reads, which lobes it can construct.
    pub fn program(&self) -> &Program {
        &self.inner.program
    }

    /// The closure tree the script leaves at a point. `globals.i` is taken as it is.
    ///
    /// # Errors
    /// If the tree goes beyond a budget.
    pub fn tree(&self, globals: &Globals) -> Result<ClosureTree, ShadeError> {
        let mut tree = ClosureTree::new();
        self.inner.program.shade(globals, &mut tree)?;
        Ok(tree)
    }

    /// The BSDF at a point seen from `wo` (world space, unit, away from the surface). `globals.i` is replaced by −ωo.
    ///
    /// # Errors
    /// If the closure tree goes beyond a budget.
    pub fn shade(&self, globals: &Globals, wo: Vec3) -> Result<Bsdf<'_>, ShadeError> {
        self.flattened(globals, V3::from_f32(wo.to_array()), &self.inner.tables)
    }

    /// [`shade`](Self::shade) into memory that is used again. The BSDF lives until the next use of `scratch`.
    ///
    /// # Errors
    /// If the closure tree goes beyond a budget; the BSDF in `scratch` is then black.
    #[inline]
    pub fn shade_in<'m, 's>(
        &'m self,
        globals: &Globals,
        wo: Vec3,
        scratch: &'s mut Scratch<'m>,
    ) -> Result<&'s Bsdf<'m>, ShadeError> {
        let Scratch { tree, bsdf } = scratch;
        self.shade_with(globals, wo, tree, bsdf)?;
        Ok(bsdf)
    }

    #[inline(always)]
    fn shade_with<'m>(
        &'m self,
        globals: &Globals,
        wo: Vec3,
        tree: &mut ClosureTree,
        bsdf: &mut Bsdf<'m>,
    ) -> Result<(), ShadeError> {
        let Baked { curves, plan, .. } = &self.inner.tables;
        let wo = V3::from_f32(wo.to_array());
        match plan {
            Some(plan) => {
                plan.turn(globals, wo, curves, bsdf);
                Ok(())
            }
            None => self.shade_tree(globals, wo, tree, bsdf),
        }
    }

    /// By the program and its tree. Apart, so that a plan is a short way off.
    #[inline(never)]
    fn shade_tree<'m>(
        &'m self,
        globals: &Globals,
        wo: V3<f32>,
        tree: &mut ClosureTree,
        bsdf: &mut Bsdf<'m>,
    ) -> Result<(), ShadeError> {
        let Baked { curves, balance, .. } = &self.inner.tables;
        let globals = Globals { i: -Vec3::new(wo.x, wo.y, wo.z), ..*globals };
        let shaded = self.inner.program.shade(&globals, tree);
        if shaded.is_err() {
            tree.clear();
        }
        let tables = Tables { curves, balance: balance.as_ref() };
        flatten_into(tree, &globals, wo, self.engine().layering, tables, bsdf)?;
        shaded
    }

    /// The BSDFs at many points, each seen from its `wo` as [`shade`](Self::shade) takes it. Where this material always makes
    /// the same tree, they stand side by side in vectors; see [`Bsdfs`]. There are as many as the shorter of the two has.
    ///
    /// # Errors
    /// If a closure tree goes beyond a budget; `bsdfs` is then empty.
    pub fn shade_many<'m>(
        &'m self,
        points: &[Globals],
        wo: &[[f32; 3]],
        bsdfs: &mut Bsdfs<'m>,
    ) -> Result<(), ShadeError> {
        let count = points.len().min(wo.len());
        let (points, wo) = (&points[..count], &wo[..count]);
        if let Some(plan) = self.inner.tables.plan.as_ref().filter(|_| dispatch::has_lanes()) {
            bsdfs.turn(plan, &self.inner.tables.curves, points, wo);
            return Ok(());
        }
        let (each, tree) = bsdfs.apart(count);
        let mut shade =
            |((globals, wo), bsdf): ((&Globals, &[f32; 3]), _)| self.shade_with(globals, (*wo).into(), tree, bsdf);
        let shaded = points.iter().zip(wo).zip(each).try_for_each(&mut shade);
        if shaded.is_err() {
            bsdfs.clear();
        }
        shaded
    }

    /// The closure trees at many points, several of them worked out side by side: less work per point than
    /// [`tree`](Self::tree), and the same trees bit for bit. Each point's `i` is taken as it is; set it to −ωo if
    /// [`bsdf`](Self::bsdf) is to follow.
    pub fn shade_batch(&self, points: &[Globals], batch: &mut Batch) {
        self.inner.program.shade_batch(points, batch);
    }

    /// The BSDF of a whole tree of this material – one of a batch – at its point, seen from −`globals.i`: what
    /// [`shade`](Self::shade) gives there.
    ///
    /// # Errors
    /// If the tree goes beyond a budget.
    pub fn bsdf(&self, tree: &ClosureTree, globals: &Globals) -> Result<Bsdf<'_>, ShadeError> {
        let tables = Tables { curves: &self.inner.tables.curves, balance: self.inner.tables.balance.as_ref() };
        let wo = V3::from_f32((-globals.i).to_array());
        Ok(flatten(tree, globals, wo, self.engine().layering, tables)?)
    }

    /// [`shade`](Self::shade) in double precision, with the reference tier's albedos. They are baked on the first call
    /// unless the engine's tier is [`Tier::Reference`].
    ///
    /// # Errors
    /// If the closure tree goes beyond a budget.
    pub fn shade_reference(&self, globals: &Globals, wo: [f64; 3]) -> Result<Bsdf<'_, f64>, ShadeError> {
        self.flattened(globals, V3::new(wo[0], wo[1], wo[2]), self.reference_tables())
    }

    fn flattened<'m, S: Scalar>(
        &'m self,
        globals: &Globals,
        wo: V3<S>,
        tables: &'m Baked<S>,
    ) -> Result<Bsdf<'m, S>, ShadeError> {
        if let Some(plan) = &tables.plan {
            // Written in place: a BSDF is too large to pass around.
            let mut shaded = Ok(Bsdf::black());
            if let Ok(bsdf) = &mut shaded {
                plan.turn(globals, wo, &tables.curves, bsdf);
            }
            return shaded;
        }
        let i = wo.map(|x| -x.to_f32());
        let globals = Globals { i: Vec3::new(i.x, i.y, i.z), ..*globals };
        // Written in place: a tree with room for a typical material is too large to pass around.
        let mut tree = ClosureTree::new();
        self.inner.program.shade(&globals, &mut tree)?;
        let tables = Tables { curves: &tables.curves, balance: tables.balance.as_ref() };
        // Likewise.
        let mut shaded = Ok(Bsdf::black());
        if let Ok(bsdf) = &mut shaded {
            flatten_into(&tree, &globals, wo, self.engine().layering, tables, bsdf)?;
        }
        shaded
    }

    fn reference_tables(&self) -> &Baked<f64> {
        let (layering, cache) = (self.layering(), &self.engine().caches.double);
        let bake = || Baked::new(&self.inner.program, layering, Precision::REFERENCE, cache);
        self.inner.reference.get_or_init(bake)
    }

    /// The scales solved for the `balanced` rule; `None` under other rules.
    pub fn balance(&self) -> Option<&Balance<f32>> {
        self.inner.tables.balance.as_ref()
    }

    /// How long baking the albedo tables took.
    pub fn bake_time(&self) -> Duration {
        self.inner.baked_in
    }

    /// Memory the albedo tables take.
    pub fn table_bytes(&self) -> usize {
        self.inner.tables.bytes() + self.inner.reference.get().map_or(0, Baked::bytes)
    }
}
