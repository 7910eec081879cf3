//! What the language costs at a point: running a script there.

use divan::{Bencher, black_box};
use overcoat::{Engine, Globals, Material};

const VELVET: &str = include_str!("../examples/velvet.osl");
const VARYING: &str = "Ci = sheen(color(0.55, 0.02, 0.04) * diffuse(N), N, color(1), 0.07 + 0.9 * u);";

/// Four octaves of Perlin noise in a loop; a branch drives color and roughness.
const NOISE: &str = "
float fbm(point p)
{
    float sum = 0, amplitude = 0.5;
    point q = p;
    for (int i = 0; i < 4; i++) {
        sum += amplitude * noise(q);
        q *= 2;
        amplitude *= 0.5;
    }
    return sum;
}
surface rough(color a = color(0.8, 0.2, 0.1), color b = color(0.1, 0.2, 0.8))
{
    float f = fbm(P * 8);
    color c = b;
    float r = 0.6;
    if (f > 0.5) {
        c = a;
        r = 0.3 + 0.2 * f;
    }
    Ci = c * oren_nayar(N, r);
}";

fn material(text: &str) -> Material {
    let shader = Engine::new().compile("bench", text).expect("compiles");
    shader.material(&[]).expect("specialises")
}

fn shade(bencher: Bencher, text: &str) {
    let material = material(text);
    let mut tree = overcoat::closure::ClosureTree::new();
    let mut globals = Globals::default();
    let mut k = 0u32;
    bencher.bench_local(|| {
        k = k.wrapping_add(97);
        globals.u = (k & 255) as f32 / 256.0;
        globals.p.x = globals.u;
        globals.p.y = 1.0 - globals.u;
        material.program().shade(black_box(&globals), &mut tree)
    });
}

#[divan::bench(sample_size = 1000)]
fn shade_velvet(bencher: Bencher) {
    shade(bencher, VELVET);
}

#[divan::bench(sample_size = 1000)]
fn shade_velvet_varying(bencher: Bencher) {
    shade(bencher, VARYING);
}

#[divan::bench(sample_size = 1000)]
fn shade_noise(bencher: Bencher) {
    shade(bencher, NOISE);
}

/// Points shaded with one call; divide by this for a point.
const POINTS: usize = 64;

fn shade_batch(bencher: Bencher, text: &str) {
    let material = material(text);
    let mut batch = overcoat::ir::Batch::new();
    let points: Vec<Globals> = (0..POINTS)
        .map(|k| {
            let u = ((k * 97) & 255) as f32 / 256.0;
            Globals { u, p: glam::vec3(u, 1.0 - u, 0.0), ..Globals::default() }
        })
        .collect();
    bencher.counter(divan::counter::ItemsCount::new(POINTS)).bench_local(|| {
        material.shade_batch(black_box(&points), &mut batch);
        batch.trees().len()
    });
}

#[divan::bench(sample_size = 50)]
fn batch_velvet(bencher: Bencher) {
    shade_batch(bencher, VELVET);
}

#[divan::bench(sample_size = 50)]
fn batch_velvet_varying(bencher: Bencher) {
    shade_batch(bencher, VARYING);
}

#[divan::bench(sample_size = 50)]
fn batch_noise(bencher: Bencher) {
    shade_batch(bencher, NOISE);
}

/// From a point to a BSDF: the tree and its preparation for one direction.
#[divan::bench(sample_size = 1000)]
fn velvet_to_bsdf(bencher: Bencher) {
    let material = material(VELVET);
    let globals = Globals::default();
    let wo = glam::vec3(0.48, 0.36, 0.8);
    bencher.bench_local(|| material.shade(black_box(&globals), *black_box(&wo)).is_ok());
}

fn main() {
    divan::main();
}
