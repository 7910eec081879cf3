//! The listings of the README and of docs/embedding.md and docs/guide.md, with what they leave out: they compile, and they
//! run. A page may say nothing that is not here, line by line and in the same order.

use overcoat::{Engine, Globals, Material, Scratch};
use std::ops::{AddAssign, Div, Mul, MulAssign};
use std::path::Path;

type Result<T = ()> = std::result::Result<T, Box<dyn std::error::Error>>;

/// What a line says, without the remark at its end.
fn said(line: &str) -> &str {
    line.split("//").next().unwrap_or("").trim()
}

/// Finds the blocks of Rust of a page in this file; how many there are.
fn listed(page: &str) -> usize {
    let here = include_str!("listings.rs");
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).expect(page);
    let blocks: Vec<&str> = text.split("```rust\n").skip(1).map(|b| b.split("```").next().expect("an end")).collect();
    for block in &blocks {
        let mut lines = here.lines().map(said);
        for line in block.lines().map(said).filter(|l| !l.is_empty()) {
            assert!(
                lines.any(|l| l == line),
                "{page}: `{line}` is not in tests/hosts/listings.rs, or not in this order"
            );
        }
    }
    blocks.len()
}

#[test]
fn the_pages_show_what_is_here() {
    assert_eq!(["README.md", "docs/embedding.md", "docs/guide.md"].map(listed), [1, 2, 1]);
}

const VELVET: &str = "surface velvet(color ground = color(0.6, 0.02, 0.05), float roughness = 0.3)
    { Ci = sheen(ground * diffuse(N), N, 1, roughness); }";
const WO: glam::Vec3 = glam::Vec3::new(0.6, 0.0, 0.8);

#[test]
fn the_readmes_calls() -> Result {
    let (source, globals, wo, wi) = (VELVET, Globals::default(), WO, [0.0, 0.6, 0.8]);
    let [u1, u2, u3] = [0.1, 0.2, 0.3];
    let material = overcoat::Engine::new().material("velvet", source)?;
    let bsdf = material.shade(&globals, wo)?;
    let eval = bsdf.eval(wi);
    let sample = bsdf.sample([u1, u2, u3]);
    let shadow = bsdf.transparency();
    assert!(eval.f_cos[0] > eval.f_cos[1] && sample.is_some() && shadow == [0.0; 3]);
    Ok(())
}

#[test]
fn the_guides_test() -> Result {
    let script = VELVET;
    let material = overcoat::Engine::new().material("mine", script)?;
    overcoat::audit::assert_no_gain(&material)?;
    Ok(())
}

/// A host's colour.
#[derive(Clone, Copy, Debug)]
struct Rgb([f32; 3]);

impl Mul for Rgb {
    type Output = Rgb;
    fn mul(self, by: Rgb) -> Rgb {
        Rgb(std::array::from_fn(|c| self.0[c] * by.0[c]))
    }
}

impl Mul<[f32; 3]> for Rgb {
    type Output = Rgb;
    fn mul(self, by: [f32; 3]) -> Rgb {
        self * Rgb(by)
    }
}

impl Mul<f32> for Rgb {
    type Output = Rgb;
    fn mul(self, by: f32) -> Rgb {
        Rgb(self.0.map(|x| x * by))
    }
}

impl Div<f32> for Rgb {
    type Output = Rgb;
    fn div(self, by: f32) -> Rgb {
        Rgb(self.0.map(|x| x / by))
    }
}

impl AddAssign for Rgb {
    fn add_assign(&mut self, other: Rgb) {
        *self = Rgb(std::array::from_fn(|c| self.0[c] + other.0[c]));
    }
}

impl MulAssign<[f32; 3]> for Rgb {
    fn mul_assign(&mut self, by: [f32; 3]) {
        *self = *self * by;
    }
}

/// The loop of a path tracer, between two walls that shine.
fn path(material: &Material) -> Result<Rgb> {
    let power = |a: f32, b: f32| a * a / (a * a + b * b);
    let weight_against = |pdf: f32| pdf;
    let emission = |given: [f32; 3], weight: f32| Rgb(given) * weight;
    let (lamp, lamp_pdf, transparency_on_the_way, toward_lamp) = (Rgb([1.0; 3]), 0.5, 1.0, [0.0, 0.6, 0.8]);
    let (mut light, mut carried, mut scratch) = (Rgb([0.0; 3]), Rgb([1.0; 3]), Scratch::new());
    let (globals, mut wo) = (Globals::default(), WO);
    for k in 0..4 {
        let [u1, u2, u3] = [0.3, 0.2, 0.1].map(|u| u + 0.2 * k as f32);
        let bsdf = material.shade_in(&globals, wo, &mut scratch)?;
        light += carried * emission(bsdf.emission(), weight_against(lamp_pdf));
        let eval = bsdf.eval(toward_lamp);
        light += carried * lamp * eval.f_cos * transparency_on_the_way * power(lamp_pdf, eval.pdf) / lamp_pdf;
        let Some(sample) = bsdf.sample([u1, u2, u3]) else { break };
        carried *= sample.weight;
        wo = glam::Vec3::from(sample.wi);
    }
    Ok(light)
}

#[test]
fn a_path_carries_light() -> Result {
    let light = path(&Engine::new().material("velvet", VELVET)?)?;
    assert!(light.0[0] > light.0[1] && light.0.iter().all(|x| *x > 0.0 && *x < 4.0), "{light:?}");
    Ok(())
}

#[test]
fn a_material_without_a_script() -> Result {
    let (globals, wo) = (Globals::default(), WO);
    let mut b = Engine::new().builder();
    let roughness = b.float(0.3);
    let ground = b.lobe("diffuse", []);
    let ground = b.mul([0.6, 0.02, 0.05], ground);
    let fuzz = b.lobe("sheen_bsdf", [("roughness", roughness.into())]);
    let cloth = b.layer(fuzz, ground);
    let cloth = b.finish(cloth)?;

    let mut inputs = cloth.inputs();
    inputs.set(roughness, 0.5)?;
    let bsdf = cloth.shade(&globals, wo, &inputs)?;
    let albedo = bsdf.albedo();
    assert!(albedo[0] > albedo[1] && albedo[0] < 1.0, "{albedo:?}");
    Ok(())
}

/// The calls of the C listing, as its header declares them.
#[cfg(feature = "capi")]
#[test]
fn the_listing_in_c_compiles() {
    use std::io::Write;
    use std::process::{Command, Stdio};
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("docs/embedding.md")).expect("the page");
    let block = text.split("```c\n").nth(1).and_then(|t| t.split("```").next()).expect("a listing");
    let program = format!(
        "#include <overcoat.h>\n#include <string.h>\nvoid check(oc_status);
        void listing(const char *source, const float *wo, const float *toward_light);
        void listing(const char *source, const float *wo, const float *toward_light)
        {{ oc_globals globals; float f_cos[3], pdf;\n{block}\n}}\n"
    );
    let mut compiler = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-x", "c", "-I"])
        .arg(root.join("include"))
        .arg("-")
        .stdin(Stdio::piped())
        .spawn()
        .expect("a compiler");
    compiler.stdin.take().expect("stdin").write_all(program.as_bytes()).expect("read");
    assert!(compiler.wait().expect("ended").success(), "{program}");
}
