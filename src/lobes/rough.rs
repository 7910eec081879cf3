//! A rough reflecting surface: what microfacet, conductor and Schlick lobes share. Not a lobe itself.
//!
//! f = F(c)·D(h)·G₂/(4·μo·μi) + F̃·M(ωo)·M(ωi)/(π·M̄), c the cosine between direction and facet. The second term gives
//! back what meets a second facet (Kulla & Conty 2017): M(ω) is 1 − E(ω) of the white surface, or a little less, and M̄
//! its mean over the hemisphere, so that E + M ≤ 1 from both sides and f stays symmetric. Of light that goes on to
//! further facets F̃ = F̄²·Ē/(1 − F̄·(1 − Ē)) comes back, F̄ the mean of F over the hemisphere, Ē = 1 − M̄. Where nothing
//! is known of E, M is 0 and the light is lost.

use super::lobe::keeps_seen;
use super::registry::LobeSpec;
use super::{Evaluated, Rgb};
use crate::albedo::facets::{FacetKey, FacetTables, MAX_STRETCH, MIN_ALPHA, PARTS};
use crate::optics::film::{self, Film};
use crate::optics::microfacet::{Facets, Shape, mirror};
use crate::optics::{Over, Real, V3, fresnel, lifted, rgb, sampling};
use std::f64::consts::FRAC_1_PI;

/// The distributions a script may name.
pub(super) const DISTRIBUTIONS: [Shape; 4] = [Shape::Ggx, Shape::Beckmann, Shape::Ggx, Shape::Ggx];

/// Widths as lobes take them: in [1e-4, 1], the smaller one at least 1/64 of the larger.
pub(super) fn widths(alpha: [f32; 2]) -> [f32; 2] {
    let alpha = alpha.map(|a| a.clamp(MIN_ALPHA as f32, 1.0));
    let floor = alpha[0].max(alpha[1]) / MAX_STRETCH as f32;
    alpha.map(|a| a.max(floor))
}

/// The one width that a surface between two media has: the geometric mean of both.
pub(super) fn even(alpha: [f32; 2]) -> f32 {
    let [x, y] = widths(alpha);
    (x * y).sqrt()
}

/// The widths of a table, if both are known: the parameter `first`, which begins at `slot`, and the one after it.
pub(super) fn known_widths(spec: &LobeSpec, first: usize, slot: usize, values: &[Option<f32>]) -> Option<[f64; 2]> {
    known(spec, first, slot, values).map(|alpha| widths(alpha).map(f64::from))
}

/// The same of a surface between two media.
pub(super) fn known_width(spec: &LobeSpec, first: usize, slot: usize, values: &[Option<f32>]) -> Option<[f64; 2]> {
    known(spec, first, slot, values).map(|alpha| [f64::from(even(alpha)); 2])
}

/// The widths of a thin wall of index `eta`. Below 1 it reflects totally beyond an angle and is not stretched either: a
/// table gained up to 9e-3 next to that edge.
pub(super) fn thin(alpha: [f32; 2], eta: f64) -> [f32; 2] {
    if eta < 1.0 { [even(alpha); 2] } else { widths(alpha) }
}

/// The same of a table, if both are known.
pub(super) fn known_thin(
    spec: &LobeSpec,
    first: usize,
    slot: usize,
    values: &[Option<f32>],
    eta: f64,
) -> Option<[f64; 2]> {
    known(spec, first, slot, values).map(|alpha| thin(alpha, eta).map(f64::from))
}

fn known(spec: &LobeSpec, first: usize, slot: usize, values: &[Option<f32>]) -> Option<[f32; 2]> {
    let value = |k: usize| Some(spec.params[first + k].clamp(0, values[slot + k]?));
    Some([value(0)?, value(1)?])
}

