//! How small and how large a lobe's albedo can be over whole ranges of parameters and directions.
//!
//! In: ranges of the slots of a parameter block. Out: numbers that hold for every block within them. Closed forms stand
//! with their lobes ([`super::Lobe::limits`]); this file reads everything else off the albedo tables, whose nodes are
//! never exceeded between them. Tables are kept for the life of the process: checking a folder of scripts asks for the
//! same few over and over.

use super::registry::LobeSpec;
#[cfg(any(feature = "cloth", feature = "microfacet"))]
use super::registry::ParamTy;
use super::{AnyLobe, LobeKind};
use crate::albedo::quadrature::Rule;
use crate::albedo::{AlbedoCurve, CurveSpec, Precision, TableSpec};
use crate::optics::V3;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

/// Lowest and highest value of a slot, as given: not yet clamped to the declared range.
pub type SlotRange = (f32, f32);

/// Between what the albedo lies, the largest channel counted, the tint left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Nowhere is the albedo bound that layers read below this.
    pub lowest: f64,
    /// Nowhere is the albedo above this, from either side.
    pub highest: f64,
}

impl Limits {
    /// Of a one-sided lobe; a range that begins at 0 is one of directions just above the surface. The albedo above the surface lies between these.
    pub fn above(cos: (f64, f64), lowest: f64, highest: f64) -> Limits {
        Limits {
            lowest: if cos.0 >= 0.0 && cos.1 > 0.0 { lowest } else { 0.0 },
            highest: if cos.1 > 0.0 { highest } else { 0.0 },
        }
    }
}

/// How far E_view, as tables give it, may lie above the truth: see `curves_stay_above_the_truth_and_close_to_it`.
const VIEW_ERROR: f64 = 5e-3;
/// For tables over a parameter: coarse, because their bounds are lifted by what that costs.
const OVER_RANGES: Precision = Precision { cos_nodes: 28, axis_nodes: 10, ..Precision::FAST };
/// Parameters that differ by less are taken as one.
const SAME: f32 = 1e-6;

/// Limits read off the table that the ranges ask for; between 0 and 1 where there is none.
pub(super) fn of_table(kind: LobeKind, ranges: &[SlotRange], cos: (f64, f64)) -> Limits {
    let values: Vec<Option<f32>> = ranges.iter().map(|r| (r.1 - r.0 <= SAME).then_some(r.0)).collect();
    let Some(spec) = kind.table(&values) else { return Limits { lowest: 0.0, highest: 1.0 } };
    match spec {
        TableSpec::Cosine(curve) => of_curve(kind.spec(), &curve, ranges, cos),
        #[cfg(feature = "cloth")]
        TableSpec::Fibre(_) => {
            let highest = around_the_thread(kind, spec, &values).unwrap_or(1.0);
            Limits::above(cos, 0.0, highest.min(1.0))
        }
        #[cfg(feature = "microfacet")]
        TableSpec::Facets(_) => {
            let rough = at_the_nodes(kind, spec, ranges, &values, cos);
            rough.unwrap_or(Limits { lowest: 0.0, highest: 1.0 })
        }
    }
}

fn of_curve(lobe: &LobeSpec, spec: &CurveSpec, ranges: &[SlotRange], cos: (f64, f64)) -> Limits {
    let precision = if spec.axis.is_some() { OVER_RANGES } else { Precision::STANDARD };
    // A lobe that is divided by what it gains reflects at most what it did before.
    let raw = CurveSpec { bounded: false, ..*spec };
    let table = baked(TableSpec::Cosine(raw), precision);
    let roughness = lobe.slot_of("roughness").and_then(|slot| ranges.get(slot));
    let parameter = roughness.map_or((0.0, 1.0), |r| (r.0 as f64, r.1 as f64));
    let (view, bound) = table.range(cos, parameter);
    let lowest = if spec.bounded { 0.0 } else { (view - VIEW_ERROR).max(0.0) };
    Limits::above(cos, lowest, bound.min(1.0))
}

