//! A shader ball: a ball with two grooves on a foot, turned from one curve.
//!
//! Nothing comes in but how fine the mesh shall be; out comes the [`Mesh`]. Round, flat, hollow and edged places show in
//! one picture what a sphere alone does not: highlights that break, light caught between two parts, a rim seen edge on.
//! The outline is a cubic B-spline, so that all edges are rounded and normals follow from its derivative. u runs around
//! the axis, v along the outline from the foot to the top, dPdu × dPdv points outward.

use super::drape::weights;
use super::mesh::{Mesh, Vertex};
use glam::{Vec2, vec2, vec3};
use std::f32::consts::{PI, TAU};

/// Segments around the axis of the mesh that is rendered; twice as many along the outline.
pub const RESOLUTION: usize = 192;

const RADIUS: f32 = 0.8;
const CENTER: f32 = 1.09;
/// The grooves: degrees above and below the equator, half their width in degrees, and depth.
const GROOVES: [f32; 2] = [-13.0, 13.0];
const GROOVE_WIDTH: f32 = 3.2;
const GROOVE_DEPTH: f32 = 0.06;
/// The foot: radius and height of what the outline bends toward, from the floor to where the ball begins.
const FOOT: [[f32; 2]; 11] = [
    [0.74, 0.0],
    [0.78, 0.0],
    [0.79, 0.02],
    [0.79, 0.06],
    [0.77, 0.085],
    [0.70, 0.09],
    [0.55, 0.10],
    [0.42, 0.125],
    [0.33, 0.17],
    [0.29, 0.23],
    [0.285, 0.29],
];

/// The ball with `resolution` segments around its axis.
pub fn ball_mesh(resolution: usize) -> Mesh {
    let (around, along) = (resolution.max(8), 2 * resolution.max(8));
    let outline = Outline::new();
    let rows: Vec<(Vec2, Vec2)> = (0..=along).map(|k| outline.at(k as f32 / along as f32)).collect();
    let mut vertices = Vec::with_capacity((around + 1) * (along + 1));
    for (k, (p, slope)) in rows.iter().enumerate() {
        for j in 0..=around {
            let u = j as f32 / around as f32;
            let (sin, cos) = ((u - 0.5) * TAU).sin_cos();
            let radius = p.x.max(0.0);
            // At the top dPdu keeps a direction.
            let dpdu = vec3(cos, 0.0, -sin) * (TAU * radius.max(1e-4));
            let dpdv = vec3(sin * slope.x, slope.y, cos * slope.x);
            let n = vec3(sin * slope.y, -slope.x, cos * slope.y).normalize_or(vec3(0.0, 1.0, 0.0));
            let position = vec3(sin * radius, p.y, cos * radius);
            vertices.push(Vertex { p: position, n, u, v: k as f32 / along as f32, dpdu, dpdv });
        }
    }
    let corner = |k: usize, j: usize| (k * (around + 1) + j) as u32;
    let mut triangles = Vec::with_capacity(2 * around * along);
    for k in 0..along {
        for j in 0..around {
            let [a, b, c, d] = [corner(k, j), corner(k, j + 1), corner(k + 1, j), corner(k + 1, j + 1)];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    Mesh::new(vertices, triangles)
}

/// (radius, height) along a B-spline, evenly by length.
struct Outline {
    knots: Vec<Vec2>,
    /// The spline's parameter at equal lengths.
    even: Vec<f32>,
    length: f32,
}

impl Outline {
    fn new() -> Outline {
        let mut knots: Vec<Vec2> = FOOT.iter().map(|[r, y]| vec2(*r, *y)).collect();
        // From where the ball is as wide as the foot's neck to the top.
        let first = -70.0f32;
        let steps = 160;
        for k in 0..=steps {
            let degrees = first + (90.0 - first) * k as f32 / steps as f32;
            let depth = |middle: &f32| {
                let x = (degrees - middle) / GROOVE_WIDTH;
                GROOVE_DEPTH * (-x.powi(6)).exp()
            };
            let radius = RADIUS - GROOVES.iter().map(depth).sum::<f32>();
            let (sin, cos) = (degrees * PI / 180.0).sin_cos();
            knots.push(vec2(radius * cos, CENTER + radius * sin));
        }
        // Mirrored beyond the axis, so that the outline meets it at a right angle.
        let before = knots[knots.len() - 2];
        knots.push(vec2(-before.x, before.y));
        let mut outline = Outline { knots, even: Vec::new(), length: 0.0 };
        outline.measure();
        outline
    }

    fn measure(&mut self) {
        let fine = 8 * self.knots.len();
        let mut lengths = vec![0.0f32];
        let mut last = self.spline(0.0).0;
        for k in 1..=fine {
            let next = self.spline(k as f32 / fine as f32).0;
            lengths.push(lengths[k - 1] + (next - last).length());
            last = next;
        }
        self.length = lengths[fine];
        let find = |k: usize| {
            let wanted = self.length * k as f32 / fine as f32;
            let i = lengths.partition_point(|l| *l < wanted).clamp(1, fine);
            let t = (wanted - lengths[i - 1]) / (lengths[i] - lengths[i - 1]).max(1e-9);
            (i as f32 - 1.0 + t) / fine as f32
        };
        self.even = (0..=fine).map(find).collect();
    }

    /// The point at a share of the length, and the derivative by it.
    fn at(&self, share: f32) -> (Vec2, Vec2) {
        let last = self.even.len() - 1;
        let i = ((share * last as f32) as usize).min(last - 1);
        let t = share * last as f32 - i as f32;
        let (p, slope) = self.spline(self.even[i] * (1.0 - t) + self.even[i + 1] * t);
        (p, slope.normalize_or(vec2(-1.0, 0.0)) * self.length)
    }

    fn spline(&self, t: f32) -> (Vec2, Vec2) {
        let pieces = self.knots.len() - 3;
        let scaled = t.clamp(0.0, 1.0) * pieces as f32;
        let i = (scaled as usize).min(pieces - 1);
        let (values, slopes) = weights(scaled - i as f32);
        let blend = |w: [f32; 4]| (0..4).fold(Vec2::ZERO, |sum, k| sum + self.knots[i + k] * w[k]);
        (blend(values), blend(slopes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_and_normals_agree_with_the_surface() {
        let mesh = ball_mesh(64);
        let away = vec2(0.0, CENTER);
        for v in mesh.vertices() {
            let across = v.dpdu.cross(v.dpdv).normalize();
            assert!(across.dot(v.n) > 0.999 || v.p.x.hypot(v.p.z) < 1e-3, "{v:?}");
            assert!((v.n.length() - 1.0).abs() < 1e-4 && v.p.y >= -1e-3);
            // On the ball normals point away from its middle, but in the grooves' walls.
            let from = vec2(v.p.x.hypot(v.p.z), v.p.y) - away;
            let smooth = GROOVES.iter().all(|g| (from.to_angle().to_degrees() - g).abs() > 2.5 * GROOVE_WIDTH);
            if v.p.y > 0.5 && smooth {
                let outward = vec3(v.p.x, v.p.y - CENTER, v.p.z).normalize();
                assert!(outward.dot(v.n) > 0.995, "{v:?}");
            }
        }
        for t in mesh.triangles() {
            let [a, b, c] = t.map(|i| mesh.vertices()[i as usize]);
            let face = (b.p - a.p).cross(c.p - a.p);
            assert!(face.length() < 1e-7 || face.dot(a.n + b.n + c.n) > 0.0);
        }
    }
}
