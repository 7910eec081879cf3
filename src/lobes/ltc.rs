//! Linearly transformed cosines (Heitz et al. 2016) that follow the sheens: a model by themselves and, mixed with a
//! uniform share, the density all sheens are sampled with.
//!
//! A direction w maps to M⁻¹w = (a·x + c·z, b·y, z), x toward ωo's azimuth; the lobe is the clamped cosine there. M
//! keeps the horizon where it is, so the density integrates to 1 over the hemisphere. The parameters a, b, c come from
//! tables over ωo's cosine and the roughness, fitted by `examples/fit_sheen.rs`.

use crate::optics::{Over, Real, V3, array, lifted, sampling};
use std::f64::consts::FRAC_1_PI;

/// Nodes of a table over √μ.
pub const COS_NODES: usize = 16;
/// Nodes of a table over ln r, from [`MIN_ROUGHNESS`] to 1.
pub const ROUGHNESS_NODES: usize = 16;
/// The lowest roughness of a table; lower ones read as this.
pub const MIN_ROUGHNESS: f64 = 0.02;
/// Numbers per node: a, b, c and one more.
pub const PARAMS: usize = 4;
/// Row after row over the roughness, nodes over the cosine, [`PARAMS`] each.
pub type Table = [f32; COS_NODES * ROUGHNESS_NODES * PARAMS];

/// The cosine and the roughness of a node.
pub fn node(row: usize, column: usize) -> (f64, f64) {
    let x = column as f64 / (COS_NODES - 1) as f64;
    let y = row as f64 / (ROUGHNESS_NODES - 1) as f64;
    (x * x, (MIN_ROUGHNESS.ln() * (1.0 - y)).exp())
}

/// The four numbers of `table` at a cosine and a roughness, bilinearly.
pub fn read<S: Real>(table: &Table, cos: S, roughness: S) -> [S; PARAMS] {
    let last = |n: usize| S::c((n - 1) as f64);
    let x = cos.clamp(S::zero(), S::one()).sqrt() * last(COS_NODES);
    let y = (S::one() - roughness.ln() * S::c(1.0 / MIN_ROUGHNESS.ln())).clamp(S::zero(), S::one());
    let y = y * last(ROUGHNESS_NODES);
    let (i, j) = (x.floor().min(last(COS_NODES - 1)), y.floor().min(last(ROUGHNESS_NODES - 1)));
    let (t, u) = (x - i, y - j);
    let params = S::c(PARAMS as f64);
    let corner = j.mul_add(S::c(COS_NODES as f64), i) * params;
    array(|p| {
        let pick = |offset: usize| S::pick(table, corner + S::c((offset * PARAMS + p) as f64));
        let mix = |a: S, b: S, t: S| (b - a).mul_add(t, a);
        mix(mix(pick(0), pick(1), t), mix(pick(COS_NODES), pick(COS_NODES + 1), t), u)
    })
}

/// The numbers of `table` at a roughness, for all nodes over the cosine.
#[cfg(feature = "cloth")]
pub(super) fn row(table: &Table, roughness: f64) -> Vec<f64> {
    let y = (1.0 - roughness.ln() / MIN_ROUGHNESS.ln()).clamp(0.0, 1.0) * (ROUGHNESS_NODES - 1) as f64;
    let j = y.floor().min((ROUGHNESS_NODES - 2) as f64);
    let at = |row: usize, k: usize| f64::from(table[row * COS_NODES * PARAMS + k]);
    let mix = |k: usize| at(j as usize, k) + (at(j as usize + 1, k) - at(j as usize, k)) * (y - j);
    (0..COS_NODES * PARAMS).map(mix).collect()
}

/// The four numbers of a [`row`] at a cosine, linearly.
#[cfg(feature = "cloth")]
#[inline(always)]
pub(super) fn read_row<S: Real>(row: &[S::Entry], cos: S) -> [S; PARAMS] {
    let x = cos.clamp(S::zero(), S::one()).sqrt() * S::c((COS_NODES - 1) as f64);
    let i = x.whole().min(S::c((COS_NODES - 2) as f64));
    let start = i * S::c(PARAMS as f64);
    let both: [S; 2 * PARAMS] = S::run(row, start);
    array(|p| (both[PARAMS + p] - both[p]).mul_add(x - i, both[p]))
}

