//! Functions on strings: numbers in them, parts of them, `format`.

use crate::ir::body::Cells;
use crate::ir::types::Ty;

/// The whole number a text begins with; 0 if there is none.
pub fn to_int(text: &str) -> i32 {
    let text = text.trim_start();
    let sign = usize::from(text.starts_with(['-', '+']));
    let digits = text[sign..].bytes().take_while(u8::is_ascii_digit).count();
    let value = text[..sign + digits].trim_start_matches('+').parse::<i64>().unwrap_or(0);
    value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// The number a text begins with; 0 if there is none.
pub fn to_float(text: &str) -> f32 {
    let text = text.trim_start();
    let sign = usize::from(text.starts_with(['-', '+']));
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut end = sign + digits(sign);
    if text[end..].starts_with('.') {
        end += 1 + digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let from = end + 1 + usize::from(text[end + 1..].starts_with(['-', '+']));
        if digits(from) > 0 {
            end = from + digits(from);
        }
    }
    text[..end].parse().unwrap_or(0.0)
}

/// `length` characters from `start` on; a negative start counts from the end.
pub fn part(text: &str, start: i32, length: i32) -> String {
    let count = text.chars().count() as i64;
    let start = if start < 0 { (count + i64::from(start)).max(0) } else { i64::from(start).min(count) };
    let length = i64::from(length).clamp(0, count - start);
    text.chars().skip(start as usize).take(length as usize).collect()
}

/// The pieces between separators, at most `most`; without a separator, between blanks.
pub fn split(text: &str, separator: &str, most: usize) -> Vec<String> {
    let pieces: Vec<String> = match separator {
        "" => text.split_whitespace().map(str::to_owned).collect(),
        separator => text.split(separator).map(str::to_owned).collect(),
    };
    let most = most.min(pieces.len());
    pieces.into_iter().take(most).collect()
}

/// A number for a text (FNV-1a).
pub fn hash(text: &str) -> i32 {
    text.bytes().fold(0x811c_9dc5u32, |h, b| (h ^ u32::from(b)).wrapping_mul(0x0100_0193)) as i32
}

/// The longest field a format may ask for.
const MAX_WIDTH: usize = 256;

/// What `printf` writes. `args`: type, value, text where it is a string.
pub fn format(pattern: &str, args: &[(Ty, Cells, &str)]) -> String {
    let mut out = String::new();
    let mut args = args.iter();
    let mut rest = pattern;
    while let Some(at) = rest.find('%') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        if let Some(after) = rest.strip_prefix('%') {
            out.push('%');
            rest = after;
            continue;
        }
        let end = rest.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(rest.len());
        let (flags, verb) = (&rest[..end], rest[end..].chars().next());
        rest = &rest[(end + verb.map_or(0, char::len_utf8)).min(rest.len())..];
        let Some((ty, cells, text)) = args.next() else { continue };
        if *ty == Ty::String || !ty.is_numeric() {
            out.push_str(&padded(flags, (*text).to_owned()));
            continue;
        }
        let numbers = &cells[..ty.cells()];
        let one = |bits: &u32| number(flags, verb.unwrap_or('g'), *ty == Ty::Int, *bits);
        out.push_str(&numbers.iter().map(one).collect::<Vec<_>>().join(" "));
    }
    out.push_str(rest);
    out
}

fn number(flags: &str, verb: char, int: bool, bits: u32) -> String {
    let value = if int { f64::from(bits as i32) } else { f64::from(f32::from_bits(bits)) };
    let precision = flags.split_once('.').and_then(|(_, digits)| digits.parse::<usize>().ok());
    let places = precision.unwrap_or(6).min(60);
    let text = match verb {
        'd' | 'i' | 'u' => (value as i64).to_string(),
        'x' => format!("{:x}", value as i32),
        'X' => format!("{:X}", value as i32),
        'o' => format!("{:o}", value as i32),
        'c' => u8::try_from(value as i64).map_or(String::new(), |b| (b as char).to_string()),
        'f' | 'F' => format!("{value:.places$}"),
        'e' | 'E' => exponent(value, places),
        _ if int => (value as i64).to_string(),
        _ => general(value, places.max(1)),
    };
    let signed = flags.contains('+') && value >= 0.0;
    padded(flags, if signed { format!("+{text}") } else { text })
}

