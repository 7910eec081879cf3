//! The trait that lobes fulfil.

use super::limits::{Limits, SlotRange};
use super::registry::ClosureParams;
use super::{Rgb, Rgb32};
use crate::albedo::{AlbedoCurve, CurveSpec, TableSpec};
use crate::optics::{Over, Real, V3};

/// To which sides of its own surface a prepared lobe may scatter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sides {
    /// Back to the side ωo is on.
    pub reflect: bool,
    /// To the other side.
    pub transmit: bool,
}

impl Sides {
    /// Back to the side ωo is on.
    pub const REFLECT: Sides = Sides { reflect: true, transmit: false };
    /// To the other side.
    pub const TRANSMIT: Sides = Sides { reflect: false, transmit: true };
    /// Both.
    pub const BOTH: Sides = Sides { reflect: true, transmit: true };

    /// Those of what is reflected and of what is transmitted that has a tint.
    #[cfg(feature = "microfacet")]
    pub(super) fn tinted(tints: [Rgb32; 2]) -> Sides {
        let [reflect, transmit] = tints.map(|t| t.iter().any(|x| *x > 0.0));
        Sides { reflect, transmit }
    }
}

/// What of a lobe depends on ωo.
pub trait Aimed<B>: Copy + std::fmt::Debug {
    /// Whether the rest is needed to make the lobe of it again.
    const APART: bool = true;
    /// Of a prepared lobe.
    fn of(lobe: &B) -> Self;
    /// The lobe again, where `rest` is one of the same parameters prepared for any other ωo: the same bits. `None` without
    /// the rest.
    fn with<'a>(&self, rest: impl FnOnce() -> Option<&'a B>) -> Option<B>
    where
        B: 'a;
}

impl<B: Copy + std::fmt::Debug> Aimed<B> for B {
    const APART: bool = false;

    #[inline(always)]
    fn of(lobe: &B) -> B {
        *lobe
    }

    #[inline(always)]
    fn with<'a>(&self, _: impl FnOnce() -> Option<&'a B>) -> Option<B>
    where
        B: 'a,
    {
        Some(*self)
    }
}

/// Says that a BSDF keeps the field `seen` of a lobe, or of what lobes are made of.
macro_rules! keeps_seen {
    ($Lobe:ident, $Seen:ident) => {
        impl<S: $crate::optics::Real> $crate::lobes::Aimed<$Lobe<S>> for $Seen<S> {
            #[inline(always)]
            fn of(lobe: &$Lobe<S>) -> Self {
                lobe.seen
            }

            #[inline(always)]
            fn with<'a>(&self, rest: impl FnOnce() -> Option<&'a $Lobe<S>>) -> Option<$Lobe<S>>
            where
                $Lobe<S>: 'a,
            {
                rest().map(|rest| $Lobe { seen: *self, ..*rest })
            }
        }
    };
}

pub(super) use keeps_seen;

/// Says that a BSDF keeps of a lobe what it keeps of the one in a field.
#[cfg(feature = "microfacet")]
macro_rules! keeps_that_of {
    ($Lobe:ident { $field:ident: $Seen:ident }) => {
        impl<S: $crate::optics::Real> $crate::lobes::Aimed<$Lobe<S>> for $Seen<S> {
            #[inline(always)]
            fn of(lobe: &$Lobe<S>) -> Self {
                $crate::lobes::Aimed::of(&lobe.$field)
            }

            #[inline(always)]
            fn with<'a>(&self, rest: impl FnOnce() -> Option<&'a $Lobe<S>>) -> Option<$Lobe<S>>
            where
                $Lobe<S>: 'a,
            {
                let rest = rest()?;
                let mut lobe = *rest;
                lobe.$field = $crate::lobes::Aimed::with(self, || Some(&rest.$field))?;
                Some(lobe)
            }
        }
    };
}

#[cfg(feature = "microfacet")]
pub(super) use keeps_that_of;

/// What is kept of a lobe that is one of two things.
#[derive(Clone, Copy, Debug)]
pub enum OneOf<A, B> {
    /// The first.
    First(A),
    /// The second.
    Second(B),
}

