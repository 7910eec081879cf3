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
    /// How the point differs from those that the neighbouring pixels show. Read only if the host says that it gives
    /// derivatives.
    pub differentials: Differentials,
}

/// What changes by one pixel to the right (`x`) and one pixel down (`y`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differentials {
    /// Of the position.
    pub dpdx: Vec3,
    /// Of the position, downward.
    pub dpdy: Vec3,
    /// Of the direction the ray travels.
    pub didx: Vec3,
    /// Of the direction the ray travels, downward.
    pub didy: Vec3,
    /// Of the first surface parameter.
    pub dudx: f32,
    /// Of the first surface parameter, downward.
    pub dudy: f32,
    /// Of the second surface parameter.
    pub dvdx: f32,
    /// Of the second surface parameter, downward.
    pub dvdy: f32,
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
            differentials: Differentials::default(),
        }
    }
}

impl Globals {
    /// A point where no two directions coincide: what is alike there comes from the same place everywhere.
    pub(crate) fn apart() -> Globals {
        Globals {
            n: Vec3::new(0.13, -0.21, 0.97),
            ng: Vec3::new(-0.31, 0.17, 0.94),
            dpdu: Vec3::new(0.91, 0.37, 0.19),
            dpdv: Vec3::new(-0.41, 0.88, 0.23),
            p: Vec3::new(0.29, 0.53, -0.67),
            ..Globals::default()
        }
    }
}
