//! Light from infinitely far away: a lat-long picture, or the same from everywhere.
//!
//! In comes a picture (or a file); out come radiance by direction, directions drawn in proportion to it, and their
//! density. +y is up; the picture's middle column is −z, to its right is +x.

use glam::{Vec2, Vec3, vec2, vec3};
use image::{ImageDecoder, ImageReader};
use std::f32::consts::{PI, TAU};
use std::io::{BufRead, Cursor, Seek};
use std::path::Path;

/// Infinities in a picture become this, the largest half float: that is where they usually come from.
const BRIGHTEST: f32 = 65_504.0;

/// What decoding a file may allocate, in bytes.
const MOST_MEMORY: u64 = 1 << 30;

/// Light by direction.
pub struct Environment {
    kind: Kind,
}

enum Kind {
    Uniform(f32),
    Picture(Picture),
}

/// A drawn direction.
#[derive(Clone, Copy, Debug)]
pub struct EnvSample {
    /// Unit, toward the light.
    pub dir: Vec3,
    pub radiance: Vec3,
    /// Per solid angle.
    pub pdf: f32,
}

impl Environment {
    /// The same radiance from everywhere. It is never sampled: a BSDF's own sampling cannot be bettered by it, and
    /// leaves no noise on a lossless surface.
    pub fn uniform(radiance: f32) -> Environment {
        Environment { kind: Kind::Uniform(radiance) }
    }

    /// A lat-long picture of `width` × `height` pixels, rows from the top. NaN and negative values become 0, infinite
    /// ones 65,504.
    ///
    /// # Panics
    /// If there are not width · height pixels, or none.
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<Vec3>) -> Environment {
        Environment { kind: Kind::Picture(Picture::new(width, height, pixels)) }
    }

    /// Reads a Radiance HDR or OpenEXR file. The error says why not, without the path.
    pub fn open(path: &Path) -> Result<Environment, String> {
        let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(|e| e.to_string())?;
        Environment::decode(reader, MOST_MEMORY)
    }

    /// [`open`](Self::open) for what a file holds, with a limit on the memory its picture may take: for tests that try
    /// any bytes.
    #[doc(hidden)]
    pub fn from_bytes(bytes: &[u8], most_memory: u64) -> Result<Environment, String> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
        Environment::decode(reader, most_memory)
    }

    fn decode(reader: ImageReader<impl BufRead + Seek>, most_memory: u64) -> Result<Environment, String> {
        match reader.format() {
            Some(image::ImageFormat::Hdr | image::ImageFormat::OpenExr) => {}
            _ => return Err("expected a Radiance HDR or an OpenEXR picture".into()),
        }
        let mut decoder = reader.into_decoder().map_err(|e| e.to_string())?;
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(most_memory);
        decoder.set_limits(limits).map_err(|e| e.to_string())?;
        // Decoders heed that for what they need besides; a header may claim a picture beyond any memory.
        if decoder.total_bytes() > most_memory {
            let (width, height) = decoder.dimensions();
            return Err(format!("a picture of {width}×{height} pixels is beyond the limit of {most_memory} bytes"));
        }
        let picture = image::DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?.into_rgb32f();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        if width < 2 || height < 2 {
            return Err(format!("a lat-long picture of {width}×{height} pixels is too small"));
        }
        let pixels = picture.pixels().map(|p| Vec3::from_array(p.0)).collect();
        Ok(Environment::from_pixels(width, height, pixels))
    }

    /// Radiance arriving from direction `dir` (unit, toward the light).
    pub fn radiance(&self, dir: Vec3) -> Vec3 {
        self.look(dir).0
    }

    /// [`radiance`](Self::radiance) and [`pdf`](Self::pdf) at once.
    pub fn look(&self, dir: Vec3) -> (Vec3, f32) {
        match &self.kind {
            Kind::Uniform(radiance) => (Vec3::splat(*radiance), 0.0),
            Kind::Picture(picture) => {
                let at = to_square(dir);
                (picture.lookup(at), picture.pdf(at, dir.y))
            }
        }
    }

    /// Draws a direction from two numbers in [0, 1); `None` if there is nothing worth drawing.
    pub fn sample(&self, u: [f32; 2]) -> Option<EnvSample> {
        match &self.kind {
            Kind::Uniform(_) => None,
            Kind::Picture(picture) => picture.sample(u),
        }
    }

    /// Density per solid angle of [`sample`](Self::sample) drawing `dir`.
    pub fn pdf(&self, dir: Vec3) -> f32 {
        self.look(dir).1
    }
}

