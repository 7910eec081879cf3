//! What is kept between questions: materials, stages, and what is under way.

use super::super::host::CliHost;
use super::super::{Global, TierArg};
use super::guard::Folder;
use super::http::Refusal;
use super::hush::Hush;
use super::material::{Compiled, Script};
use crate::engine::Engine;
use crate::globals::Globals;
use crate::ir::{Host, Lookup, Speech, Subject};
use crate::preview::{Environment, RenderSettings, Scene, Stage, lamp, output};
use crate::syntax::{Directories, Includes, Limits};
use clap::ValueEnum;
use serde_json::{Value, json};
use std::collections::{HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Materials that are kept ready.
const KEPT_MATERIALS: usize = 12;
/// Stages that are kept ready.
const KEPT_STAGES: usize = 8;
/// Questions under way that are told apart; far more than there are pages.
const MAX_SLOTS: usize = 4096;

/// Everything the answers share.
pub struct Workshop {
    pub folder: Folder,
    /// The script that the studio was opened with.
    first: Option<String>,
    includes: Vec<PathBuf>,
    quiet: bool,
    /// What the page begins with: tier and layering rule.
    begins: [String; 2],
    engine: Engine,
    /// Counts the changes made to files, so that nothing older is taken from what is kept.
    changes: AtomicU64,
    listeners: Mutex<Vec<Sender<Vec<String>>>>,
    kept: Mutex<VecDeque<(Key, Arc<Compiled>)>>,
    hosts: Mutex<HashMap<PathBuf, (u64, Arc<CliHost>)>>,
    stages: Mutex<VecDeque<(StageKey, Arc<Stage>)>>,
    slots: Mutex<HashMap<String, Arc<AtomicBool>>>,
    pub hush: Hush,
}

type Key = (u64, Script);
type StageKey = (u64, Scene, String);

/// A lock whose holder panicked guards plain collections, which are whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Workshop {
    pub fn new(folder: Folder, first: Option<String>, global: &Global) -> Workshop {
        fn word(value: impl ValueEnum) -> String {
            value.to_possible_value().map_or(String::new(), |v| v.get_name().to_owned())
        }
        let begins = [word(global.tier.unwrap_or(TierArg::Standard)), word(global.layering)];
        let engine = global.engine().limits(Limits { script_bytes: 1 << 20, ..Limits::default() });
        Workshop {
            folder,
            first,
            includes: global.include.clone(),
            quiet: global.quiet,
            begins,
            engine,
            changes: AtomicU64::new(0),
            listeners: Mutex::default(),
            kept: Mutex::default(),
            hosts: Mutex::default(),
            stages: Mutex::default(),
            slots: Mutex::default(),
            hush: Hush::default(),
        }
    }

    /// The same with an engine of one's choice.
    pub fn with_engine(self, engine: Engine) -> Workshop {
        Workshop { engine, ..self }
    }

    /// Begins what may take long; what was begun under the same name before is to stop. Set: stop.
    pub fn begin(&self, name: &str) -> Arc<AtomicBool> {
        let mut slots = lock(&self.slots);
        if slots.len() >= MAX_SLOTS {
            // Those that ended are known by nobody else.
            slots.retain(|_, stop| Arc::strong_count(stop) > 1);
        }
        let stop = Arc::new(AtomicBool::new(false));
        if let Some(before) = slots.insert(name.to_owned(), stop.clone()) {
            before.store(true, Ordering::Relaxed);
        }
        stop
    }

    /// The material a script leaves, or what is wrong with it; kept for the next question.
    pub fn material(&self, script: &Script) -> Arc<Compiled> {
        let key = (self.changes.load(Ordering::Relaxed), script.clone());
        {
            let mut kept = lock(&self.kept);
            if let Some(at) = kept.iter().position(|(k, _)| *k == key)
                && let Some(found) = kept.remove(at)
            {
                let material = found.1.clone();
                kept.push_front(found);
                return material;
            }
        }
        let _quiet = self.hush.ask();
        let made = Arc::new(Compiled::new(&self.engine_for(script), script));
        let mut kept = lock(&self.kept);
        kept.push_front((key, made.clone()));
        kept.truncate(KEPT_MATERIALS);
        made
    }

    fn engine_for(&self, script: &Script) -> Engine {
        let path = self.folder.root().join(&script.file);
        let now = self.changes.load(Ordering::Relaxed);
        let mut hosts = lock(&self.hosts);
        hosts.retain(|_, (made, _)| *made == now);
        let beside = path.parent().unwrap_or(self.folder.root()).to_owned();
        let host = hosts.entry(beside.clone()).or_insert_with(|| {
            let folders = [beside.clone(), self.folder.root().to_owned()].into_iter().chain(self.includes.clone());
            (now, Arc::new(CliHost::confined(folders.collect(), self.quiet)))
        });
        let includes = Below { root: self.folder.root().to_owned(), others: self.includes.clone() };
        let engine = self.engine.clone().host(Shared(host.1.clone())).includes(includes);
        engine.tier(script.tier).layering(script.layering)
    }

    /// A stage for a scene under a light, kept for the next question.
    pub fn stage(&self, scene: Scene, light: &str) -> Result<Arc<Stage>, Refusal> {
        let key = (self.changes.load(Ordering::Relaxed), scene, light.to_owned());
        let same = |k: &StageKey| (k.1, &k.2) == (key.1, &key.2) && (k.0 == key.0 || built_in(light));
        if let Some((_, stage)) = lock(&self.stages).iter().find(|(k, _)| same(k)) {
            return Ok(stage.clone());
        }
        let settings = RenderSettings { scene, ..RenderSettings::default() };
        let made = match (scene, light) {
            (Scene::Furnace, _) | (_, "studio") => Stage::new(&settings),
            (_, "lamp") => Stage::lit_by(lamp(glam::vec3(-0.62, 0.80, 0.55), 4.0), &settings),
            (_, "overcast") => Stage::lit_by(Environment::uniform(0.8), &settings),
            (_, file) => Stage::new(&RenderSettings { env: Some(self.picture(file)?), ..settings }),
        };
        let stage = Arc::new(made.map_err(|e| Refusal::bad(e.to_string()))?);
        let mut stages = lock(&self.stages);
        stages.push_front((key, stage.clone()));
        stages.truncate(KEPT_STAGES);
        Ok(stage)
    }

    fn picture(&self, name: &str) -> Result<PathBuf, Refusal> {
        match self.folder.resolve(name)? {
            path if LIGHTS.iter().any(|e| path.extension().is_some_and(|x| x.eq_ignore_ascii_case(e))) => Ok(path),
            _ => Err(Refusal::bad(format!("`{name}` is no environment: its name must end in .hdr or .exr"))),
        }
    }

    /// What there is to open, and which script to begin with.
    pub fn files(&self) -> Value {
        let scripts = self.folder.list(&["osl"]);
        let first = self.first.clone().or_else(|| scripts.first().cloned());
        let [tier, layering] = &self.begins;
        let name = self.folder.root().file_name().map(|n| n.to_string_lossy().into_owned());
        json!({ "folder": name, "scripts": scripts, "first": first, "lights": self.folder.list(&LIGHTS), "tier": tier, "layering": layering })
    }

    pub fn open(&self, name: &str) -> Result<Value, Refusal> {
        let text = self.folder.read(name)?;
        Ok(json!({ "path": name, "text": text, "stamp": stamp(&text) }))
    }

    /// Writes a script, unless it was changed since the page read it: then the page decides.
    pub fn save(&self, body: &Value) -> Result<Value, Refusal> {
        let (Some(name), Some(text)) = (body["path"].as_str(), body["text"].as_str()) else {
            return Err(Refusal::bad("`path` and `text` are needed"));
        };
        let path = self.folder.script(name)?;
        if let (Some(known), Ok(there)) = (body["stamp"].as_str(), self.folder.read(name))
            && stamp(&there) != known
        {
            return Err(Refusal::new(409, format!("`{name}` was changed elsewhere")));
        }
        if body["stamp"].is_null() && path.exists() && body["replace"] != true {
            return Err(Refusal::new(409, format!("`{name}` exists")));
        }
        output::replace(&path, text.as_bytes()).map_err(|e| Refusal::new(500, e.reason))?;
        Ok(json!({ "path": name, "stamp": stamp(text) }))
    }

    /// Files have changed: what is kept is old, and whoever listens is told.
    pub fn changed(&self, names: Vec<String>) {
        self.changes.fetch_add(1, Ordering::Relaxed);
        lock(&self.listeners).retain(|listener| listener.send(names.clone()).is_ok());
    }

    pub fn listen(&self, listener: Sender<Vec<String>>) {
        lock(&self.listeners).push(listener);
    }
}

