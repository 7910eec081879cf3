//! From what the page sends to a material.

use super::super::input::Evaluate;
use super::http::Refusal;
use super::told;
use crate::closure::LayeringRule;
use crate::diag::Diagnostic;
use crate::engine::{Engine, Material, Shader, Tier};
use crate::globals::Globals;
use crate::ir::{ParamDecl, Ty};
use crate::span::Source;
use serde_json::{Map, Value, json};

/// A script as it stands in the editor, and what its parameters are set to.
#[derive(Clone, PartialEq)]
pub struct Script {
    /// Its name relative to the opened folder; includes and textures are looked for beside it.
    pub file: String,
    pub text: String,
    /// Parameters that are moved from their defaults.
    pub set: Map<String, Value>,
    pub tier: Tier,
    pub layering: LayeringRule,
}

impl Script {
    pub fn read(body: &Value) -> Result<Script, Refusal> {
        let text = |key: &str| body[key].as_str().map(str::to_owned);
        let tier = match body["tier"].as_str() {
            Some("fast") => Tier::Fast,
            None | Some("standard") => Tier::Standard,
            Some("reference") => Tier::Reference,
            Some(other) => return Err(Refusal::bad(format!("there is no tier `{other}`"))),
        };
        let layering = match body["layering"].as_str() {
            None | Some("min") => LayeringRule::Min,
            Some("balanced") => LayeringRule::Balanced,
            Some("view") => LayeringRule::View,
            Some(other) => return Err(Refusal::bad(format!("there is no layering rule `{other}`"))),
        };
        Ok(Script {
            file: text("file").filter(|f| !f.is_empty()).unwrap_or_else(|| "untitled.osl".into()),
            text: text("text").ok_or_else(|| Refusal::bad("`text` is needed"))?,
            set: body["set"].as_object().cloned().unwrap_or_default(),
            tier,
            layering,
        })
    }
}

/// A script that was compiled, or what is wrong with it.
pub struct Compiled {
    pub outcome: Result<(Shader, Material), Vec<Diagnostic>>,
    source: Source,
    warnings: Vec<Diagnostic>,
    /// Values that no parameter takes.
    refused: Vec<String>,
}

impl Compiled {
    pub fn new(engine: &Engine, script: &Script) -> Compiled {
        let source = Source::new(script.file.as_str(), script.text.as_str());
        let failed = |diagnostics| Compiled {
            outcome: Err(diagnostics),
            source: source.clone(),
            warnings: Vec::new(),
            refused: Vec::new(),
        };
        let shader = match engine.compile(&script.file, &script.text) {
            Ok(shader) => shader,
            Err(e) => return failed(e.diagnostics),
        };
        let (mut set, mut refused) = (Vec::new(), Vec::new());
        for (name, value) in &script.set {
            let param = shader.params().iter().find(|p| p.name == *name);
            match param.and_then(|p| value_of(p, value)) {
                Some(value) => set.push((name.clone(), value)),
                None => refused.push(name.clone()),
            }
        }
        let material = match shader.material(&set) {
            Ok(material) => material,
            Err(e) => return failed(e.diagnostics),
        };
        // A tree beyond its budget is told before it is rendered.
        if let Err(e) = f32::shade(&material, &Globals::default(), [0.0, 0.0, 1.0]) {
            return failed(vec![Diagnostic::error("E0110", crate::span::Span::default(), e.to_string())]);
        }
        let warnings = [shader.warnings(), material.warnings()].concat();
        Compiled { outcome: Ok((shader, material)), source, warnings, refused }
    }

    pub fn material(&self) -> Option<&Material> {
        self.outcome.as_ref().ok().map(|(_, material)| material)
    }

    /// What the page is told about it.
    pub fn told(&self) -> Value {
        let (ok, diagnostics, params) = match &self.outcome {
            Ok((shader, _)) => (true, &self.warnings, shader.params().iter().map(told::parameter).collect()),
            Err(diagnostics) => (false, diagnostics, Vec::new()),
        };
        json!({
            "kind": "compiled",
            "ok": ok,
            "shader": self.material().map(Material::name),
            "diagnostics": told::diagnostics(diagnostics, &self.source),
            "parameters": params,
            "refused": self.refused,
        })
    }
}

/// What the page sends for a parameter, as the type it has; `None` if it cannot be one.
fn value_of(param: &ParamDecl, value: &Value) -> Option<crate::ir::Value> {
    let number = |v: &Value| v.as_f64().map(|x| x as f32).filter(|x| x.is_finite());
    match (param.ty, value) {
        (Ty::String, Value::String(text)) => Some(crate::ir::Value::String(text.clone())),
        (Ty::Int, v) => v.as_i64().and_then(|i| i32::try_from(i).ok()).map(crate::ir::Value::Int),
        (Ty::Float, v) => number(v).map(crate::ir::Value::Float),
        (ty, Value::Array(three)) if ty.is_triple() => {
            match three.iter().map(number).collect::<Option<Vec<_>>>()?[..] {
                [x, y, z] => Some(crate::ir::Value::Color([x, y, z])),
                _ => None,
            }
        }
        _ => None,
    }
}
