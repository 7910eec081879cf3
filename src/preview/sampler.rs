//! Low-discrepancy numbers for one camera sample.
//!
//! Owen-scrambled Sobol points, four dimensions at a time. Every pixel and every group of four has its own scramble
//! (Burley 2020, "padding"), so that the points of one group are stratified over a pixel's samples and groups are
//! independent of each other. What comes out depends on seed, pixel and sample index alone, not on who asks when.

/// The most points of one Sobol sequence; beyond it a fresh scramble starts.
const SEQUENCE: u32 = 1 << 16;

/// The numbers of one camera sample.
pub struct Sampler {
    seed: u32,
    index: u32,
    group: u32,
}

impl Sampler {
    /// `pixel` comes from [`pixel_seed`]; `index` counts the samples of that pixel.
    pub fn new(pixel: u32, index: u32) -> Sampler {
        Sampler { seed: mix(pixel ^ (index / SEQUENCE).wrapping_mul(0x85eb_ca6b)), index: index % SEQUENCE, group: 0 }
    }

    /// The next four numbers, each in [0, 1).
    pub fn next4(&mut self) -> [f32; 4] {
        let scramble = mix(self.seed.wrapping_add(self.group.wrapping_mul(0x9e37_79b9)));
        self.group += 1;
        sobol_burley::sample_4d(self.index, 0, scramble)
    }
}

/// A number of its own for every pixel of every seed.
pub fn pixel_seed(seed: u64, x: u32, y: u32) -> u32 {
    let s = mix(seed as u32) ^ mix((seed >> 32) as u32 ^ 0x68bc_21eb).rotate_left(7);
    mix(mix(s ^ x).wrapping_add(0x02e5_be93) ^ y)
}

/// A bijection of 32-bit words in which every input bit flips about half of the output (lowbias32 by Chris Wellons).
fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}
