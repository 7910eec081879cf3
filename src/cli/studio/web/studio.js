// The page: documents, and who is asked what when something changes.

import { json, Latest, stream } from "./server.js";
import { Language } from "./language.js";
import { describe, Editor } from "./editor.js";
import { Viewer } from "./viewer.js";
import { Parameters } from "./parameters.js";
import * as plots from "./plots.js";
import * as energy from "./energy.js";

const $ = (id) => document.getElementById(id);
const START = `surface untitled(
    color base = color(0.55, 0.02, 0.04) [[ float min = 0, float max = 1 ]],
    float roughness = 0.3 [[ float min = 0.07, float max = 1 ]])
{
    Ci = base * diffuse(N);
    Ci = sheen(Ci, N, color(1), roughness);
}
`;

const choices = { scene: "sphere", light: "studio", exposure: 0, tier: "standard", layering: "min", tierB: "standard", layeringB: "balanced" };
const documents = [];
let current = null;
let held = null;
let pointed = null;
let editor, viewer, parameters;
let compiled = { ok: true, diagnostics: [] };
let report = null;
let curves = null;

/** The script, as it last compiled, with what it is set to; for B what was held, if anything was. */
function script(slot = "a") {
  const own = { file: current.path ?? "untitled.osl", text: current.good ?? current.text, set: current.values };
  if (slot === "a") return { ...own, tier: choices.tier, layering: choices.layering };
  return { ...(held ?? own), tier: choices.tierB, layering: choices.layeringB };
}

const scenery = () => ({ scene: choices.scene, light: choices.light, exposure: choices.exposure });

function say(text) {
  $("notice").hidden = !text;
  $("notice").textContent = text ?? "";
}

// Asking, some time after the last change.

function later(milliseconds, work) {
  let timer;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(work, milliseconds);
  };
}

const accounts = new Latest("/api/energy", (message) => {
  if (message.kind === "verdict") {
    report = message;
    energy.verdict($("verdict"), report);
    messages();
  } else if (message.kind === "energy") {
    energy.shares($("shares"), message);
    $("energy-at").textContent = message.pointed ? `at the pin, ${message.theta.toFixed(0)}°` : "";
  } else if (message.kind === "albedo") {
    curves = message;
    plots.albedo($("albedo"), curves);
  } else if (message.kind === "failed") say(message.message);
}, (error) => say(error.message));

const account = (all) => accounts.ask({ ...script(), ...where(), all, slot: viewer.client });
const accountSoon = later(150, () => account(true));
const shareSoon = later(30, () => account(false));
const measureSoon = later(400, () => measure());

/** What is looked at: the pin, else the angle of the slider. */
const where = () => ({ ...scenery(), ...viewer.scenery(), at: viewer.at, theta: $("theta").valueAsNumber });

let lobe = null;
async function polar() {
  lobe?.abort();
  lobe = new AbortController();
  try {
    const at = pointed ?? viewer.at;
    const data = await json("/api/lobe", { ...script(), ...where(), at }, lobe.signal);
    if (!data) return;
    plots.polar($("polar"), data, energy.colour);
    $("place").textContent = `${data.pointed ? "" : "default point, "}${data.theta.toFixed(0)}°${data.backfacing ? ", back" : ""}`;
  } catch (error) {
    if (error.name !== "AbortError") say(error.message);
  }
}
let polarTimer = 0;
function polarSoon() {
  polarTimer ||= setTimeout(() => {
    polarTimer = 0;
    polar();
  }, 40);
}

async function measure() {
  try {
    energy.cost($("cost"), await json("/api/cost", script()));
  } catch (error) {
    say(error.message);
  }
}

let owing = false;
/** What the script is set to, or how it is shown, has changed: first its picture, then what is measured. */
function changed() {
  if (current.good === undefined) return;
  owing = true;
  viewer.render();
}

function settle() {
  if (!owing) return;
  owing = false;
  accountSoon();
  polarSoon();
}

let compiling = false;
let again = false;
/** The text has changed: the picture goes on as it is until the text compiles. */
async function compile() {
  again = compiling;
  if (compiling) return;
  compiling = true;
  const [d, text] = [current, current.text];
  try {
    const message = await json("/api/compile", { ...script(), text });
    if (d === current) onCompiled(message, text);
  } catch (error) {
    say(error.message);
  }
  compiling = false;
  if (again) compile();
}

