//! Numbers out of bytes.

/// Reads bytes from the first on; zeros when there are no more.
pub struct Bytes<'b>(pub &'b [u8]);

/// Numbers at which arithmetic goes wrong.
const ODD: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-45,
    1e-20,
    1e20,
    f32::EPSILON,
    1.0 - f32::EPSILON,
    0.07,
];

impl Bytes<'_> {
    /// Whether there are more.
    pub fn left(&self) -> bool {
        !self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    /// Below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        usize::from(self.byte()) % end
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (u32::from(self.byte()) << 8 | u32::from(self.byte())) as f32 / 65_536.0
    }

    /// Mostly in [lo, hi], an end of it, or any number there is.
    pub fn number(&mut self, lo: f32, hi: f32) -> f32 {
        match self.byte() {
            0 => lo,
            1 => hi,
            2 => f32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()]),
            3 => ODD[self.below(ODD.len())],
            4 => lo + (hi - lo) * self.unit().powi(6),
            _ => lo + (hi - lo) * self.unit(),
        }
    }

    pub fn numbers(&mut self, lo: f32, hi: f32) -> [f32; 3] {
        std::array::from_fn(|_| self.number(lo, hi))
    }

    /// A direction: mostly of unit length, also along an axis, near the horizon, or no direction at all.
    pub fn direction(&mut self) -> [f32; 3] {
        match self.byte() {
            0 => [0.0, 0.0, 1.0],
            1 => [1.0, 0.0, 0.0],
            2 => self.numbers(-1.0, 1.0),
            3 => self.around(1e-6),
            _ => self.around(1.0),
        }
    }

    /// A unit vector with |z| at most `height`.
    fn around(&mut self, height: f32) -> [f32; 3] {
        let z = (2.0 * self.unit() - 1.0) * height;
        let (sin, cos) = (self.unit() * std::f32::consts::TAU).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * cos, r * sin, z]
    }
}
