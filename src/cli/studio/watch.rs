//! Edits made elsewhere: from the file system to the page.

use super::http::Stream;
use super::workshop::Workshop;
use notify::{EventKind, RecursiveMode, Watcher};
use serde_json::json;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Editors write in several steps.
const SETTLED: Duration = Duration::from_millis(60);
/// How long a folder in which something changes all the time may keep the page waiting.
const LONGEST: Duration = Duration::from_millis(500);
/// How often a page that hears nothing is shown that the studio is there.
const HEARTBEAT: Duration = Duration::from_secs(5);

/// Tells the workshop of changed files, until what is returned goes.
pub fn watch(workshop: &Arc<Workshop>) -> notify::Result<impl Watcher + use<>> {
    let (tell, events) = channel();
    let mut watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
        if let Ok(event) = event
            && !matches!(event.kind, EventKind::Access(_))
        {
            // The receiver is gone only when the program ends.
            let _ = tell.send(event.paths);
        }
    })?;
    let folder = &workshop.folder;
    let mode = if folder.is_deep() { RecursiveMode::Recursive } else { RecursiveMode::NonRecursive };
    watcher.watch(folder.root(), mode)?;
    let workshop = workshop.clone();
    std::thread::spawn(move || {
        while let Ok(first) = events.recv() {
            let (mut paths, start) = (first, Instant::now());
            while let Ok(more) = events.recv_timeout(SETTLED) {
                paths.extend(more);
                if start.elapsed() > LONGEST {
                    break;
                }
            }
            let root = workshop.folder.root();
            let name = |p: &std::path::PathBuf| p.strip_prefix(root).ok()?.to_str().map(str::to_owned);
            // Temporary files of this program and others.
            let names: BTreeSet<String> = paths
                .iter()
                .filter_map(name)
                .filter(|n| !n.rsplit('/').next().unwrap_or("").starts_with('.'))
                .collect();
            if !names.is_empty() {
                workshop.changed(names.into_iter().collect());
            }
        }
    });
    Ok(watcher)
}

/// Sends the names of changed files, until the page goes.
pub fn tell(workshop: &Workshop, mut stream: Stream<'_>) {
    let (listener, changes) = channel();
    workshop.listen(listener);
    let mut alive = stream.send(&json!({ "kind": "watching" }), &[]).is_ok();
    while alive {
        let message = match changes.recv_timeout(HEARTBEAT) {
            Ok(names) => json!({ "kind": "changed", "names": names }),
            Err(RecvTimeoutError::Timeout) => json!({ "kind": "alive" }),
            Err(RecvTimeoutError::Disconnected) => return,
        };
        alive = stream.send(&message, &[]).is_ok();
    }
}
