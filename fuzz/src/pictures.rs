//! Pictures that light a scene: any bytes are one, or an error.

use super::bytes::Bytes;
use overcoat::preview::Environment;

/// Reads bytes as a picture; one that is read gives light that is finite, and directions of unit length.
pub fn light(bytes: &[u8]) {
    let Ok(environment) = Environment::from_bytes(bytes, 1 << 24) else { return };
    // The last bytes, so that they change with the picture.
    let mut numbers = Bytes(&bytes[bytes.len().saturating_sub(64)..]);
    for _ in 0..8 {
        let (radiance, pdf) = environment.look(numbers.direction().into());
        assert!(radiance.is_finite() && radiance.min_element() >= 0.0, "{radiance}");
        assert!(pdf.is_finite() && pdf >= 0.0, "{pdf}");
        let Some(drawn) = environment.sample([numbers.unit(), numbers.unit()]) else { continue };
        assert!((drawn.dir.length() - 1.0).abs() < 1e-4, "{drawn:?}");
        assert!(drawn.radiance.is_finite() && drawn.radiance.min_element() >= 0.0, "{drawn:?}");
        assert!(drawn.pdf.is_finite() && drawn.pdf > 0.0, "{drawn:?}");
    }
}
