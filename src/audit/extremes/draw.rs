//! Draws parameters and directions at the ends of what may come.

use super::{Place, Setting};
use crate::closure::ClosureTree;
use crate::lobes::LobeKind;
use crate::lobes::registry::{ParamSpec, ParamTy};
use rand::{Rng, RngExt};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Roughnesses, amounts and widths as a script may pass them; lobes clamp.
const AMOUNTS: [f32; 12] = [1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.07, 0.1, 0.3, 0.7, 1.0, 10.0, 1e3];
/// Indices of refraction: next to 1 on either side, none, endless.
const INDICES: [f32; 9] = [1.0, 1.000_000_1, 0.999_999_9, 0.0, f32::INFINITY, 1e-6, 1.5, 2.4, 1e3];
const COLORS: [f32; 9] = [0.0, 1.0, 0.5, 0.2, 1e-30, 1e30, 1e-40, f32::NAN, 0.999_999_94];
const WEIGHTS: [f32; 10] = [1.0, 1.0, 1.0, 1.0, 0.5, 1e-30, 1e30, 1e-40, f32::NAN, f32::INFINITY];
/// Numbers that should not be there at all.
const ODD: [f32; 8] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e-45, -1e-45, 1e30, f32::MAX];
const COSINES: [f64; 18] =
    [0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999_99, 0.999_999_9, 1.0];
const UNIFORM: [f64; 5] = [0.0, 1e-12, 1e-6, 0.5, 0.999_999_94];

/// Sites of the three lobes of a tree.
const TESTED: u32 = 0;
const DIFFUSE: u32 = 1;
const SHEEN: u32 = 2;

/// Two directions and what to sample with.
pub(super) struct Pair {
    pub wo: [f64; 3],
    pub wi: [f64; 3],
    pub u: [f64; 3],
    /// Not directions at all: nothing to compare.
    pub odd: bool,
}

/// Parameters of the lobe under test, and the directions to look at it from.
pub(super) struct Block {
    pub values: Vec<f32>,
    pub weight: f32,
    pub pairs: Vec<Pair>,
    /// The table is the one of a script that does not know the numbers before it shades.
    open: bool,
}

impl Block {
    pub fn random(kind: LobeKind, pairs: usize, rng: &mut impl Rng) -> Self {
        let open = rng.random_range(0..4) == 0;
        let mut values = Vec::new();
        for p in kind.spec().params {
            match p.ty {
                ParamTy::Normal => values.extend([0.0, 0.0, 1.0]),
                ParamTy::Vector => values.extend([1.0, 0.0, 0.0]),
                // Open tables are one per choice of switches, and slow: the defaults will do.
                ParamTy::Int | ParamTy::String if open => values.extend(p.default),
                ParamTy::Int | ParamTy::String => values.push(switch(p, rng)),
                _ if rng.random_range(0..3) == 0 => values.extend(p.default),
                ParamTy::Color => {
                    let gray = number(p, rng);
                    let colored = rng.random();
                    values.extend((0..3).map(|_| if colored { number(p, rng) } else { gray }));
                }
                ParamTy::Float | ParamTy::Closure => values.extend((0..p.ty.slots()).map(|_| number(p, rng))),
            }
        }
        let weight = *of(&WEIGHTS, rng);
        Block { values, weight, pairs: (0..pairs).map(|_| Pair::random(rng)).collect(), open }
    }

    /// The lobe with its weight, in its setting.
    pub fn tree(&self, kind: LobeKind, setting: Setting) -> ClosureTree {
        let mut tree = ClosureTree::new();
        let lobe = tree.lobe(kind, TESTED, &self.values);
        let lobe = tree.mul([self.weight; 3], lobe);
        let root = match setting {
            Setting::Alone => lobe,
            Setting::OverDiffuse => {
                let base = tree.lobe(LobeKind::Diffuse, DIFFUSE, &defaults(LobeKind::Diffuse));
                tree.layer(lobe, base)
            }
            Setting::BelowSheen => match LobeKind::by_name("sheen_bsdf") {
                Some(sheen) => {
                    let top = tree.lobe(sheen, SHEEN, &defaults(sheen));
                    tree.layer(top, lobe)
                }
                None => lobe,
            },
        };
        tree.set_root(root);
        tree
    }

