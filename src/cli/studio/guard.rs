//! Who may ask, and for which files.
//!
//! The page is served on the loopback only, but any page in the same browser can send requests there. So: the `Host`
//! must be the loopback by name (a foreign name that resolves to it is refused: DNS rebinding), an `Origin` must be the
//! page's own, and whatever reads or does something needs the token that only the opened address holds. Files are named
//! relative to the opened folder and looked at with their links followed.

use super::http::{Head, Refusal};
use std::path::{Component, Path, PathBuf};

/// What requests must show.
pub struct Guard {
    token: String,
    port: u16,
}

impl Guard {
    /// With a token of 128 random bits.
    pub fn new(port: u16) -> Result<Guard, String> {
        let mut bytes = [0u8; 16];
        getrandom::fill(&mut bytes).map_err(|e| format!("no random token: {e}"))?;
        Ok(Guard { token: bytes.iter().map(|b| format!("{b:02x}")).collect(), port })
    }

    /// Where the page is.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }

    /// Whether the request comes from the page's own address.
    pub fn check_origin(&self, head: &Head) -> Result<(), Refusal> {
        let refuse = |what: &str| Err(Refusal::new(403, format!("refused: {what}")));
        let own = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        if !head.header("host").is_some_and(|host| own.iter().any(|o| o == host)) {
            return refuse("the request names another host");
        }
        if head.has("origin") {
            let origin = head.header("origin").and_then(|o| o.strip_prefix("http://")).unwrap_or("");
            if !own.iter().any(|o| o == origin) {
                return refuse("the request comes from another page");
            }
        }
        match head.header("sec-fetch-site") {
            Some("cross-site" | "same-site") if head.path != "/" => refuse("the request comes from another page"),
            _ => Ok(()),
        }
    }

    /// Whether the request carries the token.
    pub fn check_token(&self, head: &Head) -> Result<(), Refusal> {
        let given = head.header("x-overcoat-token").unwrap_or("").as_bytes();
        let token = self.token.as_bytes();
        // Every byte is looked at, so that the time taken tells nothing.
        let differs = given.iter().zip(token).fold(given.len() ^ token.len(), |d, (a, b)| d | usize::from(a ^ b));
        match differs {
            0 => Ok(()),
            _ => Err(Refusal::new(403, "refused: open the address that `overcoat studio` printed")),
        }
    }
}

/// Scripts, and what they include: nothing else is read as text or written.
const EXTENSIONS: [&str; 3] = ["osl", "oslh", "h"];
/// The longest script that is opened, in bytes: what a request can carry back.
const MAX_SCRIPT: u64 = 1 << 19;
/// How deep folders are listed, and how many scripts.
const MAX_DEPTH: usize = 5;
const MAX_LISTED: usize = 2000;

/// The opened folder: all that is read and written lies below it.
pub struct Folder {
    root: PathBuf,
    /// Whether folders in it count.
    deep: bool,
}

impl Folder {
    pub fn new(root: &Path, deep: bool) -> std::io::Result<Folder> {
        Ok(Folder { root: root.canonicalize()?, deep })
    }

    pub fn root(&self) -> &Path {
        &self.root
    }

    pub fn is_deep(&self) -> bool {
        self.deep
    }

    /// The file that a name given by the page stands for, links followed. It need not exist, its folder must.
    pub fn resolve(&self, name: &str) -> Result<PathBuf, Refusal> {
        let outside = || Refusal::new(403, format!("`{name}` lies outside the opened folder"));
        let relative = Path::new(name);
        let plain = relative.components().all(|c| matches!(c, Component::Normal(_)));
        // A backslash and a colon mean something to some systems.
        if name.is_empty() || !plain || name.contains(['\\', ':', '\0']) {
            return Err(outside());
        }
        let path = self.root.join(relative);
        let real = match path.canonicalize() {
            Ok(real) => real,
            // A link to nowhere would be followed when written.
            Err(_) if path.is_symlink() => return Err(outside()),
            Err(_) => {
                let missing = || Refusal::new(404, format!("there is no folder for `{name}`"));
                let folder = path.parent().and_then(|p| p.canonicalize().ok()).ok_or_else(missing)?;
                folder.join(path.file_name().ok_or_else(missing)?)
            }
        };
        if real.starts_with(&self.root) && real != self.root { Ok(real) } else { Err(outside()) }
    }

    /// [`resolve`](Self::resolve), for scripts only.
    pub fn script(&self, name: &str) -> Result<PathBuf, Refusal> {
        let path = self.resolve(name)?;
        match path.extension().and_then(|e| e.to_str()) {
            Some(e) if EXTENSIONS.contains(&e) => Ok(path),
            _ => Err(Refusal::new(403, format!("`{name}` is no script: its name must end in .osl, .oslh or .h"))),
        }
    }

    /// The text of a script.
    pub fn read(&self, name: &str) -> Result<String, Refusal> {
        let path = self.script(name)?;
        let failed = |e: std::io::Error| Refusal::new(404, format!("cannot read `{name}`: {e}"));
        if std::fs::metadata(&path).map_err(failed)?.len() > MAX_SCRIPT {
            return Err(Refusal::new(413, format!("`{name}` is longer than {MAX_SCRIPT} bytes")));
        }
        let bytes = std::fs::read(&path).map_err(failed)?;
        String::from_utf8(bytes).map_err(|_| Refusal::new(404, format!("`{name}` is not UTF-8 text")))
    }

    /// Files whose name ends in one of `extensions`, by their path from the root, sorted.
    pub fn list(&self, extensions: &[&str]) -> Vec<String> {
        let mut found = Vec::new();
        self.walk(&self.root, 0, extensions, &mut found);
        found.sort();
        found
    }

    fn walk(&self, folder: &Path, depth: usize, extensions: &[&str], found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let (path, Ok(kind)) = (entry.path(), entry.file_type()) else { continue };
            let skipped = name.to_string_lossy().starts_with('.') || name == "target" || name == "node_modules";
            if found.len() >= MAX_LISTED || skipped {
                continue;
            }
            if kind.is_dir() && self.deep && depth < MAX_DEPTH {
                self.walk(&path, depth + 1, extensions, found);
            } else if path.extension().is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x)))
                && let Ok(relative) = path.strip_prefix(&self.root)
                && let Some(text) = relative.to_str()
                && self.resolve(text).is_ok()
            {
                found.push(text.to_owned());
            }
        }
    }
}
