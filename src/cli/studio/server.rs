//! What is asked, and who answers.
//!
//! One thread per connection, up to a limit. A panic while answering ends that answer and nothing else.

use super::guard::Guard;
use super::http::{self, Head, Link, Refusal, Stream};
use super::material::Script;
use super::workshop::Workshop;
use super::{energy, picture, polar, watch, words};
use serde_json::{Value, json};
use std::net::TcpListener;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Connections at a time; more are told to come back.
const MAX_CONNECTIONS: usize = 128;
/// Scripts nest up to 256 deep, and their readers recurse.
const STACK: usize = 16 << 20;

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const JS: &str = "text/javascript; charset=utf-8";

/// The page: where each part is, its type and its text.
const PAGE: &[(&str, &str, &str)] = &[
    ("/", HTML, include_str!("web/index.html")),
    ("/studio.css", CSS, include_str!("web/studio.css")),
    ("/studio.js", JS, include_str!("web/studio.js")),
    ("/server.js", JS, include_str!("web/server.js")),
    ("/editor.js", JS, include_str!("web/editor.js")),
    ("/language.js", JS, include_str!("web/language.js")),
    ("/viewer.js", JS, include_str!("web/viewer.js")),
    ("/parameters.js", JS, include_str!("web/parameters.js")),
    ("/energy.js", JS, include_str!("web/energy.js")),
    ("/plots.js", JS, include_str!("web/plots.js")),
    ("/icon.svg", "image/svg+xml", include_str!("web/icon.svg")),
];

/// Answers until the process ends.
pub fn serve(listener: &TcpListener, guard: &Arc<Guard>, workshop: &Arc<Workshop>) {
    let active = Arc::new(AtomicUsize::new(0));
    for connection in listener.incoming() {
        let Ok(mut connection) = connection else { continue };
        if active.fetch_add(1, Ordering::Relaxed) >= MAX_CONNECTIONS {
            active.fetch_sub(1, Ordering::Relaxed);
            let _ = connection.set_nonblocking(true);
            let _ = http::refuse(&mut connection, &Refusal::new(503, "too many requests at a time"));
            continue;
        }
        let (guard, workshop, count) = (guard.clone(), workshop.clone(), active.clone());
        let work = move || {
            let _ = catch_unwind(AssertUnwindSafe(|| connected(&mut connection, &guard, &workshop)));
            count.fetch_sub(1, Ordering::Relaxed);
        };
        if std::thread::Builder::new().stack_size(STACK).spawn(work).is_err() {
            active.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// Reads one request and answers it.
pub fn connected(connection: &mut dyn Link, guard: &Guard, workshop: &Workshop) {
    let outcome = catch_unwind(AssertUnwindSafe(|| match asked(connection, guard) {
        Ok(question) => answer(connection, &question, workshop),
        Err(refusal) => drop(http::refuse(connection, &refusal)),
    }));
    // Whatever was sent before the panic, the client is told no more than that something is wrong.
    if outcome.is_err() {
        let _ = http::refuse(connection, &Refusal::new(500, "this request crashed; the studio goes on"));
    }
}

struct Question {
    head: Head,
    body: Value,
}

/// Reads a request and judges it; its body only if it may ask.
fn asked(connection: &mut dyn Link, guard: &Guard) -> Result<Question, Refusal> {
    let head = Head::read(connection)?;
    guard.check_origin(&head)?;
    if head.path.starts_with("/api/") {
        guard.check_token(&head)?;
    }
    let body = match head.method.as_str() {
        "GET" => Value::Null,
        "POST" => {
            let body = head.body(connection)?;
            serde_json::from_slice(&body).map_err(|e| Refusal::bad(format!("the body is not JSON: {e}")))?
        }
        _ => return Err(Refusal::new(405, "only GET and POST are understood")),
    };
    Ok(Question { head, body })
}

fn answer(connection: &mut dyn Link, question: &Question, workshop: &Workshop) {
    let Question { head, body } = question;
    let whole = |connection: &mut dyn Link, outcome: Result<Value, Refusal>| match outcome {
        Ok(value) => http::answer_json(connection, 200, &value),
        Err(refusal) => http::refuse(connection, &refusal),
    };
    // A client that has gone needs no answer.
    let _ = match (head.method.as_str(), head.path.as_str()) {
        ("GET", "/api/words") => whole(connection, Ok(words::words())),
        ("GET", "/api/files") => whole(connection, Ok(workshop.files())),
        ("GET", "/api/file") => whole(connection, workshop.open(&head.asked("path").unwrap_or_default())),
        ("GET", "/api/changes") => Stream::open(connection).map(|stream| watch::tell(workshop, stream)),
        ("POST", "/api/compile") => whole(connection, Script::read(body).map(|s| workshop.material(&s).told())),
        ("POST", "/api/save") => whole(connection, workshop.save(body)),
        ("POST", "/api/lobe") => whole(connection, polar::polar(workshop, body)),
        ("POST", "/api/cost") => whole(connection, energy::cost(workshop, body)),
        ("POST", "/api/render") => match picture::Wish::read(workshop, body) {
            Ok(wish) => Stream::open(connection).map(|stream| picture::show(workshop, &wish, stream)),
            Err(refusal) => http::refuse(connection, &refusal),
        },
        ("POST", "/api/energy") => match energy::Wish::read(workshop, body) {
            Ok(wish) => Stream::open(connection).map(|stream| energy::account(workshop, &wish, stream)),
            Err(refusal) => http::refuse(connection, &refusal),
        },
        (_, path) => match PAGE.iter().find(|p| p.0 == path) {
            Some((_, kind, text)) if head.method == "GET" => http::answer(connection, 200, kind, text.as_bytes()),
            Some(_) => http::refuse(connection, &Refusal::new(405, "the page is read with GET")),
            None => http::refuse(connection, &Refusal::new(404, format!("there is nothing at {path}"))),
        },
    };
}

/// Runs `work`, and sends what became of it where it panics.
pub fn guarded(stream: &mut Stream<'_>, work: impl FnOnce(&mut Stream<'_>)) {
    if catch_unwind(AssertUnwindSafe(|| work(stream))).is_err() {
        let message = "this computation crashed; the studio goes on. Please report the script";
        let _ = stream.send(&json!({ "kind": "failed", "message": message }), &[]);
    }
}
