//! A thin wall: two parallel dielectric surfaces with nothing worth mentioning between them. Not a lobe itself.
//!
//! What a facet and the one behind it reflect, all bounces between the two summed, is R′ = 2R/(1 + R) for reflectance R; the
//! rest, 1 − R′, goes through unbent (as for the smooth pane of Stam 2001, without absorption). Roughness spreads both alike:
//! light that passes goes where the mirrored direction, taken through the surface, points. So
//!
//! f = R′(c)·D(h)·G₂/(4·μo·μi) for ωi on ωo's side, and the same with 1 − R′(c) for ωi folded over from the other, h from the
//! folded directions: together the white surface of `lobes::rough`, whose second bounces are split likewise. Reflection
//! and transmission sum to E + M from either side, and both sides look the same.
//!
//! Limit: a wall of an index below 1 is not stretched, two widths count as their geometric mean.

use super::lobe::keeps_seen;
use super::rough::{chance, largest, split, thin};
use super::{Rgb, Sides};
use crate::albedo::facets::{FacetKey, FacetTables};
use crate::optics::microfacet::{Facets, Shape, mirror};
use crate::optics::{Over, Real, V3, array, fresnel, lifted, rgb, sampling};
use std::f64::consts::FRAC_1_PI;

/// What a pane reflects at the cosine `c`; `m` is η² − 1.
#[inline(always)]
fn reflected<L: Real>(m: L, c: L) -> L {
    let r = fresnel::dielectric(m, c);
    r + r * (L::one() - r) / (L::one() + r)
}

/// For [`Facet::Mirror`](crate::albedo::facets::Facet::Mirror): the key holds the index; reflected, then passed on.
pub(super) fn parts(key: &FacetKey, c: f64) -> [f64; 3] {
    let r = reflected((key[0] - 1.0) * (key[0] + 1.0), c);
    [r, 1.0 - r, 0.0]
}

/// A thin wall seen from one ωo.
#[derive(Clone, Copy, Debug)]
pub struct Pane<S> {
    facets: Facets<S>,
    /// η² − 1.
    m: S,
    tints: [Rgb<S>; 2],
    /// What is reflected of second bounces.
    shared: S,
    /// Of even directions, the share on the far side.
    across: S,
    /// Largest channels of the tints.
    odds: [S; 2],
    sides: Sides,
    seen: PaneSeen<S>,
}

/// What of a [`Pane`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct PaneSeen<S> {
    /// Folded to the side of the normal.
    wo: V3<S>,
    /// +1 if ωo is above, −1 below.
    side: S,
    /// ℓ(ωo) of the surface and of the proposal.
    reach: [S; 2],
    /// M(ωo)/(π·M̄), for each side.
    again: [S; 2],
    /// Probability of an even direction.
    even: S,
}

keeps_seen!(Pane, PaneSeen);

impl<S: Real> Pane<S> {
    /// `eta` as [`super::interface::index`] gives it; tints for what is reflected and what passes.
    pub(super) fn new(
        shape: Shape,
        alpha: [f32; 2],
        eta: f64,
        tints: [Rgb<f32>; 2],
        wo: V3<S>,
        tables: &FacetTables<S::Entry>,
    ) -> Self {
        let alpha = thin(alpha, eta).map(S::from_f32);
        let facets = Facets::new(shape, alpha);
        let side = S::select(wo.z.lt(S::zero()), -S::one(), S::one());
        let wo = V3::new(wo.x, wo.y, wo.z.abs());
        let m = S::c((eta - 1.0) * (eta + 1.0));
        // Second bounces meet facets at any angle; 60° stands for them.
        let shared = reflected(m, S::c(0.5));
        let missing = tables.missing(wo, alpha);
        let scale = missing * S::c(FRAC_1_PI) / tables.mean_missing(false, alpha).max(S::c(1e-30));
        let sides = Sides::tinted(tints);
        let tints = tints.map(|t| t.map(S::from_f32));
        let odds = tints.map(largest);
        let (back, on) = (shared * odds[0], (S::one() - shared) * odds[1]);
        let seen = PaneSeen {
            wo,
            side,
            reach: facets.reaches(wo),
            again: [scale * shared, scale * (S::one() - shared)],
            even: missing * S::select((back + on).gt(S::zero()), S::one(), S::zero()),
        };
        Pane { facets, m, tints, shared, across: on / (back + on).max(S::c(1e-30)), odds, sides, seen }
    }