/// As C's `%e`.
fn exponent(value: f64, places: usize) -> String {
    let text = format!("{value:.places$e}");
    match text.split_once('e') {
        Some((digits, power)) => {
            let power: i32 = power.parse().unwrap_or(0);
            format!("{digits}e{}{:02}", if power < 0 { '-' } else { '+' }, power.abs())
        }
        None => text,
    }
}

/// As C's `%g`.
fn general(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let scientific = format!("{:.*e}", digits - 1, value);
    let power: i32 = scientific.split_once('e').and_then(|(_, p)| p.parse().ok()).unwrap_or(0);
    let trimmed = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if power < -4 || power >= digits as i32 {
        let text = exponent(value, digits - 1);
        return match text.split_once('e') {
            Some((mantissa, power)) => format!("{}e{power}", trimmed(mantissa)),
            None => text,
        };
    }
    trimmed(&format!("{value:.*}", (digits as i32 - 1 - power).max(0) as usize))
}

fn padded(flags: &str, text: String) -> String {
    let digits = flags.trim_start_matches(['-', '+', ' ', '#']);
    let zeros = digits.starts_with('0');
    let width = digits.split('.').next().unwrap_or("").parse::<usize>().unwrap_or(0).min(MAX_WIDTH);
    let missing = width.saturating_sub(text.chars().count());
    let fill = |c: &str| c.repeat(missing);
    match (flags.contains('-'), zeros) {
        (true, _) => text + &fill(" "),
        (false, true) => match text.strip_prefix('-') {
            Some(rest) => format!("-{}{rest}", fill("0")),
            None => fill("0") + &text,
        },
        (false, false) => fill(" ") + &text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_print_as_in_c() {
        let f = |x: f32| (Ty::Float, [x.to_bits(), 0, 0], "");
        let i = |x: i32| (Ty::Int, [x as u32, 0, 0], "");
        let c = (Ty::Color, [1.0f32, 0.5, 0.25].map(f32::to_bits), "");
        assert_eq!(format("%d|%4d|%-4d|%04d|%x", &[i(7), i(7), i(7), i(-7), i(255)]), "7|   7|7   |-007|ff");
        assert_eq!(
            format("%f|%.2f|%g|%g|%g", &[f(1.5), f(1.5), f(1.5), f(1e-5), f(1e20)]),
            "1.500000|1.50|1.5|1e-05|1e+20"
        );
        assert_eq!(
            format("%g|%s|%%|%5s", &[c, (Ty::String, [0; 3], "a"), (Ty::String, [0; 3], "b")]),
            "1 0.5 0.25|a|%|    b"
        );
        assert_eq!(format("%d %d", &[i(1)]), "1 ");
        assert_eq!(format("%999999d%", &[i(1)]).len(), MAX_WIDTH);
        assert_eq!(format("%e", &[f(1234.5)]), "1.234500e+03");
    }

    #[test]
    fn numbers_are_read() {
        assert_eq!((to_int(" -12a"), to_int("99999999999"), to_int("x")), (-12, i32::MAX, 0));
        assert_eq!((to_float("1.5e2x"), to_float(".5"), to_float("-"), to_float("1e")), (150.0, 0.5, 0.0, 1.0));
        assert_eq!((part("abcdef", -3, 2), part("äbc", 1, 9), part("a", 5, 1)), ("de".into(), "bc".into(), "".into()));
        assert_eq!(split("a,b,,c", ",", 3), ["a", "b", ""]);
        assert_eq!(split(" a  b ", "", 9), ["a", "b"]);
    }
}
