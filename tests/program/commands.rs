//! Every command that the README and the pages of docs show on a line of its own is run here, or by what `ELSEWHERE`
//! names.
#![cfg(feature = "cli")]

use super::documents::{overcoat, pages, root};
use std::collections::BTreeSet;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

/// A line that is shown as a command, and what is shown below it as its answer.
struct Shown {
    page: String,
    command: String,
    answer: Vec<String>,
}

/// How such lines begin; the first four are the program's own.
const BEGIN: [&str; 10] = [
    "cargo run --release -- ",
    "overcoat ",
    "$ overcoat ",
    "- run: overcoat ",
    "cargo ",
    "sh ",
    "pip ",
    "python ",
    "fuzz/",
    "packaging/",
];

/// Who runs what is not run here: a file, and what stands in it.
const ELSEWHERE: [(&str, &str, &str); 7] = [
    // All features: those by default and more.
    ("cargo test", ".ci/run", "step cargo test --locked --all-features -- "),
    ("cargo bench --bench bsdf", "Cargo.toml", "[[bench]]\nname = \"bsdf\"\n"),
    ("cargo run --release -- studio examples", "tests/program/studio.rs", ".args([\"studio\", "),
    ("sh examples/c/run.sh", "tests/hosts/capi.rs", "examples/c/run.sh"),
    ("sh packaging/install.sh /usr/local", "examples/c/run.sh", "sh packaging/install.sh "),
    ("pip install ./python", ".ci/run", " ./python\n"),
    (
        "pip install \"./python[plot]\" && python python/examples/lobes.py lobes.png",
        ".ci/run",
        " python/examples/lobes.py ",
    ),
];

/// The same, but quick.
const QUICKER: [(&str, &str); 4] = [
    ("--trees 1000000", "--trees 8"),
    ("--shard 1/32", "--shard 1/2"),
    ("1.json 2.json …", "1.json 2.json"),
    ("gallery examples", "gallery materials --size 16 --spp 1"),
];

fn shown() -> Vec<Shown> {
    let mut all = Vec::new();
    for page in pages() {
        let name = page.path.strip_prefix(root()).expect("below the root").display().to_string();
        let indented: Vec<Option<&str>> = page.text.lines().map(|l| l.strip_prefix("    ")).collect();
        for (k, line) in indented.iter().enumerate() {
            let Some(line) = line.filter(|l| BEGIN.iter().any(|b| l.starts_with(b))) else { continue };
            let below = indented[k + 1..].iter().map_while(|l| *l).map(str::to_owned);
            let answer = if line.starts_with('$') { below.collect() } else { Vec::new() };
            all.push(Shown { page: name.clone(), command: line.trim().to_owned(), answer });
        }
    }
    all
}

/// The program's arguments, if it is one of its commands; not of the studio, which does not end by itself.
fn arguments(command: &str) -> Option<&str> {
    BEGIN[..4].iter().find_map(|b| command.strip_prefix(b)).filter(|a| !a.starts_with("studio "))
}

fn elsewhere(command: &str) -> bool {
    let found = ELSEWHERE.iter().find(|e| e.0 == command);
    found.is_some_and(|(_, file, text)| {
        let there = std::fs::read_to_string(root().join(file)).expect(file);
        assert!(there.contains(text), "{file} does not run `{command}`");
        true
    })
}

#[test]
fn every_command_is_run_somewhere() {
    let all = shown();
    assert!(all.len() > 30, "{}", all.len());
    for Shown { page, command, .. } in all {
        let here = arguments(&command).is_some() || command.starts_with("cargo run --release --example ");
        assert!(here || elsewhere(&command), "{page}: nothing runs `{command}`");
    }
}

/// A folder with what the commands read: the examples, a user's own materials, scripts of the corpus by their names.
fn desk() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["examples", "tests"] {
        symlink(root().join(name), folder.path().join(name)).expect("linked");
    }
    std::fs::create_dir(folder.path().join("materials")).expect("made");
    symlink(root().join("examples/velvet.osl"), folder.path().join("materials/velvet.osl")).expect("linked");
    folder
}

