//! A test for your own materials: does any of them give back more light than it receives?
//!
//! `cargo run --release --example furnace -- my.osl other.osl`; without arguments, two scripts that are built in.

use overcoat::{Engine, audit};

const SCRIPTS: [(&str, &str); 2] = [
    ("layered", "Ci = sheen(0.9 * diffuse(N) + 0.1 * translucent(N), N, color(1, 0.9, 0.8), 0.4);"),
    // Everything the ground reflects, and the sheen on top of that.
    ("added", "Ci = 0.9 * diffuse(N) + sheen(N, 0.4);"),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scripts: Vec<(String, String)> = Vec::new();
    for file in std::env::args().skip(1) {
        scripts.push((file.clone(), std::fs::read_to_string(&file)?));
    }
    if scripts.is_empty() {
        scripts.extend(SCRIPTS.map(|(name, text)| (name.to_owned(), text.to_owned())));
    }
    for (name, text) in &scripts {
        let material = Engine::new().compile(name, text)?.material(&[])?;
        match audit::assert_no_gain(&material) {
            Ok(()) => println!("`{name}` gains nothing"),
            Err(gain) => println!("{gain}"),
        }
    }
    Ok(())
}
