//! The albedo of a rough surface in one direction: the mean over visible facets of what each passes on.
//!
//! A hemisphere rule would miss a lobe a ten-thousandth of a radian wide. Over visible facets the integral is one over the
//! unit square, as smooth at α = 1e-4 as at 1; along each line of it the places where light goes below the horizon, or is
//! totally reflected, are found by bisection. In: a surface and ωo. Out: E and its parts, with how far off each may be.

use super::curve::Precision;
use super::facets::{Facet, FacetSpec, PARTS};
use super::fill::Estimate;
use super::quadrature::{Rule, adaptive};
use crate::optics::V3;
use crate::optics::microfacet::{Facets, Shape, mirror};
use std::f64::consts::PI;

/// A rule over visible facets.
pub(super) struct FacetQuadrature {
    along: Rule,
    /// What each piece may be off by around the azimuth.
    error: f64,
}

/// Where along a line the kind of facet is looked at: of mirrors, and of facets that may reflect totally. Twice as many
/// lines are looked at.
const STEPS: [usize; 2] = [16, 32];
/// Most halvings of a piece around the azimuth.
const HALVINGS: usize = 6;

impl FacetQuadrature {
    /// As fine as a precision asks for.
    pub fn new(precision: Precision) -> Self {
        FacetQuadrature { along: Rule::gauss_legendre(precision.polar / 2), error: precision.margin }
    }

    /// E and its parts at `w`, whose z may be negative for a dielectric; and how far off they may be.
    pub fn albedos(&self, spec: &FacetSpec, alpha: [f64; 2], w: V3<f64>) -> [Estimate; PARTS + 1] {
        let facets = Facets::new(spec.shape, alpha);
        let wo = V3::new(w.x, w.y, w.z.abs());
        let (facet, below) = (spec.facet, w.z < 0.0);
        let seen = Seen {
            facets: &facets,
            facet,
            beyond: facet.beyond(below),
            below,
            shape: spec.shape,
            wo,
            squeezed: facets.squeezed(wo),
            reach: facets.reach(wo),
            proposal: facets.proposal().reach(wo),
        };
        // About the azimuth of ωo as the stretched surface sees it. Half the circle will do where the other half is its
        // mirror image.
        let start = (wo.y * alpha[1]).atan2(wo.x * alpha[0]);
        let turns: &[f64] = if alpha[0] == alpha[1] { &[1.0] } else { &[1.0, -1.0] };
        let mut sums = [(0.0, 0.0); PARTS + 1];
        for turn in turns {
            let halves = self.half(&seen, |v| start + turn * PI * (1.0 - v * v));
            for (sum, (value, off)) in sums.iter_mut().zip(halves) {
                let share = 1.0 / turns.len() as f64;
                *sum = (sum.0 + share * value, sum.1 + share * off);
            }
        }
        facet.total(sums)
    }

    /// The mean over half the azimuths, and how far off it may be; `azimuth` is graded toward the far end, where at grazing
    /// angles facets seen edge-on meet. Lines run from the facet that is seen best and are graded toward the steepest ones, among
    /// which a narrow surface keeps everything that is not quite smooth.
    fn half(&self, seen: &Seen<'_>, azimuth: impl Fn(f64) -> f64) -> [Estimate; PARTS + 1] {
        let line = |v: f64| Line { seen, turn: azimuth(v).sin_cos() };
        let ends = changes(|v| line(v).kinds(), 2 * seen.steps());
        let mut inner = |v: f64| {
            let line = line(v);
            let mut sums = [0.0; PARTS + 1];
            for (low, high) in line.pieces() {
                for (s, weight) in self.along.between(low, high) {
                    let weight = weight * 2.0 * (1.0 - s) * 2.0 * v;
                    for (sum, value) in sums.iter_mut().zip(seen.values(line.facet(s))) {
                        *sum += weight * value;
                    }
                }
            }
            sums
        };
        let (mut total, mut from) = ([(0.0, 0.0); PARTS + 1], 0.0);
        for (to, _) in ends {
            let piece = adaptive((from, to), self.error, HALVINGS, &mut inner);
            total = std::array::from_fn(|i| (total[i].0 + piece[i].0, total[i].1 + piece[i].1));
            from = to;
        }
        total
    }
}