/// For tables: the key holds n, then k, then the thickness of a film and its index.
pub(super) fn metal_reflectance(key: &FacetKey, c: f64) -> [f64; 3] {
    let [n0, n1, n2, k0, k1, k2, thickness, ior] = *key;
    Reflectance::metal([n0, n1, n2], [k0, k1, k2], Film { thickness, ior }, thickness > 0.0).at(c, 1.0 - c)
}

/// The key of clear glass with the index `n` per channel under a film.
pub(super) fn coated_glass(n: [f64; 3], [thickness, ior]: [f32; 2]) -> FacetKey {
    [n[0], n[1], n[2], 0.0, 0.0, 0.0, f64::from(thickness), f64::from(ior)]
}

/// Whether `u` in [0, 1) falls below `p`, and `u` stretched back to [0, 1) to be used again.
pub(super) fn split<S: Real>(u: S, p: S) -> (S::Mask, S) {
    let first = u.lt(p);
    let (below, above) = (u / p.max(S::c(1e-6)), (u - p) / (S::one() - p).max(S::c(1e-6)));
    (first, S::select(first, below, above).clamp(S::zero(), S::c(0.999_999_94)))
}

/// Probability of reflecting, not passing, at a facet with reflectance `f` where tints weigh the two with `odds`.
#[inline(always)]
pub(super) fn chance<L: Real>(f: L, odds: [L; 2]) -> L {
    let (back, on) = (f * odds[0], (L::one() - f) * odds[1]);
    L::select((back + on).gt(L::zero()), back / (back + on).max(L::c(1e-30)), L::zero())
}

/// The largest channel.
pub(super) fn largest<S: Real>(color: Rgb<S>) -> S {
    color[0].max(color[1]).max(color[2])
}

/// What a facet reflects.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reflectance<S> {
    /// All.
    White,
    /// n and k per channel.
    Conductor(Rgb<S>, Rgb<S>),
    /// The same under a film.
    Coated(Rgb<S>, Rgb<S>, Film<S>),
    /// F0, F90, and the exponent.
    Schlick(Rgb<S>, Rgb<S>, S),
}

impl<S: Real> Reflectance<S> {
    /// From n and k, under a film if it is `coated`.
    pub(super) fn metal(n: Rgb<S>, k: Rgb<S>, film: Film<S>, coated: bool) -> Self {
        if coated { Reflectance::Coated(n, k, film) } else { Reflectance::Conductor(n, k) }
    }

    /// Of clear glass with the index `n` per channel under a film, if there is one.
    pub(super) fn coated(n: [f64; 3], [thickness, ior]: [f32; 2]) -> Option<Self> {
        let film = Film { thickness: S::from_f32(thickness), ior: S::from_f32(ior) };
        (thickness > 0.0).then(|| Reflectance::Coated(n.map(S::c), [S::zero(); 3], film))
    }

    /// At the cosine `c` between direction and facet; `fall` is 1 − c with all its digits.
    #[inline(always)]
    pub(super) fn at<L: Over<S>>(&self, c: L, fall: L) -> Rgb<L> {
        match self {
            Reflectance::White => [L::one(); 3],
            Reflectance::Conductor(n, k) => rgb!(i => fresnel::conductor(L::lift(n[i]), L::lift(k[i]), c)),
            Reflectance::Coated(n, k, film) => {
                // Phases of many turns, and roots next to the critical angle: in double precision.
                let values = lifted([n[0], n[1], n[2], k[0], k[1], k[2], film.thickness, film.ior]);
                let [n0, n1, n2, k0, k1, k2, thickness, ior] = values;
                L::by_lane([n0, n1, n2, k0, k1, k2, thickness, ior, c], |v| {
                    let film = Film { thickness: v[6], ior: v[7] };
                    std::array::from_fn(|i| film::metal(film, v[i], v[3 + i], v[8], i))
                })
            }
            Reflectance::Schlick(f0, f90, exponent) => {
                let weight = fall.clamp(L::zero(), L::one()).powf(L::lift(*exponent));
                rgb!(i => (L::lift(f90[i]) - L::lift(f0[i])).mul_add(weight, L::lift(f0[i])))
            }
        }
    }