// What comes back.

function onCompiled(message, text) {
  compiled = message;
  if (message.ok) {
    for (const name of message.refused) delete current.values[name];
    current.good = text;
    changed();
    say(null);
    parameters.declare(message.parameters, current.values);
    editor.parameters = message.parameters;
  } else {
    report = null;
    accounts.stop();
    energy.verdict($("verdict"), { verdict: "error" });
    if (current.good === undefined) {
      // Nothing of another document stays behind.
      viewer.clear();
      parameters.declare([], current.values);
      energy.shares($("shares"), null);
      curves = null;
      plots.albedo($("albedo"), null);
      plots.polar($("polar"), null, energy.colour);
      $("cost").replaceChildren();
    }
  }
  $("stale").hidden = message.ok || current.good === undefined;
  messages();
}

function onFramed(message, slot) {
  if (slot === "a") settle();
  if (slot === "a" && message.samples === message.of) measureSoon();
}

function messages() {
  const marks = compiled.diagnostics.map((d) => ({ ...d }));
  for (const d of (compiled.ok && report?.diagnostics) || []) {
    if (marks.some((m) => m.code === d.code && m.start === d.start)) continue;
    marks.push({ ...d, severity: d.code === "E0701" ? "gain" : d.severity });
    for (const label of d.labels) marks.push({ ...label, severity: "part", message: label.text, here: d.here, minor: true });
  }
  editor.mark(marks);
  const listed = marks.filter((m) => !m.minor);
  $("problem-count").textContent = listed.length || "";
  $("problems").replaceChildren(...listed.map((m) => {
    const item = document.createElement("li");
    const button = document.createElement("button");
    const place = m.here ? `${m.line}:${m.column}` : `${m.file}:${m.line}`;
    button.append(Object.assign(document.createElement("code"), { textContent: place }), describe(m));
    button.className = m.severity;
    button.addEventListener("click", () => m.here && editor.reveal(m.start, m.end));
    item.append(button);
    return item;
  }));
  if (!listed.length) $("problems").append(Object.assign(document.createElement("li"), { className: "empty", textContent: "None." }));
}

// Documents.

function tabs() {
  $("tabs").replaceChildren(...documents.map((d) => {
    const tab = document.createElement("span");
    tab.className = "tab";
    const name = Object.assign(document.createElement("button"), { textContent: (d.path ?? "untitled").split("/").pop(), title: d.path ?? "not saved yet" });
    name.setAttribute("role", "tab");
    name.setAttribute("aria-selected", d === current);
    if (dirty(d)) name.classList.add("dirty");
    name.addEventListener("click", () => select(d));
    const close = Object.assign(document.createElement("button"), { textContent: "×", className: "close", ariaLabel: `Close ${name.textContent}` });
    close.addEventListener("click", () => shut(d));
    tab.append(name, ...(documents.length > 1 ? [close] : []));
    return tab;
  }));
  document.title = `${dirty(current) ? "• " : ""}${(current.path ?? "untitled").split("/").pop()} – overcoat studio`;
  $("saved").textContent = current.note ?? "";
}

const dirty = (d) => d.text !== d.kept;

function select(d) {
  if (current) current.caret = editor.area.selectionStart;
  current = d;
  report = null;
  compiled = { ok: true, diagnostics: [] };
  editor.show(d.text, d.caret ?? 0);
  energy.verdict($("verdict"), null);
  tabs();
  compile();
}

function shut(d) {
  if (dirty(d) && !confirm(`Close ${d.path ?? "the new script"} without saving?`)) return;
  documents.splice(documents.indexOf(d), 1);
  if (d === current) select(documents[0]);
  tabs();
}

async function open(path) {
  const there = documents.find((d) => d.path === path);
  if (there) return select(there);
  try {
    const { text, stamp } = await json(`/api/file?path=${encodeURIComponent(path)}`);
    documents.push({ path, text, kept: text, stamp, values: {} });
    select(documents.at(-1));
  } catch (error) {
    say(error.message);
  }
}

