//! From radiance to what a screen shows.

/// Where the shoulder begins: below it the curve is the identity, so that midtones and saturated dark colours come out
/// exactly as computed.
const KNEE: f32 = 0.7;

/// Linear radiance to a display value in [0, 1], per channel: exposure in stops, then a shoulder that bends values
/// above 0.7 smoothly toward 1 instead of clipping them, then the sRGB curve.
///
/// The shoulder is k + (1−k)·(1 − exp(−(x−k)/(1−k))): slope one at the knee, never reaching white. A radiance of 1
/// shows as 0.89 (linear), of 2 as 0.996.
pub fn display(rgb: [f32; 3], exposure: f32) -> [f32; 3] {
    let gain = exposure.exp2();
    rgb.map(|c| srgb(shoulder(c * gain)))
}

fn shoulder(x: f32) -> f32 {
    let x = x.max(0.0);
    if x <= KNEE { x } else { KNEE + (1.0 - KNEE) * (1.0 - (-(x - KNEE) / (1.0 - KNEE)).exp()) }
}

/// IEC 61966-2-1.
fn srgb(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}
