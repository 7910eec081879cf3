//! Gauss–Legendre rules on [0, 1].

use std::f64::consts::PI;

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
