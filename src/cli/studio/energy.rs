//! Where the energy goes: the verdict of `check`, albedos by angle from both sides, lobe by lobe and layer by layer, and
//! what a renderer pays.

use super::super::albedo::explain;
use super::super::check::{judge, witness};
use super::super::cost::measure;
use super::super::input::{Evaluate, in_tier};
use super::http::{Refusal, Stream};
use super::material::{Compiled, Script};
use super::polar::Place;
use super::server::guarded;
use super::told;
use super::workshop::Workshop;
use crate::audit::{Albedo, Side, Tolerance, albedo};
use crate::closure::Bsdf;
use crate::engine::{Material, Shader};
use crate::optics::Scalar;
use crate::prove::Options;
use glam::Vec3;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Angles to N in degrees at which the albedo is measured; closer together toward the horizon, where it changes most.
const ANGLES: [f64; 17] =
    [0.0, 10.0, 20.0, 30.0, 40.0, 48.0, 55.0, 61.0, 66.0, 70.0, 74.0, 77.5, 80.5, 83.0, 85.5, 87.5, 89.0];

/// Three digits: as much as a curve shows.
const TOLERANCE: Tolerance = Tolerance { error: 4e-4, evaluations: 20_000 };

/// What the page asks for.
pub struct Wish {
    script: Script,
    place: Place,
    /// Whether the proof and the curves are wanted too, or only what happens at the place.
    all: bool,
    stop: Arc<AtomicBool>,
}

impl Wish {
    pub fn read(workshop: &Workshop, body: &Value) -> Result<Wish, Refusal> {
        let script = Script::read(body)?;
        let stop = workshop.begin(&format!("energy {}", body["slot"].as_str().unwrap_or("")));
        Ok(Wish { script, place: Place::read(workshop, body)?, all: body["all"] != false, stop })
    }
}

/// Tells verdict, curves and shares, each as soon as it is known.
pub fn account(workshop: &Workshop, wish: &Wish, mut stream: Stream<'_>) {
    guarded(&mut stream, |stream| {
        let compiled: Arc<Compiled> = workshop.material(&wish.script);
        let Ok((shader, material)) = &compiled.outcome else {
            let _ = stream.send(&json!({ "kind": "verdict", "verdict": "error" }), &[]);
            return;
        };
        let wanted = || !wish.stop.load(Ordering::Relaxed);
        if wish.all && wanted() && stream.send(&verdict(shader), &[]).is_err() {
            return;
        }
        if wanted() && stream.send(&in_tier!(material, shares(material, &wish.place)), &[]).is_err() {
            return;
        }
        if wish.all && wanted() {
            let curves = in_tier!(material, curves(material, &wish.place, &wish.stop));
            let _ = stream.send(&curves, &[]);
        }
    });
}

/// What `overcoat check` says, over the declared ranges of all parameters.
fn verdict(shader: &Shader) -> Value {
    match judge(shader, &Options::default()) {
        Ok(report) => json!({
            "kind": "verdict",
            "verdict": report.verdict.name(),
            "bound": report.bound,
            "witness": report.witness.as_ref().map(witness),
            "diagnostics": told::diagnostics(&report.diagnostics, shader.source()),
            "notes": report.notes,
        }),
        Err(diagnostics) => json!({
            "kind": "verdict", "verdict": "error",
            "diagnostics": told::diagnostics(&diagnostics, shader.source()), "notes": [],
        }),
    }
}

/// The BSDF at the place, for any ωo.
fn subject<'m, S: Evaluate>(material: &'m Material, place: &'m Place) -> impl Fn([S; 3]) -> Bsdf<'m, S> + Sync + 'm {
    move |wo| S::shade(material, &place.globals, wo).unwrap_or_else(|_| Bsdf::black())
}

fn curves<S: Evaluate>(material: &Material, place: &Place, stop: &AtomicBool) -> Value {
    let subject = subject::<S>(material, place);
    let n = place.globals.n;
    let tangent = place.globals.dpdu - n * place.globals.dpdu.dot(n);
    let tangent = tangent.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
    let measure = |side: Side, degrees: f64| -> Option<Albedo> {
        let (sin, cos) = (degrees.to_radians() as f32).sin_cos();
        let w = scalars::<S>(n * cos + tangent * sin);
        (!stop.load(Ordering::Relaxed)).then(|| albedo(&subject, side, w, TOLERANCE))
    };
    let rows = |side: Side| -> Vec<Value> {
        let row = |degrees: &f64| measure(side, *degrees).map(|a| json!([degrees, a.value]));
        ANGLES.par_iter().filter_map(row).collect()
    };
    json!({ "kind": "albedo", "view": rows(Side::View), "light": rows(Side::Light) })
}

/// Lobe by lobe and layer by layer, toward the place's ωo.
fn shares<S: Evaluate>(material: &Material, place: &Place) -> Value {
    let w = scalars::<S>(place.wo);
    let total = albedo(&subject::<S>(material, place), Side::View, w, TOLERANCE);
    json!({
        "kind": "energy", "theta": place.theta(), "pointed": place.pointed, "albedo": total.value,
        "explained": explain::<S>(material, &place.globals, w, &total, TOLERANCE),
    })
}

fn scalars<S: Scalar>(w: Vec3) -> [S; 3] {
    w.to_array().map(|x| S::c(f64::from(x)))
}

/// What `overcoat cost` says; null for a script that does not compile.
pub fn cost(workshop: &Workshop, body: &Value) -> Result<Value, Refusal> {
    let compiled = workshop.material(&Script::read(body)?);
    let Ok((shader, material)) = &compiled.outcome else { return Ok(Value::Null) };
    let _quiet = workshop.hush.ask();
    let failed = |_| Refusal::bad("the material cannot be shaded");
    let mut cost = measure(material).map_err(failed)?;
    cost["unspecialised"] = measure(&shader.unspecialised()).map_err(failed)?;
    Ok(cost)
}