function create() {
  documents.push({ path: null, text: START, kept: START, stamp: null, values: {} });
  select(documents.at(-1));
  editor.area.focus();
}

async function save(replace = false) {
  const d = current;
  if (!d.path) return name();
  const text = d.text;
  try {
    const { stamp } = await json("/api/save", { path: d.path, text, stamp: replace ? null : d.stamp, replace });
    Object.assign(d, { stamp, kept: text, note: `saved ${new Date().toLocaleTimeString()}` });
    say(null);
  } catch (error) {
    if (error.status === 409 && confirm(`${error.message}. Write over it?`)) return save(true);
    say(`Not saved: ${error.message}`);
  }
  tabs();
}

/** A new script asks for its name. */
function name() {
  $("naming-error").textContent = "";
  $("naming").showModal();
  $("name").select();
}

async function saveAs() {
  const path = $("name").value.trim();
  try {
    const { stamp } = await json("/api/save", { path, text: current.text, stamp: null });
    Object.assign(current, { path, stamp, kept: current.text, note: "saved" });
    $("naming").close();
    await files();
    tabs();
  } catch (error) {
    $("naming-error").textContent = error.message;
  }
}

/** Files have changed outside. */
async function outside(names) {
  await files();
  // Included files and textures count too; what this page saved itself does not.
  let matters = names.some((n) => !documents.some((d) => d.path === n));
  for (const d of documents.filter((d) => names.includes(d.path))) {
    try {
      const { text, stamp } = await json(`/api/file?path=${encodeURIComponent(d.path)}`);
      if (stamp === d.stamp) continue;
      matters = true;
      if (dirty(d)) {
        say(`${d.path} was changed elsewhere; saving will ask before it writes over that.`);
        continue;
      }
      Object.assign(d, { text, kept: text, stamp, note: "read again" });
      if (d === current) editor.show(text, Math.min(editor.area.selectionStart, text.length));
    } catch {
      // It is gone for a moment while another editor replaces it.
    }
  }
  if (matters) compile();
  tabs();
}

async function listen() {
  try {
    await stream("/api/changes", undefined, (message) => message.kind === "changed" && outside(message.names));
  } catch {
    // Told below.
  }
  say("The program has ended. Start `overcoat studio` again; what is written here is kept until the page closes.");
}

async function files() {
  const listed = await json("/api/files");
  const entry = (path) => Object.assign(document.createElement("option"), { value: path, textContent: path });
  $("files").replaceChildren(Object.assign(entry(""), { textContent: "Open…" }), ...listed.scripts.map(entry));
  $("files").value = "";
  const light = $("light").value || choices.light;
  $("light").replaceChildren(...["studio", "lamp", "overcast", ...listed.lights].map(entry));
  $("light").value = light;
  return listed;
}

// Controls.