/// A transformed cosine, turned toward ωo's azimuth, and the share of uniform directions mixed into it.
#[derive(Clone, Copy, Debug)]
pub struct Ltc<S> {
    a: S,
    b: S,
    c: S,
    /// Cosine and sine of ωo's azimuth.
    turn: [S; 2],
    /// Probability of a uniform direction.
    uniform: S,
}

impl<S: Real> Ltc<S> {
    /// With the parameters a, b, c and the uniform share for the direction `wo`.
    pub fn new([a, b, c, uniform]: [S; PARAMS], wo: V3<S>) -> Self {
        let length = wo.x.mul_add(wo.x, wo.y * wo.y).sqrt();
        let toward = length.gt(S::c(1e-12));
        let inv = S::one() / S::select(toward, length, S::one());
        let turn = [S::select(toward, wo.x * inv, S::one()), S::select(toward, wo.y * inv, S::zero())];
        Ltc { a, b, c, turn, uniform }
    }

    /// A proposal read from `table` for `wo` and a roughness.
    pub fn proposal(table: &Table, wo: V3<S>, roughness: S) -> Self {
        Ltc::new(read(table, wo.z, roughness), wo)
    }

    /// The density over cos θ of the transformed cosine alone; finite at the horizon. Meant for z ≥ 0.
    #[inline(always)]
    pub fn density_over_cos<L: Over<S>>(&self, w: V3<L>) -> L {
        let [cos, sin] = lifted::<_, L, 2>(self.turn);
        let x = L::lift(self.a) * cos.mul_add(w.x, sin * w.y) + L::lift(self.c) * w.z;
        let y = L::lift(self.b) * (cos * w.y - sin * w.x);
        let length2 = x.mul_add(x, y.mul_add(y, w.z * w.z)).max(L::c(1e-15));
        L::lift(self.a * self.b * S::c(FRAC_1_PI)) / (length2 * length2)
    }

    /// Density over solid angle of [`sample`](Self::sample); 0 below the surface.
    #[inline(always)]
    pub fn pdf<L: Over<S>>(&self, w: V3<L>) -> L {
        let uniform = L::lift(self.uniform);
        let ltc = self.density_over_cos(w) * w.z;
        let pdf = (L::one() - uniform).mul_add(ltc, uniform * L::c(0.5 * FRAC_1_PI));
        L::select(w.z.gt(L::zero()), pdf, L::zero())
    }

    /// A direction for two uniform numbers in [0, 1).
    pub fn sample(&self, u: [S; 2]) -> V3<S> {
        let uniform = u[0].lt(self.uniform);
        // The number that made the choice is used again, stretched back to [0, 1).
        let (from, width) =
            (S::select(uniform, S::zero(), self.uniform), S::select(uniform, self.uniform, S::one() - self.uniform));
        let again = ((u[0] - from) / width.max(S::c(1e-6))).clamp(S::zero(), S::c(0.999_999_94));
        // Both maps turn by the same angle.
        let (cosine, flat) = sampling::cosine_and_uniform_hemisphere([again, u[1]]);
        // M times it, without its length: times a·b.
        let (x, y) = (self.b * (cosine.x - self.c * cosine.z), self.a * cosine.y);
        let [cos, sin] = self.turn;
        let ltc = V3::new(cos * x - sin * y, sin * x + cos * y, self.a * self.b * cosine.z);
        let ltc = ltc.scale(S::one() / ltc.length_squared().sqrt());
        let pick = |flat: S, ltc: S| S::select(uniform, flat, ltc);
        V3::new(pick(flat.x, ltc.x), pick(flat.y, ltc.y), pick(flat.z, ltc.z))
    }
}
