//! exp, ln, sin, cos and atan2 in single precision, as plain arithmetic without branches or tables.
//!
//! One text serves `f32` and vectors of it. Reductions follow Cody & Waite; the polynomials are minimax fits of the usual
//! degrees (Moshier's Cephes). Errors, measured over every exponent in `tests/lobes/numbers.rs`: exp and ln 1 ulp, sin and cos
//! 7e-8 absolute for |x| ≤ 8π, atan2 3e-7 absolute.

use super::Real;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, LOG2_E, PI};

/// Single precision, one number or several side by side, whose bits can be worked on.
pub trait Single: Real {
    /// As many words of 32 bits.
    type Bits: Bits;

    /// IEEE 754's bits.
    fn to_bits(self) -> Self::Bits;
    /// The number with these bits.
    fn from_bits(bits: Self::Bits) -> Self;
    /// Words as signed whole numbers.
    fn whole_number(bits: Self::Bits) -> Self;
    /// Whether the top bit is set.
    fn top_bit(bits: Self::Bits) -> Self::Mask;
}

/// Words of 32 bits.
pub trait Bits: Copy {
    /// The same in every lane.
    fn of(word: u32) -> Self;
    /// Modulo 2³².
    fn plus(self, o: Self) -> Self;
    /// Modulo 2³².
    fn minus(self, o: Self) -> Self;
    /// Bitwise and.
    fn and(self, o: Self) -> Self;
    /// Bitwise or.
    fn or(self, o: Self) -> Self;
    /// Up by `N` bits.
    fn up<const N: i32>(self) -> Self;
    /// Down by `N` bits, zeros coming in.
    fn down<const N: i32>(self) -> Self;
    /// Down by `N` bits, the top bit coming in.
    fn down_signed<const N: i32>(self) -> Self;
}

impl Bits for u32 {
    #[inline(always)]
    fn of(word: u32) -> Self {
        word
    }
    #[inline(always)]
    fn plus(self, o: Self) -> Self {
        self.wrapping_add(o)
    }
    #[inline(always)]
    fn minus(self, o: Self) -> Self {
        self.wrapping_sub(o)
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        self & o
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        self | o
    }
    #[inline(always)]
    fn up<const N: i32>(self) -> Self {
        self << N
    }
    #[inline(always)]
    fn down<const N: i32>(self) -> Self {
        self >> N
    }
    #[inline(always)]
    fn down_signed<const N: i32>(self) -> Self {
        (self as i32 >> N) as u32
    }
}