/// The largest albedo of a lobe whose parameters are all known: its bound is linear between the nodes of its table.
#[cfg(feature = "cloth")]
fn around_the_thread(kind: LobeKind, spec: TableSpec, values: &[Option<f32>]) -> Option<f64> {
    let mut block = Vec::new();
    for p in kind.spec().params {
        let at = block.len();
        match p.ty {
            ParamTy::Normal => block.extend([0.0, 0.0, 1.0]),
            ParamTy::Vector => block.extend([1.0, 0.0, 0.0]),
            _ => {
                for slot in 0..p.ty.slots() {
                    block.push((*values.get(at + slot)?)?);
                }
            }
        }
    }
    static KNOWN: Mutex<Vec<(LobeKind, Vec<u32>, f64)>> = Mutex::new(Vec::new());
    let key: Vec<u32> = block.iter().map(|x| x.to_bits()).collect();
    let lock = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = lock().iter().find(|k| k.0 == kind && k.1 == key) {
        return Some(known.2);
    }
    let table = baked(spec, Precision::STANDARD);
    let lobe = AnyLobe::<f64>::new(kind, &block, V3::new(0.0, 0.0, 1.0), &table);
    let bounds = table.fibre().directions().map(|w| lobe.albedo_bound(w, &table));
    let highest = bounds.fold(0.0, |a: f64, b| a.max(b[0]).max(b[1]).max(b[2]));
    let mut known = lock();
    if known.len() >= KEPT {
        known.remove(0);
    }
    known.push((kind, key, highest));
    Some(highest)
}

/// Of a rough surface whose parameters are all known, or but for its tints: its bound is linear between the nodes of its
/// table. One between two media may be met from either.
#[cfg(feature = "microfacet")]
fn at_the_nodes(
    kind: LobeKind,
    spec: TableSpec,
    ranges: &[SlotRange],
    values: &[Option<f32>],
    cos: (f64, f64),
) -> Option<Limits> {
    // With the tints at either end of their ranges.
    let block = |end: fn(&SlotRange) -> f32| -> Option<Vec<f32>> {
        let mut block = Vec::new();
        for p in kind.spec().params {
            for slot in 0..p.ty.slots() {
                let at = block.len();
                block.push(match p.ty {
                    ParamTy::Normal => [0.0, 0.0, 1.0][slot],
                    ParamTy::Vector => [1.0, 0.0, 0.0][slot],
                    ParamTy::Color if p.name.ends_with("tint") => end(ranges.get(at)?),
                    _ => (*values.get(at)?)?,
                });
            }
        }
        Some(block)
    };
    let (low, high) = (block(|r| r.0)?, block(|r| r.1)?);
    let table = baked(spec, Precision::STANDARD);
    let two_sided = kind.between_media(&high);
    let sides = if two_sided {
        let ends = (cos.0.abs().min(cos.1.abs()), cos.0.abs().max(cos.1.abs()));
        let near = if cos.0 < 0.0 && cos.1 > 0.0 { 0.0 } else { ends.0 };
        vec![(near, ends.1), (-ends.1, -near)]
    } else {
        vec![cos]
    };
    let (mut lowest, mut highest) = (1.0f64, 0.0f64);
    for w in sides.iter().flat_map(|c| table.facets().directions(*c)) {
        let lobe = |block: &[f32]| AnyLobe::<f64>::new(kind, block, w, &table);
        let (view, bound) = (lobe(&low).albedo(w, &table), lobe(&high).albedo_bound(w, &table));
        for c in 0..3 {
            lowest = lowest.min(view[c] - VIEW_ERROR);
            highest = highest.max(bound[c]);
        }
    }
    let limits = Limits { lowest: lowest.max(0.0), highest: highest.min(1.0) };
    Some(if two_sided { limits } else { Limits::above(cos, limits.lowest, limits.highest) })
}

/// The largest albedo of each component over all directions.
#[cfg(feature = "cloth")]
pub(super) fn components(spec: TableSpec) -> [f64; crate::albedo::COMPONENTS] {
    baked(spec, Precision::FAST).fibre().highest()
}

/// How a one-sided lobe that looks the same all around its normal spreads light from ωi over the cosines to ωo.
pub struct Slices {
    /// Per node of √√μi, per slice of √μo: ∫ f·μo dωo over the slice.
    parts: Vec<[f64; Slices::COUNT]>,
}

impl Slices {
    /// Slices of √μo, equally wide.
    pub const COUNT: usize = 16;
    const NODES: usize = 33;

