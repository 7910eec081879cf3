//! Regenerates the committed tables of the sheens: `cargo run --release --example fit_sheen -- terms`, then `-- tables`.
//!
//! `terms` fits the Chebyshev series of the exact Λ to its quadrature. `tables` fits transformed cosines: for each node
//! over ωo and roughness the proposal that gives f·cos/pdf the least variance, and for the `zeltner` model the
//! transformed cosine nearest to f·cos of the exact model. Both print what is left over. The second needs the first
//! compiled in.

use overcoat::albedo::AlbedoCurve;
use overcoat::albedo::quadrature::Rule;
use overcoat::lobes::charlie::{self, COS_TERMS, ROUGHNESS_TERMS};
use overcoat::lobes::ltc::{self, COS_NODES, Ltc, PARAMS, ROUGHNESS_NODES};
use overcoat::lobes::{AnyLobe, LobeKind};
use overcoat::optics::V3;
use std::f64::consts::PI;
use std::fmt::Write as _;

fn main() -> std::io::Result<()> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/src/lobes/");
    match std::env::args().nth(1).as_deref() {
        Some("terms") => std::fs::write(format!("{root}charlie_terms.rs"), terms()),
        Some("tables") => std::fs::write(format!("{root}ltc_tables.rs"), tables()),
        _ => {
            eprintln!("usage: fit_sheen terms|tables");
            Ok(())
        }
    }
}

/// Chebyshev interpolation of H(μ, r) at the roots in both coordinates.
fn terms() -> String {
    let rule = Rule::gauss_legendre(20);
    let angle = |i: usize, n: usize| PI * (i as f64 + 0.5) / n as f64;
    let mut coefficients = vec![0.0; COS_TERMS * ROUGHNESS_TERMS];
    for j in 0..ROUGHNESS_TERMS {
        let r = (charlie::MIN_ROUGHNESS.ln() * 0.5 * (1.0 - angle(j, ROUGHNESS_TERMS).cos())).exp();
        for i in 0..COS_TERMS {
            let h = charlie::series_target(charlie::series_cosine(angle(i, COS_TERMS).cos(), r), r, &rule);
            for (at, c) in coefficients.iter_mut().enumerate() {
                let (b, a) = (at / COS_TERMS, at % COS_TERMS);
                let scale = |k: usize, n: usize| if k == 0 { 1.0 } else { 2.0 } / n as f64;
                *c += h
                    * (scale(a, COS_TERMS) * (a as f64 * angle(i, COS_TERMS)).cos())
                    * (scale(b, ROUGHNESS_TERMS) * (b as f64 * angle(j, ROUGHNESS_TERMS)).cos());
            }
        }
    }
    let mut text = String::from(
        "//! Chebyshev coefficients of the exact Λ; see [`super::charlie`]. Written by `examples/fit_sheen.rs`.\n\n\
         /// Row by row over the roughness, `COS_TERMS` each.\n#[rustfmt::skip]\n",
    );
    let _ = writeln!(text, "pub const TERMS: [f64; {}] = [", coefficients.len());
    for row in coefficients.chunks(7) {
        let row: Vec<String> = row.iter().map(|c| format!("{c:.9e}")).collect();
        let _ = writeln!(text, "    {},", row.join(", "));
    }
    text + "];\n"
}

/// f·cos of a lobe seen at one cosine, at the nodes of a product rule.
struct Shape {
    points: Vec<(V3<f64>, f64, f64)>,
    wo: V3<f64>,
    albedo: f64,
}

impl Shape {
    fn new(kind: LobeKind, set: &[(&str, f64)], cos: f64) -> Shape {
        let mut values = Vec::new();
        for p in kind.spec().params {
            let given = set.iter().find(|s| s.0 == p.name).map(|s| Some(s.1 as f32));
            let slots = p.ty.slots();
            values.extend((0..slots).map(|i| given.unwrap_or(Some(p.default.get(i).copied().unwrap_or(1.0)))));
        }
        let spec = kind.curve(&values);
        let known: Vec<f32> = values.iter().map(|v| v.unwrap_or(0.0)).collect();
        let wo = V3::polar(cos.max(1e-5), 0.0);
        let (polar, azimuth) = (Rule::gauss_legendre(56), Rule::gauss_legendre(40));
        let mut points = Vec::new();
        let mut f = vec![0.0; azimuth.nodes.len()];
        for (u, wu) in polar.nodes.iter().zip(&polar.weights) {
            let mu = u * u * u;
            let ring: Vec<_> = azimuth.nodes.iter().map(|v| V3::polar(mu, PI * (1.0 - v * v))).collect();
            match spec {
                Some(spec) => (spec.kernel)(&spec.key, wo, &ring, &mut f),
                None => {
                    let none = AlbedoCurve::default();
                    let lobe = AnyLobe::<f64>::new(kind, &known, wo, &none);
                    f.iter_mut().zip(&ring).for_each(|(f, wi)| *f = lobe.f(*wi, &none)[0]);
                }
            }
            for ((w, f), (v, wv)) in ring.iter().zip(&f).zip(azimuth.nodes.iter().zip(&azimuth.weights)) {
                points.push((*w, f * mu, wu * 3.0 * u * u * wv * 4.0 * PI * v));
            }
        }
        let albedo = points.iter().map(|p| p.1 * p.2).sum();
        Shape { points, wo, albedo }
    }

