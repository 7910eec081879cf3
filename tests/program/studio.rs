//! The studio as a program: who it answers, which files it touches, and what it sends. Its page is driven by
//! `tests/studio_e2e`.
#![cfg(feature = "studio")]

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const VELVET: &str = "surface velvet(color base = color(0.5, 0.1, 0.1) [[ string label = \"Base\", float min = 0, float max = 1 ]], \
    float r = 0.3 [[ float min = 0.07, float max = 1 ]]) { Ci = sheen(base * diffuse(N), N, 1, r); }";

/// A studio on a folder of its own, which ends with it.
struct Studio {
    program: Child,
    port: u16,
    token: String,
    folder: tempfile::TempDir,
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Status, head and body of an answer.
struct Answer {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }

    /// The messages of a stream, with their bytes.
    fn messages(&self) -> Vec<(Value, Vec<u8>)> {
        let (mut rest, mut found) = (self.body.as_slice(), Vec::new());
        while !rest.is_empty() {
            let length = |at: usize| u32::from_le_bytes(rest[at..at + 4].try_into().expect("four")) as usize;
            let (head, bytes) = (length(0), length(4));
            let message = serde_json::from_slice(&rest[8..8 + head]).expect("JSON");
            found.push((message, rest[8 + head..8 + head + bytes].to_vec()));
            rest = &rest[8 + head + bytes..];
        }
        found
    }
}

