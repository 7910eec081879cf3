//! A rough surface between two media: reflection and refraction, shared by the dielectric lobes. Not a lobe itself.
//!
//! With h = ω₁ + η·ω₂, ω₁ the direction outside, ω₂ the one inside and η the inside's index over the outside's,
//! refraction is (Walter et al. 2007, eq. 21, as flux)
//!
//! f = (1 − F)·|ωo·h|·|ωi·h|·n²·D(h)·G₂/(μo·μi·|h|⁴),  n = η if ωi is inside, else 1,
//!
//! all with h as it comes: the paper's last denominator is then |h|² itself. What meets a second facet is given back
//! nearly evenly on both sides: x·M(ωo)·M(ωi)/(π·M̄) and (1 − x)·M(ωo)·M′(ωi)/(π·M̄′), primes on the far side (Kulla &
//! Conty 2017). Either way across carries the same flux if (1 − x)·M̄ = (1 − x′)·η²·M̄′; we take
//! T·min(M̄, η²·M̄′) for both, T = 4η/(1 + η)². Then reflection and refraction sum to E + M from both media.
//!
//! A reflectance of another shape than Fresnel's, per channel, is taken at the cosine outside, from either side; what is
//! totally reflected stays so. Second bounces are then divided as by the plain surface of that index.
//!
//! Limit: such a surface is not stretched, two widths count as their geometric mean. Next to the edge of total reflection
//! the albedo of a stretched one turns so fast with azimuth and cosine that no small table keeps it below 1.
//!
//! Shadowing is 1/(1 + Λo + Λi) for both, as renderers do; the exact form for refraction is a Beta function.

use super::lobe::keeps_seen;
use super::rough::{Reflectance, chance, even, largest, split};
use super::{Evaluated, Rgb, Sides};
use crate::albedo::facets::{FacetPlace, FacetTables, PARTS};
use crate::optics::film::{self, Film};
use crate::optics::microfacet::{Facets, Shape, mirror};
use crate::optics::{Over, Real, V3, array, fresnel, lifted, rgb, sampling};
use std::f64::consts::FRAC_1_PI;

/// The index that is used for a script's: between 1/4 and 4, and no closer to 1 than 1 %, where refraction would become
/// a delta lobe.
pub(super) fn index(eta: f32) -> f64 {
    let eta = f64::from(eta).clamp(0.25, 4.0);
    if eta >= 1.0 { eta.max(1.01) } else { eta.min(0.99) }
}

#[inline(always)]
fn mean<L: Real>(color: Rgb<L>) -> L {
    (color[0] + color[1] + color[2]) * L::c(1.0 / 3.0)
}

/// Reflected and refracted parts per channel, of a table that knows of no channels, …
#[inline(always)]
fn split_grey<L: Real>([back, on]: [L; 2]) -> [Rgb<L>; 2] {
    [[back; 3], [on; 3]]
}

/// … and of one that does.
#[inline(always)]
fn split_colored<L: Real>([a, b, c, d, e, f]: [L; PARTS]) -> [Rgb<L>; 2] {
    [[a, b, c], [d, e, f]]
}

/// A rough surface between two media, seen from one ωo. z > 0 is the outside.
#[derive(Clone, Copy, Debug)]
pub struct Interface<S> {
    facets: Facets<S>,
    /// Index of the inside over that of the outside.
    eta: f64,
    /// η² − 1 for ωo outside, and inside, η the far side's index over the near side's.
    steps: [S; 2],
    /// A reflectance per channel at the cosine outside; `None`: Fresnel's.
    colored: Option<Reflectance<S>>,
    reflected: Rgb<S>,
    refracted: Rgb<S>,
    /// Largest channels of the tints.
    odds: [S; 2],
    sides: Sides,
    /// Of ωo outside, and inside.
    media: [Medium<S>; 2],
    seen: InterfaceSeen<S>,
}

