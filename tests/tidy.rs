//! The shape of the source: who may use whom, how long a file may get, where unsafe code may stand. And the tests that
//! documents and comments name: they exist.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What each module may use. Everything points inward: front ends know the library, the library knows no front end.
const ARROWS: &[(&str, &[&str])] = &[
    ("span", &[]),
    ("globals", &[]),
    ("optics", &[]),
    ("diag", &["span"]),
    ("syntax", &["diag", "span"]),
    ("albedo", &["optics"]),
    ("lobes", &["albedo", "optics"]),
    ("closure", &["lobes", "albedo", "optics", "globals"]),
    ("ir", &["syntax", "diag", "span", "lobes", "closure", "optics", "globals"]),
    ("audit", &["engine", "ir", "closure", "lobes", "albedo", "optics", "globals"]),
    ("engine", &["ir", "syntax", "closure", "lobes", "albedo", "optics", "diag", "span", "globals"]),
    ("prove", &["ir", "closure", "lobes", "audit", "optics", "engine", "diag", "span", "globals"]),
    ("preview", &["engine", "closure", "lobes", "globals"]),
    ("capi", &["engine", "audit", "closure", "lobes", "ir", "syntax", "globals"]),
    (
        "cli",
        &[
            "engine", "prove", "preview", "audit", "closure", "lobes", "albedo", "optics", "ir", "syntax", "diag",
            "span", "globals",
        ],
    ),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Path relative to src, and the text without its unit tests.
fn library() -> Vec<(String, String)> {
    let mut files = Vec::new();
    sources(&root().join("src"), &mut files);
    files
        .iter()
        .map(|f| {
            let name = f.strip_prefix(root().join("src")).expect("below src").display().to_string();
            let text = std::fs::read_to_string(f).expect("source");
            let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or("").to_owned();
            (name, code)
        })
        .collect()
}

/// The modules a text names after `crate::`.
fn used(code: &str) -> BTreeSet<String> {
    let mut modules = BTreeSet::new();
    let code: String = code.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    for piece in code.split("crate::").skip(1) {
        let names = match piece.strip_prefix('{') {
            Some(list) => list.split('}').next().unwrap_or(""),
            None => piece.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or(""),
        };
        for name in names.split(',') {
            let name = name.split("::").next().unwrap_or("").trim();
            modules.insert(match name {
                "Globals" => "globals".to_owned(),
                "Engine" | "Material" | "Shader" => "engine".to_owned(),
                other => other.to_owned(),
            });
        }
    }
    modules.remove("");
    modules
}

#[test]
fn modules_use_only_what_they_may() {
    for (file, code) in library() {
        let module = file.split(['/', '.']).next().unwrap_or("");
        if ["lib", "main"].contains(&module) {
            continue;
        }
        let (_, allowed) = ARROWS.iter().find(|a| a.0 == module).unwrap_or_else(|| panic!("{file}: no arrow"));
        for name in used(&code) {
            assert!(name == module || allowed.contains(&name.as_str()), "src/{file} uses crate::{name}");
        }
    }
}

#[test]
fn only_the_parser_knows_pest() {
    for (file, code) in library() {
        let code: String = code.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
        assert!(file == "syntax/parse.rs" || !code.contains("pest"), "src/{file}");
    }
}

#[test]
fn files_stay_readable() {
    let mut files = Vec::new();
    for folder in ["src", "tests", "examples"] {
        sources(&root().join(folder), &mut files);
    }
    for file in files {
        let text = std::fs::read_to_string(&file).expect("source");
        let lines = text.lines().count();
        assert!(lines <= 600, "{}: {lines} lines", file.display());
        assert!(text.starts_with("//!") || file.ends_with("lib.rs"), "{}: opens without its story", file.display());
        let banner = text.lines().find(|l| {
            l.trim_start().starts_with("//") && !l.contains('|') && (l.contains("=====") || l.contains("-----"))
        });
        assert!(banner.is_none() || file.ends_with("tidy.rs"), "{}: {banner:?}", file.display());
    }
}

/// Every `unsafe` block and `unsafe impl` of the C interface and of vector code says why it is sound;
/// nothing else has any.
#[test]
fn unsafe_code_has_its_places_and_its_reasons() {
    for (file, code) in library() {
        let words = code.replace("unsafe_code", "");
        if !file.starts_with("capi/") && !["optics/dispatch.rs", "optics/avx.rs"].contains(&file.as_str()) {
            assert!(!words.contains("unsafe"), "src/{file}");
            continue;
        }
        let lines: Vec<&str> = words.lines().map(str::trim).collect();
        for (number, line) in lines.iter().enumerate() {
            let comment = line.starts_with("//");
            if comment || !(line.contains("unsafe {") || line.contains("unsafe impl")) {
                continue;
            }
            // The reason stands above the statement that the block is part of.
            let above = lines[number.saturating_sub(4)..number].iter().rev();
            let reason = above.take_while(|l| !l.is_empty()).any(|l| l.contains("// SAFETY:"));
            assert!(reason, "src/{file}:{}: {line}", number + 1);
        }
        let declared = words.matches("unsafe extern \"C\" fn oc_").count() + words.matches("unsafe fn ").count();
        assert_eq!(
            words.matches("/// # Safety").count(),
            declared,
            "src/{file}: functions that do not say what they need"
        );
    }
}

/// What is read by people, and what says how tests are run, with the comments of the sources.
fn documents() -> Vec<(String, String)> {
    let mut files = Vec::new();
    for folder in ["src", "tests", "examples", "benches", "fuzz/src"] {
        sources(&root().join(folder), &mut files);
    }
    let docs = std::fs::read_dir(root().join("docs")).expect("docs").map(|e| e.expect("an entry").path());
    files.extend(docs.filter(|p| p.extension().is_some_and(|e| e == "md")));
    let others = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "cbindgen.toml", "fuzz/Cargo.toml", ".ci/run"];
    files.extend(others.map(|name| root().join(name)));
    files.retain(|f| !f.ends_with("tests/tidy.rs"));
    let read = |f: PathBuf| (f.display().to_string(), std::fs::read_to_string(f).expect("a document"));
    files.into_iter().map(read).collect()
}

