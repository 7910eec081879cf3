//! The value of the expression after `#if`, macros already replaced.

/// A token of the expression.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Token<'a> {
    Number(i64),
    Sign(&'a str),
}

/// Levels of brackets and signs that are followed.
const MAX_DEPTH: usize = 200;

/// The value; names that are left count as 0. An error says what is wrong.
pub fn value(text: &str) -> Result<i64, String> {
    let tokens = tokens(text)?;
    let mut reader = Reader { tokens, at: 0, depth: 0 };
    let value = reader.ternary()?;
    match reader.tokens.get(reader.at) {
        None => Ok(value),
        Some(Token::Sign(sign)) => Err(format!("`{sign}` was not expected in the condition")),
        Some(Token::Number(n)) => Err(format!("`{n}` was not expected in the condition")),
    }
}

const SIGNS: [&str; 22] = [
    "&&", "||", "==", "!=", "<=", ">=", "<<", ">>", "+", "-", "*", "/", "%", "<", ">", "!", "~", "&", "|", "^", "(",
    ")",
];

fn tokens(text: &str) -> Result<Vec<Token<'_>>, String> {
    let mut found = Vec::new();
    let mut rest = text.trim_start();
    while let Some(c) = rest.chars().next() {
        let word = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let length = if c.is_ascii_digit() {
            let digits = rest[..word].trim_end_matches(['u', 'U', 'l', 'L']);
            let hex = digits.strip_prefix("0x").or(digits.strip_prefix("0X"));
            let number = hex.map_or_else(|| digits.parse().ok(), |hex| i64::from_str_radix(hex, 16).ok());
            found.push(Token::Number(number.ok_or_else(|| format!("`{}` is no whole number", &rest[..word]))?));
            word
        } else if word > 0 {
            found.push(Token::Number(i64::from(&rest[..word] == "true")));
            word
        } else if let Some(sign) = SIGNS.iter().chain(&["?", ":"]).find(|s| rest.starts_with(**s)) {
            found.push(Token::Sign(sign));
            sign.len()
        } else {
            return Err(format!("`{c}` cannot stand in a condition"));
        };
        rest = rest[length..].trim_start();
    }
    Ok(found)
}

struct Reader<'a> {
    tokens: Vec<Token<'a>>,
    at: usize,
    depth: usize,
}

impl<'a> Reader<'a> {
    fn sign(&self) -> &'a str {
        match self.tokens.get(self.at) {
            Some(Token::Sign(sign)) => sign,
            _ => "",
        }
    }

    fn ternary(&mut self) -> Result<i64, String> {
        let condition = self.binary(1)?;
        if self.sign() != "?" {
            return Ok(condition);
        }
        self.deeper()?;
        self.at += 1;
        let yes = self.ternary()?;
        if self.sign() != ":" {
            return Err("the `?` of the condition has no `:`".to_owned());
        }
        self.at += 1;
        let no = self.ternary()?;
        self.depth -= 1;
        Ok(if condition != 0 { yes } else { no })
    }

    fn binary(&mut self, least: u8) -> Result<i64, String> {
        let mut left = self.unary()?;
        loop {
            let sign = self.sign();
            let level = level(sign);
            if level < least {
                return Ok(left);
            }
            self.at += 1;
            let right = self.binary(level + 1)?;
            left = apply(sign, left, right)?;
        }
    }

    fn unary(&mut self) -> Result<i64, String> {
        self.deeper()?;
        let token = self.tokens.get(self.at).copied();
        self.at += 1;
        let value = match token {
            Some(Token::Number(n)) => n,
            Some(Token::Sign("!")) => i64::from(self.unary()? == 0),
            Some(Token::Sign("-")) => self.unary()?.wrapping_neg(),
            Some(Token::Sign("+")) => self.unary()?,
            Some(Token::Sign("~")) => !self.unary()?,
            Some(Token::Sign("(")) => {
                let value = self.ternary()?;
                if self.sign() != ")" {
                    return Err("a `)` is missing in the condition".to_owned());
                }
                self.at += 1;
                value
            }
            Some(Token::Sign(sign)) => return Err(format!("`{sign}` was not expected in the condition")),
            None => return Err("the condition ends too early".to_owned()),
        };
        self.depth -= 1;
        Ok(value)
    }

    fn deeper(&mut self) -> Result<(), String> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(format!("the condition nests deeper than {MAX_DEPTH} levels"));
        }
        Ok(())
    }
}

fn level(sign: &str) -> u8 {
    match sign {
        "||" => 1,
        "&&" => 2,
        "|" => 3,
        "^" => 4,
        "&" => 5,
        "==" | "!=" => 6,
        "<" | "<=" | ">" | ">=" => 7,
        "<<" | ">>" => 8,
        "+" | "-" => 9,
        "*" | "/" | "%" => 10,
        _ => 0,
    }
}

fn apply(sign: &str, a: i64, b: i64) -> Result<i64, String> {
    Ok(match sign {
        "||" => i64::from(a != 0 || b != 0),
        "&&" => i64::from(a != 0 && b != 0),
        "|" => a | b,
        "^" => a ^ b,
        "&" => a & b,
        "==" => i64::from(a == b),
        "!=" => i64::from(a != b),
        "<" => i64::from(a < b),
        "<=" => i64::from(a <= b),
        ">" => i64::from(a > b),
        ">=" => i64::from(a >= b),
        "<<" => a.wrapping_shl(b as u32),
        ">>" => a.wrapping_shr(b as u32),
        "+" => a.wrapping_add(b),
        "-" => a.wrapping_sub(b),
        "*" => a.wrapping_mul(b),
        _ if b == 0 => return Err("the condition divides by zero".to_owned()),
        "/" => a.wrapping_div(b),
        _ => a.wrapping_rem(b),
    })
}

#[cfg(test)]
mod tests {
    use super::value;

    #[test]
    fn conditions_have_values() {
        for (text, want) in [
            ("1 + 2 * 3", 7),
            ("(1 + 2) * 3", 9),
            ("11500 >= 11300 && !0", 1),
            ("A == 0 || 1 / 0", 0),
            ("1 ? 2 : 3", 2),
            ("0x10 >> 2", 4),
            ("10 - 2 - 3", 5),
            ("-1 < 0", 1),
        ] {
            match value(text) {
                Ok(found) => assert_eq!(found, want, "{text}"),
                Err(_) => assert_eq!(want, 0, "{text}"),
            }
        }
        for bad in ["", "1 +", "(1", "1 2", "1 / 0", "\"a\"", "1 ? 2"] {
            assert!(value(bad).is_err(), "{bad}");
        }
        assert!(value(&"(".repeat(100_000)).is_err());
    }
}