/// What of an [`Interface`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceSeen<S> {
    wo: V3<S>,
    /// The far side's index over that of ωo's side.
    far: S,
    /// +1 if ωo is outside, −1 inside.
    side: S,
    /// ℓ(ωo) of the surface and of the proposal.
    reach: [S; 2],
    /// M(ωo)/(π·M̄)·x, and M(ωo)/(π·M̄′)·(1 − x).
    again: [S; 2],
    /// 1 − x on ωo's side, and on the other.
    crossing: [S; 2],
    /// Probability of an even direction, and of it being on the far side.
    even: S,
    across: S,
}

keeps_seen!(Interface, InterfaceSeen);

/// What depends on the side that ωo is on alone.
#[derive(Clone, Copy, Debug)]
struct Medium<S> {
    /// 1 − x here.
    crossing: S,
    /// `again` over M(ωo)/π.
    again: [S; 2],
    /// Of even directions, the share that crosses.
    across: S,
    /// 1 if there are even directions, else 0.
    any: S,
}

impl<S: Real> Medium<S> {
    /// 1 − x, M̄ on this side and on the far one.
    fn new(crossing: S, near: S, far: S, odds: [S; 2]) -> Self {
        let tiny = S::c(1e-30);
        let [back, on] = [(S::one() - crossing) * odds[0], crossing * odds[1]];
        Medium {
            crossing,
            again: [(S::one() - crossing) / near.max(tiny), crossing / far.max(tiny)],
            across: on / (back + on).max(tiny),
            any: S::select((back + on).gt(S::zero()), S::one(), S::zero()),
        }
    }
}

impl<S: Real> InterfaceSeen<S> {
    #[inline(always)]
    fn new(facets: &Facets<S>, eta: f64, [up, down]: &[Medium<S>; 2], wo: V3<S>, missing: S) -> Self {
        let outside = wo.z.gt(S::zero());
        // Both are at hand, because a Real cannot branch.
        let pick = |a: S, b: S| S::select(outside, a, b);
        let missing = missing * S::c(FRAC_1_PI);
        InterfaceSeen {
            wo,
            far: pick(S::c(eta), S::c(1.0 / eta)),
            side: pick(S::one(), -S::one()),
            reach: facets.reaches(wo),
            again: [missing * pick(up.again[0], down.again[0]), missing * pick(up.again[1], down.again[1])],
            crossing: [pick(up.crossing, down.crossing), pick(down.crossing, up.crossing)],
            even: S::c(1.0 / FRAC_1_PI) * missing * pick(up.any, down.any),
            across: pick(up.across, down.across),
        }
    }
}

impl<S: Real> Interface<S> {
    /// `eta` as [`index`] gives it, the inside over the outside, and a reflectance if not Fresnel's; tints for what is reflected and refracted.
    pub(super) fn new(
        shape: Shape,
        alpha: [f32; 2],
        (eta, colored): (f64, Option<Reflectance<S>>),
        tints: [Rgb<f32>; 2],
        wo: V3<S>,
        tables: &FacetTables<S::Entry>,
    ) -> Self {
        let facets = Facets::new(shape, [S::from_f32(even(alpha)); 2]);
        let sides = Sides::tinted(tints);
        let [reflected, refracted] = tints.map(|t| t.map(S::from_f32));
        let odds = [largest(reflected), largest(refracted)];
        let (up, down) = (tables.mean_missing(false, facets.alpha()), tables.mean_missing(true, facets.alpha()));
        let inside_flux = S::c(eta * eta) * down;
        let shared = S::c(4.0 * eta / ((1.0 + eta) * (1.0 + eta))) * up.min(inside_flux);
        let tiny = S::c(1e-30);
        let outside = Medium::new(shared / up.max(tiny), up, down, odds);
        let inside = Medium::new(shared / inside_flux.max(tiny), down, up, odds);
        let media = [outside, inside];
        let seen = InterfaceSeen::new(&facets, eta, &media, wo, tables.missing(wo, facets.alpha()));
        let steps = [eta, 1.0 / eta].map(|far| S::c((far - 1.0) * (far + 1.0)));
        Interface { facets, eta, steps, colored, reflected, refracted, odds, sides, media, seen }
    }

