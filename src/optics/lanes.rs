//! `Real` for f64, f32 and eight f32 side by side.
//!
//! What is read into lanes, and back, is `Lanes`: here for any processor, in `avx` for those with AVX2.

use super::dispatch::Work;
use super::real::{Lift, Real, Scalar};
use super::vec3::V3;
use super::{elementary, octaves};
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

macro_rules! shared_scalar {
    ($t:ty) => {
        #[inline(always)]
        fn c(x: f64) -> Self {
            x as $t
        }
        #[inline(always)]
        fn from_f32(x: f32) -> Self {
            x as $t
        }
        #[inline(always)]
        fn min(self, o: Self) -> Self {
            // One instruction where the standard library's, which looks out for NaN on either side, takes five.
            if self < o { self } else { o }
        }
        #[inline(always)]
        fn max(self, o: Self) -> Self {
            if self > o { self } else { o }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            <$t>::abs(self)
        }
        #[inline(always)]
        fn copysign(self, s: Self) -> Self {
            <$t>::copysign(self, s)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            <$t>::sqrt(self)
        }
        #[inline(always)]
        fn lt(self, o: Self) -> bool {
            self < o
        }
        #[inline(always)]
        fn le(self, o: Self) -> bool {
            self <= o
        }
        #[inline(always)]
        fn any(mask: bool) -> bool {
            mask
        }
        #[inline(always)]
        fn select(mask: bool, a: Self, b: Self) -> Self {
            if mask { a } else { b }
        }
    };
}

impl Real for f64 {
    type Mask = bool;
    type Entry = f64;
    shared_scalar!(f64);
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    #[inline(always)]
    fn by_lane<const N: usize>(values: [Self; N], f: impl Fn([f64; N]) -> [f64; 3]) -> [Self; 3] {
        f(values)
    }
    #[inline(always)]
    fn turned(self, a: f64, o: Self, b: f64) -> Self {
        self * a + o * b
    }
    fn floor(self) -> Self {
        f64::floor(self)
    }
    fn pick(table: &[f32], index: Self) -> Self {
        f64::from(table[index as usize])
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn ln(self) -> Self {
        f64::ln(f64::max(self, f64::MIN_POSITIVE))
    }
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
    #[inline(always)]
    fn gather(table: &[f64], index: f64) -> f64 {
        table[index as usize]
    }
}

impl Real for f32 {
    type Mask = bool;
    type Entry = f32;
    shared_scalar!(f32);
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        // Not `f32::mul_add`: without the instruction it is a slow library call, and the lanes must agree bit for bit.
        self * a + b
    }
    #[inline(always)]
    fn by_lane<const N: usize>(values: [Self; N], f: impl Fn([f64; N]) -> [f64; 3]) -> [Self; 3] {
        // Not `map`, which is a call.
        let mut wide = [0.0; N];
        for (wide, x) in wide.iter_mut().zip(values) {
            *wide = f64::from(x);
        }
        let [x, y, z] = f(wide);
        [x as f32, y as f32, z as f32]
    }
    #[inline(always)]
    fn turned(self, a: f64, o: Self, b: f64) -> Self {
        (f64::from(self) * a + f64::from(o) * b) as f32
    }
    #[inline(always)]
    fn floor(self) -> Self {
        elementary::floor(self)
    }
    #[inline(always)]
    fn whole(self) -> Self {
        elementary::whole(self)
    }
    #[inline(always)]
    fn pick(table: &[f32], index: Self) -> Self {
        <f32 as Real>::gather(table, index)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        elementary::ln(self)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        elementary::ln_1p(self)
    }
    #[inline(always)]
    fn powf(self, y: Self) -> Self {
        elementary::exp2(y * elementary::log2(self))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }
    #[inline(always)]
    fn sin_cos_of_turns(self) -> (Self, Self) {
        elementary::sin_cos_of_turns(self)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        elementary::atan2(self, x)
    }
    #[inline(always)]
    fn gather(table: &[f32], index: f32) -> f32 {
        // No panic in sight: a loop over this becomes vector code.
        table.get(elementary::index(index)).copied().unwrap_or(0.0)
    }
    #[inline(always)]
    fn run<const N: usize>(table: &[f32], index: f32) -> [f32; N] {
        // One comparison: an index is far from the largest number.
        let start = elementary::index(index);
        let run = table.get(start..start + N).and_then(|run| run.first_chunk());
        run.copied().unwrap_or([0.0; N])
    }
    #[inline(always)]
    fn octaves<const OCTAVES: u32, const DIGITS: i32, const CELLS: usize, const WIDTH: usize>(
        table: &[[f32; WIDTH]; CELLS],
        x: f32,
    ) -> Option<([f32; WIDTH], f32)> {
        let (cell, t) = octaves::place::<OCTAVES, DIGITS, f32>(x);
        Some((table[cell as usize & (CELLS - 1)], t))
    }
}

