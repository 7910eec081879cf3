//! Sheen: the cloth lobe of Conty & Kulla 2017, "Production Friendly Microfacet Sheen BRDF".
//!
//! f = D·G / (4·μo·μi): fibres standing along the normal, their directions spread by `roughness`. At low roughness
//! (0.07–0.2) a thin bright rim, as on short-pile velvet; in the middle (0.3–0.5) a soft glow that reaches half-way
//! in, as on peach skin; at 1 an almost even dusting, as on felt or chalk.
//!
//! Where this departs from the paper: both cosines are clamped to 1e-3 inside Λ and in the denominator and the
//! roughness to 0.07, because the fitted Λ saturates toward grazing where the true one grows without bound, so that
//! the raw lobe gains energy (E = 6.1 at r = 0.001). Inside these limits E stays below 0.95 from both sides.

use super::registry::{Build, ClosureParams, Form, ParamSpec, ParamTy, SlotSource, closure};
use super::{Lobe, LobeKind, Rgb};
use crate::albedo::{AlbedoCurve, Axis, CurveSpec};
use crate::optics::{Lift, Real, V3, sampling};

closure! {
    /// Cloth sheen: fibres standing along the normal, seen as a glow toward grazing angles. The fitted shadowing of the
    /// paper's Table 1, its terminator softened unless told otherwise. One-sided: black below the surface.
    closure "sheen_bsdf" as SheenParams {
        /// Shading normal.
        normal N;
        /// Color the lobe is multiplied with.
        color albedo = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// How far the fibres lean away from the normal (paper: r). Low: a thin rim; high: an even dusting.
        float roughness = 0.3, in (0.07, 1.0);
        /// 1: the shadowing toward the light is softened (eq. 4), which gives up reciprocity. 0: the raw model.
        @keyword int softening = 1.0, in (0.0, 1.0);
    }
    source: "Conty & Kulla 2017, eq. 1-4 and Table 1",
    reciprocal: false,
    class: Scatter,
}

const BASE: ParamSpec = ParamSpec {
    name: "base",
    ty: ParamTy::Closure,
    keyword: false,
    default: &[],
    min: f32::NEG_INFINITY,
    max: f32::INFINITY,
    options: &[],
    doc: "What the sheen lies over.",
};
const TINT: ParamSpec = ParamSpec { name: "tint", doc: "Color of the sheen.", ..SheenParams::SPEC.params[1] };

/// `sheen(Ci, N, tint, roughness)`, which wraps, and `sheen(N, roughness)`, the bare lobe.
pub(super) const FORMS: &[Form] = &[
    Form {
        name: "sheen",
        params: &[BASE, SheenParams::SPEC.params[0], TINT, SheenParams::SPEC.params[2], SheenParams::SPEC.params[3]],
        doc: "Sheen layered over a closure: `layer(tint * sheen_bsdf(N, 1, roughness), base)`.",
        source: "Conty & Kulla 2017, §5",
        reciprocal: false,
        build: Build::Wrap {
            kind: LobeKind::Sheen,
            args: &[SlotSource::Param(1), SlotSource::Const(&[1.0; 3]), SlotSource::Param(3), SlotSource::Param(4)],
            weight: 2,
            base: 0,
        },
    },
    Form {
        name: "sheen",
        params: &[SheenParams::SPEC.params[0], SheenParams::SPEC.params[2]],
        doc: "The bare sheen lobe: `sheen_bsdf(N, 1, roughness)`.",
        source: "Conty & Kulla 2017",
        reciprocal: false,
        build: Build::Lobe {
            kind: LobeKind::Sheen,
            args: &[
                SlotSource::Param(0),
                SlotSource::Const(&[1.0; 3]),
                SlotSource::Param(1),
                SlotSource::Const(&[1.0]),
            ],
        },
    },
];

/// Cosines below this are taken as this inside Λ and in the denominator.
const MIN_COS: f64 = 1e-3;

/// The distribution D and the fitted shadowing Λ for one roughness.
#[derive(Clone, Copy, Debug)]
struct Fibres<S> {
    /// (2 + 1/r) / 2π.
    norm: S,
    /// 0.5 / r: the exponent of sin².
    exponent: S,
    /// Coefficients of L(x) = a/(1 + b·x^c) + d·x + e (eq. 3).
    a: S,
    b: S,
    c: S,
    d: S,
    e: S,
    /// 2·L(½).
    twice_l_half: S,
}

impl<S: Real> Fibres<S> {
    fn new(r: S) -> Self {
        // Table 1: rows for r = 0 and r = 1, blended by (1 − r)².
        const ROWS: [[f64; 2]; 5] =
            [[25.3245, 21.5473], [3.32435, 3.82987], [0.16801, 0.19823], [-1.27393, -1.97760], [-4.85967, -4.32054]];
        let w = (S::one() - r).sq();
        let [a, b, c, d, e] = ROWS.map(|[p0, p1]| w * S::c(p0) + (S::one() - w) * S::c(p1));
        let inv_r = S::one() / r;
        let half = S::c(0.5);
        let fibres = Fibres {
            norm: (S::c(2.0) + inv_r) * S::c(0.5 * std::f64::consts::FRAC_1_PI),
            exponent: half * inv_r,
            a,
            b,
            c,
            d,
            e,
            twice_l_half: S::zero(),
        };
        Fibres { twice_l_half: S::c(2.0) * fibres.l(half), ..fibres }
    }

