//! How the material scatters at one point, seen from one direction: f·|cos θi| around the plane of incidence.

use super::super::plot::around;
use super::http::Refusal;
use super::material::Script;
use super::picture::Scenery;
use super::workshop::Workshop;
use crate::closure::Bsdf;
use crate::engine::Material;
use crate::globals::Globals;
use crate::lobes::registry::LobeClass;
use crate::optics::V3;
use glam::Vec3;
use serde_json::{Value, json};
use std::f32::consts::PI;

/// A shading point and where it is looked at from.
pub struct Place {
    pub globals: Globals,
    pub wo: Vec3,
    /// Whether the page pointed at the subject there.
    pub pointed: bool,
}

impl Place {
    /// What the page points at: `at`, a place of the picture; else the default point at an angle of `theta` degrees.
    pub fn read(workshop: &Workshop, body: &Value) -> Result<Place, Refusal> {
        let at = [0, 1].map(|k| body["at"][k].as_f64().map(|x| x as f32));
        if let [Some(x), Some(y)] = at {
            let Scenery { stage, pass } = Scenery::read(workshop, body)?;
            if let Some(globals) = stage.point(&pass, x, y) {
                return Ok(Place { globals, wo: -globals.i, pointed: true });
            }
        }
        let theta = body["theta"].as_f64().unwrap_or(45.0).clamp(0.0, 89.9).to_radians() as f32;
        let wo = Vec3::new(theta.sin(), 0.0, theta.cos());
        Ok(Place { globals: Globals { i: -wo, ..Globals::default() }, wo, pointed: false })
    }

    /// The frame in which angles are told: N, and the direction in which ωo leans.
    fn frame(&self) -> [Vec3; 2] {
        let n = self.globals.n;
        let along = (self.wo - n * self.wo.dot(n)).try_normalize();
        let tangent = (self.globals.dpdu - n * self.globals.dpdu.dot(n)).try_normalize();
        [n, along.or(tangent).unwrap_or_else(|| n.any_orthonormal_vector())]
    }

    /// Degrees between ωo and N.
    pub fn theta(&self) -> f64 {
        f64::from(self.wo.dot(self.globals.n).clamp(-1.0, 1.0)).acos().to_degrees()
    }
}

/// Lobes whose curves are told apart.
const MAX_LOBES: usize = 12;

/// Null for a script that does not compile.
pub fn polar(workshop: &Workshop, body: &Value) -> Result<Value, Refusal> {
    let compiled = workshop.material(&Script::read(body)?);
    let Some(material) = compiled.material() else { return Ok(Value::Null) };
    let place = Place::read(workshop, body)?;
    let bsdf = material.shade(&place.globals, place.wo).map_err(|e| Refusal::bad(e.to_string()))?;
    Ok(describe(material, &place, &bsdf))
}

fn describe(material: &Material, place: &Place, bsdf: &Bsdf<'_>) -> Value {
    let [n, along] = place.frame();
    let direction = |degrees: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Positive angles lie opposite ωo, where a mirror sends light.
        n * cos - along * sin
    };
    let lobes: Vec<usize> =
        (0..bsdf.lobe_count().min(MAX_LOBES)).filter(|l| bsdf.lobe_kind(*l).0.class() == LobeClass::Scatter).collect();
    let curve = |f: &dyn Fn(Vec3) -> f32| {
        let points = around(&|degrees: f32| f(direction(degrees)));
        json!(points.iter().map(|(angle, value)| json!([angle, value])).collect::<Vec<_>>())
    };
    let brightest = |rgb: [f32; 3]| rgb[0].max(rgb[1]).max(rgb[2]);
    let parts: Vec<Value> = lobes
        .iter()
        .map(|l| {
            let part = |wi: Vec3| brightest(bsdf.lobe_part(*l, V3::new(wi.x, wi.y, wi.z), true));
            json!({ "lobe": bsdf.lobe_kind(*l).0.spec().name, "points": curve(&part) })
        })
        .collect();
    let deltas: Vec<Value> = bsdf
        .delta_parts()
        .map(|(wi, weight)| {
            let wi = Vec3::from(wi);
            let angle = (-wi.dot(along)).atan2(wi.dot(n)) * 180.0 / PI;
            json!({ "angle": angle, "weight": brightest(weight) })
        })
        .collect();
    let total = |wi: Vec3| brightest(bsdf.eval(wi.to_array()).f_cos);
    let Globals { u, v, backfacing, .. } = place.globals;
    json!({
        "shader": material.name(), "theta": place.theta(), "pointed": place.pointed,
        "u": u, "v": v, "backfacing": backfacing, "albedo": bsdf.albedo(),
        "total": curve(&total), "lobes": parts, "deltas": deltas,
    })
}
