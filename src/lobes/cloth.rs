//! Woven cloth of two families of threads: what the forms of `microcylinder` share (Sadeghi et al. 2013, §6). Not a
//! lobe itself.
//!
//! The warp runs along x, the weft along y. Each family covers a part of the cloth, and its threads bend over and under
//! one another: their tangents leave the surface by offsets that follow a piecewise-linear curve. With t over the
//! tangents, a their areas, S the thread's function and z⁺ the cosine to the tangent's own normal:
//!
//! f = Σ a·S·M(ωi, ωo) / (Q(ωi)·Q(ωo)), M = (1 − u)·zi⁺·zo⁺ + u·min(cos φi⁺, cos φo⁺)·cos θi·cos θo,
//! Q(ω) = Σ a·z⁺ + (1 − a₁ − a₂)·μ.
//!
//! M is the paper's shadowing and masking, u its blend toward full correlation when both directions are on the same
//! side of the thread; Q its reweighting, which lets what is seen of all threads fill the cloth's area.
//!
//! Where this departs from the paper: it reweights the viewer's side alone, so that its cloth is not reciprocal (seen
//! from the light, E reaches 59); here light and viewer are treated alike. With flat threads and u = 0 this is a·S, as
//! for the `thread` lobe. u = exp(−(1 − cos φd)/σ²), σ = 20°, in place of a Gaussian in φd: the same to third order.
//! The curve of offsets is replaced by [`TANGENTS`] tangents, each widened by the spread of those it stands for.

use super::cloth_family::{Family, FamilySeen};
use super::registry::ClosureParams;
use super::{Aimed, Lobe, Rgb, Rgb32};
use crate::albedo::{AlbedoCurve, COMPONENTS, FibreKernel, FibreKey, FibreSpec, HORIZON, Ridges, TableSpec};
use crate::optics::{F32x8, Lanes, Over, Real, V3, dispatch, lifted, rgb, sampling};
use std::marker::PhantomData;

/// Tangents per family.
pub const TANGENTS: usize = 5;

/// One family of threads, angles in degrees.
#[derive(Clone, Copy, Debug)]
pub struct Yarn {
    pub color: Rgb32,
    pub eta: f32,
    pub kd: f32,
    pub gamma_s: f32,
    pub gamma_v: f32,
    /// Part of the cloth's area.
    pub cover: f32,
    /// First and last offset of the tangents.
    pub lo: f32,
    pub hi: f32,
    /// How often each of the offsets between them occurs.
    pub weights: &'static [f64; TANGENTS],
}

/// Offsets spread evenly from the first to the last.
pub const EVENLY: &[f64; TANGENTS] = &weights(&[-1.0, 1.0]);

/// All threads flat.
pub const FLAT: &[f64; TANGENTS] = &[1.0, 0.0, 0.0, 0.0, 0.0];

/// How much of a piecewise-linear curve, its segments equally long, falls to each of the evenly spaced offsets from its
/// least to its largest value: each point of it is shared by the two offsets it lies between.
pub const fn weights(curve: &[f64]) -> [f64; TANGENTS] {
    const STEPS: usize = 256;
    let (mut lo, mut hi) = (curve[0], curve[0]);
    let mut i = 1;
    while i < curve.len() {
        if curve[i] < lo {
            lo = curve[i];
        }
        if curve[i] > hi {
            hi = curve[i];
        }
        i += 1;
    }
    let mut weights = [0.0; TANGENTS];
    let segments = curve.len() - 1;
    let share = 1.0 / (segments * STEPS) as f64;
    let mut segment = 0;
    while segment < segments {
        let mut step = 0;
        while step < STEPS {
            let along = (step as f64 + 0.5) / STEPS as f64;
            let value = curve[segment] + (curve[segment + 1] - curve[segment]) * along;
            let place = (value - lo) / (hi - lo) * (TANGENTS - 1) as f64;
            let at = place as usize;
            let at = if at > TANGENTS - 2 { TANGENTS - 2 } else { at };
            let part = place - at as f64;
            weights[at] += share * (1.0 - part);
            weights[at + 1] += share * part;
            step += 1;
        }
        segment += 1;
    }
    weights
}

/// Least Q: where no thread shows itself. Tiny, so that the cloth does not fade toward the horizon.
const MIN_Q: f64 = 1e-12;
/// The components of the tables.
const SURFACE: usize = 0;
const WARP: usize = 1;
const WEFT: usize = 2;

