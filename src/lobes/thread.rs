//! One family of threads lying side by side in the surface, along T: the thread model of Sadeghi et al. 2013.
//!
//! A cone of surface reflection about the thread, its width gamma_s, and light that went through the thread, colored by
//! A and spread by gamma_v. Widths of 2–5° give the sharp streak of silk or a wound spool, 10–15° a linen yarn, 30° and
//! more a dull, nearly diffuse fibre; kd = 0 keeps all transmitted light in the cone, kd = 1 sends it everywhere.
//!
//! As a surface: threads packed side by side shade each other by cos φ, seen and lit, and the seen width shrinks by
//! cos φ too. Shadowing toward both sides, taken as independent, then leaves f equal to the thread's own function,
//! which is symmetric: reciprocal as we count it. About half of what a thread reflects goes down between the others.
//!
//! Where this departs from the source: [`super::cylinder`] says how f is normalised. Toward the thread's ends the volume
//! term still grows as 1/cos θ, so f is divided by max(1, E(ωo), E(ωi)). The tables of E know eta and the widths, not
//! the colors; one of these may vary over the surface, and where several do, E is replaced by a bound over their whole
//! range: darker near the thread's ends, but never gaining. Where f is divided, the albedo estimate is high.

use super::cylinder::{Around, Cylinder, Parts, Ridge, around_thread};
use super::limits::{self, Limits, SlotRange};
use super::lobe::keeps_seen;
use super::registry::{ClosureParams, closure};
use super::{Lobe, Rgb};
use crate::albedo::{AlbedoCurve, COMPONENTS, FibreKey, FibreSpec, TableSpec};
use crate::optics::{Over, Real, V3, lifted, rgb, sampling};
use std::f64::consts::PI;

closure! {
    /// Dielectric threads lying along T: a streak of surface reflection and colored light from inside. One-sided:
    /// black below the surface.
    closure "thread" as ThreadParams {
        /// Shading normal.
        normal N;
        /// Direction of the threads; its part along N is removed.
        vector T;
        /// Color of light that went through the thread.
        color A = [0.3, 0.3, 0.3], in (0.0, 1.0);
        /// Relative index of refraction of the fibre.
        float eta = 1.5, in (1.0, 3.0);
        /// How much of the light from inside leaves evenly rather than in the cone.
        float kd = 0.3, in (0.0, 1.0);
        /// Width of the surface reflection, in degrees: the standard deviation of θh.
        float gamma_s = 12.0, in (1.0, 90.0);
        /// Width of the cone of light from inside, in degrees.
        float gamma_v = 24.0, in (1.0, 90.0);
    }
    source: "Sadeghi, Bisker, De Deken & Jensen 2013, eq. 1-5",
    reciprocal: true,
    class: Scatter,
}

/// The components of the tables: surface, forward, even.
const SURFACE: usize = 0;
const FORWARD: usize = 1;
const EVEN: usize = 2;

/// Where parameters that vary are bounded over their whole range, the components' albedos are at most this; the last
/// two over max(cos θ, [`MIN_COS`]).
const WHOLE_RANGE: [f64; COMPONENTS] = [1.1, 3.6, 1.3];
const MIN_COS: f64 = 0.02;

/// See [`ThreadParams`].
#[derive(Clone, Copy, Debug)]
pub struct Thread<S> {
    cylinder: Cylinder<S>,
    /// A·(1 − kd) and A·kd.
    forward: Rgb<S>,
    even: Rgb<S>,
    /// The varying parameter's place in the table.
    place: S,
    seen: ThreadSeen<S>,
}

/// What of a [`Thread`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct ThreadSeen<S> {
    o: Around<S>,
    /// 1 above the surface, else 0.
    scale: S,
    /// max(1, E(ωo)) per channel.
    excess: Rgb<S>,
    /// Proposals for the surface and forward parts, and how often each is taken; the rest follows the cosine.
    ridges: [Ridge<S>; 2],
    shares: [S; 2],
}

keeps_seen!(Thread, ThreadSeen);

/// The index in [eta, gamma_s, gamma_v] of the only one that is `None`.
fn varying(values: &[Option<f32>]) -> Result<Option<usize>, ()> {
    let spec = ThreadParams::SPEC;
    let free: Vec<usize> = (0..3).filter(|i| values[spec.slot_of(NAMES[*i]).unwrap_or(0)].is_none()).collect();
    if free.len() > 1 { Err(()) } else { Ok(free.first().copied()) }
}

const NAMES: [&str; 3] = ["eta", "gamma_s", "gamma_v"];
const PARAMS: [usize; 3] = [3, 5, 6];

/// The range of one of [`NAMES`].
fn range(index: usize) -> (f64, f64) {
    let p = &ThreadParams::SPEC.params[PARAMS[index]];
    (p.min as f64, p.max as f64)
}