    /// 1 − F, of Schlick's curve with all its digits where F is close to 1.
    #[inline(always)]
    pub(super) fn rest<L: Over<S>>(&self, c: L, fall: L) -> Rgb<L> {
        let Reflectance::Schlick(f0, f90, exponent) = self else {
            return {
                let f = self.at(c, fall);
                rgb!(i => L::one() - f[i])
            };
        };
        let weight = fall.clamp(L::zero(), L::one()).powf(L::lift(*exponent));
        rgb!(i => {
            let (f0, f90) = (L::lift(f0[i]), L::lift(f90[i]));
            (f0 - f90).mul_add(weight, L::one() - f0).max(L::zero())
        })
    }

    /// 2·∫ F(c)·c dc, exactly or by four Gauss points in c² (2e-3 for metals, which costs no energy).
    fn mean(&self) -> Rgb<S> {
        match self {
            Reflectance::White => [S::one(); 3],
            Reflectance::Schlick(f0, f90, p) => {
                let share = S::c(2.0) / ((*p + S::one()) * (*p + S::c(2.0)));
                rgb!(i => (f90[i] - f0[i]).mul_add(share, f0[i]))
            }
            Reflectance::Conductor(..) | Reflectance::Coated(..) => {
                const POINTS: [(f64, f64); 4] = [
                    (0.263_499_221_998_5, 0.173_927_422_568_7),
                    (0.574_464_185_155_5, 0.326_072_577_431_3),
                    (0.818_529_380_366_1, 0.326_072_577_431_3),
                    (0.964_659_633_115_6, 0.173_927_422_568_7),
                ];
                let mut sum = [S::zero(); 3];
                for (c, weight) in POINTS {
                    let f = self.at(S::c(c), S::c(1.0 - c));
                    for i in 0..3 {
                        sum[i] = f[i].mul_add(S::c(weight), sum[i]);
                    }
                }
                sum
            }
        }
    }
}

/// A rough reflecting surface seen from one ωo.
#[derive(Clone, Copy, Debug)]
pub struct Reflector<S> {
    facets: Facets<S>,
    reflectance: Reflectance<S>,
    /// F̃.
    kept: Rgb<S>,
    seen: ReflectorSeen<S>,
}

/// What of a [`Reflector`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct ReflectorSeen<S> {
    wo: V3<S>,
    /// ℓ(ωo) of the surface and of the proposal.
    reach: [S; 2],
    /// F̃/(π·M̄)·M(ωo).
    again: Rgb<S>,
    /// Probability of a cosine-distributed direction.
    even: S,
}

keeps_seen!(Reflector, ReflectorSeen);

impl<S: Real> Reflector<S> {
    pub(super) fn new(
        shape: Shape,
        alpha: [f32; 2],
        reflectance: Reflectance<S>,
        wo: V3<S>,
        tables: &FacetTables<S::Entry>,
    ) -> Self {
        let alpha = widths(alpha).map(S::from_f32);
        let facets = Facets::new(shape, alpha);
        let missing = tables.missing(wo, alpha);
        let mean = tables.mean_missing(false, alpha);
        let kept = reflectance.mean().map(|f| f * f * (S::one() - mean) / (S::one() - f * mean).max(S::c(1e-6)));
        let scale = S::c(FRAC_1_PI) * missing / mean.max(S::c(1e-30));
        let (again, even) = (kept.map(|k| k * scale), missing * largest(kept));
        Reflector { facets, reflectance, kept, seen: ReflectorSeen { wo, reach: facets.reaches(wo), again, even } }
    }

    pub(super) fn roughness(&self) -> S {
        self.facets.roughness()
    }

