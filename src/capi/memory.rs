//! The host's memory: the one place that follows its pointers.

use super::status::{Failure, OcStatus};
use std::ffi::{CStr, c_char};

fn null(what: &str) -> Failure {
    Failure::new(OcStatus::OcErrorNull, format!("`{what}` is null"))
}

fn text(bytes: &[u8], what: &str) -> Result<String, Failure> {
    let text = std::str::from_utf8(bytes);
    let bad = |e| Failure::new(OcStatus::OcErrorBadText, format!("`{what}`: {e}"));
    text.map(str::to_owned).map_err(bad)
}

/// A text that ends with 0.
///
/// # Safety
/// `start` is null or points to bytes that end with 0.
pub unsafe fn c_text(start: *const c_char, what: &str) -> Result<String, Failure> {
    if start.is_null() {
        return Err(null(what));
    }
    // SAFETY: not null, and the caller promises the 0.
    text(unsafe { CStr::from_ptr(start) }.to_bytes(), what)
}

/// [`c_text`]; empty where it is null.
///
/// # Safety
/// As for [`c_text`].
pub unsafe fn c_text_or_empty(start: *const c_char, what: &str) -> Result<String, Failure> {
    // SAFETY: passed on.
    if start.is_null() { Ok(String::new()) } else { unsafe { c_text(start, what) } }
}

/// `len` bytes of text.
///
/// # Safety
/// `start` is null or points to `len` bytes.
pub unsafe fn sized_text(start: *const c_char, len: usize, what: &str) -> Result<String, Failure> {
    // SAFETY: passed on; chars of C are bytes.
    text(unsafe { slice(start.cast::<u8>(), len, what)? }, what)
}

/// An array as a slice; null is fine if it is empty.
///
/// # Safety
/// `start` is null or points to `len` values of `T` that nobody changes as long as the slice is used.
pub unsafe fn slice<'a, T>(start: *const T, len: usize, what: &str) -> Result<&'a [T], Failure> {
    if len == 0 {
        return Ok(&[]);
    }
    if start.is_null() {
        return Err(null(what));
    }
    let bytes = len.checked_mul(size_of::<T>()).filter(|b| *b <= isize::MAX as usize);
    if bytes.is_none() || !start.is_aligned() {
        return Err(Failure::new(OcStatus::OcErrorBadLength, format!("`{what}` cannot have {len} elements there")));
    }
    // SAFETY: neither null, misaligned nor too large; the caller promises the rest.
    Ok(unsafe { std::slice::from_raw_parts(start, len) })
}

/// One value.
///
/// # Safety
/// `start` is null or points to a `T`, whatever its alignment.
pub unsafe fn read<T: Copy>(start: *const T, what: &str) -> Result<T, Failure> {
    if start.is_null() {
        return Err(null(what));
    }
    // SAFETY: not null; the caller promises a value.
    Ok(unsafe { start.read_unaligned() })
}

/// Sets one result.
///
/// # Safety
/// `start` is null or has room for a `T`, whatever its alignment.
pub unsafe fn write<T: Copy>(start: *mut T, value: T, what: &str) -> Result<(), Failure> {
    if start.is_null() {
        return Err(null(what));
    }
    // SAFETY: not null; the caller promises room.
    unsafe { start.write_unaligned(value) };
    Ok(())
}

/// Writes a text and the 0 that ends it.
///
/// # Safety
/// `start` is not null and has room for one byte more than `text` is long.
pub unsafe fn write_text(start: *mut c_char, text: &str) {
    // SAFETY: the caller promises room, and `text` is memory of the library, so the two do not overlap.
    unsafe {
        std::ptr::copy_nonoverlapping(text.as_ptr().cast(), start, text.len());
        start.add(text.len()).write(0);
    }
}

/// An array of the host whose elements lie `stride` bytes apart.
#[derive(Clone, Copy)]
pub struct Strided<T> {
    start: *mut T,
    stride: usize,
}

impl<T: Copy> Strided<T> {
    /// `count` elements.
    ///
    /// # Errors
    /// A null array that is not empty, a stride smaller than an element, a size beyond the address space.
    pub fn new(start: *mut T, stride: usize, count: usize, what: &str) -> Result<Self, Failure> {
        if start.is_null() && count > 0 {
            return Err(null(what));
        }
        let bytes = stride.checked_mul(count).filter(|b| *b <= isize::MAX as usize);
        if bytes.is_none() || (stride < size_of::<T>() && count > 1) {
            let message = format!("`{what}` cannot have {count} elements {stride} bytes apart");
            return Err(Failure::new(OcStatus::OcErrorBadLength, message));
        }
        Ok(Strided { start, stride })
    }

    /// Element `index`.
    ///
    /// # Safety
    /// The array has that many elements.
    pub unsafe fn get(self, index: usize) -> T {
        // SAFETY: the caller promises that the element is there; its alignment is not asked for.
        unsafe { self.start.byte_add(index * self.stride).read_unaligned() }
    }

    /// Sets element `index`.
    ///
    /// # Safety
    /// The array has room for that many elements.
    pub unsafe fn set(self, index: usize, value: T) {
        // SAFETY: the caller promises that there is room; its alignment is not asked for.
        unsafe { self.start.byte_add(index * self.stride).write_unaligned(value) }
    }
}
