//! The commands that measure: audit, furnace, reciprocity, and where the light goes.
#![cfg(feature = "cli")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn overcoat(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_overcoat"));
    command.current_dir(folder).args(args).output().expect("the program starts")
}

fn status(output: &Output) -> i32 {
    output.status.code().expect("an exit status")
}

fn document(output: &Output) -> Value {
    let stderr = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {stderr}"))
}

fn script(folder: &Path, name: &str, text: &str) -> String {
    std::fs::write(folder.join(name), text).expect("written");
    name.to_owned()
}

#[test]
fn audits_in_shards_add_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let audit = |more: &[&str]| overcoat(here, &[&["audit", "--tier", "fast", "--trees", "60"], more].concat());
    let whole = audit(&["--seed", "4", "--json", "--threads", "1"]);
    assert_eq!(status(&whole), 0, "{}", String::from_utf8_lossy(&whole.stderr));
    assert!(whole.stderr.is_empty(), "a progress bar away from a terminal");
    let whole = document(&whole);
    assert_eq!((whole["measured"].as_u64(), whole["violations"].as_u64()), (Some(60), Some(0)));
    for part in ["1/2", "2/2"] {
        let output = audit(&["--seed", "4", "--shard", part, "-o", &format!("{}.json", &part[..1])]);
        assert_eq!(status(&output), 0);
        assert!(String::from_utf8_lossy(&output.stdout).contains("gain"));
    }
    let merge = |files: &[&str]| overcoat(here, &[&["audit", "--json", "--merge"], files].concat());
    let mut merged = document(&merge(&["2.json", "1.json"]));
    merged["seconds"] = whole["seconds"].clone();
    merged["shards"] = whole["shards"].clone();
    merged["of"] = whole["of"].clone();
    assert_eq!(merged, whole);

    let refused = |files: &[&str], why: &str| {
        let output = merge(files);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(status(&output) == 2 && message.contains(why), "{files:?}: {message}");
    };
    refused(&["1.json"], "shard 2 of 2 is missing");
    refused(&["1.json", "2.json", "1.json"], "shard 1 is there already");
    refused(&["1.json", "none.json"], "cannot read");
    let other = std::fs::read_to_string(here.join("2.json")).expect("read").replace("\"seed\": 4", "\"seed\": 5");
    script(here, "other.json", &other);
    refused(&["1.json", "other.json"], "not parts of the same campaign");
    refused(&[&script(here, "text.json", "{}"), "1.json"], "no result of `overcoat audit`");
    for wrong in ["0/2", "3/2", "2", "a/b"] {
        assert_eq!(status(&audit(&["--shard", wrong])), 2, "{wrong}");
    }

    // What is found is measured again by the command that comes with it.
    let worst = &whole["worst"][0];
    let file = format!("tree-{}.osl", worst["tree"]);
    script(here, &file, worst["script"].as_str().expect("a script"));
    let command = worst["command"].as_str().expect("a command").strip_prefix("overcoat ").expect("of ours");
    let again = document(&overcoat(here, &[command.split(' ').collect(), vec!["--json"]].concat()));
    for c in 0..3 {
        let (a, b) = (&worst["albedo"][c], &again["rows"][0]["albedo"][c]);
        assert!((a.as_f64().expect("a number") - b.as_f64().expect("a number")).abs() < 1e-4, "{worst} {again}");
    }
}

#[test]
fn a_furnace_tells_what_gains_and_where() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let layered = script(here, "layered.osl", "Ci = sheen(0.8*diffuse(N) + 0.2*translucent(N), N, 1, 0.4);");
    let added = script(here, "added.osl", "Ci = color(1, 0.5, 0.5)*diffuse(N) + sheen(N, 0.4);");
    let furnace = |file: &str, more: &[&str]| overcoat(here, &[&["furnace", file, "--azimuths", "2"], more].concat());
    let fine = furnace(&layered, &["--json"]);
    assert_eq!(status(&fine), 0);
    let fine = document(&fine);
    assert_eq!((fine["gains"].as_bool(), fine["rows"].as_array().map(Vec::len)), (Some(false), Some(44)));
    // Seen from below: what is translucent, and all of it.
    let below = fine["rows"].as_array().expect("rows").iter().find(|r| r["cos"] == -1.0).expect("below");
    assert!(below["albedo"][0].as_f64().is_some_and(|e| e > 0.1 && e < 0.2), "{below}");
    let gains = furnace(&added, &["--json"]);
    assert_eq!(status(&gains), 3);
    assert!(String::from_utf8_lossy(&gains.stderr).contains("gains energy"));
    let gains = document(&gains);
    assert_eq!(gains["gains"], true);
    assert!(gains["worst"]["albedo"][0].as_f64().is_some_and(|e| e > 1.3), "{}", gains["worst"]);
    let text = furnace(&added, &["--cos", "0.5,0.1"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("\ngains: at most 1."));
    // `view` promises nothing toward the light.
    let view = furnace(&layered, &["--layering", "view", "--cos", "0.7,0.05"]);
    assert_eq!(status(&view), 0, "{}", String::from_utf8_lossy(&view.stderr));
    assert_eq!(status(&furnace(&layered, &["--cos", "2"])), 2);
    assert_eq!(status(&furnace(&layered, &["--azimuths", "0"])), 2);
}

