//! Sheen: the cloth lobe of Conty & Kulla 2017, "Production Friendly Microfacet Sheen BRDF", and its relatives.
//!
//! f = D·G / (4·μo·μi): fibres standing along the normal, their directions spread by `roughness`. At low roughness
//! (0.07–0.2) a thin bright rim, as on short-pile velvet; in the middle (0.3–0.5) a soft glow that reaches half-way
//! in, as on peach skin; at 1 an almost even dusting, as on felt or chalk.
//!
//! The models share D and differ in G. Each keeps the roughness to its own range, so that a value below its floor is
//! taken as the floor:
//!
//! | model | G | r from | softening | gains? |
//! |---|---|---|---|---|
//! | `conty_kulla` | the paper's fit of Smith's Λ (eq. 3, Table 1) | 0.07 | eq. 4 | no |
//! | `refit` | the same rows under a better weight over r | 0.02 | eq. 4 | no |
//! | `exact` | Smith's Λ itself | 0.001 | ignored | no |
//! | `charlie_v` | Narkowicz 2018: G/(4μoμi) = 1/(4(μo + μi − μoμi)) | 0.02 | ignored | bounded |
//! | `zeltner` | a transformed cosine fitted to `exact`, scaled by its E | 0.05 | ignored | bounded |
//!
//! Where this departs from the sources: under the fits both cosines are clamped to 1e-4 inside Λ and in the
//! denominator, because the fitted Λ saturates toward grazing where the true one grows without bound, so that the raw
//! lobe gains energy (E = 6.1 at r = 0.001). Inside these limits E of `conty_kulla` stays below 0.99 and that of
//! `refit` below 0.95, from both sides. A bounded model is divided by max(1, Ē(ωo), Ē(ωi)): D·V gains below r = 0.204,
//! and is untouched above. `zeltner` follows Zeltner, Burley & Chiang 2022 in form only: the table is fitted to
//! `exact`, not to a volume of fibres.
//!
//! The paper samples the hemisphere uniformly. Here all models are sampled by a transformed cosine mixed with a
//! uniform share ([`super::ltc`]), at a fifth of the variance on average (`tests/lobes/sampling.rs` prints the table).

use super::charlie::{self, ExactLambda, Fibres, FittedLambda};
use super::lobe::{apart, evaluate_again, keeps_seen};
use super::ltc::{self, Ltc};
use super::registry::{Build, ClosureParams, Form, ParamSpec, SlotSource, closure};
use super::sheen_variant::Variant::{self, CharlieV, Exact, Fitted, Refit, RefitSoftened, Softened, Zeltner};
use super::{Evaluated, Lobe, LobeKind, Rgb};
use crate::albedo::curve::Extra;
use crate::albedo::{AlbedoCurve, Axis, Cells, CurveSpec};
use crate::optics::{Over, Real, Scalar, V3};

closure! {
    /// Cloth sheen: fibres standing along the normal, seen as a glow toward grazing angles. By default the fitted
    /// shadowing of Conty & Kulla, its terminator softened. One-sided: black below the surface.
    closure "sheen_bsdf" as SheenParams {
        /// Shading normal.
        normal N;
        /// Color the lobe is multiplied with.
        color albedo = [1.0, 1.0, 1.0], in (0.0, 1.0);
        /// How far the fibres lean away from the normal (paper: r). Low: a thin rim; high: an even dusting. Each model
        /// has its own floor: conty_kulla 0.07, refit and charlie_v 0.02, zeltner 0.05, exact 0.001.
        float roughness = 0.3, in (0.001, 1.0);
        /// 0: conty_kulla, 1: zeltner. Only looked at where no model is named. (MaterialX calls its own D·V mode 0:
        /// that is "charlie_v" here.)
        @keyword int mode = 0.0, in (0.0, 1.0);
        /// How fibres shadow each other. "conty_kulla": the paper's fit; "refit": the same fit, better blended over r;
        /// "exact": Smith's integral; "charlie_v": Narkowicz's fast visibility; "zeltner": a transformed cosine fitted
        /// to the exact model; "auto": what `mode` says.
        @keyword string model = 0.0, in (0.0, 5.0), of ["auto", "conty_kulla", "refit", "exact", "charlie_v", "zeltner"];
        /// 1: the shadowing toward the light is softened (eq. 4), which gives up reciprocity. 0: the raw model. Only
        /// conty_kulla and refit know it.
        @keyword int softening = 1.0, in (0.0, 1.0);
    }
    source: "Conty & Kulla 2017, eq. 1-4 and Table 1; Narkowicz 2018; Zeltner, Burley & Chiang 2022",
    reciprocal: false,
    class: Scatter,
}

