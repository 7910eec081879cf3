//! A host in a few lines: compile a script, shade a point, sample its BSDF, and integrate what it reflects.
//!
//! `cargo run --release --example embed`

use overcoat::ir::Value;
use overcoat::{Engine, Globals};
use rand::{RngExt, SeedableRng};

const SCRIPT: &str = "
surface velvet(color ground = color(0.6, 0.02, 0.05), float roughness = 0.3)
{
    Ci = ground * diffuse(N);
    Ci = sheen(Ci, N, color(1), roughness);
}";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Once per material: compile, set parameters.
    let shader = Engine::new().compile("velvet", SCRIPT)?;
    let material = shader.material(&[("roughness".into(), Value::Float(0.5))])?;

    // Once per shading point: what the ray hit, and the direction toward the viewer.
    let wo = glam::Vec3::new(0.6, 0.0, 0.8);
    let globals = Globals { n: glam::Vec3::Z, ng: glam::Vec3::Z, dpdu: glam::Vec3::X, ..Globals::default() };
    let bsdf = material.shade(&globals, wo)?;

    // A light sample: f·|cos| and the density for multiple importance sampling.
    let light = bsdf.eval([0.0, 0.6, 0.8]);
    println!("toward the light: f·cos {:?}, pdf {:.4}", light.f_cos, light.pdf);

    // BSDF samples: their weights average to the albedo.
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1);
    let count = 100_000;
    let mut albedo = [0.0f64; 3];
    for _ in 0..count {
        if let Some(sample) = bsdf.sample([rng.random(), rng.random(), rng.random()]) {
            for c in 0..3 {
                albedo[c] += f64::from(sample.weight[c]) / f64::from(count);
            }
        }
    }
    println!("albedo by sampling:   {albedo:.4?}");

    // The same by quadrature.
    let subject = |wo: [f32; 3]| material.shade(&globals, wo.into()).expect("a small tree");
    let exact = overcoat::audit::albedo(&subject, overcoat::audit::Side::View, wo.into(), Default::default());
    println!("albedo by quadrature: {:.4?} ± {:.0e}", exact.value, exact.error);
    Ok(())
}