impl Studio {
    fn open() -> Studio {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("scripts")).expect("a folder");
        std::fs::write(folder.path().join("scripts/velvet.osl"), VELVET).expect("written");
        std::fs::write(folder.path().join("secret.osl"), "// outside").expect("written");
        let mut program = Command::new(env!("CARGO_BIN_EXE_overcoat"))
            .args(["studio", "--no-open", "--json"])
            .arg(folder.path().join("scripts"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut lines = BufReader::new(program.stdout.take().expect("stdout"));
        let mut text = String::new();
        while !text.ends_with("}\n") {
            assert!(lines.read_line(&mut text).expect("a line") > 0, "{text}");
        }
        let told: Value = serde_json::from_str(&text).expect("JSON");
        let address = told["address"].as_str().expect("an address");
        let (port, token) =
            address.strip_prefix("http://127.0.0.1:").and_then(|a| a.split_once("/?token=")).expect("port and token");
        Studio { program, port: port.parse().expect("a port"), token: token.to_owned(), folder }
    }

    fn file(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join("scripts").join(name)
    }

    /// Sends bytes as they are and reads until the connection ends.
    fn raw(&self, request: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("connects");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("set");
        // A server that refuses early may close while we write.
        let _ = stream.write_all(request);
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("an answer");
        let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").expect("a head");
        let head = String::from_utf8(bytes[..end].to_vec()).expect("text");
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status");
        Answer { status, head, body: bytes[end + 4..].to_vec() }
    }

    fn send(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> Answer {
        let host = format!("127.0.0.1:{}", self.port);
        let host = if headers.iter().any(|h| h.0 == "Host") { String::new() } else { format!("Host: {host}\r\n") };
        let more: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        let request = format!("{method} {path} HTTP/1.1\r\n{host}{more}Content-Length: {}\r\n\r\n{body}", body.len());
        self.raw(request.as_bytes())
    }

    fn get(&self, path: &str) -> Answer {
        self.send("GET", path, &[("X-Overcoat-Token", &self.token)], "")
    }

    fn post(&self, path: &str, body: &Value) -> Answer {
        self.send("POST", path, &[("X-Overcoat-Token", &self.token)], &body.to_string())
    }

    fn render(&self, text: &str) -> Vec<(Value, Vec<u8>)> {
        let body = json!({ "text": text, "width": 64, "height": 48, "samples": 2, "slot": text });
        let answer = self.post("/api/render", &body);
        assert_eq!(answer.status, 200, "{}", answer.head);
        answer.messages()
    }
}

#[test]
fn only_the_page_that_was_opened_is_answered() {
    let studio = Studio::open();
    let own = format!("http://127.0.0.1:{}", studio.port);
    let token = ("X-Overcoat-Token", studio.token.as_str());
    let ask = |headers: &[(&str, &str)]| studio.send("GET", "/api/files", headers, "").status;
    assert_eq!(ask(&[token]), 200);
    assert_eq!(ask(&[token, ("Origin", &own)]), 200);
    assert_eq!(ask(&[token, ("Origin", "http://evil.example")]), 403);
    assert_eq!(ask(&[token, ("Origin", "null")]), 403);
    assert_eq!(ask(&[token, ("Origin", &own), ("Origin", "http://evil.example")]), 403);
    assert_eq!(ask(&[token, ("Host", "evil.example")]), 403);
    assert_eq!(ask(&[token, ("Host", &format!("evil.example:{}", studio.port))]), 403);
    assert_eq!(ask(&[token, ("Host", "127.0.0.1:1")]), 403);
    assert_eq!(ask(&[token, ("Host", &format!("localhost:{}", studio.port))]), 200);
    assert_eq!(ask(&[token, ("Sec-Fetch-Site", "cross-site")]), 403);
    assert_eq!(ask(&[]), 403);
    assert_eq!(ask(&[("X-Overcoat-Token", "")]), 403);
    assert_eq!(ask(&[("X-Overcoat-Token", &studio.token[1..])]), 403);
    assert_eq!(ask(&[("X-Overcoat-Token", &studio.token.replace(|c: char| c.is_ascii_digit(), "x"))]), 403);
    for (method, path) in
        [("POST", "/api/render"), ("POST", "/api/save"), ("GET", "/api/file?path=velvet.osl"), ("GET", "/api/changes")]
    {
        assert_eq!(studio.send(method, path, &[], "{}").status, 403, "{path}");
    }
    let begins = studio.get("/api/files").json();
    assert_eq!((&begins["tier"], &begins["layering"]), (&json!("standard"), &json!("min")));
    // The loopback alone: another address of this machine is not listened on.
    assert!(TcpStream::connect_timeout(&([127, 0, 0, 2], studio.port).into(), Duration::from_millis(300)).is_err());
    let page = studio.send("GET", "/", &[], "");
    assert!(page.status == 200 && !String::from_utf8_lossy(&page.body).contains(&studio.token));
    assert!(page.head.contains("Content-Security-Policy: default-src 'none'") && page.head.contains("nosniff"));
    for part in ["/studio.css", "/studio.js", "/editor.js", "/server.js", "/viewer.js"] {
        assert!(studio.send("GET", part, &[], "").body.len() > 1000, "{part}");
    }
    // Nothing is loaded from elsewhere.
    let text = String::from_utf8(page.body).expect("text");
    assert!(!text.contains("http:") && !text.contains("https:"));
}

#[test]
fn nothing_outside_the_folder_is_read_or_written() {
    let studio = Studio::open();
    let outside = studio.folder.path().join("secret.osl");
    let link = |from: &Path, to: &str| std::os::unix::fs::symlink(from, studio.file(to)).expect("linked");
    link(&outside, "link.osl");
    link(studio.folder.path(), "up");
    link(&studio.folder.path().join("nowhere.osl"), "dangling.osl");
    let encoded = outside.display().to_string().replace('/', "%2F");
    let names = [
        "..%2Fsecret.osl",
        "../secret.osl",
        "up/secret.osl",
        "link.osl",
        "dangling.osl",
        &encoded,
        "./../secret.osl",
        "scripts/../../secret.osl",
        "..\\secret.osl",
        "",
        ".",
        "velvet.osl%00.osl",
        "C:secret.osl",
    ];
    for name in names {
        let read = studio.get(&format!("/api/file?path={name}"));
        assert!(matches!(read.status, 403 | 404), "{name}: {}", read.head);
        let path = name.replace("%2F", "/").replace("%00", "\0");
        let saved = studio.post("/api/save", &json!({ "path": path, "text": "gone", "replace": true }));
        assert!(matches!(saved.status, 403 | 404), "{name}: {}", saved.head);
    }
    assert_eq!(std::fs::read_to_string(&outside).expect("there"), "// outside");
    assert!(!studio.folder.path().join("nowhere.osl").exists());
    for name in ["a.sh", ".bashrc", "a.osl/b"] {
        let saved = studio.post("/api/save", &json!({ "path": name, "text": "x" }));
        assert!(matches!(saved.status, 403 | 404), "{name}");
    }
    // Nor by a script: neither as an included file nor as a picture.
    std::fs::write(studio.folder.path().join("secret.h"), "#define SECRET 1\n").expect("written");
    let found = studio.render("#include \"../secret.h\"\nCi = SECRET * diffuse(N);");
    assert_eq!(found[0].0["ok"], false);
    std::fs::write(studio.file("near.h"), "#define NEAR 0.5\n").expect("written");
    let found = studio.render("#include \"near.h\"\nCi = NEAR * diffuse(N);");
    assert_eq!(found[0].0["ok"], true, "{}", found[0].0);
    let picture = image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 255]));
    picture.save(studio.folder.path().join("secret.png")).expect("written");
    picture.save(studio.file("near.png")).expect("written");
    let brightest = |name: &str| {
        let found =
            studio.render(&format!("Ci = (color)texture(\"{name}\", u, v, \"missingcolor\", color(0)) * emission();"));
        let (_, bytes) = found.last().expect("a frame");
        bytes.chunks(4).map(|p| i32::from(p[0]) - i32::from(p[1])).max().expect("pixels")
    };
    assert!(brightest("near.png") > 100);
    assert!(brightest("../secret.png") < 40);
    assert!(brightest(&studio.folder.path().join("secret.png").display().to_string()) < 40);
    let light = studio.post("/api/render", &json!({ "text": "Ci = diffuse(N);", "light": "../sky.hdr" }));
    assert_eq!(light.status, 403);
}

