//! What the README says can be done can be done.
#![cfg(feature = "cli")]

use std::path::Path;
use std::process::Command;

fn readme() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).expect("README.md")
}

#[test]
fn its_commands_run() {
    let folder = tempfile::tempdir().expect("a folder");
    std::os::unix::fs::symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"), folder.path().join("examples"))
        .expect("linked");
    let mut pictures = 0;
    for line in readme().lines() {
        let Some(arguments) = line.strip_prefix("    cargo run --release -- ") else { continue };
        // This one does not end by itself; `tests/program/studio.rs` runs it.
        if arguments.starts_with("studio ") {
            continue;
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_overcoat"));
        // The same, but quick.
        command.current_dir(folder.path()).args(arguments.split_whitespace()).args(["--spp", "1"]);
        if !arguments.contains("--size") {
            command.args(["--size", "32"]);
        }
        let output = command.output().expect("the program starts");
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        let file = arguments.split_whitespace().skip_while(|a| *a != "-o").nth(1).expect("an output");
        image::open(folder.path().join(file)).expect("a picture");
        pictures += 1;
    }
    assert!(pictures >= 2, "{pictures} pictures");
}

/// Each host is built and run by one command: this runs those that need only cargo, `tests/hosts/capi.rs` the one for C, `.ci/run`
/// the one for Python.
#[test]
fn its_hosts_run() {
    let (root, folder) = (Path::new(env!("CARGO_MANIFEST_DIR")), tempfile::tempdir().expect("a folder"));
    let mut hosts = 0;
    for line in readme().lines() {
        let Some(arguments) = line.strip_prefix("    cargo run --release --example ") else { continue };
        let (name, arguments) = arguments.split_once(" -- ").expect("arguments");
        let mut command = Command::new(env!("CARGO"));
        command.args(["run", "--quiet", "--manifest-path"]).arg(root.join("Cargo.toml")).args([
            "--example",
            name,
            "--",
        ]);
        command.args(arguments.split_whitespace()).args(["--spp", "2", "--size", "32"]).current_dir(folder.path());
        let output = command.output().expect("cargo starts");
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        let file = arguments.split_whitespace().skip_while(|a| *a != "-o").nth(1).expect("an output");
        let picture = image::open(folder.path().join(file)).expect("a picture").to_rgb8();
        let light = picture.pixels().filter(|p| p.0.iter().any(|c| *c > 40)).count();
        assert!(light > 400, "{light} of {} pixels are not dark", 32 * 32);
        hosts += 1;
    }
    assert!(hosts >= 1);
    let ci = std::fs::read_to_string(root.join(".ci/run")).expect(".ci/run");
    let python =
        readme().lines().find_map(|l| l.strip_prefix("    pip install ").map(str::to_owned)).expect("a command");
    let script =
        python.split("python ").nth(1).expect("a script").split_whitespace().next().expect("a path").to_owned();
    assert!(root.join(&script).exists() && ci.contains(&script), "{script}");
    assert!(readme().contains("    sh examples/c/run.sh\n") && root.join("examples/c/run.sh").exists());
}

/// In the pages that show commands; `# 3` at the end of a line is the exit status it says.
#[test]
fn the_commands_of_the_pages_run() {
    let (root, folder) = (Path::new(env!("CARGO_MANIFEST_DIR")), tempfile::tempdir().expect("a folder"));
    for page in ["audit.md", "guide.md"] {
        let text = std::fs::read_to_string(root.join("docs").join(page)).expect(page);
        let mut commands = 0;
        for line in text.lines() {
            let Some(arguments) = line.strip_prefix("    cargo run --release -- ") else { continue };
            let (arguments, status) = arguments.split_once("  # ").unwrap_or((arguments, "0"));
            let mut command = Command::new(env!("CARGO_BIN_EXE_overcoat"));
            command.current_dir(root);
            for argument in arguments.split_whitespace() {
                // Pictures go elsewhere.
                match argument.ends_with(".png") {
                    true => command.arg(folder.path().join(argument)),
                    false => command.arg(argument),
                };
            }
            let output = command.output().expect("the program starts");
            let message = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), status.parse().ok(), "{page}: {line}: {message}");
            assert!(output.stdout.len() + message.len() > 100 || arguments.contains(".png"), "{page}: {line}");
            commands += 1;
        }
        assert!(commands >= 4, "{page}: {commands} commands");
    }
}

#[test]
fn the_guides_scripts_compile_and_its_links_lead_somewhere() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let text = std::fs::read_to_string(docs.join("guide.md")).expect("docs/guide.md");
    let script = text.split("```c\n").nth(1).and_then(|t| t.split("```").next()).expect("a script");
    let shader = overcoat::Engine::new().compile("guide", script).expect("compiles");
    assert!(shader.warnings().is_empty() && shader.params().len() == 2);
    for link in text.split("](").skip(1) {
        let target = link.split(')').next().expect("a target");
        let heading = target.strip_prefix('#').map(|anchor| anchor.replace('-', " "));
        let found = match heading {
            Some(heading) => text.lines().any(|l| l.to_lowercase() == format!("## {heading}")),
            None => docs.join(target).exists(),
        };
        assert!(found, "{target}");
    }
}

#[test]
fn its_script_compiles_without_a_warning() {
    let text = readme();
    let script = text.split("```c\n").nth(1).and_then(|t| t.split("```").next()).expect("a script");
    let shader = overcoat::Engine::new().compile("readme", script).expect("compiles");
    assert!(shader.warnings().is_empty());
    assert_eq!(shader.params().len(), 4);
}

#[test]
fn its_table_names_every_command() {
    let help = Command::new(env!("CARGO_BIN_EXE_overcoat")).arg("--help").output().expect("the program starts");
    let help = String::from_utf8(help.stdout).expect("text");
    let commands = help.split("Commands:").nth(1).and_then(|t| t.split("Options:").next()).expect("commands");
    for line in commands.lines().filter(|l| l.starts_with("  ") && !l.starts_with("   ")) {
        let name = line.split_whitespace().next().expect("a name");
        assert!(name == "help" || readme().contains(&format!("`overcoat {name} ")), "README without `{name}`");
    }
}

#[test]
fn its_files_exist() {
    for link in readme().split("](").skip(1) {
        let target = link.split(')').next().expect("a target");
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(target).exists(), "{target}");
    }
}
