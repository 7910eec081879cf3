//! Rays in, pixels out.
//!
//! Each pixel gathers its own samples, spread around its centre with the density of the filter, so that a pixel is a
//! plain mean and no two pixels share a sum: rows can be made by any thread in any order.

use super::camera::Camera;
use super::integrator::{Tally, Tracer};
use super::sampler::{Sampler, pixel_seed};
use super::{Control, Image, Pass, RenderError, Surface};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Renders every pixel on the threads of the current pool.
pub fn expose<S: Surface>(
    pass: &Pass,
    camera: &Camera,
    tracer: &Tracer<'_, S>,
    control: Control<'_>,
) -> Result<(Image, Tally), RenderError> {
    let (width, height) = (pass.width as usize, pass.height as usize);
    let filter = Filter::new();
    let mut data = vec![0.0f32; 3 * width * height];
    let done = AtomicU64::new(0);
    let rows: Vec<Result<Tally, RenderError>> = data
        .par_chunks_exact_mut(3 * width)
        .enumerate()
        .map(|(y, row)| {
            let mut tally = Tally::default();
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                if control.cancel.load(Ordering::Relaxed) {
                    return Err(RenderError::Cancelled);
                }
                let rgb = expose_pixel(pass, camera, tracer, &filter, [x as u32, y as u32], &mut tally)?;
                pixel.copy_from_slice(&rgb);
            }
            (control.progress)(done.fetch_add(1, Ordering::Relaxed) + 1, height as u64);
            Ok(tally)
        })
        .collect();
    // In row order, so that the same error is reported however the rows were shared out.
    let mut total = Tally::default();
    for row in rows {
        total.add(row?);
    }
    let image = Image::from_vec(pass.width, pass.height, data).expect("three values a pixel");
    Ok((image, total))
}

/// The mean of one pixel's samples. Summed in f64: f32 would lose the later of 65,536 samples.
fn expose_pixel<S: Surface>(
    pass: &Pass,
    camera: &Camera,
    tracer: &Tracer<'_, S>,
    filter: &Filter,
    [x, y]: [u32; 2],
    tally: &mut Tally,
) -> Result<[f32; 3], RenderError> {
    let pixel = pixel_seed(pass.seed, x, y);
    let mut sum = [0.0f64; 3];
    for index in pass.samples.clone() {
        let mut sampler = Sampler::new(pixel, index);
        let [u, v, ..] = sampler.next4();
        let film_x = (x as f32 + 0.5 + filter.offset(u)) / pass.width as f32;
        let film_y = (y as f32 + 0.5 + filter.offset(v)) / pass.height as f32;
        let radiance = tracer.radiance(camera.ray(film_x, film_y), &mut sampler, tally).map_err(RenderError::Shade)?;
        if sane(radiance) {
            for c in 0..3 {
                sum[c] += f64::from(radiance[c]);
            }
        } else {
            tally.invalid += 1;
        }
    }
    Ok(sum.map(|s| (s / pass.samples.len() as f64).min(f64::from(f32::MAX)) as f32))
}

fn sane(radiance: Vec3) -> bool {
    radiance.is_finite() && radiance.min_element() >= 0.0
}

/// Draws offsets from a pixel's centre with the density of a Blackman–Harris window: smooth, non-negative, and as good
/// as free of ringing and aliasing.
struct Filter {
    /// The inverse of the cumulated window at equal steps of the random number.
    inverse: [f32; Filter::STEPS + 1],
}

impl Filter {
    const STEPS: usize = 128;
    /// Half the window's width, in pixels.
    const RADIUS: f64 = 1.5;

    fn new() -> Filter {
        // The window integrated from its left edge to x, x in [0, 1]; the constant term makes it 1 at the right edge.
        let cumulated = |x: f64| {
            let t = std::f64::consts::TAU * x;
            let a = [0.358_75, 0.488_29, 0.141_28, 0.011_68];
            let wave = a[1] * t.sin() - a[2] * (2.0 * t).sin() / 2.0 + a[3] * (3.0 * t).sin() / 3.0;
            x - wave / (std::f64::consts::TAU * a[0])
        };
        let inverse = std::array::from_fn(|i| {
            let target = i as f64 / Self::STEPS as f64;
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if cumulated(middle) < target { low = middle } else { high = middle }
            }
            ((low + high - 1.0) * Self::RADIUS) as f32
        });
        Filter { inverse }
    }

    /// Pixels from the centre, for `u` in [0, 1).
    fn offset(&self, u: f32) -> f32 {
        let at = u * Self::STEPS as f32;
        let i = (at as usize).min(Self::STEPS - 1);
        let t = at - i as f32;
        self.inverse[i] * (1.0 - t) + self.inverse[i + 1] * t
    }
}
