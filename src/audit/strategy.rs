//! Random closure trees for property tests with `proptest`.
//!
//! The trees are budgeted: whatever is built of them must not gain energy. They shrink to fewer and plainer lobes,
//! toward default parameters, weights of one and normals along +z. Bake their tables with
//! [`Curves::for_tree`](crate::closure::Curves::for_tree).

use super::trees::Recipe;
use crate::closure::ClosureTree;
use crate::lobes::registry::{ParamSpec, ParamTy};
use crate::lobes::{LobeKind, Rgb32};
use proptest::collection::vec;
use proptest::prelude::*;

/// A budgeted tree of all registered lobes, nested up to five deep. [`super::script`] prints one.
///
/// ```
/// use overcoat::audit::strategy::closure_tree;
/// use proptest::prelude::*;
/// proptest!(ProptestConfig::with_cases(16), |(tree in closure_tree())| {
///     prop_assert!(tree.within_budget().is_ok());
/// });
/// ```
pub fn closure_tree() -> impl Strategy<Value = ClosureTree> {
    recipe().prop_map(|recipe| numbered(&recipe).tree())
}

/// What [`closure_tree`] builds from.
pub fn recipe() -> impl Strategy<Value = Recipe> {
    lobe().prop_recursive(5, 24, 4, |inner| {
        prop_oneof![
            (weight(), inner.clone()).prop_map(|(w, closure)| Recipe::Weighted(w, Box::new(closure))),
            (vec((share(), inner.clone()), 1..5), any::<bool>())
                .prop_map(|(terms, leans_right)| sum(terms, leans_right)),
            (inner.clone(), inner).prop_map(|(top, base)| Recipe::Layer(Box::new(top), Box::new(base))),
        ]
    })
}

/// The terms of a sum, their shares scaled down until no channel claims more than one.
fn sum(terms: Vec<(Rgb32, Recipe)>, leans_right: bool) -> Recipe {
    let total: [f64; 3] = std::array::from_fn(|c| terms.iter().map(|t| t.0[c] as f64).sum::<f64>().max(1.0));
    let scaled = |(w, closure): (Rgb32, Recipe)| {
        let w = std::array::from_fn(|c| (w[c] as f64 / total[c]) as f32);
        Recipe::Weighted(w, Box::new(closure))
    };
    Recipe::Sum { terms: terms.into_iter().map(scaled).collect(), leans_right }
}

/// Shrinks toward white.
fn weight() -> impl Strategy<Value = Rgb32> {
    prop_oneof![
        Just([1.0; 3]),
        (0u8..=100).prop_map(|dark| [1.0 - f32::from(dark) / 100.0; 3]),
        [0u8..=100, 0..=100, 0..=100].prop_map(|dark| dark.map(|d| 1.0 - f32::from(d) / 100.0)),
    ]
}

/// The share of a term before all are scaled to fit.
fn share() -> impl Strategy<Value = Rgb32> {
    prop_oneof![(0u8..=100).prop_map(|s| [f32::from(s) / 100.0; 3]), weight()]
}

/// Any lobe, the plain ones first.
fn lobe() -> impl Strategy<Value = Recipe> {
    (0..LobeKind::ALL.len()).prop_flat_map(|index| {
        let kind = LobeKind::ALL[index];
        let blocks: Vec<BoxedStrategy<Vec<f32>>> = kind.spec().params.iter().map(slots).collect();
        blocks.prop_map(move |values| Recipe::Lobe { kind, site: 0, values: values.concat() })
    })
}

/// A parameter's slots: the default first, then both ends and hundredths of the range.
fn slots(p: &'static ParamSpec) -> BoxedStrategy<Vec<f32>> {
    let (lo, hi) = (p.min.max(-10.0), p.max.min(1e3));
    match p.ty {
        ParamTy::Normal => prop_oneof![
            2 => Just(vec![0.0, 0.0, 1.0]),
            1 => (0i8..=12, 0i8..=12).prop_map(|(x, y)| vec![f32::from(x) / 10.0, -f32::from(y) / 10.0, 1.0]),
        ]
        .boxed(),
        ParamTy::Vector => prop_oneof![
            Just(vec![1.0, 0.0, 0.0]),
            [-9i8..=9, -9..=9, -9..=9].prop_map(|v| v.map(|x| f32::from(x) / 9.0).to_vec()),
        ]
        .boxed(),
        ParamTy::Color => weight().prop_map(|w| w.to_vec()).boxed(),
        ParamTy::String if p.options.is_empty() => Just(p.default.to_vec()).boxed(),
        ParamTy::Int | ParamTy::String => {
            prop_oneof![Just(p.default.to_vec()), (lo as i32..=hi as i32).prop_map(|x| vec![x as f32])].boxed()
        }
        _ => prop_oneof![
            Just(p.default.to_vec()),
            Just(vec![lo]),
            Just(vec![hi]),
            (0u8..=100).prop_map(move |t| vec![p.clamp(0, lo + (hi - lo) * f32::from(t) / 100.0)]),
        ]
        .boxed(),
    }
}

/// A site of its own for every lobe.
fn numbered(recipe: &Recipe) -> Recipe {
    fn visit(recipe: &mut Recipe, next: &mut u32) {
        match recipe {
            Recipe::Lobe { site, .. } => {
                *site = *next;
                *next += 1;
            }
            Recipe::Weighted(_, closure) => visit(closure, next),
            Recipe::Sum { terms, .. } => terms.iter_mut().for_each(|t| visit(t, next)),
            Recipe::Layer(top, base) => {
                visit(top, next);
                visit(base, next);
            }
        }
    }
    let mut numbered = recipe.clone();
    visit(&mut numbered, &mut 0);
    numbered
}