/// Says so of an enum of two.
macro_rules! keeps_one_of {
    ($Lobe:ident: $First:ident($A:ty) | $Second:ident($B:ty)) => {
        impl<S: $crate::optics::Real> $crate::lobes::Aimed<$Lobe<S>> for $crate::lobes::OneOf<$A, $B> {
            #[inline(always)]
            fn of(lobe: &$Lobe<S>) -> Self {
                match lobe {
                    $Lobe::$First(lobe) => $crate::lobes::OneOf::First($crate::lobes::Aimed::of(lobe)),
                    $Lobe::$Second(lobe) => $crate::lobes::OneOf::Second($crate::lobes::Aimed::of(lobe)),
                }
            }

            #[inline(always)]
            fn with<'a>(&self, rest: impl FnOnce() -> Option<&'a $Lobe<S>>) -> Option<$Lobe<S>>
            where
                $Lobe<S>: 'a,
            {
                use $crate::lobes::{Aimed, OneOf};
                match (self, rest()?) {
                    (OneOf::First(kept), $Lobe::$First(rest)) => Aimed::with(kept, || Some(rest)).map($Lobe::$First),
                    (OneOf::Second(kept), $Lobe::$Second(rest)) => Aimed::with(kept, || Some(rest)).map($Lobe::$Second),
                    _ => None,
                }
            }
        }
    };
}

pub(super) use keeps_one_of;

/// One model of scattering, prepared for one ωo.
///
/// All directions are unit vectors in the lobe's local frame, pointing away from the surface; z is the normal. The
/// type parameter is what the lobe was prepared in; `f`, `pdf` and `albedo_bound` may be evaluated over lanes.
pub trait Lobe<S: Real>: Sized + Copy {
    /// The declared parameters.
    type Params: ClosureParams;
    /// What a BSDF keeps of it: the lobe itself, unless most of it is the same for every ωo.
    type Aimed: Aimed<Self>;

    /// Which albedo table a parameter block needs; `values` holds `None` where the value is not known before shading.
    fn curve(values: &[Option<f32>]) -> Option<CurveSpec> {
        let _ = values;
        None
    }

    /// The table of whatever shape a parameter block needs: the [`curve`](Lobe::curve), unless a lobe says otherwise.
    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        Self::curve(values).map(TableSpec::Cosine)
    }

    /// A color that multiplies the lobe and stays out of its albedo curve.
    fn weight(params: &Self::Params) -> Rgb32 {
        let _ = params;
        [1.0; 3]
    }

    /// Whether this instance is reciprocal.
    fn reciprocal(params: &Self::Params) -> bool {
        let _ = params;
        Self::Params::SPEC.reciprocal
    }

    /// Whether f of this instance depends on where the tangent points.
    fn follows_tangent(params: &Self::Params) -> bool {
        let _ = params;
        Self::Params::SPEC.tangent_slot().is_some()
    }

    /// Whether it lies between two media: z points to the outside, also where the host turned N toward a viewer inside.
    fn between_media(params: &Self::Params) -> bool {
        let _ = params;
        false
    }

    /// The index of refraction on ωo's side over that on ωi's; 1 unless light crosses into another medium. The adjoint
    /// of f is f times its square.
    #[inline(always)]
    fn relative_eta<L: Over<S>>(&self, wi: V3<L>) -> L {
        let _ = wi;
        L::one()
    }

    /// Prepares everything that depends on the parameters and on ωo alone.
    fn new(params: &Self::Params, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self;

    /// The same lobe for another ωo: the bits that [`new`](Lobe::new) gives for the same parameters. `None` if there is no
    /// shorter way.
    fn toward(&self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Option<Self> {
        let _ = (wo, curve);
        None
    }

    /// [`toward`](Lobe::toward), with its albedo and, if it is asked for, its bound at ωo: the bits that
    /// [`albedo`](Lobe::albedo) and [`albedo_bound`](Lobe::albedo_bound) give.
    #[inline(always)]
    fn seen(&self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Option<(Self, [Rgb<S>; 2])> {
        let lobe = self.toward(wo, curve)?;
        let albedos = albedos(&lobe, wo, curve, bound);
        Some((lobe, albedos))
    }

    /// f(ωo, ωi), without any cosine. Zero on sides the lobe does not scatter to. Finite for every input.
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L>;

    /// All that evaluating a BSDF asks at once: [`f`](Lobe::f), [`pdf`](Lobe::pdf) and, if it is asked for, the
    /// [`albedo_bound`](Lobe::albedo_bound), the same bits.
    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        apart(self, wi, curve, bound)
    }

    /// [`evaluate`](Lobe::evaluate) from what a BSDF keeps; black without the rest of it.
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
        evaluate_again::<S, Self, L>(kept, rest, wi, curve, bound)
    }

    /// [`sample`](Lobe::sample) from what a BSDF keeps; no direction without the rest of it.
    #[inline(always)]
    fn sample_kept<'a>(kept: &Self::Aimed, rest: impl FnOnce() -> Option<&'a Self>, u: [S; 2]) -> V3<S>
    where
        Self: 'a,
    {
        sample_again(kept, rest, u)
    }

    /// Density over solid angle of [`sample`](Lobe::sample) returning ωi.
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L;

    /// A direction for two uniform numbers in [0, 1); one in the horizon, z = 0, says that there is none for these.
    fn sample(&self, u: [S; 2]) -> V3<S>;

    /// Best estimate of E_view(ω) = ∫ f(ω, ωi)·|cos θi| dωi.
    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S>;

    /// Never below E_view(ω) nor E_light(ω), on ω's own side of the surface.
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L>;

    /// Never below E_view(ω), on ω's own side: [`albedo_bound`](Lobe::albedo_bound), unless a lobe that is not
    /// reciprocal has a tighter one.
    fn view_bound(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        self.albedo_bound(w, curve)
    }

    /// How small and how large the albedo may be over whole ranges of parameters, `(lowest, highest)` per slot as given
    /// (not yet clamped), and of cosines to the lobe's normal. `None`: to be read off the table.
    fn limits(ranges: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
        let _ = (ranges, cos);
        None
    }

    /// The first slot of a color that the albedo is at most proportional to: the lobe's [`weight`](Lobe::weight), or a
    /// reflectance that bounds it. [`limits`](Lobe::limits) leaves it out.
    fn tint_slot() -> Option<usize> {
        None
    }

    /// To which sides this instance may scatter.
    fn sides(&self) -> Sides {
        Sides::REFLECT
    }

    /// How wide this instance scatters: 0 one direction, 1 as wide as a diffuse surface. Perceptual, as users set it.
    fn roughness(&self) -> S {
        S::one()
    }

    /// For lobes of class [`Delta`](super::registry::LobeClass::Delta): the one direction they scatter to, and the part they
    /// scatter.
    fn delta(&self) -> Option<(V3<S>, Rgb<S>)> {
        None
    }
}

