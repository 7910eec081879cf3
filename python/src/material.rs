//! Engines, materials, and what is asked of whole materials.

use crate::bsdf::{Bsdf, Rows, array, rows};
use crate::{problem, script_problem, tree};
use glam::Vec3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use overcoat::audit::{self, Side, Tolerance};
use overcoat::closure::LayeringRule;
use overcoat::engine::Tier;
use overcoat::ir::Value;
use overcoat::preview::{Control, RenderSettings, Scene, Stage};
use overcoat::prove::{Options, prove};
use overcoat::syntax::Directories;
use overcoat::{Globals, OwnedBsdf};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Compiles scripts.
#[pyclass(frozen, module = "overcoat")]
pub struct Engine(overcoat::Engine);

fn choose<T: Copy>(what: &str, name: &str, choices: &[(&str, T)]) -> PyResult<T> {
    let found = choices.iter().find(|(n, _)| *n == name).map(|(_, value)| *value);
    found.ok_or_else(|| {
        let names = choices.iter().map(|(n, _)| *n).collect::<Vec<_>>().join("', '");
        PyValueError::new_err(format!("{what} '{name}': expected one of '{names}'"))
    })
}

#[pymethods]
impl Engine {
    /// tier: 'fast' or 'standard'; layering: 'min', 'view' or 'balanced'; include_dirs: where `#include` looks.
    #[new]
    #[pyo3(signature = (*, tier = "standard", layering = "min", include_dirs = Vec::new()))]
    fn new(tier: &str, layering: &str, include_dirs: Vec<PathBuf>) -> PyResult<Engine> {
        let tier = choose("tier", tier, &[("fast", Tier::Fast), ("standard", Tier::Standard)])?;
        let rules = [("min", LayeringRule::Min), ("view", LayeringRule::View), ("balanced", LayeringRule::Balanced)];
        let rule = choose("layering", layering, &rules)?;
        Ok(Engine(overcoat::Engine::new().tier(tier).layering(rule).includes(Directories(include_dirs))))
    }

    /// Compiles a script and sets parameters.
    #[pyo3(signature = (source, name = "material", **params))]
    fn compile(
        &self,
        py: Python<'_>,
        source: &str,
        name: &str,
        params: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Material> {
        let set = values(params)?;
        let made = py.detach(|| self.0.compile(name, source)?.material(&set));
        Ok(Material(Mutex::new(made.map_err(|e| script_problem(py, &e))?)))
    }
}

/// Python values as parameters.
fn values(params: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, Value)>> {
    let mut set = Vec::new();
    for (name, value) in params.into_iter().flatten() {
        let value = if let Ok(text) = value.extract::<String>() {
            Value::String(text)
        } else if let Ok(number) = value.extract::<i32>() {
            Value::Int(number)
        } else if let Ok(number) = value.extract::<f32>() {
            Value::Float(number)
        } else if let Ok(triple) = value.extract::<[f32; 3]>() {
            Value::Color(triple)
        } else {
            return Err(PyTypeError::new_err(format!("{name}: expected a number, three numbers, or a string")));
        };
        set.push((name.extract()?, value));
    }
    Ok(set)
}

/// A script with its parameters set. May be used from any thread.
#[pyclass(frozen, module = "overcoat")]
pub struct Material(Mutex<overcoat::Material>);

impl Material {
    fn lock(&self) -> MutexGuard<'_, overcoat::Material> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A clone to work with: nothing waits for it, and it does not change meanwhile.
    fn get(&self) -> overcoat::Material {
        self.lock().clone()
    }
}

/// What became of a proof.
#[pyclass(frozen, get_all, module = "overcoat")]
pub struct Report {
    /// 'conserves', 'gains' or 'undecided'.
    verdict: &'static str,
    /// No albedo is above this, or None.
    bound: Option<f64>,
    /// Where it gains: (side, direction, albedo), or None.
    witness: Option<(&'static str, [f64; 3], [f64; 3])>,
    /// What is wrong or stood in the way, with source lines.
    messages: Vec<String>,
}

#[pymethods]
impl Report {
    fn __repr__(&self) -> String {
        let bound = self.bound.map_or("None".to_owned(), |b| format!("{b:.5}"));
        format!("Report(verdict='{}', bound={bound})", self.verdict)
    }
}

#[pymethods]
impl Material {
    /// The name of the shader.
    #[getter]
    fn name(&self) -> String {
        self.get().name().to_owned()
    }

    /// The declared parameters and their values now; None where a default depends on the point.
    #[getter]
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let material = self.get();
        let dict = PyDict::new(py);
        for param in material.shader().params() {
            let set = material.params().iter().find(|(name, _)| *name == param.name).map(|(_, value)| value);
            match set.or(param.default.as_ref()) {
                None => dict.set_item(&param.name, py.None())?,
                Some(Value::Int(x)) => dict.set_item(&param.name, x)?,
                Some(Value::Float(x)) => dict.set_item(&param.name, x)?,
                Some(Value::String(text)) => dict.set_item(&param.name, text)?,
                Some(triple) => dict.set_item(&param.name, triple.numbers())?,
            }
        }
        Ok(dict)
    }