function controls() {
  const options = (id, names, key) => {
    $(id).replaceChildren(...names.map((n) => Object.assign(document.createElement("option"), { value: n, textContent: n })));
    $(id).value = choices[key];
    $(id).addEventListener("change", () => {
      choices[key] = $(id).value;
      changed();
    });
  };
  const tiers = ["fast", "standard", "reference"];
  const rules = ["min", "balanced", "view"];
  options("tier", tiers, "tier");
  options("layering", rules, "layering");
  options("tier-b", tiers, "tierB");
  options("layering-b", rules, "layeringB");
  options("light", ["studio", "lamp", "overcast"], "light");
  const scenes = ["sphere", "ball", "drape", "furnace"].map((scene) => {
    const button = Object.assign(document.createElement("button"), { textContent: scene });
    button.setAttribute("role", "radio");
    button.dataset.scene = scene;
    button.addEventListener("click", () => show(scene));
    button.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = scenes[(scenes.indexOf(button) + step + scenes.length) % scenes.length];
      next.focus();
      next.click();
    });
    return button;
  });
  const show = (scene) => {
    choices.scene = scene;
    for (const b of scenes) {
      b.setAttribute("aria-checked", b.dataset.scene === scene);
      b.tabIndex = b.dataset.scene === scene ? 0 : -1;
    }
    $("light").disabled = scene === "furnace";
    viewer?.home();
  };
  $("scenes").append(...scenes);
  show(choices.scene);
  $("exposure").addEventListener("input", () => {
    choices.exposure = $("exposure").valueAsNumber;
    viewer.render();
  });
  $("compare").addEventListener("click", () => {
    const on = $("compare").getAttribute("aria-pressed") !== "true";
    $("compare").setAttribute("aria-pressed", on);
    $("other").hidden = !on;
    $("badge-a").hidden = !on;
    viewer.compare(on);
  });
  $("keep").addEventListener("click", () => {
    const { file, text, set } = script();
    held = held ? null : { file, text, set: { ...set } };
    $("keep").setAttribute("aria-pressed", held !== null);
    $("keep").textContent = held ? "Held" : "Hold";
    viewer.render();
  });
  $("theta").addEventListener("input", () => {
    $("theta-value").textContent = `${$("theta").value}°`;
    viewer.unpin();
    shareSoon();
    polarSoon();
  });
  $("reset").addEventListener("click", () => parameters.reset());
  $("measure").addEventListener("click", measure);
  $("save").addEventListener("click", () => save());
  $("new").addEventListener("click", create);
  $("files").addEventListener("change", () => {
    const path = $("files").value;
    $("files").value = "";
    if (path) open(path);
  });
  $("help").addEventListener("click", () => $("keys").showModal());
  $("naming-save").addEventListener("click", saveAs);
  $("naming-cancel").addEventListener("click", () => $("naming").close());
  $("name").addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    saveAs();
  });
  const theme = (name) => {
    document.documentElement.dataset.theme = name;
    localStorage.setItem("theme", name);
    redraw();
  };
  const dark = () => (document.documentElement.dataset.theme ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark")) === "dark";
  $("theme").addEventListener("click", () => theme(dark() ? "light" : "dark"));
  if (localStorage.getItem("theme")) document.documentElement.dataset.theme = localStorage.getItem("theme");
}

function redraw() {
  plots.albedo($("albedo"), curves);
  if (current) polarSoon();
}

function keys() {
  addEventListener("keydown", (event) => {
    const command = event.ctrlKey || event.metaKey;
    if (command && event.key.toLowerCase() === "s") save();
    else if (event.key === "F1") $("keys").showModal();
    else if (event.key === "F8") step(event.shiftKey ? -1 : 1);
    else if (event.altKey && event.key === "1") editor.area.focus();
    else if (event.altKey && event.key === "2") viewer.root.focus();
    else if (event.altKey && event.key === "3") $("parameters").querySelector("input, select")?.focus();
    else return;
    event.preventDefault();
  });
  addEventListener("beforeunload", (event) => documents.some(dirty) && event.preventDefault());
}

/** To the next message, or the one before. */
function step(by) {
  const at = editor.area.selectionStart;
  const marks = editor.marks.filter((m) => !m.minor).sort((a, b) => a.start - b.start);
  const next = by > 0 ? marks.find((m) => m.start > at) ?? marks[0] : marks.findLast((m) => m.start < at) ?? marks.at(-1);
  if (next) editor.reveal(next.start, next.end);
}

async function start() {
  let words;
  try {
    words = await json("/api/words");
  } catch (error) {
    return say(error.message);
  }
  editor = new Editor($("editor"), new Language(words), () => {
    current.text = editor.text;
    current.note = "";
    compile();
    tabs();
  });
  parameters = new Parameters($("parameters"), changed);
  controls();
  documents.push({ path: null, text: "", kept: "", stamp: null, values: {} });
  current = documents[0];
  viewer = new Viewer($("viewer"), (slot) => ({ ...script(slot), ...scenery() }), {
    framed: onFramed,
    failed: (error) => {
      say(error.message);
      settle();
    },
    pointed: (spot) => {
      pointed = spot;
      polarSoon();
    },
    pinned: () => {
      account(true);
      polarSoon();
    },
  });
  keys();
  new ResizeObserver(redraw).observe($("albedo"));
  const { first, tier, layering } = await files();
  Object.assign(choices, { tier, layering });
  $("tier").value = tier;
  $("layering").value = layering;
  documents.length = 0;
  if (first) await open(first);
  if (!documents.length) {
    create();
    if (first) current.path = first;
    tabs();
  }
  listen();
}

start();