/// Facets of one azimuth, from the one that is seen best (s = 0) to the steepest.
struct Line<'s, 'f> {
    seen: &'s Seen<'f>,
    /// Sine and cosine of the azimuth.
    turn: (f64, f64),
}

impl Line<'_, '_> {
    fn facet(&self, s: f64) -> V3<f64> {
        self.seen.facets.seen_at(self.seen.squeezed, self.turn, 1.0 - (1.0 - s) * (1.0 - s))
    }

    fn kind(&self, s: f64) -> Option<Kind> {
        self.seen.kind(self.facet(s))
    }

    /// The pieces on which all facets do the same with light; none of those that there are next to none of.
    fn pieces(&self) -> Vec<(f64, f64)> {
        let mut low = 0.0;
        let mut pieces = Vec::new();
        for (high, kind) in changes(|s| self.kind(s), self.seen.steps()) {
            pieces.extend(kind.is_some().then_some((low, high)));
            low = high;
        }
        pieces
    }

    /// What its facets do, one kind after the other.
    fn kinds(&self) -> Vec<Kind> {
        let steps = self.seen.steps();
        let mut kinds: Vec<Kind> = (0..=steps).filter_map(|k| self.kind(k as f64 / steps as f64)).collect();
        kinds.dedup();
        kinds
    }
}

/// The pieces of [0, 1] on which a value stays the same, as far as steps of 1/`steps` show it: their ends, and the value.
fn changes<T: PartialEq>(of: impl Fn(f64) -> T, steps: usize) -> Vec<(f64, T)> {
    let mut pieces = Vec::new();
    let (mut last, mut value) = (0.0, of(0.0));
    for k in 1..=steps {
        let next = k as f64 / steps as f64;
        // A step may hold several changes.
        while of(next) != value {
            let (mut lo, mut hi) = (last, next);
            for _ in 0..14 {
                let middle = 0.5 * (lo + hi);
                if of(middle) == value { lo = middle } else { hi = middle }
            }
            pieces.push((hi, std::mem::replace(&mut value, of(hi))));
            last = hi;
        }
        last = next;
    }
    pieces.push((1.0, value));
    pieces
}

/// Whether light is mirrored upward, and whether refracted downward; `None` where it is totally reflected.
type Kind = (bool, Option<bool>);

/// A surface seen from one direction.
struct Seen<'f> {
    facets: &'f Facets<f64>,
    facet: Facet,
    /// See [`Facet::beyond`].
    beyond: Option<f64>,
    below: bool,
    shape: Shape,
    wo: V3<f64>,
    /// ωo on the squeezed surface.
    squeezed: V3<f64>,
    reach: f64,
    proposal: f64,
}