/// A cloth prepared for one ωo.
#[derive(Clone, Copy, Debug)]
pub struct Cloth<S> {
    families: [Family<S>; 2],
    /// What lies between the threads: 1 − a₁ − a₂.
    gap: S,
    /// Q(ω) is nowhere less than this times μ.
    level: S,
    seen: ClothSeen<S>,
}

/// What of a [`Cloth`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct ClothSeen<S> {
    wo: V3<S>,
    /// 1/Q(ωo) above the surface, else 0.
    scale: S,
    /// max(1, E(ωo)) per channel.
    excess: Rgb<S>,
    families: [FamilySeen<S>; 2],
}

/// The weft's thread coordinates: along y.
#[inline(always)]
fn across<R: Real>(w: V3<R>) -> V3<R> {
    V3::new(w.y, -w.x, w.z)
}

/// A direction no closer to the horizon than [`HORIZON`].
#[inline(always)]
fn raised<R: Real>(w: V3<R>) -> V3<R> {
    V3::new(w.x, w.y, w.z.max(R::c(HORIZON)))
}

impl<S: Real> Cloth<S> {
    pub fn new(yarns: &[Yarn; 2], wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        Self::prepare(yarns, wo, curve, true)
    }

    fn prepare(yarns: &[Yarn; 2], wo: V3<S>, curve: &AlbedoCurve<S::Entry>, samples: bool) -> Self {
        let (above, wo) = (wo.z.gt(S::zero()), raised(wo));
        let total = (yarns[0].cover as f64 + yarns[1].cover as f64).max(1.0);
        let covered = (yarns[0].cover + yarns[1].cover).max(1e-6);
        let sampled = |i: usize| (yarns[i].cover / covered) as f64;
        let share = |i: usize| Yarn { cover: (yarns[i].cover as f64 / total) as f32, ..yarns[i] };
        let families = [Family::new(&share(0)), Family::new(&share(1))];
        let gap = (S::one() - families[0].cover - families[1].cover).max(S::zero());
        let one = S::one();
        // Offsets in pairs ±δ give at least 2·cos δ·μ together; nothing is known of others.
        let level = |i: usize| {
            let (count, tangents) = families[i].tangents();
            let cosines: f64 = families[i].weights[..count].iter().zip(tangents).map(|(w, t)| w * t.0).sum();
            families[i].cover * S::c(if symmetric(&yarns[i]) { cosines } else { 0.0 })
        };
        let level = (gap + level(0) + level(1)).max(S::c(1e-6));
        let views = [wo, across(wo)];
        let each = [0, 1].map(|i| families[i].seen_from(views[i], sampled(i), samples));
        let seen = ClothSeen { wo, scale: one, excess: [one; 3], families: each };
        let mut cloth = Cloth { families, gap, level, seen };
        let (_, _, q) = cloth.sums::<S>(wo);
        cloth.seen.scale = S::select(above, one / q, S::zero());
        // Integrating needs no division.
        let e = if samples { cloth.bounds(wo, curve) } else { [S::zero(); COMPONENTS] };
        for c in 0..3 {
            cloth.seen.excess[c] = cloth.mix(e, c).max(one);
        }
        cloth
    }

    /// The surface sum, the volume sums and Q(ωi).
    #[inline(always)]
    fn sums<L: Over<S>>(&self, wi: V3<L>) -> (L, [L; 2], L) {
        let (wo, wi) = (V3::<L>::lift(self.seen.wo), raised(wi));
        let mut q = L::lift(self.gap) * wi.z;
        let (mut surface, mut volume) = (L::zero(), [L::zero(); 2]);
        self.families[0].add(wo, wi, &mut surface, &mut volume[0], &mut q);
        self.families[1].add(across(wo), across(wi), &mut surface, &mut volume[1], &mut q);
        (surface, volume, q.max(L::c(MIN_Q)))
    }

    #[inline(always)]
    fn parts<L: Over<S>>(&self, wi: V3<L>) -> [L; COMPONENTS] {
        let (surface, volume, q) = self.sums(wi);
        let scale = L::select(wi.z.gt(L::zero()), L::lift(self.seen.scale) / q, L::zero());
        [surface * scale, volume[0] * scale, volume[1] * scale]
    }

