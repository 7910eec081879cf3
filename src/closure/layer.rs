//! The layering rule: the only place that knows how a layer scales what lies below it.
//!
//! f = f_top + s(ωo, ωi)·f_base, s = min(α(ωo), α(ωi)), α(ω) = 1 − Ē_top(ω) clamped to [0, 1], where Ē_top bounds the
//! albedo of everything in the top on ω's own side. For any base that keeps energy,
//! ∫ f|cos| ≤ E_top(ωo) + (1 − Ē_top(ωo)) ≤ 1, from either side: the composition cannot gain. (Conty & Kulla 2017, §5,
//! after Kelemen & Szirmay-Kalos 2001. Read literally the paper scales by the sheen's own albedo; α is what a layer
//! passes on.)
//!
//! [`LayerStack`] follows a tree written out top before base, and gives for one direction at a time the bound of every
//! top and the scale of every lobe. A layer may stand in another's top or base, at any depth.

use crate::lobes::Rgb;
use crate::optics::{Lift, Real, array};

/// How a layer scales its base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LayeringRule {
    /// min(α(ωo), α(ωi)): reciprocal, never gains; loses up to 15 % on a white base.
    #[default]
    Min,
    /// s(ωo)·s(ωi), solved per base lobe so that its albedo becomes exactly α(ωo) times its own: reciprocal, and for
    /// a reciprocal top lossless. Where that is not to be had, `Min`; see [`super::balance`].
    Balanced,
    /// 1 − E(ωo): loses nothing seen from the camera; not reciprocal, gains seen from the light.
    View,
}

impl LayeringRule {
    /// Every rule there is.
    pub const ALL: [LayeringRule; 3] = [LayeringRule::Min, LayeringRule::Balanced, LayeringRule::View];
}

/// Which channels of a top's albedo a layer answers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TintRule {
    /// The largest channel dims all: the base keeps its hue.
    #[default]
    Largest,
    /// Each channel dims itself: lossless for coloured tops, but the base takes the complementary hue.
    Channel,
}

/// α = 1 − Ē, what a layer passes on: for each channel, or (`C` = 1, under [`TintRule::Largest`] alone) once for all.
#[inline(always)]
pub fn alpha<L: Real, const C: usize>(tint: TintRule, bound: Rgb<L>) -> [L; C] {
    let pass = |e: L| (L::one() - e).clamp(L::zero(), L::one());
    match tint {
        TintRule::Largest => [pass(bound[0].max(bound[1]).max(bound[2])); C],
        TintRule::Channel => array(|c| pass(bound[c])),
    }
}

/// s(ωo, ωi), what a layer scales its base by.
#[inline(always)]
pub fn scale<L: Real, const C: usize>(rule: LayeringRule, alpha_o: [L; C], alpha_i: [L; C]) -> [L; C] {
    match rule {
        // What was solved for takes the place of this.
        LayeringRule::Min | LayeringRule::Balanced => array(|c| alpha_o[c].min(alpha_i[c])),
        LayeringRule::View => alpha_o,
    }
}

/// What stands before a lobe of a [`FlatStack`], in the order in which it happens.
pub(crate) mod step {
    /// Nothing new.
    pub const NONE: u8 = 0;
    /// No layer dims what follows.
    pub const CLEAR: u8 = 1;
    /// A base begins.
    pub const MIDDLE: u8 = 2;
    /// A top begins.
    pub const BEGIN: u8 = 4;
}

/// [`LayerStack`] for trees whose tops hold no layers and whose bases hold one at their end, as scripts build them
/// (`Ci = sheen(Ci, …)`), all channels dimmed alike: the same numbers for less.
#[derive(Clone, Copy)]
pub(crate) struct FlatStack<L> {
    /// Bound on the albedo of the top being walked, so far; the fourth is idle, but four go as one.
    bound: [L; 4],
    /// The product of all layer scales above here.
    scale: L,
}

impl<L: Real> Default for FlatStack<L> {
    /// Outside of any layer.
    #[inline(always)]
    fn default() -> Self {
        FlatStack { bound: [L::zero(); 4], scale: L::one() }
    }
}

impl<L: Real> FlatStack<L> {
    /// Takes the steps before a lobe. `alpha_o` is α toward ωo of the layer whose base begins. Returns the lobe's scale.
    #[inline(always)]
    pub fn step(&mut self, steps: u8, rule: LayeringRule, alpha_o: L) -> L {
        if steps != step::NONE {
            if steps & step::CLEAR != 0 {
                self.scale = L::one();
            }
            if steps & step::MIDDLE != 0 {
                let [s] = scale(rule, [alpha_o], [self.alpha()]);
                self.scale *= s;
            }
            if steps & step::BEGIN != 0 {
                self.bound = [L::zero(); 4];
            }
        }
        self.scale
    }

    /// α of the top that is complete.
    #[inline(always)]
    pub fn alpha(&self) -> L {
        let [r, g, b, _] = self.bound;
        let [alpha] = alpha(TintRule::Largest, [r, g, b]);
        alpha
    }