const BASE: ParamSpec = ParamSpec::closure("base", "What the sheen lies over.");
const TINT: ParamSpec = ParamSpec { name: "tint", doc: "Color of the sheen.", ..SheenParams::SPEC.params[1] };

/// `sheen(Ci, N, tint, roughness)`, which wraps, and `sheen(N, roughness)`, the bare lobe.
pub(super) const FORMS: &[Form] = &[
    Form {
        name: "sheen",
        params: &[
            BASE,
            SheenParams::SPEC.params[0],
            TINT,
            SheenParams::SPEC.params[2],
            SheenParams::SPEC.params[4],
            SheenParams::SPEC.params[5],
        ],
        doc: "Sheen layered over a closure: `layer(tint * sheen_bsdf(N, 1, roughness), base)`.",
        source: "Conty & Kulla 2017, §5",
        reciprocal: false,
        build: Build::Wrap {
            kind: LobeKind::Sheen,
            args: &[
                SlotSource::Param(1),
                SlotSource::Const(&[1.0; 3]),
                SlotSource::Param(3),
                SlotSource::Const(&[0.0]),
                SlotSource::Param(4),
                SlotSource::Param(5),
            ],
            weight: 2,
            base: 0,
        },
        note: "",
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
                SlotSource::Const(&[0.0]),
                SlotSource::Const(&[0.0]),
                SlotSource::Const(&[1.0]),
            ],
        },
        note: "",
    },
];

/// Cosines below this are taken as this inside the fitted Λ and in its denominator.
const MIN_COS: f64 = 1e-4;

/// Shadowing by the fitted Λ.
#[derive(Clone, Copy, Debug)]
struct Fit<S> {
    fit: FittedLambda<S>,
    /// 2 with softening and 0 without.
    soften: S,
}

impl<S: Real> Fit<S> {
    /// Λ toward the viewer, which is never softened, and the albedo there if it is at hand.
    #[inline(always)]
    fn lambda_o(&self, wo: V3<S>, known: Known<'_, S::Entry>) -> (S, Option<S>) {
        let cos = fitted_cosine(wo);
        if let Some(cells) = known.cells
            && let Some((lambda, albedo)) = charlie::read_viewer(cells, cos)
        {
            return (lambda, Some(lit(wo, albedo)));
        }
        (self.fit.lambda(cos, S::zero()), None)
    }

    /// Λ toward a light.
    #[inline(always)]
    fn lambda_i<L: Over<S>>(&self, wi: V3<L>, known: Known<'_, S::Entry>) -> L {
        let cos = fitted_cosine(wi);
        if let Some(cells) = known.cells
            && let Some((lambda, _)) = charlie::read_light(cells, cos)
        {
            return lambda;
        }
        self.fit.lambda(cos, self.soften)
    }
}

/// How fibres hide each other.
#[derive(Clone, Copy, Debug)]
enum Shadowing<S> {
    Fitted(Fit<S>),
    Exact(ExactLambda<S>),
    Visibility,
    Transformed,
}

/// See [`SheenParams`].
#[derive(Clone, Copy, Debug)]
pub struct Sheen<S> {
    fibres: Fibres<S>,
    /// Where a table over the roughness has to be read.
    roughness: S,
    shadowing: Shadowing<S>,
    seen: SheenSeen<S>,
}