#[test]
fn a_save_is_whole_or_not_at_all() {
    let studio = Studio::open();
    let opened = studio.get("/api/file?path=velvet.osl").json();
    assert_eq!(opened["text"], VELVET);
    let save = |text: &str, stamp: &Value| {
        studio.post("/api/save", &json!({ "path": "velvet.osl", "text": text, "stamp": stamp }))
    };
    let saved = save("Ci = diffuse(N);", &opened["stamp"]);
    assert_eq!(saved.status, 200);
    assert_eq!(std::fs::read_to_string(studio.file("velvet.osl")).expect("there"), "Ci = diffuse(N);");
    // Changed elsewhere since.
    std::fs::write(studio.file("velvet.osl"), "Ci = 0;").expect("written");
    assert_eq!(save("mine", &saved.json()["stamp"]).status, 409);
    assert_eq!(save("mine", &Value::Null).status, 409);
    assert_eq!(std::fs::read_to_string(studio.file("velvet.osl")).expect("there"), "Ci = 0;");
    // A folder that cannot be written leaves the old file, and no other.
    std::fs::create_dir(studio.file("fixed")).expect("a folder");
    std::fs::write(studio.file("fixed/a.osl"), "old").expect("written");
    let mut permissions = std::fs::metadata(studio.file("fixed")).expect("there").permissions();
    std::os::unix::fs::PermissionsExt::set_mode(&mut permissions, 0o555);
    std::fs::set_permissions(studio.file("fixed"), permissions.clone()).expect("set");
    let failed = studio.post("/api/save", &json!({ "path": "fixed/a.osl", "text": "new", "replace": true }));
    let root = std::fs::write(studio.file("fixed/probe"), "").is_ok();
    assert!(root || failed.status == 500, "{}", failed.head);
    let there = std::fs::read_to_string(studio.file("fixed/a.osl")).expect("there");
    assert_eq!(there, if root { "new" } else { "old" });
    std::os::unix::fs::PermissionsExt::set_mode(&mut permissions, 0o755);
    std::fs::set_permissions(studio.file("fixed"), permissions).expect("set");
    let left = std::fs::read_dir(studio.file("")).expect("listed").flatten();
    assert!(left.into_iter().all(|e| !e.file_name().to_string_lossy().contains("tmp")));
}

