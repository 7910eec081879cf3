//! Woven cloth by name: the microcylinder model of Sadeghi, Bisker, De Deken & Jensen 2013.
//!
//! Warp and weft as two families of dielectric threads; `cloth.rs` has the formula and where it departs from the
//! paper. `linen`: a soft, nearly even sheen. `silk_crepe`: two broad streaks across the warp. `satin`: sharp, bright
//! bands. `shot_silk`: green along the warp, red where the weft shows at grazing angles. `velvet`: dark but for the rim,
//! its warp standing out of the cloth.
//!
//! The presets are *recalled* from the paper's Table II by way of third-party transcriptions, not read from it, and the
//! segments of the offset curves are taken as equally long.

use super::cloth::{self, ClothParams, EVENLY, FLAT, TANGENTS, Woven, Yarn, weights};
use super::registry::{ClosureParams, closure};
use crate::albedo::{COMPONENTS, FibreKey, TableSpec};
use crate::optics::V3;

closure! {
    /// Woven cloth of two families of dielectric threads, one along T, one across it. One-sided: black below the
    /// surface. The presets' values are recalled from the paper's Table II, not read from it.
    closure "microcylinder" as MicrocylinderParams {
        /// Shading normal.
        normal N;
        /// Direction of the warp; its part along N is removed.
        vector T;
        /// The cloth (values recalled): plain linen, silk crepe de Chine, polyester satin charmeuse, shot silk, velvet.
        string preset = 0.0, in (0.0, 4.0), of ["linen", "silk_crepe", "satin", "shot_silk", "velvet"];
    }
    source: "Sadeghi, Bisker, De Deken & Jensen 2013, §5-6 and Table II (recalled)",
    reciprocal: true,
    class: Scatter,
}

const fn yarn(
    color: [f32; 3],
    scale: f32,
    optics: [f32; 4],
    cover: f32,
    ends: [f32; 2],
    weights: &'static [f64; TANGENTS],
) -> Yarn {
    let [eta, kd, gamma_s, gamma_v] = optics;
    let color = [color[0] * scale, color[1] * scale, color[2] * scale];
    Yarn { color, eta, kd, gamma_s, gamma_v, cover, lo: ends[0], hi: ends[1], weights }
}

const CREPE: &[f64; TANGENTS] = &weights(&[-35.0, -35.0, 35.0, 35.0]);
const SATIN: &[f64; TANGENTS] = &weights(&[-32.0, -32.0, -18.0, 0.0, 0.0, 18.0, 32.0, 32.0]);
const SHOT: &[f64; TANGENTS] = &weights(&[-25.0, -25.0, 25.0, 25.0]);
const PILE: &[f64; TANGENTS] = &weights(&[-90.0, -55.0, 55.0, 90.0]);

/// Sadeghi et al. 2013, Table II, recalled: warp and weft per preset.
static PRESETS: [[Yarn; 2]; 5] = [
    [yarn([0.2, 0.8, 1.0], 0.3, [1.46, 0.3, 12.0, 24.0], 0.33, [-25.0, 25.0], EVENLY); 2],
    [
        yarn([1.0, 0.95, 0.05], 0.12, [1.345, 0.2, 5.0, 10.0], 0.75, [-35.0, 35.0], CREPE),
        yarn([1.0, 0.95, 0.05], 0.16, [1.345, 0.3, 18.0, 32.0], 0.25, [0.0, 0.0], FLAT),
    ],
    [
        yarn([1.0, 0.37, 0.3], 0.035, [1.539, 0.1, 2.5, 5.0], 0.9, [-32.0, 32.0], SATIN),
        yarn([1.0, 0.37, 0.3], 0.02, [1.539, 0.7, 30.0, 60.0], 0.1, [0.0, 0.0], FLAT),
    ],
    [
        yarn([0.1, 1.0, 0.4], 0.2, [1.345, 0.1, 4.0, 8.0], 0.86, [-25.0, 25.0], SHOT),
        yarn([1.0, 0.0, 0.1], 0.6, [1.345, 0.1, 5.0, 10.0], 0.14, [0.0, 0.0], FLAT),
    ],
    [
        yarn([0.05, 0.02, 0.0], 0.3, [1.46, 0.1, 6.0, 12.0], 0.5, [-90.0, -50.0], EVENLY),
        yarn([0.05, 0.02, 0.0], 0.3, [1.46, 0.1, 6.0, 12.0], 0.5, [-90.0, 90.0], PILE),
    ],
];

/// See [`MicrocylinderParams`].
pub type Microcylinder<S> = Woven<S, MicrocylinderParams>;

fn preset(index: usize) -> &'static [Yarn; 2] {
    &PRESETS[index.min(PRESETS.len() - 1)]
}

fn kernel(key: &FibreKey, wo: V3<f64>, wi: &[V3<f64>], out: &mut [[f64; COMPONENTS]]) {
    cloth::integrate(preset(key[0] as usize), key[15] as usize, wo, wi, out);
}

impl ClothParams for MicrocylinderParams {
    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let spec = MicrocylinderParams::SPEC;
        let index = spec.params[2].clamp(0, values[spec.slot_of("preset")?]?) as usize;
        let mut key = [0.0; 16];
        key[0] = index as f64;
        Some(cloth::table(kernel, key, preset(index)))
    }

    fn yarns(&self) -> [Yarn; 2] {
        *preset(self.preset as usize)
    }
}