    /// ωi folded to the normal's side, and whether it lies on ωo's side, and whether on the other.
    #[inline(always)]
    fn folded<L: Over<S>>(&self, wi: V3<L>) -> (V3<L>, L::Mask, L::Mask) {
        let lit = wi.z.abs().gt(L::zero()) & L::lift(self.seen.wo.z).gt(L::zero());
        let same = (wi.z * L::lift(self.seen.side)).gt(L::zero());
        (V3::new(wi.x, wi.y, wi.z.abs()), lit & same, lit & !same)
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
        let (wi, same, other) = self.folded(wi);
        let wo = V3::<L>::lift(self.seen.wo);
        let h = wo + wi;
        let shadowed = wi.z.mul_add(L::lift(self.seen.reach[0]), wo.z * self.facets.reach(wi));
        let single = self.facets.d(h) * L::c(0.5) / shadowed.max(L::c(1e-18));
        let r = reflected(L::lift(self.m), L::c(0.5) * h.length_squared().sqrt());
        let missing = tables.missing(wi, self.facets.alpha());
        let [back, on] = array(|k| L::lift(self.seen.again[k]) * missing);
        let (back, on) = (r.mul_add(single, back), (L::one() - r).mul_add(single, on));
        rgb!(c => {
            let (back, on) = (L::lift(self.tints[0][c]) * back, L::lift(self.tints[1][c]) * on);
            L::select(same, back, L::select(other, on, L::zero()))
        })
    }

    /// Probability of reflecting at a facet with reflectance `r`.
    #[inline(always)]
    fn chance<L: Over<S>>(&self, r: L) -> L {
        chance(r, lifted(self.odds))
    }

    #[inline(always)]
    pub(super) fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        let (wi, same, other) = self.folded(wi);
        let h = V3::<L>::lift(self.seen.wo) + wi;
        let r = reflected(L::lift(self.m), L::c(0.5) * h.length_squared().sqrt());
        let facet = self.facets.mirrored_pdf(h, L::lift(self.seen.wo.z), L::lift(self.seen.reach[1]));
        let (even, across, back) = (L::lift(self.seen.even), L::lift(self.across), self.chance(r));
        let flat = even * sampling::cosine_hemisphere_pdf(wi.z);
        let facet = (L::one() - even) * facet;
        let back_pdf = facet.mul_add(back, flat * (L::one() - across));
        let on_pdf = facet.mul_add(L::one() - back, flat * across);
        L::select(same, back_pdf, L::select(other, on_pdf, L::zero()))
    }

    pub(super) fn sample(&self, u: [S; 2]) -> V3<S> {
        let (even, u1) = split(u[1], self.seen.even);
        // The azimuth's digits below 2⁻¹² choose the side.
        let fine = u[0] * S::c(4096.0);
        let left = fine - fine.floor();
        let flat = sampling::cosine_hemisphere([u1, u[0]]);
        let h = self.facets.visible(self.seen.wo, [u[0], u1]);
        let bright = mirror(self.seen.wo, h);
        let c = self.seen.wo.dot(h) / h.length_squared().sqrt().max(S::c(1e-18));
        let passes = S::select(even, self.across, S::one() - self.chance(reflected(self.m, c)));
        let turn = S::select(left.lt(passes), -self.seen.side, self.seen.side);
        let pick = |a: S, b: S| S::select(even, a, b);
        // A facet may send light below the surface: no direction at all.
        let z = pick(flat.z, bright.z).max(S::zero());
        V3::new(pick(flat.x, bright.x), pick(flat.y, bright.y), z * turn)
    }

    /// Best estimate of the albedo.
    pub(super) fn albedo(&self, w: V3<S>, tables: &FacetTables<S::Entry>) -> Rgb<S> {
        let w = V3::new(w.x, w.y, w.z.abs());
        let missing = tables.missing(w, self.facets.alpha());
        let view = tables.view(w);
        // Without parts as if it were smooth.
        let smooth = reflected(self.m, w.z) * (S::one() - missing);
        let parts = if tables.has_parts() { [view[0], view[1]] } else { [smooth, S::one() - missing - smooth] };
        self.total(w, missing, parts)
    }

    /// Never below the albedo, from either side.
    #[inline(always)]
    pub(super) fn albedo_bound<L: Over<S>>(&self, w: V3<L>, tables: &FacetTables<S::Entry>) -> Rgb<L> {
        let w = V3::new(w.x, w.y, w.z.abs());
        let most = |c: usize| L::lift(self.tints[0][c].max(self.tints[1][c]));
        let most: Rgb<L> = rgb!(c => L::select(w.z.gt(L::zero()), most(c), L::zero()));
        if !tables.has_parts() {
            return most;
        }
        let bound = tables.bound(w);
        let parts = self.total(w, tables.missing(w, self.facets.alpha()), [bound[0], bound[1]]);
        // Where it begins to reflect totally, what it reflects jumps between two nodes: all may be of the brighter part.
        let jumps = L::lift(self.m).lt(L::zero());
        rgb!(c => L::select(jumps, most[c], parts[c]))
    }

    #[inline(always)]
    fn total<L: Over<S>>(&self, w: V3<L>, missing: L, [back, on]: [L; 2]) -> Rgb<L> {
        let back = missing.mul_add(L::lift(self.shared), back);
        let on = missing.mul_add(L::one() - L::lift(self.shared), on);
        rgb!(c => {
            let sum = L::lift(self.tints[0][c]).mul_add(back, L::lift(self.tints[1][c]) * on);
            let sum = sum.clamp(L::zero(), L::one());
            L::select(w.z.gt(L::zero()), sum, L::zero())
        })
    }
}
