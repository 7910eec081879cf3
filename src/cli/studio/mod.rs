//! `overcoat studio`: a page in the browser to edit a material, see it, and see where its energy goes.
//!
//! The page (`web/`, embedded) holds all state and sends it whole with every question; the program answers from the
//! functions that the other commands call. What takes time is sent as a [`http::Stream`] and ends when the page asks
//! the same again: [`workshop::Workshop::begin`]. Layers: `http` (bytes), `guard` (who may ask, for which files),
//! `server` (what is asked), `workshop` (materials and stages that are kept), and one file per answer.

mod desk;
mod energy;
mod guard;
mod http;
mod hush;
mod material;
mod picture;
mod polar;
mod server;
mod told;
mod watch;
mod words;
mod workshop;

#[cfg(test)]
mod tests;

pub use desk::Desk;

use super::{Failure, Global, Outcome, output};
use crate::preview::Scene;
use clap::Args;
use guard::{Folder, Guard};
use serde_json::json;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use workshop::Workshop;

#[derive(Args, Debug)]
pub struct StudioArgs {
    /// A script, or a folder of scripts; the current folder if none is given.
    #[arg(default_value = ".", value_name = "FILE|DIR")]
    path: PathBuf,
    /// The port on the loopback; any free one if none is given.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Print the address and leave the browser alone.
    #[arg(long)]
    no_open: bool,
}

pub fn run(global: &Global, args: &StudioArgs) -> Outcome {
    if !global.set.is_empty() {
        return Err(Failure::usage("--set: the studio's page sets parameters, for each script its own"));
    }
    let unusable = |e: &dyn std::fmt::Display| Failure::usage(format!("cannot open `{}`: {e}", args.path.display()));
    let (folder, first) = if args.path.is_dir() {
        (Folder::new(&args.path, true), None)
    } else {
        // Also a script that is yet to be written.
        let parent = args.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        (Folder::new(parent, false), args.path.file_name().map(|n| n.to_string_lossy().into_owned()))
    };
    let folder = folder.map_err(|e| unusable(&e))?;
    if let Some(first) = &first {
        folder.script(first).map_err(|e| unusable(&e.reason))?;
    }
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, args.port))
        .map_err(|e| Failure::usage(format!("cannot listen on port {}: {e}", args.port)))?;
    let port = listener.local_addr().map_err(|e| Failure::usage(e.to_string()))?.port();
    let guard = Guard::new(port).map_err(Failure::Usage)?;
    let address = guard.address();
    if global.json {
        output::json(&json!({ "address": address, "folder": folder.root().display().to_string() }))?;
    } else {
        output::write(&format!("{address}\n"))?;
    }
    let workshop = Arc::new(Workshop::new(folder, first, global));
    let _watcher = watch::watch(&workshop).inspect_err(|e| {
        if !global.quiet {
            eprintln!("warning: edits made elsewhere will not be noticed: {e}");
        }
    });
    let early = workshop.clone();
    // The cloth takes a moment to fall; whoever asks for it later need not wait.
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(3));
        let _ = early.stage(Scene::Drape, "studio");
    });
    if !args.no_open && open::that_detached(&address).is_err() && !global.quiet {
        eprintln!("open this address in a browser");
    }
    server::serve(&listener, &Arc::new(guard), &workshop);
    Ok(())
}
