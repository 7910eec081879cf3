//! Color spaces, between linear RGB (Rec. 709 primaries, D65) and others.

/// Names by their number. `sRGB` is display-encoded; the others hold linear light.
pub const SPACES: &[&str] = &["rgb", "RGB", "hsv", "hsl", "YIQ", "XYZ", "xyY", "sRGB"];

type Rgb = [f32; 3];

/// Converts a color between the spaces numbered in [`SPACES`]. Unknown numbers mean RGB.
pub fn transform(from: usize, to: usize, c: Rgb) -> Rgb {
    let name = |i: usize| SPACES.get(i).copied().unwrap_or("rgb");
    if name(from) == name(to) {
        return c;
    }
    let rgb = match name(from) {
        "hsv" => from_hsv(c),
        "hsl" => from_hsl(c),
        "YIQ" => apply(&FROM_YIQ, c),
        "XYZ" => apply(&FROM_XYZ, c),
        "xyY" => apply(&FROM_XYZ, from_chromaticity(c)),
        "sRGB" => c.map(decode),
        _ => c,
    };
    match name(to) {
        "hsv" => to_hsv(rgb),
        "hsl" => to_hsl(rgb),
        "YIQ" => apply(&TO_YIQ, rgb),
        "XYZ" => apply(&TO_XYZ, rgb),
        "xyY" => to_chromaticity(apply(&TO_XYZ, rgb)),
        "sRGB" => rgb.map(encode),
        _ => rgb,
    }
}

/// IEC 61966-2-1, and its inverse.
const TO_XYZ: [Rgb; 3] = [
    [0.412_390_8, 0.357_584_33, 0.180_480_8],
    [0.212_639, 0.715_168_65, 0.072_192_32],
    [0.019_330_82, 0.119_194_78, 0.950_532_14],
];
const FROM_XYZ: [Rgb; 3] = [
    [3.240_97, -1.537_383_2, -0.498_610_76],
    [-0.969_243_65, 1.875_967_5, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_5],
];
/// FCC 1953, and its inverse.
const TO_YIQ: [Rgb; 3] =
    [[0.299, 0.587, 0.114], [0.595_716, -0.274_453, -0.321_263], [0.211_456, -0.522_591, 0.311_135]];
const FROM_YIQ: [Rgb; 3] =
    [[1.0, 0.956_295_7, 0.621_024_4], [1.0, -0.272_122_1, -0.647_380_6], [1.0, -1.106_989, 1.704_614_9]];

fn apply(m: &[Rgb; 3], c: Rgb) -> Rgb {
    m.map(|row| row[0] * c[0] + row[1] * c[1] + row[2] * c[2])
}

fn to_chromaticity([x, y, z]: Rgb) -> Rgb {
    let sum = x + y + z;
    if sum == 0.0 { [0.0; 3] } else { [x / sum, y / sum, y] }
}

fn from_chromaticity([x, y, luminance]: Rgb) -> Rgb {
    if y == 0.0 { [0.0; 3] } else { [x * luminance / y, luminance, (1.0 - x - y) * luminance / y] }
}

fn decode(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

fn encode(x: f32) -> f32 {
    if x <= 0.003_130_8 { x * 12.92 } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// Hue in turns, and the largest and smallest channel.
fn hue([r, g, b]: Rgb) -> (f32, f32, f32) {
    let (max, min) = (r.max(g).max(b), r.min(g).min(b));
    let range = max - min;
    let hue = if range <= 0.0 {
        0.0
    } else if r == max {
        (g - b) / range
    } else if g == max {
        2.0 + (b - r) / range
    } else {
        4.0 + (r - g) / range
    };
    ((hue / 6.0).rem_euclid(1.0), max, min)
}

/// The fully saturated color of a hue.
fn saturated(hue: f32) -> Rgb {
    [0.0, 2.0, 1.0].map(|shift: f32| {
        let x = (hue.rem_euclid(1.0) * 6.0 + shift * 2.0).rem_euclid(6.0);
        ((x - 3.0).abs() - 1.0).clamp(0.0, 1.0)
    })
}

fn to_hsv(rgb: Rgb) -> Rgb {
    let (hue, max, min) = hue(rgb);
    [hue, if max > 0.0 { (max - min) / max } else { 0.0 }, max]
}

fn from_hsv([h, s, v]: Rgb) -> Rgb {
    saturated(h).map(|x| v * (1.0 - s + s * x))
}

fn to_hsl(rgb: Rgb) -> Rgb {
    let (hue, max, min) = hue(rgb);
    let l = 0.5 * (max + min);
    let room = 1.0 - (2.0 * l - 1.0).abs();
    [hue, if room > 0.0 { (max - min) / room } else { 0.0 }, l]
}

fn from_hsl([h, s, l]: Rgb) -> Rgb {
    let chroma = (1.0 - (2.0 * l - 1.0).abs()) * s;
    saturated(h).map(|x| l + chroma * (x - 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_space_leads_back() {
        for (space, name) in SPACES.iter().enumerate() {
            for k in 0..216 {
                let c = [k % 6, k / 6 % 6, k / 36].map(|x| 0.02 + x as f32 * 0.19);
                let back = transform(space, 0, transform(0, space, c));
                for i in 0..3 {
                    assert!((back[i] - c[i]).abs() < 2e-5, "{name}: {c:?} {back:?}");
                }
            }
        }
    }

    #[test]
    fn known_colors() {
        let of = |name: &str| SPACES.iter().position(|s| *s == name).expect("a space");
        let close = |a: Rgb, b: Rgb| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(close(transform(of("hsv"), 0, [1.0 / 3.0, 1.0, 0.5]), [0.0, 0.5, 0.0]));
        assert!(close(transform(of("hsl"), 0, [2.0 / 3.0, 1.0, 0.5]), [0.0, 0.0, 1.0]));
        assert!(close(transform(0, of("XYZ"), [1.0; 3]), [0.9505, 1.0, 1.089]));
        assert!(close(transform(0, of("xyY"), [1.0; 3]), [0.3127, 0.329, 1.0]));
        assert!(close(transform(0, of("YIQ"), [1.0; 3]), [1.0, 0.0, 0.0]));
        assert!(close(transform(0, of("sRGB"), [0.5; 3]), [0.7354; 3]));
        for (space, _) in SPACES.iter().enumerate() {
            assert!(transform(space, 0, transform(0, space, [0.0; 3])).iter().all(|x| x.abs() < 1e-6));
        }
    }
}
