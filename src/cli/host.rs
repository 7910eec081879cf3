//! What scripts ask the command line program: pictures from files, and where printing goes.

use crate::globals::Globals;
use crate::ir::{Host, Lookup, Speech, Subject};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Loads pictures beside the script or in the include directories, each once; prints to stderr.
pub struct CliHost {
    directories: Vec<PathBuf>,
    /// Whether pictures elsewhere are none.
    confined: bool,
    quiet: bool,
    pictures: Mutex<HashMap<String, Option<Arc<Picture>>>>,
    /// What has been printed: a script says the same at every point.
    said: Mutex<Vec<String>>,
}

struct Picture {
    pixels: image::Rgba32FImage,
    /// Eight bits per channel: taken as sRGB unless told.
    encoded: bool,
}

/// Different lines that are printed, at most.
const MAX_LINES: usize = 100;

impl CliHost {
    /// For a script at `path`.
    pub fn new(path: &Path, include: &[PathBuf], quiet: bool) -> Self {
        let beside = path.parent().map(Path::to_owned);
        let directories = beside.into_iter().chain(include.iter().cloned()).collect();
        CliHost { directories, confined: false, quiet, pictures: Mutex::default(), said: Mutex::default() }
    }

    /// Pictures below these folders, links followed, and no others.
    #[cfg(feature = "studio")]
    pub fn confined(directories: Vec<PathBuf>, quiet: bool) -> Self {
        CliHost { directories, confined: true, quiet, pictures: Mutex::default(), said: Mutex::default() }
    }

    fn picture(&self, name: &str) -> Option<Arc<Picture>> {
        // A thread that panicked while loading leaves at worst a missing entry.
        let mut pictures = self.pictures.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = pictures.get(name) {
            return known.clone();
        }
        let loaded = self.load(name).map(Arc::new);
        if loaded.is_none() && !self.quiet {
            eprintln!("warning: the texture `{name}` cannot be read");
        }
        pictures.insert(name.to_owned(), loaded.clone());
        loaded
    }

    fn load(&self, name: &str) -> Option<Picture> {
        let found = self.directories.iter().map(|d| d.join(name)).find(|path| path.is_file() && self.allowed(path));
        let path = found.or_else(|| (!self.confined).then(|| PathBuf::from(name)))?;
        let opened = image::open(path).ok()?;
        let encoded = matches!(opened.color().bytes_per_pixel() / opened.color().channel_count(), 1);
        Some(Picture { pixels: opened.into_rgba32f(), encoded })
    }
}

impl CliHost {
    fn allowed(&self, path: &Path) -> bool {
        let below =
            |folder: &PathBuf| folder.canonicalize().is_ok_and(|f| path.canonicalize().is_ok_and(|p| p.starts_with(f)));
        !self.confined || self.directories.iter().any(below)
    }
}

impl Picture {
    fn at(&self, x: i64, y: i64, wrap: [&str; 2]) -> [f32; 4] {
        let (width, height) = (i64::from(self.pixels.width()), i64::from(self.pixels.height()));
        let place = |at: i64, size: i64, wrap: &str| match wrap {
            "periodic" => Some(at.rem_euclid(size)),
            "mirror" => {
                let at = at.rem_euclid(2 * size);
                Some(if at < size { at } else { 2 * size - 1 - at })
            }
            "clamp" => Some(at.clamp(0, size - 1)),
            _ => (0..size).contains(&at).then_some(at),
        };
        match (place(x, width, wrap[0]), place(y, height, wrap[1])) {
            (Some(x), Some(y)) => self.pixels.get_pixel(x as u32, y as u32).0,
            _ => [0.0; 4],
        }
    }
}

/// IEC 61966-2-1.
fn linear(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

impl Host for CliHost {
    fn answers(&self, subject: Subject) -> bool {
        matches!(subject, Subject::Textures | Subject::Speech)
    }

    fn texture(&self, lookup: &Lookup, _: &Globals) -> Option<[f32; 4]> {
        let picture = self.picture(lookup.name)?;
        let size = [picture.pixels.width(), picture.pixels.height()].map(|n| n as f32);
        let limit = |x: f32| if x.is_finite() { x.clamp(-1e6, 1e6) } else { 0.0 };
        let (x, y) = (limit(lookup.s) * size[0] - 0.5, limit(lookup.t) * size[1] - 0.5);
        let decode = match lookup.colorspace {
            "" => picture.encoded,
            space => space.eq_ignore_ascii_case("srgb"),
        };
        let texel = |dx: i64, dy: i64| {
            let [r, g, b, a] = picture.at(x.floor() as i64 + dx, y.floor() as i64 + dy, lookup.wrap);
            if decode { [linear(r), linear(g), linear(b), a] } else { [r, g, b, a] }
        };
        if lookup.interpolation == "closest" {
            return Some(texel(i64::from(x.fract() >= 0.5), i64::from(y.fract() >= 0.5)));
        }
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let mix = |a: [f32; 4], b: [f32; 4], t: f32| std::array::from_fn(|k| a[k] * (1.0 - t) + b[k] * t);
        let rows: [[f32; 4]; 2] = [mix(texel(0, 0), texel(1, 0), fx), mix(texel(0, 1), texel(1, 1), fx)];
        let color: [f32; 4] = mix(rows[0], rows[1], fy);
        // Channels from the first one asked for on; beyond the last there is nothing.
        let first = usize::try_from(lookup.first_channel).unwrap_or(0);
        let channel = |k: usize| color.get(first + k).copied().unwrap_or(0.0);
        Some([channel(0), channel(1), channel(2), color[3]])
    }

    fn say(&self, speech: Speech, text: &str) {
        let mut said = self.said.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if self.quiet || said.len() >= MAX_LINES || said.iter().any(|line| line == text) {
            return;
        }
        match speech {
            Speech::Print => eprintln!("{}", text.trim_end_matches('\n')),
            Speech::Warning => eprintln!("warning: {text}"),
            Speech::Error => eprintln!("error: {text}"),
        }
        said.push(text.to_owned());
    }
}