#[test]
fn reciprocity_is_measured_and_claimed() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let measure = |text: &str, more: &[&str]| {
        let file = script(here, "r.osl", text);
        overcoat(here, &[&["reciprocity", &file, "--pairs", "2000", "--json"], more].concat())
    };
    let raw = "Ci = sheen(0.5*diffuse(N), N, 1, 0.4, \"softening\", 0);";
    let output = measure(raw, &["--chi2"]);
    assert_eq!(status(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let found = document(&output);
    assert_eq!(found["claims_reciprocity"], true);
    assert!(found["error"].as_f64().is_some_and(|e| e < 1e-4), "{found}");
    let tests = found["chi2"].as_array().expect("tests");
    assert!(tests.len() == 4 && tests.iter().all(|t| t["passes"] == true), "{tests:?}");
    for (text, more, reason) in [
        ("Ci = sheen(0.5*diffuse(N), N, 1, 0.4);", &[][..], "sheen_bsdf is not reciprocal"),
        (raw, &["--layering", "view"][..], "the layering rule"),
        ("Ci = max(dot(N, -I), 0) * diffuse(N);", &[][..], "the script reads I"),
    ] {
        let output = measure(text, more);
        let found = document(&output);
        assert_eq!((status(&output), &found["claims_reciprocity"]), (0, &Value::from(false)), "{text}");
        assert!(found["error"].as_f64().is_some_and(|e| e > 0.05), "{text}: {found}");
        assert!(found["reasons"][0].as_str().is_some_and(|r| r.contains(reason)), "{found}");
        assert_eq!(measure(text, more).stdout, output.stdout, "same seed, same pairs");
    }
}

#[test]
fn explained_light_adds_up_to_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "Ci = color(0.8, 0.4, 0.1)*diffuse(N) + 0.1*transparent();
        Ci = sheen(Ci, N, color(1, 0.5, 0.2), 0.6);
        Ci = sheen(Ci, N, 0.5, 0.2);";
    let file = script(folder.path(), "e.osl", text);
    let mut lost = Vec::new();
    for (tier, rule) in [("standard", "min"), ("reference", "min"), ("standard", "balanced"), ("reference", "balanced")]
    {
        let args =
            ["albedo", &file, "--explain", "--json", "--tier", tier, "--layering", rule, "--cos", "0.9,0.2,-0.3"];
        let mut of_layers = 0.0;
        for row in document(&overcoat(folder.path(), &args))["rows"].as_array().expect("rows") {
            let parts = &row["explain"];
            let number = |v: &Value, c: usize| v[c].as_f64().expect("a number");
            for c in 0..3 {
                let list = |key: &str| parts[key].as_array().cloned().unwrap_or_default();
                let scattered: f64 = list("lobes").iter().map(|l| number(&l["scattered"], c)).sum();
                let layers = list("layers");
                assert_eq!(layers.len(), 2);
                let withheld: f64 = layers.iter().map(|l| number(&l["tint"], c) + number(&l["lost"], c)).sum();
                of_layers += layers.iter().map(|l| number(&l["lost"], c)).sum::<f64>();
                let absorbed = number(&parts["absorbed_by_weights"], c) + number(&parts["absorbed_by_lobes"], c);
                assert!((scattered + withheld + absorbed - 1.0).abs() < 2e-4, "{row}");
                assert!((1.0 - scattered - number(&parts["not_scattered"], c)).abs() < 2e-4, "{row}");
            }
        }
        lost.push(of_layers);
    }
    // Solved scales pass more than `min`, in the layers' part of the account too; softened tops lose from one side.
    assert!(lost[2] < lost[0] && lost[3] < lost[1], "{lost:?}");
}

