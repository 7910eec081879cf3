//! The lobes: one file each, one line each in the list below, and the trait they fulfil.
//!
//! In: a parameter block, ωo in the lobe's own frame (z = its normal), an albedo curve where the lobe asks for one.
//! Out: f, pdf, samples, albedo and – required – a bound on the albedo. A lobe never sees other lobes, weights,
//! layers or world space.

#[cfg(feature = "cloth")]
pub mod charlie;
pub mod ltc;
pub mod registry;
pub mod tags;

mod aliases;
pub mod burley;
#[cfg(feature = "cloth")]
mod charlie_terms;
#[cfg(feature = "cloth")]
mod cloth;
#[cfg(feature = "cloth")]
mod cloth_family;
#[cfg(feature = "cloth")]
mod cloth_range;
#[cfg(feature = "microfacet")]
pub mod conductor;
#[cfg(feature = "cloth")]
pub mod cylinder;
#[cfg(feature = "microfacet")]
pub mod dielectric;
pub mod diffuse;
pub mod emission;
pub mod eon;
#[cfg(feature = "cloth")]
pub mod fabric;
#[cfg(feature = "microfacet")]
mod facet_aliases;
pub mod families;
pub mod host;
#[cfg(feature = "microfacet")]
mod interface;
pub mod limits;
mod listed;
mod lobe;
mod ltc_tables;
#[cfg(feature = "microfacet")]
pub mod metal;
#[cfg(feature = "cloth")]
pub mod microcylinder;
#[cfg(feature = "cloth")]
pub mod microcylinder_threads;
#[cfg(feature = "microfacet")]
pub mod microfacet;
pub mod oren_nayar;
pub mod oren_nayar_diffuse;
#[cfg(feature = "microfacet")]
mod pane;
#[cfg(feature = "legacy")]
pub mod phong;
#[cfg(feature = "microfacet")]
mod rough;
#[cfg(feature = "microfacet")]
pub mod schlick;
#[cfg(feature = "cloth")]
pub mod sheen;
#[cfg(feature = "cloth")]
mod sheen_variant;
pub mod signals;
mod signatures;
#[cfg(feature = "microfacet")]
pub mod specular;
pub mod subsurface;
#[cfg(feature = "cloth")]
pub mod thread;
pub mod translucent;
pub mod transparent;
#[cfg(feature = "cloth")]
pub mod velvet;
#[cfg(feature = "legacy")]
pub mod ward;

use crate::albedo::{AlbedoCurve, CurveSpec, TableSpec};
use crate::optics::{Over, Real, V3};
use limits::{Limits, SlotRange};
pub(crate) use listed::{Listed, LobeVisitor, again, host_again};
use lobe::albedos;
pub use lobe::{Aimed, Evaluated, Lobe, OneOf, Sides};
use registry::{ClosureParams, LobeClass, LobeSpec};
pub use signatures::forms;

/// A value per colour channel.
pub type Rgb<R> = [R; 3];
/// A colour as scripts hold it: linear RGB.
pub type Rgb32 = [f32; 3];

/// See [`AnyLobe::turn`].
#[inline(always)]
fn turned<S: Real, T: Lobe<S>>(
    lobe: &T,
    wo: V3<S>,
    curve: &AlbedoCurve<S::Entry>,
    bound: bool,
    to: &mut AimedLobe<S>,
    any: impl Fn(T::Aimed) -> AimedLobe<S>,
) -> Option<[Rgb<S>; 2]> {
    let (turned, albedos) = lobe.seen(wo, curve, bound)?;
    *to = any(T::Aimed::of(&turned));
    Some(albedos)
}