    /// What of a lobe's block is known before shading.
    pub fn known(&self, site: u32, kind: LobeKind, values: &[f32]) -> Vec<Option<f32>> {
        let mut known = Vec::new();
        for p in kind.spec().params {
            let slots = known.len()..known.len() + p.ty.slots();
            let open = self.open && site == TESTED && matches!(p.ty, ParamTy::Float | ParamTy::Color);
            known.extend(values[slots].iter().map(|v| (!open).then_some(*v)));
        }
        known
    }

    pub fn place(&self, what: &'static str, pair: &Pair, found: [f64; 3], truth: [f64; 3]) -> Place {
        Place { what, values: self.values.clone(), weight: self.weight, wo: pair.wo, wi: pair.wi, found, truth }
    }
}

fn of<'t, T>(list: &'t [T], rng: &mut impl Rng) -> &'t T {
    &list[rng.random_range(0..list.len())]
}

/// A block of defaults, N = +z and T = +x.
pub(super) fn defaults(kind: LobeKind) -> Vec<f32> {
    let mut values = Vec::new();
    for p in kind.spec().params {
        match p.ty {
            ParamTy::Normal => values.extend([0.0, 0.0, 1.0]),
            ParamTy::Vector => values.extend([1.0, 0.0, 0.0]),
            _ => values.extend(p.default),
        }
    }
    values
}

fn switch(p: &ParamSpec, rng: &mut impl Rng) -> f32 {
    let free_text = p.ty == ParamTy::String && p.options.is_empty();
    if free_text || !(p.max - p.min).is_finite() {
        return p.default.first().copied().unwrap_or(0.0);
    }
    rng.random_range(p.min as i32..=p.max as i32) as f32
}

fn number(p: &ParamSpec, rng: &mut impl Rng) -> f32 {
    let index = ["eta", "ior", "extinction"].iter().any(|n| p.name.contains(n));
    match rng.random_range(0..10) {
        0 => *of(&ODD, rng),
        _ if index => *of(&INDICES, rng),
        1 => -*of(&AMOUNTS, rng),
        _ if p.ty == ParamTy::Color => *of(&COLORS, rng),
        _ => *of(&AMOUNTS, rng),
    }
}

impl Pair {
    fn random(rng: &mut impl Rng) -> Pair {
        let u =
            std::array::from_fn(
                |_| if rng.random() { rng.random::<f64>().min(0.999_999_9) } else { *of(&UNIFORM, rng) },
            );
        if rng.random_range(0..12) == 0 {
            let mut odd = || std::array::from_fn(|_| f64::from(*of(&ODD, rng)));
            return Pair { wo: odd(), wi: odd(), u, odd: true };
        }
        let wo = direction(rng);
        let [x, y, z] = wo;
        let wi = match rng.random_range(0..8) {
            0 => wo,
            1 => [-x, -y, -z],
            // h = N: where a mirror sends it, exactly and nearly, and straight on.
            2 => [-x, -y, z],
            3 => near([-x, -y, z], rng),
            4 => near([-x, -y, -z], rng),
            _ => direction(rng),
        };
        Pair { wo, wi, u, odd: false }
    }
}

/// At a chosen cosine on either side, along an axis, beside one, or anywhere.
fn direction(rng: &mut impl Rng) -> [f64; 3] {
    let side = if rng.random_range(0..5) == 0 { -1.0 } else { 1.0 };
    let cos = if rng.random_range(0..4) == 0 { rng.random::<f64>() } else { *of(&COSINES, rng) };
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    let phi: f64 = match rng.random_range(0..6) {
        0 => 0.0,
        1 => PI,
        2 => FRAC_PI_2,
        3 => 1e-7,
        _ => rng.random::<f64>() * TAU,
    };
    [sin * phi.cos(), sin * phi.sin(), side * cos]
}

/// A direction close to `w`.
fn near(w: [f64; 3], rng: &mut impl Rng) -> [f64; 3] {
    let far = 10f64.powf(-1.0 - 7.0 * rng.random::<f64>());
    let moved = w.map(|x| x + far * (rng.random::<f64>() - 0.5));
    let length = moved.iter().map(|x| x * x).sum::<f64>().sqrt();
    moved.map(|x| x / length)
}