    #[inline(always)]
    pub(super) fn f<L: Over<S>>(&self, wi: V3<L>, tables: &FacetTables<S::Entry>) -> Rgb<L> {
        self.scattered(wi, tables.missing(wi, self.facets.alpha())).0
    }

    #[inline(always)]
    pub(super) fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.scattered(wi, L::zero()).1
    }

    /// All at once.
    #[inline(always)]
    pub(super) fn evaluate<L: Over<S>>(&self, wi: V3<L>, tables: &FacetTables<S::Entry>, bound: bool) -> Evaluated<L> {
        let missing = tables.missing(wi, self.facets.alpha());
        let (f, pdf) = self.scattered(wi, missing);
        let bound = if bound { self.total(wi, tables, missing, tables.bound(wi)) } else { [L::zero(); 3] };
        Evaluated { f, pdf, bound }
    }

    /// f, where `missing` is what the tables say at ωi, and the density.
    #[inline(always)]
    fn scattered<L: Over<S>>(&self, wi: V3<L>, missing: L) -> (Rgb<L>, L) {
        let wo = V3::<L>::lift(self.seen.wo);
        let h = wo + wi;
        let shadowed = wi.z.mul_add(L::lift(self.seen.reach[0]), wo.z * self.facets.reach(wi));
        let (d, facet) = self.facets.d_and_mirrored_pdf(h, wo.z, L::lift(self.seen.reach[1]));
        let single = d * L::c(0.5) / shadowed.max(L::c(1e-18));
        let c = L::c(0.5) * h.length_squared().sqrt();
        // 1 − c² is the square of half the difference.
        let fall = L::c(0.25) * (wo - wi).length_squared() / (L::one() + c);
        let part = self.reflectance.at(c, fall);
        let even = L::lift(self.seen.even);
        let pdf = (L::one() - even).mul_add(facet, even * sampling::cosine_hemisphere_pdf(wi.z));
        let lit = wo.z.gt(L::zero()) & wi.z.gt(L::zero());
        let f = rgb!(c => {
            let f = part[c].mul_add(single, L::lift(self.seen.again[c]) * missing);
            L::select(lit, f, L::zero())
        });
        (f, L::select(lit, pdf, L::zero()))
    }

    pub(super) fn sample(&self, u: [S; 2]) -> V3<S> {
        let (even, again) = split(u[1], self.seen.even);
        let flat = sampling::cosine_hemisphere([again, u[0]]);
        let bright = mirror(self.seen.wo, self.facets.visible(self.seen.wo, [u[0], again]));
        V3::new(S::select(even, flat.x, bright.x), S::select(even, flat.y, bright.y), S::select(even, flat.z, bright.z))
    }

    /// Best estimate of the albedo.
    pub(super) fn albedo(&self, w: V3<S>, tables: &FacetTables<S::Entry>) -> Rgb<S> {
        self.total(w, tables, tables.missing(w, self.facets.alpha()), tables.view(w))
    }

    /// Never below the albedo.
    #[inline(always)]
    pub(super) fn albedo_bound<L: Over<S>>(&self, w: V3<L>, tables: &FacetTables<S::Entry>) -> Rgb<L> {
        self.total(w, tables, tables.missing(w, self.facets.alpha()), tables.bound(w))
    }

    #[inline(always)]
    fn total<L: Over<S>>(&self, w: V3<L>, tables: &FacetTables<S::Entry>, missing: L, parts: [L; PARTS]) -> Rgb<L> {
        let white = matches!(self.reflectance, Reflectance::White);
        rgb!(c => {
            // Without parts: all that is not missing, which no reflectance exceeds.
            let single = if white || !tables.has_parts() { L::one() - missing } else { parts[c] };
            // A part that is next to nothing may have been rounded below it.
            let sum = missing.mul_add(L::lift(self.kept[c]), single).clamp(L::zero(), L::one());
            L::select(w.z.gt(L::zero()), sum, L::zero())
        })
    }
}
