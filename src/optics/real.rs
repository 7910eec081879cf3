//! The number types lobe maths is written over.
//!
//! One source text of every formula serves three evaluators: `f64` (the reference), `f32` (the standard tier) and
//! [`F32x8`](super::lanes::F32x8) (batches). [`Real`] is what that text may use: arithmetic, a handful of functions,
//! comparisons that give a mask, and `select` in place of `if`. `f32` and the lanes share one `exp`, `ln`, `sin`
//! and `atan2` (see [`super::elementary`]), so a batch gives bit for bit what the scalar call gives.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

/// A real number, or several side by side.
pub trait Real:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Lift<Self>
    + Lift<Self::Entry>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// The outcome of a comparison, one truth value per lane.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;

    /// What tables hold that are read in this type: a single number.
    type Entry: Scalar;

    /// Whether it is several numbers. What is called, not inlined, is not compiled for the vectors they are kept in.
    const WIDE: bool = false;

    /// A constant, rounded to this type.
    fn c(x: f64) -> Self;
    /// A script value, taken as it is.
    fn from_f32(x: f32) -> Self;

    /// The smaller of the two; `o` if either is NaN.
    fn min(self, o: Self) -> Self;
    /// The larger of the two; `o` if either is NaN.
    fn max(self, o: Self) -> Self;
    /// The value without its sign.
    fn abs(self) -> Self;
    /// `self` with the sign of `s`.
    fn copysign(self, s: Self) -> Self;
    /// Square root; NaN of a negative number.
    fn sqrt(self) -> Self;
    /// The next whole number below.
    fn floor(self) -> Self;
    /// [`floor`](Self::floor) of a number in [0, 2²²], for less: the cell of a table.
    #[inline(always)]
    fn whole(self) -> Self {
        self.floor()
    }
    /// `self·a + b`, fused where the machine fuses.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `self·a + o·b` with double-precision constants, rounded once: keeps its digits where the two products cancel.
    fn turned(self, a: f64, o: Self, b: f64) -> Self;
    /// eˣ; 0 below the range of the type, +∞ above it.
    fn exp(self) -> Self;
    /// Natural logarithm of a positive number; of 0 or less: a large negative finite number.
    fn ln(self) -> Self;
    /// Sine and cosine, for |x| up to 8π.
    fn sin_cos(self) -> (Self, Self);
    /// Sine and cosine of as many turns, 2π times this; for up to 4 of them.
    fn sin_cos_of_turns(self) -> (Self, Self) {
        (self * Self::c(core::f64::consts::TAU)).sin_cos()
    }
    /// The angle of (x, y), in [−π, π]; 0 at the origin.
    fn atan2(self, x: Self) -> Self;

    /// self < o.
    fn lt(self, o: Self) -> Self::Mask;
    /// self ≤ o.
    fn le(self, o: Self) -> Self::Mask;
    /// self > o.
    #[inline(always)]
    fn gt(self, o: Self) -> Self::Mask {
        o.lt(self)
    }
    /// self ≥ o.
    #[inline(always)]
    fn ge(self, o: Self) -> Self::Mask {
        o.le(self)
    }
    /// Whether the mask is set anywhere: work that nobody would see can be left out.
    fn any(mask: Self::Mask) -> bool;
    /// `a` where the mask is set, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;

    /// xʸ for x ≥ 0, as exp(y·ln x) in one base or another. 0⁰ = 1.
    #[inline(always)]
    fn powf(self, y: Self) -> Self {
        (y * self.ln()).exp()
    }
    /// ln(1 + x) for x ≥ 0, precise for small x too.
    #[inline(always)]
    fn ln_1p(self) -> Self {
        // Kahan: the rounding of 1 + x is divided out again.
        let u = Self::one() + self;
        let d = u - Self::one();
        Self::select(d.gt(Self::zero()), u.ln() * (self / d), self)
    }
    /// `table[index]` of a committed table; `index` holds whole numbers inside it.
    fn pick(table: &[f32], index: Self) -> Self;
    /// `table[index]` per lane; `index` holds whole numbers inside the table (beyond it: some finite number).
    fn gather(table: &[Self::Entry], index: Self) -> Self;

    /// `N` entries of `table` from `index` on; see [`gather`](Self::gather).
    #[inline(always)]
    fn run<const N: usize>(table: &[Self::Entry], index: Self) -> [Self; N] {
        array(|k| Self::gather(table, index + Self::c(k as f64)))
    }

    /// What a table of `octaves` holds for `x`, |x| ≤ 1: a row of its `CELLS`, 2^`DIGITS` to each of
    /// `OCTAVES` octaves below 1, and where in the cell `x` lies. `None` if the type has more digits than such a table.
    #[inline(always)]
    fn octaves<const OCTAVES: u32, const DIGITS: i32, const CELLS: usize, const WIDTH: usize>(
        table: &[[f32; WIDTH]; CELLS],
        x: Self,
    ) -> Option<([Self; WIDTH], Self)> {
        let _ = (table, x);
        None
    }

    /// A table whose entries stand for x = (k/`cells`)⁴, linearly between them; 0 where `x` is not above 0.
    #[inline(always)]
    fn quartic(table: &[Self::Entry], cells: Self::Entry, x: Self) -> Self {
        let cells = <Self as Lift<Self::Entry>>::lift(cells);
        let place = x.clamp(Self::zero(), Self::one()).sqrt().sqrt() * cells;
        let i = place.whole().min(cells - Self::one());
        Self::select(x.gt(Self::zero()), Self::between(table, i, place - i), Self::zero())
    }

    /// `table` at `at` + `t`, linearly: `at` a whole number below the last place, `t` in [0, 1].
    #[inline(always)]
    fn between(table: &[Self::Entry], at: Self, t: Self) -> Self {
        let [a, b] = Self::run(table, at);
        (b - a).mul_add(t, a)
    }

    /// Applies a function of doubles lane by lane: for formulas that come from outside.
    fn by_lane<const N: usize>(values: [Self; N], f: impl Fn([f64; N]) -> [f64; 3]) -> [Self; 3];
    /// x² .
    #[inline(always)]
    fn sq(self) -> Self {
        self * self
    }
    /// `self` limited to `[lo, hi]`; NaN becomes `lo`.
    #[inline(always)]
    fn clamp(self, lo: Self, hi: Self) -> Self {
        self.max(lo).min(hi)
    }
    /// Square root of a number that rounding may have pushed below zero.
    #[inline(always)]
    fn safe_sqrt(self) -> Self {
        self.max(Self::c(0.0)).sqrt()
    }
    /// 0.
    #[inline(always)]
    fn zero() -> Self {
        Self::c(0.0)
    }
    /// 1.
    #[inline(always)]
    fn one() -> Self {
        Self::c(1.0)
    }
}

