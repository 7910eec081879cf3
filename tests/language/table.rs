//! The feature table of docs/language.md names tests that exist, and every corpus of values is in it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn names(folder: &Path) -> BTreeSet<String> {
    let files = std::fs::read_dir(folder).expect("a folder").flatten();
    files.filter_map(|f| Some(f.path().file_stem()?.to_string_lossy().into_owned())).collect()
}

#[test]
fn every_feature_has_a_test_that_shows_it() {
    let text = std::fs::read_to_string(root().join("docs/language.md")).expect("the document");
    let files = std::fs::read_dir(root().join("tests/language")).expect("a folder").flatten();
    let tests: String = files.map(|f| std::fs::read_to_string(f.path()).expect("a test file")).collect();
    let mut shown = BTreeSet::new();
    let mut rows = 0;
    for line in text.lines().filter(|l| l.starts_with("| ")).skip(1) {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
        assert_eq!(cells.len(), 4, "{line}");
        let known = ["works", "host", "refused", "zero", "`step`"];
        assert!(known.iter().any(|k| cells[2].starts_with(k)), "{line}");
        for reference in cells[3].split(", ") {
            match reference.split_once('/') {
                Some((folder, name)) => {
                    let found = names(&root().join("tests/corpus").join(folder));
                    assert!(found.contains(name), "{reference}");
                }
                None => assert!(tests.contains(&format!("fn {reference}()")), "{reference}"),
            }
            shown.insert(reference.to_owned());
        }
        rows += 1;
    }
    assert!(rows > 50, "{rows} rows");
    for name in names(&root().join("tests/corpus/values")) {
        assert!(shown.contains(&format!("values/{name}")), "values/{name} is not in the table");
    }
}
