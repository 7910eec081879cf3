//! The studio without a socket: bytes of a request in, bytes of its answer out. For tests that ask it anything.

use super::guard::{Folder, Guard};
use super::http::Link;
use super::server;
use super::workshop::Workshop;
use crate::cli::{Global, LayeringArg, TintArg};
use crate::engine::{Engine, Tier};
use crate::syntax::Limits;
use std::io::{self, Cursor, Read, Write};
use std::path::Path;

/// Where this studio would listen.
const PORT: u16 = 1234;
/// How many times a client reads before it hangs up: streams may be endless.
const READS: usize = 12;

impl Global {
    /// No options, and nothing on the terminal.
    pub(super) fn quiet() -> Global {
        Global {
            set: vec![],
            tier: None,
            layering: LayeringArg::Min,
            tint_rule: TintArg::Largest,
            include: vec![],
            json: false,
            quiet: true,
        }
    }
}

/// A studio on a folder, with budgets so small that every answer comes soon.
#[doc(hidden)]
pub struct Desk {
    guard: Guard,
    workshop: Workshop,
    token: String,
}

impl Desk {
    /// Opens a folder; tells why it cannot.
    pub fn open(folder: &Path) -> Result<Desk, String> {
        let global = Global::quiet();
        let opened = Folder::new(folder, true).map_err(|e| e.to_string())?;
        let limits = Limits {
            expanded_bytes: 1 << 16,
            calls: 1 << 8,
            expressions: 1 << 12,
            iterations: 1 << 8,
            ..Limits::default()
        };
        let engine = Engine::new().tier(Tier::Fast).limits(limits);
        let guard = Guard::new(PORT)?;
        let token = guard.address().rsplit('=').next().unwrap_or_default().to_owned();
        Ok(Desk { guard, workshop: Workshop::new(opened, None, &global).with_engine(engine), token })
    }

    /// What the page would send: with the headers that are asked for, and the length of its body.
    pub fn request(&self, method: &str, path: &str, body: &[u8]) -> Vec<u8> {
        let Desk { token, .. } = self;
        let head = format!("{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{PORT}\r\nX-Overcoat-Token: {token}\r\n");
        let length = format!("Content-Length: {}\r\n\r\n", body.len());
        [head.as_bytes(), length.as_bytes(), body].concat()
    }

    /// The answer to a request.
    pub fn ask(&self, request: &[u8]) -> Vec<u8> {
        let mut link = Memory { request: Cursor::new(request), answer: Vec::new(), writes: 0 };
        server::connected(&mut link, &self.guard, &self.workshop);
        link.answer
    }
}

struct Memory<'r> {
    request: Cursor<&'r [u8]>,
    answer: Vec<u8>,
    writes: usize,
}

impl Read for Memory<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        self.request.read(out)
    }
}

impl Write for Memory<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writes += 1;
        if self.writes > READS {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        self.answer.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Link for Memory<'_> {}
