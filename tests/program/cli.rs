//! The command line contract: JSON shapes, exit status, bad input.
#![cfg(feature = "cli")]

use serde_json::Value;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const VELVET: &str = "Ci = color(0.6, 0.02, 0.05) * diffuse(N);\nCi = sheen(Ci, N, color(1, 0.9, 0.8), 0.3);\n";

/// Runs the program with `script` on stdin.
fn overcoat(args: &[&str], script: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_overcoat"))
        .args(args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stdin = child.stdin.take().expect("stdin");
    let script = script.to_owned();
    // A command that stops early closes its end.
    let feed = std::thread::spawn(move || drop(stdin.write_all(script.as_bytes())));
    let output = child.wait_with_output().expect("the program ends");
    feed.join().expect("fed");
    output
}

fn json(args: &[&str], script: &str) -> Value {
    let output = overcoat(args, script);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON document")
}

/// Exit status and stderr of a command that must fail.
fn fails(args: &[&str], script: &str) -> (i32, String) {
    let output = overcoat(args, script);
    assert!(output.stdout.is_empty(), "{args:?} wrote to stdout: {}", String::from_utf8_lossy(&output.stdout));
    (output.status.code().expect("an exit status"), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn example(name: &str) -> String {
    format!("{}/examples/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn temporary(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    (folder, path)
}

#[test]
fn tree_explains_its_layers() {
    let script = "Ci = layer(velvet(N, 0.5), 0.5 * diffuse(N) + 0.5 * translucent(N));";
    let explain =
        |more: &[&str]| json(&[&["tree", "-", "--json", "--explain"], more].concat(), script)["layering"].clone();
    assert_eq!(explain(&[]), serde_json::json!({ "rule": "min" }));
    let balanced = explain(&["--layering", "balanced"]);
    let rules: Vec<_> = balanced["lobes"].as_array().expect("lobes").iter().map(|l| l["rule"].clone()).collect();
    assert_eq!(rules, ["balanced", "min"], "{balanced}");
    let text = overcoat(&["tree", "-", "--explain", "--layering", "balanced"], script).stdout;
    assert!(String::from_utf8_lossy(&text).contains("translucent: min: it scatters to the other side"));
    let varying = "Ci = layer(u * velvet(N, 0.5), diffuse(N));";
    let text = overcoat(&["tree", "-", "--explain", "--layering", "balanced"], varying).stdout;
    assert!(String::from_utf8_lossy(&text).contains("diffuse below velvet: balanced"));
}

#[test]
fn tree_has_the_promised_shape() {
    let tree = json(&["tree", "-", "--json"], VELVET);
    assert_eq!(tree["shader"], "stdin");
    let layer = &tree["closure"];
    assert_eq!(layer["kind"], "layer");
    assert_eq!(layer["top"]["kind"], "mul");
    assert_eq!(layer["top"]["weight"], serde_json::json!([1.0, 0.9, 0.8]));
    let lobe = &layer["top"]["closure"];
    assert_eq!((lobe["kind"].as_str(), lobe["name"].as_str()), (Some("lobe"), Some("sheen_bsdf")));
    assert_eq!(lobe["params"]["roughness"], 0.3);
    assert_eq!(layer["base"]["closure"]["name"], "diffuse");
    let sum = json(&["tree", "-", "--json"], "Ci = diffuse(N) + translucent(N) + 0.5 * emission();");
    assert_eq!(sum["closure"]["kind"], "add");
    assert_eq!(sum["closure"]["terms"].as_array().map(Vec::len), Some(3));
    assert_eq!(json(&["tree", "-", "--json"], "Ci = 0 * diffuse(N);")["closure"]["kind"], "zero");
    let unweighted = json(&["tree", "-", "--json"], "Ci = sheen(diffuse(N), N, 1, 0.3);");
    assert_eq!(unweighted["closure"]["top"]["kind"], "lobe");
}

#[test]
fn eval_gives_f_cos_and_pdf() {
    let one = json(&["eval", "-", "--json", "--wo", "0,0,2", "--wi", "0,0.6,0.8"], "Ci = diffuse(N);");
    assert!((one["f_cos"][0].as_f64().expect("f") - 0.8 / std::f64::consts::PI).abs() < 1e-6);
    assert!((one["pdf"].as_f64().expect("pdf") - 0.8 / std::f64::consts::PI).abs() < 1e-6);
    let args = ["eval", "-", "--json", "--wo", "0,0,1", "--wi", "0,0,1", "--wi", "0,0,-1"];
    let rows = json(&args, "Ci = diffuse(N);");
    assert_eq!(rows["rows"].as_array().map(Vec::len), Some(2));
    assert_eq!(rows["rows"][1]["f_cos"], serde_json::json!([0.0, 0.0, 0.0]));
    let exact = json(&["eval", "-", "--json", "--tier", "reference", "--wo", "0,0,1", "--wi", "0,0.6,0.8"], VELVET);
    let fast = json(&["eval", "-", "--json", "--tier", "fast", "--wo", "0,0,1", "--wi", "0,0.6,0.8"], VELVET);
    let difference = exact["f_cos"][0].as_f64().expect("f") - fast["f_cos"][0].as_f64().expect("f");
    assert!(difference.abs() < 1e-2 && difference != 0.0, "{difference}");
}

#[test]
fn sample_writes_exactly_the_rows_asked_for() {
    let csv = |seed: &str| {
        let output = overcoat(&["sample", "-", "--wo", "0.3,0,1", "--count", "1000", "--seed", seed], VELVET);
        String::from_utf8(output.stdout).expect("text")
    };
    let text = csv("7");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "wi_x,wi_y,wi_z,f_r,f_g,f_b,pdf,delta");
    assert_eq!(lines.len(), 1001);
    assert!(lines[1..].iter().all(|l| l.split(',').all(|x| x.parse::<f64>().is_ok_and(f64::is_finite))));
    assert_eq!(text, csv("7"), "same seed, same samples");
    assert_ne!(text, csv("8"));
    let black = json(&["sample", "-", "--json", "--wo", "0,0,1", "--count", "3"], "Ci = 0 * diffuse(N);");
    assert_eq!(black["rows"].as_array().map(Vec::len), Some(3));
    assert_eq!(black["rows"][0]["pdf"], 0.0);
    let delta = json(&["sample", "-", "--json", "--wo", "0,0,1", "--count", "1"], "Ci = transparent();");
    assert_eq!((&delta["rows"][0]["delta"], &delta["rows"][0]["wi_z"]), (&Value::from(1), &Value::from(-1.0)));
}

#[test]
fn albedo_measures_from_both_sides() {
    for side in ["view", "light"] {
        let rows = json(&["albedo", "-", "--json", "--side", side, "--cos", "0.9,0.2,-0.5", "--phi", "30"], VELVET);
        assert_eq!(rows["side"], side);
        let rows = rows["rows"].as_array().expect("rows");
        assert_eq!(rows.len(), 3);
        let phi = 30f64.to_radians();
        let sin = (1.0f64 - 0.81).sqrt();
        assert!((rows[0]["dir"][1].as_f64().expect("y") - sin * phi.sin()).abs() < 1e-9);
        assert!(rows[0]["albedo"][0].as_f64().is_some_and(|a| a > 0.5 && a < 1.0001));
        assert!(rows[0]["error"].as_f64().is_some_and(|e| e < 1e-4));
        assert_eq!(rows[2]["albedo"], serde_json::json!([0.0, 0.0, 0.0]));
    }
    let through = json(&["albedo", "-", "--json", "--cos", "-0.5"], "Ci = 0.25*transparent() + 0.5*translucent(N);");
    assert!((through["rows"][0]["albedo"][1].as_f64().expect("albedo") - 0.75).abs() < 1e-4);
    let explained = json(&["albedo", "-", "--json", "--explain", "--cos", "0.4"], VELVET);
    let lobes = explained["rows"][0]["explain"]["lobes"].as_array().expect("lobes");
    let parts: f64 = lobes.iter().map(|l| l["scattered"][0].as_f64().unwrap_or(0.0)).sum();
    let total = explained["rows"][0]["albedo"][0].as_f64().expect("albedo");
    assert!((parts - total).abs() < 1e-4, "{parts} {total}");
}

#[test]
fn lobes_lists_every_closure() {
    let all = json(&["lobes", "--json"], "");
    let names: Vec<&str> = all.as_array().expect("a list").iter().filter_map(|l| l["name"].as_str()).collect();
    for name in ["diffuse", "translucent", "transparent", "emission", "oren_nayar", "sheen_bsdf", "sheen", "layer"] {
        assert!(names.contains(&name), "{name}");
    }
    let sheen = json(&["lobes", "sheen_bsdf", "--json"], "");
    let roughness = sheen[0]["params"].as_array().expect("params").iter().find(|p| p["name"] == "roughness");
    let roughness = roughness.expect("roughness");
    assert_eq!((&roughness["type"], &roughness["max"]), (&Value::from("float"), &Value::from(1.0)));
    assert_eq!(sheen[0]["reciprocal"], false);
    let (status, message) = fails(&["lobes", "shean"], "");
    assert_eq!(status, 2);
    assert!(message.contains("did you mean `sheen`"), "{message}");
}

#[test]
fn cost_measures_before_and_after() {
    let varying = "surface s(float r = 0.1) { Ci = sheen(diffuse(N), N, 1, r + 0.5 * u); }";
    let cost = json(&["cost", "-", "--json", "--set", "r=0.2"], varying);
    assert_eq!(cost["constant"], false);
    assert_eq!(cost["globals"], serde_json::json!(["N", "u"]));
    assert_eq!(cost["lobes"], serde_json::json!(["diffuse", "sheen_bsdf"]));
    for side in [&cost, &cost["unspecialised"]] {
        for key in ["shade", "flatten", "eval", "sample", "eval_batch"] {
            assert!(side["ns"][key].as_f64().is_some_and(|ns| ns > 0.0), "{key}: {side}");
        }
        assert!(side["bytes"]["bsdf"].as_u64().is_some_and(|b| b > 100 && b < 2000));
    }
    let constant = json(&["cost", "-", "--json"], VELVET);
    assert_eq!(constant["constant"], true);
    // One curve for the one roughness, against a table over all of them; what makes it fast has a size of its own: a cubic per
    // cell for D, and for Λ toward a light and toward the viewer a cubic and what the albedo is there.
    let tables = |c: &Value| c["bytes"]["tables"].as_u64().expect("bytes");
    let cubics = 16 * 1024 + 32 * (1024 + 512);
    assert!((tables(&constant) - cubics) * 8 < tables(&cost));
}

#[test]
fn parameters_are_set_by_name() {
    let file = example("velvet.osl");
    let args = ["tree", &file, "--json", "--set", "roughness=0.5", "--set", "base_color=0.1,0.2,0.3"];
    let tree = json(&args, "");
    assert_eq!(tree["shader"], "velvet");
    assert_eq!(tree["closure"]["top"]["params"]["roughness"], 0.5);
    assert_eq!(tree["closure"]["base"]["weight"], serde_json::json!([0.1, 0.2, 0.3]));
    for (set, expected) in [
        ("roughnes=0.5", "did you mean `roughness`"),
        ("roughness", "expected NAME=VALUE"),
        ("roughness=rough", "a float"),
        ("base_color=1,2", "three"),
    ] {
        let (status, message) = fails(&["tree", &file, "--set", set], "");
        assert_eq!(status, 2, "{set}: {message}");
        assert!(message.contains(expected), "{set}: {message}");
    }
    let outside = overcoat(&["tree", &file, "--json", "--set", "roughness=7"], "");
    assert!(outside.status.success());
    assert!(String::from_utf8_lossy(&outside.stderr).contains("outside its range"));
}

#[test]
fn mistakes_in_scripts_exit_1_with_the_place() {
    for (script, expected) in [
        ("Ci = difuse(N);", "diffuse"),
        ("Ci = diffuse(N)", "1:15"),
        ("Ci = diffuse(N) * diffuse(N);", "1:"),
        ("Ci = diffuse(N;", "1:"),
        ("float x = \"a\"; Ci = x * diffuse(N);", "1:"),
        ("Ci = sheen(Ci, N);", "sheen("),
        ("\u{0}", "1:1"),
    ] {
        let (status, message) = fails(&["tree", "-"], script);
        assert_eq!(status, 1, "{script}: {message}");
        assert!(message.contains(expected), "{script}: {message}");
    }
    let (folder, path) = temporary("latin.osl");
    std::fs::write(&path, b"Ci = diffuse(N); // caf\xe9").expect("written");
    let (status, message) = fails(&["tree", path.to_str().expect("a path")], "");
    assert_eq!(status, 1);
    assert!(message.contains("not UTF-8"), "{message}");
    drop(folder);
}

#[test]
fn wrong_usage_exits_2() {
    let missing = fails(&["tree", "no/such/file.osl"], "");
    assert_eq!(missing.0, 2);
    assert!(missing.1.contains("no/such/file.osl"), "{}", missing.1);
    for args in [
        ["eval", "-", "--wo", "0,0,0", "--wi", "0,0,1"],
        ["eval", "-", "--wo", "nan,0,1", "--wi", "0,0,1"],
        ["eval", "-", "--wo", "0,1", "--wi", "0,0,1"],
    ] {
        assert_eq!(fails(&args, VELVET).0, 2, "{args:?}");
    }
    assert_eq!(fails(&["albedo", "-", "--cos", "1.5"], VELVET).0, 2);
    assert_eq!(fails(&["tree", "-", "--tier", "sloppy"], VELVET).0, 2);
    for output in ["picture.gif", "/no/such/folder/picture.png"] {
        let (status, message) = fails(&["render", "-", "-o", output], VELVET);
        assert_eq!(status, 2, "{message}");
        assert!(message.contains(output), "{message}");
    }
    let (status, message) = fails(&["render", "-", "-o", "x.png", "--env", "no.hdr"], VELVET);
    assert!(status == 2 && message.contains("no.hdr"), "{message}");
}

#[test]
fn large_and_deep_scripts_come_to_an_end() {
    let long_line = format!("Ci = {}diffuse(N);", "1.0 * ".repeat(170_000));
    let parentheses = format!("Ci = {}diffuse(N){};", "(".repeat(10_000), ")".repeat(10_000));
    let sum = format!("Ci = {};", vec!["1e-5 * diffuse(N)"; 100_000].join(" + "));
    let alternating = format!("Ci = diffuse(N);\n{}", "Ci = 0.5 * (Ci + diffuse(N));\n".repeat(20_000));
    let doubling = format!("closure color c = diffuse(N);\n{}Ci = c;", "c = c + c;\n".repeat(60));
    for (name, script, codes) in [
        ("a long line", long_line, [0, 1]),
        ("parentheses", parentheses, [1, 1]),
        ("a long sum", sum, [0, 0]),
        ("alternating", alternating, [0, 1]),
        ("doubling", doubling, [1, 1]),
    ] {
        for command in [&["tree", "-", "--json"][..], &["eval", "-", "--wo", "0,0,1", "--wi", "0,0,1"]] {
            let output = overcoat(command, &script);
            let status = output.status.code();
            let message: String = String::from_utf8_lossy(&output.stderr).chars().take(600).collect();
            assert!(status.is_some_and(|s| codes.contains(&s)), "{name} {command:?}: {status:?} {message}");
            assert!(output.stderr.len() < 4000, "{name}: a message of {} bytes", output.stderr.len());
        }
    }
}

#[test]
fn odd_parameters_give_sane_numbers() {
    for value in ["nan", "inf", "-inf", "-1", "0", "1e30"] {
        let script = format!(
            "surface s(float r = 0.3) {{ Ci = sheen(oren_nayar(N, r), normal(r, 0, r), color(r), r); }} // {value}"
        );
        let args = ["eval", "-", "--json", "--quiet", "--wo", "0.1,0,1", "--wi", "0,0.6,0.8", "--set"];
        let set = format!("r={value}");
        let result = json(&[&args[..], &[set.as_str()]].concat(), &script);
        for c in 0..3 {
            assert!(result["f_cos"][c].as_f64().is_some_and(|f| f.is_finite() && f >= 0.0), "{value}: {result}");
        }
    }
}

#[test]
fn render_makes_pictures_and_strips() {
    let (_folder, path) = temporary("velvet.png");
    let file = path.to_str().expect("a path");
    let velvet = example("velvet.osl");
    let render = |more: &[&str]| {
        let args = [&["render", &velvet, "-o", file, "--size", "24x20", "--spp", "4", "--json"], more].concat();
        let stats = json(&args, "");
        (stats, image::open(&path).expect("a picture").to_rgb8())
    };
    let (stats, picture) = render(&["--threads", "1"]);
    assert_eq!((picture.width(), picture.height()), (24, 20));
    assert_eq!((stats["invalid"].as_u64(), stats["samples"].as_u64()), (Some(0), Some(24 * 20 * 4)));
    assert!(stats["seconds"].as_f64().is_some_and(|s| s > 0.0));
    let (_, again) = render(&["--threads", "2"]);
    assert_eq!(picture, again, "the number of threads changes nothing");
    assert_ne!(picture, render(&["--seed", "5"]).1);
    assert_ne!(picture, render(&["--scene", "drape"]).1);
    let (_, strip) = render(&["--sweep", "roughness=0.15,0.5,1.0"]);
    assert!(strip.width() >= 3 * 24 && strip.height() >= 20);
    let other = example("felt.osl");
    assert!(render(&["--compare", &other]).1.width() >= 2 * 24);
    let (status, message) = fails(&["render", &velvet, "-o", file, "--sweep", "rough=1,2"], "");
    assert!(status == 2 && message.contains("roughness"), "{message}");
}

#[test]
fn a_furnace_cannot_see_a_white_wall() {
    let (_folder, path) = temporary("furnace.exr");
    let file = path.to_str().expect("a path");
    json(
        &["render", "-", "-o", file, "--scene", "furnace", "--size", "16", "--spp", "32", "--json"],
        "Ci = diffuse(N);",
    );
    let picture = image::open(&path).expect("a picture").to_rgb32f();
    assert!(picture.pixels().all(|p| p.0.iter().all(|x| (x - 1.0).abs() < 0.02)));
}

#[test]
fn a_watched_script_is_rendered_again() {
    let (folder, script) = temporary("watched.osl");
    let picture = folder.path().join("watched.png");
    std::fs::write(&script, "Ci = diffuse(N);").expect("written");
    let mut child = Command::new(env!("CARGO_BIN_EXE_overcoat"))
        .args(["render", script.to_str().expect("a path"), "-o", picture.to_str().expect("a path")])
        .args(["--watch", "--size", "16", "--spp", "1"])
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let wait_for_change = |old: Option<Vec<u8>>| {
        let start = Instant::now();
        loop {
            let now = std::fs::read(&picture).ok();
            if now.is_some() && now != old {
                return now;
            }
            assert!(start.elapsed() < Duration::from_secs(600), "no new picture");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    let first = wait_for_change(None);
    // A mistake in between is told, and ends nothing.
    std::fs::write(&script, "Ci = difuse(N);").expect("written");
    std::thread::sleep(Duration::from_millis(300));
    std::fs::write(&script, "Ci = color(0.1, 0.8, 0.1) * diffuse(N);").expect("written");
    wait_for_change(first);
    child.kill().expect("stopped");
    child.wait().expect("ended");
}

#[test]
fn every_example_is_a_documented_shader_that_keeps_energy() {
    let folder = format!("{}/examples", env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("examples").flatten() {
        let path = entry.path();
        if path.extension().is_none_or(|e| e != "osl") {
            continue;
        }
        count += 1;
        let file = path.to_str().expect("a path");
        let text = std::fs::read_to_string(&path).expect("a script");
        assert!(text.starts_with("//") && text.contains("[[ string label"), "{file}");
        for side in ["view", "light"] {
            let output = overcoat(&["albedo", file, "--json", "--side", side, "--cos", "0.95,0.5,0.1,-0.4"], "");
            assert!(output.status.success() && output.stderr.is_empty(), "{file}: {output:?}");
            let rows: Value = serde_json::from_slice(&output.stdout).expect("JSON");
            for row in rows["rows"].as_array().expect("rows") {
                let albedo = row["albedo"].as_array().expect("albedo");
                assert!(albedo.iter().all(|a| a.as_f64().is_some_and(|a| a <= 1.0001)), "{file} {side}: {row}");
            }
        }
    }
    assert!(count >= 8, "{count} examples");
}

#[test]
fn figures_come_with_numbers_and_an_index() {
    let (_folder, path) = temporary("figures");
    let folder = path.to_str().expect("a path");
    let args = ["reproduce", folder, "--json", "--quiet", "--spp", "1", "--size", "16", "--only"];
    for (name, file) in [
        ("sheen-2", "sheen-2-distribution.svg"),
        ("cylinder", "cylinder-refraction.csv"),
        ("softening", "sheen-4-softening.png"),
    ] {
        let done = json(&[&args[..], &[name]].concat(), "");
        assert!(done["figures"][0]["measured"].as_str().is_some_and(|m| !m.contains("NaN")), "{done}");
        assert!(path.join(file).exists(), "{file}");
        let index = std::fs::read_to_string(path.join("index.md")).expect("an index");
        assert!(index.contains(file) && index.contains("- The source: ") && index.contains("- Measured: "));
    }
    let (status, message) = fails(&[&args[..], &["no-such-figure"]].concat(), "");
    assert!(status == 2 && message.contains("sheen-2-distribution"), "{message}");
}
