//! Shared by the tests: lobes and stacks without a script, and the reference tables.
#![allow(dead_code)]

use overcoat::Globals;
use overcoat::albedo::Precision;
use overcoat::closure::{
    Balance, Balancer, Bsdf, ClosureTree, Curves, Layering, LayeringRule, NodeId, Tables, flatten,
};
use overcoat::lobes::LobeKind;
use overcoat::lobes::registry::{ParamSpec, ParamTy};
use overcoat::optics::{Scalar, V3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

/// A tree with its tables, ready to be looked at from any direction.
pub struct Stack<S: Scalar> {
    pub tree: ClosureTree,
    pub curves: Curves<S>,
    pub layering: Layering,
    balance: Option<Balance<S>>,
}

impl<S: Scalar> Stack<S> {
    pub fn new(tree: ClosureTree, precision: Precision) -> Self {
        let curves = Curves::for_tree(&tree, precision);
        Stack { tree, curves, layering: Layering::default(), balance: None }
    }

    /// Bakes as for a script that does not know the parameters called `unknown` before it shades.
    pub fn varying(tree: ClosureTree, precision: Precision, unknown: &[&str]) -> Self {
        let mut curves = Curves::default();
        for (site, kind, values) in tree.lobes() {
            let mut known: Vec<Option<f32>> = values.iter().map(|v| Some(*v)).collect();
            for p in kind.spec().params.iter().filter(|p| unknown.contains(&p.name)) {
                let at = kind.spec().slot_of(p.name).expect("its own parameter");
                known[at..at + p.ty.slots()].fill(None);
            }
            curves.set(site, kind.table(&known), precision);
        }
        Stack { tree, curves, layering: Layering::default(), balance: None }
    }

    /// Layers as told, with what `balanced` needs.
    pub fn layered(&mut self, layering: Layering) {
        let balanced = layering.rule == LayeringRule::Balanced;
        let solve = || Balancer::with_nodes(32).solve(&self.tree, &Globals::default(), layering.tint, &self.curves);
        self.balance = balanced.then(solve);
        self.layering = layering;
    }

    pub fn bsdf(&self, wo: [S; 3]) -> Bsdf<'_, S> {
        let wo = V3::new(wo[0], wo[1], wo[2]);
        let tables = Tables { curves: &self.curves, balance: self.balance.as_ref() };
        flatten(&self.tree, &Globals::default(), wo, self.layering, tables).expect("within budget")
    }
}

/// A direction at this cosine in the xz plane.
pub fn at<S: Scalar>(cos: f64) -> [S; 3] {
    [S::c((1.0 - cos * cos).max(0.0).sqrt()), S::zero(), S::c(cos)]
}

/// Off the axes, so that no azimuth is special.
pub fn turned(cos: f64) -> [f32; 3] {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    [(sin * 0.8) as f32, (sin * 0.6) as f32, cos as f32]
}

/// How much `f`, in double precision, may change where rounding in single precision moves every component of both directions
/// by one unit in the last place: an error that no way of computing in single precision avoids.
pub fn rounding(f: impl Fn([f64; 3], [f64; 3]) -> f64, a: [f64; 3], b: [f64; 3]) -> f64 {
    overcoat::audit::rounding(f64::from(f32::EPSILON), f, a, b)
}

/// One lobe on its own, with N = +z and T = +x where it takes them.
pub fn lobe(tree: &mut ClosureTree, kind: LobeKind, set: &[(&str, f32)]) -> NodeId {
    let site = tree.len() as u32;
    tree.lobe(kind, site, &with(kind, set))
}

/// A tree of nothing but that lobe.
pub fn alone(kind: LobeKind, set: &[(&str, f32)]) -> ClosureTree {
    let mut tree = ClosureTree::new();
    let root = lobe(&mut tree, kind, set);
    tree.set_root(root);
    tree
}

