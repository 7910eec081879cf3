//! Woven cloth thread by thread: the microcylinder model of Sadeghi, Bisker, De Deken & Jensen 2013, "A Practical
//! Microcylinder Appearance Model for Cloth Rendering", with explicit parameters for both families.
//!
//! `microcylinder.rs` names five cloths; this is the same model with numbers of your own. Scripts call both
//! `microcylinder`. Per family, 1 the warp along T and 2 the weft across it:
//!
//! | parameter | means | low | middle | high |
//! |---|---|---|---|---|
//! | `A` | color of light that went through the thread | 0.02: dark satin | 0.3: linen | 1: undyed, nothing absorbed |
//! | `eta` | index of refraction | 1.34: silk, little surface gloss | 1.5: cotton, polyester | 2 and more: glassy |
//! | `kd` | how much of that light leaves evenly | 0.1: all in the cone, lustrous | 0.3: linen | 0.7: dull |
//! | `gamma_s` | width of the surface reflection | 2.5°: a sharp streak, satin | 12°: linen | 30°: no streak left |
//! | `gamma_v` | width of the cone from inside | 5°: bright bands | 24°: a soft band | 60°: nearly even |
//! | `a` | part of the cloth's area | 0.1: shows at grazing angles only | 0.33: an even, open weave | 0.9: floats of satin |
//! | `offset` | how far the threads bend out of the surface | 0°: lie flat | 25°: linen | 60°: a coarse, steep weave |
//!
//! Offsets occur evenly from −offset to +offset; the paper's curves of other shapes come with the named cloths only. If
//! a1 + a2 exceeds 1 both are scaled down to a sum of 1; if it is less, what lies between the threads is black: layer the
//! cloth over something, or add `(1 - a1 - a2) * transparent()`.
//!
//! Widths start at 2°, above the 1° of `thread`: the tables have to resolve both families and their crossing. Where all
//! parameters but the colors are known before shading, E comes from such a table; where one of the others varies, from
//! closed forms that lie above it for any parameters (`cloth_range.rs`), so that f is divided by more than it need be
//! where threads are pale or seen along their length: darker, never gaining. Where f is divided, the albedo estimate is
//! high.

use super::cloth::{self, ClothParams, EVENLY, FLAT, Woven, Yarn};
use super::registry::{ClosureParams, Form, closure};
use super::{LobeKind, Rgb32};
use crate::albedo::{COMPONENTS, FibreKey, TableSpec};
use crate::optics::V3;

closure! {
    /// Woven cloth of two families of dielectric threads, one along T, one across it, parameter by parameter.
    /// One-sided: black below the surface, and between the threads.
    closure "microcylinder_threads" as MicrocylinderThreadsParams {
        /// Shading normal.
        normal N;
        /// Direction of the warp; its part along N is removed.
        vector T;
        /// Color of light that went through a warp thread.
        color A1 = [0.06, 0.24, 0.3], in (0.0, 1.0);
        /// Relative index of refraction of the warp.
        float eta1 = 1.46, in (1.0, 3.0);
        /// How much of the light from inside a warp thread leaves evenly rather than in the cone.
        float kd1 = 0.3, in (0.0, 1.0);
        /// Width of the warp's surface reflection, in degrees: the standard deviation of θh.
        float gamma_s1 = 12.0, in (2.0, 90.0);
        /// Width of the warp's cone of light from inside, in degrees.
        float gamma_v1 = 24.0, in (2.0, 90.0);
        /// Part of the cloth's area that is warp; both parts are scaled down if their sum exceeds 1.
        float a1 = 0.33, in (0.0, 1.0);
        /// How far the warp bends out of the surface, in degrees: tangents from -offset1 to +offset1.
        float offset1 = 25.0, in (0.0, 60.0);
        /// As A1, for the weft.
        color A2 = [0.06, 0.24, 0.3], in (0.0, 1.0);
        /// As eta1, for the weft.
        float eta2 = 1.46, in (1.0, 3.0);
        /// As kd1, for the weft.
        float kd2 = 0.3, in (0.0, 1.0);
        /// As gamma_s1, for the weft.
        float gamma_s2 = 12.0, in (2.0, 90.0);
        /// As gamma_v1, for the weft.
        float gamma_v2 = 24.0, in (2.0, 90.0);
        /// As a1, for the weft.
        float a2 = 0.33, in (0.0, 1.0);
        /// As offset1, for the weft.
        float offset2 = 25.0, in (0.0, 60.0);
    }
    source: "Sadeghi, Bisker, De Deken & Jensen 2013, §5-6",
    reciprocal: true,
    class: Scatter,
}

/// `microcylinder(N, T, A1, …)`, beside `microcylinder(N, T, preset)`.
pub(super) const FORM: Form =
    Form { name: "microcylinder", ..Form::of_lobe(LobeKind::MicrocylinderThreads, MicrocylinderThreadsParams::SPEC) };

/// What a table depends on, family after family.
const SHAPE: [&str; 12] =
    ["eta1", "kd1", "gamma_s1", "gamma_v1", "a1", "offset1", "eta2", "kd2", "gamma_s2", "gamma_v2", "a2", "offset2"];

fn yarn(color: Rgb32, [eta, kd, gamma_s, gamma_v, cover, offset]: [f32; 6]) -> Yarn {
    let weights = if offset == 0.0 { FLAT } else { EVENLY };
    Yarn { color, eta, kd, gamma_s, gamma_v, cover, lo: -offset, hi: offset, weights }
}

/// The yarns a key stands for; their colors do not matter to the tables.
fn yarns(key: &FibreKey) -> [Yarn; 2] {
    [0, 6].map(|at| yarn([0.0; 3], std::array::from_fn(|i| key[at + i] as f32)))
}

fn kernel(key: &FibreKey, wo: V3<f64>, wi: &[V3<f64>], out: &mut [[f64; COMPONENTS]]) {
    cloth::integrate(&yarns(key), key[15] as usize, wo, wi, out);
}

/// See [`MicrocylinderThreadsParams`].
pub type MicrocylinderThreads<S> = Woven<S, MicrocylinderThreadsParams>;

impl ClothParams for MicrocylinderThreadsParams {
    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let spec = MicrocylinderThreadsParams::SPEC;
        let mut key = [0.0; 16];
        for (entry, name) in key.iter_mut().zip(SHAPE) {
            let param = spec.params.iter().find(|p| p.name == name)?;
            *entry = param.clamp(0, values[spec.slot_of(name)?]?) as f64;
        }
        Some(cloth::table(kernel, key, &yarns(&key)))
    }

    fn yarns(&self) -> [Yarn; 2] {
        let warp = yarn(self.A1, [self.eta1, self.kd1, self.gamma_s1, self.gamma_v1, self.a1, self.offset1]);
        let weft = yarn(self.A2, [self.eta2, self.kd2, self.gamma_s2, self.gamma_v2, self.a2, self.offset2]);
        [warp, weft]
    }
}