/// What of a [`Sheen`] depends on ωo.
#[derive(Clone, Copy, Debug)]
pub struct SheenSeen<S> {
    wo: V3<S>,
    /// Fitted: 1 + Λ(ωo). Exact: μo·Λ(ωo). Of a transformed cosine: the albedo it is scaled by.
    hidden: S,
    /// Fitted: 1/(4·μo).
    scale: S,
    /// What is sampled; under `zeltner` also the lobe.
    ltc: Ltc<S>,
    /// The curve's excess at ωo.
    excess: S,
}

keeps_seen!(Sheen, SheenSeen);

impl<S: Real> SheenSeen<S> {
    /// `f` where both directions lie above the surface, else 0.
    #[inline(always)]
    fn above<L: Over<S>>(&self, wi: V3<L>, f: L) -> L {
        L::select(L::lift(self.wo.z).gt(L::zero()) & wi.z.gt(L::zero()), f, L::zero())
    }

    /// D over ωo and ωi from cells, if they may be read.
    #[inline(always)]
    fn d<L: Over<S>>(&self, wi: V3<L>, cells: &Cells) -> Option<L> {
        charlie::read_d(cells, charlie::half_sin2(V3::<L>::lift(self.wo), wi))
    }

    /// f of the fitted models.
    #[inline(always)]
    fn fitted<L: Over<S>>(&self, wi: V3<L>, d: L, lambda_i: L) -> L {
        let sum = fitted_cosine(wi) * (L::lift(self.hidden) + lambda_i);
        self.above(wi, d * L::lift(self.scale) / sum)
    }

    /// All at once where there are cells, which only fitted models have.
    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, cells: Option<&Cells>, bound: bool) -> Option<Evaluated<L>> {
        let cells = cells?;
        let (lambda, most) = charlie::read_light(cells, fitted_cosine(wi))?;
        let f = self.fitted(wi, self.d(wi, cells)?, lambda);
        let bound = if bound { lit(wi, most) } else { L::zero() };
        Some(Evaluated { f: [f; 3], pdf: self.ltc.pdf(wi), bound: [bound; 3] })
    }
}

impl<S: Real> Sheen<S> {
    fn prepare(variant: Variant, roughness: S, wo: V3<S>, known: Known<'_, S::Entry>) -> Self {
        let r = roughness.clamp(S::c(variant.floor()), S::one());
        let fitted = |fit: FittedLambda<S>, soften: f64| Shadowing::Fitted(Fit { fit, soften: S::c(soften) });
        let shadowing = match variant {
            Softened => fitted(FittedLambda::published(r), 2.0),
            Fitted => fitted(FittedLambda::published(r), 0.0),
            RefitSoftened => fitted(FittedLambda::refitted(r), 2.0),
            Refit => fitted(FittedLambda::refitted(r), 0.0),
            Exact => Shadowing::Exact(ExactLambda::new(r)),
            CharlieV => Shadowing::Visibility,
            Zeltner => Shadowing::Transformed,
        };
        let params = match known.row {
            [] => ltc::read(variant.table(), wo.z, r),
            row => ltc::read_row(row, wo.z),
        };
        let (one, ltc) = (S::one(), Ltc::new([S::one(), S::one(), S::zero(), S::one()], wo));
        let seen = SheenSeen { wo, hidden: one, scale: one, ltc, excess: one };
        Sheen { fibres: Fibres::new(r), roughness: r, shadowing, seen }.aimed(wo, params, known).0
    }

    /// Turned toward ωo, where its transformed cosine has the parameters `params`; and its albedo there if it is at hand.
    #[inline(always)]
    fn aimed(self, wo: V3<S>, params: [S; ltc::PARAMS], known: Known<'_, S::Entry>) -> (Self, Option<S>) {
        let [a, b, c, share] = params;
        let (mut uniform, mut scale, mut albedo) = (share, S::one(), None);
        let hidden = match &self.shadowing {
            Shadowing::Fitted(fitted) => {
                let (lambda, at_hand) = fitted.lambda_o(wo, known);
                albedo = at_hand;
                scale = S::c(0.25) / fitted_cosine(wo);
                S::one() + lambda
            }
            Shadowing::Exact(exact) => exact.cos_lambda(unit_cosine(wo), sin2(wo), known.terms),
            Shadowing::Visibility => S::one(),
            Shadowing::Transformed => {
                uniform = S::zero();
                share
            }
        };
        let seen = SheenSeen { wo, hidden, scale, ltc: Ltc::new([a, b, c, uniform], wo), excess: S::one() };
        (Sheen { seen, ..self }, albedo)
    }