    /// The same surface seen from another ωo, its albedo and, if it is asked for, its bound there.
    #[inline(always)]
    pub(super) fn seen_from(&self, wo: V3<S>, tables: &FacetTables<S::Entry>, bound: bool) -> (Self, [Rgb<S>; 2]) {
        let alpha = self.facets.alpha();
        let place = tables.place(wo, alpha[0]);
        let missing = tables.missing_at(&place, alpha);
        let seen = InterfaceSeen::new(&self.facets, self.eta, &self.media, wo, missing);
        let bound = if bound { self.bound(&seen, wo, &place, missing, tables) } else { [S::zero(); 3] };
        (Interface { seen, ..*self }, [self.estimate(&seen, wo, &place, missing, tables), bound])
    }

    /// Whether ωi lies on ωo's side, and whether on the other.
    #[inline(always)]
    fn sides<L: Over<S>>(seen: &InterfaceSeen<S>, wi: V3<L>) -> (L::Mask, L::Mask) {
        let (cos_o, cos_i) = (L::lift(seen.wo.z), wi.z);
        let lit = cos_o.abs().gt(L::zero()) & cos_i.abs().gt(L::zero());
        let same = (cos_i * L::lift(seen.side)).gt(L::zero());
        (lit & same, lit & !same)
    }

    /// Of refraction from ωo to ωi: h, the product of the cosines times n²/|h|⁴ (0 where no facet does it), 1 − F.
    #[inline(always)]
    fn refraction<L: Over<S>>(&self, seen: &InterfaceSeen<S>, wi: V3<L>) -> (V3<L>, L, Rgb<L>) {
        let (wo, eta) = (V3::<L>::lift(seen.wo), self.eta);
        let outside = L::lift(seen.side).gt(L::zero());
        let pick = |a: L, b: L| L::select(outside, a, b);
        let out = V3::new(pick(wo.x, wi.x), pick(wo.y, wi.y), pick(wo.z, wi.z));
        let inn = V3::new(pick(wi.x, wo.x), pick(wi.y, wo.y), pick(wi.z, wo.z));
        // Toward the outside; what cancels is rounded once.
        let sign = if eta > 1.0 { -1.0 } else { 1.0 };
        let sum = |a: L, b: L| b.turned(sign * eta, a, sign);
        let h = V3::new(sum(out.x, inn.x), sum(out.y, inn.y), sum(out.z, inn.z));
        let length2 = h.length_squared().max(L::c(1e-12));
        let n2 = pick(L::c(eta * eta), L::one());
        if let Some(law) = &self.colored {
            // The cosines, and what the outer one lacks of 1 from the sine: |out × h| is η·|out × in|. In double precision,
            // because a grazing cosine is a small difference and unlike Fresnel's, this 1 − F does not vanish there.
            let [c_out, c_in, sine2] = L::by_lane([out.x, out.y, out.z, inn.x, inn.y, inn.z], |[x, y, z, u, v, w]| {
                let cross = [y * w - z * v, z * u - x * w, x * v - y * u];
                let (out2, in2) = (x * x + y * y + z * z, u * u + v * v + w * w);
                let both = x * u + y * v + z * w;
                let c_out = sign * (eta * both + out2);
                let c_in = -sign * (eta * in2 + both);
                [c_out, c_in, eta * eta * cross.iter().map(|c| c * c).sum::<f64>()]
            });
            let cos = c_out / length2.sqrt();
            let rest = match law {
                Reflectance::Coated(n, _, film) => {
                    let [n0, n1, n2, thickness, ior] = lifted([n[0], n[1], n[2], film.thickness, film.ior]);
                    let all = [out.x, out.y, out.z, inn.x, inn.y, inn.z, n0, n1, n2, thickness, ior];
                    // The cosine too: what passes has a root's slope next to the critical angle.
                    L::by_lane(all, |v| {
                        let h: [f64; 3] = std::array::from_fn(|i| sign * (eta * v[3 + i] + v[i]));
                        let dot = |a: &[f64]| a.iter().zip(&h).map(|(a, h)| a * h).sum::<f64>();
                        let cos = dot(&v[..3]) / dot(&h).max(1e-300).sqrt();
                        let film = Film { thickness: v[9], ior: v[10] };
                        std::array::from_fn(|i| film::passed(film, v[6 + i], cos, i))
                    })
                }
                _ => law.rest(cos, sine2 / (length2 * (L::one() + cos.max(L::zero())))),
            };
            let (met, jacobian) = Self::met(h, c_out, c_in, n2 / (length2 * length2));
            return (h, jacobian, rgb!(c => L::select(met, rest[c], L::zero())));
        }
        let (c_out, c_in) = (out.dot(h), -inn.dot(h));
        // 1 − F from both cosines, in any unit: nothing cancels toward the critical angle.
        let index = L::c(eta);
        let (s, p) = (index.mul_add(c_in, c_out), index.mul_add(c_out, c_in));
        let both = L::one() / s.sq().max(L::c(1e-12)) + L::one() / p.sq().max(L::c(1e-12));
        let (met, jacobian) = Self::met(h, c_out, c_in, n2 / (length2 * length2));
        let passed = L::select(met, L::c(2.0) * index * c_out * c_in * both, L::zero()).min(L::one());
        (h, jacobian, [passed; 3])
    }

