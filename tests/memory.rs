//! What memory it takes: a picture less than 200 MiB at its most, the albedo tables of a material less than 256 KiB.
#![cfg(feature = "cli")]

use overcoat::Engine;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The scripts of `examples`.
fn examples() -> Vec<PathBuf> {
    let files = std::fs::read_dir(root().join("examples")).expect("the examples").map(|e| e.expect("an entry").path());
    files.filter(|f| f.extension().is_some_and(|e| e == "osl")).collect()
}

/// As the program bakes them unless it is told otherwise.
#[test]
fn the_tables_of_every_example_fit_in_a_quarter_of_a_megabyte() {
    let mut seen = 0;
    for file in examples() {
        let text = std::fs::read_to_string(&file).expect("a script");
        let material = Engine::new().material(&file.display().to_string(), &text).expect("compiles");
        println!("{}: {} bytes", file.display(), material.table_bytes());
        assert!(material.table_bytes() <= 256 << 10, "{}: {} bytes", file.display(), material.table_bytes());
        seen += 1;
    }
    assert!(seen > 5, "{seen} examples");
}

/// The most that was resident at once, in bytes, by the kernel's own mark, which is read until the program ends.
#[cfg(target_os = "linux")]
fn peak(arguments: &[&str]) -> u64 {
    let folder = tempfile::tempdir().expect("a folder");
    let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_overcoat"))
        .args(arguments)
        .arg("--quiet")
        .arg("-o")
        .arg(folder.path().join("out.png"))
        .current_dir(root())
        .spawn()
        .expect("the program starts");
    let status = format!("/proc/{}/status", program.id());
    let mut peak = 0;
    loop {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let mark = text.lines().find_map(|l| l.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
        peak = peak.max(mark.unwrap_or(0));
        if let Some(done) = program.try_wait().expect("its status") {
            assert!(done.success(), "{arguments:?}: {done}");
            return peak << 10;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// The picture is in memory as a whole, so that its size counts and the samples do not.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_takes_less_than_200_megabytes() {
    for scene in ["sphere", "drape"] {
        for file in ["examples/velvet.osl", "examples/denim.osl"] {
            let peak = peak(&["render", file, "--scene", scene, "--size", "512", "--spp", "1"]);
            println!("{file} on {scene}: {} MiB", peak >> 20);
            assert!(peak > 4 << 20, "{file} on {scene}: {peak} bytes, which is too little to be true");
            assert!(peak < 200 << 20, "{file} on {scene}: {} MiB", peak >> 20);
        }
    }
}