macro_rules! lobes {
    ($( $( #[cfg(feature = $family:literal)] )? $module:ident :: $Lobe:ident ),* $(,)?) => {
        /// Names one of the registered lobes.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum LobeKind {
            $( $( #[cfg(feature = $family)] )? #[doc = concat!("See [`", stringify!($module), "::", stringify!($Lobe), "`].")] $Lobe, )*
            /// A closure that a host brought along.
            Host(host::HostKind),
        }

        impl LobeKind {
            /// Every built-in lobe.
            pub const ALL: &[LobeKind] = &[ $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe ),* ];

            /// The cargo feature that brings the lobe along; `None` for those that are always there.
            pub fn family(self) -> Option<&'static str> {
                match self {
                    $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => None$( .or(Some($family)) )?, )*
                    LobeKind::Host(_) => None,
                }
            }

            /// The lobe's declaration.
            pub fn spec(self) -> &'static LobeSpec {
                match self {
                    $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => <$module::$Lobe<f32> as Lobe<f32>>::Params::SPEC, )*
                    LobeKind::Host(host) => host.spec(),
                }
            }

            /// The albedo table a parameter block needs (`None` entries: known only when shading).
            pub fn table(self, values: &[Option<f32>]) -> Option<TableSpec> {
                match self { $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => <$module::$Lobe<f32> as Lobe<f32>>::table(values), )* LobeKind::Host(_) => None }
            }

            /// The table of a lobe whose albedo depends on the cosine alone; `None` for all others.
            pub fn curve(self, values: &[Option<f32>]) -> Option<CurveSpec> {
                match self { $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => <$module::$Lobe<f32> as Lobe<f32>>::curve(values), )* LobeKind::Host(_) => None }
            }

            /// Whether a lobe with these parameter values is reciprocal.
            pub fn reciprocal(self, values: &[f32]) -> bool {
                match self { $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => {
                    let params = <<$module::$Lobe<f32> as Lobe<f32>>::Params as ClosureParams>::from_slots(values);
                    <$module::$Lobe<f32> as Lobe<f32>>::reciprocal(&params)
                }, )* LobeKind::Host(host) => host.spec().reciprocal }
            }

            fn closed_limits(self, ranges: &[SlotRange], cos: (f64, f64)) -> Option<Limits> {
                match self {
                    $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => <$module::$Lobe<f32> as Lobe<f32>>::limits(ranges, cos), )*
                    LobeKind::Host(host) => Some(Limits { lowest: 0.0, highest: host.albedo_at_most().into() }),
                }
            }

            /// See [`Lobe::tint_slot`].
            pub fn tint_slot(self) -> Option<usize> {
                match self { $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => <$module::$Lobe<f32> as Lobe<f32>>::tint_slot(), )* LobeKind::Host(_) => None }
            }

            /// Whether f of a lobe with these parameter values depends on where its tangent points; of a host's lobe that
            /// is not known.
            pub fn follows_tangent(self, values: &[f32]) -> bool {
                match self { $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => {
                    let params = <<$module::$Lobe<f32> as Lobe<f32>>::Params as ClosureParams>::from_slots(values);
                    <$module::$Lobe<f32> as Lobe<f32>>::follows_tangent(&params)
                }, )* LobeKind::Host(_) => true }
            }

            /// See [`Lobe::between_media`].
            pub fn between_media(self, values: &[f32]) -> bool {
                match self { $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => {
                    let params = <<$module::$Lobe<f32> as Lobe<f32>>::Params as ClosureParams>::from_slots(values);
                    <$module::$Lobe<f32> as Lobe<f32>>::between_media(&params)
                }, )* LobeKind::Host(_) => false }
            }

            /// The color that multiplies a lobe with these parameter values.
            pub fn weight(self, values: &[f32]) -> Rgb32 {
                match self { $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => {
                    let params = <<$module::$Lobe<f32> as Lobe<f32>>::Params as ClosureParams>::from_slots(values);
                    <$module::$Lobe<f32> as Lobe<f32>>::weight(&params)
                }, )* LobeKind::Host(_) => [1.0; 3] }
            }
        }

        /// A prepared lobe of any kind: the one place that dispatches.
        #[derive(Clone, Copy, Debug)]
        pub enum AnyLobe<S: Real> {
            $( $( #[cfg(feature = $family)] )? #[doc = concat!("See [`", stringify!($module), "::", stringify!($Lobe), "`].")] $Lobe($module::$Lobe<S>), )*
            /// See [`host::HostLobe`].
            Host(host::Host<S>),
        }

        $(
            $( #[cfg(feature = $family)] )?
            impl<S: Real> Listed<S> for $module::$Lobe<S> {
                #[inline(always)]
                fn listed(any: &AnyLobe<S>) -> Option<&Self> {
                    match any {
                        AnyLobe::$Lobe(lobe) => Some(lobe),
                        _ => None,
                    }
                }
                #[inline(always)]
                fn kept(any: &AimedLobe<S>) -> Option<&Self::Aimed> {
                    match any {
                        AimedLobe::$Lobe(kept) => Some(kept),
                        _ => None,
                    }
                }
            }
        )*

        /// What a BSDF keeps of a lobe; `rest` is always one of the same parameters, if there is need of it.
        #[derive(Clone, Copy, Debug)]
        pub(crate) enum AimedLobe<S: Real> {
            $( $( #[cfg(feature = $family)] )? $Lobe(<$module::$Lobe<S> as Lobe<S>>::Aimed), )*
            Host(host::HostSeen<S>),
        }

        impl<S: Real> AimedLobe<S> {
            /// Of a prepared lobe.
            pub fn of(lobe: &AnyLobe<S>) -> Self {
                match lobe {
                    $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => AimedLobe::$Lobe(Aimed::<$module::$Lobe<S>>::of(l)), )*
                    AnyLobe::Host(l) => AimedLobe::Host(Aimed::of(l)),
                }
            }
            /// What it is.
            pub fn kind(&self) -> LobeKind {
                match self { $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(_) => LobeKind::$Lobe, )* AimedLobe::Host(l) => LobeKind::Host(l.kind()) }
            }
            /// The lobe again. `None` without its rest.
            #[inline(never)]
            pub fn whole(&self, rest: Option<&AnyLobe<S>>) -> Option<AnyLobe<S>> {
                match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => again(l, || rest).map(AnyLobe::$Lobe), )*
                    AimedLobe::Host(l) => host_again(l, || rest).map(AnyLobe::Host),
                }
            }
            /// What evaluating a BSDF needs of a lobe, in one call.
            #[inline(always)]
            pub fn evaluate<'a>(
                &self,
                rest: impl Fn() -> Option<&'a AnyLobe<S>>,
                wi: V3<S>,
                curve: &AlbedoCurve<S::Entry>,
                bound: bool,
            ) -> Evaluated<S> where S: 'a {
                match self {
                    AimedLobe::Diffuse(l) => diffuse::Diffuse::<S>::evaluate_kept(l, || rest().and_then(Listed::listed), wi, curve, bound),
                    #[cfg(feature = "cloth")]
                    AimedLobe::Sheen(l) => sheen::Sheen::<S>::evaluate_kept(l, || rest().and_then(Listed::listed), wi, curve, bound),
                    AimedLobe::OrenNayar(l) => oren_nayar::OrenNayar::<S>::evaluate_kept(l, || rest().and_then(Listed::listed), wi, curve, bound),
                    _ => self.evaluate_apart(rest(), wi.apart(), curve, bound).apart(),
                }
            }
            /// Apart, so that a walk stays short whatever lobes there are.
            #[inline(never)]
            fn evaluate_apart(
                &self,
                rest: Option<&AnyLobe<S>>,
                wi: V3<S>,
                curve: &AlbedoCurve<S::Entry>,
                bound: bool,
            ) -> Evaluated<S> {
                match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => <$module::$Lobe<S> as Lobe<S>>::evaluate_kept(l, || rest.and_then(Listed::listed), wi, curve, bound), )*
                    AimedLobe::Host(l) => match host_again(l, || rest) {
                        Some(l) => l.evaluate(wi, bound),
                        None => Evaluated::black(),
                    },
                }
            }
            /// See [`Lobe::f`].
            pub fn f(&self, rest: Option<&AnyLobe<S>>, wi: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
                let f = match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => again::<S, $module::$Lobe<S>>(l, || rest).map(|l| l.f(wi, curve)), )*
                    AimedLobe::Host(l) => host_again(l, || rest).map(|l| l.f(wi)),
                };
                f.unwrap_or([S::zero(); 3])
            }
            /// See [`Lobe::pdf`].
            pub fn pdf(&self, rest: Option<&AnyLobe<S>>, wi: V3<S>) -> S {
                let pdf = match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => again::<S, $module::$Lobe<S>>(l, || rest).map(|l| Lobe::<S>::pdf(&l, wi)), )*
                    AimedLobe::Host(l) => host_again(l, || rest).map(|l| l.pdf(wi)),
                };
                pdf.unwrap_or(S::zero())
            }
            /// See [`Lobe::sample`].
            #[inline(always)]
            pub fn sample<'a>(&self, rest: impl Fn() -> Option<&'a AnyLobe<S>>, u: [S; 2]) -> V3<S> where S: 'a {
                match self {
                    AimedLobe::Diffuse(l) => diffuse::Diffuse::<S>::sample_kept(l, || rest().and_then(Listed::listed), u),
                    #[cfg(feature = "cloth")]
                    AimedLobe::Sheen(l) => sheen::Sheen::<S>::sample_kept(l, || rest().and_then(Listed::listed), u),
                    AimedLobe::OrenNayar(l) => oren_nayar::OrenNayar::<S>::sample_kept(l, || rest().and_then(Listed::listed), u),
                    _ => self.sample_apart(rest(), u).apart(),
                }
            }
            #[inline(never)]
            fn sample_apart(&self, rest: Option<&AnyLobe<S>>, u: [S; 2]) -> V3<S> {
                match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => <$module::$Lobe<S> as Lobe<S>>::sample_kept(l, || rest.and_then(Listed::listed), u), )*
                    AimedLobe::Host(l) => match host_again(l, || rest) {
                        Some(l) => l.sample(u),
                        None => V3::new(S::zero(), S::zero(), S::zero()),
                    },
                }
            }
            /// See [`Lobe::albedo_bound`].
            pub fn albedo_bound(&self, rest: Option<&AnyLobe<S>>, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
                let bound = match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => again::<S, $module::$Lobe<S>>(l, || rest).map(|l| l.albedo_bound(w, curve)), )*
                    AimedLobe::Host(l) => host_again(l, || rest).map(|l| l.albedo_bound(w)),
                };
                bound.unwrap_or([S::zero(); 3])
            }
            /// See [`Lobe::view_bound`].
            pub fn view_bound(&self, rest: Option<&AnyLobe<S>>, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
                let bound = match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => again::<S, $module::$Lobe<S>>(l, || rest).map(|l| l.view_bound(w, curve)), )*
                    AimedLobe::Host(l) => host_again(l, || rest).map(|l| l.albedo_bound(w)),
                };
                bound.unwrap_or([S::zero(); 3])
            }
            /// Tells `visitor` what it is. All of it in one place: what is called is not compiled for the processor's vectors.
            #[inline(always)]
            pub fn visit(&self, visitor: impl LobeVisitor<S>) {
                match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(_) => visitor.scattering::<$module::$Lobe<S>>(), )*
                    AimedLobe::Host(kept) => visitor.host(kept),
                }
            }
        }

        impl<S: Real> AnyLobe<S> {
            /// See [`Lobe::new`]; `values` is the lobe's parameter block.
            pub fn new(kind: LobeKind, values: &[f32], wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
                match kind {
                    $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => AnyLobe::$Lobe(
                        <$module::$Lobe<S> as Lobe<S>>::new(&ClosureParams::from_slots(values), wo, curve)), )*
                    LobeKind::Host(host) => AnyLobe::Host(host::Host::prepare(host, values, wo)),
                }
            }
            /// See [`Lobe::seen`]. Written in place, because there is room for the largest lobe. `None`, and nothing is
            /// written, if there is no shorter way than [`new`](Self::new).
            #[inline(always)]
            pub(crate) fn turn(
                &self,
                wo: V3<S>,
                curve: &AlbedoCurve<S::Entry>,
                bound: bool,
                to: &mut AimedLobe<S>,
            ) -> Option<[Rgb<S>; 2]> {
                match self {
                    AnyLobe::Diffuse(l) => turned(l, wo, curve, bound, to, AimedLobe::Diffuse),
                    #[cfg(feature = "cloth")]
                    AnyLobe::Sheen(l) => turned(l, wo, curve, bound, to, AimedLobe::Sheen),
                    AnyLobe::OrenNayar(l) => turned(l, wo, curve, bound, to, AimedLobe::OrenNayar),
                    _ => {
                        // As numbers: what comes from a call stays in memory.
                        let [[a, b, c], [d, e, f]] = self.turn_apart(wo.apart(), curve, bound, to)?;
                        Some([[a, b, c], [d, e, f]])
                    }
                }
            }
            #[inline(never)]
            fn turn_apart(
                &self,
                wo: V3<S>,
                curve: &AlbedoCurve<S::Entry>,
                bound: bool,
                to: &mut AimedLobe<S>,
            ) -> Option<[Rgb<S>; 2]> {
                match self {
                    $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => turned(l, wo, curve, bound, to, AimedLobe::$Lobe), )*
                    AnyLobe::Host(_) => None,
                }
            }
            /// Whether a BSDF keeps only a part of it.
            pub(crate) fn is_kept_apart(&self) -> bool {
                match self {
                    $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(_) => <<$module::$Lobe<S> as Lobe<S>>::Aimed as Aimed<$module::$Lobe<S>>>::APART, )*
                    AnyLobe::Host(_) => true,
                }
            }
            /// See [`Lobe::f`].
            #[inline]
            pub fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => l.f(wi, curve), )* AnyLobe::Host(l) => l.f(wi) }
            }
            /// See [`Lobe::pdf`].
            #[inline]
            pub fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => l.pdf(wi), )* AnyLobe::Host(l) => l.pdf(wi) }
            }
            /// See [`Lobe::sample`].
            #[inline]
            pub fn sample(&self, u: [S; 2]) -> V3<S> {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => l.sample(u), )* AnyLobe::Host(l) => l.sample(u) }
            }
            /// See [`Lobe::albedo`].
            #[inline]
            pub fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => l.albedo(w, curve), )* AnyLobe::Host(l) => l.albedo(w) }
            }
            /// See [`Lobe::albedo_bound`].
            #[inline]
            pub fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => l.albedo_bound(w, curve), )* AnyLobe::Host(l) => l.albedo_bound(w) }
            }
            /// See [`Lobe::view_bound`].
            pub fn view_bound(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => l.view_bound(w, curve), )* AnyLobe::Host(l) => l.albedo_bound(w) }
            }
            /// See [`Lobe::sides`].
            pub fn sides(&self) -> Sides {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => Lobe::<S>::sides(l), )* AnyLobe::Host(l) => l.sides() }
            }
            /// See [`Lobe::roughness`].
            pub fn roughness(&self) -> S {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => Lobe::<S>::roughness(l), )* AnyLobe::Host(l) => l.roughness() }
            }
            /// See [`Lobe::relative_eta`].
            #[inline]
            pub fn relative_eta<L: Over<S>>(&self, wi: V3<L>) -> L {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => l.relative_eta(wi), )* AnyLobe::Host(_) => L::one() }
            }
            /// See [`Lobe::delta`].
            #[inline]
            pub fn delta(&self) -> Option<(V3<S>, Rgb<S>)> {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => Lobe::<S>::delta(l), )* AnyLobe::Host(_) => None }
            }
        }

        impl<S: Real> AnyLobe<S> {
            /// [`albedo`](Self::albedo), and [`albedo_bound`](Self::albedo_bound) if it is asked for. Here, not in a call, for
            /// the lobes that most materials are made of: three numbers that come from a call have to be waited for.
            #[inline(always)]
            pub(crate) fn albedos(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> [Rgb<S>; 2] {
                match self {
                    AnyLobe::Diffuse(l) => albedos(l, w, curve, bound),
                    #[cfg(feature = "cloth")]
                    AnyLobe::Sheen(l) => albedos(l, w, curve, bound),
                    AnyLobe::OrenNayar(l) => albedos(l, w, curve, bound),
                    _ => {
                        let bound = if bound { self.albedo_bound(w.apart(), curve) } else { [S::zero(); 3] };
                        [self.albedo(w.apart(), curve), bound]
                    }
                }
            }
        }

        impl<S: Real> AimedLobe<S> {
            /// Of a sample: the index of refraction on ωi's side over that on ωo's, and [`AnyLobe::roughness`].
            #[inline(always)]
            pub fn crossing<'a>(&self, rest: impl Fn() -> Option<&'a AnyLobe<S>>, wi: V3<S>) -> (S, S) where S: 'a {
                match self {
                    AimedLobe::Diffuse(_) => (S::one(), S::one()),
                    #[cfg(feature = "cloth")]
                    AimedLobe::Sheen(_) => (S::one(), S::one()),
                    AimedLobe::OrenNayar(_) => (S::one(), S::one()),
                    _ => self.crossing_apart(rest(), wi.apart()),
                }
            }

            #[inline(never)]
            fn crossing_apart(&self, rest: Option<&AnyLobe<S>>, wi: V3<S>) -> (S, S) {
                let crossing = match self {
                    $( $( #[cfg(feature = $family)] )? AimedLobe::$Lobe(l) => again::<S, $module::$Lobe<S>>(l, || rest).map(|l| (S::one() / Lobe::<S>::relative_eta(&l, wi), Lobe::<S>::roughness(&l))), )*
                    AimedLobe::Host(l) => host_again(l, || rest).map(|l| (S::one(), l.roughness())),
                };
                crossing.unwrap_or((S::one(), S::one()))
            }

            /// The smallest of them, black: until another takes its place.
            pub fn nothing() -> Self {
                AimedLobe::Diffuse(diffuse::Diffuse::black())
            }
        }
    };
}

