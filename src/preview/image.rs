//! A picture in memory: linear radiance, three f32 a pixel, rows from the top.

use std::fmt;

/// Linear RGB radiance.
#[derive(Clone, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    data: Vec<f32>,
}

impl Image {
    /// A picture of one colour.
    pub fn filled(width: u32, height: u32, rgb: [f32; 3]) -> Image {
        let data = (0..width as usize * height as usize).flat_map(|_| rgb).collect();
        Image { width, height, data }
    }

    /// A picture from its values, red first, rows from the top; `None` unless there are 3·width·height of them.
    pub fn from_vec(width: u32, height: u32, data: Vec<f32>) -> Option<Image> {
        (data.len() == 3 * width as usize * height as usize).then_some(Image { width, height, data })
    }

    /// Pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All values, red first, rows from the top.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All values, as [`data`](Self::data) gives them.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// One pixel; (0, 0) is the upper left corner.
    ///
    /// # Panics
    /// Outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> [f32; 3] {
        let i = self.index(x, y);
        [self.data[i], self.data[i + 1], self.data[i + 2]]
    }

    /// Sets one pixel.
    ///
    /// # Panics
    /// Outside the picture.
    pub fn set_pixel(&mut self, x: u32, y: u32, rgb: [f32; 3]) {
        let i = self.index(x, y);
        self.data[i..i + 3].copy_from_slice(&rgb);
    }

    /// The mean of each channel.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for p in self.data.chunks_exact(3) {
            for c in 0..3 {
                sum[c] += f64::from(p[c]);
            }
        }
        sum.map(|s| s * 3.0 / self.data.len().max(1) as f64)
    }

    fn index(&self, x: u32, y: u32) -> usize {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) of a {}×{} picture", self.width, self.height);
        3 * (y as usize * self.width as usize + x as usize)
    }
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Image({}×{})", self.width, self.height)
    }
}
