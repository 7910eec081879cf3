//! Do `sample` and `pdf` agree? Pearson's chi-square test over a grid on the sphere.

use super::cubature::{Tolerance, integrate, split_at};
use super::{Subject, dot};
use crate::optics::Scalar;
use rand::{Rng, RngExt};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// The outcome of a chi-square test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chi2 {
    /// Probability of a deviation at least this large if sampler and density agree.
    pub p_value: f64,
    /// Pearson's statistic.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// ∫ pdf over the sphere: 1 − the delta probability, if no sample is lost.
    pub pdf_integral: f64,
    /// Share of samples that came back as `None`.
    pub lost: f64,
    /// Share of samples from delta lobes.
    pub delta: f64,
    /// Largest relative difference between the pdf a sample reports and `eval` of its direction.
    pub pdf_mismatch: f64,
}

impl Chi2 {
    /// Whether the test passes at significance `level`, with the pdf integrating to what was not lost or delta.
    pub fn passes(&self, level: f64) -> bool {
        self.p_value > level
            && self.pdf_mismatch < 1e-3
            && (self.pdf_integral + self.delta + self.lost - 1.0).abs() < 5e-3 + 0.02 * self.lost
    }
}

/// Compares `count` samples of `subject` at ωo = `wo` with its pdf.
pub fn chi2<'m, S: Scalar>(subject: &impl Subject<'m, S>, wo: [S; 3], count: usize, rng: &mut impl Rng) -> Chi2 {
    const ROWS: usize = 24;
    const COLUMNS: usize = 32;
    // Samples per bin that tell the integration where to look.
    const PLACES: usize = 256;
    let bsdf = subject.bsdf(wo);
    let mut observed = vec![0.0f64; ROWS * COLUMNS];
    let mut places: Vec<Vec<[f64; 2]>> = vec![vec![]; ROWS * COLUMNS];
    let (mut lost, mut delta, mut mismatch) = (0.0, 0.0, 0.0f64);
    for _ in 0..count {
        let u = std::array::from_fn(|_| S::c(rng.random::<f32>() as f64));
        let Some(sample) = bsdf.sample(u) else {
            lost += 1.0;
            continue;
        };
        if sample.flags.delta {
            delta += 1.0;
            continue;
        }
        let again = bsdf.pdf(sample.wi).to_f64();
        mismatch = mismatch.max((again / sample.pdf.to_f64() - 1.0).abs());
        let [x, y, z] = sample.wi.map(S::to_f64);
        let row = ((z * 0.5 + 0.5) * ROWS as f64).clamp(0.0, ROWS as f64 - 1.0) as usize;
        let turn = y.atan2(x) / TAU;
        let column = ((turn - turn.floor()) * COLUMNS as f64).clamp(0.0, COLUMNS as f64 - 1.0) as usize;
        observed[row * COLUMNS + column] += 1.0;
        let places = &mut places[row * COLUMNS + column];
        if places.len() < PLACES {
            places.push([z, (turn - turn.floor()) * TAU]);
        }
    }

    // Adaptive: densities have narrow ridges, and poles where a thread meets the horizon.
    let tolerance = Tolerance { error: 3e-6, evaluations: 20_000 };
    let bin = |bin: usize| {
        let (row, column) = ((bin / COLUMNS) as f64, (bin % COLUMNS) as f64);
        let (z0, turn) = (row / ROWS as f64 * 2.0 - 1.0, TAU / COLUMNS as f64);
        let corners = [z0, z0 + 2.0 / ROWS as f64, column * turn, (column + 1.0) * turn];
        // As the samples' number is no estimate of the density, the sum stays independent of them.
        let integral = integrate(&split_at(&[corners], &places[bin], PLACES / 8), tolerance, |z, phi| {
            let sin = (1.0 - z * z).max(0.0).sqrt();
            let wi = [sin * phi.cos(), sin * phi.sin(), z].map(S::c);
            [bsdf.pdf(wi).to_f64(), 0.0, 0.0]
        });
        integral.value[0]
    };
    let mut expected: Vec<f64> = (0..ROWS * COLUMNS).map(bin).collect();
    let pdf_integral: f64 = expected.iter().sum();
    let n = count as f64;
    expected.iter_mut().for_each(|e| *e *= n);
    let (statistic, degrees) = pearson(&observed, &expected);
    let p_value = ChiSquared::new(degrees as f64).map_or(1.0, |d| d.sf(statistic));
    Chi2 { p_value, statistic, degrees, pdf_integral, lost: lost / n, delta: delta / n, pdf_mismatch: mismatch }
}

/// The statistic and its degrees of freedom; bins that expect fewer than five samples are pooled.
fn pearson(observed: &[f64], expected: &[f64]) -> (f64, usize) {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|a, b| expected[*a].total_cmp(&expected[*b]));
    let (mut pool_observed, mut pool_expected) = (0.0, 0.0);
    let (mut statistic, mut bins) = (0.0, 0usize);
    let mut term = |o: f64, e: f64| {
        statistic += (o - e) * (o - e) / e;
        bins += 1;
    };
    for i in order {
        if expected[i] >= 5.0 && (pool_expected == 0.0 || pool_expected >= 5.0) {
            term(observed[i], expected[i]);
        } else {
            pool_observed += observed[i];
            pool_expected += expected[i];
        }
    }
    if pool_expected >= 1.0 {
        term(pool_observed, pool_expected);
    } else if pool_observed > 3.0 {
        // Samples where the density is zero.
        statistic = f64::INFINITY;
        bins += 1;
    }
    (statistic, bins.saturating_sub(1).max(1))
}

/// The largest relative asymmetry |f(ωo, ωi) − f(ωi, ωo)| / (½(f(ωo, ωi) + f(ωi, ωo)) + 1e-3) over `pairs` random pairs
/// of directions on the whole sphere, with the pair where it occurs.
pub fn reciprocity_error<'m, S: Scalar>(
    subject: &impl Subject<'m, S>,
    pairs: usize,
    rng: &mut impl Rng,
) -> (f64, [S; 3], [S; 3]) {
    let mut worst = (0.0, [S::zero(); 3], [S::zero(); 3]);
    for _ in 0..pairs {
        let (a, b) = (direction::<S>(rng), direction::<S>(rng));
        let (ab, ba) = (subject.bsdf(a).f(b), subject.bsdf(b).f(a));
        for c in 0..3 {
            let (x, y) = (ab[c].to_f64(), ba[c].to_f64());
            let error = (x - y).abs() / (0.5 * (x + y) + 1e-3);
            if error > worst.0 {
                worst = (error, a, b);
            }
        }
    }
    worst
}

/// Uniform on the sphere.
pub fn direction<S: Scalar>(rng: &mut impl Rng) -> [S; 3] {
    loop {
        let v: [f64; 3] = std::array::from_fn(|_| rng.random::<f64>() * 2.0 - 1.0);
        let length = dot(v, v).sqrt();
        if length > 1e-3 && length <= 1.0 {
            return v.map(|x| S::c(x / length));
        }
    }
}
