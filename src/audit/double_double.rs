//! Double-double numbers as a [`Real`]: some 31 digits, what double precision is held to.
//!
//! An unevaluated sum of two doubles (Dekker 1971; Joldes, Muller & Popescu 2017). Where an operation leaves the range of
//! doubles – an infinite or undefined part – the plain result stands, so that limits and masks behave as they do in the
//! other types. Constants and tables are the same doubles as elsewhere: what is compared is the arithmetic alone.

use crate::optics::{Lift, Real, Scalar};
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};
use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_2, LN_2};

/// The value `hi + lo`, where `lo` is at most half a unit in the last place of `hi`.
#[derive(Clone, Copy, Debug, Default)]
pub struct DoubleDouble {
    hi: f64,
    lo: f64,
}

const HALF_TURN_BY_TWO: DoubleDouble = DoubleDouble { hi: FRAC_PI_2, lo: 6.123_233_995_736_766e-17 };
const LN_OF_2: DoubleDouble = DoubleDouble { hi: LN_2, lo: 2.319_046_813_846_299_6e-17 };

impl DoubleDouble {
    const fn of(hi: f64) -> Self {
        DoubleDouble { hi, lo: 0.0 }
    }

    /// a + b without error.
    fn sum(a: f64, b: f64) -> Self {
        let hi = a + b;
        let part = hi - a;
        DoubleDouble { hi, lo: (a - (hi - part)) + (b - part) }
    }

    /// a + b without error, where |a| ≥ |b|.
    fn quick_sum(a: f64, b: f64) -> Self {
        let hi = a + b;
        DoubleDouble { hi, lo: b - (hi - a) }
    }

    /// a·b without error.
    fn product(a: f64, b: f64) -> Self {
        let hi = a * b;
        DoubleDouble { hi, lo: a.mul_add(b, -hi) }
    }

    /// This value if it is a number, else what double precision makes of it.
    fn or(self, plain: f64) -> Self {
        if plain.is_finite() && self.hi.is_finite() && self.lo.is_finite() { self } else { Self::of(plain) }
    }

    /// Times a power of two.
    fn scaled(self, by: f64) -> Self {
        DoubleDouble { hi: self.hi * by, lo: self.lo * by }
    }

    /// eˣ: the series of x/512 after whole powers of two are taken out, then squared nine times as eˣ − 1.
    fn series_exp(self) -> Self {
        let k = (self.hi / LN_2).round();
        let r = (self - LN_OF_2 * Self::of(k)).scaled(1.0 / 512.0);
        let mut sum = Self::of(1.0);
        for n in (2..=9).rev() {
            sum = Self::of(1.0) + sum * r / Self::of(f64::from(n));
        }
        let mut less_one = sum * r;
        for _ in 0..9 {
            less_one = less_one.scaled(2.0) + less_one * less_one;
        }
        // In two steps, because 2ᵏ alone may leave the range.
        let (half, rest) = ((k / 2.0).floor(), k - (k / 2.0).floor());
        (less_one + Self::of(1.0)).scaled(half.exp2()).scaled(rest.exp2())
    }

    /// Σ (−1)ⁿ·x^(2n+first)/(2n+first)!, for |x| ≤ π/4.
    fn alternating(self, first: i32) -> Self {
        let square = self * self;
        let mut sum = Self::of(1.0);
        for n in (1..=14).rev() {
            let m = 2 * n + first;
            sum = Self::of(1.0) - sum * square / Self::of(f64::from(m * (m - 1)));
        }
        if first == 1 { sum * self } else { sum }
    }

    fn series_sin_cos(self) -> (Self, Self) {
        let k = (self.hi / FRAC_PI_2).round();
        let r = self - HALF_TURN_BY_TWO * Self::of(k);
        let (s, c) = (r.alternating(1), r.alternating(0));
        match k.rem_euclid(4.0) as u32 {
            0 => (s, c),
            1 => (c, -s),
            2 => (-s, -c),
            _ => (-c, s),
        }
    }
}

impl PartialEq for DoubleDouble {
    fn eq(&self, o: &Self) -> bool {
        self.partial_cmp(o) == Some(Ordering::Equal)
    }
}

impl PartialOrd for DoubleDouble {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        match self.hi.partial_cmp(&o.hi) {
            Some(Ordering::Equal) => self.lo.partial_cmp(&o.lo),
            other => other,
        }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        DoubleDouble { hi: -self.hi, lo: -self.lo }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let (high, low) = (Self::sum(self.hi, o.hi), Self::sum(self.lo, o.lo));
        let high = Self::quick_sum(high.hi, high.lo + low.hi);
        Self::quick_sum(high.hi, high.lo + low.lo).or(self.hi + o.hi)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let high = Self::product(self.hi, o.hi);
        let low = high.lo + (self.hi * o.lo + self.lo * o.hi);
        Self::quick_sum(high.hi, low).or(self.hi * o.hi)
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let plain = self.hi / o.hi;
        if !plain.is_finite() || plain == 0.0 {
            return Self::of(plain);
        }
        let rest = self - o * Self::of(plain);
        let next = rest.hi / o.hi;
        let last = (rest - o * Self::of(next)).hi / o.hi;
        (Self::quick_sum(plain, next) + Self::of(last)).or(plain)
    }
}

