//! Directional albedos: curves a layer may rely on because they never fall below the truth.

/// What a lobe asks to be baked.
#[derive(Clone, Debug)]
pub struct CurveSpec {}

/// Albedo over the cosine.
#[derive(Clone, Debug)]
pub struct AlbedoCurve<S> {
    pub x: Vec<S>,
}