    fn new(kind: LobeKind, block: &[f32]) -> Slices {
        let known: Vec<Option<f32>> = block.iter().map(|v| Some(*v)).collect();
        let table = kind.table(&known).map(|spec| baked(spec, Precision::STANDARD)).unwrap_or_default();
        let (polar, turn) = (Rule::gauss_legendre(6), Rule::gauss_legendre(20));
        let mut parts = vec![[0.0; Slices::COUNT]; Slices::NODES];
        for slice in 0..Slices::COUNT {
            for (u, weight) in polar.nodes.iter().zip(&polar.weights) {
                let root = (slice as f64 + u) / Slices::COUNT as f64;
                // μ = root², dμ = 2·root/COUNT du.
                let (mu, weight) = (root * root, weight * 2.0 * root / Slices::COUNT as f64);
                let lobe = AnyLobe::<f64>::new(kind, block, V3::polar(mu, 0.0), &table);
                for (node, parts) in parts.iter_mut().enumerate() {
                    let cos = Slices::cos(node);
                    for (v, share) in turn.nodes.iter().zip(&turn.weights) {
                        // Graded toward the far side, where half vectors turn fast.
                        let angle = PI * (1.0 - v * v);
                        let f = lobe.f(V3::polar(cos, angle), &table)[0];
                        parts[slice] += weight * mu * share * 2.0 * v * 2.0 * PI * f;
                    }
                }
            }
        }
        Slices { parts }
    }

    fn cos(node: usize) -> f64 {
        (node as f64 / (Slices::NODES - 1) as f64).powi(4).max(1e-9)
    }

    /// No more goes to viewers with √μo in `root`, for light at the cosines `light`. What lies between nodes is taken
    /// to exceed them by at most a quarter of their difference.
    pub fn most(&self, root: (f64, f64), light: (f64, f64)) -> f64 {
        let count = Slices::COUNT as f64;
        let slices = (root.0 * count + 1e-6).floor() as usize..(root.1 * count - 1e-6).ceil() as usize;
        let place = |c: f64| c.clamp(0.0, 1.0).sqrt().sqrt() * (Slices::NODES - 1) as f64;
        let nodes = place(light.0).floor() as usize..=place(light.1).ceil() as usize;
        let sums = nodes.map(|n| self.parts[n][slices.start..slices.end.min(Slices::COUNT)].iter().sum::<f64>());
        let (lo, hi) = sums.fold((f64::INFINITY, 0.0f64), |(lo, hi), x| (lo.min(x), hi.max(x)));
        hi + 0.25 * (hi - lo) + 1e-5
    }
}

/// The slices of a lobe with known parameters, kept for the life of the process.
pub fn slices(kind: LobeKind, block: &[f32]) -> Arc<Slices> {
    type Known = (LobeKind, Vec<u32>, Arc<Slices>);
    static SLICES: Mutex<Vec<Known>> = Mutex::new(Vec::new());
    let key: Vec<u32> = block.iter().map(|x| x.to_bits()).collect();
    let lock = || SLICES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = lock().iter().find(|k| k.0 == kind && k.1 == key) {
        return known.2.clone();
    }
    let slices = Arc::new(Slices::new(kind, block));
    let mut known = lock();
    if known.len() >= KEPT {
        known.remove(0);
    }
    known.push((kind, key, slices.clone()));
    slices
}

type Baked = (TableSpec, Precision, Arc<AlbedoCurve<f64>>);
/// Tables above this many are forgotten, oldest first.
const KEPT: usize = 64;

fn baked(spec: TableSpec, precision: Precision) -> Arc<AlbedoCurve<f64>> {
    static TABLES: Mutex<Vec<Baked>> = Mutex::new(Vec::new());
    let find = |tables: &[Baked]| tables.iter().find(|t| t.0 == spec && t.1 == precision).map(|t| t.2.clone());
    let lock = || TABLES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(table) = find(&lock()) {
        return table;
    }
    let table = Arc::new(spec.bake(precision));
    let mut tables = lock();
    if tables.len() >= KEPT {
        tables.remove(0);
    }
    tables.push((spec, precision, table.clone()));
    table
}

