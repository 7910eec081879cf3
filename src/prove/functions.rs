//! The ranges of the functions scripts have, from the ranges of their arguments.

use super::interval::Interval;
use crate::ir::builtins::BUILTINS;
use std::f64::consts::PI;

/// The function's value on single floats, as the shader computes it.
fn apply(index: u16, args: [f64; 3]) -> f64 {
    let cells = args.map(|x| [(x as f32).to_bits(), 0, 0]);
    f32::from_bits(BUILTINS[index as usize].apply(1, &cells)[0]) as f64
}

/// Whether it is the square root.
pub fn is_root(index: u16) -> bool {
    BUILTINS[index as usize].name == "sqrt"
}

/// The function whose square adds up to 1 with that of this one: of sine and cosine.
pub fn quarter_turn(index: u16) -> Option<u16> {
    let other = if BUILTINS[index as usize].name == "sin" { "cos" } else { "" };
    BUILTINS.iter().position(|b| b.name == other).map(|i| i as u16)
}

/// The exponent of a power that is a product.
pub fn whole_power(index: u16, args: [Interval; 3]) -> Option<u32> {
    let n = args[1].lo;
    let small = args[1].is_point() && n.fract() == 0.0 && (1.0..=8.0).contains(&n);
    (BUILTINS[index as usize].name == "pow" && small && args[0].is_finite() && !args[0].nan).then_some(n as u32)
}

/// A float cut to a whole number.
pub fn whole(x: Interval) -> Interval {
    let cut = |x: f64| x.trunc().clamp(i32::MIN as f64, i32::MAX as f64);
    let range = Interval::new(cut(x.lo), cut(x.hi));
    if x.nan { range.hull(Interval::point(0.0)) } else { range }
}

/// The range of a function of the table.
pub fn range(index: u16, args: [Interval; 3]) -> Interval {
    let [a, b, c] = args;
    let f = |x: f64, y: f64, z: f64| apply(index, [x, y, z]);
    let one = |x: f32| f(x as f64, 0.0, 0.0) as f32;
    let line = Interval { nan: false, ..Interval::ALL };
    let any = Interval { nan: a.nan || b.nan || c.nan, ..line };
    let unit = Interval { nan: any.nan, ..Interval::new(0.0, 1.0) };
    match BUILTINS[index as usize].name {
        "sqrt" | "cbrt" | "exp" | "exp2" | "expm1" | "log2" | "log10" | "asin" | "atan" | "sinh" | "tanh" | "floor"
        | "ceil" | "round" | "trunc" | "sign" | "degrees" => a.rising(one),
        "log" if BUILTINS[index as usize].instances().any(|(_, types)| types.len() == 1) => a.rising(one),
        "acos" => a.mapped(one(a.hi as f32) as f64, one(a.lo as f32) as f64, f64::NAN),
        "sin" => wave(a, 0.0),
        "cos" => wave(a, PI / 2.0),
        "cosh" => {
            let least = if a.lo <= 0.0 && a.hi >= 0.0 { 0.0 } else { a.lo.abs().min(a.hi.abs()) };
            a.mapped(f(least, 0.0, 0.0), f(a.magnitude(), 0.0, 0.0), f64::NAN)
        }
        "inversesqrt" if a.lo > 0.0 => a.mapped(f(a.hi, 0.0, 0.0), f(a.lo, 0.0, 0.0), 0.0),
        "inversesqrt" => Interval { nan: a.nan, ..Interval::new(0.0, f64::INFINITY) },
        "atan2" => Interval { nan: any.nan, ..Interval::new(-PI - 1e-6, PI + 1e-6) },
        "hypot" => {
            let least = |x: Interval| if x.lo <= 0.0 && x.hi >= 0.0 { 0.0 } else { x.lo.abs().min(x.hi.abs()) };
            let near = f(least(a), least(b), least(c));
            let far = f(a.magnitude(), b.magnitude(), c.magnitude());
            let plain = a.mapped(near, far, f64::NAN);
            Interval { nan: any.nan, ..plain }
        }
        // a − b·⌊a/b⌋: the difference may round up to b and a little beyond.
        "mod" if b.is_point() && a.is_finite() => {
            let b = b.lo.abs() + 1e-6 * (b.lo.abs() + a.magnitude());
            let (lo, hi) = if args[1].lo >= 0.0 { (-1e-6 * a.magnitude(), b) } else { (-b, 1e-6 * a.magnitude()) };
            Interval { nan: any.nan, ..Interval::new(lo, hi) }
        }
        "fmod" if b.is_finite() && a.is_finite() => {
            let most = b.magnitude().min(a.magnitude());
            let lo = if a.lo >= 0.0 { 0.0 } else { -most };
            Interval { nan: any.nan, ..Interval::new(lo, if a.hi <= 0.0 { 0.0 } else { most }) }
        }
        // Rising in x, falling in both edges; where the edges may cross, still between 0 and 1.
        "linearstep" | "smoothstep" if a.hi < b.lo && !any.nan => {
            c.mapped(f(a.hi, b.hi, c.lo), f(a.lo, b.lo, c.hi), f64::NAN).narrowed(unit)
        }
        "linearstep" | "smoothstep" => unit,
        "pow" => power(index, a, b),
        _ => Interval { nan: true, ..line },
    }
}