// What a build may leave out stands behind the feature that brings it.
lobes! {
    diffuse::Diffuse,
    translucent::Translucent,
    transparent::Transparent,
    emission::Emission,
    #[cfg(feature = "cloth")]
    fabric::Fabric,
    oren_nayar::OrenNayar,
    #[cfg(feature = "cloth")]
    sheen::Sheen,
    #[cfg(feature = "cloth")]
    thread::Thread,
    #[cfg(feature = "cloth")]
    microcylinder::Microcylinder,
    #[cfg(feature = "cloth")]
    microcylinder_threads::MicrocylinderThreads,
    #[cfg(feature = "cloth")]
    velvet::Velvet,
    eon::Eon,
    #[cfg(feature = "microfacet")]
    microfacet::Microfacet,
    #[cfg(feature = "microfacet")]
    dielectric::Dielectric,
    #[cfg(feature = "microfacet")]
    conductor::Conductor,
    #[cfg(feature = "microfacet")]
    schlick::GeneralizedSchlick,
    #[cfg(feature = "microfacet")]
    specular::Reflection,
    #[cfg(feature = "microfacet")]
    specular::Refraction,
    oren_nayar_diffuse::OrenNayarDiffuse,
    burley::Burley,
    #[cfg(feature = "microfacet")]
    metal::Metal,
    #[cfg(feature = "legacy")]
    phong::Phong,
    #[cfg(feature = "legacy")]
    ward::Ward,
    subsurface::Subsurface,
    signals::Holdout,
    signals::Background,
    signals::Debug,
}