    /// With what is to be divided by where the curve asks for it.
    #[inline(always)]
    fn dividing(self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let excess = curve.excess(wo, self.roughness);
        Sheen { seen: SheenSeen { excess, ..self.seen }, ..self }
    }

    /// f(ωo, ωi), eq. 1 with F = 1, before it is bounded.
    #[inline(always)]
    fn value<L: Over<S>>(&self, wi: V3<L>, known: Known<'_, S::Entry>) -> L {
        match &self.shadowing {
            Shadowing::Fitted(fitted) => self.seen.fitted(wi, self.d(wi, known), fitted.lambda_i(wi, known)),
            _ if L::WIDE => self.value_of_any(wi, known),
            // Of a copy: what is called wants it in memory.
            _ => Self::value_apart(&{ *self }, wi, known),
        }
    }

    /// Apart, so that the default model stays short.
    #[inline(never)]
    fn value_apart<L: Over<S>>(&self, wi: V3<L>, known: Known<'_, S::Entry>) -> L {
        self.value_of_any(wi, known)
    }

    #[inline(always)]
    fn value_of_any<L: Over<S>>(&self, wi: V3<L>, known: Known<'_, S::Entry>) -> L {
        let d = self.d(wi, known);
        match &self.shadowing {
            Shadowing::Fitted(fitted) => self.seen.fitted(wi, d, fitted.lambda_i(wi, known)),
            Shadowing::Exact(exact) => self.exact(*exact, wi, d, known.terms),
            Shadowing::Visibility => self.visible(wi, d),
            Shadowing::Transformed => self.transformed(wi),
        }
    }

    /// D over ωo and ωi.
    #[inline(always)]
    fn d<L: Over<S>>(&self, wi: V3<L>, known: Known<'_, S::Entry>) -> L {
        if let Some(cells) = known.cells
            && let Some(d) = self.seen.d(wi, cells)
        {
            return d;
        }
        self.fibres.d(charlie::half_cot2(V3::<L>::lift(self.seen.wo), wi))
    }

    #[inline(always)]
    fn exact<L: Over<S>>(&self, exact: ExactLambda<S>, wi: V3<L>, d: L, terms: &[S::Entry]) -> L {
        // 4·μo·μi·(1 + Λo + Λi), multiplied out: finite and accurate at the horizon.
        let cos_o = L::lift(self.seen.wo.z);
        let cos_lambda_i = exact.cos_lambda(unit_cosine(wi), sin2(wi), terms);
        let sum = cos_o * (wi.z + cos_lambda_i) + wi.z * L::lift(self.seen.hidden);
        self.seen.above(wi, d * L::c(0.25) / sum.max(L::c(1e-30)))
    }

    #[inline(always)]
    fn visible<L: Over<S>>(&self, wi: V3<L>, d: L) -> L {
        self.seen.above(wi, d * charlie::visibility(L::lift(self.seen.wo.z), wi.z))
    }

