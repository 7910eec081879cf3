//! Perfectly smooth surfaces: the limit of the microfacet lobes as α goes to 0, as delta lobes.
//!
//! Where this departs from the source: with an index both lie between two media and work from either side.

use super::interface::index;
use super::registry::{Build, ClosureParams, Form, SlotSource, closure};
use super::{Lobe, LobeKind, Rgb, Sides};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3, fresnel};

closure! {
    /// Mirror reflection, a delta lobe. Without an index all light is reflected, on the normal's side; with one what a
    /// smooth dielectric reflects, on both sides.
    closure "reflection" as ReflectionParams {
        /// Shading normal.
        normal N;
        /// Index of refraction inside over outside; 0: a perfect mirror. Others are taken as at least 1/4, and at least
        /// 1 % away from 1.
        float eta = 1.5, in (0.0, 4.0);
    }
    source: "OSL specification, reflection()",
    reciprocal: true,
    class: Delta,
}

closure! {
    /// Refraction through a smooth surface, a delta lobe: what a smooth dielectric does not reflect, bent. Two-sided.
    closure "refraction" as RefractionParams {
        /// Shading normal.
        normal N;
        /// Index of refraction inside over outside, taken as at least 1/4, and at least 1 % away from 1.
        float eta = 1.5, in (0.1, 4.0);
    }
    source: "OSL specification, refraction(); Born & Wolf, §1.5",
    reciprocal: true,
    class: Delta,
}

/// `reflection(N)`.
pub(super) const FORMS: &[Form] = &[Form {
    name: "reflection",
    params: &[ReflectionParams::SPEC.params[0]],
    doc: "A perfect mirror: `reflection(N, 0)`.",
    source: "OSL specification, reflection()",
    reciprocal: true,
    build: Build::Lobe { kind: LobeKind::Reflection, args: &[SlotSource::Param(0), SlotSource::Const(&[0.0])] },
    note: "",
}];

/// What a smooth dielectric reflects from the side `w` is on.
#[inline(always)]
fn reflected<S: Real, L: Over<S>>(eta: S, w: V3<L>) -> L {
    let eta = L::lift(eta);
    let far = L::select(w.z.gt(L::zero()), eta, L::one() / eta);
    let f = fresnel::dielectric((far - L::one()) * (far + L::one()), w.z.abs());
    L::select(w.z.abs().gt(L::zero()), f, L::zero())
}

/// See [`ReflectionParams`].
#[derive(Clone, Copy, Debug)]
pub struct Reflection<S> {
    wo: V3<S>,
    eta: S,
    mirror: bool,
}

impl<S: Real> Reflection<S> {
    #[inline(always)]
    fn part<L: Over<S>>(&self, w: V3<L>) -> Rgb<L> {
        let part = if self.mirror { L::select(w.z.gt(L::zero()), L::one(), L::zero()) } else { reflected(self.eta, w) };
        [part; 3]
    }
}

impl<S: Real> Lobe<S> for Reflection<S> {
    type Params = ReflectionParams;
    type Aimed = Self;

    fn roughness(&self) -> S {
        S::zero()
    }

    fn between_media(params: &ReflectionParams) -> bool {
        params.eta > 0.0
    }

    fn new(params: &ReflectionParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Reflection { wo, eta: S::c(index(params.eta)), mirror: params.eta <= 0.0 }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, _: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::zero(); 3]
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, _: V3<L>) -> L {
        L::zero()
    }

    fn sample(&self, _: [S; 2]) -> V3<S> {
        V3::new(-self.wo.x, -self.wo.y, self.wo.z)
    }

    fn albedo(&self, w: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        self.part(w)
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.part(w)
    }

    fn delta(&self) -> Option<(V3<S>, Rgb<S>)> {
        Some((self.sample([S::zero(); 2]), self.part(self.wo)))
    }
}

/// See [`RefractionParams`].
#[derive(Clone, Copy, Debug)]
pub struct Refraction<S> {
    wo: V3<S>,
    eta: S,
}

impl<S: Real> Refraction<S> {
    #[inline(always)]
    fn part<L: Over<S>>(&self, w: V3<L>) -> Rgb<L> {
        let part = L::one() - reflected(self.eta, w);
        [L::select(w.z.abs().gt(L::zero()), part, L::zero()); 3]
    }
}

impl<S: Real> Lobe<S> for Refraction<S> {
    type Params = RefractionParams;
    type Aimed = Self;

    fn sides(&self) -> Sides {
        Sides::TRANSMIT
    }

    fn roughness(&self) -> S {
        S::zero()
    }

    fn between_media(_: &RefractionParams) -> bool {
        true
    }

    fn new(params: &RefractionParams, wo: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Refraction { wo, eta: S::c(index(params.eta)) }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, _: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::zero(); 3]
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, _: V3<L>) -> L {
        L::zero()
    }

    fn sample(&self, _: [S; 2]) -> V3<S> {
        let outside = self.wo.z.gt(S::zero());
        let inv = S::select(outside, S::one() / self.eta, self.eta);
        let (x, y) = (-self.wo.x * inv, -self.wo.y * inv);
        let cos = (S::one() - x.mul_add(x, y * y)).safe_sqrt();
        V3::new(x, y, S::select(outside, -cos, cos))
    }

    fn albedo(&self, w: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        self.part(w)
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        // Toward grazing the way back through the other medium keeps only half the digits of the cosine.
        let cos = w.z.mul_add(w.z, L::c(4e-6)).sqrt().copysign(w.z);
        let part = self.part(V3::new(w.x, w.y, cos))[0];
        [L::select(w.z.abs().gt(L::zero()), part, L::zero()); 3]
    }

    #[inline(always)]
    fn relative_eta<L: Over<S>>(&self, _: V3<L>) -> L {
        let inv = S::select(self.wo.z.gt(S::zero()), S::one() / self.eta, self.eta);
        L::lift(inv)
    }

    fn delta(&self) -> Option<(V3<S>, Rgb<S>)> {
        Some((self.sample([S::zero(); 2]), self.part(self.wo)))
    }
}