#[test]
fn what_is_too_large_or_no_request_is_refused() {
    let studio = Studio::open();
    let token = studio.token.clone();
    let head = format!("POST /api/render HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nX-Overcoat-Token: {token}\r\n", studio.port);
    let send = |more: &str, body: &[u8]| studio.raw(&[format!("{head}{more}\r\n").as_bytes(), body].concat()).status;
    assert_eq!(send("Content-Length: 1048577\r\n", &vec![b'a'; 1 << 20]), 413);
    assert_eq!(send("Content-Length: 18446744073709551615\r\n", b""), 413);
    assert_eq!(send("Content-Length: -1\r\n", b""), 400);
    assert_eq!(send("Content-Length: 2\r\nContent-Length: 3\r\n", b"{}"), 400);
    assert_eq!(send("Transfer-Encoding: chunked\r\n", b"2\r\n{}\r\n0\r\n\r\n"), 411);
    assert_eq!(send("Content-Length: 5\r\n", b"{\"a\":"), 400);
    assert_eq!(send(&format!("X-Long: {}\r\n", "a".repeat(40_000)), b""), 431);
    assert_eq!(studio.raw(b"nonsense\r\n\r\n").status, 400);
    assert_eq!(studio.send("DELETE", "/api/file?path=velvet.osl", &[("X-Overcoat-Token", &token)], "").status, 405);
    assert_eq!(studio.get("/api/nothing").status, 404);
    for body in [json!({}), json!({ "text": 3 }), json!({ "text": "", "tier": "best" }), json!([1])] {
        assert_eq!(studio.post("/api/render", &body).status, 400, "{body}");
    }
    // Numbers without sense are brought to what makes sense.
    let odd =
        json!({ "text": "Ci = diffuse(N);", "width": 1e30, "height": -5, "samples": 1, "turn": 1e300, "distance": -1 });
    let frames = studio.post("/api/render", &odd).messages();
    assert_eq!(frames.last().map(|f| (f.0["width"].clone(), f.0["height"].clone())), Some((json!(2048), json!(8))));
    // Budgets of scripts hold here as everywhere.
    let endless = studio.render("int i = 0; while (1) i += 1; Ci = diffuse(N);");
    assert_eq!(endless[0].0["ok"], false, "{}", endless[0].0);
    assert_eq!(studio.get("/api/files").status, 200);
}

#[test]
fn a_picture_refines_and_tells_of_the_script() {
    let studio = Studio::open();
    let body = json!({
        "file": "velvet.osl", "text": VELVET, "set": { "r": 0.5, "base": [0.1, 0.2, 0.9], "gone": 1, "N": 2 },
        "width": 240, "height": 200, "samples": 5, "slot": "a",
    });
    let messages = studio.post("/api/render", &body).messages();
    let compiled = &messages[0].0;
    assert_eq!((&compiled["kind"], &compiled["ok"]), (&json!("compiled"), &json!(true)));
    assert_eq!(compiled["refused"], json!(["gone", "N"]));
    assert_eq!(compiled["parameters"][0]["label"], "Base");
    assert_eq!((&compiled["parameters"][1]["kind"], &compiled["parameters"][1]["max"]), (&json!("float"), &json!(1.0)));
    let frames: Vec<_> = messages[1..].iter().collect();
    let small = &frames[0];
    assert!(small.0["width"].as_u64().is_some_and(|w| w < 200));
    let samples: Vec<u64> = frames[1..].iter().filter_map(|f| f.0["samples"].as_u64()).collect();
    assert!(samples.windows(2).all(|w| w[0] < w[1]) && samples.last() == Some(&5), "{samples:?}");
    for (head, bytes) in &frames {
        assert_eq!(bytes.len() as u64, 4 * head["width"].as_u64().expect("w") * head["height"].as_u64().expect("h"));
    }
    // The middle of the ball is blue, as it was set.
    let (_, bytes) = frames.last().expect("frames");
    let middle = &bytes[4 * (100 * 240 + 120)..][..4];
    assert!(middle[2] > middle[0] + 30, "{middle:?}");
    let alone = studio.post("/api/compile", &body).json();
    assert_eq!(
        (&alone["ok"], &alone["shader"], &alone["parameters"]),
        (&json!(true), &json!("velvet"), &compiled["parameters"])
    );
    let wrong = studio.render("Ci = difuse(N);\n");
    assert_eq!((wrong.len(), &wrong[0].0["ok"]), (1, &json!(false)));
    let message = &wrong[0].0["diagnostics"][0];
    assert_eq!((&message["start"], &message["end"], &message["line"]), (&json!(5), &json!(11), &json!(1)));
}