    /// Whether a facet along `h` is met from both sides, and there the product of the cosines times `scale`.
    #[inline(always)]
    fn met<L: Real>(h: V3<L>, c_out: L, c_in: L, scale: L) -> (L::Mask, L) {
        let met = c_out.gt(L::zero()) & c_in.gt(L::zero()) & h.z.gt(L::zero());
        (met, L::select(met, c_out * c_in * scale, L::zero()))
    }

    /// F of the facet that mirrors ωo to ωi, along `h` between them.
    #[inline(always)]
    fn reflectance<L: Over<S>>(&self, seen: &InterfaceSeen<S>, wi: V3<L>, h: V3<L>) -> Rgb<L> {
        let (wo, eta) = (V3::<L>::lift(seen.wo), self.eta);
        let outside = L::lift(seen.side).gt(L::zero());
        let m = L::select(outside, L::lift(self.steps[0]), L::lift(self.steps[1]));
        let c2 = (L::c(0.25) * h.length_squared()).min(L::one());
        let (mut c, mut g2) = (c2.sqrt(), c2 + m);
        let dense = m.lt(L::zero());
        if L::any(dense) {
            // In double precision, because toward the critical angle the sum for g² cancels.
            let sum = L::by_lane([wo.x, wo.y, wo.z, wi.x, wi.y, wi.z, L::lift(seen.side)], |v| {
                let far = if v[6] > 0.0 { eta } else { 1.0 / eta };
                let c2 = 0.25 * ((v[0] + v[3]).powi(2) + (v[1] + v[4]).powi(2) + (v[2] + v[5]).powi(2)).min(4.0);
                [c2.sqrt(), c2 + (far - 1.0) * (far + 1.0), 0.0]
            });
            (c, g2) = (L::select(dense, sum[0], c), L::select(dense, sum[1], g2));
        }
        let Some(law) = &self.colored else { return [fresnel::dielectric_at(m, c, g2); 3] };
        // 1 − c² is the square of half the difference; bent, it grows by the index.
        let fall = L::c(0.25) * (wo - wi).length_squared();
        let bent = (g2.max(L::zero()) * L::c(eta * eta)).sqrt();
        let cos = L::select(outside, c, bent);
        let sine2 = L::select(outside, fall, fall * L::c(eta * eta));
        let f = law.at(cos, sine2 / (L::one() + cos));
        rgb!(c => L::select(g2.gt(L::zero()), f[c], L::one()))
    }

    /// [`Self::reflectance`] of a facet that ωo meets at the cosine `c`, all channels alike.
    #[inline(always)]
    fn grey(&self, seen: &InterfaceSeen<S>, c: S) -> S {
        let g2 = c.mul_add(c, (seen.far - S::one()) * (seen.far + S::one()));
        let Some(law) = &self.colored else {
            return fresnel::dielectric((seen.far - S::one()) * (seen.far + S::one()), c);
        };
        let outside = seen.side.gt(S::zero());
        let cos = S::select(outside, c, (g2.max(S::zero()) * S::c(self.eta * self.eta)).sqrt());
        let f = mean(law.at(cos, S::one() - cos));
        S::select(g2.gt(S::zero()), f, S::one())
    }

