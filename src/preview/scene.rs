//! What a ray can hit: the subject, the floor, or nothing but light.

use super::camera::{Camera, Ray};
use super::mesh::Mesh;
use super::{Environment, Scene, View, ball, drape, sphere};
use glam::{Vec3, vec3};
use std::sync::{Arc, OnceLock};

/// Distance kept from the surface a ray leaves, in world units.
pub const EPSILON: f32 = 2e-4;

/// A point of the subject, as its own geometry has it: nothing is flipped toward a viewer yet.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub p: Vec3,
    /// Smooth normal, unit.
    pub n: Vec3,
    /// Geometric normal, unit, on the side of `n`.
    pub ng: Vec3,
    pub u: f32,
    pub v: f32,
    pub dpdu: Vec3,
    pub dpdv: Vec3,
    /// Where rays leave to the side of `ng`, and to the other.
    pub outside: Vec3,
    pub inside: Vec3,
}

/// What a ray met.
pub enum Hit {
    Subject(Point),
    /// The floor: where, and how much of it is there (it fades into the backdrop far out).
    Floor {
        p: Vec3,
        opacity: f32,
    },
    Nothing,
}

enum Subject {
    Sphere,
    Mesh(Arc<Mesh>),
}

pub struct World {
    subject: Subject,
    floor: Option<Floor>,
    pub environment: Environment,
}

/// A disc at y = 0 that fades out between two radii.
struct Floor {
    fade: [f32; 2],
}

/// What the floor reflects.
pub const FLOOR_ALBEDO: Vec3 = vec3(0.20, 0.20, 0.205);

impl World {
    pub fn new(scene: Scene, environment: Environment) -> World {
        let floor = Some(Floor { fade: [2.5, 9.0] });
        match scene {
            Scene::Sphere => World { subject: Subject::Sphere, floor, environment },
            Scene::Furnace => World { subject: Subject::Sphere, floor: None, environment },
            Scene::Ball => World { subject: Subject::Mesh(ball_once()), floor, environment },
            Scene::Drape => World { subject: Subject::Mesh(drape_once()), floor, environment },
        }
    }

    /// The nearest thing along the ray.
    pub fn hit(&self, ray: Ray) -> Hit {
        let floor = self.floor.as_ref().and_then(|floor| floor.intersect(ray));
        let t_max = floor.map_or(f32::INFINITY, |(t, _)| t);
        let subject = match &self.subject {
            Subject::Sphere => sphere::intersect(ray, t_max).map(|t| sphere::surface(ray, t)),
            Subject::Mesh(mesh) => mesh.intersect(ray, t_max).map(|hit| mesh.surface(hit)),
        };
        match (subject, floor) {
            (Some(point), _) => Hit::Subject(point),
            (None, Some((t, opacity))) => {
                let p = ray.origin + ray.dir * t;
                Hit::Floor { p: vec3(p.x, 0.0, p.z), opacity }
            }
            (None, None) => Hit::Nothing,
        }
    }

    /// The share of the environment's light that comes through along the ray, 0 to 1.
    pub fn visibility(&self, ray: Ray) -> f32 {
        let open = self.floor.as_ref().and_then(|floor| floor.intersect(ray)).map_or(1.0, |(_, opacity)| 1.0 - opacity);
        let blocked = open <= 0.0
            || match &self.subject {
                Subject::Sphere => sphere::intersect(ray, f32::INFINITY).is_some(),
                Subject::Mesh(mesh) => mesh.occluded(ray),
            };
        if blocked { 0.0 } else { open }
    }
}

impl Floor {
    /// Distance and opacity where the ray comes down onto the floor; from below there is none.
    fn intersect(&self, ray: Ray) -> Option<(f32, f32)> {
        if ray.dir.y >= 0.0 || ray.origin.y <= 0.0 {
            return None;
        }
        let t = -ray.origin.y / ray.dir.y;
        let p = ray.origin + ray.dir * t;
        let x = (((p.x * p.x + p.z * p.z).sqrt() - self.fade[0]) / (self.fade[1] - self.fade[0])).clamp(0.0, 1.0);
        let opacity = 1.0 - x * x * (3.0 - 2.0 * x);
        (opacity > 0.0).then_some((t, opacity))
    }
}

/// Where each scene is seen from; `aspect` is width over height.
pub fn camera(scene: Scene, view: View, aspect: f32) -> Camera {
    let (eye, target, degrees) = match scene {
        Scene::Sphere => (vec3(0.0, 2.5, 7.2), vec3(0.0, 0.93, 0.0), 21.5),
        Scene::Furnace => (vec3(0.0, 1.0, 7.2), vec3(0.0, 1.0, 0.0), 21.5),
        Scene::Ball => (vec3(0.0, 2.75, 7.2), vec3(0.0, 0.91, 0.0), 20.5),
        Scene::Drape => (vec3(1.2, 2.9, 7.2), vec3(0.03, 0.76, 0.0), 18.5),
    };
    let eye = if view == View::default() { eye } else { orbit(eye, target, view, scene != Scene::Furnace) };
    Camera::look_at(eye, target, f32::to_radians(degrees), aspect)
}

/// The eye carried around its target; above the floor where there is one, and never straight above or below.
fn orbit(eye: Vec3, target: Vec3, view: View, floor: bool) -> Vec3 {
    const STEEPEST: f32 = 1.53;
    let (from, distance) = (eye - target, (eye - target).length() * view.distance.clamp(0.25, 4.0));
    let lowest = if floor { ((0.05 - target.y) / distance).clamp(-1.0, 1.0).asin() } else { -STEEPEST };
    let rise = ((from.y / from.length()).asin() + view.rise).clamp(lowest, STEEPEST);
    let turn = from.x.atan2(from.z) + view.turn;
    target + vec3(rise.cos() * turn.sin(), rise.sin(), rise.cos() * turn.cos()) * distance
}

/// The drape takes a moment to fall, and always falls the same way.
fn drape_once() -> Arc<Mesh> {
    static DRAPE: OnceLock<Arc<Mesh>> = OnceLock::new();
    DRAPE.get_or_init(|| Arc::new(drape::drape_mesh(drape::RESOLUTION))).clone()
}

fn ball_once() -> Arc<Mesh> {
    static BALL: OnceLock<Arc<Mesh>> = OnceLock::new();
    BALL.get_or_init(|| Arc::new(ball::ball_mesh(ball::RESOLUTION))).clone()
}