    /// L(x) of eq. 3.
    #[inline(always)]
    fn l<L: Real + Lift<S>>(&self, x: L) -> L {
        let power = x.powf(L::lift(self.c));
        L::lift(self.a) / (L::one() + L::lift(self.b) * power) + L::lift(self.d).mul_add(x, L::lift(self.e))
    }

    /// ln Λ(μ), eq. 3.
    #[inline(always)]
    fn ln_lambda<L: Real + Lift<S>>(&self, cos: L) -> L {
        let low = cos.lt(L::c(0.5));
        let l = self.l(L::select(low, cos, L::one() - cos));
        L::select(low, l, L::lift(self.twice_l_half) - l)
    }

    /// D(h) of eq. 2 from s² = sin²θh.
    #[inline(always)]
    fn d<L: Real + Lift<S>>(&self, sin2: L) -> L {
        L::lift(self.norm) * sin2.powf(L::lift(self.exponent))
    }
}

/// See [`SheenParams`].
#[derive(Clone, Copy, Debug)]
pub struct Sheen<S> {
    fibres: Fibres<S>,
    /// The roughness, where a table over it has to be read.
    roughness: S,
    wo: V3<S>,
    /// 1 + Λ(ωo).
    lambda_o: S,
    /// 1/(4·μo) on the normal's side, else 0: f is 0 there.
    scale: S,
    /// 2 with softening, 0 without.
    soften: S,
}

impl<S: Real> Sheen<S> {
    fn prepare(roughness: S, softening: bool, wo: V3<S>) -> Self {
        let fibres = Fibres::new(roughness);
        let cos = wo.z.clamp(S::c(MIN_COS), S::one());
        Sheen {
            fibres,
            roughness,
            wo,
            lambda_o: S::one() + fibres.ln_lambda(cos).exp(),
            scale: S::select(wo.z.gt(S::zero()), S::c(0.25) / cos, S::zero()),
            soften: S::c(if softening { 2.0 } else { 0.0 }),
        }
    }

    /// f(ωo, ωi), eq. 1 with F = 1.
    #[inline(always)]
    fn value<L: Real + Lift<S>>(&self, wi: V3<L>) -> L {
        let cos = wi.z.clamp(L::c(MIN_COS), L::one());
        // sin² of the half vector as hx² + hy²: 1 − cos² would lose everything near the normal.
        let h = V3::lift(self.wo) + wi;
        let across = h.x.mul_add(h.x, h.y * h.y);
        let sin2 = (across / (across + h.z * h.z).max(L::c(1e-30))).clamp(L::zero(), L::one());
        // Eq. 4: Λ(ωi)^(1 + 2(1 − μi)⁸).
        let grazing = (L::one() - cos).sq().sq().sq();
        let softened = L::lift(self.soften).mul_add(grazing, L::one());
        let lambda_i = (self.fibres.ln_lambda(cos) * softened).exp();
        let f = self.fibres.d(sin2) * L::lift(self.scale) / (cos * (L::lift(self.lambda_o) + lambda_i));
        L::select(wi.z.gt(L::zero()), f, L::zero())
    }

    /// What [`CurveSpec`] integrates: key = [roughness, softening].
    fn kernel(key: &[f64; 4], wo: V3<f64>, wi: &[V3<f64>], out: &mut [f64]) {
        let lobe = Sheen::<f64>::prepare(key[0], key[1] > 0.5, wo);
        for (out, wi) in out.iter_mut().zip(wi) {
            *out = lobe.value(*wi);
        }
    }
}

impl<S: Real> Lobe<S> for Sheen<S> {
    type Params = SheenParams;

    fn curve(values: &[Option<f32>]) -> Option<CurveSpec> {
        let spec = SheenParams::SPEC;
        let (rough, soft) = (&spec.params[2], &spec.params[3]);
        let value = |p: &ParamSpec| values[spec.slot_of(p.name).unwrap_or(0)].map(|v| p.clamp(0, v) as f64);
        let softening = value(soft);
        Some(CurveSpec {
            kernel: Sheen::<f64>::kernel,
            key: [value(rough).unwrap_or(0.0), softening.unwrap_or(1.0), 0.0, 0.0],
            axis: value(rough).is_none().then_some(Axis { index: 0, lo: rough.min as f64, hi: rough.max as f64 }),
            reciprocal: softening == Some(0.0),
            bounded: false,
        })
    }

    fn weight(params: &SheenParams) -> [f32; 3] {
        params.albedo
    }

    fn reciprocal(params: &SheenParams) -> bool {
        params.softening == 0
    }

    fn new(params: &SheenParams, wo: V3<S>, _: &AlbedoCurve<S>) -> Self {
        Sheen::prepare(S::from_f32(params.roughness), params.softening > 0, wo)
    }

    #[inline(always)]
    fn f<L: Real + Lift<S>>(&self, wi: V3<L>, _: &AlbedoCurve<S>) -> Rgb<L> {
        [self.value(wi); 3]
    }

    fn pdf<L: Real + Lift<S>>(&self, wi: V3<L>) -> L {
        sampling::uniform_hemisphere_pdf(wi.z)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        // The paper's choice: micronormal sampling gives large weights and directions below the surface.
        sampling::uniform_hemisphere(u)
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S>) -> Rgb<S> {
        [curve.view(w, self.roughness); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Real + Lift<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S>) -> Rgb<L> {
        [curve.bound(w, L::lift(self.roughness)); 3]
    }
}
