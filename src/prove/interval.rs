//! Ranges of single-precision values.
//!
//! Rounding to single precision is monotone: a result that lies between two numbers before it is rounded lies between
//! the same two rounded. So every operation computes its ends in double precision and rounds them.

/// All values from `lo` to `hi`, and NaN if `nan` says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower end, possibly −∞.
    pub lo: f64,
    /// The upper end, possibly ∞.
    pub hi: f64,
    /// Whether the value may be no number.
    pub nan: bool,
}

/// How far functions of the mathematics library may be off, relatively.
const LIBRARY: f64 = 1e-6;

impl Interval {
    /// Everything there is.
    pub const ALL: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY, nan: true };

    /// From `lo` to `hi`; both ways round.
    pub fn new(lo: f64, hi: f64) -> Interval {
        Interval { lo: lo.min(hi), hi: hi.max(lo), nan: false }
    }

    /// One value.
    pub fn point(x: f64) -> Interval {
        if x.is_nan() { Interval { nan: true, ..Interval::new(0.0, 0.0) } } else { Interval::new(x, x) }
    }

    /// Whether it is a single number.
    pub fn is_point(self) -> bool {
        self.lo == self.hi && !self.nan
    }

    /// Whether both ends are finite.
    pub fn is_finite(self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// The largest absolute value.
    pub fn magnitude(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// hi − lo.
    pub fn width(self) -> f64 {
        self.hi - self.lo
    }

    /// A value inside, in the middle where that is finite.
    pub fn middle(self) -> f64 {
        match (self.lo.is_finite(), self.hi.is_finite()) {
            (true, true) => 0.5 * (self.lo + self.hi),
            (true, false) => self.lo + 1.0,
            (false, true) => self.hi - 1.0,
            (false, false) => 0.0,
        }
    }

    /// The smallest interval that holds both.
    pub fn hull(self, o: Interval) -> Interval {
        Interval { lo: self.lo.min(o.lo), hi: self.hi.max(o.hi), nan: self.nan || o.nan }
    }

    /// What both hold; `None` if that is nothing.
    pub fn meet(self, o: Interval) -> Option<Interval> {
        let (lo, hi) = (self.lo.max(o.lo), self.hi.min(o.hi));
        (lo <= hi).then_some(Interval { lo, hi, nan: self.nan && o.nan })
    }

    /// What both hold, where both are known to hold the value.
    pub fn narrowed(self, o: Interval) -> Interval {
        self.meet(o).unwrap_or(self)
    }

    fn rounded(lo: f64, hi: f64, nan: bool) -> Interval {
        // No number at an end: infinities of both signs met.
        let nan = nan || lo.is_nan() || hi.is_nan();
        let lo = if lo.is_nan() { f64::NEG_INFINITY } else { (lo as f32) as f64 };
        let hi = if hi.is_nan() { f64::INFINITY } else { (hi as f32) as f64 };
        Interval { lo, hi, nan }
    }

    /// Sum.
    pub fn plus(self, o: Interval) -> Interval {
        let mixed = (self.lo.is_infinite() || self.hi.is_infinite()) && (o.lo.is_infinite() || o.hi.is_infinite());
        Interval::rounded(self.lo + o.lo, self.hi + o.hi, self.nan || o.nan || mixed)
    }

    /// −x.
    pub fn negated(self) -> Interval {
        Interval { lo: -self.hi, hi: -self.lo, nan: self.nan }
    }

    /// Product.
    pub fn times(self, o: Interval) -> Interval {
        let zero_by_infinity = |a: Interval, b: Interval| !a.is_finite() && b.lo <= 0.0 && b.hi >= 0.0;
        let nan = self.nan || o.nan || zero_by_infinity(self, o) || zero_by_infinity(o, self);
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let ends = [(self.lo, o.lo), (self.lo, o.hi), (self.hi, o.lo), (self.hi, o.hi)].map(|(a, b)| product(a, b));
        Interval::rounded(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
            nan,
        )
    }

    /// 1/x as mathematics has it; everything if 0 lies inside.
    pub fn reciprocal(self) -> Interval {
        if self.lo > 0.0 || self.hi < 0.0 {
            Interval { lo: 1.0 / self.hi, hi: 1.0 / self.lo, nan: self.nan }
        } else if self.lo == 0.0 && self.hi > 0.0 {
            Interval { lo: 1.0 / self.hi, hi: f64::INFINITY, nan: self.nan }
        } else {
            Interval { nan: self.nan, ..Interval::ALL }
        }
    }

    /// The values of a function that nowhere falls, with what libraries may be off by.
    pub fn rising(self, f: impl Fn(f32) -> f32) -> Interval {
        self.mapped(f(self.lo as f32) as f64, f(self.hi as f32) as f64, f(f32::NAN) as f64)
    }

    /// The values of a function whose values at the ends are these.
    pub fn mapped(self, a: f64, b: f64, at_nan: f64) -> Interval {
        let span = Interval { nan: a.is_nan() || b.is_nan(), ..Interval::new(a.min(b), a.max(b)) };
        let slack = |x: f64| if x.fract() == 0.0 || !x.is_finite() { 0.0 } else { LIBRARY * x.abs() };
        let wide = Interval { lo: span.lo - slack(span.lo), hi: span.hi + slack(span.hi), nan: span.nan };
        match (self.nan, at_nan.is_nan()) {
            (false, _) => wide,
            (true, true) => Interval { nan: true, ..wide },
            (true, false) => wide.hull(Interval::point(at_nan)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_kept_exactly_where_single_precision_keeps_them() {
        let unit = Interval::new(0.0, 1.0);
        assert_eq!(unit.times(unit), unit);
        assert_eq!(Interval::point(1.0).plus(unit.negated()), unit);
        assert_eq!(unit.plus(Interval::point(0.1f32 as f64)).hi, (1.0f32 + 0.1f32) as f64);
    }

    #[test]
    fn infinities_may_make_no_number() {
        assert!(Interval::ALL.plus(Interval::ALL).nan);
        let line = Interval { nan: false, ..Interval::ALL };
        assert!(line.times(Interval::new(0.0, 1.0)).nan && !line.times(Interval::new(2.0, 3.0)).nan);
        assert_eq!(Interval::new(0.0, 4.0).reciprocal(), Interval::new(0.25, f64::INFINITY));
        assert_eq!(Interval::new(0.0, 4.0).rising(f32::sqrt), Interval::new(0.0, 2.0));
    }
}