/// Runs a command as it is shown, but quicker; `# 3` at its end, or an error below it, is the exit status it says.
fn run(folder: &Path, Shown { page, command, answer }: &Shown) {
    let (line, status) = command.split_once("  # ").unwrap_or((command, "0"));
    let status = if answer.iter().any(|l| l.starts_with("error[")) { "3" } else { status };
    let mut line = arguments(line).expect("a command of the program").to_owned();
    for (slow, quick) in QUICKER {
        line = line.replace(slow, quick);
    }
    let mut words: Vec<&str> = line.split_whitespace().collect();
    if words[0] == "render" {
        words.extend(if line.contains("--spp") { &[][..] } else { &["--spp", "1"] });
        words.extend(if line.contains("--size") { &[][..] } else { &["--size", "32"] });
    }
    for script in words.iter().filter(|w| w.ends_with(".osl") && !folder.join(w).exists()) {
        symlink(root().join("tests/corpus/energy").join(script), folder.join(script)).expect("linked");
    }
    let output = overcoat(&words).current_dir(folder).output().expect("the program starts");
    let (said, told) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), status.parse().ok(), "{page}: {command}: {told}");
    match words.iter().skip_while(|w| **w != "-o").nth(1).map(|file| folder.join(file)) {
        Some(file) if file.extension().is_some_and(|e| e == "png") => {
            image::open(file).expect("a picture");
        }
        Some(file) => assert!(file.exists(), "{page}: {command}"),
        None => assert!(said.len() + told.len() > 100 || line.contains("github"), "{page}: {command}: {said}{told}"),
    }
    for shown in answer.iter().map(|l| l.trim_end()).filter(|l| l.trim() != "…") {
        assert!(
            said.lines().chain(told.lines()).any(|l| l.trim_end() == shown),
            "{page}: {command}: no `{shown}` in\n{said}{told}"
        );
    }
}

#[test]
fn commands_of_the_program_run() {
    let (folder, mut seen) = (desk(), BTreeSet::new());
    for shown in shown().iter().filter(|s| arguments(&s.command).is_some() && seen.insert(s.command.clone())) {
        run(folder.path(), shown);
        // The other half of a campaign in parts.
        if shown.command.contains("--shard 1/32") {
            let command = shown.command.replace("--shard 1/32", "--shard 2/2").replace("1.json", "2.json");
            run(folder.path(), &Shown { page: shown.page.clone(), command, answer: Vec::new() });
        }
    }
    assert!(seen.len() > 20, "{seen:?}");
}

fn example(folder: &Path, name: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO"));
    command.args(["run", "--quiet", "--manifest-path"]).arg(root().join("Cargo.toml"));
    // As these tests were built, and the examples with them: other features would build the library anew.
    command.args(cfg!(all(feature = "capi", feature = "proptest")).then_some("--all-features"));
    command.args(["--example", name, "--"]);
    let output = command.args(arguments).current_dir(folder).output().expect("cargo starts");
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The hosts that need only cargo. The tests of the C interface run those in C, `.ci/run` the one in Python.
#[test]
fn hosts_run() {
    let (folder, mut seen) = (tempfile::tempdir().expect("a folder"), BTreeSet::new());
    for Shown { command, .. } in shown() {
        let Some(line) = command.strip_prefix("cargo run --release --example ") else { continue };
        if !seen.insert(line.to_owned()) {
            continue;
        }
        let (name, arguments) = line.split_once(" -- ").expect("arguments");
        let mut words: Vec<&str> = arguments.split_whitespace().collect();
        let file = words.iter().skip_while(|a| **a != "-o").nth(1).expect("an output").to_string();
        words.extend(["--spp", "2", "--size", "32"]);
        example(folder.path(), name, &words);
        let picture = image::open(folder.path().join(file)).expect("a picture").to_rgb8();
        let light = picture.pixels().filter(|p| p.0.iter().any(|c| *c > 40)).count();
        assert!(light > 400, "{light} of {} pixels are not dark", 32 * 32);
    }
    assert!(!seen.is_empty());
    // What the pages link to and show no command for.
    assert!(example(folder.path(), "embed", &[]).contains("albedo by quadrature"));
    let gains = example(folder.path(), "furnace", &[]);
    assert!(gains.contains("`layered` gains nothing") && gains.contains("`added`"), "{gains}");
}
