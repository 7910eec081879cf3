//! The built-in environment: a soft studio.
//!
//! A large key light from the upper left front, a dim fill from the right, and two lights behind the subject whose
//! grazing light is what makes cloth glow at its rim. The lower half is the colour of an endless backdrop. All edges
//! are wide, so that shadows are soft. Nothing bright lies where the camera looks.

use super::environment::{Environment, from_square};
use glam::{Vec3, vec2, vec3};

/// Enough for lights this soft, and small enough to stay in the cache.
const WIDTH: usize = 256;
const HEIGHT: usize = 128;

/// A round light with a soft edge.
struct Lamp {
    toward: Vec3,
    /// Angle from the centre at which it starts to fade, and where it ends, in degrees.
    edge: [f32; 2],
    radiance: Vec3,
}

const LAMPS: [Lamp; 4] = [
    Lamp { toward: vec3(-0.62, 0.80, 0.55), edge: [12.0, 30.0], radiance: vec3(7.2, 6.9, 6.4) },
    Lamp { toward: vec3(0.90, 0.30, 0.50), edge: [10.0, 50.0], radiance: vec3(0.22, 0.24, 0.28) },
    Lamp { toward: vec3(0.72, 0.50, -0.80), edge: [10.0, 28.0], radiance: vec3(5.2, 5.5, 6.0) },
    Lamp { toward: vec3(-0.90, 0.40, -0.75), edge: [8.0, 26.0], radiance: vec3(3.5, 3.6, 3.8) },
];

pub fn environment() -> Environment {
    let pixels = (0..WIDTH * HEIGHT).map(|i| {
        let at = vec2((i % WIDTH) as f32 + 0.5, (i / WIDTH) as f32 + 0.5);
        radiance(from_square(at / vec2(WIDTH as f32, HEIGHT as f32)).0)
    });
    Environment::from_pixels(WIDTH, HEIGHT, pixels.collect())
}

/// One small round light toward `toward`, `degrees` in radius, in a dim grey surrounding.
pub fn lamp(toward: Vec3, degrees: f32) -> Environment {
    let (width, height) = (2 * WIDTH, 2 * HEIGHT);
    let toward = toward.normalize();
    let edge = degrees.to_radians().cos();
    // The same light falls on a surface that faces it, whatever its size.
    let bright = 2.2 / (1.0 - edge) / std::f32::consts::TAU;
    let pixels = (0..width * height).map(|i| {
        let at = vec2((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let dir = from_square(at / vec2(width as f32, height as f32)).0;
        Vec3::splat(if dir.dot(toward) > edge { bright } else { 0.02 })
    });
    Environment::from_pixels(width, height, pixels.collect())
}

fn radiance(dir: Vec3) -> Vec3 {
    const GROUND: Vec3 = vec3(0.16, 0.16, 0.165);
    const HORIZON: Vec3 = vec3(0.055, 0.056, 0.060);
    const ZENITH: Vec3 = vec3(0.20, 0.21, 0.235);
    let below = GROUND.lerp(HORIZON, smoothstep(-0.30, 0.02, dir.y));
    let sky = below.lerp(ZENITH, smoothstep(0.1, 0.9, dir.y));
    LAMPS.iter().fold(sky, |sum, lamp| {
        let [inner, outer] = lamp.edge.map(|degrees| degrees.to_radians().cos());
        sum + lamp.radiance * smoothstep(outer, inner, dir.dot(lamp.toward.normalize()))
    })
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