/// Direction to (column, row) in the unit square.
fn to_square(dir: Vec3) -> Vec2 {
    let azimuth = if dir.x == 0.0 && dir.z == 0.0 { 0.0 } else { dir.x.atan2(-dir.z) };
    vec2(azimuth / TAU + 0.5, dir.y.clamp(-1.0, 1.0).acos() / PI)
}

/// The inverse of [`to_square`], and sin θ from +y.
pub(super) fn from_square(square: Vec2) -> (Vec3, f32) {
    let (sin_azimuth, cos_azimuth) = ((square.x - 0.5) * TAU).sin_cos();
    let (sin, cos) = (square.y * PI).sin_cos();
    (vec3(sin * sin_azimuth, cos, -sin * cos_azimuth), sin)
}

struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<Vec3>,
    /// Per row, `width` + 1 values rising from 0 to 1.
    columns: Vec<f32>,
    /// `height` + 1 values rising from 0 to 1.
    rows: Vec<f32>,
    /// cos θ at the upper edge of each row, and at the last one's lower edge.
    cosines: Vec<f32>,
    /// Nothing in it shines.
    black: bool,
}

impl Picture {
    fn new(width: usize, height: usize, mut pixels: Vec<Vec3>) -> Picture {
        assert!(width > 0 && height > 0 && pixels.len() == width * height, "{} pixels", pixels.len());
        for p in &mut pixels {
            *p = Vec3::from_array(p.to_array().map(sane));
        }
        let edge = |y: usize| (y as f64 / height as f64 * std::f64::consts::PI).cos() as f32;
        let cosines: Vec<f32> = (0..=height).map(edge).collect();
        let mut columns = Vec::with_capacity((width + 1) * height);
        let mut weights = Vec::with_capacity(height);
        let mut row = vec![0.0f64; width];
        for y in 0..height {
            for (x, w) in row.iter_mut().enumerate() {
                *w = blurred_luminance(&pixels, width, height, x, y);
            }
            // Times the solid angle of a pixel in this row, up to a constant.
            let sum = cumulate(&row, &mut columns);
            weights.push(sum * f64::from(cosines[y] - cosines[y + 1]));
        }
        let mut rows = Vec::with_capacity(height + 1);
        let total = cumulate(&weights, &mut rows);
        Picture { width, height, pixels, columns, rows, cosines, black: total <= 0.0 }
    }

    /// Bilinear between pixel centres; around in longitude, held at the poles.
    fn lookup(&self, at: Vec2) -> Vec3 {
        // A whole turn is added to keep the column positive, so that a cast rounds down.
        let x = at.x.clamp(0.0, 1.0) * self.width as f32 + (self.width as f32 - 0.5);
        let y = (at.y * self.height as f32 - 0.5).clamp(0.0, (self.height - 1) as f32);
        let (fx, fy) = (x - (x as usize) as f32, y - (y as usize) as f32);
        let x0 = x as usize % self.width;
        let x1 = if x0 + 1 == self.width { 0 } else { x0 + 1 };
        let y0 = y as usize;
        let y1 = (y0 + 1).min(self.height - 1);
        let row = |y: usize| {
            let row = &self.pixels[y * self.width..(y + 1) * self.width];
            row[x0].lerp(row[x1], fx)
        };
        row(y0).lerp(row(y1), fy)
    }