/// A lobe on its own, of the standard tier; what is baked for one test serves the others.
pub fn single<S: Scalar>(kind: LobeKind, values: &[f32]) -> Arc<Stack<S>> {
    type Shared = Arc<dyn Any + Send + Sync>;
    type Key = (TypeId, &'static str, Vec<u32>);
    static STACKS: LazyLock<Mutex<HashMap<Key, Arc<OnceLock<Shared>>>>> = LazyLock::new(Mutex::default);
    let key = (TypeId::of::<S>(), kind.spec().name, values.iter().map(|v| v.to_bits()).collect());
    let entry = STACKS.lock().expect("no test panics here").entry(key).or_default().clone();
    let shared = entry.get_or_init(|| {
        let mut tree = ClosureTree::new();
        let lobe = tree.lobe(kind, 0, values);
        tree.set_root(lobe);
        Arc::new(Stack::<S>::new(tree, Precision::STANDARD))
    });
    shared.clone().downcast().expect("keyed by its type")
}

/// The same, with these parameters and defaults for the others.
pub fn single_with<S: Scalar>(kind: LobeKind, set: &[(&str, f32)]) -> Arc<Stack<S>> {
    single(kind, &with(kind, set))
}

/// A parameter block with these and defaults for the others.
fn with(kind: LobeKind, set: &[(&str, f32)]) -> Vec<f32> {
    block(kind, |p| set.iter().find(|s| s.0 == p.name).map(|s| s.1))
}

/// A parameter block: `pick` gives a value per parameter, else its default.
pub fn block(kind: LobeKind, mut pick: impl FnMut(&ParamSpec) -> Option<f32>) -> Vec<f32> {
    let mut values = Vec::new();
    for p in kind.spec().params {
        match p.ty {
            ParamTy::Normal => values.extend([0.0, 0.0, 1.0]),
            ParamTy::Vector => values.extend([1.0, 0.0, 0.0]),
            _ => match pick(p) {
                Some(v) => values.extend(std::iter::repeat_n(v, p.ty.slots())),
                None => values.extend(p.default),
            },
        }
    }
    values
}

/// Blocks over a lobe's whole declared range: every parameter at its lower end, default, middle and upper end in turn,
/// and all combinations for up to three parameters; of more than eight, a few mixtures. Rough surfaces: [`surfaces`].
pub fn blocks(kind: LobeKind) -> Vec<Vec<f32>> {
    let free: Vec<&ParamSpec> = kind
        .spec()
        .params
        .iter()
        .filter(|p| !matches!(p.ty, ParamTy::Normal | ParamTy::Vector | ParamTy::Color))
        .collect();
    let limit = if free.len() > 8 { 100.0 } else { 10.0 };
    let choices: Vec<Vec<f32>> = free
        .iter()
        .map(|p| {
            if p.ty == ParamTy::Float {
                let (lo, hi) = (p.min.max(0.0), p.max.min(limit));
                vec![lo, lo + (hi - lo) * 0.1, lo + (hi - lo) * 0.4, hi]
            } else if p.ty == ParamTy::String && p.options.is_empty() {
                // A name is as good as any other.
                p.default.to_vec()
            } else {
                (p.min as i32..=p.max as i32).map(|v| v as f32).collect()
            }
        })
        .collect();
    let mut sets: Vec<Vec<f32>> = vec![vec![]];
    let thin = choices.len() > 3;
    if free.iter().any(|p| p.name == "distribution") {
        return surfaces(kind);
    }
    if choices.len() > 8 {
        // All at either end, and some mixtures.
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        sets = vec![choices.iter().map(|c| c[0]).collect(), choices.iter().map(|c| c[c.len() - 1]).collect()];
        sets.push(free.iter().map(|p| p.default[0]).collect());
        sets.extend((0..5).map(|_| choices.iter().map(|c| c[rng.random_range(0..c.len())]).collect::<Vec<_>>()));
    } else if thin {
        // One at a time, the others at their defaults; and all at either end.
        let defaults: Vec<f32> = free.iter().map(|p| p.default[0]).collect();
        sets = vec![choices.iter().map(|c| c[0]).collect(), choices.iter().map(|c| c[c.len() - 1]).collect()];
        for (i, c) in choices.iter().enumerate() {
            sets.extend(c.iter().map(|v| {
                let mut set = defaults.clone();
                set[i] = *v;
                set
            }));
        }
    }
    for c in choices.iter().filter(|_| !thin) {
        sets = sets.iter().flat_map(|s| c.iter().map(move |v| [s.as_slice(), &[*v]].concat())).collect();
    }
    let value = |set: &[f32], name: &str| free.iter().position(|f| f.name == name).map(|i| set[i]);
    sets.retain(|set| !says_it_again(|name| value(set, name)));
    sets.iter().map(|set| block(kind, |p| value(set, p.name))).collect()
}

/// Blocks of a rough surface: even ones from the narrowest to the widest, and a stretched one, with both distributions;
/// what else there is goes through its range beside them.
fn surfaces(kind: LobeKind) -> Vec<Vec<f32>> {
    let is_width = |p: &ParamSpec| p.name.ends_with("alpha") || p.name.starts_with("roughness_");
    let widths = [(1e-4, 1e-4), (0.03, 0.03), (0.1, 0.1), (0.3, 0.3), (0.6, 0.6), (1.0, 1.0), (0.05, 0.4)];
    let set = |(k, (x, y)): (usize, (f32, f32))| {
        block(kind, |p| {
            let t = [0.0, 1.0, 0.4, 0.1][k / 2 % 4];
            match p.ty {
                ParamTy::Float if p.name == "thinfilm_thickness" => Some([0.0, 300.0, 0.0, 900.0][k / 2 % 4]),
                ParamTy::Float if is_width(p) => Some(if p.name.contains('x') { x } else { y }),
                ParamTy::Float => Some(p.min.max(0.0) + (p.max.min(10.0) - p.min.max(0.0)) * t),
                ParamTy::String => Some((k % 2) as f32),
                // Black by default, so that no more than half of them transmit.
                ParamTy::Color if kind.spec().name == "generalized_schlick_bsdf" && p.name == "transmission_tint" => {
                    Some((k % 2) as f32)
                }
                ParamTy::Int => Some((p.min + t * (p.max - p.min)).round()),
                _ => None,
            }
        })
    };
    widths.into_iter().enumerate().map(set).collect()
}

/// Whether a block differs from another only in a switch its model does not look at.
fn says_it_again(value: impl Fn(&str) -> Option<f32>) -> bool {
    let (Some(mode), Some(model), Some(softening)) = (value("mode"), value("model"), value("softening")) else {
        return false;
    };
    let named = model > 0.0;
    let softens = model == 1.0 || model == 2.0 || (!named && mode == 0.0);
    (named && mode > 0.0) || (!softens && softening > 0.0)
}

/// Rows of a table in tests/data as numbers, by column name; text becomes NaN.
pub fn table(name: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect(&path);
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let header = lines.next().expect("header").split(',').map(String::from).collect();
    let rows = lines.map(|l| l.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect()).collect();
    (header, rows)
}