impl<S: Real> Thread<S> {
    /// The albedos' weights in one channel.
    #[inline(always)]
    fn mix<L: Over<S>>(&self, parts: [L; COMPONENTS], channel: usize) -> L {
        let forward = L::lift(self.forward[channel]) * parts[FORWARD];
        L::lift(self.even[channel]).mul_add(parts[EVEN], parts[SURFACE] + forward)
    }

    /// A bound on the components' albedos.
    #[inline(always)]
    fn bounds<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> [L; COMPONENTS] {
        if !curve.fibre().is_empty() {
            return curve.fibre().bound(w, L::lift(self.place));
        }
        let cos = w.y.mul_add(w.y, w.z * w.z).sqrt().max(L::c(MIN_COS));
        let [a, b, c] = WHOLE_RANGE.map(L::c);
        [a, b / cos, c / cos].map(|e| L::select(w.z.gt(L::zero()), e, L::zero()))
    }

    fn kernel(key: &FibreKey, wo: V3<f64>, wi: &[V3<f64>], out: &mut [[f64; COMPONENTS]]) {
        let mut values = [key[0], key[1], key[2]];
        if key[3] >= 0.0 {
            // A square: narrow widths change fastest.
            let index = key[3] as usize;
            let (lo, hi) = range(index);
            values[index] = lo + (hi - lo) * values[index].powi(2);
        }
        let cylinder = Cylinder::<f64>::new(values[0], values[1], values[2], 0.0);
        let o = Around::new(wo);
        for (out, wi) in out.iter_mut().zip(wi) {
            let Parts { surface, forward, even } = cylinder.parts(o, Around::new(*wi));
            *out = [surface, forward, even];
        }
    }
}

