//! Eight `f32` in one AVX register: what batches are worked out in where the processor has AVX2.
//!
//! Every operation is the one that `f32` does, lane by lane – no fused multiply-add, no reciprocal estimates – so that a
//! batch gives bit for bit what single calls give.
//!
//! [`Avx`] is only used inside [`dispatch::lanes`](super::dispatch::lanes), which has asked the processor first: that is
//! what every `unsafe` block here relies on. All is `#[inline(always)]`, because a function that is not compiled for AVX2
//! would call each instruction.
#![allow(unsafe_code)]

use super::dispatch::Work;
use super::elementary::{self, Bits, Single};
use super::lanes::{F32x8, Lanes};
use super::octaves;
use super::real::{Lift, Real};
use super::vec3::V3;
use core::arch::x86_64::*;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

/// Eight numbers.
#[derive(Clone, Copy, Debug)]
pub struct Avx(__m256);

/// Eight truth values: all bits of a lane, or none.
#[derive(Clone, Copy, Debug)]
pub struct AvxMask(__m256);

/// Eight words.
#[derive(Clone, Copy, Debug)]
pub struct AvxBits(__m256i);

/// One instruction, or a few.
macro_rules! avx {
    ($e:expr) => {
        // SAFETY: only used where the processor is known to have AVX2; see the top of this file. Pointers among the
        // arguments come from references to as many numbers as the instruction reads or writes.
        unsafe { $e }
    };
}

impl Avx {
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        let mut out = [0.0; 8];
        avx!(_mm256_storeu_ps(out.as_mut_ptr(), self.0));
        out
    }
    #[inline(always)]
    fn from_array(x: &[f32; 8]) -> Self {
        Avx(avx!(_mm256_loadu_ps(x.as_ptr())))
    }
}

impl AvxBits {
    #[inline(always)]
    fn to_array(self) -> [u32; 8] {
        let mut out = [0; 8];
        avx!(_mm256_storeu_si256(out.as_mut_ptr().cast(), self.0));
        out
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident $instruction:ident, $assign:ident $assign_method:ident);*) => { $(
        impl $trait for Avx {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                Avx(avx!($instruction(self.0, o.0)))
            }
        }
        impl $assign for Avx {
            #[inline(always)]
            fn $assign_method(&mut self, o: Self) {
                *self = $trait::$method(*self, o);
            }
        }
    )* };
}
operators!(
    Add add _mm256_add_ps, AddAssign add_assign;
    Sub sub _mm256_sub_ps, SubAssign sub_assign;
    Mul mul _mm256_mul_ps, MulAssign mul_assign
);

impl Div for Avx {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        Avx(avx!(_mm256_div_ps(self.0, o.0)))
    }
}
impl Neg for Avx {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Avx(avx!(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))))
    }
}
impl BitAnd for AvxMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        AvxMask(avx!(_mm256_and_ps(self.0, o.0)))
    }
}
impl BitOr for AvxMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        AvxMask(avx!(_mm256_or_ps(self.0, o.0)))
    }
}
impl Not for AvxMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        AvxMask(avx!(_mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))))
    }
}

impl Bits for AvxBits {
    #[inline(always)]
    fn of(word: u32) -> Self {
        AvxBits(avx!(_mm256_set1_epi32(word as i32)))
    }
    #[inline(always)]
    fn plus(self, o: Self) -> Self {
        AvxBits(avx!(_mm256_add_epi32(self.0, o.0)))
    }
    #[inline(always)]
    fn minus(self, o: Self) -> Self {
        AvxBits(avx!(_mm256_sub_epi32(self.0, o.0)))
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        AvxBits(avx!(_mm256_and_si256(self.0, o.0)))
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        AvxBits(avx!(_mm256_or_si256(self.0, o.0)))
    }
    #[inline(always)]
    fn up<const N: i32>(self) -> Self {
        AvxBits(avx!(_mm256_slli_epi32::<N>(self.0)))
    }
    #[inline(always)]
    fn down<const N: i32>(self) -> Self {
        AvxBits(avx!(_mm256_srli_epi32::<N>(self.0)))
    }
    #[inline(always)]
    fn down_signed<const N: i32>(self) -> Self {
        AvxBits(avx!(_mm256_srai_epi32::<N>(self.0)))
    }
}

