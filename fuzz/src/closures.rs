//! Closure trees: any lobes, weights, normals and shapes, also such as no script can build; flattened for every tier and
//! layering rule, and asked everything a host may ask.

use super::bytes::Bytes;
use overcoat::Globals;
use overcoat::albedo::Precision;
use overcoat::audit::trees::Pool;
use overcoat::audit::{Side, Tolerance, albedo};
use overcoat::closure::tree::{MAX_LAYERS, MAX_LOBES};
use overcoat::closure::{
    Balancer, Bsdf, ClosureTree, Curves, Eval, Layering, LayeringRule, NodeId, TableCache, Tables, TintRule, flatten,
};
use overcoat::lobes::registry::{LobeClass, ParamTy};
use overcoat::optics::{Scalar, V3};
use rand::SeedableRng;
use std::sync::{LazyLock, Mutex, PoisonError};

/// Lobes that were chosen once.
static POOL: LazyLock<Pool> = LazyLock::new(|| Pool::random(&mut rand_pcg::Pcg64Mcg::seed_from_u64(5)));

/// A cache, and what keeps its tables from being dropped.
#[derive(Default)]
struct Kept {
    cache: TableCache<f32>,
    curves: Mutex<Curves<f32>>,
}

/// Tables by tier, each made when a tree first asks for it.
static KEPT: LazyLock<[Kept; 2]> = LazyLock::new(Default::default);

/// Coarse tables for two tiers: every run makes its own.
const PRECISIONS: [Precision; 2] = [
    Precision { cos_nodes: 16, axis_nodes: 8, polar: 12, azimuth: 8, ..Precision::FAST },
    Precision { cos_nodes: 32, axis_nodes: 8, polar: 24, azimuth: 16, ..Precision::FAST },
];

/// The tables of a tree.
fn curves(tree: &ClosureTree, tier: usize) -> Curves<f32> {
    let Kept { cache, curves: kept } = &KEPT[tier];
    let mut curves = Curves::default();
    for (site, kind, _) in tree.lobes() {
        let table = kind.table(&POOL.entries()[site as usize].known);
        kept.lock().unwrap_or_else(PoisonError::into_inner).set_shared(site, table, PRECISIONS[tier], cache);
        curves.set_shared(site, table, PRECISIONS[tier], cache);
    }
    curves
}

/// Nodes that bytes may ask for.
const MAX_NODES: usize = 96;
/// Trees that come to more lobes than this, and not to more than are allowed, only take long.
const MANY_LOBES: u32 = 3000;

/// Builds a tree from bytes and asks it everything.
pub fn trees(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let [tier, rule, tint, measured] = std::array::from_fn(|_| bytes.byte());
    let layering = Layering {
        rule: LayeringRule::ALL[usize::from(rule) % LayeringRule::ALL.len()],
        tint: if tint & 1 == 0 { TintRule::Largest } else { TintRule::Channel },
    };
    let globals = globals(&mut bytes);
    let wo = bytes.direction();
    let directions: [[f32; 3]; 5] = std::array::from_fn(|_| bytes.direction());
    let (tree, budgeted) = tree(&mut bytes);
    let size = tree.size(tree.root());
    if size.lobes > MANY_LOBES && size.lobes <= MAX_LOBES {
        return;
    }
    let curves = curves(&tree, usize::from(tier & 1));
    let balancer = Balancer::with_nodes(6);
    let small = size.lobes <= 16 && size.layers <= 8;
    let balance = (layering.rule == LayeringRule::Balanced && small)
        .then(|| balancer.solve(&tree, &globals, layering.tint, &curves));
    let tables = Tables { curves: &curves, balance: balance.as_ref() };
    let bsdf = match flatten::<f32>(&tree, &globals, V3::new(wo[0], wo[1], wo[2]), layering, tables) {
        Ok(bsdf) => bsdf,
        Err(_) => return assert!(size.lobes > MAX_LOBES || size.layers > MAX_LAYERS),
    };
    assert!(size.lobes <= MAX_LOBES && size.layers <= MAX_LAYERS);
    interrogate(&bsdf, &directions, &mut bytes);
    side_by_side(&bsdf, &directions);
    let in_double = curves.in_double();
    let double = balance.as_ref().map(overcoat::closure::Balance::cast::<f64>);
    let tables = Tables { curves: &in_double, balance: double.as_ref() };
    let exact = |wo: [f64; 3]| {
        let wo = V3::new(wo[0], wo[1], wo[2]);
        flatten::<f64>(&tree, &globals, wo, layering, tables).unwrap_or_else(|_| Bsdf::black())
    };
    let wo = wo.map(f64::from);
    interrogate(&exact(wo), &directions.map(|w| w.map(f64::from)), &mut bytes);
    if measured == 1 && tier & 1 == 1 && budgeted && small {
        let measured = |evaluations| albedo(&exact, Side::View, wo, Tolerance { error: 1e-3, evaluations });
        // What so few evaluations find may be a highlight they have half seen.
        let e = Some(measured(20_000)).filter(|e| e.max() <= 1.001).unwrap_or_else(|| measured(1_000_000));
        assert!(e.max() - 2.0 * e.error <= 1.001, "gains: {} ± {}", e.max(), e.error);
    }
}

