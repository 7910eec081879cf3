//! Several pictures in one: for comparing materials and sweeping a parameter.

use super::{Image, label};

/// Sets pictures next to each other, each with its text centred below; an empty text leaves only the picture, and if
/// all are empty there is no margin for them. `exposure` in stops is the one the strip will be shown with: the writing
/// keeps its brightness. `None` if there are no pictures.
pub fn strip(panels: &[(&Image, &str)], exposure: f32) -> Option<Image> {
    let tallest = panels.iter().map(|(image, _)| image.height()).max()?;
    let gap = (tallest / 128).max(2);
    let total: u32 = panels.iter().map(|(image, _)| image.width()).sum::<u32>() + gap * (panels.len() as u32 - 1);
    let scale = panels.iter().map(|(image, text)| text_scale(image, text)).min()?;
    let labelled = panels.iter().any(|(_, text)| !text.is_empty());
    let margin = if labelled { 2 * label::height(scale) } else { 0 };
    let shown = |value: f32| [value * (-exposure).exp2(); 3];
    let mut out = Image::filled(total, tallest + margin, shown(0.012));
    let mut left = 0;
    for (image, text) in panels {
        for y in 0..image.height() {
            for x in 0..image.width() {
                out.set_pixel(left + x, y, image.pixel(x, y));
            }
        }
        let indent = (i64::from(image.width()) - i64::from(label::width(text, scale))) / 2;
        let top = i64::from(tallest + label::height(scale) / 2);
        label::draw(&mut out, text, i64::from(left) + indent, top, scale, shown(0.7));
        left += image.width() + gap;
    }
    Some(out)
}

/// The largest whole scale, up to a sixteenth of the picture's height, at which the text fits below it; at least 1.
fn text_scale(image: &Image, text: &str) -> u32 {
    let widest = image.width() / label::width(text, 1).max(1);
    let tallest = image.height() / (16 * label::height(1));
    widest.min(tallest).max(1)
}
