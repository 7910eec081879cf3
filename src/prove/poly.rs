//! Polynomials in several variables and their range over a box.
//!
//! Weights are polynomials in parameters and in values that are none (`sqrt(x)`, `texture`), each a variable of its own.
//! Sums and products of them are exact, so that `a*(1 - x) + b*x` stays what it is. The range over a box: variables in
//! which the polynomial rises or falls throughout go to their ends; the rest is written in Bernstein form, whose
//! coefficients enclose the range and are exact at the corners – and everywhere for what is linear in each variable.

use super::interval::Interval;
use smallvec::SmallVec;

/// A product of powers: variables in ascending order.
pub type Monomial = SmallVec<[(u32, u8); 4]>;

/// A sum of monomials with coefficients, in ascending order, none zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Poly {
    terms: Vec<(Monomial, f64)>,
}

/// More terms than this are not kept.
const MAX_TERMS: usize = 400;
/// Largest degree in one variable.
const MAX_DEGREE: u8 = 12;
/// More Bernstein coefficients than this are not computed.
const MAX_TENSOR: usize = 1 << 13;

impl Poly {
    /// A number.
    pub fn constant(x: f64) -> Poly {
        Poly { terms: if x == 0.0 { vec![] } else { vec![(Monomial::new(), x)] } }
    }

    /// A variable.
    pub fn var(v: u32) -> Poly {
        Poly { terms: vec![(SmallVec::from_slice(&[(v, 1)]), 1.0)] }
    }

    /// The variable it is, if it is nothing else.
    pub fn as_var(&self) -> Option<u32> {
        match self.terms.as_slice() {
            [(m, c)] if *c == 1.0 && m.len() == 1 && m[0].1 == 1 => Some(m[0].0),
            _ => None,
        }
    }

    /// Its value if it is a number.
    pub fn as_constant(&self) -> Option<f64> {
        match self.terms.as_slice() {
            [] => Some(0.0),
            [(m, c)] if m.is_empty() => Some(*c),
            _ => None,
        }
    }

    /// Its terms.
    pub fn terms(&self) -> &[(Monomial, f64)] {
        &self.terms
    }

