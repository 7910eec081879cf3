//! What commands write to stdout.

use super::{Failure, Outcome};
use serde_json::{Number, Value};
use std::fmt::Debug;
use std::io::{ErrorKind, Write};

/// Writes text to stdout; a reader that has gone away is not an error.
pub fn write(text: &str) -> Outcome {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| match e.kind() {
        ErrorKind::BrokenPipe => Failure::Closed,
        _ => Failure::usage(format!("cannot write to stdout: {e}")),
    })
}

/// Writes one JSON document.
pub fn json(value: &Value) -> Outcome {
    let text = serde_json::to_string_pretty(value).map_err(|e| Failure::usage(format!("cannot write JSON: {e}")))?;
    write(&(text + "\n"))
}

/// A single-precision number with no more digits than it takes to read it back; `null` if it is not finite.
pub fn number(x: f32) -> Value {
    let shortest: f64 = x.to_string().parse().unwrap_or(f64::NAN);
    Number::from_f64(shortest).map_or(Value::Null, Value::Number)
}

/// Numbers as an array.
pub fn numbers(xs: &[f32]) -> Value {
    Value::Array(xs.iter().map(|x| number(*x)).collect())
}

/// A variant as words on the command line name it: in lower case.
pub fn word(value: impl Debug) -> String {
    format!("{value:?}").to_lowercase()
}