    /// Relative variance of f·cos/pdf.
    fn variance(&self, pdf: impl Fn(V3<f64>) -> f64) -> f64 {
        let second: f64 = self.points.iter().map(|(w, f, weight)| f * f / pdf(*w).max(1e-300) * weight).sum();
        second / (self.albedo * self.albedo) - 1.0
    }

    /// Root of ∫(f·cos/E − p)² over ∫(f·cos/E)².
    fn distance(&self, pdf: impl Fn(V3<f64>) -> f64) -> f64 {
        let (mut gap, mut all) = (0.0, 0.0);
        for (w, f, weight) in &self.points {
            let f = f / self.albedo;
            gap += (f - pdf(*w)).powi(2) * weight;
            all += f * f * weight;
        }
        (gap / all).sqrt()
    }
}

/// Logarithms and a logit, so that the search is free: a, b, c, uniform share. The share is at least 0.02 so that weights
/// stay low, a and b at least 0.05 so that no density is a needle.
fn params(x: &[f64]) -> [f64; PARAMS] {
    [0.05 + x[0].exp(), 0.05 + x[1].exp(), x[2], 0.02 + 0.96 / (1.0 + (-x[3]).exp())]
}

fn tables() -> String {
    let mut text =
        String::from("//! Tables of [`super::ltc`], written by `examples/fit_sheen.rs`.\n\nuse super::ltc::Table;\n");
    let sheen = |model: f64, softening: f64| {
        move |cos: f64, r: f64| {
            Shape::new(LobeKind::Sheen, &[("roughness", r), ("model", model), ("softening", softening)], cos)
        }
    };
    let velvet = |cos: f64, r: f64| Shape::new(LobeKind::Velvet, &[("roughness", r)], cos);
    proposals(&mut text, "SHEEN", "Proposals for the sheens without a softened terminator", sheen(3.0, 0.0));
    proposals(&mut text, "SOFTENED", "Proposals for the softened sheens", sheen(1.0, 1.0));
    proposals(&mut text, "VELVET", "Proposals for the velvet", velvet);
    let eon = |cos: f64, r: f64| Shape::new(LobeKind::Eon, &[("roughness", r), ("albedo", 1.0)], cos);
    proposals(&mut text, "EON", "Proposals for EON with white facets", eon);
    zeltner(&mut text, sheen(3.0, 0.0));
    text
}

fn proposals(text: &mut String, name: &str, what: &str, shape: impl Fn(f64, f64) -> Shape) {
    let (mut mean, mut uniform) = (0.0, 0.0);
    let table = fit(|cos, r, guess| {
        let shape = shape(cos, r);
        let score = |x: &[f64]| shape.variance(|w| Ltc::new(params(x), shape.wo).pdf(w));
        let (score, x) = best(score, 4, guess);
        mean += score;
        uniform += shape.variance(|_| 0.5 / PI);
        (params(&x), x)
    });
    let n = (COS_NODES * ROUGHNESS_NODES) as f64;
    println!(
        "{name}: relative variance {:.3} on average over the nodes, uniform sampling {:.3}",
        mean / n,
        uniform / n
    );
    write_table(text, name, &format!("{what}: a, b, c, uniform share."), &table);
}

fn zeltner(text: &mut String, shape: impl Fn(f64, f64) -> Shape) {
    let (mut mean, mut worst, mut n) = (0.0, 0.0f64, 0.0);
    let table = fit(|cos, r, guess| {
        let shape = shape(cos, r);
        let with = |x: &[f64]| Ltc::new([x[0].exp(), x[1].exp(), x[2], 0.0], shape.wo);
        let (distance, x) = best(|x| shape.distance(|w| with(x).pdf(w)), 3, guess);
        if r >= 0.05 {
            mean += distance;
            worst = worst.max(distance);
            n += 1.0;
        }
        ([x[0].exp(), x[1].exp(), x[2], shape.albedo], x)
    });
    println!("ZELTNER: distance {:.3} of the root of ∫f² on average for r ≥ 0.05, {worst:.3} at worst", mean / n);
    write_table(text, "ZELTNER", "The sheen of transformed cosines itself: a, b, c, albedo.", &table);
}