    /// What one family adds to [`parts`](Self::parts).
    #[inline(always)]
    fn part<L: Over<S>>(&self, family: usize, wi: V3<L>) -> [L; COMPONENTS] {
        let above = wi.z.gt(L::zero());
        let (wo, wi) = (V3::<L>::lift(self.seen.wo), raised(wi));
        let views = [(wo, wi), (across(wo), across(wi))];
        let (mut surface, mut volume) = (L::zero(), L::zero());
        let mut q = L::lift(self.gap).mul_add(wi.z, self.families[1 - family].seen(views[1 - family].1));
        let (wo, turned) = views[family];
        self.families[family].add(wo, turned, &mut surface, &mut volume, &mut q);
        let scale = L::select(above, L::lift(self.seen.scale) / q.max(L::c(MIN_Q)), L::zero());
        let mut parts = [surface * scale, L::zero(), L::zero()];
        parts[WARP + family] = volume * scale;
        parts
    }

    #[inline(always)]
    fn mix<L: Over<S>>(&self, parts: [L; COMPONENTS], channel: usize) -> L {
        let warp = L::lift(self.families[0].color[channel]) * parts[WARP];
        L::lift(self.families[1].color[channel]).mul_add(parts[WEFT], parts[SURFACE] + warp)
    }

    /// Bounds on the components' albedos: from the table or, where there is none, as [`cloth_range`] derives.
    #[inline(always)]
    fn bounds<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> [L; COMPONENTS] {
        if !curve.fibre().is_empty() {
            return curve.fibre().bound(w, L::zero());
        }
        let (above, w) = (w.z.gt(L::zero()), raised(w));
        let [warp, weft] = [self.families[0].facing(w), self.families[1].facing(across(w))];
        let q = L::lift(self.gap).mul_add(w.z, warp[0] + weft[0]).max(L::c(MIN_Q));
        let scale = L::select(above, L::one() / (q * L::lift(self.level)), L::zero());
        [(warp[1] + weft[1]) * scale, warp[2] * scale, weft[2] * scale]
    }

    #[inline(always)]
    pub fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let (parts, e) = (self.parts(wi), self.bounds(wi, curve));
        rgb!(c => self.mix(parts, c) / self.mix(e, c).max(L::lift(self.seen.excess[c])))
    }

    /// Which part of the samples follows the families' ridges; the rest follows the cosine.
    #[inline(always)]
    fn shares(&self) -> [S; 2] {
        [self.seen.families[0].share, self.seen.families[1].share]
    }

    #[inline(always)]
    pub fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        let [a, b] = lifted::<_, L, 2>(self.shares());
        let ([warp, weft], wo) = (&self.seen.families, self.seen.wo);
        let ridges =
            a * self.families[0].density(wo, warp, wi) + b * self.families[1].density(across(wo), weft, across(wi));
        let even = (L::one() - a - b) * L::c(std::f64::consts::FRAC_1_PI);
        L::select(wi.z.gt(L::zero()), even.mul_add(wi.z, ridges), L::zero())
    }

    pub fn sample(&self, u: [S; 2]) -> V3<S> {
        let [a, b] = self.shares();
        let (first, second) = (u[0].lt(a), u[0].lt(a + b));
        let choose = |x: S, y: S, z: S| S::select(first, x, S::select(second, y, z));
        let tiny = S::c(1e-9);
        let v = choose(u[0] / a.max(tiny), (u[0] - a) / b.max(tiny), (u[0] - a - b) / (S::one() - a - b));
        let v = v.clamp(S::zero(), S::one());
        let views = [self.seen.wo, across(self.seen.wo)];
        let [warp, weft] = [0, 1].map(|i| self.families[i].sample(views[i], &self.seen.families[i], v, u[1]));
        let even = sampling::cosine_hemisphere([v, u[1]]);
        // The inverse of `across`.
        V3::new(choose(warp.x, -weft.y, even.x), choose(warp.y, weft.x, even.y), choose(warp.z, weft.z, even.z))
    }

    /// Where f is divided, an upper estimate: by the excess at `w` alone.
    pub fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        let bound = self.bounds(w, curve);
        let e = if curve.fibre().is_empty() { bound } else { curve.fibre().view(w, S::zero()) };
        rgb!(c => self.mix(e, c) / self.mix(bound, c).max(S::one()))
    }

    #[inline(always)]
    pub fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        let e = self.bounds(w, curve);
        rgb!(c => self.mix(e, c).min(L::one()))
    }
}

/// Whether every offset occurs as often as its opposite.
fn symmetric(y: &Yarn) -> bool {
    let flat = y.lo == 0.0 && y.hi == 0.0;
    flat || y.lo == -y.hi && (0..TANGENTS).all(|i| (y.weights[i] - y.weights[TANGENTS - 1 - i]).abs() < 1e-9)
}