/// Pictures that may light a scene.
const LIGHTS: [&str; 2] = ["hdr", "exr"];

fn built_in(light: &str) -> bool {
    ["studio", "lamp", "overcast"].contains(&light)
}

/// Tells one text from another.
fn stamp(text: &str) -> String {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    format!("{:016x}-{:x}", hasher.finish(), text.len())
}

/// Included files below the opened folder, or one given with `-I`.
struct Below {
    root: PathBuf,
    others: Vec<PathBuf>,
}

impl Includes for Below {
    fn load(&self, name: &str, from: &str) -> Option<(String, String)> {
        let real = |path: &Path| path.canonicalize().ok();
        // Names in messages are relative to the opened folder.
        let from = self.root.join(from);
        let beside = from.parent()?.to_owned();
        let path = [beside, self.root.clone()].into_iter().chain(self.others.clone()).map(|d| d.join(name));
        let allowed: Vec<PathBuf> = self.others.iter().chain([&self.root]).filter_map(|d| real(d)).collect();
        let found = path.filter_map(|p| real(&p)).find(|p| p.is_file() && allowed.iter().any(|d| p.starts_with(d)))?;
        let (_, text) = Directories(vec![found.parent()?.to_owned()]).load(found.file_name()?.to_str()?, "")?;
        let shown = found.strip_prefix(&self.root).unwrap_or(&found);
        Some((shown.display().to_string(), text))
    }
}

/// One host for many engines: textures are loaded once.
struct Shared(Arc<CliHost>);

impl Host for Shared {
    fn answers(&self, subject: Subject) -> bool {
        self.0.answers(subject)
    }
    fn texture(&self, lookup: &Lookup<'_>, globals: &Globals) -> Option<[f32; 4]> {
        self.0.texture(lookup, globals)
    }
    fn say(&self, speech: Speech, text: &str) {
        self.0.say(speech, text);
    }
}
