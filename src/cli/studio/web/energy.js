// What the program says about the energy: the verdict, the shares, the cost.

import { prose } from "./editor.js";

const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};
const mean = (rgb) => (rgb[0] + rgb[1] + rgb[2]) / 3;
const percent = (x) => `${(100 * x).toFixed(Math.abs(x) < 0.0995 ? 1 : 0)} %`;

const VERDICTS = {
  conserves: ["✓", "Conserves energy"],
  gains: ["✗", "Gains energy"],
  undecided: ["?", "Not decided"],
  error: ["!", "Does not compile"],
  none: ["…", "Checking"],
};

/** Shows what `check` says; `null` while it is not known. */
export function verdict(root, report) {
  const name = report?.verdict ?? "none";
  const [mark, title] = VERDICTS[name];
  root.dataset.verdict = name;
  root.querySelector(".mark").textContent = mark;
  root.querySelector("strong").textContent = title;
  root.querySelector("p").replaceChildren(...prose(report ? because(report) : "for all parameters, points and angles"));
}

function because(report) {
  const { verdict: name, bound, witness, diagnostics } = report;
  if (name === "gains" && witness) {
    const [worst, side] = [Math.max(...witness.albedo), witness.side === "view" ? "" : ", seen from the light"];
    const advice = diagnostics?.[0]?.help?.find((h) => !/contributes/.test(h));
    return `albedo ${worst.toFixed(3)} at ${Math.round((Math.acos(witness.cos) * 180) / Math.PI)}°${side}${advice ? `; ${advice}` : ""}`;
  }
  if (name === "conserves") return bound === null ? "proven" : `proven: albedo at most ${bound.toFixed(4)} for all parameters, points and angles`;
  if (name === "undecided") return bound === null ? "neither proven nor refuted" : `no more than ${bound.toFixed(3)} is proven, nothing above 1 found`;
  return "see the messages";
}

/** A colour of its own for each lobe, the same in bars and curves. */
const PALETTE = ["#e8804f", "#4a9edb", "#46b37b", "#c77dd6", "#d6b13c", "#6f7ee8", "#e06a8f", "#3fb5b5"];
const given = new Map();
export function colour(lobe) {
  if (!given.has(lobe)) given.set(lobe, PALETTE[given.size % PALETTE.length]);
  return given.get(lobe);
}

/** Lobe by lobe and layer by layer: a bar whose parts add up to all light, and their names. */
export function shares(root, message) {
  const explained = message?.explained;
  if (!explained) return root.replaceChildren();
  if (explained.note) return root.replaceChildren(element("p", { className: "empty", textContent: explained.note }));
  const parts = [];
  const add = (name, rgb, kind, fill) => {
    const share = mean(rgb);
    if (Math.abs(share) >= 5e-4) parts.push({ name, rgb, share, kind, fill });
  };
  for (const lobe of explained.lobes) add(lobe.lobe, lobe.scattered, "scattered", colour(lobe.lobe));
  for (const layer of explained.layers) {
    add(`lost below ${layer.top.join(", ")}`, layer.lost, "lost");
    add(`withheld below ${layer.top.join(", ")}`, layer.tint, "tint");
  }
  const weights = explained.absorbed_by_weights;
  // A tree over its budget gives out more than it is given.
  add(mean(weights) < 0 ? "given out twice by weights" : "absorbed by weights", weights, "absorbed");
  add("absorbed by lobes", explained.absorbed_by_lobes, "absorbed");
  const whole = Math.max(1, parts.filter((p) => p.share > 0).reduce((sum, p) => sum + p.share, 0));
  const bar = element("div", { className: "bar-of-light" });
  for (const part of parts.filter((p) => p.share > 0)) {
    const piece = element("span", { className: part.kind, title: `${part.name}: ${percent(part.share)}` });
    piece.style.width = `${(100 * part.share) / whole}%`;
    if (part.fill) piece.style.background = part.fill;
    bar.append(piece);
  }
  if (whole > 1.0005) {
    const limit = element("i", { className: "limit", title: "all light there is" });
    limit.style.left = `${100 / whole}%`;
    bar.append(limit);
  }
  const list = element("ul", {}, ...parts.map((part) => {
    const swatch = element("i", { className: part.kind });
    if (part.fill) swatch.style.background = part.fill;
    const value = element("b", { textContent: percent(part.share), title: part.rgb.map((x) => x.toFixed(4)).join("  ") });
    return element("li", {}, swatch, element("span", { textContent: part.name }), value);
  }));
  root.replaceChildren(bar, list);
}

export function cost(root, data) {
  if (!data) return root.replaceChildren();
  const cell = (ns) => (ns >= 100 ? ns.toFixed(0) : ns.toFixed(1));
  const row = (name, key) => element("tr", {}, element("th", { textContent: name, scope: "row" }), element("td", { textContent: cell(data.ns[key]) }), element("td", { textContent: cell(data.unspecialised.ns[key]) }));
  const head = element("tr", {}, element("th", { textContent: "ns" }), element("th", { textContent: "as set", scope: "col" }), element("th", { textContent: "open", scope: "col", title: "with every parameter read at every point" }));
  const table = element("table", {}, head, row("shade", "shade"), row("flatten", "flatten"), row("eval", "eval"), row("sample", "sample"), row("in a batch", "eval_batch"));
  const bytes = `${data.bytes.bsdf} bytes per BSDF, ${data.bytes.tables} of tables; ${data.constant ? "one tree everywhere" : `varies with ${data.globals.join(", ")}`}`;
  root.replaceChildren(table, element("p", { textContent: bytes }));
}
