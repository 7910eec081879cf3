//! How calls end, and what went wrong last.

use super::memory;
use crate::engine::Error;
use std::cell::RefCell;
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How a call ended. Whatever is not `OC_OK` leaves a message for `oc_last_error` and, unless said otherwise, all
/// results untouched.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OcStatus {
    /// As asked.
    OcOk = 0,
    /// A pointer that must not be null is null.
    OcErrorNull = 1,
    /// A length or a stride is out of range.
    OcErrorBadLength = 2,
    /// A handle was never given out, is freed, or is of another kind.
    OcErrorBadHandle = 3,
    /// Text is not UTF-8.
    OcErrorBadText = 4,
    /// A number stands for nothing.
    OcErrorBadValue = 5,
    /// A script does not compile, or a parameter cannot be set so; the message has the places.
    OcErrorScript = 6,
    /// Shading went beyond a budget.
    OcErrorBudget = 7,
    /// A closure cannot be registered.
    OcErrorRegister = 8,
    /// A material gives back more light than it receives.
    OcErrorGains = 9,
    /// A fault of the library. What was asked for may be half done.
    OcErrorInternal = 10,
}

/// A status that is not `OC_OK`, with its message.
pub(super) struct Failure {
    pub status: OcStatus,
    pub message: String,
}

impl Failure {
    pub fn new(status: OcStatus, message: impl Into<String>) -> Failure {
        Failure { status, message: message.into() }
    }
}

impl From<Error> for Failure {
    fn from(e: Error) -> Failure {
        let status = match e {
            Error::Script(_) => OcStatus::OcErrorScript,
            Error::Shade(_) | Error::Build(_) => OcStatus::OcErrorBudget,
            Error::Register(_) => OcStatus::OcErrorRegister,
        };
        Failure::new(status, e.to_string())
    }
}

thread_local! {
    static LAST: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Runs a call; keeps its message if it fails, and any panic.
pub(super) fn guard(call: impl FnOnce() -> Result<(), Failure>) -> OcStatus {
    // What a panic leaves behind is behind a lock of its own, and every lock is taken poisoned or not.
    let failure = match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(())) => return OcStatus::OcOk,
        Ok(Err(failure)) => failure,
        Err(panic) => {
            let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
            let text = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
            Failure::new(OcStatus::OcErrorInternal, format!("fault in the library: {text}"))
        }
    };
    // A thread that is ending may have no place for it any more.
    let _ = LAST.try_with(|last| *last.borrow_mut() = failure.message);
    failure.status
}

/// The message of the last call of this thread that failed: what is wrong, and for scripts where, with the source line.
/// Writes at most `len` bytes with the closing 0 to `buffer` (UTF-8, cut between characters); returns the length of the
/// whole message without the 0. A null `buffer` only asks for that length.
///
/// # Safety
/// `buffer` is null or has room for `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_last_error(buffer: *mut c_char, len: usize) -> usize {
    let told = LAST.try_with(|last| {
        let message = last.borrow();
        if !buffer.is_null() && len > 0 {
            let mut end = message.len().min(len - 1);
            while !message.is_char_boundary(end) {
                end -= 1;
            }
            // SAFETY: `end + 1` is at most `len`, the room the caller promises.
            unsafe { memory::write_text(buffer, &message[..end]) };
        }
        message.len()
    });
    told.unwrap_or(0)
}
