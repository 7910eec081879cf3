//! The fuzzers' targets on the inputs that fuzzing kept, on the scripts of the corpus, and on inputs that a seed draws:
//! what fuzzing does, in small. `fuzz/run.sh` looks further, `fuzz/keep.py` keeps what it finds.
#![cfg(all(feature = "cloth", feature = "microfacet", feature = "legacy"))]

#[path = "../fuzz/src/lib.rs"]
mod targets;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
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

/// Runs a target over `count` inputs: one of `seeds` with a few bytes changed or its end cut off, or bytes at random.
fn mutated(target: fn(&[u8]), seeds: &[Vec<u8>], count: usize) {
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    for _ in 0..count {
        let length = rng.random_range(1..160);
        let mut bytes: Vec<u8> = match seeds.len() {
            0 => (0..length).map(|_| rng.random()).collect(),
            n => seeds[rng.random_range(0..n)].clone(),
        };
        for _ in 0..rng.random_range(0..6) {
            let at = rng.random_range(0..bytes.len());
            bytes[at] = rng.random();
        }
        if rng.random_range(0..4) == 0 {
            bytes.truncate(rng.random_range(1..=bytes.len()));
        }
        // Whose input fails is told by what it prints last.
        println!("{bytes:?}");
        target(&bytes);
    }
}

const SCRIPTS: [&str; 3] = ["tests/corpus/osl", "tests/corpus/energy", "examples"];
const SCRIPT: &str = "surface a(float r = 0.3) { Ci = sheen(diffuse(N), N, 1, r); }";

#[test]
fn scripts_parse_or_are_errors() {
    assert!(replay(targets::parse, &["fuzz/corpus/parse"]) > 20);
    assert!(replay(targets::parse, &SCRIPTS) > 20);
    mutated(targets::parse, &[SCRIPT.into()], 200);
}

#[test]
fn scripts_are_shaded_alone_as_side_by_side() {
    assert!(replay(targets::front_end, &["fuzz/corpus/front_end"]) > 20);
    assert!(replay(targets::front_end, &SCRIPTS) > 20);
    mutated(targets::front_end, &[SCRIPT.into()], 200);
}

#[test]
fn closure_trees_give_sane_numbers() {
    assert!(replay(targets::trees, &["fuzz/corpus/trees"]) > 20);
    mutated(targets::trees, &[], 40);
}

#[cfg(feature = "capi")]
#[test]
fn calls_of_the_c_interface_are_answered() {
    assert!(replay(targets::handles, &["fuzz/corpus/handles"]) > 20);
    mutated(targets::handles, &[], 100);
}

#[cfg(feature = "studio")]
#[test]
fn the_studio_answers_any_request() {
    assert!(replay(targets::studio, &["fuzz/corpus/studio"]) > 20);
    let body = format!("{{\"text\": \"{SCRIPT}\", \"path\": \"a.osl\", \"size\": 16, \"spp\": 1}}");
    let seeds: Vec<Vec<u8>> = (0..24u8).map(|first| [&[first], body.as_bytes()].concat()).collect();
    mutated(targets::studio, &seeds, 100);
    mutated(targets::studio, &[], 100);
}

#[cfg(feature = "studio")]
#[test]
fn pictures_light_or_are_errors() {
    use overcoat::preview::{Image, output};
    assert!(replay(targets::light, &["fuzz/corpus/light"]) > 20);
    let image = Image::from_vec(4, 2, (0..24).map(|i| i as f32).collect()).expect("a picture");
    let exr = output::exr(&image).expect("written");
    let hdr = [&b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n"[..], &[128; 32]].concat();
    mutated(targets::light, &[exr, hdr], 300);
}