    #[inline(always)]
    fn transformed<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.seen.above(wi, L::lift(self.seen.hidden) * self.seen.ltc.density_over_cos(wi))
    }

    /// A value divided by what the lobe would gain at either direction.
    #[inline(always)]
    fn kept<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, value: L) -> Rgb<L> {
        if curve.divides() {
            let excess = curve.excess(wi, L::lift(self.roughness)).max(L::lift(self.seen.excess));
            [value / excess; 3]
        } else {
            [value; 3]
        }
    }

    /// What [`CurveSpec`] integrates: key = [roughness, variants], the largest f of the variants whose bit is set.
    fn kernel(key: &[f64; 4], wo: V3<f64>, wi: &[V3<f64>], out: &mut [f64]) {
        out.fill(0.0);
        let terms = charlie::terms_at(key[0].clamp(charlie::MIN_ROUGHNESS, 1.0));
        let known = Known { terms: &terms, ..NOTHING };
        for variant in Variant::ALL {
            if key[1] as u32 & 1 << variant as u32 != 0 {
                let lobe = Sheen::<f64>::prepare(variant, key[0], wo, known);
                for (out, wi) in out.iter_mut().zip(wi) {
                    *out = out.max(lobe.value(*wi, known));
                }
            }
        }
    }

    /// For [`CurveSpec::extra`]: the terms and the row of [`Known`].
    fn extra(key: &[f64; 4], axis: Option<Axis>) -> Extra<f64> {
        let mask = key[1] as u32;
        let terms = match axis {
            _ if mask & 1 << Exact as u32 == 0 => vec![],
            Some(_) => charlie::term_rows(),
            None => charlie::terms_at(key[0]).to_vec(),
        };
        match Variant::only(mask) {
            Some(variant) if axis.is_none() => [terms, ltc::row(variant.table(), key[0])],
            _ => [terms, vec![]],
        }
    }

    /// For [`CurveSpec::cells`].
    fn cells(key: &[f64; 4], view: &dyn Fn(f64) -> f64, bound: &dyn Fn(f64) -> f64) -> Option<Cells> {
        let variant = Variant::only(key[1] as u32)?;
        let lobe = Sheen::<f64>::prepare(variant, key[0], V3::new(0.0, 0.0, 1.0), NOTHING);
        let Shadowing::Fitted(Fit { fit, soften }) = lobe.shadowing else { return None };
        charlie::cells((&lobe.fibres, &fit, soften), MIN_COS, view, bound)
    }
}

/// What [`Sheen::extra`] and [`Sheen::cells`] gave; each may be empty.
#[derive(Clone, Copy)]
struct Known<'a, E> {
    /// The coefficients of the exact Λ, where it may be asked for.
    terms: &'a [E],
    /// Of a lobe that is all known: its row of the transformed cosines, …
    row: &'a [E],
    /// … and in single precision D, its fitted Λ and albedos.
    cells: Option<&'a Cells>,
}

const NOTHING: Known<'static, f64> = Known { terms: &[], row: &[], cells: None };

impl<'a, E: Scalar> Known<'a, E> {
    #[inline(always)]
    fn of(curve: &'a AlbedoCurve<E>) -> Self {
        let [terms, row] = curve.extra();
        Known { terms, row, cells: curve.cells() }
    }
}

#[inline(always)]
fn fitted_cosine<L: Real>(w: V3<L>) -> L {
    w.z.clamp(L::c(MIN_COS), L::one())
}

#[inline(always)]
fn unit_cosine<L: Real>(w: V3<L>) -> L {
    w.z.clamp(L::zero(), L::one())
}

/// `value` above the surface, else 0.
#[inline(always)]
fn lit<L: Real>(w: V3<L>, value: L) -> L {
    L::select(w.z.gt(L::zero()), value, L::zero())
}

/// sin²θ without cancellation near the normal.
#[inline(always)]
fn sin2<L: Real>(w: V3<L>) -> L {
    w.x.mul_add(w.x, w.y * w.y)
}

impl<S: Real> Lobe<S> for Sheen<S> {
    type Params = SheenParams;
    type Aimed = SheenSeen<S>;

    fn curve(values: &[Option<f32>]) -> Option<CurveSpec> {
        let spec = SheenParams::SPEC;
        let value = |name: &str| {
            let p = spec.params.iter().find(|p| p.name == name)?;
            values[spec.slot_of(name)?].map(|v| p.clamp(0, v))
        };
        let choices = |name: &str, count: u32| match value(name) {
            Some(v) => v as u32..v as u32 + 1,
            None => 0..count,
        };
        let mut variants = Vec::new();
        for mode in choices("mode", 2) {
            for model in choices("model", 6) {
                variants.extend(choices("softening", 2).map(|softening| Variant::of(mode, model, softening)));
            }
        }
        let lo = variants.iter().map(|v| v.floor()).fold(1.0, f64::min);
        let roughness = value("roughness").map(|r| (r as f64).max(lo));
        let mask = variants.iter().fold(0, |mask, v| mask | 1u32 << *v as u32);
        Some(CurveSpec {
            kernel: Sheen::<f64>::kernel,
            key: [roughness.unwrap_or(0.0), mask as f64, 0.0, 0.0],
            axis: roughness.is_none().then_some(Axis { index: 0, lo, hi: 1.0 }),
            reciprocal: variants.iter().all(|v| v.reciprocal()),
            bounded: mask.count_ones() > 1 || variants.iter().any(|v| v.gains(roughness.unwrap_or(lo))),
            extra: Sheen::<f64>::extra,
            cells: Sheen::<f64>::cells,
        })
    }

