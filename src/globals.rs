//! What a host tells a shader about the point being shaded.

use glam::Vec3;

/// The shading point, in world space. `N` points toward the viewer; a host that finds the back of a surface flips it
/// and sets [`backfacing`](Globals::backfacing).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Globals {
    /// Position.
    pub p: Vec3,
    /// Shading normal. Zero or non-finite: the geometric normal is used.
    pub n: Vec3,
    /// Geometric normal.
    pub ng: Vec3,
    /// Direction the ray travels: −ωo.
    pub i: Vec3,
    /// Surface parameters.
    pub u: f32,
    /// The second surface parameter.
    pub v: f32,
    /// ∂P/∂u: where azimuths and tangents are measured from.
    pub dpdu: Vec3,
    /// ∂P/∂v.
    pub dpdv: Vec3,
    /// Shutter time in seconds.
    pub time: f32,
    /// The ray hit the side the surface's own normal points away from.
    pub backfacing: bool,
}

impl Default for Globals {
    /// The origin of a plane with its normal along z, u along x, seen from straight above.
    fn default() -> Self {
        Globals {
            p: Vec3::ZERO,
            n: Vec3::Z,
            ng: Vec3::Z,
            i: Vec3::NEG_Z,
            u: 0.0,
            v: 0.0,
            dpdu: Vec3::X,
            dpdv: Vec3::Y,
            time: 0.0,
            backfacing: false,
        }
    }
}
