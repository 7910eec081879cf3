//! Gauss–Legendre rules on [0, 1], and an adaptive Gauss–Kronrod rule.

use std::f64::consts::PI;

/// Nodes of the 15-point Kronrod rule on [−1, 1], the positive half; every second one belongs to the 7-point Gauss rule.
pub(crate) const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
/// Their weights.
pub(crate) const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
/// Weights of the Gauss rule's nodes: those of odd index.
pub(crate) const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_7, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// ∫ f over `[from, to]`, part by part, and how far off that may be: halved where a (7, 15) rule sees more than its share
/// of `error`, at most `depth` times.
pub fn adaptive<const N: usize>(
    (from, to): (f64, f64),
    error: f64,
    depth: usize,
    f: &mut impl FnMut(f64) -> [f64; N],
) -> [(f64, f64); N] {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let mut sums = [(0.0, 0.0); N];
    for (k, node) in NODES.iter().enumerate() {
        let gauss = if k % 2 == 1 { GAUSS[k / 2] } else { 0.0 };
        let sides: &[f64] = if *node > 0.0 { &[-1.0, 1.0] } else { &[1.0] };
        for side in sides {
            for (sum, value) in sums.iter_mut().zip(f(middle + side * half * node)) {
                *sum = (sum.0 + KRONROD[k] * half * value, sum.1 + (KRONROD[k] - gauss) * half * value);
            }
        }
    }
    if depth == 0 || sums.iter().all(|s| s.1.abs() <= error) {
        return sums.map(|s| (s.0, s.1.abs()));
    }
    let low = adaptive((from, middle), 0.5 * error, depth - 1, f);
    let high = adaptive((middle, to), 0.5 * error, depth - 1, f);
    std::array::from_fn(|i| (low[i].0 + high[i].0, low[i].1 + high[i].1))
}

/// Nodes and weights of a Gauss–Legendre rule on [0, 1].
#[derive(Clone, Debug)]
pub struct Rule {
    /// Where to evaluate, ascending.
    pub nodes: Vec<f64>,
    /// What each value counts; the sum is 1.
    pub weights: Vec<f64>,
}

impl Rule {
    /// The rule with `n` nodes, exact for polynomials of degree 2n − 1. The nodes are the roots of the Legendre
    /// polynomial Pₙ, found by Newton's method from Tricomi's estimate.
    pub fn gauss_legendre(n: usize) -> Rule {
        let mut nodes = vec![0.5; n];
        let mut weights = vec![1.0; n];
        for i in 0..n {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (p, dp) = legendre(n, x);
                slope = dp;
                let step = p / dp;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            // From [−1, 1] to [0, 1], ascending.
            nodes[n - 1 - i] = 0.5 * (1.0 + x);
            weights[n - 1 - i] = 1.0 / ((1.0 - x * x) * slope * slope);
        }
        Rule { nodes, weights }
    }

    /// Nodes and weights on `[from, to]`, graded toward both ends, where an integrand may begin like a root.
    pub fn between(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let length = to - from;
        self.nodes
            .iter()
            .zip(&self.weights)
            .map(move |(t, weight)| (from + length * t * t * (3.0 - 2.0 * t), weight * length * 6.0 * t * (1.0 - t)))
    }
}

/// Pₙ(x) and its derivative, by the three-term recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut p, mut previous) = (1.0, 0.0);
    for k in 0..n {
        let k = k as f64;
        (p, previous) = (((2.0 * k + 1.0) * x * p - k * previous) / (k + 1.0), p);
    }
    let n = n as f64;
    (p, n * (x * p - previous) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::Rule;

    #[test]
    fn integrates_polynomials_exactly() {
        for n in 1..40 {
            let rule = Rule::gauss_legendre(n);
            for power in 0..2 * n {
                let sum: f64 = rule.nodes.iter().zip(&rule.weights).map(|(x, w)| w * x.powi(power as i32)).sum();
                approx::assert_abs_diff_eq!(sum, 1.0 / (power as f64 + 1.0), epsilon = 1e-13);
            }
        }
    }
}