impl Scalar for f64 {
    fn to_f64(self) -> f64 {
        self
    }
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
}

impl Scalar for f32 {
    const SINGLE: bool = true;
    fn to_f64(self) -> f64 {
        self as f64
    }
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
}

/// Eight `f32`, computed together.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct F32x8(pub [f32; 8]);

/// Eight `f32` side by side, whatever they are kept in.
pub(crate) trait Lanes: Real<Entry = f32> + Lift<f32> + Lift<F32x8> {
    /// Whether they are the processor's own vectors.
    const VECTORS: bool;
    /// Three columns of eight rows.
    fn load(rows: &[[f32; 3]; 8]) -> V3<Self>;
    /// Eight rows of four columns.
    fn store(columns: [Self; 4]) -> [[f32; 4]; 8];
    /// Does `work` in a function of its own, compiled for these lanes: compilers take long over functions that are long.
    fn apart<W: Work>(work: W) -> W::Output;
}

impl Lanes for F32x8 {
    const VECTORS: bool = false;
    #[inline(always)]
    fn load(rows: &[[f32; 3]; 8]) -> V3<Self> {
        let column = |c: usize| F32x8(std::array::from_fn(|i| rows[i][c]));
        V3::new(column(0), column(1), column(2))
    }
    #[inline(always)]
    fn store(columns: [Self; 4]) -> [[f32; 4]; 8] {
        std::array::from_fn(|i| columns.map(|c| c.0[i]))
    }
    #[inline(never)]
    fn apart<W: Work>(work: W) -> W::Output {
        work.run()
    }
}

/// One truth value per lane of [`F32x8`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mask8(pub [bool; 8]);

impl F32x8 {
    /// How many there are.
    pub const LANES: usize = 8;

    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        F32x8(std::array::from_fn(|i| f(self.0[i])))
    }
    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        F32x8(std::array::from_fn(|i| f(self.0[i], o.0[i])))
    }
    #[inline(always)]
    fn test(self, o: Self, f: impl Fn(f32, f32) -> bool) -> Mask8 {
        Mask8(std::array::from_fn(|i| f(self.0[i], o.0[i])))
    }
}

macro_rules! lane_ops {
    ($($trait:ident $method:ident),*) => { $(
        impl $trait for F32x8 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, f32::$method)
            }
        }
    )* };
}
lane_ops!(Add add, Sub sub, Mul mul, Div div);

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}
impl AddAssign for F32x8 {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl SubAssign for F32x8 {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
impl MulAssign for F32x8 {
    #[inline(always)]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}
impl BitAnd for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Mask8(std::array::from_fn(|i| self.0[i] & o.0[i]))
    }
}
impl BitOr for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Mask8(std::array::from_fn(|i| self.0[i] | o.0[i]))
    }
}
impl Not for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Mask8(self.0.map(|x| !x))
    }
}

impl Real for F32x8 {
    type Mask = Mask8;
    type Entry = f32;
    const WIDE: bool = true;

