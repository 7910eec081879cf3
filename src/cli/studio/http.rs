//! As much of HTTP/1.1 as one page needs, read with limits: a head of 16 KiB, a body of 1 MiB, ten seconds for each.
//!
//! In: a [`Link`], which is a connection or bytes in memory. Out: a [`Head`] that can be judged before the body is read,
//! then the body; back go a whole answer or a [`Stream`] of messages that ends with the connection. One request per
//! connection: on the loopback a connection costs less than keeping count of one.

use serde_json::{Value, json};
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// The longest request line with its headers, in bytes.
const MAX_HEAD: usize = 16 << 10;
/// The longest body, in bytes.
pub const MAX_BODY: usize = 1 << 20;
/// How long a client may take to send either.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long it may take to read what it asked for.
const WRITE_PATIENCE: Duration = Duration::from_secs(30);

/// Where a request comes from and its answer goes. What is not a connection waits for nobody.
pub trait Link: Read + Write {
    /// How long the next read may wait.
    fn wait_to_read(&mut self, _: Duration) -> io::Result<()> {
        Ok(())
    }

    /// How long writes may wait; what is written goes at once.
    fn wait_to_write(&mut self, _: Duration) -> io::Result<()> {
        Ok(())
    }

    /// Nothing more is written.
    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Link for TcpStream {
    fn wait_to_read(&mut self, patience: Duration) -> io::Result<()> {
        self.set_read_timeout(Some(patience))
    }

    fn wait_to_write(&mut self, patience: Duration) -> io::Result<()> {
        self.set_nodelay(true)?;
        self.set_write_timeout(Some(patience))
    }

    fn end(&mut self) -> io::Result<()> {
        self.shutdown(Shutdown::Write)
    }
}

/// Why a request is not answered: a status and a sentence.
#[derive(Debug)]
pub struct Refusal {
    pub status: u16,
    pub reason: String,
}

impl Refusal {
    pub fn new(status: u16, reason: impl Into<String>) -> Refusal {
        Refusal { status, reason: reason.into() }
    }

    pub fn bad(reason: impl Into<String>) -> Refusal {
        Refusal::new(400, reason)
    }
}

/// What comes before the body.
pub struct Head {
    pub method: String,
    pub path: String,
    pub query: String,
    headers: Vec<(String, String)>,
    /// What was read beyond the head.
    rest: Vec<u8>,
}

impl Head {
    /// Reads up to the empty line.
    pub fn read(stream: &mut dyn Link) -> Result<Head, Refusal> {
        let start = Instant::now();
        let mut bytes = Vec::new();
        let mut chunk = [0; 4096];
        loop {
            if let Some(head) = Head::parse(&bytes)? {
                return Ok(head);
            }
            if bytes.len() > MAX_HEAD {
                return Err(Refusal::new(431, "the request's headers are too long"));
            }
            match receive(stream, &mut chunk, start)? {
                0 => return Err(Refusal::bad("the request ended early")),
                count => bytes.extend(&chunk[..count]),
            }
        }
    }

    fn parse(bytes: &[u8]) -> Result<Option<Head>, Refusal> {
        let mut headers = [httparse::EMPTY_HEADER; 64];
        let mut request = httparse::Request::new(&mut headers);
        let length = match request.parse(bytes) {
            Ok(httparse::Status::Complete(length)) => length,
            Ok(httparse::Status::Partial) => return Ok(None),
            Err(e) => return Err(Refusal::bad(format!("not a request: {e}"))),
        };
        let target = request.path.unwrap_or("/");
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
        Ok(Some(Head {
            method: request.method.unwrap_or("").to_owned(),
            path: path.to_owned(),
            query: query.to_owned(),
            headers: request.headers.iter().map(|h| (h.name.to_ascii_lowercase(), text(h.value))).collect(),
            rest: bytes[length..].to_vec(),
        }))
    }

    /// The header called `name`, in lower case. Twice the same header is none: which of them counts is what attacks
    /// play with.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(n, _)| n == name);
        found.next().filter(|_| found.next().is_none()).map(|(_, value)| value.as_str())
    }

