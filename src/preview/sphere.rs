//! The unit sphere on the floor, hit exactly.

use super::camera::Ray;
use super::scene::{EPSILON, Point};
use glam::{Vec3, vec3};
use std::f32::consts::{PI, TAU};

pub const CENTER: Vec3 = vec3(0.0, 1.0, 0.0);

/// Distance to the nearest hit beyond [`EPSILON`], from outside or inside.
pub fn intersect(ray: Ray, t_max: f32) -> Option<f32> {
    let to = ray.origin - CENTER;
    let b = to.dot(ray.dir);
    // The squared distance of the centre from the ray, without the cancellation of b² − c.
    let near = to - ray.dir * b;
    let d = 1.0 - near.length_squared();
    if d < 0.0 {
        return None;
    }
    let root = d.sqrt();
    [-b - root, -b + root].into_iter().find(|&t| t > EPSILON && t < t_max)
}

/// The surface where the ray hits at distance `t`. u runs along the longitude, v from the south pole to the north.
pub fn surface(ray: Ray, t: f32) -> Point {
    let n = (ray.origin + ray.dir * t - CENTER).normalize();
    let p = CENTER + n;
    // Longitude runs the way that makes dPdu × dPdv point outward; its seam lies at the back. At the poles dPdu keeps a
    // direction.
    let azimuth = if n.x == 0.0 && n.z == 0.0 { 0.0 } else { n.x.atan2(n.z) };
    let sin = (n.x * n.x + n.z * n.z).sqrt();
    let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
    let dpdu = vec3(cos_azimuth, 0.0, -sin_azimuth) * (TAU * sin.max(1e-4));
    let dpdv = vec3(-n.y * sin_azimuth, sin, -n.y * cos_azimuth) * PI;
    Point {
        p,
        n,
        ng: n,
        u: (azimuth / TAU + 0.5).clamp(0.0, 1.0),
        v: (0.5 + n.y.clamp(-1.0, 1.0).asin() / PI).clamp(0.0, 1.0),
        dpdu,
        dpdv,
        outside: p + n * EPSILON,
        inside: p - n * EPSILON,
    }
}
