//! What the README and the pages of docs say is so: their scripts compile, their links lead somewhere, the commands and
//! flags they name exist. What they show on a line of its own is run by `commands.rs`.
#![cfg(feature = "cli")]

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A document, and what it says.
pub struct Page {
    pub path: PathBuf,
    pub text: String,
}

/// What users read.
pub fn pages() -> Vec<Page> {
    let docs = std::fs::read_dir(root().join("docs")).expect("docs").map(|e| e.expect("an entry").path());
    let mut paths: Vec<PathBuf> = docs.filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    paths.extend(["README.md", "python/README.md"].map(|name| root().join(name)));
    paths.sort();
    paths.into_iter().map(|path| Page { text: std::fs::read_to_string(&path).expect("a page"), path }).collect()
}

pub fn overcoat(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_overcoat"));
    command.args(arguments);
    command
}

fn help(arguments: &[&str]) -> String {
    let output = overcoat(arguments).arg("--help").output().expect("the program starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The names of all commands.
fn commands() -> Vec<String> {
    let help = help(&[]);
    let listed = help.split("Commands:").nth(1).and_then(|t| t.split("Options:").next()).expect("commands");
    let lines = listed.lines().filter(|l| l.starts_with("  ") && !l.starts_with("   "));
    lines.map(|l| l.split_whitespace().next().expect("a name").to_owned()).filter(|n| n != "help").collect()
}

/// What stands between backticks, blocks of code left out.
fn quoted(text: &str) -> Vec<String> {
    let prose: Vec<&str> = text.split("```").step_by(2).collect();
    prose.iter().flat_map(|p| p.split('`').skip(1).step_by(2)).map(|q| q.replace("\\|", "|")).collect()
}

/// A script's block begins like a shader: blocks of C do not.
#[test]
fn scripts_compile_without_a_warning() {
    let mut scripts = 0;
    for Page { path, text } in pages() {
        for block in text.split("```c\n").skip(1) {
            let script = block.split("```").next().expect("an end");
            if !script.starts_with("surface ") {
                continue;
            }
            let shader = overcoat::Engine::new().compile("page", script).unwrap_or_else(|e| panic!("{path:?}: {e}"));
            assert!(shader.warnings().is_empty() && shader.params().len() > 1, "{path:?}");
            scripts += 1;
        }
    }
    assert!(scripts >= 2, "{scripts}");
}

#[test]
fn scripts_in_a_line_run() {
    let mut scripts = 0;
    for Page { path, text } in pages() {
        for line in quoted(&text) {
            let Some((script, arguments)) = line.split_once(" | overcoat ") else { continue };
            let script = script.strip_prefix("echo '").and_then(|s| s.strip_suffix('\'')).expect("a script");
            let words: Vec<&str> = arguments.split_whitespace().collect();
            let mut program =
                overcoat(&words).stdin(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the program starts");
            program.stdin.take().expect("stdin").write_all(script.as_bytes()).expect("read");
            assert!(program.wait().expect("ended").success(), "{path:?}: {line}");
            scripts += 1;
        }
    }
    assert!(scripts >= 1);
}

#[test]
fn links_lead_somewhere() {
    let mut links = 0;
    for Page { path, text } in pages() {
        for link in text.split("](").skip(1) {
            let target = link.split(')').next().expect("a target");
            if target.starts_with("http") {
                continue;
            }
            let found = match target.strip_prefix('#') {
                Some(anchor) => {
                    let heading = format!("## {}", anchor.replace('-', " "));
                    text.lines().any(|l| l.to_lowercase() == heading)
                }
                None => path.with_file_name(target).exists(),
            };
            assert!(found, "{path:?}: {target}");
            links += 1;
        }
    }
    assert!(links > 100, "{links}");
}

#[test]
fn the_readmes_table_names_every_command() {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("README.md");
    for name in commands() {
        assert!(readme.contains(&format!("`overcoat {name} ")), "README without `{name}`");
    }
}

/// In running text and tables, and in the script that makes the pictures: a command that was renamed, a flag that is gone.
#[test]
fn commands_and_flags_that_are_named_exist() {
    let helps: Vec<(String, String)> = commands().into_iter().map(|n| (n.clone(), help(&[&n]))).collect();
    let figures = overcoat(&["reproduce", "nowhere", "--only", "no such figure"]).output().expect("the program starts");
    let figures = String::from_utf8(figures.stderr).expect("text");
    let pictures = std::fs::read_to_string(root().join("docs/pictures.sh")).expect("the script");
    let pictures = pictures.lines().filter_map(|l| Some(format!("overcoat {}", l.strip_prefix("\"$overcoat\" ")?)));
    let named = pages().into_iter().flat_map(|p| quoted(&p.text)).chain(pictures);
    let mut count = 0;
    for line in named {
        let words: Vec<&str> = line.split_whitespace().collect();
        let about = match words[..] {
            ["overcoat", name, ..] => {
                let of = |(n, h): &(String, String)| (n == name).then(|| h.clone());
                helps.iter().find_map(of).unwrap_or_else(|| panic!("no command: `{line}`"))
            }
            // Alone, it may be any command's; benches and tests are cargo's.
            [flag, ..] if flag.starts_with("--") && !["--bench", "--nocapture"].contains(&flag) => {
                helps.iter().map(|h| h.1.as_str()).collect()
            }
            _ => continue,
        };
        for flag in words.iter().filter(|w| w.starts_with("--")) {
            assert!(about.contains(flag), "`{line}`: no {flag}");
        }
        if let ["overcoat", "reproduce", _, "--only", figure] = words[..] {
            assert!(figures.contains(figure), "`{line}`: {figures}");
        }
        count += 1;
    }
    assert!(count > 60, "{count}");
}