    /// To the sides that have a tint.
    pub(super) fn scattered_to(&self) -> Sides {
        self.sides
    }

    pub(super) fn roughness(&self) -> S {
        self.facets.roughness()
    }

    #[inline(always)]
    pub(super) fn f<L: Over<S>>(&self, wi: V3<L>, tables: &FacetTables<S::Entry>) -> Rgb<L> {
        self.scattered(&self.seen, wi, tables.missing(wi, self.facets.alpha())).0
    }

    #[inline(always)]
    pub(super) fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.scattered(&self.seen, wi, L::zero()).1
    }

    /// All at once.
    #[inline(always)]
    pub(super) fn evaluate<L: Over<S>>(&self, wi: V3<L>, tables: &FacetTables<S::Entry>, bound: bool) -> Evaluated<L> {
        self.evaluate_from(&self.seen, wi, tables, bound)
    }

    /// [`evaluate`](Self::evaluate) as seen from another ωo.
    #[inline(always)]
    pub(super) fn evaluate_from<L: Over<S>>(
        &self,
        seen: &InterfaceSeen<S>,
        wi: V3<L>,
        tables: &FacetTables<S::Entry>,
        bound: bool,
    ) -> Evaluated<L> {
        let alpha = self.facets.alpha();
        let place = tables.place(wi, alpha[0]);
        let missing = tables.missing_at(&place, alpha);
        let (f, pdf) = self.scattered(seen, wi, missing);
        let bound = if bound { self.bound(seen, wi, &place, missing, tables) } else { [L::zero(); 3] };
        Evaluated { f, pdf, bound }
    }

    /// f, where `missing` is what the tables say at ωi, and the density. A side that has no tint, or that no lane looks to, is
    /// left out.
    #[inline(always)]
    fn scattered<L: Over<S>>(&self, seen: &InterfaceSeen<S>, wi: V3<L>, missing: L) -> (Rgb<L>, L) {
        let wo = V3::<L>::lift(seen.wo);
        let (same, other) = Self::sides(seen, wi);
        let (cos_o, proposal, even, across) =
            (wo.z.abs(), L::lift(seen.reach[1]), L::lift(seen.even), L::lift(seen.across));
        let shadowed = wi.z.abs().mul_add(L::lift(seen.reach[0]), cos_o * self.facets.reach(wi)).max(L::c(1e-18));
        let flat = even * sampling::cosine_hemisphere_pdf(wi.z.abs());
        let [back_again, on_again] = array(|k| L::lift(seen.again[k]) * missing);
        let (mut f, mut pdf) = ([L::zero(); 3], L::zero());
        if self.sides.reflect && L::any(same) {
            let h = wo + wi;
            let reflectance = self.reflectance(seen, wi, h);
            let (d, density) = self.facets.d_and_mirrored_pdf(h, cos_o, proposal);
            let mirrored = d * L::c(0.5) / shadowed;
            let back = self.chance(mean(reflectance)) * density;
            f = rgb!(c => {
                let back = L::lift(self.reflected[c]) * reflectance[c].mul_add(mirrored, back_again);
                L::select(same, back, L::zero())
            });
            pdf = L::select(same, (L::one() - even).mul_add(back, flat * (L::one() - across)), L::zero());
        }
        if self.sides.transmit && L::any(other) {
            let (h, jacobian, passed) = self.refraction(seen, wi);
            let (d, density) = self.facets.d_and_mirrored_pdf(h, cos_o, proposal);
            let bent = jacobian * d * L::c(2.0) / shadowed;
            let on = (L::one() - self.chance(L::one() - mean(passed))) * (L::c(4.0) * jacobian * density);
            f = rgb!(c => {
                let on = L::lift(self.refracted[c]) * passed[c].mul_add(bent, on_again);
                L::select(other, on, f[c])
            });
            pdf = L::select(other, (L::one() - even).mul_add(on, flat * across), pdf);
        }
        (f, pdf)
    }

    /// Probability of reflecting at a facet with reflectance `f`.
    #[inline(always)]
    fn chance<L: Over<S>>(&self, f: L) -> L {
        if self.sides.transmit || !self.sides.reflect {
            chance(f, lifted(self.odds))
        } else {
            // What `chance` gives: something over itself.
            L::select(f.gt(L::zero()), L::one(), L::zero())
        }
    }

    pub(super) fn sample(&self, u: [S; 2]) -> V3<S> {
        self.sample_from(&self.seen, u)
    }

    /// [`sample`](Self::sample) as seen from another ωo.
    #[inline(always)]
    pub(super) fn sample_from(&self, seen: &InterfaceSeen<S>, u: [S; 2]) -> V3<S> {
        let (zero, one) = (S::zero(), S::one());
        let choose = |mask, a: V3<S>, b: V3<S>| {
            V3::new(S::select(mask, a.x, b.x), S::select(mask, a.y, b.y), S::select(mask, a.z, b.z))
        };
        let up = |w: V3<S>| V3::new(w.x, w.y, w.z * seen.side);
        let wo = up(seen.wo);
        let (even, u1) = split(u[1], seen.even);
        let (cross, v0) = split(u[0], seen.across);
        let flat = sampling::cosine_hemisphere([u1, v0]);
        let flat = choose(cross, V3::new(flat.x, flat.y, -flat.z), flat);

        // The azimuth of the facet is drawn first: choosing by its reflectance reuses the other number.
        let (h, u1_left) = self.facet(wo, u[0], u1);
        let c = wo.dot(h).max(zero);
        let inv = one / seen.far;
        let reflects = u1_left.lt(self.chance(self.grey(seen, c)));
        let cos2 = one - (one - c * c) * inv * inv;
        let cos_t = cos2.safe_sqrt();
        let bent = h.scale(c.mul_add(inv, -cos_t)) - wo.scale(inv);
        let mirrored = mirror(wo, h);
        // A facet may send light where its kind of scattering is not: no direction at all.
        let lands = (mirrored.z.gt(zero) & reflects) | (bent.z.lt(zero) & cos2.gt(zero) & !reflects);
        let bright = choose(reflects, mirrored, bent).map(|x| S::select(lands, x, zero));
        up(choose(even, flat, bright))
    }

    /// A unit visible facet, and a number left over to choose with: the azimuth's digits below 2⁻¹².
    fn facet(&self, wo: V3<S>, u0: S, u1: S) -> (V3<S>, S) {
        let fine = u0 * S::c(4096.0);
        let left = fine - fine.floor();
        let h = self.facets.visible(wo, [u0, u1]);
        (h.scale(S::one() / h.length_squared().sqrt().max(S::c(1e-18))), left)
    }

    /// Best estimate of the albedo.
    #[inline(always)]
    pub(super) fn albedo(&self, w: V3<S>, tables: &FacetTables<S::Entry>) -> Rgb<S> {
        let alpha = self.facets.alpha();
        let place = tables.place(w, alpha[0]);
        self.estimate(&self.seen, w, &place, tables.missing_at(&place, alpha), tables)
    }

    #[inline(always)]
    fn estimate(
        &self,
        seen: &InterfaceSeen<S>,
        w: V3<S>,
        place: &FacetPlace<S>,
        missing: S,
        tables: &FacetTables<S::Entry>,
    ) -> Rgb<S> {
        let parts = match (tables.has_parts(), self.colored.is_some()) {
            (true, false) => split_grey(tables.view_at(place)),
            (true, true) => split_colored(tables.view_at(place)),
            _ => {
                // As if it were smooth.
                let back = self.grey(seen, w.z.abs());
                [back, S::one() - back].map(|part| [part * (S::one() - missing); 3])
            }
        };
        self.total(seen, w, missing, parts)
    }

    /// Never below the albedo, from either side.
    #[inline(always)]
    pub(super) fn albedo_bound<L: Over<S>>(&self, w: V3<L>, tables: &FacetTables<S::Entry>) -> Rgb<L> {
        let alpha = self.facets.alpha();
        let place = tables.place(w, alpha[0]);
        self.bound(&self.seen, w, &place, tables.missing_at(&place, alpha), tables)
    }

    #[inline(always)]
    fn bound<L: Over<S>>(
        &self,
        seen: &InterfaceSeen<S>,
        w: V3<L>,
        place: &FacetPlace<L>,
        missing: L,
        tables: &FacetTables<S::Entry>,
    ) -> Rgb<L> {
        let parts = match (tables.has_parts(), self.colored.is_some()) {
            // What is not refracted need not be looked up.
            (true, false) if !self.sides.transmit => {
                let [back] = tables.bound_at(place);
                split_grey([back, L::zero()])
            }
            (true, false) => split_grey(tables.bound_at(place)),
            (true, true) => split_colored(tables.bound_at(place)),
            _ => {
                let largest = |c: usize| L::lift(self.reflected[c].max(self.refracted[c]));
                return rgb!(c => L::select(w.z.abs().gt(L::zero()), largest(c), L::zero()));
            }
        };
        self.total(seen, w, missing, parts)
    }

    #[inline(always)]
    fn total<L: Over<S>>(&self, seen: &InterfaceSeen<S>, w: V3<L>, missing: L, [back, on]: [Rgb<L>; 2]) -> Rgb<L> {
        let near = (w.z * L::lift(seen.side)).gt(L::zero());
        let crossing = L::select(near, L::lift(seen.crossing[0]), L::lift(seen.crossing[1]));
        rgb!(c => {
            let (back, on) = (missing.mul_add(L::one() - crossing, back[c]), missing.mul_add(crossing, on[c]));
            let sum = L::lift(self.reflected[c]).mul_add(back, L::lift(self.refracted[c]) * on);
            // A part that is next to nothing may have been integrated to less.
            let sum = sum.clamp(L::zero(), L::one());
            L::select(w.z.abs().gt(L::zero()), sum, L::zero())
        })
    }

    /// Index on ωo's side over that on ωi's.
    #[inline(always)]
    pub(super) fn relative_eta<L: Over<S>>(&self, wi: V3<L>) -> L {
        let (_, other) = Self::sides(&self.seen, wi);
        L::select(other, L::one() / L::lift(self.seen.far), L::one())
    }
}