#[test]
fn the_energy_is_that_of_the_other_commands() {
    let studio = Studio::open();
    let account = |text: &str| {
        let messages = studio.post("/api/energy", &json!({ "text": text, "theta": 60, "slot": text })).messages();
        let kind = |kind: &str| messages.iter().find(|m| m.0["kind"] == kind).map(|m| m.0.clone()).expect("told");
        (kind("verdict"), kind("energy"), kind("albedo"))
    };
    let (verdict, energy, albedo) = account("Ci = diffuse(N) + diffuse(N);");
    assert_eq!(verdict["verdict"], "gains");
    assert!(verdict["witness"]["albedo"][0].as_f64().is_some_and(|a| (a - 2.0).abs() < 1e-3));
    assert_eq!(verdict["diagnostics"][0]["code"], "E0701");
    assert!((energy["albedo"][0].as_f64().expect("albedo") - 2.0).abs() < 1e-3);
    let curve = albedo["view"].as_array().expect("rows");
    assert!(curve.len() > 10 && curve.iter().all(|r| (r[1][0].as_f64().expect("a") - 2.0).abs() < 2e-3), "{curve:?}");
    let (verdict, energy, albedo) = account("Ci = sheen(color(0.5, 0.5, 0.5) * diffuse(N), N, 1, 0.3);");
    assert_eq!(verdict["verdict"], "conserves");
    assert!(albedo["light"].as_array().expect("rows").iter().all(|r| r[1][0].as_f64().expect("a") < 1.001));
    // All light is accounted for.
    let explained = &energy["explained"];
    let number = |v: &Value| v[0].as_f64().expect("a number");
    let all = |list: &Value, keys: &[&str]| -> f64 {
        list.as_array().expect("a list").iter().map(|e| keys.iter().map(|k| number(&e[*k])).sum::<f64>()).sum()
    };
    let sum = all(&explained["lobes"], &["scattered"])
        + all(&explained["layers"], &["lost", "tint"])
        + number(&explained["absorbed_by_weights"])
        + number(&explained["absorbed_by_lobes"]);
    assert!((sum - 1.0).abs() < 5e-3, "{sum}: {explained}");
    let lobe = studio.post("/api/lobe", &json!({ "text": VELVET, "at": [0.5, 0.5], "width": 64, "height": 64 })).json();
    assert!(lobe["pointed"] == true && lobe["total"].as_array().is_some_and(|p| p.len() > 100));
    assert!(lobe["theta"].as_f64().is_some_and(|t| t < 45.0), "{}", lobe["theta"]);
    let beside = studio.post("/api/lobe", &json!({ "text": VELVET, "at": [0.01, 0.01], "theta": 30 })).json();
    assert!(beside["pointed"] == false && beside["theta"].as_f64().is_some_and(|t| (t - 30.0).abs() < 0.1));
    let cost = studio.post("/api/cost", &json!({ "text": VELVET })).json();
    assert!(cost["ns"]["eval"].as_f64().is_some_and(|ns| ns > 0.0) && cost["unspecialised"]["ns"]["eval"].is_number());
}

#[test]
fn changes_made_elsewhere_are_told() {
    let studio = Studio::open();
    let mut stream = TcpStream::connect(("127.0.0.1", studio.port)).expect("connects");
    let head = format!(
        "GET /api/changes HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nX-Overcoat-Token: {}\r\n\r\n",
        studio.port, studio.token
    );
    stream.write_all(head.as_bytes()).expect("sent");
    stream.set_read_timeout(Some(Duration::from_secs(20))).expect("set");
    let (mut seen, mut chunk) = (String::new(), [0; 4096]);
    let mut until = |wanted: &str| {
        let start = Instant::now();
        while !seen.contains(wanted) {
            assert!(start.elapsed() < Duration::from_secs(20), "{seen}");
            let count = stream.read(&mut chunk).expect("bytes");
            seen += &String::from_utf8_lossy(&chunk[..count]);
        }
    };
    until("watching");
    std::fs::write(studio.file("velvet.osl"), "Ci = diffuse(N);").expect("written");
    until("velvet.osl");
}

#[test]
fn fifty_clients_are_served_at_a_time() {
    let studio = Studio::open();
    std::thread::scope(|scope| {
        let clients: Vec<_> = (0..50)
            .map(|k| {
                let studio = &studio;
                scope.spawn(move || {
                    let text = format!("Ci = {} * diffuse(N);", f64::from(k) / 50.0);
                    let frames = studio.render(&text);
                    assert_eq!(frames.last().map(|f| f.0["samples"].clone()), Some(json!(2)));
                    studio.get("/api/files").status
                })
            })
            .collect();
        for client in clients {
            assert_eq!(client.join().expect("served"), 200);
        }
    });
}

