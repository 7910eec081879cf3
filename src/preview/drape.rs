//! A square cloth laid over a ball: made by letting it fall.
//!
//! Nothing comes in but how fine the mesh shall be; out comes the [`Mesh`]. Position-based dynamics (Müller et al. 2007)
//! in small steps (Macklin et al. 2019), first on a coarse net, then on a finer one, serially and without randomness, so that
//! the folds are the same everywhere. The mesh is a cubic B-spline surface through the finest net: its derivatives give
//! normals and tangents that agree with its coordinates. u runs along the warp, v along the weft, dPdu × dPdv is the
//! upper side. The ball itself is taken away again.

use super::mesh::{Mesh, Vertex};
use glam::{Vec2, Vec3, vec2, vec3};

/// Segments per side of the mesh that is rendered.
pub const RESOLUTION: usize = 288;

/// Length of the cloth's side, in world units.
const SIDE: f32 = 2.95;
const BALL: Vec3 = vec3(0.0, 1.08, 0.0);
const BALL_RADIUS: f32 = 0.5;
/// The lowest the cloth may come: half its thickness above the floor.
const FLOOR: f32 = 0.012;
/// Segments per side of the nets that fall, and how many steps each is given.
const NETS: [(usize, usize); 2] = [(56, 1100), (112, 420)];

/// The draped cloth with `resolution` segments per side.
pub fn drape_mesh(resolution: usize) -> Mesh {
    let mut net = Net::flat(NETS[0].0);
    for (segments, steps) in NETS {
        net = net.refined(segments);
        net.fall(steps);
    }
    tessellate(&net, resolution.max(1))
}

/// The cloth as points with a velocity, `segments` + 1 per side; u runs fastest.
struct Net {
    segments: usize,
    points: Vec<Vec3>,
    velocities: Vec<Vec3>,
}

/// A pair of points kept at a distance.
struct Thread {
    a: u32,
    b: u32,
    length: f32,
    /// The share of a stretch, and of a squeeze, that one pass takes back.
    pull: f32,
    push: f32,
}

impl Net {
    /// Flat above the ball. Turned and shifted a little, as by hand: a cloth laid exactly straight would fold in perfect
    /// symmetry.
    fn flat(segments: usize) -> Net {
        let (sin, cos) = 0.42f32.sin_cos();
        let point = |at: Vec2| {
            let (x, z) = ((at.x - 0.5) * SIDE + 0.03, (0.5 - at.y) * SIDE - 0.05);
            let wave = 0.012 * ((5.0 * at.x + 1.0).sin() * (7.0 * at.y).cos() + (11.0 * at.y + 3.0 * at.x).sin());
            vec3(cos * x + sin * z, BALL.y + BALL_RADIUS + 0.03 + wave, -sin * x + cos * z)
        };
        let points: Vec<Vec3> = grid(segments).map(point).collect();
        Net { segments, velocities: vec![Vec3::ZERO; points.len()], points }
    }

    /// The same cloth as a finer net.
    fn refined(&self, segments: usize) -> Net {
        if segments == self.segments {
            return Net { segments, points: self.points.clone(), velocities: self.velocities.clone() };
        }
        let pick = |values: &[Vec3]| grid(segments).map(|at| spline(self.segments, values, at).value).collect();
        Net { segments, points: pick(&self.points), velocities: pick(&self.velocities) }
    }

    fn fall(&mut self, steps: usize) {
        const STEP: f32 = 1.0 / 420.0;
        const GRAVITY: Vec3 = vec3(0.0, -9.8, 0.0);
        let threads = self.threads();
        let mut before = self.points.clone();
        for step in 0..steps {
            // Air slows the fall, more so toward the end, until the cloth hangs still.
            let damping = 1.0 - STEP * (1.5 + 8.0 * step as f32 / steps as f32);
            before.copy_from_slice(&self.points);
            for (p, v) in self.points.iter_mut().zip(&mut self.velocities) {
                *v = (*v + GRAVITY * STEP) * damping;
                *p += *v * STEP;
            }
            // Forward and backward in turn, lest the order of the pairs pull the cloth one way.
            if step % 2 == 0 {
                threads.iter().for_each(|thread| thread.relax(&mut self.points));
            } else {
                threads.iter().rev().for_each(|thread| thread.relax(&mut self.points));
            }
            for ((p, v), old) in self.points.iter_mut().zip(&mut self.velocities).zip(&before) {
                *p = collide(*p, *old);
                *v = (*p - *old) / STEP;
            }
        }
    }

    /// Warp and weft hardly stretch, the bias gives a little, and bending resists weakly.
    fn threads(&self) -> Vec<Thread> {
        let n = self.segments as i32;
        let spacing = SIDE / self.segments as f32;
        let mut threads = Vec::new();
        // Bending counts for less per pair the finer the net.
        let bend = 0.10 * (56.0 / self.segments as f32).powi(2);
        for (du, dv, pull, push) in [
            (1, 0, 0.95, 0.95),
            (0, 1, 0.95, 0.95),
            (1, 1, 0.30, 0.12),
            (-1, 1, 0.30, 0.12),
            (2, 0, 0.5, bend),
            (0, 2, 0.5, bend),
            (4, 0, 0.3, 0.4 * bend),
            (0, 4, 0.3, 0.4 * bend),
        ] {
            let length = spacing * ((du * du + dv * dv) as f32).sqrt();
            for v in 0..=n - dv {
                for u in 0.max(-du)..=n.min(n - du) {
                    let index = |u: i32, v: i32| (v * (n + 1) + u) as u32;
                    threads.push(Thread { a: index(u, v), b: index(u + du, v + dv), length, pull, push });
                }
            }
        }
        threads
    }
}