    fn sample(&self, u: [f32; 2]) -> Option<EnvSample> {
        if self.black {
            return None;
        }
        let (y, fy) = draw(&self.rows, u[1]);
        let row = &self.columns[y * (self.width + 1)..(y + 1) * (self.width + 1)];
        let (x, fx) = draw(row, u[0]);
        // Uniform in solid angle within the pixel's row: linear in cos θ.
        let (top, bottom) = (self.cosines[y], self.cosines[y + 1]);
        let cos = top + (bottom - top) * fy;
        let square = vec2((x as f32 + fx) / self.width as f32, cos.clamp(-1.0, 1.0).acos() / PI);
        let (dir, _) = from_square(square);
        let pdf = self.cell_pdf(x, y);
        (pdf > 0.0).then(|| EnvSample { dir, radiance: self.lookup(square), pdf })
    }

    fn pdf(&self, at: Vec2, cos: f32) -> f32 {
        if self.black {
            return 0.0;
        }
        let x = ((at.x * self.width as f32) as usize).min(self.width - 1);
        let mut y = ((at.y * self.height as f32) as usize).min(self.height - 1);
        // acos rounds; the row is where the cosine lies.
        while y > 0 && cos > self.cosines[y] {
            y -= 1;
        }
        while y + 1 < self.height && cos < self.cosines[y + 1] {
            y += 1;
        }
        self.cell_pdf(x, y)
    }

    /// The density is the same all over a pixel.
    fn cell_pdf(&self, x: usize, y: usize) -> f32 {
        let row = &self.columns[y * (self.width + 1)..];
        let probability = (self.rows[y + 1] - self.rows[y]) * (row[x + 1] - row[x]);
        let (top, bottom) = (self.cosines[y], self.cosines[y + 1]);
        probability * self.width as f32 / (TAU * (top - bottom))
    }
}

fn sane(x: f32) -> f32 {
    if x > 0.0 { if x.is_finite() { x } else { BRIGHTEST } } else { 0.0 }
}

/// The luminance a bilinear lookup can find within a pixel, roughly: never zero where the lookup is not.
fn blurred_luminance(pixels: &[Vec3], width: usize, height: usize, x: usize, y: usize) -> f64 {
    const TENT: [f64; 3] = [0.125, 0.75, 0.125];
    let mut sum = 0.0;
    for (j, wy) in TENT.iter().enumerate() {
        let yy = (y + j).saturating_sub(1).min(height - 1);
        for (i, wx) in TENT.iter().enumerate() {
            let p = pixels[yy * width + (x + i + width - 1) % width];
            sum += wx * wy * f64::from(p.dot(vec3(0.2126, 0.7152, 0.0722)));
        }
    }
    sum
}

/// Appends the running sums of `weights`, scaled to end at 1, behind a leading 0. Returns the sum. All-zero weights
/// count as equal ones.
fn cumulate(weights: &[f64], out: &mut Vec<f32>) -> f64 {
    let sum: f64 = weights.iter().sum();
    out.push(0.0);
    let mut running = 0.0;
    for (i, w) in weights.iter().enumerate() {
        running += w;
        let share = if sum > 0.0 { running / sum } else { (i + 1) as f64 / weights.len() as f64 };
        out.push(share as f32);
    }
    *out.last_mut().expect("at least the leading 0") = 1.0;
    sum
}

/// The interval of a cumulated table that `u` falls into, and where in it.
fn draw(table: &[f32], u: f32) -> (usize, f32) {
    let i = table.partition_point(|&c| c <= u).clamp(1, table.len() - 1) - 1;
    let width = table[i + 1] - table[i];
    let t = if width > 0.0 { (u - table[i]) / width } else { 0.5 };
    (i, t.clamp(0.0, 1.0))
}