    fn collected(mut terms: Vec<(Monomial, f64)>) -> Poly {
        terms.sort_by(|a, b| a.0.cmp(&b.0));
        terms.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 += next.1;
            }
            same
        });
        // What is left of a difference of equals.
        terms.retain(|(_, c)| c.abs() > 1e-15);
        Poly { terms }
    }

    /// self + k·o.
    pub fn plus(&self, o: &Poly, k: f64) -> Poly {
        let scaled = o.terms.iter().map(|(m, c)| (m.clone(), c * k));
        Poly::collected(self.terms.iter().cloned().chain(scaled).collect())
    }

    /// k·self.
    pub fn scaled(&self, k: f64) -> Poly {
        Poly::default().plus(self, k)
    }

    /// The product, unless it gets too large.
    pub fn times(&self, o: &Poly) -> Option<Poly> {
        if self.terms.len() * o.terms.len() > 4 * MAX_TERMS {
            return None;
        }
        let mut terms = Vec::with_capacity(self.terms.len() * o.terms.len());
        for (a, x) in &self.terms {
            for (b, y) in &o.terms {
                terms.push((product(a, b)?, x * y));
            }
        }
        let poly = Poly::collected(terms);
        (poly.terms.len() <= MAX_TERMS).then_some(poly)
    }

    /// Whether it has become too large to carry on with.
    pub fn is_large(&self) -> bool {
        self.terms.len() > MAX_TERMS
    }

    /// Its variables with the highest power of each.
    pub fn degrees(&self) -> Vec<(u32, u8)> {
        let mut all: Vec<(u32, u8)> = self.terms.iter().flat_map(|(m, _)| m.iter().copied()).collect();
        all.sort_by_key(|(v, d)| (*v, std::cmp::Reverse(*d)));
        all.dedup_by_key(|(v, _)| *v);
        all
    }

    /// The part that `v` multiplies in the first power, divided by it, if `v` occurs in no other power.
    pub fn linear_in(&self, v: u32) -> Option<(Poly, Poly)> {
        let (mut with, mut without) = (Vec::new(), Vec::new());
        for (m, c) in &self.terms {
            match m.iter().position(|(w, _)| *w == v) {
                None => without.push((m.clone(), *c)),
                Some(at) if m[at].1 == 1 => {
                    let mut m = m.clone();
                    m.remove(at);
                    with.push((m, *c));
                }
                Some(_) => return None,
            }
        }
        Some((Poly::collected(with), Poly::collected(without)))
    }

    /// Replaces each multiple of the leading term of `zero`, a polynomial known to vanish, by what it equals.
    /// `lead` is that term's place in `zero`.
    pub fn reduced(&self, zero: &Poly, lead: usize) -> Poly {
        let Some((monomial, coefficient)) = zero.terms.get(lead) else { return self.clone() };
        let mut poly = self.clone();
        for _ in 0..64 {
            let found = poly.terms.iter().find_map(|(m, c)| Some((quotient(m, monomial)?, *c)));
            let Some((rest, c)) = found else { break };
            let factor = Poly { terms: vec![(rest, 1.0)] };
            match factor.times(zero) {
                Some(multiple) => poly = poly.plus(&multiple, -c / coefficient),
                None => break,
            }
        }
        if poly.is_large() { self.clone() } else { poly }
    }

    /// Term by term.
    pub fn rough_range(&self, range: &impl Fn(u32) -> Interval) -> Interval {
        let mut sum = (0.0, 0.0);
        for (m, c) in &self.terms {
            let (mut lo, mut hi) = (*c, *c);
            for (v, d) in m {
                let (a, b) = powers(range(*v), *d);
                let times = |x: f64, y: f64| if x == 0.0 || y == 0.0 { 0.0 } else { x * y };
                let ends = [times(lo, a), times(lo, b), times(hi, a), times(hi, b)];
                lo = ends.into_iter().fold(f64::INFINITY, f64::min);
                hi = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
            }
            sum = (sum.0 + lo, sum.1 + hi);
        }
        let slack = 1e-12 * (sum.0.abs() + sum.1.abs());
        match sum.0.is_nan() || sum.1.is_nan() {
            true => Interval { nan: false, ..Interval::ALL },
            false if slack.is_finite() => Interval::new(sum.0 - slack, sum.1 + slack),
            false => Interval::new(sum.0, sum.1),
        }
    }

    /// The range over a box.
    pub fn range(&self, range: &impl Fn(u32) -> Interval) -> Interval {
        if self.terms.len() <= 1 {
            return self.rough_range(range);
        }
        let rough = self.rough_range(range);
        let up = self.upper(range);
        let down = -self.scaled(-1.0).upper(range);
        rough.narrowed(Interval::new(down.min(up), up))
    }

    /// An upper bound over a box.
    pub fn upper(&self, range: &impl Fn(u32) -> Interval) -> f64 {
        let endless = |(m, _): &&(Monomial, f64)| m.iter().any(|(v, _)| !range(*v).is_finite());
        let (far, near): (Vec<_>, Vec<_>) = self.terms.iter().partition(endless);
        let far = Poly { terms: far.into_iter().cloned().collect() };
        let beyond = if far.terms.is_empty() { 0.0 } else { far.rough_range(range).hi };
        let near = Poly { terms: near.into_iter().cloned().collect() };
        let bound = near.without_slopes(range).bernstein(range).min(near.rough_range(range).hi);
        let size: f64 = near.terms.iter().map(|(_, c)| c.abs()).sum();
        bound + beyond + 1e-13 * size
    }

    /// Variables in which it only rises, or only falls, set to the end where it is largest.
    fn without_slopes(&self, range: &impl Fn(u32) -> Interval) -> Poly {
        let mut poly = self.clone();
        loop {
            let steep = poly.degrees().into_iter().find_map(|(v, _)| {
                let slope = poly.derivative(v).rough_range(range);
                match () {
                    () if slope.lo >= -1e-14 => Some((v, range(v).hi)),
                    () if slope.hi <= 1e-14 => Some((v, range(v).lo)),
                    () => None,
                }
            });
            match steep {
                Some((v, x)) => poly = poly.with(v, x),
                None => return poly,
            }
        }
    }

    fn derivative(&self, v: u32) -> Poly {
        let terms = self.terms.iter().filter_map(|(m, c)| {
            let at = m.iter().position(|(w, _)| *w == v)?;
            let (mut m, d) = (m.clone(), m[at].1);
            if d == 1 {
                m.remove(at);
            } else {
                m[at].1 -= 1;
            }
            Some((m, c * d as f64))
        });
        Poly::collected(terms.collect())
    }

    /// With a number in place of a variable.
    fn with(&self, v: u32, x: f64) -> Poly {
        let terms = self.terms.iter().map(|(m, c)| match m.iter().position(|(w, _)| *w == v) {
            Some(at) => {
                let (mut m, d) = (m.clone(), m[at].1);
                m.remove(at);
                (m, c * x.powi(d as i32))
            }
            None => (m.clone(), *c),
        });
        Poly::collected(terms.collect())
    }

    /// The largest Bernstein coefficient.
    fn bernstein(&self, range: &impl Fn(u32) -> Interval) -> f64 {
        let vars = self.degrees();
        let mut size = 1usize;
        for (_, d) in &vars {
            size = size.saturating_mul(*d as usize + 1);
        }
        if size > MAX_TENSOR {
            return f64::INFINITY;
        }
        let mut tensor = vec![0.0; size];
        for (m, c) in &self.terms {
            let (mut at, mut stride) = (0, 1);
            for (v, d) in &vars {
                let power = m.iter().find(|(w, _)| w == v).map_or(0, |(_, p)| *p as usize);
                at += power * stride;
                stride *= *d as usize + 1;
            }
            tensor[at] += c;
        }
        let mut stride = 1;
        for (v, d) in &vars {
            let count = *d as usize + 1;
            let box_ = range(*v);
            for start in (0..size).filter(|i| (i / stride) % count == 0) {
                let mut line: Vec<f64> = (0..count).map(|k| tensor[start + k * stride]).collect();
                to_bernstein(&mut line, box_);
                line.iter().enumerate().for_each(|(k, x)| tensor[start + k * stride] = *x);
            }
            stride *= count;
        }
        tensor.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// From powers of x to Bernstein coefficients over a range.
fn to_bernstein(line: &mut [f64], range: Interval) {
    let n = line.len() - 1;
    // Taylor coefficients about the lower end, then in units of the width.
    for i in 0..n {
        for k in (i..n).rev() {
            line[k] += range.lo * line[k + 1];
        }
    }
    let mut scale = 1.0;
    for (k, x) in line.iter_mut().enumerate() {
        *x *= scale / binomial(n, k);
        scale *= range.width();
    }
    for i in 0..n {
        for k in (i + 1..=n).rev() {
            line[k] += line[k - 1];
        }
    }
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |b, i| b * (n - i) as f64 / (i + 1) as f64)
}

