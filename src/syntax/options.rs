//! What the front end may spend, and where included files come from.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Budgets of the front end and of shading. What goes beyond one is an error that names it.
///
/// ```
/// use overcoat::{Engine, syntax::Limits};
/// let engine = Engine::new().limits(Limits { iterations: 1000, ..Limits::default() });
/// let endless = engine.compile("a", "int i = 0; while (1) i += 1; Ci = diffuse(N);")?.material(&[])?;
/// assert!(endless.tree(&Default::default()).unwrap_err().to_string().contains("1000"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The longest script or included file, in bytes.
    pub script_bytes: usize,
    /// How deep `#include` may nest.
    pub include_depth: usize,
    /// What macros may expand to, intermediate results counted, in bytes; and all included text together.
    pub expanded_bytes: usize,
    /// How many function calls are written out while compiling.
    pub calls: usize,
    /// How many expressions a script may come to with all calls written out and loops of known length unrolled.
    pub expressions: usize,
    /// How many rounds all loops together may take at one shading point.
    pub iterations: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            script_bytes: 64 << 20,
            include_depth: 32,
            expanded_bytes: 64 << 20,
            calls: 1 << 16,
            expressions: 1 << 22,
            iterations: 1 << 20,
        }
    }
}

/// Where the text of `#include` comes from.
pub trait Includes: Send + Sync {
    /// The file called `name`, asked for by the file called `from`: a name for messages, and its text. `None` if there
    /// is none.
    fn load(&self, name: &str, from: &str) -> Option<(String, String)>;
}

/// Looks beside the including file, then in these directories, in order.
#[derive(Clone, Debug, Default)]
pub struct Directories(pub Vec<PathBuf>);

impl Includes for Directories {
    fn load(&self, name: &str, from: &str) -> Option<(String, String)> {
        let beside = Path::new(from).parent().map(Path::to_owned);
        beside.iter().chain(&self.0).find_map(|directory| {
            let path = directory.join(name);
            let text = std::fs::read_to_string(&path).ok()?;
            Some((path.display().to_string(), text))
        })
    }
}

/// How text becomes a syntax tree.
#[derive(Clone, Default)]
pub struct Options {
    /// Budgets.
    pub limits: Limits,
    /// Where included files come from, other than the headers that are built in.
    pub includes: Option<Arc<dyn Includes>>,
    /// Macros defined before the first line, with their text.
    pub defines: Vec<(String, String)>,
}

impl fmt::Debug for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let includes = self.includes.is_some();
        f.debug_struct("Options").field("limits", &self.limits).field("includes", &includes).finish_non_exhaustive()
    }
}