impl<S: Real> Lobe<S> for Thread<S> {
    type Params = ThreadParams;
    type Aimed = ThreadSeen<S>;

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let spec = ThreadParams::SPEC;
        let axis = varying(values).ok()?;
        let mut key = [0.0; 16];
        for i in 0..3 {
            let value = values[spec.slot_of(NAMES[i]).unwrap_or(0)];
            key[i] = value.map_or(0.0, |v| spec.params[PARAMS[i]].clamp(0, v) as f64);
        }
        key[3] = axis.map_or(-1.0, |i| i as f64);
        let degrees = |i: usize| if axis == Some(i) { 4.0 } else { key[i] };
        Some(TableSpec::Fibre(FibreSpec {
            kernel: Thread::<f64>::kernel,
            key,
            components: COMPONENTS,
            axis,
            width: 2.0 * degrees(1).min(degrees(2)).to_radians(),
            around: true,
            detail: 1.0,
            // The largest albedo around the thread is looked for at a few angles: the surface reflection exceeds it by
            // up to 0.3 %.
            margin: if axis.is_some() { 5e-3 } else { 0.0 },
            mirrored: true,
            weave: None,
        }))
    }

    /// Linear in A and kd, with the largest albedo of each component.
    fn limits(ranges: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        let spec = ThreadParams::SPEC;
        let clamped = |name: &str| {
            let (slot, p) = (spec.slot_of(name)?, spec.params.iter().find(|p| p.name == name)?);
            let range = |r: &SlotRange| (p.clamp(0, r.0), p.clamp(0, r.1));
            let all = ranges.get(slot..slot + p.ty.slots())?.iter().map(range);
            all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        };
        let values: Vec<Option<f32>> = ranges.iter().map(|r| (r.0 == r.1).then_some(r.0)).collect();
        let table = varying(&values).ok().and_then(|_| Self::table(&values))?;
        let (a, kd) = (clamped("A")?.1 as f64, clamped("kd")?);
        let [surface, forward, even] = limits::components(table);
        let at = |kd: f32| surface + a * ((1.0 - kd as f64) * forward + kd as f64 * even);
        Some(Limits::above(cos, 0.0, at(kd.0).max(at(kd.1)).min(1.0)))
    }

    fn new(params: &ThreadParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let (zero, one, p) = (S::zero(), S::one(), params);
        let [eta, gamma_s, gamma_v, kd] = [p.eta, p.gamma_s, p.gamma_v, p.kd].map(S::from_f32);
        let o = Around::new(wo);
        // Where a table runs over a parameter, only one is unknown to it; reading needs that one's place.
        let place = |index: usize, value: S| {
            let (lo, hi) = range(index);
            ((value - S::c(lo)) / S::c(hi - lo)).safe_sqrt()
        };
        let places = [place(0, eta), place(1, gamma_s), place(2, gamma_v)];
        let radians = S::c(2.0 * PI / 180.0);
        let ridge = |gamma: S| Ridge::new(-o.angle(), gamma * radians);
        let a = p.A.map(S::from_f32);
        let mut lobe = Thread {
            cylinder: Cylinder::new(eta, gamma_s, gamma_v, zero),
            forward: a.map(|a| a * (one - kd)),
            even: a.map(|a| a * kd),
            seen: ThreadSeen {
                o,
                scale: S::select(wo.z.gt(zero), one, zero),
                excess: [one; 3],
                ridges: [ridge(gamma_s), ridge(gamma_v)],
                shares: [zero; 2],
            },
            place: curve.fibre().axis_index().map_or(zero, |i| places[i.min(2)]),
        };
        let e = lobe.bounds(wo, curve);
        for c in 0..3 {
            lobe.seen.excess[c] = lobe.mix(e, c).max(one);
        }
        let seen = if curve.fibre().is_empty() { [0.05, 0.7, 0.5].map(S::c) } else { e };
        let mean = |x: Rgb<S>| (x[0] + x[1] + x[2]) * S::c(1.0 / 3.0);
        let parts = [seen[SURFACE], seen[FORWARD] * mean(lobe.forward), seen[EVEN] * mean(lobe.even)];
        // A tenth follows the cosine in any case: it bounds the weights.
        let total = S::c(0.9) / (parts[0] + parts[1] + parts[2]).max(S::c(1e-9));
        lobe.seen.shares = [parts[0] * total, parts[1] * total];
        lobe
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let Parts { surface, forward, even } = self.cylinder.parts(Around::<L>::lift(self.seen.o), Around::new(wi));
        let e = self.bounds(wi, curve);
        let scale = L::select(wi.z.gt(L::zero()), L::lift(self.seen.scale), L::zero());
        rgb!(c => {
            let excess = self.mix(e, c).max(L::lift(self.seen.excess[c]));
            scale * self.mix([surface, forward, even], c) / excess
        })
    }

    /// A mixture of three: θi by each ridge with φi by its cosine, and the cosine over the hemisphere.
    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        let i = Around::new(wi);
        let theta = i.angle();
        let [a, b] = lifted::<_, L, 2>(self.seen.shares);
        let ridges = a * self.seen.ridges[0].pdf(theta) + b * self.seen.ridges[1].pdf(theta);
        let inv = L::c(0.5) / i.cos.sq().max(L::c(1e-12));
        let even = (L::one() - a - b) * L::c(1.0 / PI);
        wi.z.max(L::zero()) * ridges.mul_add(inv, even)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        let [a, b] = self.seen.shares;
        let (first, second) = (u[0].lt(a), u[0].lt(a + b));
        let choose = |x: S, y: S, z: S| S::select(first, x, S::select(second, y, z));
        let rest = (S::one() - a - b).max(S::c(1e-6));
        let tiny = S::c(1e-9);
        let v = choose(u[0] / a.max(tiny), (u[0] - a) / b.max(tiny), (u[0] - a - b) / rest);
        let v = v.clamp(S::zero(), S::one());
        let theta = S::select(first, self.seen.ridges[0].sample(v), self.seen.ridges[1].sample(v));
        let (ridge, even) = (around_thread(theta, u[1]), sampling::cosine_hemisphere([v, u[1]]));
        let pick = |ridge: S, even: S| S::select(second, ridge, even);
        V3::new(pick(ridge.x, even.x), pick(ridge.y, even.y), pick(ridge.z, even.z))
    }

    /// Exact where f is not divided. Where it is, an upper estimate: E before the division over the excess at `w` alone,
    /// though each f is divided by the larger excess of its two directions.
    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        let e = if curve.fibre().is_empty() { self.bounds(w, curve) } else { curve.fibre().view(w, self.place) };
        let bound = self.bounds(w, curve);
        rgb!(c => self.mix(e, c) / self.mix(bound, c).max(S::one()))
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let e = self.bounds(w, curve);
        rgb!(c => self.mix(e, c).min(L::one()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::albedo::Precision;

    #[test]
    fn the_whole_range_is_bounded() {
        let mut largest = [0.0f64; COMPONENTS];
        for (eta, gamma) in
            [1.0, 1.3, 2.0, 3.0].iter().flat_map(|e| [1.0, 3.0, 10.0, 30.0, 60.0, 90.0].map(|g| (*e, g)))
        {
            let mut values = [Some(0.3f32); 13];
            (values[9], values[11], values[12]) = (Some(eta), Some(gamma), Some(gamma));
            let curve = Thread::<f32>::table(&values).expect("known").bake::<f64>(Precision::FAST);
            for k in 0..2000 {
                let (theta, phi) = ((k % 50) as f64 / 49.0, (k / 50) as f64 / 40.0);
                let (theta, phi) = (PI / 2.0 * (1.0 - (1.0 - theta).powi(3)), PI / 2.0 * phi);
                let (s, c) = theta.sin_cos();
                let w = V3::new(s, c * phi.sin(), c * phi.cos());
                let [a, b, d] = curve.fibre().view(w, 0.0);
                let cos = c.max(MIN_COS);
                for (l, e) in largest.iter_mut().zip([a, b * cos, d * cos]) {
                    *l = l.max(e);
                }
            }
        }
        println!("largest {largest:?}");
        assert!((0..COMPONENTS).all(|c| largest[c] < WHOLE_RANGE[c]), "{largest:?}");
        assert!((0..COMPONENTS).all(|c| 1.3 * largest[c] > WHOLE_RANGE[c]), "needlessly wide: {largest:?}");
    }
}