/// Visits the nodes, starting from the solutions of the neighbours.
fn fit(mut node: impl FnMut(f64, f64, &[Vec<f64>]) -> ([f64; PARAMS], Vec<f64>)) -> Vec<[f64; PARAMS]> {
    let mut solutions: Vec<Vec<f64>> = Vec::new();
    let mut table = vec![[0.0; PARAMS]; COS_NODES * ROUGHNESS_NODES];
    // From rough, where shapes are round, to smooth; from the normal, where they are even, to grazing.
    for row in (0..ROUGHNESS_NODES).rev() {
        for column in (0..COS_NODES).rev() {
            let (cos, r) = ltc::node(row, column);
            let k = solutions.len();
            let left = (column + 1 < COS_NODES).then(|| solutions[k - 1].clone());
            let above = (k >= COS_NODES).then(|| solutions[k - COS_NODES].clone());
            let guesses: Vec<_> = left.into_iter().chain(above).collect();
            let (params, x) = node(cos, r, &guesses);
            table[row * COS_NODES + column] = params;
            solutions.push(x);
        }
    }
    table
}

/// The best of several descents.
fn best(score: impl Fn(&[f64]) -> f64, free: usize, guesses: &[Vec<f64>]) -> (f64, Vec<f64>) {
    let fresh = vec![-0.7, -0.7, -0.3, -2.0];
    let starts = guesses.iter().cloned().chain([fresh]);
    let score = |x: &[f64]| {
        let s = score(x);
        if s.is_finite() { s } else { 1e30 }
    };
    starts.map(|start| descend(&score, &start[..free])).min_by(|a, b| a.0.total_cmp(&b.0)).expect("a start")
}

/// Nelder and Mead's simplex search.
fn descend(score: &impl Fn(&[f64]) -> f64, start: &[f64]) -> (f64, Vec<f64>) {
    let n = start.len();
    let mut simplex = vec![(score(start), start.to_vec())];
    for i in 0..n {
        let mut x = start.to_vec();
        x[i] += 0.4;
        simplex.push((score(&x), x));
    }
    for _ in 0..260 {
        simplex.sort_by(|a, b| a.0.total_cmp(&b.0));
        let centre: Vec<f64> = (0..n).map(|i| simplex[..n].iter().map(|p| p.1[i]).sum::<f64>() / n as f64).collect();
        let worst = simplex[n].clone();
        let at = |t: f64| {
            let x: Vec<f64> = (0..n).map(|i| centre[i] + t * (worst.1[i] - centre[i])).collect();
            (score(&x), x)
        };
        let mirrored = at(-1.0);
        if mirrored.0 < simplex[0].0 {
            let further = at(-2.0);
            simplex[n] = if further.0 < mirrored.0 { further } else { mirrored };
        } else if mirrored.0 < simplex[n - 1].0 {
            simplex[n] = mirrored;
        } else {
            let nearer = at(if mirrored.0 < worst.0 { -0.5 } else { 0.5 });
            if nearer.0 < worst.0.min(mirrored.0) {
                simplex[n] = nearer;
            } else {
                let centre = simplex[0].1.clone();
                for (_, x) in &mut simplex[1..] {
                    x.iter_mut().zip(&centre).for_each(|(x, c)| *x = 0.5 * (*x + c));
                }
                simplex[1..].iter_mut().for_each(|p| p.0 = score(&p.1));
            }
        }
    }
    simplex.sort_by(|a, b| a.0.total_cmp(&b.0));
    simplex.swap_remove(0)
}

fn write_table(text: &mut String, name: &str, doc: &str, table: &[[f64; PARAMS]]) {
    // Eon's is there in every build.
    let only = if name == "EON" { "" } else { "#[cfg(feature = \"cloth\")]\n" };
    let _ = writeln!(text, "\n/// {doc}\n{only}#[rustfmt::skip]\npub const {name}: Table = [");
    for nodes in table.chunks(4) {
        let row: Vec<String> = nodes.iter().flatten().map(|x| format!("{x:.5}")).collect();
        let _ = writeln!(text, "    {},", row.join(", "));
    }
    text.push_str("];\n");
}