    fn tint_slot() -> Option<usize> {
        SheenParams::SPEC.slot_of("albedo")
    }

    fn weight(params: &SheenParams) -> [f32; 3] {
        params.albedo
    }

    fn reciprocal(params: &SheenParams) -> bool {
        Variant::of(params.mode, params.model, params.softening).reciprocal()
    }

    fn new(params: &SheenParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let variant = Variant::of(params.mode, params.model, params.softening);
        let lobe = Sheen::prepare(variant, S::from_f32(params.roughness), wo, Known::of(curve));
        lobe.dividing(wo, curve)
    }

    #[inline(always)]
    fn toward(&self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Option<Self> {
        self.seen(wo, curve, false).map(|(lobe, _)| lobe)
    }

    #[inline(always)]
    fn seen(&self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Option<(Self, [Rgb<S>; 2])> {
        let known = Known::of(curve);
        if known.row.is_empty() {
            return None;
        }
        let (aimed, albedo) = self.aimed(wo, ltc::read_row(known.row, wo.z), known);
        let lobe = aimed.dividing(wo, curve);
        let albedo = match albedo {
            Some(albedo) => [albedo; 3],
            None => lobe.albedo(wo, curve),
        };
        let bound = if bound { lobe.albedo_bound(wo, curve) } else { [S::zero(); 3] };
        Some((lobe, [albedo, bound]))
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.kept(wi, curve, self.value(wi, Known::of(curve)))
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.seen.ltc.pdf(wi)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        self.seen.ltc.sample(u)
    }

    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        if let Some(evaluated) = self.seen.evaluate(wi, curve.cells(), bound) {
            return evaluated;
        }
        apart(self, wi, curve, bound)
    }

    /// Without the rest where there are cells.
    #[inline(always)]
    fn evaluate_kept<'a, L: Over<S>>(
        kept: &SheenSeen<S>,
        rest: impl FnOnce() -> Option<&'a Self>,
        wi: V3<L>,
        curve: &AlbedoCurve<S::Entry>,
        bound: bool,
    ) -> Evaluated<L>
    where
        Self: 'a,
    {
        if let Some(evaluated) = kept.evaluate(wi, curve.cells(), bound) {
            return evaluated;
        }
        evaluate_again::<S, Self, L>(kept, rest, wi, curve, bound)
    }

    #[inline(always)]
    fn sample_kept<'a>(kept: &SheenSeen<S>, _: impl FnOnce() -> Option<&'a Self>, u: [S; 2]) -> V3<S>
    where
        Self: 'a,
    {
        kept.ltc.sample(u)
    }

    #[inline(always)]
    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        if let Some(cells) = curve.cells()
            && let Some((_, albedo)) = charlie::read_viewer(cells, fitted_cosine(w))
        {
            return [lit(w, albedo); 3];
        }
        [curve.view(w, self.roughness); 3]
    }

    fn view_bound(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [curve.view_bound(w, self.roughness); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        if let Some(cells) = curve.cells()
            && let Some((_, bound)) = charlie::read_light(cells, fitted_cosine(w))
        {
            return [lit(w, bound); 3];
        }
        let bound = curve.bound(w, L::lift(self.roughness));
        // E_light integrates over the kinks of the fitted table, which the baking resolves to 1e-4 only.
        let slack = if matches!(self.shadowing, Shadowing::Transformed) { 2e-4 } else { 0.0 };
        [L::select(w.z.gt(L::zero()), (bound + L::c(slack)).min(L::one().max(bound)), bound); 3]
    }
}
