//! `overcoat plot` and `overcoat gallery`: what they draw is what was measured, and what they write can be shown.
#![cfg(feature = "cli")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn overcoat(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_overcoat")).args(args).output().expect("the program starts")
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).expect("written")
}

/// The corners of the first curve of a chart.
fn curve(svg: &str) -> Vec<(f64, f64)> {
    let points = svg.split("<polyline").map(|p| p.split("points=\"").nth(1).and_then(|p| p.split('"').next()));
    let longest = points.flatten().max_by_key(|p| p.len()).expect("a curve");
    let pair = |p: &str| p.split_once(',').map(|(x, y)| (x.parse().expect("x"), y.parse().expect("y")));
    longest.split_whitespace().filter_map(pair).collect()
}

#[test]
fn plots_show_what_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let (script, out) = (folder.path().join("a.osl"), folder.path().join("a.svg"));
    let (script_name, out_name) = (script.display().to_string(), out.display().to_string());
    std::fs::write(&script, "Ci = 0.5 * diffuse(N);").expect("written");
    let plot = |show: &str| {
        let output = overcoat(&["plot", &script_name, "-o", &out_name, "--show", show, "--theta", "40"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        text(&out)
    };
    // A Lambert lobe in the plane of incidence is a circle through the origin.
    let circle = curve(&plot("polar"));
    let (low, high) = circle.iter().fold((f64::MAX, f64::MIN), |(lo, hi), p| (lo.min(p.1), hi.max(p.1)));
    let (left, right) = circle.iter().fold((f64::MAX, f64::MIN), |(lo, hi), p| (lo.min(p.0), hi.max(p.0)));
    assert!(circle.len() > 60 && ((right - left) / (high - low) - 1.0).abs() < 0.1, "{left} {right} {low} {high}");
    // Its albedo is the same from all angles above.
    let flat = curve(&plot("albedo"));
    let first = flat[0].1;
    assert!(flat.iter().all(|p| (p.1 - first).abs() <= 2.0), "{flat:?}");
    let sheet = plot("polar,albedo,furnace,sampling");
    assert_eq!(sheet.matches("<svg ").count(), 5);
    assert!(
        ["white furnace", "where the energy goes", "noise", "plane of incidence"].iter().all(|t| sheet.contains(t))
    );
    assert_eq!(sheet.matches("</svg>").count(), 5);
    for (args, status) in [
        (vec!["plot", &script_name, "-o", "a.png"], 2),
        (vec!["plot", &script_name, "-o", &out_name, "--theta", "NaN"], 2),
        (vec!["plot", "nothing.osl", "-o", &out_name], 2),
    ] {
        assert_eq!(overcoat(&args).status.code(), Some(status), "{args:?}");
    }
}

#[test]
fn a_gallery_has_every_script_on_every_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("deeper")).expect("a folder");
    std::fs::write(folder.path().join("a.osl"), "// <Grey> & plain,\n// in two lines\nCi = 0.5 * diffuse(N);")
        .expect("written");
    std::fs::write(folder.path().join("deeper/b.osl"), "Ci = diffuse(N) + diffuse(N);").expect("written");
    let (from, to) = (folder.path().display().to_string(), folder.path().join("out"));
    let output = overcoat(&[
        "gallery",
        &from,
        "-o",
        &to.display().to_string(),
        "--size",
        "16",
        "--spp",
        "1",
        "--scenes",
        "sphere,ball",
        "--json",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let verdicts: Vec<&Value> =
        told["materials"].as_array().expect("materials").iter().map(|m| &m["verdict"]).collect();
    assert_eq!(verdicts, ["conserves", "gains"]);
    for name in ["a-sphere.png", "a-ball.png", "deeper-b-sphere.png", "deeper-b-ball.png"] {
        assert_eq!(image::open(to.join(name)).expect(name).width(), 16);
        assert!(text(&to.join("index.html")).contains(name));
    }
    let page = text(&to.join("index.html"));
    assert!(page.contains("&lt;Grey&gt; &amp; plain, in two lines") && !page.contains("http"));
    let empty = tempfile::tempdir().expect("a folder");
    assert_eq!(overcoat(&["gallery", &empty.path().display().to_string()]).status.code(), Some(2));
}
