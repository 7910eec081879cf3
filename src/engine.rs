//! The way a host goes through the library: [`Engine`] → [`Shader`] → [`Material`] → [`Bsdf`].
//!
//! An engine holds the choices that are the same for a whole scene. It compiles text to a shader; a shader with its
//! parameters set becomes a material, and only then are the albedo tables baked, for the lobes that are left. A
//! material is shared between threads and shaded point by point; shading never bakes.

use crate::Globals;
use crate::albedo::Precision;
use crate::closure::{Bsdf, ClosureTree, Curves, Layering, LayeringRule, TintRule, flatten};
use crate::diag::{Diagnostic, render_all};
use crate::ir::{self, CheckedShader, ParamDecl, Program, Site, Value};
use crate::optics::{Scalar, V3};
use crate::span::Source;
use glam::Vec3;
use std::fmt;
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
    fn precision(self) -> Precision {
        match self {
            Tier::Fast => Precision::FAST,
            Tier::Standard | Tier::Reference => Precision::STANDARD,
        }
    }
}

/// Compiles scripts. Cheap to make and to copy.
///
/// ```
/// use overcoat::{Engine, Globals};
/// let shader = Engine::new().compile("velvet", "Ci = sheen(color(0.6, 0, 0.05) * diffuse(N), N, 1, 0.3);")?;
/// let material = shader.material(&[])?;
/// let bsdf = material.shade(&Globals::default(), glam::Vec3::Z)?;
/// assert!(bsdf.eval([0.0, 0.6, 0.8]).f_cos[0] > 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Engine {
    tier: Tier,
    layering: Layering,
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

    /// Chooses how layers scale what lies below them.
    pub fn layering(self, rule: LayeringRule) -> Self {
        Engine { layering: Layering { rule, ..self.layering }, ..self }
    }

    /// Chooses which channels of a top's albedo a layer answers to.
    pub fn tint_rule(self, tint: TintRule) -> Self {
        Engine { layering: Layering { tint, ..self.layering }, ..self }
    }

    pub(crate) fn layering_of(&self) -> Layering {
        self.layering
    }

    /// Compiles a script. `name` names it in messages, and the shader if the script does not.
    ///
    /// # Errors
    /// Everything that is wrong with the script, with its places.
    pub fn compile(&self, name: &str, text: &str) -> Result<Shader, ScriptError> {
        let source = Arc::new(Source::new(name, text));
        match ir::compile(name, text) {
            Ok((checked, warnings)) => Ok(Shader { engine: *self, source, checked: Arc::new(checked), warnings }),
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

    pub(crate) fn engine(&self) -> Engine {
        self.engine
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
        Ok(self.finished(program))
    }

    /// The material with every parameter left open, read at every point: what specialising is measured against.
    pub fn unspecialised(&self) -> Material {
        self.finished(self.checked.unspecialised())
    }

    fn finished(&self, program: Program) -> Material {
        let start = Instant::now();
        let curves = bake(program.sites(), self.engine.tier.precision());
        let inner = Inner {
            engine: self.engine,
            name: self.name().to_owned(),
            program,
            curves,
            baked_in: start.elapsed(),
            reference: OnceLock::new(),
        };
        let material = Material { inner: Arc::new(inner) };
        if self.engine.tier == Tier::Reference {
            material.reference_curves();
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
    engine: Engine,
    name: String,
    program: Program,
    curves: Curves<f32>,
    baked_in: Duration,
    reference: OnceLock<Curves<f64>>,
}

impl Material {
    /// The name of the shader it came from.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// The tier of the engine that made it.
    pub fn tier(&self) -> Tier {
        self.inner.engine.tier
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
        self.flattened(globals, V3::from_f32(wo.to_array()), &self.inner.curves)
    }

    /// [`shade`](Self::shade) in double precision, with the reference tier's albedos. They are baked on the first call
    /// unless the engine's tier is [`Tier::Reference`].
    ///
    /// # Errors
    /// If the closure tree goes beyond a budget.
    pub fn shade_reference(&self, globals: &Globals, wo: [f64; 3]) -> Result<Bsdf<'_, f64>, ShadeError> {
        self.flattened(globals, V3::new(wo[0], wo[1], wo[2]), self.reference_curves())
    }

    fn flattened<'m, S: Scalar>(
        &'m self,
        globals: &Globals,
        wo: V3<S>,
        curves: &'m Curves<S>,
    ) -> Result<Bsdf<'m, S>, ShadeError> {
        let i = wo.map(|x| -x.to_f32());
        let globals = Globals { i: Vec3::new(i.x, i.y, i.z), ..*globals };
        let tree = self.tree(&globals)?;
        flatten(&tree, &globals, wo, self.inner.engine.layering, curves)
    }

    fn reference_curves(&self) -> &Curves<f64> {
        self.inner.reference.get_or_init(|| bake(self.inner.program.sites(), Precision::REFERENCE))
    }

    /// How long baking the albedo tables took.
    pub fn bake_time(&self) -> Duration {
        self.inner.baked_in
    }

    /// Memory the albedo tables take.
    pub fn table_bytes(&self) -> usize {
        self.inner.curves.bytes() + self.inner.reference.get().map_or(0, Curves::bytes)
    }
}

fn bake<S: Scalar>(sites: &[Site], precision: Precision) -> Curves<S> {
    let mut curves = Curves::default();
    for (index, site) in sites.iter().enumerate() {
        curves.set(index as u32, site.kind.table(&site.values), precision);
    }
    curves
}

/// What is wrong with a script.
#[derive(Clone, Debug)]
pub struct ScriptError {
    /// The script.
    pub source: Arc<Source>,
    /// All that is wrong, with places.
    pub diagnostics: Vec<Diagnostic>,
}

impl ScriptError {
    /// The messages with their source lines; `color` adds terminal colours.
    pub fn render(&self, color: bool) -> String {
        render_all(&self.diagnostics, &self.source, color)
    }
}

impl fmt::Display for ScriptError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for ScriptError {}

pub use crate::ir::ShadeError;
