//! exp, ln, sin, cos and atan2 in single precision, as plain arithmetic without branches or tables.
//!
//! One text serves `f32` and the lanes: the compiler turns a loop over it into vector code. Reductions follow Cody &
//! Waite; the polynomials are minimax fits of the usual degrees (Moshier's Cephes). Errors, measured over every
//! exponent in `tests/numbers.rs`: exp and ln 1 ulp, sin and cos 7e-8 absolute for |x| ≤ 8π, atan2 3e-7 absolute.

use std::f32::consts::{FRAC_PI_2, PI};

/// ln 2 = LN_2_HIGH − LN_2_LOW; the first has so few bits that its products with small whole numbers are exact.
const LN_2_HIGH: f32 = 355.0 / 512.0;
const LN_2_LOW: f32 = 2.121_944_4e-4;

/// Adding and subtracting 1.5·2²³ rounds to the nearest integer, which is then found in the sum's lowest bits.
const MAGIC: f32 = 12_582_912.0;

/// eˣ. 0 below −87.3 (no denormals), +∞ above 88.7; NaN stays NaN.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    // x = n·ln 2 + r, |r| ≤ ½ ln 2.
    let clamped = x.clamp(-87.5, 89.0);
    let shifted = clamped * std::f32::consts::LOG2_E + MAGIC;
    let n = shifted - MAGIC;
    let r = clamped - n * LN_2_HIGH + n * LN_2_LOW;
    let r2 = r * r;
    // Pairs of terms side by side: half as long a wait as term after term.
    let p = (1.987_569_2e-4 * r + 1.398_199_9e-3) * r2 + (8.333_452e-3 * r + 4.166_579_6e-2);
    let p = p * r2 + (1.666_666_5e-1 * r + 5.000_000_3e-1);
    let y = times_pow2(p * r2 + r + 1.0, shifted);
    let y = if x < -87.3 { 0.0 } else { y };
    if x > 88.722_84 { f32::INFINITY } else { y }
}

/// 2ˣ: like [`exp`] with |x| times 6e-8 as its relative error. 0 below −126, +∞ from 128.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    let clamped = x.clamp(-126.0, 128.0);
    let shifted = clamped + MAGIC;
    let r = clamped - (shifted - MAGIC);
    let r2 = r * r;
    let p = (1.535_336_2e-4 * r + 1.339_887_4e-3) * r2 + (9.618_437e-3 * r + 5.550_332_7e-2);
    let p = p * r2 + (2.402_264_8e-1 * r + 6.931_472e-1);
    let y = times_pow2(p * r + 1.0, shifted);
    let y = if x < -126.0 { 0.0 } else { y };
    if x >= 128.0 { f32::INFINITY } else { y }
}

/// y·2ⁿ where the result is a normal number and `shifted` is n + [`MAGIC`].
#[inline(always)]
fn times_pow2(y: f32, shifted: f32) -> f32 {
    f32::from_bits(y.to_bits().wrapping_add(shifted.to_bits() << 23))
}

/// x = 2ᵉ·(1 + m), 1 + m in [√½, √2): (e, m), and 2⁻ᵉ.
#[inline(always)]
fn split(x: f32) -> (f32, f32, f32) {
    let shifted = x.to_bits().wrapping_sub(0x3f35_04f3);
    let e = (shifted as i32 >> 23) as f32;
    let m = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(0x3f35_04f3)) - 1.0;
    (e, m, f32::from_bits(0x3f80_0000_u32.wrapping_sub(shifted & 0xff80_0000)))
}

/// (ln(1 + m) − m + m²/2) / m³ for 1 + m in [√½, √2).
#[inline(always)]
fn ln_terms(m: f32) -> f32 {
    let z = m * m;
    let p = (7.037_683_6e-2 * z + (-1.151_461e-1 * m + 1.167_699_9e-1)) * (z * z)
        + ((-1.242_014_1e-1 * m + 1.424_932_3e-1) * z + (-1.666_805_7e-1 * m + 2.000_071_5e-1));
    p * z + (-2.499_999_4e-1 * m + 0.333_333_3)
}