impl LobeKind {
    /// Whether the lobe scatters, transmits in one direction, or emits.
    pub fn class(self) -> LobeClass {
        self.spec().class
    }

    /// Whether the lobe, at its defaults, sends light to the other side.
    pub fn transmits(self) -> bool {
        let mut values = Vec::new();
        for p in self.spec().params {
            if p.default.is_empty() {
                values.extend([0.0; 3].iter().take(p.ty.slots()));
            } else {
                values.extend(p.default);
            }
        }
        let (curve, wo) = (AlbedoCurve::default(), V3::polar(0.8, 0.0));
        let lobe = AnyLobe::<f64>::new(self, &values, wo, &curve);
        let below = |cos: f64| lobe.f(V3::polar(-cos, 0.4), &curve).iter().any(|f| *f > 0.0);
        lobe.delta().is_some_and(|(wi, _)| wi.z < 0.0) || [0.1, 0.5, 0.9].into_iter().any(below)
    }

    /// Between what the albedo lies over ranges of parameters and of cosines: see [`Lobe::limits`].
    pub fn limits(self, ranges: &[SlotRange], cos: (f64, f64)) -> Limits {
        self.closed_limits(ranges, cos).unwrap_or_else(|| limits::of_table(self, ranges, cos))
    }

    /// The lobe called `name`.
    pub fn by_name(name: &str) -> Option<LobeKind> {
        LobeKind::ALL.iter().copied().find(|k| k.spec().name == name)
    }
}