    #[inline(always)]
    fn c(x: f64) -> Self {
        F32x8([x as f32; 8])
    }
    #[inline(always)]
    fn from_f32(x: f32) -> Self {
        F32x8([x; 8])
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        self.zip(o, <f32 as Real>::min)
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        self.zip(o, <f32 as Real>::max)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f32::abs)
    }
    #[inline(always)]
    fn copysign(self, s: Self) -> Self {
        self.zip(s, f32::copysign)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        self.map(elementary::floor)
    }
    #[inline(always)]
    fn whole(self) -> Self {
        self.map(elementary::whole)
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    fn by_lane<const N: usize>(values: [Self; N], f: impl Fn([f64; N]) -> [f64; 3]) -> [Self; 3] {
        let mut out = [F32x8([0.0; 8]); 3];
        for lane in 0..8 {
            let [x, y, z] = f(values.map(|v| f64::from(v.0[lane])));
            [out[0].0[lane], out[1].0[lane], out[2].0[lane]] = [x as f32, y as f32, z as f32];
        }
        out
    }
    #[inline(always)]
    fn turned(self, a: f64, o: Self, b: f64) -> Self {
        self.zip(o, |x, y| x.turned(a, y, b))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.map(elementary::exp)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        self.map(elementary::ln)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        self.map(elementary::ln_1p)
    }
    #[inline(always)]
    fn powf(self, y: Self) -> Self {
        self.zip(y, <f32 as Real>::powf)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let both = self.0.map(elementary::sin_cos);
        (F32x8(both.map(|b| b.0)), F32x8(both.map(|b| b.1)))
    }
    fn sin_cos_of_turns(self) -> (Self, Self) {
        let both = self.0.map(elementary::sin_cos_of_turns);
        (F32x8(both.map(|b| b.0)), F32x8(both.map(|b| b.1)))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        self.zip(x, elementary::atan2)
    }
    #[inline(always)]
    fn lt(self, o: Self) -> Mask8 {
        self.test(o, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, o: Self) -> Mask8 {
        self.test(o, |a, b| a <= b)
    }
    #[inline(always)]
    fn any(mask: Mask8) -> bool {
        mask.0.iter().any(|m| *m)
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        F32x8(std::array::from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn pick(table: &[f32], index: Self) -> Self {
        index.map(|i| <f32 as Real>::gather(table, i))
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Self) -> Self {
        index.map(|i| <f32 as Real>::gather(table, i))
    }
    #[inline(always)]
    fn octaves<const OCTAVES: u32, const DIGITS: i32, const CELLS: usize, const WIDTH: usize>(
        table: &[[f32; WIDTH]; CELLS],
        x: Self,
    ) -> Option<([Self; WIDTH], Self)> {
        let (mut rows, mut t) = ([F32x8([0.0; 8]); WIDTH], F32x8([0.0; 8]));
        for k in 0..8 {
            let (cell, place) = octaves::place::<OCTAVES, DIGITS, f32>(x.0[k]);
            let row = &table[cell as usize & (CELLS - 1)];
            t.0[k] = place;
            for (column, number) in rows.iter_mut().zip(row) {
                column.0[k] = *number;
            }
        }
        Some((rows, t))
    }
    /// In three loops: the one in the middle, which reads, cannot become vector code, and would keep the rest from it.
    #[inline(always)]
    fn quartic(table: &[f32], cells: f32, x: Self) -> Self {
        let (mut first, mut part) = ([0; 8], [0.0; 8]);
        for k in 0..8 {
            let place = Real::clamp(x.0[k], 0.0, 1.0).sqrt().sqrt() * cells;
            let i = Real::min(Real::whole(place), cells - 1.0);
            (first[k], part[k]) = (elementary::index(i) as u32, place - i);
        }
        let (mut a, mut b) = ([0.0; 8], [0.0; 8]);
        if let Some(pairs) = table.len().checked_sub(1) {
            // Of one length, so that one look at it does for both.
            let (low, high) = (&table[..pairs], &table[1..][..pairs]);
            for k in 0..8 {
                if let (Some(low), Some(high)) = (low.get(first[k] as usize), high.get(first[k] as usize)) {
                    (a[k], b[k]) = (*low, *high);
                }
            }
        }
        let mut out = [0.0; 8];
        for k in 0..8 {
            out[k] = if x.0[k] > 0.0 { (b[k] - a[k]) * part[k] + a[k] } else { 0.0 };
        }
        F32x8(out)
    }
}

impl Lift<f32> for F32x8 {
    #[inline(always)]
    fn lift(s: f32) -> Self {
        F32x8([s; 8])
    }
}

impl Lift<F32x8> for F32x8 {
    #[inline(always)]
    fn lift(s: F32x8) -> Self {
        s
    }
}

impl Lift<f32> for f32 {
    #[inline(always)]
    fn lift(s: f32) -> Self {
        s
    }
}

impl Lift<f64> for f64 {
    #[inline(always)]
    fn lift(s: f64) -> Self {
        s
    }
}
