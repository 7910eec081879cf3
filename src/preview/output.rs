//! Pictures to files.
//!
//! An [`Image`] and a path come in; the file's extension says what becomes of them: `.png` is what a screen shows (see
//! [`display`]), `.exr` the linear radiance. A file is written beside its destination and then renamed, so that
//! a reader never sees half a picture and a failure leaves the old one.

use super::{Image, display};
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::fmt;
use std::io::{BufWriter, Cursor, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8 bits a channel, as a screen shows it.
    Png,
    /// Linear radiance.
    Exr,
}

impl Format {
    /// What the extension asks for, in either case.
    pub fn of(path: &Path) -> Result<Format, OutputError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        match extension.as_str() {
            "png" => Ok(Format::Png),
            "exr" => Ok(Format::Exr),
            _ => Err(OutputError::new(path, "the name must end in .png or .exr")),
        }
    }
}

/// Why a picture was not written.
#[derive(Debug)]
pub struct OutputError {
    /// The file.
    pub path: PathBuf,
    /// What went wrong.
    pub reason: String,
}

impl OutputError {
    fn new(path: &Path, reason: impl fmt::Display) -> OutputError {
        OutputError { path: path.to_owned(), reason: reason.to_string() }
    }
}

impl fmt::Display for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot write `{}`: {}", self.path.display(), self.reason)
    }
}

impl std::error::Error for OutputError {}

/// Finds out before a long render whether [`save`] could write there. Leaves nothing behind.
pub fn check(path: &Path) -> Result<Format, OutputError> {
    let format = Format::of(path)?;
    check_writable(path)?;
    Ok(format)
}

/// Writes the picture. `exposure`, in stops, only matters to a PNG.
pub fn save(image: &Image, path: &Path, exposure: f32) -> Result<(), OutputError> {
    let format = check(path)?;
    let fail = |e: &dyn fmt::Display| OutputError::new(path, e);
    let bytes = match format {
        Format::Png => png(image, exposure),
        Format::Exr => exr(image),
    }
    .map_err(|e| fail(&e))?;
    replace(path, &bytes)
}

/// Finds out whether [`replace`] could write there. Leaves nothing behind.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    if path.is_dir() {
        return Err(OutputError::new(path, "it is a directory"));
    }
    beside(path).map(drop)
}

/// Writes a file as a whole or not at all.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let fail = |e: &dyn fmt::Display| OutputError::new(path, e);
    let file = beside(path)?;
    let mut writer = BufWriter::new(file.as_file());
    writer.write_all(bytes).and_then(|()| writer.flush()).map_err(|e| fail(&e))?;
    drop(writer);
    file.persist(path).map_err(|e| fail(&e.error))?;
    Ok(())
}

/// The bytes of a PNG file: 8 bits a channel, as a screen shows it.
pub fn png(image: &Image, exposure: f32) -> Result<Vec<u8>, image::ImageError> {
    let bytes: Vec<u8> = image
        .data()
        .chunks_exact(3)
        .flat_map(|p| display([p[0], p[1], p[2]], exposure).map(|c| (c * 255.0 + 0.5) as u8))
        .collect();
    let mut out = Vec::new();
    PngEncoder::new(&mut out).write_image(&bytes, image.width(), image.height(), ExtendedColorType::Rgb8)?;
    Ok(out)
}

/// The bytes of an OpenEXR file: linear RGB, 32-bit floats.
pub fn exr(image: &Image) -> Result<Vec<u8>, image::ImageError> {
    let bytes: Vec<u8> = image.data().iter().flat_map(|c| c.to_ne_bytes()).collect();
    let mut out = Cursor::new(Vec::new());
    OpenExrEncoder::new(&mut out).write_image(&bytes, image.width(), image.height(), ExtendedColorType::Rgb32F)?;
    Ok(out.into_inner())
}

/// A temporary file in the directory of `path`, with the permissions of an ordinary new file.
fn beside(path: &Path) -> Result<NamedTempFile, OutputError> {
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".overcoat-").suffix(".tmp");
    #[cfg(unix)]
    let permissions = {
        use std::os::unix::fs::PermissionsExt;
        std::fs::Permissions::from_mode(0o666)
    };
    #[cfg(unix)]
    builder.permissions(permissions);
    builder
        .tempfile_in(directory)
        .map_err(|e| OutputError::new(path, format!("no file can be made in `{}`: {e}", directory.display())))
}