impl AddAssign for DoubleDouble {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl SubAssign for DoubleDouble {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl MulAssign for DoubleDouble {
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl Real for DoubleDouble {
    type Mask = bool;
    type Entry = Self;

    fn c(x: f64) -> Self {
        Self::of(x)
    }
    fn from_f32(x: f32) -> Self {
        Self::of(f64::from(x))
    }
    fn min(self, o: Self) -> Self {
        if self < o || o.hi.is_nan() { self } else { o }
    }
    fn max(self, o: Self) -> Self {
        if self > o || o.hi.is_nan() { self } else { o }
    }
    fn abs(self) -> Self {
        if self.hi.is_sign_negative() { -self } else { self }
    }
    fn copysign(self, s: Self) -> Self {
        if self.hi.is_sign_negative() == s.hi.is_sign_negative() { self } else { -self }
    }
    fn sqrt(self) -> Self {
        let root = self.hi.sqrt();
        if !root.is_finite() || root == 0.0 {
            return Self::of(root);
        }
        // One step of Newton's doubles the digits.
        let rest = self - Self::product(root, root);
        Self::quick_sum(root, rest.hi / (2.0 * root)).or(root)
    }
    fn floor(self) -> Self {
        let hi = self.hi.floor();
        // A whole upper half leaves the lower one to decide.
        if hi == self.hi { Self::quick_sum(hi, self.lo.floor()).or(hi) } else { Self::of(hi) }
    }
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    fn turned(self, a: f64, o: Self, b: f64) -> Self {
        self * Self::of(a) + o * Self::of(b)
    }
    fn exp(self) -> Self {
        let plain = self.hi.exp();
        if plain.is_finite() && plain > 0.0 { self.series_exp().or(plain) } else { Self::of(plain) }
    }
    fn ln(self) -> Self {
        let x = Real::max(self, Self::of(f64::MIN_POSITIVE));
        let mut y = Self::of(x.hi.ln());
        if y.hi.is_finite() {
            for _ in 0..2 {
                y += x * Real::exp(-y) - Self::of(1.0);
            }
        }
        y
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.hi.sin_cos();
        if !sin.is_finite() {
            return (Self::of(sin), Self::of(cos));
        }
        let (s, c) = self.series_sin_cos();
        (s.or(sin), c.or(cos))
    }
    fn atan2(self, x: Self) -> Self {
        let plain = self.hi.atan2(x.hi);
        let (length, angle) = ((self * self + x * x).sqrt(), Self::of(plain));
        // Where nothing can be gained: at the origin, far out, and on the axis where the sign of zero decides.
        if self.hi == 0.0 || length.hi == 0.0 || !length.hi.is_finite() {
            return angle;
        }
        let (s, c) = angle.sin_cos();
        (angle + (self * c - x * s) / length).or(plain)
    }
    fn lt(self, o: Self) -> bool {
        self < o
    }
    fn le(self, o: Self) -> bool {
        self <= o
    }
    fn any(mask: bool) -> bool {
        mask
    }
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
    fn gather(table: &[DoubleDouble], index: Self) -> Self {
        table[index.hi as usize]
    }
    fn pick(table: &[f32], index: Self) -> Self {
        Self::from_f32(table[index.hi as usize])
    }
    fn by_lane<const N: usize>(values: [Self; N], f: impl Fn([f64; N]) -> [f64; 3]) -> [Self; 3] {
        f(values.map(|v| v.hi)).map(Self::of)
    }
}

impl Scalar for DoubleDouble {
    fn to_f64(self) -> f64 {
        self.hi
    }
    fn is_finite(self) -> bool {
        self.hi.is_finite()
    }
}

impl Lift<DoubleDouble> for DoubleDouble {
    fn lift(s: DoubleDouble) -> Self {
        s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Identities that double precision misses by 1e-16.
    #[test]
    fn functions_have_thirty_digits() {
        let mut worst = [0.0f64; 5];
        for k in 1..2000 {
            let x = DoubleDouble::c(f64::from(k) * 0.012_345_678_9);
            let (s, c) = x.sin_cos();
            let turns = s.atan2(c);
            let (again, cosine) = turns.sin_cos();
            let errors = [
                x.ln().exp() / x - Real::one(),
                s * s + c * c - Real::one(),
                again - s,
                cosine - c,
                x.sqrt() * x.sqrt() / x - Real::one(),
            ];
            for (w, e) in worst.iter_mut().zip(errors) {
                *w = w.max(e.to_f64().abs());
            }
        }
        println!("{worst:?}");
        assert!(worst.iter().all(|w| *w < 1e-28), "{worst:?}");
    }

    #[test]
    fn edges_are_those_of_doubles() {
        let odd = [0.0, -0.0, 1.0, -1.0, 1e-320, 1e300, -1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        let same = |a: DoubleDouble, b: f64| {
            let a = a.to_f64();
            a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() < 4e-16 * b.abs()
        };
        for x in odd {
            let a = DoubleDouble::c(x);
            assert!(same(a.sqrt(), x.sqrt()) && same(a.exp(), x.exp()) && same(a.ln(), Real::ln(x)), "{x}");
            assert!(same(a.floor(), x.floor()) && same(a.abs(), x.abs()), "{x}");
            for y in odd {
                let b = DoubleDouble::c(y);
                assert!(
                    same(a + b, x + y) && same(a - b, x - y) && same(a * b, x * y) && same(a / b, x / y),
                    "{x} {y}"
                );
                assert!(same(Real::min(a, b), x.min(y)) && same(Real::max(a, b), x.max(y)), "{x} {y}");
                assert!(same(a.atan2(b), Real::atan2(x, y)) && same(a.copysign(b), x.copysign(y)), "{x} {y}");
                assert_eq!((a < b, a <= b, a == b), (x < y, x <= y, x == y), "{x} {y}");
            }
        }
        let third = DoubleDouble::c(1.0) / DoubleDouble::c(3.0);
        assert!((third * DoubleDouble::c(3.0) - DoubleDouble::c(1.0)).to_f64().abs() < 1e-31);
        assert_eq!((DoubleDouble::c(2.0) - DoubleDouble::c(1e-20)).floor().to_f64(), 1.0);
    }
}
