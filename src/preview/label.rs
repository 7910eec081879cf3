//! Short texts in a picture, in the 8×8 font of the public-domain PC character set that `font8x8` carries.

use super::Image;
use font8x8::UnicodeFonts;

/// Height and width of a character in font pixels.
const CELL: u32 = 8;

/// Width in pixels of a text with font pixels `scale` wide.
pub fn width(text: &str, scale: u32) -> u32 {
    text.chars().count() as u32 * CELL * scale
}

/// Height in pixels of a line.
pub fn height(scale: u32) -> u32 {
    CELL * scale
}

/// Writes a line with its upper left corner at (`left`, `top`); what falls outside the picture is cut off.
pub fn draw(image: &mut Image, text: &str, left: i64, top: i64, scale: u32, ink: [f32; 3]) {
    for (i, c) in text.chars().enumerate() {
        let glyph = glyph(c);
        let x = left + i as i64 * i64::from(CELL * scale);
        for row in 0..CELL * scale {
            for column in 0..CELL * scale {
                let lit = glyph[(row / scale) as usize] >> (column / scale) & 1 == 1;
                let (px, py) = (x + i64::from(column), top + i64::from(row));
                let inside =
                    (0..i64::from(image.width())).contains(&px) && (0..i64::from(image.height())).contains(&py);
                if lit && inside {
                    image.set_pixel(px as u32, py as u32, ink);
                }
            }
        }
    }
}

/// One byte a row, least bit to the left; a question mark for what the font does not have.
fn glyph(c: char) -> [u8; 8] {
    use font8x8::{BASIC_FONTS, GREEK_FONTS, LATIN_FONTS};
    BASIC_FONTS
        .get(c)
        .or_else(|| LATIN_FONTS.get(c))
        .or_else(|| GREEK_FONTS.get(c))
        .or_else(|| BASIC_FONTS.get('?'))
        .unwrap_or_default()
}
