//! One call for a test: does this material gain energy anywhere?

use super::campaign::{LIMIT, promises};
use super::cubature::Tolerance;
use super::estimate::direction_of;
use super::furnace::{Albedo, Side, albedo_until};
use crate::closure::Bsdf;
use crate::engine::{Material, Tier};
use crate::globals::Globals;
use crate::ir::{GlobalVar, Value};
use glam::Vec3;
use std::fmt;

/// Cosines to Ng, and azimuths in degrees, at which a material is looked at.
const COSINES: [f64; 10] = [1.0, 0.85, 0.6, 0.35, 0.15, 0.05, 0.01, 0.001, -0.05, -0.6];
const AZIMUTHS: [f64; 3] = [17.0, 107.0, 200.0];

/// A direction in which a material gives back more than it receives.
#[derive(Clone, Debug, PartialEq)]
pub struct Gain {
    /// The shader.
    pub shader: String,
    /// The parameters that were set.
    pub params: Vec<(String, Value)>,
    /// The shading point.
    pub globals: Globals,
    /// Which direction is held.
    pub side: Side,
    /// That direction: world space, unit.
    pub direction: [f64; 3],
    /// What was measured there: above 1 + 1e-4 by more than its error.
    pub albedo: Albedo,
}

impl fmt::Display for Gain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}`", self.shader)?;
        for (index, (name, value)) in self.params.iter().enumerate() {
            let numbers: Vec<String> = value.numbers().iter().map(f32::to_string).collect();
            let text = match value {
                Value::String(text) => format!("\"{text}\""),
                _ => numbers.join(","),
            };
            write!(f, "{} {name}={text}", if index == 0 { " with" } else { "," })?;
        }
        let ([x, y, z], [r, g, b]) = (self.direction, self.albedo.value);
        let (side, fixed) = match self.side {
            Side::View => ("view", "ωo"),
            Side::Light => ("light", "ωi"),
        };
        write!(f, " gains energy on the {side} side: albedo {r:.5} {g:.5} {b:.5} (error {:.0e})", self.albedo.error)?;
        write!(f, " for {fixed} = ({x:.4}, {y:.4}, {z:.4})")?;
        let point = Globals { i: Globals::default().i, ..self.globals };
        if point != Globals::default() {
            write!(f, " at u {}, v {}, time {}, P {}", point.u, point.v, point.time, point.p)?;
            write!(f, "{}", if point.backfacing { ", seen from behind" } else { "" })?;
        }
        Ok(())
    }
}

impl std::error::Error for Gain {}

/// Measures `material` in white surroundings, with its own tier and layering rule: from thirty directions above and
/// below the surface, with each held as the viewer's and as the light's (`view` promises nothing for the light), and at
/// several shading points if it reads more of them than normals and tangents.
///
/// Looks at a sample of directions and points; it proves nothing in between. A point at which shading goes beyond a
/// budget gives nothing back.
///
/// ```
/// # #[cfg(feature = "cloth")] {
/// use overcoat::{Engine, audit};
/// let compile = |script| Engine::new().compile("cloth", script).unwrap().material(&[]).unwrap();
/// audit::assert_no_gain(&compile("Ci = sheen(diffuse(N), N, 1, 0.5);"))?;
/// let gain = audit::assert_no_gain(&compile("Ci = diffuse(N) + sheen(N, 0.5);")).unwrap_err();
/// assert!(gain.to_string().contains("`cloth` gains energy on the view side"));
/// # }
/// # Ok::<(), overcoat::audit::Gain>(())
/// ```
///
/// # Errors
/// The first direction found in which the albedo exceeds 1 + 1e-4 by more than its error.
// A test meets this error once.
#[allow(clippy::result_large_err)]
pub fn assert_no_gain(material: &Material) -> Result<(), Gain> {
    for globals in points(material) {
        for side in [Side::View, Side::Light] {
            if !promises(material.layering().rule, side) {
                continue;
            }
            for cos in COSINES {
                let azimuths = if cos == 1.0 { &AZIMUTHS[..1] } else { &AZIMUTHS };
                for phi in azimuths {
                    let direction = direction_of(cos, *phi);
                    let albedo = measure(material, &globals, side, direction);
                    if albedo.max() - albedo.error > LIMIT {
                        let (shader, params) = (material.name().to_owned(), material.params().to_vec());
                        return Err(Gain { shader, params, globals, side, direction, albedo });
                    }
                }
            }
        }
    }
    Ok(())
}

fn measure(material: &Material, globals: &Globals, side: Side, direction: [f64; 3]) -> Albedo {
    let tolerance = Tolerance { error: 1e-5, evaluations: 200_000 };
    let enough = |a: &Albedo| a.max() + a.error <= LIMIT;
    if material.tier() == Tier::Reference {
        let subject = |wo| material.shade_reference(globals, wo).unwrap_or_else(|_| Bsdf::black());
        albedo_until(&subject, side, direction, tolerance, enough)
    } else {
        let subject = |wo: [f32; 3]| material.shade(globals, wo.into()).unwrap_or_else(|_| Bsdf::black());
        albedo_until(&subject, side, direction.map(|x| x as f32), tolerance, enough)
    }
}

/// The shading points to look at: the default one, and a few that differ in what the material reads.
fn points(material: &Material) -> Vec<Globals> {
    let reads = material.program().globals();
    let mut points = vec![Globals::default()];
    if reads.iter().any(|g| matches!(g, GlobalVar::P | GlobalVar::U | GlobalVar::V | GlobalVar::Time)) {
        let point = |u: f32, v: f32, time: f32| Globals { u, v, time, p: Vec3::new(u, v, time), ..Globals::default() };
        points.extend([point(0.5, 0.5, 0.5), point(1.0, 0.0, 1.0), point(0.0, 1.0, 0.25), point(1.0, 1.0, 0.75)]);
        points.push(point(0.2, 0.8, 0.0));
    }
    if reads.contains(&GlobalVar::Backfacing) {
        points.extend(points.clone().into_iter().map(|p| Globals { backfacing: true, ..p }));
    }
    points
}
