//! What a lobe of known parameters reads in one place: its own functions of a cosine beside its albedos.

/// Tables of `optics::octaves` in single precision; what the functions are, the lobe knows.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    /// Over sin² of the half vector's angle: a cubic. 64 octaves of 16 cells.
    pub half: Box<[[f32; 4]; 1024]>,
    /// Over the cosine of a direction toward a light, from both ends: a cubic, and a square that nowhere lies below the
    /// albedo's bound. 32 octaves of 16 cells each way.
    pub light: Box<[[f32; 8]; 1024]>,
    /// Over the viewer's cosine, from both ends: a cubic, and the albedo as another. 32 octaves of 8 cells each way.
    pub viewer: Box<[[f32; 8]; 512]>,
}

impl Cells {
    /// Memory they take.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.half) + size_of_val(&*self.light) + size_of_val(&*self.viewer)
    }
}