impl Thread {
    fn relax(&self, points: &mut [Vec3]) {
        let (a, b) = (self.a as usize, self.b as usize);
        let between = points[b] - points[a];
        let distance = between.length();
        if distance < 1e-9 {
            return;
        }
        let excess = distance - self.length;
        let share = if excess > 0.0 { self.pull } else { self.push };
        let correction = between * (0.5 * share * excess / distance);
        points[a] += correction;
        points[b] -= correction;
    }
}

/// Pushes a point out of ball and floor, and holds it back where it rubs against them.
fn collide(p: Vec3, old: Vec3) -> Vec3 {
    let mut p = p;
    let from = p - BALL;
    let distance = from.length();
    if distance < BALL_RADIUS {
        let n = from / distance.max(1e-6);
        p = rub(BALL + n * BALL_RADIUS, old, n, 0.25);
    }
    if p.y < FLOOR {
        p = rub(vec3(p.x, FLOOR, p.z), old, Vec3::Y, 0.3);
    }
    p
}

/// Takes back a share of the slide along the surface with normal `n`.
fn rub(p: Vec3, old: Vec3, n: Vec3, share: f32) -> Vec3 {
    let slide = p - old;
    p - (slide - n * slide.dot(n)) * share
}

/// Cloth coordinates of the points of a net, u fastest.
fn grid(segments: usize) -> impl Iterator<Item = Vec2> {
    let at = move |i: usize| i as f32 / segments as f32;
    (0..=segments).flat_map(move |v| (0..=segments).map(move |u| vec2(at(u), at(v))))
}

/// A point of the spline surface and its derivatives by u and v.
struct Patch {
    value: Vec3,
    du: Vec3,
    dv: Vec3,
}

/// The uniform cubic B-spline over a net of values at `at` in [0, 1]². Beyond its edges the net goes on straight, so the
/// surface ends where the net does.
fn spline(segments: usize, values: &[Vec3], at: Vec2) -> Patch {
    let n = segments as i32;
    let locate = |x: f32| {
        let scaled = x * segments as f32;
        let i = (scaled as i32).clamp(0, n - 1);
        (i, scaled - i as f32)
    };
    let ((iu, tu), (iv, tv)) = (locate(at.x), locate(at.y));
    let line = |v: i32, u: i32| {
        let row = v as usize * (segments + 1);
        beyond(u, n, |u| values[row + u as usize])
    };
    let value = |u: i32, v: i32| beyond(v, n, |v| line(v, u));
    let (wu, du) = weights(tu);
    let (wv, dv) = weights(tv);
    let mut patch = Patch { value: Vec3::ZERO, du: Vec3::ZERO, dv: Vec3::ZERO };
    for j in 0..4 {
        for i in 0..4 {
            let p = value(iu + i as i32 - 1, iv + j as i32 - 1);
            patch.value += p * (wu[i] * wv[j]);
            patch.du += p * (du[i] * wv[j] * segments as f32);
            patch.dv += p * (wu[i] * dv[j] * segments as f32);
        }
    }
    patch
}

/// `f` at `i`, continued straight one step beyond 0 and `n`.
fn beyond(i: i32, n: i32, f: impl Fn(i32) -> Vec3) -> Vec3 {
    if i < 0 {
        2.0 * f(0) - f(1)
    } else if i > n {
        2.0 * f(n) - f(n - 1)
    } else {
        f(i)
    }
}

/// The four cubic B-spline weights at `t` in [0, 1], and their derivatives.
pub(super) fn weights(t: f32) -> ([f32; 4], [f32; 4]) {
    let s = 1.0 - t;
    let value = [s * s * s, 3.0 * t * t * t - 6.0 * t * t + 4.0, 3.0 * s * s * s - 6.0 * s * s + 4.0, t * t * t];
    let slope = [-s * s, (3.0 * t - 4.0) * t, (4.0 - 3.0 * s) * s, t * t];
    (value.map(|w| w / 6.0), slope.map(|w| w / 2.0))
}

fn tessellate(net: &Net, resolution: usize) -> Mesh {
    let vertex = |at: Vec2| {
        let patch = spline(net.segments, &net.points, at);
        let n = patch.du.cross(patch.dv).normalize_or(Vec3::Y);
        Vertex { p: patch.value, n, u: at.x, v: at.y, dpdu: patch.du, dpdv: patch.dv }
    };
    let vertices = grid(resolution).map(vertex).collect();
    let mut triangles = Vec::with_capacity(2 * resolution * resolution);
    for v in 0..resolution {
        for u in 0..resolution {
            let [a, b, c, d] =
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| ((v + j) * (resolution + 1) + u + i) as u32);
            triangles.push([a, b, d]);
            triangles.push([a, d, c]);
        }
    }
    Mesh::new(vertices, triangles)
}
