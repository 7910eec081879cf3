//! What each operation makes of the numbers it is given.

use super::{BARELY_NEGATIVE, Number, Path, ROUNDING, Vanishing, decided, functions};
use crate::prove::graph::{Id, Node, Order};
use crate::prove::interval::Interval;
use crate::prove::poly::Poly;

impl Path<'_> {
    pub(super) fn sum(&mut self, id: Id, a: Id, b: Id) -> Number {
        let (a, b) = (self.of(a), self.of(b));
        let range = a.range.plus(b.range);
        let error = a.error + b.error + ROUNDING * range.magnitude();
        let same_sign = (a.range.lo >= 0.0 && b.range.lo >= 0.0) || (a.range.hi <= 0.0 && b.range.hi <= 0.0);
        let relative = if same_sign { a.relative.max(b.relative) + ROUNDING } else { f64::INFINITY };
        self.settled(id, range, Some(a.poly.plus(&b.poly, 1.0)), error, relative)
    }

    pub(super) fn product(&mut self, id: Id, a: Id, b: Id) -> Number {
        let square = a == b;
        let (a, b) = (self.of(a), self.of(b));
        let mut range = a.range.times(b.range);
        if square {
            range = range.narrowed(Interval::new(0.0, f64::INFINITY));
        }
        let (x, y) = (a.range.magnitude(), b.range.magnitude());
        let error = a.error * y + b.error * x + a.error * b.error + ROUNDING * range.magnitude();
        let error = if error.is_nan() { f64::INFINITY } else { error };
        let poly = a.poly.times(&b.poly);
        self.settled(id, range, poly, error, a.relative + b.relative + ROUNDING)
    }

    pub(super) fn quotient(&mut self, id: Id, a: Id, b: Id, r: Id) -> Number {
        let (a, b, r) = (self.of(a), self.of(b), self.of(r));
        let zero = b.range.lo <= 0.0 && b.range.hi >= 0.0;
        let inverse = r.range.narrowed(b.range.reciprocal());
        let mut range = if r.range.is_point() { a.range.times(r.range) } else { a.range.times(inverse) };
        // 0/0 is 0, and what is not zero divided by next to nothing stays a number.
        range.nan = a.range.nan || b.range.nan || !a.range.is_finite();
        if zero && !r.range.is_point() {
            range = range.hull(Interval::point(0.0));
        }
        let of = |v: u32| self.variable(v);
        if a.range.lo >= 0.0 && b.range.lo >= 0.0 && a.poly.plus(&b.poly, -1.0).upper(&of) <= a.error + b.error {
            range = range.narrowed(Interval::new(0.0, 1.0));
        }
        let size = range.magnitude();
        let absolute = a.error * r.range.magnitude() + ROUNDING * size;
        let relative = a.relative + ROUNDING;
        let error = if absolute.is_finite() { absolute } else { relative * size };
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.settled(id, range, a.poly.times(&r.poly), error, relative + b.relative)
    }

    pub(super) fn reciprocal(&mut self, id: Id, b: Id) -> Number {
        let b = self.of(b);
        if b.range.is_point() {
            return Number::exactly(if b.range.lo == 0.0 { 0.0 } else { 1.0 / b.range.lo });
        }
        if b.range.lo <= 0.0 && b.range.hi >= 0.0 {
            match self.choose(id, 2) {
                Some(0) => {
                    self.narrow(&b.poly, b.error, true);
                    self.narrow(&b.poly, b.error, false);
                    return Number::exactly(0.0);
                }
                Some(_) => {}
                None => return self.atom(id, Interval { nan: false, ..Interval::ALL }),
            }
        }
        let number = self.atom(id, Interval { nan: false, ..b.range.reciprocal() });
        let error = b.relative.min(b.error * number.range.magnitude());
        if let Some(product) = b.poly.times(&Poly::var(id.0)).filter(|_| error < 1e-4) {
            let poly = product.plus(&Poly::constant(1.0), -1.0);
            // The term of the highest degree divides no other.
            let degree = |i: &usize| poly.terms()[*i].0.iter().map(|(_, d)| *d as u32).sum::<u32>();
            let lead = (0..poly.terms().len()).max_by_key(degree).unwrap_or(0);
            self.vanishing.push(Vanishing { poly, lead, error });
        }
        number
    }

    /// The larger of two for `sign` 1, the smaller for −1.
    pub(super) fn larger(&mut self, id: Id, a: Id, b: Id, sign: f64) -> Number {
        let (x, y) = (self.of(a), self.of(b));
        let pick = |p: f64, q: f64| if sign > 0.0 { p.max(q) } else { p.min(q) };
        let mut range = Interval::new(pick(x.range.lo, y.range.lo), pick(x.range.hi, y.range.hi));
        if x.range.nan || y.range.nan {
            range = range.hull(x.range);
            range.nan = x.range.nan;
            return self.atom(id, range);
        }
        let difference = y.poly.plus(&x.poly, -1.0).scaled(sign);
        let error = x.error + y.error;
        let seen = self.difference(&x, &y, sign);
        let second = match () {
            () if seen.hi <= 0.0 => Some(1),
            () if seen.lo >= 0.0 => Some(0),
            () => self.choose(id, 2),
        };
        match second {
            Some(0) => {
                self.narrow(&difference.scaled(-1.0), error, true);
                Number { range: y.range.narrowed(range), ..(*y).clone() }
            }
            Some(_) => {
                self.narrow(&difference, error, true);
                Number { range: x.range.narrowed(range), ..(*x).clone() }
            }
            None => self.atom(id, range),
        }
    }

    /// sign·(b − a).
    pub(super) fn difference(&self, a: &Number, b: &Number, sign: f64) -> Interval {
        let plain = b.range.plus(a.range.negated());
        let seen = b.poly.plus(&a.poly, -1.0).range(&|v| self.variable(v));
        let error = a.error + b.error;
        let both = plain.narrowed(Interval::new(seen.lo - error, seen.hi + error));
        if sign > 0.0 { both } else { both.negated() }
    }

    pub(super) fn absolute(&mut self, id: Id, a: Id) -> Number {
        let x = self.of(a);
        let positive = match () {
            () if x.range.nan => None,
            () if x.range.lo >= 0.0 => Some(0),
            () if x.range.hi <= 0.0 => Some(1),
            () => self.choose(id, 2),
        };
        match positive {
            Some(0) => {
                self.narrow(&x.poly.scaled(-1.0), x.error, true);
                Number { range: x.range.narrowed(Interval::new(0.0, f64::INFINITY)), ..(*x).clone() }
            }
            Some(_) => {
                self.narrow(&x.poly, x.error, true);
                let turned = x.negated();
                Number { range: turned.range.narrowed(Interval::new(0.0, f64::INFINITY)), ..turned }
            }
            None => {
                let lo =
                    if x.range.lo <= 0.0 && x.range.hi >= 0.0 { 0.0 } else { x.range.lo.abs().min(x.range.hi.abs()) };
                self.atom(id, Interval { nan: x.range.nan, ..Interval::new(lo, x.range.magnitude()) })
            }
        }
    }

    pub(super) fn weight(&mut self, id: Id, a: Id) -> Number {
        let x = self.of(a);
        let most = crate::closure::tree::MAX_WEIGHT as f64;
        let range =
            Interval { nan: x.range.nan, ..Interval::new(x.range.lo.clamp(0.0, most), x.range.hi.clamp(0.0, most)) };
        if x.range.nan {
            return self.atom(id, Interval { lo: 0.0, ..range });
        }
        if x.range.hi <= 0.0 {
            return Number::exactly(0.0);
        }
        if x.range.hi > most {
            return self.atom(id, range);
        }
        if x.range.lo >= -BARELY_NEGATIVE {
            return Number { range, error: x.error + (-x.range.lo).max(0.0), ..(*x).clone() };
        }
        match self.choose(id, 2) {
            Some(0) => {
                self.narrow(&x.poly.scaled(-1.0), x.error, true);
                Number { range, ..(*x).clone() }
            }
            Some(_) => {
                self.narrow(&x.poly, x.error, true);
                Number::exactly(0.0)
            }
            None => self.atom(id, range),
        }
    }

    pub(super) fn comparison(&mut self, id: Id, order: Order, a: Id, b: Id) -> Number {
        let (x, y) = (self.of(a), self.of(b));
        let seen = self.difference(&y, &x, 1.0);
        let nan = x.range.nan || y.range.nan;
        let known = match order {
            Order::Equal if seen.lo > 0.0 || seen.hi < 0.0 => Some(false),
            Order::Equal if x.range.is_point() && y.range.is_point() => Some(x.range.lo == y.range.lo),
            Order::Less if seen.hi < 0.0 => Some(true),
            Order::Less if seen.lo >= 0.0 => Some(false),
            Order::AtMost if seen.hi <= 0.0 => Some(true),
            Order::AtMost if seen.lo > 0.0 => Some(false),
            _ => None,
        };
        if let Some(known) = known.filter(|known| !nan || !known) {
            return Number::logic(Some(known), id);
        }
        // a < b is the opposite of b ≤ a, which may have been asked already.
        let opposite = match order {
            Order::Equal => None,
            Order::Less => self.graph.find(Node::Compare(Order::AtMost, b, a)),
            Order::AtMost => self.graph.find(Node::Compare(Order::Less, b, a)),
        };
        let answered = opposite.and_then(|o| self.numbers[o.index()].as_ref()).and_then(|n| decided(n.range));
        if let Some(opposite) = answered.filter(|_| !nan) {
            return Number::logic(Some(!opposite), id);
        }
        let difference = x.poly.plus(&y.poly, -1.0);
        let error = x.error + y.error;
        let holds = self.choose(id, 2).map(|case| case == 0);
        match holds {
            _ if nan => {}
            Some(true) => {
                self.narrow(&difference, error, true);
                if order == Order::Equal {
                    self.narrow(&difference.scaled(-1.0), error, true);
                }
            }
            Some(false) if order != Order::Equal => self.narrow(&difference.scaled(-1.0), error, true),
            _ => {}
        }
        Number::logic(holds, id)
    }

    pub(super) fn truth(&mut self, id: Id, a: Id) -> Number {
        let x = self.of(a);
        if let Some(known) = decided(x.range) {
            return Number::logic(Some(known), id);
        }
        let holds = self.choose(id, 2).map(|case| case == 0);
        if holds == Some(false) && !x.range.nan {
            self.narrow(&x.poly, x.error, true);
            self.narrow(&x.poly.scaled(-1.0), x.error, true);
        }
        Number::logic(holds, id)
    }

    pub(super) fn call(&mut self, id: Id, index: u16, args: [Id; 3]) -> Number {
        let args = args.map(|a| self.of(a));
        let ranges = [args[0].range, args[1].range, args[2].range];
        let range = functions::range(index, ranges);
        if let Some(power) = functions::whole_power(index, ranges) {
            let x = &args[0];
            let mut poly = Some(x.poly.clone());
            for _ in 1..power {
                poly = poly.and_then(|p| p.times(&x.poly));
            }
            let (n, size) = (power as f64, x.range.magnitude());
            let error = n * size.powi(power as i32 - 1) * x.error + 8.0 * ROUNDING * size.powi(power as i32);
            return self.settled(id, range, poly, error, n * x.relative + 8.0 * ROUNDING);
        }
        let number = self.atom(id, range);
        if let Some(other) =
            functions::quarter_turn(index).and_then(|o| self.graph.find(Node::Call(o, self.args_of(id))))
        {
            let square = |v: u32| Poly::var(v).times(&Poly::var(v)).unwrap_or_default();
            let poly = square(id.0).plus(&square(other.0), 1.0).plus(&Poly::constant(1.0), -1.0);
            let lead = poly.terms().iter().position(|(m, _)| m.as_slice() == [(id.0, 2)]).unwrap_or(0);
            self.vanishing.push(Vanishing { poly, lead, error: 8.0 * ROUNDING });
        }
        if functions::is_root(index) && ranges[0].lo >= 0.0 && args[0].error < 1e-4 && number.poly.as_var().is_some() {
            let square = Poly::var(id.0).times(&Poly::var(id.0)).unwrap_or_default();
            let poly = square.plus(&args[0].poly, -1.0);
            let lead = poly.terms().iter().position(|(m, _)| m.as_slice() == [(id.0, 2)]).unwrap_or(0);
            self.vanishing.push(Vanishing {
                poly,
                lead,
                error: args[0].error + 4.0 * ROUNDING * ranges[0].magnitude(),
            });
        }
        number
    }
}
