//! From arguments to materials, directions and values.

use super::host::CliHost;
use super::{Failure, Global, LayeringArg, TierArg, TintArg};
use crate::closure::{Bsdf, ClosureTree, LayeringRule, TintRule};
use crate::diag::Diagnostic;
use crate::engine::{Engine, Material, ShadeError, Shader, Tier};
use crate::globals::Globals;
use crate::ir::{ParamDecl, Ty, Value};
use crate::optics::{Scalar, V3, frame};
use crate::span::Source;
use crate::syntax::Directories;
use std::io::{IsTerminal, Read};
use std::path::Path;

impl Global {
    pub fn engine(&self) -> Engine {
        let tier = self.tier().unwrap_or_default();
        let rule = match self.layering {
            LayeringArg::Min => LayeringRule::Min,
            LayeringArg::Balanced => LayeringRule::Balanced,
            LayeringArg::View => LayeringRule::View,
        };
        let tint = match self.tint_rule {
            TintArg::Largest => TintRule::Largest,
            TintArg::Channel => TintRule::Channel,
        };
        Engine::new().tier(tier).layering(rule).tint_rule(tint)
    }

    /// The engine for the script at `path`, with its files and pictures at hand.
    pub fn engine_for(&self, path: &Path) -> Engine {
        let host = CliHost::new(path, &self.include, self.quiet);
        self.engine().includes(Directories(self.include.clone())).host(host)
    }

    /// The tier, if one is asked for.
    pub fn tier(&self) -> Option<Tier> {
        self.tier.map(|tier| match tier {
            TierArg::Fast => Tier::Fast,
            TierArg::Standard => Tier::Standard,
            TierArg::Reference => Tier::Reference,
        })
    }

    /// Compiles the script at `path` with the parameters of `--set`, then those of `more`.
    pub fn material(&self, path: &Path, more: &[(String, String)]) -> Result<Material, Failure> {
        let shader = self.shader(path)?;
        self.specialise(&shader, more)
    }

    /// Compiles the script at `path`, and says what it warns about.
    pub fn shader(&self, path: &Path) -> Result<Shader, Failure> {
        let (name, text) = read(path)?;
        let shader =
            self.engine_for(path).compile(&name, &text).map_err(|e| Failure::Script(e.render(stderr_has_color())))?;
        self.warn(shader.warnings(), shader.source());
        Ok(shader)
    }

    /// Sets the parameters of `--set`, then those of `more`.
    pub fn specialise(&self, shader: &Shader, more: &[(String, String)]) -> Result<Material, Failure> {
        let values = self.values(shader, more)?;
        let material = shader.material(&values).map_err(|e| self.setting_failed(&e.diagnostics, shader.source()))?;
        self.warn(material.warnings(), shader.source());
        Ok(material)
    }

    /// The values of `--set`, then those of `more`, as the types the parameters have.
    pub fn values(&self, shader: &Shader, more: &[(String, String)]) -> Result<Vec<(String, Value)>, Failure> {
        let mut set = Vec::new();
        for given in &self.set {
            let (name, text) = name_and_value(given)?;
            set.push((name, text));
        }
        set.extend(more.iter().cloned());
        let mut values = Vec::new();
        for (name, text) in set {
            let value = match shader.params().iter().find(|p| p.name == name) {
                Some(param) => parse_value(param, &text)?,
                // The shader says what is wrong with the name.
                None => Value::String(text),
            };
            values.push((name, value));
        }
        Ok(values)
    }

    /// Wrong names and types in `--set` are wrong usage; anything else is the script's fault.
    pub fn setting_failed(&self, diagnostics: &[Diagnostic], source: &Source) -> Failure {
        if diagnostics.iter().all(|d| d.code.starts_with("E04")) {
            let lines = diagnostics.iter().map(|d| {
                let help = d.help.iter().map(|h| format!("; {h}")).collect::<String>();
                format!("--set: {}{help}", d.message)
            });
            return Failure::usage(lines.collect::<Vec<_>>().join("\n"));
        }
        Failure::Script(crate::diag::render_all(diagnostics, source, stderr_has_color()))
    }

    fn warn(&self, warnings: &[Diagnostic], source: &Source) {
        if !self.quiet && !warnings.is_empty() {
            eprintln!("{}", crate::diag::render_all(warnings, source, stderr_has_color()).trim_end());
        }
    }
}

impl From<ShadeError> for Failure {
    fn from(e: ShadeError) -> Failure {
        Failure::Script(format!("error: {e}"))
    }
}

pub fn stderr_has_color() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none()
}