    pub fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|(n, _)| n == name)
    }

    /// The value of `name` in the query, decoded.
    pub fn asked(&self, name: &str) -> Option<String> {
        let pair = self.query.split('&').find_map(|pair| pair.split_once('=').filter(|(n, _)| *n == name))?;
        decoded(pair.1)
    }

    /// Reads the body, if it is not too long.
    pub fn body(&self, stream: &mut dyn Link) -> Result<Vec<u8>, Refusal> {
        if self.has("transfer-encoding") {
            return Err(Refusal::new(411, "the request must say how long its body is"));
        }
        let length = match self.header("content-length") {
            Some(text) => text.parse::<u64>().map_err(|_| Refusal::bad("the length of the body is not a number"))?,
            None if self.has("content-length") => return Err(Refusal::bad("two lengths of the body")),
            None => 0,
        };
        if length > MAX_BODY as u64 {
            return Err(Refusal::new(413, format!("a request may have {MAX_BODY} bytes")));
        }
        let (start, length) = (Instant::now(), length as usize);
        let mut body = self.rest.clone();
        let mut chunk = [0; 16 << 10];
        while body.len() < length {
            match receive(stream, &mut chunk, start)? {
                0 => return Err(Refusal::bad("the request ended early")),
                count => body.extend(&chunk[..count]),
            }
        }
        body.truncate(length);
        Ok(body)
    }
}

fn receive(stream: &mut dyn Link, chunk: &mut [u8], start: Instant) -> Result<usize, Refusal> {
    let slow = || Refusal::new(408, "the request took too long");
    let left = PATIENCE.checked_sub(start.elapsed()).filter(|left| !left.is_zero()).ok_or_else(slow)?;
    stream.wait_to_read(left).map_err(|e| Refusal::bad(e.to_string()))?;
    stream.read(chunk).map_err(|_| slow())
}

/// `%2F` and its kin as characters.
fn decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?];
                u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
            }
            b'+' => b' ',
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

/// Said with every answer: nothing is kept, nothing is guessed, nothing from elsewhere is loaded or may frame the page.
const POLICY: &str = "Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
    Referrer-Policy: no-referrer\r\nCross-Origin-Opener-Policy: same-origin\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\nX-Frame-Options: DENY\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n";

/// Sends a whole answer.
pub fn answer(stream: &mut dyn Link, status: u16, kind: &str, body: &[u8]) -> io::Result<()> {
    stream.wait_to_write(WRITE_PATIENCE)?;
    let head = format!(
        "HTTP/1.1 {status} {}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n{POLICY}\r\n",
        phrase(status),
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    finish(stream)
}

/// Sends a JSON document.
pub fn answer_json(stream: &mut dyn Link, status: u16, value: &Value) -> io::Result<()> {
    answer(stream, status, "application/json", value.to_string().as_bytes())
}

/// Sends why there is no answer.
pub fn refuse(stream: &mut dyn Link, refusal: &Refusal) -> io::Result<()> {
    answer_json(stream, refusal.status, &json!({ "error": refusal.reason }))
}

/// Closes a connection whose client may still be sending: closing at once would make its system throw the answer away.
fn finish(stream: &mut dyn Link) -> io::Result<()> {
    stream.end()?;
    stream.wait_to_read(Duration::from_millis(200))?;
    let (start, mut chunk) = (Instant::now(), [0; 16 << 10]);
    while start.elapsed() < Duration::from_secs(2) && matches!(stream.read(&mut chunk), Ok(1..)) {}
    Ok(())
}

fn phrase(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        409 => "Conflict",
        411 => "Length Required",
        413 => "Content Too Large",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}

/// Messages, each sent as soon as it is there: the lengths of a JSON document and of the bytes that go with it, both as
/// four bytes, least first; then the two.
pub struct Stream<'l> {
    out: &'l mut dyn Link,
}

impl<'l> Stream<'l> {
    pub fn open(out: &'l mut dyn Link) -> io::Result<Stream<'l>> {
        out.wait_to_write(WRITE_PATIENCE)?;
        let head = format!("HTTP/1.1 200 OK\r\nContent-Type: application/octet-stream\r\n{POLICY}\r\n");
        out.write_all(head.as_bytes())?;
        Ok(Stream { out })
    }

    pub fn send(&mut self, head: &Value, bytes: &[u8]) -> io::Result<()> {
        let head = head.to_string();
        let mut message = Vec::with_capacity(8 + head.len() + bytes.len());
        message.extend((head.len() as u32).to_le_bytes());
        message.extend((bytes.len() as u32).to_le_bytes());
        message.extend(head.as_bytes());
        message.extend(bytes);
        self.out.write_all(&message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn queries_are_decoded() {
        let head = Head::parse(b"GET /a?path=b%2Fc%20d&e=%zz HTTP/1.1\r\nHost: x\r\n\r\nrest").expect("parses");
        let head = head.expect("whole");
        assert_eq!((head.path.as_str(), head.rest.as_slice()), ("/a", &b"rest"[..]));
        assert_eq!(head.asked("path").as_deref(), Some("b/c d"));
        assert_eq!((head.asked("e"), head.asked("f")), (None, None));
    }

    #[test]
    fn a_header_given_twice_is_none() {
        let head = Head::parse(b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n").expect("parses").expect("whole");
        assert!(head.header("host").is_none() && head.has("host"));
    }
}