fn globals(bytes: &mut Bytes<'_>) -> Globals {
    if bytes.byte() < 128 {
        return Globals::default();
    }
    let [n, ng, dpdu, i] = std::array::from_fn(|_| bytes.direction().into());
    Globals { n, ng, dpdu, i, backfacing: bytes.byte() & 1 == 1, ..Globals::default() }
}

/// A closure under construction: what it claims of the light, and whether it and its parts claim at most all.
#[derive(Clone, Copy)]
struct Part {
    node: NodeId,
    claim: [f64; 3],
    budgeted: bool,
}

impl Part {
    fn fits(&self) -> bool {
        self.budgeted && self.claim.iter().all(|b| *b <= 1.0)
    }
}

/// The tree, and whether it is budgeted.
fn tree(bytes: &mut Bytes<'_>) -> (ClosureTree, bool) {
    let mut tree = ClosureTree::new();
    let zero = Part { node: tree.zero(), claim: [0.0; 3], budgeted: true };
    let mut parts: Vec<Part> = Vec::new();
    for _ in 0..MAX_NODES {
        if !bytes.left() {
            break;
        }
        let operation = bytes.byte() % 16;
        let mut pop = || parts.pop().unwrap_or(zero);
        let part = match operation {
            0 => zero,
            1..=4 => {
                let weight = bytes.numbers(0.0, 1.0);
                let part = pop();
                // As the tree does with weights.
                let sane = |w: f32| if w > 0.0 { f64::from(w.min(1e30)) } else { 0.0 };
                let claim = std::array::from_fn(|c| sane(weight[c]) * part.claim[c]);
                Part { node: tree.mul(weight, part.node), claim, budgeted: part.budgeted }
            }
            5 | 6 => {
                let (b, a) = (pop(), pop());
                let claim = std::array::from_fn(|c| a.claim[c] + b.claim[c]);
                Part { node: tree.add(a.node, b.node), claim, budgeted: a.budgeted && b.budgeted }
            }
            7..=10 => {
                let (top, base) = (pop(), pop());
                let claim = std::array::from_fn(|c| top.claim[c].max(base.claim[c]));
                Part { node: tree.layer(top.node, base.node), claim, budgeted: top.fits() && base.fits() }
            }
            11 => {
                let part = pop();
                parts.push(part);
                part
            }
            _ => lobe(&mut tree, bytes),
        };
        parts.push(part);
    }
    let root = parts.into_iter().reduce(|base, top| {
        let claim = std::array::from_fn(|c| top.claim[c].max(base.claim[c]));
        Part { node: tree.layer(top.node, base.node), claim, budgeted: top.fits() && base.fits() }
    });
    let root = root.unwrap_or(zero);
    tree.set_root(root.node);
    (tree, root.fits())
}