#[test]
fn a_newer_picture_stops_the_older() {
    let studio = Studio::open();
    let body = |samples: u32| json!({ "text": VELVET, "width": 600, "height": 600, "samples": samples, "slot": "one" });
    std::thread::scope(|scope| {
        let long = scope.spawn(|| studio.post("/api/render", &body(4096)).messages());
        std::thread::sleep(Duration::from_millis(600));
        let short = studio.post("/api/render", &body(1)).messages();
        assert_eq!(short.last().map(|f| f.0["samples"].clone()), Some(json!(1)));
        let long = long.join().expect("ends");
        assert!(long.last().is_some_and(|f| f.0["samples"] != 4096));
    });
}

/// Most memory the program ever held, in bytes, where the system tells.
fn peak(studio: &Studio) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", studio.program.id())).unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or("0 kB");
    line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number") << 10
}

/// What client `k` asks, and that the answers are its own.
fn asks_thrice(studio: &Studio, k: usize) {
    let gray = (k + 1) as f64 / 64.0;
    let body = json!({
        "text": format!("surface s{k}(float g = {gray}) {{ Ci = g * diffuse(N); }}"),
        "width": 24, "height": 16, "samples": 1, "slot": format!("client {k}"),
    });
    let compiled = studio.post("/api/compile", &body).json();
    assert_eq!((&compiled["shader"], &compiled["ok"]), (&json!(format!("s{k}")), &json!(true)), "{compiled}");
    assert!((compiled["parameters"][0]["default"].as_f64().expect("a number") - gray).abs() < 1e-6, "{compiled}");
    let lobe = studio.post("/api/lobe", &body).json();
    assert_eq!(lobe["shader"], format!("s{k}"));
    assert!((lobe["albedo"][1].as_f64().expect("a number") - gray).abs() < 1e-4, "{lobe}");
    let messages = studio.post("/api/render", &body).messages();
    let (last, pixels) = messages.last().expect("a message");
    assert_eq!((&last["kind"], &last["samples"]), (&json!("frame"), &json!(1)), "{last}");
    assert_eq!(pixels.len(), 4 * 24 * 16);
}

#[test]
fn fifty_clients_at_once_and_a_million_lines_are_answered() {
    let studio = Studio::open();
    let begin = std::sync::Barrier::new(50);
    std::thread::scope(|scope| {
        for k in 0..50 {
            let (studio, begin) = (&studio, &begin);
            scope.spawn(move || {
                begin.wait();
                asks_thrice(studio, k);
            });
        }
    });
    let crowded = peak(&studio);
    // A million lines are longer than a request may be, and refused in so many words.
    let million = "Ci = Ci + diffuse(N);\n".repeat(1_000_000);
    for path in ["/api/compile", "/api/render", "/api/save"] {
        let refused = studio.post(path, &json!({ "path": "long.osl", "text": million }));
        let reason = refused.json();
        assert_eq!((refused.status, &reason["error"]), (413, &json!("a request may have 1048576 bytes")));
    }
    std::fs::write(studio.file("million.osl"), &million).expect("written");
    assert_eq!(studio.get("/api/file?path=million.osl").status, 413);
    let included = studio.post("/api/compile", &json!({ "text": "#include \"million.osl\"\nCi = diffuse(N);" })).json();
    let told = &included["diagnostics"][0];
    let message = told["message"].as_str().expect("a message");
    assert_eq!((&included["ok"], &told["file"]), (&json!(false), &json!("million.osl")), "{included}");
    assert_eq!(message, format!("the script has {} bytes; the limit is 1048576", million.len()));
    // As long as a request may be: answered, whatever the answer, and soon.
    let start = Instant::now();
    let lines = |line: &str| line.repeat(1_000_000 / (line.len() + 1));
    let blank = studio.post("/api/compile", &json!({ "text": format!("{}Ci = diffuse(N);", "\n".repeat(500_000)) }));
    assert_eq!(blank.json()["ok"], true);
    let long = studio.post("/api/compile", &json!({ "text": lines("Ci = Ci + diffuse(N);\n") })).json();
    assert!(long["ok"] == true || !long["diagnostics"][0]["message"].as_str().expect("a message").is_empty(), "{long}");
    let took = start.elapsed();
    assert!(took < Duration::from_secs(30), "{took:?}");
    let grown = peak(&studio);
    println!("{} MiB for fifty clients, {} MiB for long scripts, which took {took:?}", crowded >> 20, grown >> 20);
    assert!(grown < 1 << 30, "{} MiB", grown >> 20);
    asks_thrice(&studio, 7);
}