/// The tangents' offsets in radians, those that occur.
fn offsets(y: &Yarn) -> [f64; TANGENTS] {
    let step = (y.hi - y.lo) as f64 / (TANGENTS - 1) as f64;
    std::array::from_fn(|k| (y.lo as f64 + step * k as f64).to_radians())
}

/// The parameters of a closure that is a cloth.
pub trait ClothParams: ClosureParams {
    /// See [`Lobe::table`].
    fn table(values: &[Option<f32>]) -> Option<TableSpec>;
    /// The two families of threads.
    fn yarns(&self) -> [Yarn; 2];
}

/// The lobe of a cloth whose threads follow from `P`.
#[derive(Clone, Copy, Debug)]
pub struct Woven<S, P> {
    cloth: Cloth<S>,
    params: PhantomData<P>,
}

impl<S: Real, P: ClothParams> Aimed<Woven<S, P>> for ClothSeen<S> {
    #[inline(always)]
    fn of(lobe: &Woven<S, P>) -> Self {
        lobe.cloth.seen
    }

    #[inline(always)]
    fn with<'a>(&self, rest: impl FnOnce() -> Option<&'a Woven<S, P>>) -> Option<Woven<S, P>>
    where
        Woven<S, P>: 'a,
    {
        rest().map(|rest| Woven { cloth: Cloth { seen: *self, ..rest.cloth }, ..*rest })
    }
}

impl<S: Real, P: ClothParams> Lobe<S> for Woven<S, P> {
    type Params = P;
    type Aimed = ClothSeen<S>;

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        P::table(values)
    }

    fn new(params: &P, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        Woven { cloth: Cloth::new(&params.yarns(), wo, curve), params: PhantomData }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.cloth.f(wi, curve)
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.cloth.pdf(wi)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        self.cloth.sample(u)
    }

    /// Exact where f is not divided; where it is, an upper estimate, as for `thread`.
    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        self.cloth.albedo(w, curve)
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.cloth.albedo_bound(w, curve)
    }
}

/// What to bake for a cloth that `kernel` integrates: [`integrate`] of the yarns its key stands for.
pub fn table(kernel: FibreKernel, key: FibreKey, yarns: &[Yarn; 2]) -> TableSpec {
    let weave = [0, 1].map(|i| {
        let (y, twice) = (&yarns[i], |degrees: f32| 2.0 * (degrees as f64).to_radians());
        let spread = twice(y.hi - y.lo) / ((TANGENTS - 1) as f64 * 12f64.sqrt());
        Ridges {
            width: twice(y.gamma_s.min(y.gamma_v)).hypot(spread),
            reach: twice(y.lo.abs().max(y.hi.abs())),
            offsets: offsets(y),
        }
    });
    let mirrored = yarns.iter().all(symmetric);
    TableSpec::Fibre(FibreSpec {
        kernel,
        key,
        components: COMPONENTS,
        axis: None,
        width: weave[0].width.min(weave[1].width),
        around: true,
        // Two sheets in the time of one: threads that stand out of the cloth reflect smoothly.
        detail: if mirrored { 0.7 } else { 0.485 },
        // The quadrature follows the kinks in φ, not in θ.
        margin: 5e-3,
        mirrored,
        weave: Some(weave),
    })
}

/// One family's components of f for many ωi, before any division.
pub fn integrate(yarns: &[Yarn; 2], family: usize, wo: V3<f64>, wi: &[V3<f64>], out: &mut [[f64; COMPONENTS]]) {
    // Eight at a time in single precision, in the widest vectors at hand: these sums are what baking a cloth spends its
    // time on.
    let cloth = Cloth::<f32>::prepare(yarns, wo.map(|x| x as f32), &AlbedoCurve::default(), false);
    dispatch::lanes(Ring { cloth: &cloth, family, wi, out });
}

/// The work of [`integrate`].
struct Ring<'a> {
    cloth: &'a Cloth<f32>,
    family: usize,
    wi: &'a [V3<f64>],
    out: &'a mut [[f64; COMPONENTS]],
}

impl dispatch::LaneWork for Ring<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (out, wi) in self.out.chunks_mut(F32x8::LANES).zip(self.wi.chunks(F32x8::LANES)) {
            let rows = std::array::from_fn(|k| wi[k.min(wi.len() - 1)]).map(|w| [w.x, w.y, w.z].map(|x| x as f32));
            let [surface, warp, weft] = self.cloth.part(self.family, L::load(&rows));
            for (out, parts) in out.iter_mut().zip(L::store([surface, warp, weft, L::zero()])) {
                *out = [parts[0], parts[1], parts[2]].map(f64::from);
            }
        }
    }
}
