//! The microcylinder cloth: what a thread reflects in all, and what a smooth cylinder does to a ray.

use super::{Bench, Figure};
use crate::cli::Failure;
use crate::lobes::cylinder::{through_smooth_cylinder, total_reflectance as reflectance};
use crate::preview::plot::Plot;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

pub fn total_reflectance(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let degrees: Vec<f64> = (0..=17).map(|k| 5.0 * f64::from(k)).collect();
    let mut series = Vec::new();
    for beta in [5.0, 10.0, 20.0, 40.0] {
        let with = |factor: f64| {
            degrees.iter().map(|t| (*t, factor * reflectance(f64::to_radians(beta), t.to_radians()))).collect()
        };
        series.push((format!("β = {beta}°, with ¼ and halved"), with(1.0)));
        if beta == 10.0 {
            series.push((format!("β = {beta}°, with ¼"), with(2.0)));
            series.push((format!("β = {beta}°, without ¼"), with(8.0)));
        }
    }
    let narrow = reflectance(1f64.to_radians(), 0.0);
    let plot = Plot { title: "Total reflectance of a thread", x: "θr, degrees", y: "reflectance", series: &series };
    Ok(Figure {
        title: "Total reflectance of a thread, with and without the ¼ (Sadeghi et al. 2013, as widely implemented)",
        says: "the azimuthal term is printed without the ¼ of a unit cylinder's scattering function.",
        measured: format!(
            "with the ¼ a smooth thread reflects {:.4} of what it receives, without it {:.4}; the Gaussian in the half \
             angle accounts for the other 2, so this engine halves it and reflects {narrow:.4}.",
            2.0 * narrow,
            8.0 * narrow
        ),
        files: bench.plot("thread-reflectance", &plot)?,
    })
}

pub fn refraction(bench: &Bench<'_>) -> Result<Figure, Failure> {
    let mut rng = Pcg64Mcg::seed_from_u64(bench.args.seed);
    let (mut rays, mut worst) = (0u32, 0.0f64);
    let mut points = Vec::new();
    while rays < 200_000 {
        let [along, turn, offset, eta] = std::array::from_fn(|_| rng.random::<f64>());
        let (theta, turn) = ((1.98 * along - 0.99).asin(), std::f64::consts::TAU * turn);
        let way = [theta.sin(), theta.cos() * turn.cos(), theta.cos() * turn.sin()];
        let Some(out) = through_smooth_cylinder(way, 1.998 * offset - 0.999, 1.1 + eta) else { continue };
        let out = out[0].clamp(-1.0, 1.0).asin();
        rays += 1;
        worst = worst.max((out - theta).abs());
        if rays.is_multiple_of(2000) {
            points.push((theta.to_degrees(), out.to_degrees()));
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let series = [("refracted through".to_owned(), points)];
    let plot = Plot {
        title: "Longitudinal angle before and after a smooth cylinder",
        x: "θ in, degrees",
        y: "θ out, degrees",
        series: &series,
    };
    Ok(Figure {
        title: "A ray refracted through a smooth cylinder (Marschner et al. 2003)",
        says: "it leaves on the same cone about the axis: the longitudinal angle is kept.",
        measured: format!(
            "over {rays} random rays, offsets and indices the angle changes by at most {worst:.1e} radians."
        ),
        files: bench.plot("cylinder-refraction", &plot)?,
    })
}