fn lobe(tree: &mut ClosureTree, bytes: &mut Bytes<'_>) -> Part {
    let entries = POOL.entries();
    let site = bytes.below(entries.len());
    let entry = &entries[site];
    let mut values = Vec::with_capacity(entry.known.len());
    for p in entry.kind.spec().params {
        match p.ty {
            ParamTy::Normal | ParamTy::Vector => values.extend(bytes.direction()),
            _ => {
                for _ in 0..p.ty.slots() {
                    // A table is made for what is known; the rest may be anything.
                    let value =
                        entry.known[values.len()].unwrap_or_else(|| bytes.number(p.min.max(-10.0), p.max.min(1e3)));
                    values.push(value);
                }
            }
        }
    }
    let claim = if entry.kind.class() == LobeClass::Emission { 0.0 } else { 1.0 };
    Part { node: tree.lobe(entry.kind, site as u32, &values), claim: [claim; 3], budgeted: true }
}

fn sane<S: Scalar>(what: &str, values: &[S]) {
    assert!(values.iter().all(|x| x.is_finite() && *x >= S::zero()), "{what}: {values:?}");
}

/// Everything is finite and not negative, and a sample is what `eval` says of its direction.
fn interrogate<S: Scalar>(bsdf: &Bsdf<'_, S>, directions: &[[S; 3]], bytes: &mut Bytes<'_>) {
    sane("albedo", &bsdf.albedo());
    sane("emission", &bsdf.emission());
    sane("transparency", &bsdf.transparency());
    sane("delta albedo", &bsdf.delta_albedo());
    bsdf.signals().iter().for_each(|s| sane("signal", &s.value));
    for wi in directions {
        let Eval { f_cos, pdf } = bsdf.eval(*wi);
        sane("f_cos", &f_cos);
        sane("pdf", &[pdf]);
        sane("adjoint", &bsdf.eval_adjoint(*wi));
        sane("f", &bsdf.f(*wi));
        sane("bound", &bsdf.albedo_bound(*wi));
    }
    for _ in 0..4 {
        let u = bytes.numbers(0.0, 1.0).map(|x| S::c(f64::from(x)));
        let Some(s) = bsdf.sample(u) else { continue };
        sane("sampled f_cos", &s.f_cos);
        sane("weight", &s.weight);
        sane("sampled pdf", &[s.pdf, s.eta, s.roughness]);
        let [x, y, z] = s.wi;
        // Delta lobes mirror ωo, which hosts may give as long as 2.
        let length = V3::new(x, y, z).dot(V3::new(x, y, z));
        let off = if s.flags.delta { S::c(3.01) } else { S::c(1e-3) };
        assert!(s.pdf > S::zero() && (length - S::one()).abs() < off, "{s:?} for {u:?}");
        if !s.flags.delta {
            assert_eq!(bsdf.eval(s.wi), Eval { f_cos: s.f_cos, pdf: s.pdf });
        }
    }
}

/// Many directions at once give what they give alone, to the same bits.
fn side_by_side(bsdf: &Bsdf<'_>, directions: &[[f32; 3]]) {
    let many: Vec<[f32; 3]> = directions.iter().cycle().take(19).copied().collect();
    let mut found = vec![Eval { f_cos: [7.0; 3], pdf: 7.0 }; many.len()];
    bsdf.eval_batch(&many, &mut found);
    let bits = |e: &Eval| [e.f_cos[0], e.f_cos[1], e.f_cos[2], e.pdf].map(f32::to_bits);
    for (wi, found) in many.iter().zip(&found) {
        let alone = bsdf.eval(*wi);
        assert_eq!(bits(&alone), bits(found), "{alone:?}, side by side {found:?}, at {wi:?}");
    }
}
