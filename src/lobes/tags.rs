//! Names that scripts give and hosts read: the tags of `debug()`.
//!
//! A parameter block holds numbers only, so a name becomes its number in a list that lives as long as the process.

use std::sync::{Mutex, PoisonError};

/// Most names that are told apart; later ones count as the last.
pub const MAX_TAGS: usize = 1 << 16;

static TAGS: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());

/// The number of a name.
pub fn number(name: &str) -> usize {
    let mut tags = TAGS.lock().unwrap_or_else(PoisonError::into_inner);
    match tags.iter().position(|t| *t == name) {
        Some(index) => index,
        None if tags.len() < MAX_TAGS => {
            tags.push(name.to_owned().leak());
            tags.len() - 1
        }
        None => MAX_TAGS - 1,
    }
}

/// The name with a number; empty if there is none.
pub fn name(number: usize) -> &'static str {
    TAGS.lock().unwrap_or_else(PoisonError::into_inner).get(number).copied().unwrap_or("")
}
