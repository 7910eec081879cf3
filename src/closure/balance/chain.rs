//! The layers above a lobe, as far as balancing asks.

use super::super::walk::{LobeVisit, first};
use super::Unbalanced;
use crate::lobes::Rgb;
use crate::optics::{Scalar, V3};
use smallvec::SmallVec;

/// A layer that is open.
#[derive(Clone, Copy, Debug)]
struct Open<S> {
    /// Its top is still being walked.
    in_top: bool,
    /// Some lobe of the top follows a tangent.
    tangent: bool,
    /// The normal its lobes share.
    normal: Option<V3<S>>,
    /// They do not share one.
    mixed: bool,
    /// The lobe the top is, unless it is more than one.
    single: Option<Single<S>>,
    more: bool,
}

/// A lobe that is a whole top.
#[derive(Clone, Copy, Debug)]
pub struct Single<S> {
    pub site: u32,
    pub weight: Rgb<S>,
    /// The parameter that varies.
    pub param: S,
}

/// The layers that are open.
#[derive(Clone, Debug)]
pub struct Chain<S> {
    open: SmallVec<[Open<S>; 4]>,
}

impl<S> Default for Chain<S> {
    fn default() -> Self {
        Chain { open: SmallVec::new() }
    }
}

impl<S: Scalar> Chain<S> {
    pub fn begin(&mut self) {
        for open in self.open.iter_mut().filter(|o| o.in_top) {
            open.more = true;
        }
        self.open.push(Open { in_top: true, tangent: false, normal: None, mixed: false, single: None, more: false });
    }

    pub fn middle(&mut self) {
        if let Some(open) = self.open.last_mut() {
            open.in_top = false;
        }
    }

    pub fn end(&mut self) {
        self.open.pop();
    }

    /// A lobe that scatters, with its normal and the parameter of it that varies.
    pub fn lobe(&mut self, visit: &LobeVisit<'_, S>, normal: V3<S>, param: S) {
        let spec = visit.kind.spec();
        for open in self.open.iter_mut().filter(|o| o.in_top) {
            open.tangent |= visit.kind.follows_tangent(visit.values);
            if spec.normal_slot().is_some() {
                open.mixed |= open.normal.is_some_and(|n| n != normal);
                open.normal = Some(normal);
            }
            open.more |= open.single.is_some();
            open.single = Some(Single { site: visit.site, weight: first(visit.weights.in_top), param });
        }
    }

    fn above(&self) -> impl Iterator<Item = &Open<S>> {
        self.open.iter().filter(|o| !o.in_top)
    }

    /// Whether any layer lies above.
    pub fn has_layers(&self) -> bool {
        self.above().next().is_some()
    }

    /// Whether α of all layers above is a function of the cosine to `normal` alone.
    pub fn fits(&self, normal: V3<S>) -> Result<(), Unbalanced> {
        if self.above().any(|o| o.tangent) {
            return Err(Unbalanced::Tangent);
        }
        if self.above().any(|o| o.mixed || o.normal.is_some_and(|n| n != normal)) {
            return Err(Unbalanced::Normal);
        }
        Ok(())
    }

    /// The one lobe above, with the same normal.
    pub fn single(&self, normal: V3<S>) -> Option<Single<S>> {
        let mut above = self.above();
        let (only, more) = (above.next()?, above.next());
        self.fits(normal).ok()?;
        if more.is_some() || only.more { None } else { only.single }
    }
}
