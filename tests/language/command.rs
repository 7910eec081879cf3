//! The language on the command line: include directories, textures, printing, explanations, the shipped header.
#![cfg(feature = "cli")]

use std::path::Path;
use std::process::{Command, Output};

fn overcoat(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_overcoat")).args(args).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A folder with a script, a header in another folder, and a picture.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    std::fs::create_dir(folder.path().join("lib")).expect("a folder");
    write("lib/shared.h", "#include \"beside.h\"\nfloat shared() { return BESIDE; }\n");
    write("lib/beside.h", "#define BESIDE 0.5\n");
    write("a.osl", "#include \"shared.h\"\nprintf(\"at %g\\n\", u);\nCi = shared() * diffuse(N);\n");
    write("t.osl", "Ci = (color) texture(\"dots.png\", 0.75, 0.25, \"interp\", \"closest\") * diffuse(N);\n");
    write(
        "l.osl",
        "Ci = (color) texture(\"dots.png\", 0.5, 0.25, \"wrap\", \"clamp\", \"colorspace\", \"Raw\") * diffuse(N);\n",
    );
    let mut dots = image::RgbaImage::new(2, 2);
    dots.put_pixel(1, 0, image::Rgba([255, 0, 188, 255]));
    dots.save(folder.path().join("dots.png")).expect("saved");
    folder
}

fn tree(folder: &Path, script: &str, more: &[&str]) -> Output {
    let path = folder.join(script).display().to_string();
    let lib = folder.join("lib").display().to_string();
    overcoat(&[&["tree", &path, "--json", "-I", &lib], more].concat())
}

fn weight(output: &Output) -> Vec<f64> {
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let weight = json["closure"]["weight"].as_array().expect("a weight");
    weight.iter().map(|x| x.as_f64().expect("a number")).collect()
}

#[test]
fn includes_come_from_directories_and_printing_goes_to_stderr() {
    let folder = folder();
    let output = tree(folder.path(), "a.osl", &[]);
    assert_eq!(weight(&output), [0.5; 3], "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "at 0\n");
    assert!(tree(folder.path(), "a.osl", &["--quiet"]).stderr.is_empty());
    let path = folder.path().join("a.osl").display().to_string();
    let output = overcoat(&["tree", &path]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("E0103"));
}

#[test]
fn textures_are_read_from_files() {
    let folder = folder();
    let nearest = weight(&tree(folder.path(), "t.osl", &[]));
    // 188/255 is half, decoded from sRGB.
    assert!((nearest[0] - 1.0).abs() < 1e-6 && nearest[1] == 0.0 && (nearest[2] - 0.5029).abs() < 1e-3, "{nearest:?}");
    let between = weight(&tree(folder.path(), "l.osl", &[]));
    assert!((between[0] - 0.5).abs() < 1e-6 && (between[2] - 0.5 * 188.0 / 255.0).abs() < 1e-5, "{between:?}");
    std::fs::remove_file(folder.path().join("dots.png")).expect("removed");
    let output = tree(folder.path(), "t.osl", &[]);
    assert!(text(&output.stderr).contains("`dots.png` cannot be read"));
}

#[test]
fn codes_are_explained_and_trees_too() {
    let output = overcoat(&["explain", "e0203"]);
    assert!(text(&output.stdout).starts_with("E0203: "));
    assert_eq!(overcoat(&["explain", "E9999"]).status.code(), Some(2));
    let all = text(&overcoat(&["explain"]).stdout);
    assert_eq!(all.lines().count(), overcoat::diag::CODES.len());
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/velvet.osl");
    let output = text(&overcoat(&["tree", example, "--explain", "--set", "roughness=0.5"]).stdout);
    assert!(output.contains("folded into the program as they are set: `roughness`"), "{output}");
    assert!(output.contains("is never made"), "{output}");
}

#[test]
fn the_reference_of_closures_is_fresh_and_pictured() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let made = text(&overcoat(&["lobes", "--markdown"]).stdout);
    let shipped = std::fs::read_to_string(root.join("lobes.md")).expect("there");
    assert!(made == shipped, "run `overcoat lobes --markdown > docs/lobes.md`");
    let linked = |(_, rest): (usize, &str)| rest.split_once(')').map(|(path, _)| path.to_owned());
    let pictures: Vec<String> =
        made.match_indices("](lobes/").map(|(at, m)| (at, &made[at + m.len() - 6..])).filter_map(linked).collect();
    assert!(pictures.len() > 40, "{}", pictures.len());
    for path in pictures {
        assert!(root.join(&path).exists(), "{path}: run `overcoat lobes --gallery docs/lobes`");
    }
}

#[test]
fn the_shipped_header_is_fresh() {
    let made = text(&overcoat(&["lobes", "--header"]).stdout);
    let shipped =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/include/osl/overcoat.h")).expect("there");
    assert_eq!(made, shipped, "run `overcoat lobes --header > include/osl/overcoat.h`");
    assert!(made.contains("closure color sheen(closure color base, normal N, color tint, float roughness) BUILTIN;"));
}