impl Single for f32 {
    type Bits = u32;
    #[inline(always)]
    fn to_bits(self) -> u32 {
        f32::to_bits(self)
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> f32 {
        f32::from_bits(bits)
    }
    #[inline(always)]
    fn whole_number(bits: u32) -> f32 {
        bits as i32 as f32
    }
    #[inline(always)]
    fn top_bit(bits: u32) -> bool {
        bits >> 31 != 0
    }
}

/// ln 2 = LN_2_HIGH − LN_2_LOW; the first has so few bits that its products with small whole numbers are exact.
const LN_2_HIGH: f32 = 355.0 / 512.0;
const LN_2_LOW: f32 = 2.121_944_4e-4;

/// Adding and subtracting 1.5·2²³ rounds to the nearest integer, which is then found in the sum's lowest bits.
const MAGIC: f32 = 12_582_912.0;

/// A constant.
#[inline(always)]
fn k<R: Real>(x: f32) -> R {
    R::from_f32(x)
}

/// eˣ. 0 below −87.3 (no denormals), +∞ above 88.7; NaN stays NaN.
#[inline(always)]
pub fn exp<R: Single>(x: R) -> R {
    // x = n·ln 2 + r, |r| ≤ ½ ln 2. In this order NaN goes through.
    let clamped = k::<R>(89.0).min(k::<R>(-87.5).max(x));
    let shifted = clamped * k(LOG2_E) + k(MAGIC);
    let n = shifted - k(MAGIC);
    let r = clamped - n * k(LN_2_HIGH) + n * k(LN_2_LOW);
    let r2 = r * r;
    // Pairs of terms side by side: half as long a wait as term after term.
    let p = (k::<R>(1.987_569_2e-4) * r + k(1.398_199_9e-3)) * r2 + (k::<R>(8.333_452e-3) * r + k(4.166_579_6e-2));
    let p = p * r2 + (k::<R>(1.666_666_5e-1) * r + k(5.000_000_3e-1));
    let y = times_pow2(p * r2 + r + k(1.0), shifted);
    let y = R::select(x.lt(k(-87.3)), R::zero(), y);
    R::select(x.gt(k(88.722_84)), k(f32::INFINITY), y)
}

/// 2ˣ: like [`exp`] with |x| times 6e-8 as its relative error. 0 below −126, +∞ from 128.
#[inline(always)]
pub fn exp2<R: Single>(x: R) -> R {
    let clamped = k::<R>(128.0).min(k::<R>(-126.0).max(x));
    let shifted = clamped + k(MAGIC);
    let r = clamped - (shifted - k(MAGIC));
    let r2 = r * r;
    let p = (k::<R>(1.535_336_2e-4) * r + k(1.339_887_4e-3)) * r2 + (k::<R>(9.618_437e-3) * r + k(5.550_332_7e-2));
    let p = p * r2 + (k::<R>(2.402_264_8e-1) * r + k(6.931_472e-1));
    let y = times_pow2(p * r + k(1.0), shifted);
    let y = R::select(x.lt(k(-126.0)), R::zero(), y);
    R::select(x.ge(k(128.0)), k(f32::INFINITY), y)
}

/// y·2ⁿ where the result is a normal number and `shifted` is n + [`MAGIC`].
#[inline(always)]
fn times_pow2<R: Single>(y: R, shifted: R) -> R {
    R::from_bits(y.to_bits().plus(shifted.to_bits().up::<23>()))
}

/// x = 2ᵉ·(1 + m), 1 + m in [√½, √2): (e, m), and 2⁻ᵉ.
#[inline(always)]
fn split<R: Single>(x: R) -> (R, R, R) {
    let word = R::Bits::of;
    let shifted = x.to_bits().minus(word(0x3f35_04f3));
    let e = R::whole_number(shifted.down_signed::<23>());
    let m = R::from_bits(shifted.and(word(0x007f_ffff)).plus(word(0x3f35_04f3))) - k(1.0);
    (e, m, R::from_bits(word(0x3f80_0000).minus(shifted.and(word(0xff80_0000)))))
}

/// (ln(1 + m) − m + m²/2) / m³ for 1 + m in [√½, √2).
#[inline(always)]
fn ln_terms<R: Real>(m: R) -> R {
    let z = m * m;
    let p = (k::<R>(7.037_683_6e-2) * z + (k::<R>(-1.151_461e-1) * m + k(1.167_699_9e-1))) * (z * z)
        + ((k::<R>(-1.242_014_1e-1) * m + k(1.424_932_3e-1)) * z + (k::<R>(-1.666_805_7e-1) * m + k(2.000_071_5e-1)));
    p * z + (k::<R>(-2.499_999_4e-1) * m + k(0.333_333_3))
}

/// Natural logarithm. Below the smallest normal number, and for 0 and negative numbers, that number's logarithm.
#[inline(always)]
pub fn ln<R: Single>(x: R) -> R {
    let x = x.max(k(f32::MIN_POSITIVE));
    let (e, m, _) = split(x);
    let z = m * m;
    let y = m * z * ln_terms(m) - k::<R>(LN_2_LOW) * e - k::<R>(0.5) * z;
    let y = m + y + k::<R>(LN_2_HIGH) * e;
    R::select(x.lt(k(f32::INFINITY)), y, k(f32::INFINITY))
}

/// ln(1 + x) for x ≥ 0, precise for small x too.
#[inline(always)]
pub fn ln_1p<R: Single>(x: R) -> R {
    let u = k::<R>(1.0) + x;
    let (e, m, inv) = split(u);
    // What rounding took from 1 + x, relative to it; at most 6e-8, so that 1/(1 + m) need not be exact.
    let lost = (x - (u - k(1.0))) * inv * (k::<R>(1.0) - m);
    let z = m * m;
    let y = m * z * ln_terms(m) - k::<R>(LN_2_LOW) * e - k::<R>(0.5) * z + lost;
    let y = m + y + k::<R>(LN_2_HIGH) * e;
    R::select(u.ge(k(f32::INFINITY)), k(f32::INFINITY), y)
}

/// log₂ x. Below the smallest normal number, and for 0 and negative numbers, −126.
#[inline(always)]
pub fn log2<R: Single>(x: R) -> R {
    let x = x.max(k(f32::MIN_POSITIVE));
    let (e, m, _) = split(x);
    let z = m * m;
    let y = m * z * ln_terms(m) - k::<R>(0.5) * z;
    let y = (m + y) * k(LOG2_E) + e;
    R::select(x.lt(k(f32::INFINITY)), y, k(f32::INFINITY))
}

/// 2²³: from here on every number is whole.
pub(crate) const WHOLE: f32 = 8_388_608.0;

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
    indices(x) as usize
}