#[test]
fn extremes_are_counted_and_located() {
    let folder = tempfile::tempdir().expect("a folder");
    let measure = |more: &[&str]| overcoat(folder.path(), &[&["extremes", "--cases", "100"], more].concat());
    let output = measure(&["--lobe", "oren_nayar", "--json", "--seed", "3"]);
    assert_eq!(status(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let found = document(&output);
    let rows = found["rows"].as_array().expect("rows");
    // Alone, and in two stacks under three rules, in three tiers.
    assert_eq!((rows.len(), &found["faults"], &found["seed"]), (21, &Value::from(0), &Value::from(3)));
    for row in rows {
        assert!(row["lobe"] == "oren_nayar" && row["pairs"] == 128 && row["compared"].as_u64() <= Some(128), "{row}");
        let (error, beyond) = (row["error"].as_f64().expect("a number"), row["beyond_rounding"].as_f64());
        assert!(beyond.is_some_and(|b| b <= error), "{row}");
        assert!(row["error_at"]["params"]["sigma"].is_array() || error == 0.0, "{row}");
    }
    assert_eq!(measure(&["--lobe", "oren_nayar", "--json", "--seed", "3"]).stdout, output.stdout);
    let text = measure(&["--lobe", "diffuse"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("below sheen"));
    let typo = measure(&["--lobe", "difuse"]);
    assert_eq!(status(&typo), 2);
    assert!(String::from_utf8_lossy(&typo.stderr).contains("did you mean `diffuse`?"));
}

#[test]
fn a_tradeoff_has_a_front() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let points = |subject: &Value| subject["points"].as_array().expect("points").clone();
    let output = overcoat(here, &["tradeoff", "--lobe", "diffuse", "--json"]);
    assert_eq!(status(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let lobe = document(&output)["subjects"][0].clone();
    // A lobe without tables has one size of them, and no layer that a rule could scale.
    assert_eq!((lobe["name"].as_str(), points(&lobe).len()), (Some("diffuse"), 3));
    assert!(points(&lobe).iter().all(|p| p["layering"] == "-" && p["max_error"].as_f64() < Some(1e-6)), "{lobe}");

    let file = script(here, "layered.osl", "Ci = sheen(diffuse(N), N, 1, 0.4);");
    let output = overcoat(here, &["tradeoff", &file, "--json", "--svg", "t.svg"]);
    assert_eq!(status(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
    let found = document(&output);
    let all = points(&found["subjects"][0]);
    // Three rules; two tiers with three sizes of tables, and the reference.
    assert_eq!((all.len(), found["subjects"].as_array().map(Vec::len)), (21, Some(1)));
    for p in &all {
        let number = |v: &Value| v.as_f64().expect("a number");
        let reference = p["tier"] == "reference";
        assert_eq!((number(&p["max_error"]) == 0.0, p["ns"]["eval_batch"].is_null()), (reference, reference), "{p}");
        // What the tiers promise; tables of half the size do not.
        let promised = match (p["tier"].as_str(), p["tables"].as_str()) {
            (_, Some("half")) => 2e-2,
            (Some("fast"), _) => 1e-2,
            _ => 1e-3,
        };
        assert!(number(&p["rms_error"]) <= number(&p["max_error"]) && number(&p["max_error"]) < promised, "{p}");
        let lost = p["energy_lost"].as_array().expect("a list").clone();
        let most = if p["layering"] == "min" { 0.5 } else { 0.05 };
        assert!(lost.len() == 3 && lost.iter().all(|l| (-1e-3..most).contains(&number(l))), "{p}");
        assert!(["eval", "sample", "setup"].iter().all(|k| number(&p["ns"][*k]) > 0.0), "{p}");
        assert!(number(&p["bytes"]["bsdf"]) > 0.0 && number(&p["bytes"]["tables"]) > 0.0, "{p}");
        // Nothing is closer than the reference, so it is never beaten.
        assert!(!reference || p["front"] == true, "{p}");
    }
    let bytes = |tables: &str| {
        let of = |p: &&Value| p["tier"] == "standard" && p["layering"] == "min" && p["tables"] == tables;
        all.iter().find(of).and_then(|p| p["bytes"]["tables"].as_u64()).expect("a row")
    };
    assert!(bytes("half") < bytes("normal") && bytes("normal") < bytes("double"));
    let svg = std::fs::read_to_string(here.join("t.svg")).expect("a picture");
    assert!(svg.starts_with("<svg") && svg.matches("<circle").count() >= 21);
    assert_eq!(status(&overcoat(here, &["tradeoff", &file, "--lobe", "diffuse"])), 2);
    assert_eq!(status(&overcoat(here, &["tradeoff", &script(here, "bad.osl", "Ci = difuse(N);")])), 1);
}
