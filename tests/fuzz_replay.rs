//! What the fuzzers found worth keeping, once more, and the scripts they began with. `fuzz/run.sh` looks for more.

#[path = "../fuzz/src/lib.rs"]
mod targets;

use std::path::Path;

/// Runs a target over every file of these folders; how many there were.
fn replay(target: fn(&[u8]), folders: &[&str]) -> usize {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for folder in folders {
        let mut files: Vec<_> =
            std::fs::read_dir(root.join(folder)).expect("a folder").map(|e| e.expect("an entry").path()).collect();
        files.sort();
        for file in files.iter().filter(|f| f.is_file()) {
            let bytes = std::fs::read(file).expect("a file");
            // Whose input fails is told by what it prints last.
            println!("{}", file.display());
            target(&bytes);
            count += 1;
        }
    }
    count
}

const SCRIPTS: [&str; 3] = ["tests/corpus/osl", "tests/corpus/energy", "examples"];

#[test]
fn scripts_parse_or_are_errors() {
    assert!(replay(targets::parse, &SCRIPTS) > 20);
    assert!(replay(targets::parse, &["fuzz/corpus/parse"]) > 20);
}

#[test]
fn scripts_are_shaded_alone_as_side_by_side() {
    assert!(replay(targets::front_end, &SCRIPTS) > 20);
    assert!(replay(targets::front_end, &["fuzz/corpus/front_end"]) > 20);
}

#[test]
fn closure_trees_give_sane_numbers() {
    assert!(replay(targets::trees, &["fuzz/corpus/trees"]) > 20);
}

#[cfg(feature = "capi")]
#[test]
fn calls_of_the_c_interface_are_answered() {
    assert!(replay(targets::handles, &["fuzz/corpus/handles"]) > 20);
}

#[cfg(feature = "studio")]
#[test]
fn the_studio_answers_any_request() {
    assert!(replay(targets::studio, &["fuzz/corpus/studio"]) > 20);
}

#[cfg(feature = "studio")]
#[test]
fn pictures_light_or_are_errors() {
    assert!(replay(targets::light, &["fuzz/corpus/light"]) > 20);
}
