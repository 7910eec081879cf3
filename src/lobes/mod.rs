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
use registry::{ClosureParams, LobeClass, LobeSpec};
pub use signatures::forms;

/// A value per colour channel.
pub type Rgb<R> = [R; 3];
/// A colour as scripts hold it: linear RGB.
pub type Rgb32 = [f32; 3];

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
    fn tinted(tints: [Rgb32; 2]) -> Sides {
        let [reflect, transmit] = tints.map(|t| t.iter().any(|x| *x > 0.0));
        Sides { reflect, transmit }
    }
}

/// One model of scattering, prepared for one ωo.
///
/// All directions are unit vectors in the lobe's local frame, pointing away from the surface; z is the normal. The
/// type parameter is what the lobe was prepared in; `f`, `pdf` and `albedo_bound` may be evaluated over lanes.
pub trait Lobe<S: Real>: Sized + Copy {
    /// The declared parameters.
    type Params: ClosureParams;

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

    /// f(ωo, ωi), without any cosine. Zero on sides the lobe does not scatter to. Finite for every input.
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L>;

    /// All that evaluating a BSDF asks at once: [`f`](Lobe::f), [`pdf`](Lobe::pdf) and, if it is asked for, the
    /// [`albedo_bound`](Lobe::albedo_bound), the same bits.
    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        let bound = if bound { self.albedo_bound(wi, curve) } else { [L::zero(); 3] };
        Evaluated { f: self.f(wi, curve), pdf: self.pdf(wi), bound }
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

    /// For lobes of class [`LobeClass::Delta`]: the one direction they scatter to, and the part they scatter.
    fn delta(&self) -> Option<(V3<S>, Rgb<S>)> {
        None
    }
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

/// See [`AnyLobe::turn`].
#[inline(always)]
fn turned<S: Real, T: Lobe<S>>(
    lobe: &T,
    wo: V3<S>,
    curve: &AlbedoCurve<S::Entry>,
    to: &mut AnyLobe<S>,
    any: impl Fn(T) -> AnyLobe<S>,
) -> bool {
    match lobe.toward(wo, curve) {
        Some(turned) => {
            *to = any(turned);
            true
        }
        None => false,
    }
}

#[inline(always)]
fn albedos<S: Real>(lobe: &impl Lobe<S>, w: V3<S>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> [Rgb<S>; 2] {
    [lobe.albedo(w, curve), if bound { lobe.albedo_bound(w, curve) } else { [S::zero(); 3] }]
}

/// Something to do with a lobe whose type is known.
pub(crate) trait LobeVisitor<S: Real> {
    /// A lobe of the list.
    fn scattering(self, lobe: &impl Lobe<S>);
    /// One that a host brought along.
    fn host(self, lobe: &host::Host<S>);
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

        impl<S: Real> AnyLobe<S> {
            /// See [`Lobe::new`]; `values` is the lobe's parameter block.
            pub fn new(kind: LobeKind, values: &[f32], wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
                match kind {
                    $( $( #[cfg(feature = $family)] )? LobeKind::$Lobe => AnyLobe::$Lobe(
                        <$module::$Lobe<S> as Lobe<S>>::new(&ClosureParams::from_slots(values), wo, curve)), )*
                    LobeKind::Host(host) => AnyLobe::Host(host::Host::prepare(host, values, wo)),
                }
            }
            /// See [`Lobe::toward`]. Written in place, because there is room for the largest lobe. False, and nothing is
            /// written, if there is no shorter way than [`new`](Self::new).
            #[inline(always)]
            pub(crate) fn turn(&self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>, to: &mut AnyLobe<S>) -> bool {
                match self {
                    AnyLobe::Diffuse(l) => turned(l, wo, curve, to, AnyLobe::Diffuse),
                    #[cfg(feature = "cloth")]
                    AnyLobe::Sheen(l) => turned(l, wo, curve, to, AnyLobe::Sheen),
                    _ => self.turn_apart(wo, curve, to),
                }
            }
            #[inline(never)]
            fn turn_apart(&self, wo: V3<S>, curve: &AlbedoCurve<S::Entry>, to: &mut AnyLobe<S>) -> bool {
                match self {
                    $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => turned(l, wo, curve, to, AnyLobe::$Lobe), )*
                    AnyLobe::Host(_) => false,
                }
            }
            /// What it is.
            pub(crate) fn kind(&self) -> LobeKind {
                match self { $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(_) => LobeKind::$Lobe, )* AnyLobe::Host(l) => LobeKind::Host(l.kind()) }
            }
            /// What evaluating a BSDF needs of a lobe, in one call.
            #[inline(always)]
            pub fn evaluate(&self, wi: V3<S>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<S> {
                match self {
                    AnyLobe::Diffuse(l) => Lobe::<S>::evaluate(l, wi, curve, bound),
                    #[cfg(feature = "cloth")]
                    AnyLobe::Sheen(l) => Lobe::<S>::evaluate(l, wi, curve, bound),
                    AnyLobe::OrenNayar(l) => Lobe::<S>::evaluate(l, wi, curve, bound),
                    _ => self.evaluate_apart(wi, curve, bound),
                }
            }
            /// Apart, so that a walk stays short whatever lobes there are.
            #[inline(never)]
            fn evaluate_apart(&self, wi: V3<S>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<S> {
                match self {
                    $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => Lobe::<S>::evaluate(l, wi, curve, bound), )*
                    AnyLobe::Host(l) => l.evaluate(wi, bound),
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
                        let bound = if bound { self.albedo_bound(w, curve) } else { [S::zero(); 3] };
                        [self.albedo(w, curve), bound]
                    }
                }
            }

            /// The smallest of them, black: until another takes its place.
            pub(crate) fn nothing() -> Self {
                AnyLobe::Diffuse(diffuse::Diffuse::black())
            }
        }

        impl<S: Real> AnyLobe<S> {
            /// Shows `visitor` the lobe as what it is. All of it in one place: what is called is not compiled for the
            /// processor's vectors.
            #[inline(always)]
            pub(crate) fn visit(&self, visitor: impl LobeVisitor<S>) {
                match self {
                    $( $( #[cfg(feature = $family)] )? AnyLobe::$Lobe(l) => visitor.scattering(l), )*
                    AnyLobe::Host(l) => visitor.host(l),
                }
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
