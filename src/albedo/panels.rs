//! Where to split an integral around the thread of one family of a cloth: comes in ωo and the offsets of both families'
//! tangents, goes out the edges of smooth panels for each θi.

use super::fibre::OFFSETS;
use crate::optics::V3;
use std::f64::consts::FRAC_PI_2;

/// Where one family's part of f has kinks around its thread: at the horizons of its own tangents, at those of the other
/// family's, which Q contains, and where a tangent's shadow is as long as its mask.
pub(super) struct Panels {
    own: [f64; OFFSETS],
    /// tan φo in the frame of each of the family's own tangents that is seen.
    masks: [Option<f64>; OFFSETS],
    /// The same for every θ: the ends, and the horizons of the threads across.
    fixed: Vec<f64>,
}

impl Panels {
    /// `w` is ωo in the frame of the family's threads, `across` the offsets of the others'.
    pub fn new(w: V3<f64>, own: &[f64; OFFSETS], across: [f64; OFFSETS]) -> Self {
        let mask = |d: f64| {
            let up = d.cos() * w.z - d.sin() * w.x;
            (up > 1e-6).then(|| w.y / up)
        };
        let mut fixed = vec![-FRAC_PI_2, FRAC_PI_2];
        fixed.extend(across.iter().filter(|d| d.sin() != 0.0).map(|d| (d.cos() / d.sin()).atan()));
        Panels { own: *own, masks: own.map(mask), fixed }
    }

    /// The edges of the panels in φi at this tan θi, ascending.
    pub fn edges(&self, tan: f64) -> Vec<f64> {
        let mut edges = self.fixed.clone();
        for (d, mask) in self.own.iter().zip(&self.masks) {
            let horizon = d.tan() * tan;
            if horizon > 0.0 && horizon < 1.0 {
                edges.extend([horizon.acos(), -horizon.acos()]);
            }
            // sin φ = tan φo (cos δ cos φ − sin δ tan θ)
            if let Some(m) = mask {
                let (s, c) = d.sin_cos();
                let sine = -m * s * tan / (m * c).hypot(1.0);
                if sine.abs() < 1.0 {
                    edges.push((m * c).atan() + sine.asin());
                }
            }
        }
        edges.retain(|e| e.abs() <= FRAC_PI_2);
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|b, a| *b - *a < 1e-3);
        if let Some(last) = edges.last_mut() {
            *last = FRAC_PI_2;
        }
        edges
    }
}