/// One number type for a single value, as opposed to lanes: what a BSDF is built in.
pub trait Scalar: Real<Mask = bool, Entry = Self> + PartialOrd + Default {
    /// Whether it is single precision, which tables of `octaves` are for.
    const SINGLE: bool = false;
    /// In double precision.
    fn to_f64(self) -> f64;
    /// In single precision.
    fn to_f32(self) -> f32 {
        self.to_f64() as f32
    }
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;
}

/// Brings what a lobe stores into the type a formula is evaluated in: a lobe prepared in `f32` evaluates over lanes.
pub trait Lift<S>: Sized {
    /// The same value in every lane.
    fn lift(s: S) -> Self;
}

/// What a formula is evaluated in whose lobe was prepared in `S`, with tables that both can read.
pub trait Over<S: Real>: Real<Entry = S::Entry> + Lift<S> {}

impl<S: Real, L: Real<Entry = S::Entry> + Lift<S>> Over<S> for L {}

/// `f` of 0, 1, …, as an array: `std::array::from_fn` in words that leave no call behind.
#[inline(always)]
pub fn array<R: Real, const N: usize>(f: impl Fn(usize) -> R) -> [R; N] {
    let mut out = [R::zero(); N];
    for i in 0..N {
        out[i] = f(i);
    }
    out
}

/// Three channels: `rgb!(c => expression in c)`. No closure, because those cannot be told to be inlined.
macro_rules! rgb {
    ($c:ident => $e:expr) => {
        [
            {
                let $c = 0usize;
                $e
            },
            {
                let $c = 1usize;
                $e
            },
            {
                let $c = 2usize;
                $e
            },
        ]
    };
}
pub(crate) use rgb;

/// `values` brought into another type; see [`array()`].
#[inline(always)]
pub fn lifted<S: Copy, L: Real + Lift<S>, const N: usize>(values: [S; N]) -> [L; N] {
    array(|i| L::lift(values[i]))
}