/// [`Lobe::evaluate`] of a lobe made again from what is kept of it.
#[inline(always)]
pub(super) fn evaluate_again<'a, S: Real, B: Lobe<S> + 'a, L: Over<S>>(
    kept: &B::Aimed,
    rest: impl FnOnce() -> Option<&'a B>,
    wi: V3<L>,
    curve: &AlbedoCurve<S::Entry>,
    bound: bool,
) -> Evaluated<L> {
    match kept.with(rest) {
        Some(lobe) => lobe.evaluate(wi, curve, bound),
        None => Evaluated::black(),
    }
}

/// [`Lobe::sample`] of a lobe made again.
#[inline(always)]
pub(super) fn sample_again<'a, S: Real, B: Lobe<S> + 'a>(
    kept: &B::Aimed,
    rest: impl FnOnce() -> Option<&'a B>,
    u: [S; 2],
) -> V3<S> {
    match kept.with(rest) {
        Some(lobe) => lobe.sample(u),
        None => V3::new(S::zero(), S::zero(), S::zero()),
    }
}

/// [`Lobe::evaluate`] of a lobe whose parts share nothing.
#[inline(always)]
pub(crate) fn apart<S: Real, L: Over<S>>(
    lobe: &impl Lobe<S>,
    wi: V3<L>,
    curve: &AlbedoCurve<S::Entry>,
    bound: bool,
) -> Evaluated<L> {
    let bound = if bound { lobe.albedo_bound(wi, curve) } else { [L::zero(); 3] };
    Evaluated { f: lobe.f(wi, curve), pdf: lobe.pdf(wi), bound }
}

/// All that an evaluation asks of a lobe for one direction, or for several side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Evaluated<L> {
    /// See [`Lobe::f`].
    pub f: Rgb<L>,
    /// See [`Lobe::pdf`].
    pub pdf: L,
    /// See [`Lobe::albedo_bound`]; 0 if it was not asked for.
    pub bound: Rgb<L>,
}

impl<L: Real> Evaluated<L> {
    /// Of what scatters nothing.
    #[inline(always)]
    pub(super) fn black() -> Self {
        Evaluated { f: [L::zero(); 3], pdf: L::zero(), bound: [L::zero(); 3] }
    }

    /// As numbers: what comes from a call stays in memory, and so does all that may stand in its place.
    #[inline(always)]
    pub(super) fn apart(self) -> Self {
        let Evaluated { f: [r, g, b], pdf, bound: [x, y, z] } = self;
        Evaluated { f: [r, g, b], pdf, bound: [x, y, z] }
    }
}

/// The albedo of a lobe and, if it is asked for, its bound.
#[inline(always)]
pub(super) fn albedos<S: Real>(
    lobe: &impl Lobe<S>,
    w: V3<S>,
    curve: &AlbedoCurve<S::Entry>,
    bound: bool,
) -> [Rgb<S>; 2] {
    [lobe.albedo(w, curve), if bound { lobe.albedo_bound(w, curve) } else { [S::zero(); 3] }]
}