impl Single for Avx {
    type Bits = AvxBits;
    #[inline(always)]
    fn to_bits(self) -> AvxBits {
        AvxBits(avx!(_mm256_castps_si256(self.0)))
    }
    #[inline(always)]
    fn from_bits(bits: AvxBits) -> Self {
        Avx(avx!(_mm256_castsi256_ps(bits.0)))
    }
    #[inline(always)]
    fn whole_number(bits: AvxBits) -> Self {
        Avx(avx!(_mm256_cvtepi32_ps(bits.0)))
    }
    #[inline(always)]
    fn top_bit(bits: AvxBits) -> AvxMask {
        AvxMask(avx!(_mm256_castsi256_ps(_mm256_srai_epi32::<31>(bits.0))))
    }
}

impl Real for Avx {
    type Mask = AvxMask;
    type Entry = f32;
    const WIDE: bool = true;

    #[inline(always)]
    fn c(x: f64) -> Self {
        Self::from_f32(x as f32)
    }
    #[inline(always)]
    fn from_f32(x: f32) -> Self {
        Avx(avx!(_mm256_set1_ps(x)))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Avx(avx!(_mm256_min_ps(self.0, o.0)))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Avx(avx!(_mm256_max_ps(self.0, o.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Avx(avx!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn copysign(self, s: Self) -> Self {
        let sign = avx!(_mm256_and_ps(_mm256_set1_ps(-0.0), s.0));
        Avx(avx!(_mm256_or_ps(self.abs().0, sign)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Avx(avx!(_mm256_sqrt_ps(self.0)))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Avx(avx!(_mm256_floor_ps(self.0)))
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    #[inline(always)]
    fn turned(self, a: f64, o: Self, b: f64) -> Self {
        let half = |x: __m128, y: __m128| {
            avx!({
                let x = _mm256_mul_pd(_mm256_cvtps_pd(x), _mm256_set1_pd(a));
                let y = _mm256_mul_pd(_mm256_cvtps_pd(y), _mm256_set1_pd(b));
                _mm256_cvtpd_ps(_mm256_add_pd(x, y))
            })
        };
        let low = half(avx!(_mm256_castps256_ps128(self.0)), avx!(_mm256_castps256_ps128(o.0)));
        let high = half(avx!(_mm256_extractf128_ps::<1>(self.0)), avx!(_mm256_extractf128_ps::<1>(o.0)));
        Avx(avx!(_mm256_set_m128(high, low)))
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
    fn lt(self, o: Self) -> AvxMask {
        AvxMask(avx!(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn le(self, o: Self) -> AvxMask {
        AvxMask(avx!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn any(mask: AvxMask) -> bool {
        avx!(_mm256_movemask_ps(mask.0)) != 0
    }
    #[inline(always)]
    fn select(mask: AvxMask, a: Self, b: Self) -> Self {
        Avx(avx!(_mm256_blendv_ps(b.0, a.0, mask.0)))
    }
    #[inline(always)]
    fn by_lane<const N: usize>(values: [Self; N], f: impl Fn([f64; N]) -> [f64; 3]) -> [Self; 3] {
        let mut lanes = [[0.0; 8]; N];
        for (lanes, v) in lanes.iter_mut().zip(&values) {
            *lanes = v.to_array();
        }
        let mut out = [[0.0; 8]; 3];
        for i in 0..8 {
            let mut wide = [0.0; N];
            for (wide, lanes) in wide.iter_mut().zip(&lanes) {
                *wide = f64::from(lanes[i]);
            }
            let [x, y, z] = f(wide);
            [out[0][i], out[1][i], out[2][i]] = [x as f32, y as f32, z as f32];
        }
        let [x, y, z] = &out;
        [Avx::from_array(x), Avx::from_array(y), Avx::from_array(z)]
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Self) -> Self {
        let places = elementary::indices(index).to_array();
        Avx::from_array(&std::array::from_fn(|i| table.get(places[i] as usize).copied().unwrap_or(0.0)))
    }
    #[inline(always)]
    fn pick(table: &[f32], index: Self) -> Self {
        Self::gather(table, index)
    }
    #[inline(always)]
    fn run<const N: usize>(table: &[f32], index: Self) -> [Self; N] {
        if N != 2 || table.len() < 2 {
            return std::array::from_fn(|k| Self::gather(table, index + Self::c(k as f64)));
        }
        // Pairs, each read as one number of 64 bits; no place is beyond the last.
        let last = AvxBits::of((table.len() - 2).min(1 << 23) as u32);
        let places = AvxBits(avx!(_mm256_min_epu32(elementary::indices(index).0, last.0))).to_array();
        let pairs = |a: u32, b: u32| {
            // SAFETY: as in `avx!`; both places are followed by another in the table.
            unsafe {
                let low = _mm_load_sd(table.as_ptr().add(a as usize).cast());
                _mm_castpd_ps(_mm_loadh_pd(low, table.as_ptr().add(b as usize).cast()))
            }
        };
        let [p0, p1, p2, p3, p4, p5, p6, p7] = places;
        let even = avx!(_mm256_set_m128(pairs(p4, p5), pairs(p0, p1)));
        let odd = avx!(_mm256_set_m128(pairs(p6, p7), pairs(p2, p3)));
        let first = Avx(avx!(_mm256_shuffle_ps::<0b10_00_10_00>(even, odd)));
        let second = Avx(avx!(_mm256_shuffle_ps::<0b11_01_11_01>(even, odd)));
        std::array::from_fn(|k| if k == 0 { first } else { second })
    }
    #[inline(always)]
    fn octaves<const OCTAVES: u32, const DIGITS: i32, const CELLS: usize, const WIDTH: usize>(
        table: &[[f32; WIDTH]; CELLS],
        x: Self,
    ) -> Option<([Self; WIDTH], Self)> {
        let (cell, t) = octaves::place::<OCTAVES, DIGITS, Self>(x);
        let places = cell.and(AvxBits::of(CELLS as u32 - 1)).to_array();
        let mut columns = [Self::zero(); WIDTH];
        let mut first = 0;
        while first + 4 <= WIDTH {
            let four = |i: usize| {
                let row: &[f32; WIDTH] = &table[places[i] as usize & (CELLS - 1)];
                // SAFETY: as in `avx!`; four numbers from `first` on are within the row.
                unsafe { _mm_loadu_ps(row.as_ptr().add(first)) }
            };
            let [a, b, c, d] = turned([
                avx!(_mm256_set_m128(four(4), four(0))),
                avx!(_mm256_set_m128(four(5), four(1))),
                avx!(_mm256_set_m128(four(6), four(2))),
                avx!(_mm256_set_m128(four(7), four(3))),
            ]);
            [columns[first], columns[first + 1], columns[first + 2], columns[first + 3]] =
                [Avx(a), Avx(b), Avx(c), Avx(d)];
            first += 4;
        }
        Some((columns, t))
    }
}

/// Rows become columns, in each half by itself.
#[inline(always)]
fn turned([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    avx!({
        let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    })
}

impl Lift<f32> for Avx {
    #[inline(always)]
    fn lift(s: f32) -> Self {
        Self::from_f32(s)
    }
}

impl Lift<Avx> for Avx {
    #[inline(always)]
    fn lift(s: Avx) -> Self {
        s
    }
}

impl Lift<F32x8> for Avx {
    #[inline(always)]
    fn lift(s: F32x8) -> Self {
        Avx::from_array(&s.0)
    }
}

impl Lanes for Avx {
    const VECTORS: bool = true;
    #[inline(always)]
    fn load(rows: &[[f32; 3]; 8]) -> V3<Self> {
        let numbers = rows.as_flattened();
        let half = |k: usize| {
            let numbers: &[f32; 4] = numbers[k..].first_chunk().unwrap_or(&[0.0; 4]);
            avx!(_mm_loadu_ps(numbers.as_ptr()))
        };
        avx!({
            let first = _mm256_set_m128(half(12), half(0));
            let second = _mm256_set_m128(half(16), half(4));
            let third = _mm256_set_m128(half(20), half(8));
            let xy = _mm256_shuffle_ps::<0b10_01_11_10>(second, third);
            let yz = _mm256_shuffle_ps::<0b01_00_10_01>(first, second);
            V3::new(
                Avx(_mm256_shuffle_ps::<0b10_00_11_00>(first, xy)),
                Avx(_mm256_shuffle_ps::<0b11_01_10_00>(yz, xy)),
                Avx(_mm256_shuffle_ps::<0b11_00_11_01>(yz, third)),
            )
        })
    }

    #[inline(always)]
    fn store(columns: [Self; 4]) -> [[f32; 4]; 8] {
        let mut rows = [[0.0; 4]; 8];
        for (i, both) in turned(columns.map(|c| c.0)).into_iter().enumerate() {
            avx!(_mm_storeu_ps(rows[i].as_mut_ptr(), _mm256_castps256_ps128(both)));
            avx!(_mm_storeu_ps(rows[i + 4].as_mut_ptr(), _mm256_extractf128_ps::<1>(both)));
        }
        rows
    }

    #[inline(always)]
    fn apart<W: Work>(work: W) -> W::Output {
        #[inline(never)]
        #[target_feature(enable = "avx2")]
        fn avx2<W: Work>(work: W) -> W::Output {
            work.run()
        }
        avx!(avx2(work))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::dispatch::{self, LaneWork};

    /// Numbers of all kinds, and tables read by them.
    struct Compare;

    impl LaneWork for Compare {
        type Output = Vec<u32>;

        fn run<L: Lanes>(self) -> Vec<u32> {
            let kinds = [0.0f32, -0.0, 1.0, -1.5, 0.3, 1e-3, -7.25, 3e5, 1e-40, f32::MIN_POSITIVE, 88.9, -90.0];
            let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
            let mut bits = Vec::new();
            let mut keep = |x: L| {
                let rows = L::store([x; 4]);
                // Which NaN it is, nobody promises.
                bits.extend(rows.map(|r| if r[0].is_nan() { u32::MAX } else { r[0].to_bits() }));
            };
            let lanes = |k: usize| {
                let all: Vec<f32> = kinds.iter().chain(&odd).copied().collect();
                L::load(&std::array::from_fn(|i| {
                    [all[(i + k) % all.len()], all[(3 * i + k) % all.len()], 0.1 * i as f32]
                }))
            };
            let table: Vec<f32> = (0..600).map(|k| (k as f32).sqrt()).collect();
            let cubics: Box<[[f32; 4]; 512]> = octaves::table(octaves::fit::<32, 4>(f64::sqrt));
            for k in 0..15 {
                let V3 { x, y, z } = lanes(k);
                for v in [x + y, x - y, x * y, x / y, -x, x.min(y), x.max(y), x.abs(), x.copysign(y), x.abs().sqrt()] {
                    keep(v);
                }
                keep(x.floor());
                keep(x.mul_add(y, z));
                keep(x.turned(1.3, y, -0.7));
                keep(L::select(x.lt(y) | x.le(z), x, y));
                keep(L::select(!(x.gt(y) & x.ge(z)), x, y));
                keep(x.exp());
                keep(x.ln());
                keep(x.abs().ln_1p());
                keep(x.abs().powf(y));
                let angle = z.mul_add(L::c(7.0), L::c(-3.0));
                let (sin, cos) = angle.sin_cos();
                [sin, cos, z.atan2(angle), angle.atan2(z), L::quartic(&table, 599.0, z)]
                    .into_iter()
                    .for_each(&mut keep);
                let (row, t) = L::octaves::<32, 4, 512, 4>(&cubics, z).expect("single precision");
                keep(octaves::cubic(row, t));
                keep(L::gather(&table, (z * L::c(599.0)).whole()));
                let [a, b, c] = L::run(&table, (z * L::c(500.0)).whole());
                [a, b, c].into_iter().for_each(&mut keep);
                L::by_lane([x, z], |[x, z]| [x + z, x * z, z]).into_iter().for_each(&mut keep);
            }
            bits
        }
    }

    #[test]
    fn lanes_are_the_portable_ones_bit_for_bit() {
        assert_eq!(dispatch::lanes(Compare), Compare.run::<F32x8>());
    }
}