/// Natural logarithm. Below the smallest normal number, and for 0 and negative numbers, that number's logarithm.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    let x = x.max(f32::MIN_POSITIVE);
    let (e, m, _) = split(x);
    let z = m * m;
    let y = m * z * ln_terms(m) - LN_2_LOW * e - 0.5 * z;
    let y = m + y + LN_2_HIGH * e;
    if x == f32::INFINITY { f32::INFINITY } else { y }
}

/// ln(1 + x) for x ≥ 0, precise for small x too.
#[inline(always)]
pub fn ln_1p(x: f32) -> f32 {
    let u = 1.0 + x;
    let (e, m, inv) = split(u);
    // What rounding took from 1 + x, relative to it; at most 6e-8, so that 1/(1 + m) need not be exact.
    let lost = (x - (u - 1.0)) * inv * (1.0 - m);
    let z = m * m;
    let y = m * z * ln_terms(m) - LN_2_LOW * e - 0.5 * z + lost;
    let y = m + y + LN_2_HIGH * e;
    if u == f32::INFINITY { f32::INFINITY } else { y }
}

/// log₂ x. Below the smallest normal number, and for 0 and negative numbers, −126.
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    let x = x.max(f32::MIN_POSITIVE);
    let (e, m, _) = split(x);
    let z = m * m;
    let y = m * z * ln_terms(m) - 0.5 * z;
    let y = (m + y) * std::f32::consts::LOG2_E + e;
    if x == f32::INFINITY { f32::INFINITY } else { y }
}

/// 2²³: from here on every number is whole.
const WHOLE: f32 = 8_388_608.0;

/// The next whole number below; NaN for NaN.
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    let near = ((x.abs() + WHOLE) - WHOLE).copysign(x);
    let below = if near > x { near - 1.0 } else { near };
    if x.abs() < WHOLE { below } else { x }
}

/// [`floor`] of a number in [0, 2²²], for less.
#[inline(always)]
pub(crate) fn whole(x: f32) -> f32 {
    let near = (x + WHOLE) - WHOLE;
    near - if near > x { 1.0 } else { 0.0 }
}

/// A whole number in [0, 2²³) as an index. Anything else: some number below 2²³.
#[inline(always)]
pub fn index(x: f32) -> usize {
    ((x + WHOLE).to_bits() & 0x007f_ffff) as usize
}

/// (sin x, cos x) for |x| ≤ 8π.
#[inline(always)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let shifted = x * std::f32::consts::FRAC_2_PI + MAGIC;
    let n = shifted - MAGIC;
    // π/2 in three parts.
    let r = x - n * 1.570_312_5 - n * 4.837_513e-4 - n * 7.549_79e-8;
    let z = r * r;
    let s = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * r + r;
    let c = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    let q = shifted.to_bits() & 3;
    let (a, b) = if q & 1 == 0 { (s, c) } else { (c, s) };
    let sin = if q & 2 == 0 { a } else { -a };
    let cos = if (q + 1) & 2 == 0 { b } else { -b };
    (sin, cos)
}

/// The angle of (x, y) in [−π, π]; 0 at the origin.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (hi, lo) = if ax > ay { (ax, ay) } else { (ay, ax) };
    let t = lo / hi.max(f32::MIN_POSITIVE);
    // Reduce to |t| ≤ tan(π/8).
    let large = t > 0.414_213_57;
    let r = if large { (t - 1.0) / (t + 1.0) } else { t };
    let z = r * r;
    let p = (((8.053_745e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_294_8e-1) * z * r + r;
    let p = if large { p + std::f32::consts::FRAC_PI_4 } else { p };
    let a = if ay > ax { FRAC_PI_2 - p } else { p };
    let a = if x < 0.0 { PI - a } else { a };
    a.copysign(y)
}