/// [`index`] of every lane.
#[inline(always)]
pub(crate) fn indices<R: Single>(x: R) -> R::Bits {
    (x + k(WHOLE)).to_bits().and(R::Bits::of(0x007f_ffff))
}

/// (sin x, cos x) for |x| ≤ 8π.
#[inline(always)]
pub fn sin_cos<R: Single>(x: R) -> (R, R) {
    let shifted = x * k(std::f32::consts::FRAC_2_PI) + k(MAGIC);
    let n = shifted - k(MAGIC);
    // π/2 in three parts.
    let r = x - n * k(1.570_312_5) - n * k(4.837_513e-4) - n * k(7.549_79e-8);
    in_quadrant(r, shifted.to_bits())
}

/// Sine and cosine of 2πu, for |u| up to 4: the quarter turns come off exactly.
#[inline(always)]
pub fn sin_cos_of_turns<R: Single>(u: R) -> (R, R) {
    let quarters = u * k(4.0);
    let shifted = quarters + k(MAGIC);
    in_quadrant((quarters - (shifted - k(MAGIC))) * k(FRAC_PI_2), shifted.to_bits())
}

/// Sine and cosine of `r` in [−π/4, π/4] and as many quarter turns as the last two bits of `q` say.
#[inline(always)]
fn in_quadrant<R: Single>(r: R, q: R::Bits) -> (R, R) {
    let z = r * r;
    let s = ((k::<R>(-1.951_529_6e-4) * z + k(8.332_161e-3)) * z - k(1.666_665_5e-1)) * z * r + r;
    let c =
        ((k::<R>(2.443_315_7e-5) * z - k(1.388_731_6e-3)) * z + k(4.166_664_6e-2)) * z * z - k::<R>(0.5) * z + k(1.0);
    // By bits, because a quadrant is a matter of chance: the processor would guess wrong half of the time.
    let top = R::Bits::of(1 << 31);
    let (s, c) = (s.to_bits(), c.to_bits());
    // Exchanged in odd quadrants.
    let step = c.minus(s).and(q.up::<31>().down_signed::<31>());
    let flipped = |x: R::Bits, q: R::Bits| R::from_bits(x.plus(q.up::<30>().and(top)));
    (flipped(s.plus(step), q), flipped(c.minus(step), q.plus(R::Bits::of(1))))
}

/// The angle of (x, y) in [−π, π]; 0 at the origin.
#[inline(always)]
pub fn atan2<R: Real>(y: R, x: R) -> R {
    let (ax, ay) = (x.abs(), y.abs());
    let steep = !ax.gt(ay);
    let (hi, lo) = (R::select(steep, ay, ax), R::select(steep, ax, ay));
    let t = lo / hi.max(k(f32::MIN_POSITIVE));
    // Reduce to |t| ≤ tan(π/8).
    let large = t.gt(k(0.414_213_57));
    let r = R::select(large, (t - k(1.0)) / (t + k(1.0)), t);
    let z = r * r;
    let p =
        (((k::<R>(8.053_745e-2) * z - k(1.387_768_6e-1)) * z + k(1.997_771_1e-1)) * z - k(3.333_294_8e-1)) * z * r + r;
    let p = R::select(large, p + k(FRAC_PI_4), p);
    let a = R::select(ay.gt(ax), k::<R>(FRAC_PI_2) - p, p);
    let a = R::select(x.lt(R::zero()), k::<R>(PI) - a, a);
    a.copysign(y)
}
