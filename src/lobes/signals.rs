//! Closures that scatter nothing and tell the renderer something: `holdout`, `background`, `debug`.
//!
//! Their weights, dimmed by the layers above them, arrive as `Bsdf::signals`. They take no part in any albedo.

use super::limits::{Limits, SlotRange};
use super::registry::{ClosureParams, closure};
use super::tags::{self, MAX_TAGS};
use super::{AnyLobe, Lobe, Rgb};
use crate::albedo::AlbedoCurve;
use crate::optics::{Over, Real, V3};
use std::marker::PhantomData;

closure! {
    /// Cuts a hole into the picture: the surface reflects nothing and what lies behind it does not show. The weight is the
    /// part of the pixel a compositor is to leave free.
    closure "holdout" as HoldoutParams {}
    source: "OSL specification, holdout()",
    reciprocal: true,
    class: Emission,
}

closure! {
    /// Radiance of the surroundings, for shaders that describe those: the weight, the same from both sides. On a surface
    /// it adds nothing.
    closure "background" as BackgroundParams {}
    source: "OSL specification, background()",
    reciprocal: true,
    class: Emission,
}

closure! {
    /// A value for the host to read: the weight, under the name `tag`.
    closure "debug" as DebugParams {
        /// What the value is called.
        string tag = 0.0, in (0.0, 65535.0);
    }
    source: "OSL specification, debug()",
    reciprocal: true,
    class: Emission,
}

/// What a signal stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalKind {
    /// How much of the pixel is to be left free.
    Holdout,
    /// Radiance of the surroundings.
    Background,
    /// A value with a name.
    Debug(&'static str),
}

impl SignalKind {
    /// What a lobe signals, if it does.
    pub(crate) fn of<S: Real>(lobe: &AnyLobe<S>) -> Option<SignalKind> {
        match lobe {
            AnyLobe::Holdout(_) => Some(SignalKind::Holdout),
            AnyLobe::Background(_) => Some(SignalKind::Background),
            AnyLobe::Debug(debug) => Some(SignalKind::Debug(tags::name(debug.tag as usize))),
            _ => None,
        }
    }
}

/// A lobe that scatters nothing.
#[derive(Clone, Copy, Debug)]
pub struct Silent<S, P> {
    tag: u32,
    params: PhantomData<(S, P)>,
}

/// See [`HoldoutParams`].
pub type Holdout<S> = Silent<S, HoldoutParams>;
/// See [`BackgroundParams`].
pub type Background<S> = Silent<S, BackgroundParams>;
/// See [`DebugParams`].
pub type Debug<S> = Silent<S, DebugParams>;

/// Parameters of a lobe that scatters nothing.
pub trait SignalParams: ClosureParams + std::fmt::Debug {
    /// The number of the name it goes by, if it has one.
    fn tag(&self) -> u32 {
        0
    }
}

impl SignalParams for HoldoutParams {}
impl SignalParams for BackgroundParams {}
impl SignalParams for DebugParams {
    fn tag(&self) -> u32 {
        self.tag.min(MAX_TAGS as u32 - 1)
    }
}

impl<S: Real, P: SignalParams> Lobe<S> for Silent<S, P> {
    type Params = P;
    type Aimed = Self;

    fn limits(_: &[SlotRange], _: (f64, f64)) -> Option<Limits> {
        Some(Limits { lowest: 0.0, highest: 0.0 })
    }

    fn new(params: &P, _: V3<S>, _: &AlbedoCurve<S::Entry>) -> Self {
        Silent { tag: params.tag(), params: PhantomData }
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
        V3::new(S::zero(), S::zero(), S::one())
    }

    fn albedo(&self, _: V3<S>, _: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        [S::zero(); 3]
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, _: V3<L>, _: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        [L::zero(); 3]
    }
}