#[cfg(feature = "cloth")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::lobes::Lobe;
    use crate::lobes::oren_nayar::OrenNayar;
    use crate::lobes::registry::LobeClass;

    /// Blocks at both ends and in the middle of every float, the ranges that hold them, and directions between.
    #[test]
    fn no_bound_lies_outside_the_limits() {
        for kind in LobeKind::ALL.iter().copied().filter(|k| k.class() == LobeClass::Scatter) {
            for (from, to) in [(0.2, 0.9), (0.6, 0.6)] {
                compare(kind, from, to);
            }
        }
    }

    fn compare(kind: LobeKind, from: f32, to: f32) {
        let block = |t: f32| {
            let mut block = Vec::new();
            for p in kind.spec().params {
                match p.ty {
                    ParamTy::Normal => block.extend([0.0, 0.0, 1.0]),
                    ParamTy::Vector => block.extend([1.0, 0.0, 0.0]),
                    ParamTy::Color => block.extend([1.0; 3]),
                    // Narrow ranges keep the tables few; the whole range is asked for by `roughness`.
                    ParamTy::Float if p.name == "roughness" || p.name == "sigma" => {
                        block.push(p.min + (p.max - p.min) * (from + (to - from) * t));
                    }
                    _ => block.extend(p.default),
                }
            }
            block
        };
        let ranges: Vec<SlotRange> = block(0.0).into_iter().zip(block(1.0)).collect();
        for t in [0.0, 0.7] {
            let values = block(t);
            let known: Vec<Option<f32>> = values.iter().map(|v| Some(*v)).collect();
            let table = kind.table(&known).map_or_else(AlbedoCurve::default, |s| s.bake::<f32>(Precision::STANDARD));
            let lobe = AnyLobe::new(kind, &values, V3::new(0.0, 0.0, 1.0), &table);
            for k in 0..40 {
                let mu = ((k as f32 + 0.5) / 40.0).powi(3);
                let bound = lobe.albedo_bound(V3::polar(mu, 0.7 * k as f32), &table)[0] as f64;
                let limits = kind.limits(&ranges, (mu as f64 * 0.9, (mu as f64 * 1.1).min(1.0)));
                // Tables in another precision are lifted by other amounts.
                assert!(bound <= limits.highest + 2e-3, "{kind:?} {values:?} {mu}: {bound} above {limits:?}");
                assert!(bound >= limits.lowest, "{kind:?} {values:?} {mu}: {bound} below {limits:?}");
            }
        }
    }

    #[test]
    fn slices_add_up_to_the_albedo() {
        let block = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.3, 0.0, 0.0, 0.0];
        let slices = slices(LobeKind::Sheen, &block);
        let ranges: Vec<SlotRange> = block.iter().map(|x| (*x, *x)).collect();
        for node in [12, 18, 22, 27, 32] {
            let (mu, sum) = (Slices::cos(node), slices.parts[node].iter().sum::<f64>());
            let limits = LobeKind::Sheen.limits(&ranges, (mu, mu));
            assert!(sum < limits.highest + 1e-3 && sum > limits.lowest, "{mu}: {sum}, {limits:?}");
            // Read between nodes, the slices together are no less than either node has.
            let read: f64 = (0..16).map(|k| slices.most((k as f64 / 16.0, (k + 1) as f64 / 16.0), (mu, mu))).sum();
            assert!(read >= sum, "{mu}: {read} below {sum}");
        }
        let grey = crate::lobes::limits::slices(LobeKind::OrenNayar, &[0.0, 0.0, 1.0, 0.3]);
        let (mu, sum) = (Slices::cos(27), grey.parts[27].iter().sum::<f64>());
        let most = LobeKind::OrenNayar.limits(&[(0.0, 0.0), (0.0, 0.0), (1.0, 1.0), (0.3, 0.3)], (mu, mu)).highest;
        assert!(sum <= most + 1e-3 && sum > 0.95 * most, "{sum}, {most}");
    }

    #[test]
    fn ranges_are_not_much_wider_than_they_must_be() {
        let ranges = [(0.0, 0.0), (0.0, 0.0), (1.0, 1.0), (0.3, 0.3)];
        let limits = OrenNayar::<f32>::limits(&ranges, (0.5, 0.5)).expect("a closed form");
        assert!(limits.highest < 0.96, "{limits:?}");
        assert_eq!(LobeKind::Diffuse.limits(&[(0.0, 0.0); 3], (-1.0, 0.0)), Limits { lowest: 0.0, highest: 0.0 });
    }
}
