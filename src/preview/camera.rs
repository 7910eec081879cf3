//! From a point on the film to a ray: a pinhole.

use glam::Vec3;

/// A half line.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    /// Unit.
    pub dir: Vec3,
}

pub struct Camera {
    eye: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
}

impl Camera {
    /// At `eye`, looking at `target`, y up. `angle` in radians is what the shorter side of the picture spans; `aspect`
    /// is width over height.
    pub fn look_at(eye: Vec3, target: Vec3, angle: f32, aspect: f32) -> Camera {
        let forward = (target - eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let half = (0.5 * angle).tan();
        let (w, h) = if aspect >= 1.0 { (half * aspect, half) } else { (half, half / aspect) };
        Camera { eye, right: right * w, up: right.cross(forward) * h, forward }
    }

    /// Through the film point (`x`, `y`), both 0 to 1, from the upper left corner.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let dir = self.forward + self.right * (2.0 * x - 1.0) + self.up * (1.0 - 2.0 * y);
        Ray { origin: self.eye, dir: dir.normalize() }
    }
}
