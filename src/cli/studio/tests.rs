//! A render that panics, which no script should bring about: the studio outlives it.

use super::guard::{Folder, Guard};
use super::server;
use super::workshop::Workshop;
use crate::cli::Global;
use crate::engine::Engine;
use crate::lobes::host::{ClosureSpec, HostLobe};
use serde_json::json;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;

/// Panics wherever it is looked at.
struct Broken;

impl HostLobe for Broken {
    fn f(&self, _: &[f32], _: [f64; 3], _: [f64; 3]) -> [f64; 3] {
        panic!("a lobe that is broken on purpose")
    }
    fn albedo_bound(&self, _: &[f32], _: [f64; 3]) -> [f64; 3] {
        [1.0; 3]
    }
}

#[test]
fn a_panic_in_a_render_leaves_the_server_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let global = Global::quiet();
    let spec = ClosureSpec::new("broken").normal("N", "Shading normal.");
    let engine = Engine::new().register(spec, Broken).expect("registers");
    let opened = Folder::new(folder.path(), true).expect("a folder");
    let workshop = Arc::new(Workshop::new(opened, None, &global).with_engine(engine));
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let guard = Arc::new(Guard::new(port).expect("a token"));
    let address = guard.address();
    let token = address.split("token=").nth(1).expect("a token").to_owned();
    // The thread ends with the tests.
    std::thread::spawn(move || server::serve(&listener, &guard, &workshop));
    let post = |path: &str, text: &str| {
        let body = json!({ "text": text, "width": 32, "height": 32, "samples": 1 }).to_string();
        let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("connects");
        let head = format!("POST {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Overcoat-Token: {token}\r\n");
        let request = format!("{head}Content-Length: {}\r\n\r\n{body}", body.len());
        stream.write_all(request.as_bytes()).expect("sent");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        String::from_utf8_lossy(&answer).into_owned()
    };
    for _ in 0..3 {
        assert!(post("/api/render", "Ci = broken(N);").contains("this computation crashed"));
        assert!(post("/api/lobe", "Ci = broken(N);").starts_with("HTTP/1.1 500 "));
        assert!(post("/api/render", "Ci = diffuse(N);").contains("\"kind\":\"frame\""));
    }
}
