//! What each operation computes. Folding and running both call this, so that a value known early and one known late
//! are the same value.

use super::body::{Cells, Op};

/// The value of an operation that touches no closure; `n` is the number of components of its operands.
pub fn apply(op: Op, n: usize, a: Cells, b: Cells, c: Cells) -> Cells {
    let float = || {
        let mut out = [0; 3];
        for k in 0..n {
            out[k] = arithmetic(op, f32::from_bits(a[k]), f32::from_bits(b[k])).to_bits();
        }
        out
    };
    let int = |f: fn(i32, i32) -> i32| [f(a[0] as i32, b[0] as i32) as u32, 0, 0];
    let truth = |t: bool| [u32::from(t), 0, 0];
    let compare_i = |f: fn(&i32, &i32) -> bool| truth(f(&(a[0] as i32), &(b[0] as i32)));
    let equal = || (0..n).all(|k| f32::from_bits(a[k]) == f32::from_bits(b[k]));
    match op {
        Op::NegF | Op::AddF | Op::SubF | Op::MulF | Op::DivF => float(),
        Op::NegI => int(|a, _| a.wrapping_neg()),
        Op::NotI => int(|a, _| i32::from(a == 0)),
        Op::BitNotI => int(|a, _| !a),
        Op::AddI => int(i32::wrapping_add),
        Op::SubI => int(i32::wrapping_sub),
        Op::MulI => int(i32::wrapping_mul),
        Op::DivI => int(|a, b| if b == 0 { 0 } else { a.wrapping_div(b) }),
        Op::RemI => int(|a, b| if b == 0 { 0 } else { a.wrapping_rem(b) }),
        Op::BitAndI => int(|a, b| a & b),
        Op::BitOrI => int(|a, b| a | b),
        Op::BitXorI => int(|a, b| a ^ b),
        Op::ShlI => int(|a, b| a.wrapping_shl(b as u32)),
        Op::ShrI => int(|a, b| a.wrapping_shr(b as u32)),
        Op::EqF => truth(equal()),
        Op::NeF => truth(!equal()),
        Op::LtF | Op::LeF | Op::GtF | Op::GeF => truth(compare(op, f32::from_bits(a[0]), f32::from_bits(b[0]))),
        Op::EqI => compare_i(i32::eq),
        Op::NeI => compare_i(i32::ne),
        Op::LtI => compare_i(i32::lt),
        Op::LeI => compare_i(i32::le),
        Op::GtI => compare_i(i32::gt),
        Op::GeI => compare_i(i32::ge),
        Op::TruthF => truth((0..n).any(|k| f32::from_bits(a[k]) != 0.0)),
        Op::TruthI => truth(a[0] != 0),
        Op::IntToFloat => [(a[0] as i32 as f32).to_bits(), 0, 0],
        Op::FloatToInt => [f32::from_bits(a[0]) as i32 as u32, 0, 0],
        Op::Splat => [a[0]; 3],
        Op::Triple => [a[0], b[0], c[0]],
        Op::Component => [a[component(b)], 0, 0],
        Op::Insert => {
            let mut out = a;
            out[component(b)] = c[0];
            out
        }
        Op::And => truth(a[0] != 0 && b[0] != 0),
        Op::Or => truth(a[0] != 0 || b[0] != 0),
        Op::Select => {
            if a[0] != 0 {
                b
            } else {
                c
            }
        }
        Op::AddC | Op::MulC | Op::Layer => [0; 3],
    }
}

#[inline(always)]
fn arithmetic(op: Op, a: f32, b: f32) -> f32 {
    match op {
        Op::NegF => -a,
        Op::AddF => a + b,
        Op::SubF => a - b,
        Op::MulF => a * b,
        _ => divide(a, b),
    }
}

#[inline(always)]
fn compare(op: Op, a: f32, b: f32) -> bool {
    match op {
        Op::LtF => a < b,
        Op::LeF => a <= b,
        Op::GtF => a > b,
        _ => a >= b,
    }
}

/// [`apply`] where operands and result are one cell each: what is frequent is done on the spot.
#[inline(always)]
pub fn scalar(op: Op, a: u32, b: u32) -> u32 {
    let (x, y) = (f32::from_bits(a), f32::from_bits(b));
    match op {
        Op::AddF => arithmetic(Op::AddF, x, y).to_bits(),
        Op::SubF => arithmetic(Op::SubF, x, y).to_bits(),
        Op::MulF => arithmetic(Op::MulF, x, y).to_bits(),
        Op::DivF => arithmetic(Op::DivF, x, y).to_bits(),
        Op::LtF | Op::LeF | Op::GtF | Op::GeF => u32::from(compare(op, x, y)),
        _ => apply(op, 1, [a, 0, 0], [b, 0, 0], [0; 3])[0],
    }
}

/// [`scalar`] in every lane.
#[inline(always)]
pub fn wide<const L: usize>(op: Op, a: &[u32; L], b: &[u32; L]) -> [u32; L] {
    // What is frequent is decided once, not per lane.
    macro_rules! wide {
        ($($known:ident)*) => {
            match op {
                $( Op::$known => each(a, b, #[inline(always)] |a, b| scalar(Op::$known, a, b)), )*
                _ => each(a, b, |a, b| scalar(op, a, b)),
            }
        };
    }
    wide!(AddF SubF MulF DivF LtF LeF GtF GeF)
}

#[inline(always)]
fn each<const L: usize>(a: &[u32; L], b: &[u32; L], f: impl Fn(u32, u32) -> u32) -> [u32; L] {
    let mut out = [0; L];
    for l in 0..L {
        out[l] = f(a[l], b[l]);
    }
    out
}

/// [`apply`] for arithmetic on the components of triples.
#[inline(always)]
pub fn componentwise(op: Op, a: Cells, b: Cells) -> Cells {
    let each = |op| std::array::from_fn(|k| arithmetic(op, f32::from_bits(a[k]), f32::from_bits(b[k])).to_bits());
    // The operation is decided once, not per component.
    match op {
        Op::AddF => each(Op::AddF),
        Op::SubF => each(Op::SubF),
        Op::MulF => each(Op::MulF),
        _ => apply(op, 3, a, b, [0; 3]),
    }
}

/// Division where anything by zero is zero, as OSL has it.
#[inline(always)]
pub fn divide(a: f32, b: f32) -> f32 {
    if b == 0.0 { 0.0 } else { a / b }
}

/// An index past the end means the last component.
fn component(index: Cells) -> usize {
    (index[0] as i32).clamp(0, 2) as usize
}