/// Programs, files of tests, and the words that pick some of a program: they are names of its files.
#[test]
fn tests_that_are_named_exist() {
    let tests = root().join("tests");
    let word = |c: char| c.is_alphanumeric() || "_/.".contains(c);
    let mut count = 0;
    for (file, text) in documents() {
        for piece in text.split("--test ").skip(1) {
            let line = piece.split(['`', '"', '\n']).next().unwrap_or("");
            let mut words = line.split_whitespace().filter(|w| w.chars().all(|c| word(c) || c == ':'));
            let name = words.next().expect("a name");
            let found = tests.join(format!("{name}.rs")).exists() || tests.join(name).join("main.rs").exists();
            assert!(found, "{file}: --test {name}");
            for picked in words.map(|w| w.trim_end_matches("::")) {
                assert!(tests.join(name).join(format!("{picked}.rs")).exists(), "{file}: {line}");
            }
            count += 1;
        }
        for piece in text.split("tests/").skip(1) {
            let path: String = piece.chars().take_while(|c| word(*c)).collect();
            let path = path.trim_end_matches('.');
            assert!(!path.ends_with(".rs") || tests.join(path).exists(), "{file}: tests/{path}");
            count += 1;
        }
    }
    assert!(count > 60, "{count}");
}

/// `file.rs`: `name`, `name` – of tables that say which test holds what.
#[test]
fn tests_that_are_said_to_hold_something_exist() {
    let mut count = 0;
    for (file, text) in documents().into_iter().filter(|d| d.0.ends_with(".md")) {
        for line in text.lines().filter(|l| l.starts_with('|')) {
            let pieces: Vec<&str> = line.split('`').collect();
            let mut source = None;
            for k in (1..pieces.len()).step_by(2) {
                let (before, inside, after) = (pieces[k - 1], pieces[k], pieces.get(k + 1).unwrap_or(&""));
                if inside.ends_with(".rs") && *after == ": " {
                    let places = [root().join(inside), root().join("src").join(inside)];
                    let place = places.iter().find(|p| p.exists()).unwrap_or_else(|| panic!("{file}: {inside}"));
                    source = Some((inside, std::fs::read_to_string(place).expect("source")));
                } else if let Some((name, code)) = source.as_ref().filter(|_| [": ", ", "].contains(&before)) {
                    assert!(code.contains(&format!("fn {inside}(")), "{file}: no `{inside}` in {name}");
                    count += 1;
                } else {
                    source = None;
                }
            }
        }
    }
    assert!(count > 20, "{count}");
}