/// What lobes that may be an [`Interface`] – their case `$Surface`, kept in `$Place` of [`OneOf`](super::OneOf) – leave to it:
/// turned, and evaluated and sampled without making it again.
macro_rules! by_interface {
    ($Place:ident, $Surface:ident) => {
        #[inline(always)]
        fn seen(&self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Option<(Self, [Rgb<S>; 2])> {
            let Self::$Surface(surface) = self else { return None };
            let (surface, albedos) = surface.seen_from(wo, curve.facets(), bound);
            Some((Self::$Surface(surface), albedos))
        }

        /// Without making the surface again.
        #[inline(always)]
        fn evaluate_kept<'a, L: Over<S>>(
            kept: &Self::Aimed,
            rest: impl FnOnce() -> Option<&'a Self>,
            wi: V3<L>,
            curve: &AlbedoCurve<S::Entry>,
            bound: bool,
        ) -> Evaluated<L>
        where
            Self: 'a,
        {
            let rest = rest();
            match (kept, rest) {
                (OneOf::$Place(seen), Some(Self::$Surface(surface))) => {
                    surface.evaluate_from(seen, wi, curve.facets(), bound)
                }
                _ => $crate::lobes::lobe::evaluate_again::<S, Self, L>(kept, || rest, wi, curve, bound),
            }
        }

        #[inline(always)]
        fn sample_kept<'a>(kept: &Self::Aimed, rest: impl FnOnce() -> Option<&'a Self>, u: [S; 2]) -> V3<S>
        where
            Self: 'a,
        {
            let rest = rest();
            match (kept, rest) {
                (OneOf::$Place(seen), Some(Self::$Surface(surface))) => surface.sample_from(seen, u),
                _ => $crate::lobes::lobe::sample_again(kept, || rest, u),
            }
        }
    };
}

pub(super) use by_interface;
