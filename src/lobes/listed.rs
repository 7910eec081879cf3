//! From a lobe of any kind to the one it is, and from what a BSDF keeps of it back to the lobe.

use super::{Aimed, AimedLobe, AnyLobe, Lobe, host};
use crate::optics::Real;

/// Something to do with a lobe once its type is known.
pub(crate) trait LobeVisitor<S: Real> {
    /// It is this one of the list.
    fn scattering<B: Listed<S>>(self);
    /// A host brought it along.
    fn host(self, kept: &host::HostSeen<S>);
}

/// A lobe of the list.
pub(crate) trait Listed<S: Real>: Lobe<S> {
    /// The lobe in its case, if it is of this kind.
    fn listed(any: &AnyLobe<S>) -> Option<&Self>;
    /// What is kept of it.
    fn kept(any: &AimedLobe<S>) -> Option<&Self::Aimed>;
}

/// The lobe that `kept` is of, where `rest` is at hand if it takes any.
#[inline(always)]
pub(crate) fn again<'a, S: Real + 'a, B: Listed<S> + 'a>(
    kept: &B::Aimed,
    rest: impl FnOnce() -> Option<&'a AnyLobe<S>>,
) -> Option<B> {
    kept.with(|| rest().and_then(B::listed))
}

/// The same of a host's.
#[inline(always)]
pub(crate) fn host_again<'a, S: Real + 'a>(
    kept: &host::HostSeen<S>,
    rest: impl FnOnce() -> Option<&'a AnyLobe<S>>,
) -> Option<host::Host<S>> {
    kept.with(|| match rest() {
        Some(AnyLobe::Host(host)) => Some(host),
        _ => None,
    })
}