/// sin(x + shift).
fn wave(x: Interval, shift: f64) -> Interval {
    let whole = Interval { nan: x.nan || !x.is_finite(), ..Interval::new(-1.0, 1.0) };
    // The argument of a large float is off by as much as its rounding.
    if !x.is_finite() || x.width() >= 2.0 * PI || x.magnitude() > 1e4 {
        return whole;
    }
    let (lo, hi) = (x.lo + shift, x.hi + shift);
    let holds = |at: f64| ((hi - at) / (2.0 * PI)).floor() >= ((lo - at) / (2.0 * PI)).ceil();
    let (a, b) = (lo.sin(), hi.sin());
    let top = if holds(PI / 2.0) { 1.0 } else { a.max(b) + 1e-6 };
    let bottom = if holds(-PI / 2.0) { -1.0 } else { a.min(b) - 1e-6 };
    Interval { nan: x.nan, ..Interval::new(bottom.max(-1.0), top.min(1.0)) }
}

fn power(index: u16, x: Interval, y: Interval) -> Interval {
    let f = |x: f64, y: f64| apply(index, [x, y, 0.0]);
    if x.nan || y.nan || !y.is_finite() {
        return Interval::ALL;
    }
    // Monotone in each argument on either side of x = 1 and y = 0, so that the extremes lie at corners and at 1.
    let base = Interval::new(x.lo.max(0.0), x.hi.max(0.0));
    let mut corners = vec![f(base.lo, y.lo), f(base.lo, y.hi), f(base.hi, y.lo), f(base.hi, y.hi)];
    if base.lo <= 0.0 {
        // 0 to a positive power, or by definition to a negative one.
        corners.push(0.0);
        if y.lo < 0.0 && base.hi > 0.0 {
            corners.push(f64::INFINITY);
        }
    }
    if y.lo <= 0.0 && y.hi >= 0.0 {
        corners.push(1.0);
    }
    if x.lo < 0.0 {
        let most = [f(-x.lo, y.lo), f(-x.lo, y.hi), 1.0].into_iter().fold(0.0, f64::max);
        let whole = y.is_point() && y.lo.fract() != 0.0;
        let near_zero = x.lo > -1.0 && y.lo > 0.0;
        let most = if near_zero { f(-x.lo, y.lo).max(f(-x.lo, y.hi)) } else { most };
        match () {
            () if whole => corners.push(0.0),
            () if y.lo < 0.0 => return Interval { nan: false, ..Interval::ALL },
            () => corners.extend([-most, most]),
        }
    }
    let lo = corners.iter().copied().fold(f64::INFINITY, f64::min);
    let hi = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Interval::new(lo, hi).mapped(lo, hi, f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Every function of floats, on random ranges and random values within them.
    #[test]
    fn values_lie_in_the_ranges() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(11);
        for (index, builtin) in BUILTINS.iter().enumerate() {
            if !crate::prove::graph::componentwise(index as u16) {
                continue;
            }
            for _ in 0..400 {
                let scale: f64 = *[0.5, 1.0, 3.0, 20.0].get(rng.random_range(0..4usize)).unwrap();
                let mut end = || (rng.random_range(-1.0..1.0f64) * scale) as f32 as f64;
                let args: [Interval; 3] = std::array::from_fn(|k| match (builtin.name, k) {
                    // A constant exponent and modulus are what is treated apart.
                    ("pow" | "mod", 1) => Interval::point((end() * 2.0).round() * 0.5),
                    _ => Interval::new(end(), end()),
                });
                let range = range(index as u16, args);
                for _ in 0..20 {
                    let x = args.map(|a| (a.lo + a.width() * rng.random_range(0.0..=1.0)) as f32 as f64);
                    let y = apply(index as u16, x);
                    let fits = if y.is_nan() { range.nan } else { y >= range.lo && y <= range.hi };
                    assert!(fits, "{}({x:?}) = {y} outside {range:?} of {args:?}", builtin.name);
                }
            }
        }
    }
}
