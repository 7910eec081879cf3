//! Plain Rust values as parameters.

use crate::ir::Value;

impl From<i32> for Value {
    fn from(x: i32) -> Value {
        Value::Int(x)
    }
}

impl From<f32> for Value {
    fn from(x: f32) -> Value {
        Value::Float(x)
    }
}

/// Linear RGB; sets a vector, normal or point too.
impl From<[f32; 3]> for Value {
    fn from(x: [f32; 3]) -> Value {
        Value::Color(x)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Value {
        Value::String(text.to_owned())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Value {
        Value::String(text)
    }
}