    /// A lobe of a top: see [`LayerStack::lobe`].
    #[inline(always)]
    pub fn lobe<S: Real>(&mut self, weight: [S; 4], bound: Rgb<L>)
    where
        L: Lift<S>,
    {
        let bound = [bound[0], bound[1], bound[2], bound[2]];
        for c in 0..4 {
            self.bound[c] = L::lift(weight[c]).mul_add(bound[c], self.bound[c]);
        }
    }
}

/// What is set aside while a layer is open.
#[derive(Clone, Copy, Debug)]
struct Saved<L, const C: usize> {
    bound: Rgb<L>,
    path: [L; C],
    scale: [L; C],
}

/// Walks a tree, written out as `begin top… middle base… end` per layer, for one direction.
///
/// `D` is how many layers may be open at once. `C` is 3, or 1 where all channels are dimmed alike ([`TintRule::Largest`]):
/// the same numbers for a third of the work.
#[derive(Clone, Copy)]
pub struct LayerStack<L, const D: usize, const C: usize = 3> {
    saved: [Saved<L, C>; D],
    open: usize,
    /// Bound on the albedo of the top being walked (outside any top: of the whole tree), so far.
    bound: Rgb<L>,
    /// What the layers between that top's root and here pass on.
    path: [L; C],
    /// The product of all layer scales above here.
    scale: [L; C],
}

impl<L: Real, const D: usize, const C: usize> Default for LayerStack<L, D, C> {
    #[inline(always)]
    fn default() -> Self {
        let (zero, one) = ([L::zero(); 3], [L::one(); C]);
        LayerStack {
            saved: [Saved { bound: zero, path: one, scale: one }; D],
            open: 0,
            bound: zero,
            path: one,
            scale: one,
        }
    }
}

impl<L: Real, const D: usize, const C: usize> LayerStack<L, D, C> {
    /// What the layers above scale a lobe here by.
    #[inline(always)]
    pub fn scale(&self) -> Rgb<L> {
        array(|c| self.scale[c % C])
    }

    /// The bound on the whole tree's albedo, after the walk.
    #[inline(always)]
    pub fn bound(&self) -> Rgb<L> {
        self.bound
    }

    /// A lobe whose albedo bound, weighted relative to the top it stands in, is `weight`·`bound`.
    #[inline(always)]
    pub fn lobe<S: Real>(&mut self, weight: Rgb<S>, bound: Rgb<L>)
    where
        L: Lift<S>,
    {
        for c in 0..3 {
            self.bound[c] = (L::lift(weight[c]) * self.path[c % C]).mul_add(bound[c], self.bound[c]);
        }
    }

    /// What was set aside when the innermost open layer began.
    #[inline(always)]
    fn outer(&mut self) -> &mut Saved<L, C> {
        // Where one layer is the most, the compiler is told: all this then stays in registers.
        &mut self.saved[if D == 1 { 0 } else { self.open - 1 }]
    }

    /// A layer begins, its top first.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.open += 1;
        // The only layer stands in no other, so that nothing dims it.
        let ([path, scale], one) = ([self.path, self.scale], [L::one(); C]);
        let [path, scale] = if D == 1 { [one; 2] } else { [path, scale] };
        *self.outer() = Saved { bound: self.bound, path, scale };
        self.bound = [L::zero(); 3];
        self.path = one;
    }

    /// The top is complete, the base follows. `weight` is the layer's own weight relative to the top it stands in;
    /// `alpha_o` is this layer's α toward ωo, or `None` if this walk is the one for ωo. Returns α for this direction.
    #[inline(always)]
    pub fn middle<S: Real>(
        &mut self,
        weight: Rgb<S>,
        rule: LayeringRule,
        tint: TintRule,
        alpha_o: Option<Rgb<S>>,
    ) -> Rgb<L>
    where
        L: Lift<S>,
    {
        let alpha: [L; C] = alpha(tint, self.bound);
        // Seen from the light, `view` dims nothing: the bound there is Ē_t + Ē_b.
        let passed = if rule == LayeringRule::View && alpha_o.is_some() { [L::one(); C] } else { alpha };
        let toward_viewer = alpha_o.map_or(alpha, |a| array(|c| L::lift(a[c])));
        let s = scale(rule, toward_viewer, alpha);
        let outer = *self.outer();
        for c in 0..3 {
            // Bound of a layer as part of a top: Ē_t + α·Ē_b, per channel.
            self.bound[c] = (L::lift(weight[c]) * outer.path[c % C]).mul_add(self.bound[c], outer.bound[c]);
        }
        for c in 0..C {
            self.path[c] = outer.path[c] * passed[c];
            self.scale[c] = outer.scale[c] * s[c];
        }
        array(|c| alpha[c % C])
    }

    /// The layer is complete.
    #[inline(always)]
    pub fn end(&mut self) {
        let Saved { path, scale, .. } = *self.outer();
        (self.path, self.scale) = (path, scale);
        self.open -= 1;
    }
}