fn product(a: &Monomial, b: &Monomial) -> Option<Monomial> {
    let mut all: Monomial = a.iter().chain(b).copied().collect();
    all.sort_unstable();
    let mut out = Monomial::new();
    for (v, d) in all {
        match out.last_mut() {
            Some(last) if last.0 == v => last.1 = last.1.checked_add(d).filter(|d| *d <= MAX_DEGREE)?,
            _ => out.push((v, d)),
        }
    }
    Some(out)
}

/// a/b if b divides a.
fn quotient(a: &Monomial, b: &Monomial) -> Option<Monomial> {
    let mut out = a.clone();
    for (v, d) in b {
        let at = out.iter().position(|(w, _)| w == v)?;
        out[at].1 = out[at].1.checked_sub(*d)?;
    }
    out.retain(|(_, d)| *d > 0);
    Some(out)
}

fn powers(x: Interval, d: u8) -> (f64, f64) {
    let (a, b) = (x.lo.powi(d as i32), x.hi.powi(d as i32));
    match d.is_multiple_of(2) {
        false => (a, b),
        true if x.lo <= 0.0 && x.hi >= 0.0 => (0.0, a.max(b)),
        true => (a.min(b), a.max(b)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn unit(_: u32) -> Interval {
        Interval::new(0.0, 1.0)
    }

    #[test]
    fn a_mix_stays_between_its_ends() {
        let (a, b, x) = (Poly::var(0), Poly::var(1), Poly::var(2));
        let rest = Poly::constant(1.0).plus(&x, -1.0);
        let mix = a.times(&rest).unwrap().plus(&b.times(&x).unwrap(), 1.0);
        let range = mix.range(&unit);
        assert!(range.lo > -1e-9 && range.hi < 1.0 + 1e-9, "{range:?}");
    }

    #[test]
    fn random_polynomials_lie_in_their_range_and_nearly_reach_it() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(5);
        for _ in 0..300 {
            let mut poly = Poly::constant(rng.random_range(-1.0..1.0));
            for _ in 0..4 {
                let mut term = Poly::constant(rng.random_range(-1.0..1.0));
                for _ in 0..rng.random_range(1..4) {
                    term = term.times(&Poly::var(rng.random_range(0..3))).unwrap();
                }
                poly = poly.plus(&term, 1.0);
            }
            let ends: Vec<Interval> = (0..3).map(|k| Interval::new(-0.3 * k as f64, 0.9)).collect();
            let range = poly.range(&|v| ends[v as usize]);
            let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
            for k in 0..1331 {
                let x = [k % 11, k / 11 % 11, k / 121].map(|i| i as f64 / 10.0);
                let at = |v: u32| ends[v as usize].lo + x[v as usize] * ends[v as usize].width();
                let value: f64 = poly
                    .terms()
                    .iter()
                    .map(|(m, c)| c * m.iter().map(|(v, d)| at(*v).powi(*d as i32)).product::<f64>())
                    .sum();
                assert!(value >= range.lo - 1e-9 && value <= range.hi + 1e-9, "{poly:?} {value} {range:?}");
                (lo, hi) = (lo.min(value), hi.max(value));
            }
            assert!(range.width() < 1.6 * (hi - lo) + 0.05, "{poly:?}: {range:?}, seen {lo}..{hi}");
        }
    }

    #[test]
    fn what_vanishes_is_taken_out() {
        // r·(a + b) − 1 = 0, so a·r + b·r is 1.
        let (a, b, r) = (Poly::var(0), Poly::var(1), Poly::var(2));
        let zero = a.plus(&b, 1.0).times(&r).unwrap().plus(&Poly::constant(1.0), -1.0);
        let sum = a.times(&r).unwrap().plus(&b.times(&r).unwrap(), 1.0);
        let lead = zero.terms().iter().position(|(m, _)| m.contains(&(0, 1))).unwrap();
        assert_eq!(sum.reduced(&zero, lead).as_constant(), Some(1.0));
    }
}