    /// Sets parameters by name; all or, if one is wrong, none.
    #[pyo3(signature = (**params))]
    fn set(&self, py: Python<'_>, params: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let set = values(params)?;
        let mut material = self.get();
        let done = py.detach(|| material.set_all(set.iter().map(|(n, v)| (n.as_str(), v.clone()))));
        done.map_err(|e| script_problem(py, &e))?;
        *self.lock() = material;
        Ok(())
    }

    /// The BSDF at a point seen from `wo` (world space, unit, away from the surface).
    #[pyo3(signature = (wo = [0.0, 0.0, 1.0], *, n = [0.0, 0.0, 1.0], ng = None, p = [0.0; 3], u = 0.0, v = 0.0,
        dpdu = [1.0, 0.0, 0.0], dpdv = [0.0, 1.0, 0.0], time = 0.0, backfacing = false))]
    #[allow(clippy::too_many_arguments)]
    fn shade(
        &self,
        wo: [f32; 3],
        n: [f32; 3],
        ng: Option<[f32; 3]>,
        p: [f32; 3],
        u: f32,
        v: f32,
        dpdu: [f32; 3],
        dpdv: [f32; 3],
        time: f32,
        backfacing: bool,
    ) -> PyResult<Bsdf> {
        let globals = Globals {
            p: p.into(),
            n: n.into(),
            ng: ng.unwrap_or(n).into(),
            u,
            v,
            dpdu: dpdu.into(),
            dpdv: dpdv.into(),
            time,
            backfacing,
            ..Globals::default()
        };
        let material = self.get();
        let mut bsdf = OwnedBsdf::new(material.clone());
        bsdf.shade(&material, &globals, Vec3::from_array(wo)).map_err(problem)?;
        Ok(Bsdf(bsdf))
    }

    /// Directional albedos (n, 3) for directions `w` (n, 3) by adaptive quadrature, delta lobes added; side: 'view' or
    /// 'light'.
    #[pyo3(signature = (w, side = "view"))]
    fn albedo<'py>(&self, py: Python<'py>, w: Rows<'py>, side: &str) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let side = choose("side", side, &[("view", Side::View), ("light", Side::Light)])?;
        let (material, w) = (self.get(), rows("w", &w)?);
        let globals = Globals::default();
        material.shade(&globals, Vec3::Z).map_err(problem)?;
        let black = overcoat::closure::Bsdf::black;
        let subject = |wo: [f32; 3]| material.shade(&globals, wo.into()).unwrap_or_else(|_| black());
        let tolerance = Tolerance { error: 1e-4, evaluations: 100_000 };
        let of = |w: &[f32; 3]| audit::albedo(&subject, side, *w, tolerance).value.map(|x| x as f32);
        array(py, py.detach(|| w.iter().map(of).collect()))
    }

    /// Proves that the material keeps energy for all directions and all values of the parameters that are not set, finds a
    /// direction where it gains, or says what stood in the way.
    fn check(&self, py: Python<'_>) -> PyResult<Report> {
        let material = self.get();
        let options = Options { set: material.params().to_vec(), ..Options::default() };
        let shader = material.shader();
        let report = py.detach(|| prove(shader, &options)).map_err(|diagnostics| {
            let messages: Vec<String> = diagnostics.iter().map(|d| d.render(shader.source(), false)).collect();
            PyValueError::new_err(messages.join("\n"))
        })?;
        let side = |s: Side| if s == Side::View { "view" } else { "light" };
        Ok(Report {
            verdict: report.verdict.name(),
            bound: report.bound,
            witness: report.witness.as_ref().map(|w| (side(w.side), w.dir, w.albedo.value)),
            messages: report.diagnostics.iter().map(|d| d.render(shader.source(), false)).chain(report.notes).collect(),
        })
    }

    /// The closure tree at a point as nested dictionaries, as `overcoat tree --json` prints it.
    #[pyo3(signature = (u = 0.0, v = 0.0))]
    fn tree<'py>(&self, py: Python<'py>, u: f32, v: f32) -> PyResult<Bound<'py, PyDict>> {
        let tree = self.get().tree(&Globals { u, v, ..Globals::default() }).map_err(problem)?;
        tree::dictionary(py, &tree)
    }

    /// A picture (size, size, 3) of linear radiance. scene: 'sphere', 'ball', 'drape' or 'furnace'.
    #[pyo3(signature = (size = 256, spp = 16, *, scene = "sphere", seed = 0, threads = 0))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        size: u32,
        spp: u32,
        scene: &str,
        seed: u64,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let scenes =
            [("sphere", Scene::Sphere), ("ball", Scene::Ball), ("drape", Scene::Drape), ("furnace", Scene::Furnace)];
        let scene = choose("scene", scene, &scenes)?;
        let settings =
            RenderSettings { scene, spp, width: size, height: size, seed, threads, ..RenderSettings::default() };
        let material = self.get();
        let rendered = py.detach(|| Stage::new(&settings)?.render(&material, Control::quiet())).map_err(problem)?;
        let side = size as usize;
        PyArray1::from_vec(py, rendered.image.into_data()).reshape([side, side, 3])
    }

    fn __repr__(&self) -> String {
        format!("<overcoat.Material '{}'>", self.get().name())
    }
}
