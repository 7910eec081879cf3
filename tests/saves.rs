//! Killed while it saves, the program leaves the old file or the new one, never half of either.
#![cfg(feature = "studio")]

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

fn start(args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_overcoat"));
    command.args(args).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program starts")
}

/// What is in the folder but the files themselves: what a killed program had begun.
fn begun(folder: &Path) -> usize {
    let hidden = |e: &std::fs::DirEntry| e.file_name().to_string_lossy().starts_with(".overcoat-");
    std::fs::read_dir(folder).expect("a folder").flatten().filter(hidden).count()
}

/// Saves a text through the studio; whether it was told that it is saved.
fn save(port: u16, token: &str, text: &str) -> bool {
    let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { return false };
    let body = json!({ "path": "a.osl", "text": text, "replace": true }).to_string();
    let head = format!("POST /api/save HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Overcoat-Token: {token}\r\n");
    let _ = stream.write_all(format!("{head}Content-Length: {}\r\n\r\n{body}", body.len()).as_bytes());
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).is_ok() && answer.starts_with(b"HTTP/1.1 200")
}

#[test]
fn a_studio_killed_while_it_saves_leaves_a_whole_script() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.osl");
    let texts: Vec<String> =
        ["a", "b", "c"].iter().enumerate().map(|(k, c)| format!("// {}\n", c.repeat(400_000 + 90_000 * k))).collect();
    std::fs::write(&file, &texts[0]).expect("written");
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let saved = AtomicUsize::new(0);
    for _ in 0..24 {
        let mut studio = start(&["studio", "--no-open", "--json", "--quiet", folder.path().to_str().expect("a name")]);
        let mut lines = BufReader::new(studio.stdout.take().expect("stdout"));
        let mut told = String::new();
        while !told.ends_with("}\n") {
            assert!(lines.read_line(&mut told).expect("a line") > 0, "{told}");
        }
        let told: Value = serde_json::from_str(&told).expect("JSON");
        let address = told["address"].as_str().expect("an address");
        let (port, token) = address["http://127.0.0.1:".len()..].split_once("/?token=").expect("port and token");
        let port = port.parse().expect("a port");
        std::thread::scope(|scope| {
            for k in 0..2 {
                let (texts, saved) = (&texts, &saved);
                scope.spawn(move || {
                    for text in texts.iter().cycle().skip(k) {
                        if !save(port, token, text) {
                            break;
                        }
                        saved.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
            std::thread::sleep(Duration::from_micros(rng.random_range(3_000..90_000)));
            studio.kill().expect("killed");
        });
        studio.wait().expect("ended");
        let found = std::fs::read_to_string(&file).expect("still there");
        assert!(texts.contains(&found), "{} bytes: {:?} …", found.len(), found.get(..20));
    }
    println!("{} saves, {} cut short", saved.load(Ordering::Relaxed), begun(folder.path()));
    assert!(saved.load(Ordering::Relaxed) > 10);
}

#[test]
fn a_render_killed_leaves_the_old_picture_or_the_new() {
    let folder = tempfile::tempdir().expect("a folder");
    let (script, picture) = (folder.path().join("a.osl"), folder.path().join("a.exr"));
    std::fs::write(&script, "Ci = emission() + diffuse(N);").expect("written");
    let name = |path: &Path| path.to_str().expect("a name").to_owned();
    let (script, output) = (name(&script), name(&picture));
    let args = ["render", &script, "-o", &output, "--scene", "furnace", "--size", "640x640", "--spp", "1", "--quiet"];
    let before = Instant::now();
    assert!(start(&args).wait().expect("ended").success());
    let whole = before.elapsed();
    let new = std::fs::read(&picture).expect("written");
    assert!(new.len() > 1 << 20);
    let old = b"the picture that was there before".to_vec();
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    let (mut kept, mut replaced) = (0, 0);
    for round in 0..16 {
        std::fs::write(&picture, &old).expect("written");
        let mut program = start(&args);
        // The file is written toward the end; one of them is let go.
        let moment = if round == 0 { 20.0 } else { rng.random_range(0.3..1.15) };
        let deadline = Instant::now() + whole.mul_f32(moment);
        while Instant::now() < deadline && program.try_wait().expect("a program").is_none() {
            std::thread::sleep(Duration::from_micros(300));
        }
        let _ = program.kill();
        program.wait().expect("ended");
        let found = std::fs::read(&picture).expect("still there");
        assert!(found == old || found == new, "{} of {} bytes", found.len(), new.len());
        *(if found == old { &mut kept } else { &mut replaced }) += 1;
    }
    println!("kept {kept}, replaced {replaced}, {} cut short, {whole:?} each", begun(folder.path()));
    assert!(kept > 0 && replaced > 0);
}
