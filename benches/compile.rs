//! What comes before the first point: reading and checking a script (`compile`), folding it into a material whose tables
//! another material of the engine holds already (`specialise`), and with its tables to be baked (`bake`).
//!
//!     cargo bench --bench compile -- velvet

use divan::{Bencher, black_box};
use overcoat::{Engine, Shader};
use std::path::Path;

/// A generated material: 240 lines of its own after 300 of operators.
const GENERATED: &str = "tests/corpus/osl/standard_surface.osl";

/// A script of about 500 lines.
const LONG: &str = "500 lines";

/// The examples, by their names, and two that are longer.
fn names() -> Vec<String> {
    let files = std::fs::read_dir(root().join("examples")).expect("the examples").map(|e| e.expect("an entry").path());
    let scripts = files.filter(|f| f.extension().is_some_and(|e| e == "osl"));
    let mut names: Vec<_> = scripts.filter_map(|f| Some(format!("examples/{}", f.file_name()?.to_str()?))).collect();
    names.sort();
    names.extend([GENERATED, LONG].map(str::to_owned));
    names
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn script(name: &str) -> String {
    if name == LONG { long() } else { std::fs::read_to_string(root().join(name)).expect("a script") }
}

/// 100 functions of five lines, all of them called.
fn long() -> String {
    let mut text = String::new();
    for i in 0..100 {
        text += &format!(
            "float part{i}(float x, float y)\n{{\n    float a = sin(x * {i}.5) + y;\n    return clamp(a, 0, 1);\n}}\n"
        );
    }
    text += "surface long(float k = 0.5) {\n    float sum = 0;\n";
    for i in 0..100 {
        text += &format!("    sum += part{i}(u + k, v) * 0.01;\n");
    }
    text + "    Ci = sum * diffuse(N);\n}\n"
}

fn shader(name: &str, text: &str) -> Shader {
    Engine::new().compile(name, text).expect("compiles")
}

#[divan::bench(args = names())]
fn compile(bencher: Bencher, name: &str) {
    let text = script(name);
    let engine = Engine::new();
    bencher.bench_local(|| engine.compile(name, black_box(&text)));
}

#[divan::bench(args = names())]
fn specialise(bencher: Bencher, name: &str) {
    let shader = shader(name, &script(name));
    let holds_the_tables = shader.material(&[]).expect("specialises");
    bencher.bench_local(|| shader.material(black_box(&[])));
    drop(holds_the_tables);
}

#[divan::bench(args = names(), sample_count = 5, sample_size = 1)]
fn bake(bencher: Bencher, name: &str) {
    let text = script(name);
    bencher.with_inputs(|| shader(name, &text)).bench_local_values(|shader| shader.material(black_box(&[])));
}

fn main() {
    divan::main();
}