impl Seen<'_> {
    /// Cosine of the facet, and the mirrored and the refracted direction; the last is `None` if totally reflected.
    fn directions(&self, h: V3<f64>) -> (f64, V3<f64>, Option<V3<f64>>) {
        let h = h.scale(1.0 / h.length_squared().sqrt().max(1e-300));
        let c = self.wo.dot(h).max(0.0);
        let refracted = self.beyond.and_then(|eta| {
            let cos2 = 1.0 - (1.0 - c * c) / (eta * eta);
            (cos2 > 0.0).then(|| h.scale(c / eta - cos2.sqrt()) - self.wo.scale(1.0 / eta))
        });
        (c, mirror(self.wo, h), refracted)
    }

    /// Steps along a line that its kinds are looked for in.
    fn steps(&self) -> usize {
        STEPS[usize::from(self.beyond.is_some())]
    }

    /// `None` where Gaussian slopes are so steep that they hardly occur.
    fn kind(&self, h: V3<f64>) -> Option<Kind> {
        let [x, y] = self.facets.alpha();
        let none = self.shape == Shape::Beckmann && (h.x / x).powi(2) + (h.y / y).powi(2) > 30.0 * h.z * h.z;
        let (_, up, down) = self.directions(h);
        (!none).then(|| (up.z > 0.0, down.map(|w| w.z < 0.0)))
    }

    fn values(&self, h: V3<f64>) -> [f64; PARTS + 1] {
        let (c, up, down) = self.directions(h);
        let ratio = self.facets.d(h) / self.facets.proposal().d(h).max(1e-300);
        // f·μ/pdf of the proposal, for light reflected and refracted alike.
        let passed = |wi: V3<f64>| {
            let cos = wi.z.abs();
            let shadowed = cos * self.reach + self.wo.z * self.facets.reach(wi);
            ratio * cos * (self.wo.z + self.proposal) / shadowed.max(1e-300)
        };
        let reflected = if up.z > 0.0 { passed(up) } else { 0.0 };
        // Of the bent direction: its cosine with the facet, and what passes on.
        let bent = down.zip(self.beyond).map(|(w, eta)| {
            let cos = (1.0 - (1.0 - c * c) / (eta * eta)).max(0.0).sqrt();
            (cos, if w.z < 0.0 { passed(w) } else { 0.0 })
        });
        self.facet.parts(self.below, (c, reflected), bent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::albedo::facets::white;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Surfaces and directions: any width and stretch, a third at grazing angles.
    fn surface(rng: &mut Pcg64Mcg, even: bool) -> (FacetSpec, [f64; 2], V3<f64>) {
        let mut draw = || rng.random::<f64>();
        let x = 10f64.powf(-4.0 * draw().powi(2));
        let y = if even { x } else { (x * 64f64.powf(2.0 * draw() - 1.0)).clamp(1e-4, 1.0) };
        let cos: f64 = if draw() < 0.3 { 10f64.powf(-9.0 * draw()) } else { draw() };
        let (sin, phi) = ((1.0 - cos * cos).sqrt(), 1.6 * draw());
        let shape = if draw() < 0.5 { Shape::Ggx } else { Shape::Beckmann };
        let side = if even && draw() < 0.5 { -1.0 } else { 1.0 };
        let facet = if even {
            Facet::Dielectric { eta: [0.3, 0.7, 0.99, 1.01, 1.5, 4.0][(6.0 * draw()) as usize] }
        } else {
            Facet::Mirror { reflectance: white, key: [0.0; 8], parts: 1 }
        };
        let w = V3::new(sin * phi.cos(), sin * phi.sin(), side * cos);
        (FacetSpec { shape, alpha: None, facet }, [x, y], w)
    }

    #[test]
    fn albedos_are_as_precise_as_they_say() {
        let mut rng = Pcg64Mcg::seed_from_u64(22);
        let fine = Precision { polar: 160, margin: 1e-8, ..Precision::REFERENCE };
        let truth = FacetQuadrature::new(fine);
        for (precision, count) in [(Precision::FAST, 60), (Precision::STANDARD, 60), (Precision::REFERENCE, 30)] {
            let rule = FacetQuadrature::new(precision);
            for even in [false, true] {
                let mut worst = 0.0f64;
                for _ in 0..count {
                    let (spec, alpha, w) = surface(&mut rng, even);
                    let (found, exact) = (rule.albedos(&spec, alpha, w), truth.albedos(&spec, alpha, w));
                    for (found, exact) in found.iter().zip(exact) {
                        let off = (found.0 - exact.0).abs();
                        assert!(
                            off <= found.1 + 2.0 * precision.margin,
                            "{precision:?} {spec:?} {alpha:?} {w:?}: {found:?} for {exact:?}"
                        );
                        worst = worst.max(off);
                    }
                }
                println!("margin {:e}, dielectric {even}: off by {worst:.1e} at most", precision.margin);
            }
        }
    }
}