/// The script's name for messages, and its text.
pub fn read(path: &Path) -> Result<(String, String), Failure> {
    let (name, bytes) = if path == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin().read_to_end(&mut bytes).map_err(|e| Failure::usage(format!("cannot read stdin: {e}")))?;
        ("stdin".to_owned(), bytes)
    } else {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|e| Failure::usage(format!("cannot read `{name}`: {e}")))?;
        (name, bytes)
    };
    match String::from_utf8(bytes) {
        Ok(text) => Ok((name, text)),
        Err(e) => {
            let valid = &e.as_bytes()[..e.utf8_error().valid_up_to()];
            let line = 1 + valid.iter().filter(|b| **b == b'\n').count();
            Err(Failure::Script(format!("error: `{name}` is not UTF-8 text: line {line} has a byte that is none")))
        }
    }
}

/// Splits `NAME=VALUE`.
pub fn name_and_value(given: &str) -> Result<(String, String), Failure> {
    match given.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => Ok((name.trim().to_owned(), value.to_owned())),
        _ => Err(Failure::usage(format!("`{given}`: expected NAME=VALUE, for example `roughness=0.4`"))),
    }
}

/// Reads a value as the type the parameter has.
pub fn parse_value(param: &ParamDecl, text: &str) -> Result<Value, Failure> {
    let wrong = |what: &str| Failure::usage(format!("`{}={text}`: `{}` is {what}", param.name, param.name));
    let numbers = || text.split(',').map(|t| t.trim().parse::<f32>()).collect::<Result<Vec<_>, _>>();
    match param.ty {
        Ty::String => Ok(Value::String(text.to_owned())),
        Ty::Int => text.trim().parse().map(Value::Int).map_err(|_| wrong("an int; give a whole number")),
        Ty::Float => text.trim().parse().map(Value::Float).map_err(|_| wrong("a float; give one number")),
        ty => match numbers().as_deref() {
            Ok([x]) => Ok(Value::Float(*x)),
            Ok([x, y, z]) => Ok(Value::Color([*x, *y, *z])),
            _ => Err(wrong(&format!("{}; give one number or three, as in `0.8,0.1,0.1`", ty.name()))),
        },
    }
}

/// A direction given as `x,y,z`, normalised.
pub fn direction(option: &str, text: &str) -> Result<[f64; 3], Failure> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|t| t.trim().parse::<f64>()).collect();
    let Ok([x, y, z]) = numbers.as_deref() else {
        return Err(Failure::usage(format!("{option} {text}: expected three numbers x,y,z")));
    };
    match frame::normalize(V3::new(*x, *y, *z)) {
        Some(v) => Ok([v.x, v.y, v.z]),
        None => Err(Failure::usage(format!("{option} {text}: a direction must be finite and not zero"))),
    }
}

/// The number type a tier works in, chosen once per command.
pub trait Evaluate: Scalar {
    /// The BSDF at the default point, seen from `wo`.
    fn shade<'m>(material: &'m Material, globals: &Globals, wo: [Self; 3]) -> Result<Bsdf<'m, Self>, ShadeError>;

    /// Shows `look` the BSDF of a part of the material's tree.
    fn with_part<R>(
        material: &Material,
        tree: &ClosureTree,
        globals: &Globals,
        wo: [Self; 3],
        look: impl FnOnce(&Bsdf<'_, Self>) -> R,
    ) -> Result<R, ShadeError>;
}

impl Evaluate for f32 {
    fn shade<'m>(material: &'m Material, globals: &Globals, wo: [f32; 3]) -> Result<Bsdf<'m, f32>, ShadeError> {
        material.shade(globals, wo.into())
    }

    fn with_part<R>(
        material: &Material,
        tree: &ClosureTree,
        globals: &Globals,
        wo: [f32; 3],
        look: impl FnOnce(&Bsdf<'_, f32>) -> R,
    ) -> Result<R, ShadeError> {
        material.with_part(tree, globals, wo.into(), look)
    }
}

impl Evaluate for f64 {
    fn shade<'m>(material: &'m Material, globals: &Globals, wo: [f64; 3]) -> Result<Bsdf<'m, f64>, ShadeError> {
        material.shade_reference(globals, wo)
    }

    fn with_part<R>(
        material: &Material,
        tree: &ClosureTree,
        globals: &Globals,
        wo: [f64; 3],
        look: impl FnOnce(&Bsdf<'_, f64>) -> R,
    ) -> Result<R, ShadeError> {
        material.with_part_reference(tree, globals, wo, look)
    }
}

/// Calls a function generic over [`Evaluate`] with the number type of the material's tier.
macro_rules! in_tier {
    ($material:expr, $function:ident ( $($arg:expr),* )) => {
        match $material.tier() {
            $crate::engine::Tier::Reference => $function::<f64>($($arg),*),
            _ => $function::<f32>($($arg),*),
        }
    };
}
pub(super) use in_tier;
