// The script language as the editor sees it: tokens to colour, words to complete. The words come from the program.

const TOKEN = /(\/\/[^\n]*|\/\*[\s\S]*?(?:\*\/|$))|("(?:\\.|[^"\\\n])*"?)|(^[ \t]*#[^\n]*)|(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)|([A-Za-z_]\w*)|(\[\[|\]\]|[-+*/%=<>!&|^~?:]+)|([(){}[\],;.])/gm;

export class Language {
  constructor(words) {
    this.words = words;
    this.classes = new Map();
    const put = (names, kind) => names.forEach((name) => this.classes.set(name, kind));
    put(words.functions.map((f) => f.name), "function");
    put(words.closures.map((c) => c.name), "closure");
    put(words.keywords, "keyword");
    put(words.types, "type");
    put(words.globals, "global");
    put(words.constants, "constant");
    this.closures = new Map();
    for (const closure of words.closures) {
      if (!this.closures.has(closure.name)) this.closures.set(closure.name, []);
      this.closures.get(closure.name).push(closure);
    }
    this.functions = new Map(words.functions.map((f) => [f.name, f]));
  }

  /** `[start, end, class]` of everything that has a colour. */
  tokens(text) {
    const found = [];
    TOKEN.lastIndex = 0;
    for (let m; (m = TOKEN.exec(text)); ) {
      const kind = m[1] ? "comment" : m[2] ? "string" : m[3] ? "directive" : m[4] ? "number" : m[5] ? this.classes.get(m[5]) : m[6] ? "operator" : "";
      if (kind) found.push([m.index, m.index + m[0].length, kind]);
    }
    return found;
  }

  /** The call that `at` stands in: the name, which argument, the string before it, whether within a string. */
  call(text, at) {
    const open = [];
    TOKEN.lastIndex = 0;
    let last = "";
    let inside = null;
    for (let m; (m = TOKEN.exec(text)) && m.index < at; ) {
      const end = m.index + m[0].length;
      if (m[1] && at <= end && at > m.index) return { comment: true };
      if (m[2] && at > m.index && (at < end || !/^".*"$/s.test(m[0]))) inside = { start: m.index + 1 };
      else if (m[0] === "(" || m[0] === "[[") open.push({ name: m[0] === "(" ? last : "[[", argument: 0, word: "" });
      else if (m[0] === ")" || m[0] === "]]") open.pop();
      else if (m[0] === "," && open.length) open[open.length - 1].argument += 1;
      else if (m[2] && open.length) open[open.length - 1].word = m[0].slice(1, -1);
      last = m[5] ?? "";
    }
    return { ...(open.pop() ?? {}), inside };
  }

  /** What may stand at `at`: the range it replaces, and the candidates. */
  complete(text, at, parameters, asked) {
    const call = this.call(text, at);
    if (call.comment) return null;
    if (call.inside) {
      const start = call.inside.start;
      const typed = text.slice(start, at);
      const words = (this.closures.get(call.name) ?? []).flatMap((c) => c.params.flatMap((p, index) => {
        if (p.keyword && call.word === p.name && p.options) return p.options.map((o) => option(o, p));
        if (!p.keyword && p.type === "string" && index === call.argument) return (p.options ?? []).map((o) => option(o, p));
        return p.keyword && call.word !== p.name ? [{ label: p.name, kind: "keyword", detail: p.type, doc: p.doc }] : [];
      }));
      const found = filter(words, typed);
      return found.length ? { start, found } : null;
    }
    const typed = /[A-Za-z_]\w*$/.exec(text.slice(Math.max(0, at - 64), at))?.[0] ?? "";
    if (typed.length < (asked ? 0 : 2) || /\d$/.test(text.slice(0, at - typed.length).slice(-1))) return null;
    const found = filter(this.candidates(call, parameters), typed);
    if (!found.length || (found.length === 1 && found[0].label === typed && !asked)) return null;
    return { start: at - typed.length, found };
  }

  candidates(call, parameters) {
    if (call.name === "[[") {
      const metadata = this.words.metadata.map((label) => ({ label, kind: "metadata", detail: "metadata" }));
      return [...metadata, ...this.words.types.map((label) => ({ label, kind: "type", detail: "type" }))];
    }
    const plain = (names, kind) => names.map((label) => ({ label, kind, detail: kind }));
    return [
      ...parameters.map((p) => ({ label: p.name, kind: "parameter", detail: p.type, doc: p.label ?? "" })),
      ...this.words.closures.map((c) => ({ label: c.name, kind: "closure", detail: c.signature.slice(c.name.length), doc: c.doc, call: true })),
      ...this.words.functions.map((f) => ({ label: f.name, kind: "function", detail: f.signatures[0] ?? "", doc: f.signatures.slice(1, 4).join("\n"), call: true })),
      ...plain(this.words.globals, "global"),
      ...plain(this.words.keywords, "keyword"),
      ...plain(this.words.types, "type"),
      ...plain(this.words.constants, "constant"),
    ];
  }

  /** The signature of the call around `at`, in parts, and what is said about the argument. */
  signature(text, at) {
    const call = this.call(text, at);
    const forms = this.closures.get(call.name);
    if (forms) {
      const form = forms.find((f) => f.params.filter((p) => !p.keyword).length > call.argument) ?? forms[0];
      const named = form.params.find((p) => p.keyword && p.name === call.word);
      const positional = form.params.filter((p) => !p.keyword);
      const current = named ?? positional[call.argument] ?? null;
      const parts = positional.map((p) => ({ text: `${p.type} ${p.name}`, current: p === current }));
      if (named) parts.push({ text: `"${named.name}", ${named.type}`, current: true });
      return { name: form.name, parts, doc: current ? current.doc + range(current) : form.doc };
    }
    const signatures = this.functions.get(call.name)?.signatures ?? [];
    return signatures.length ? { name: "", parts: [{ text: signatures.slice(0, 3).join("   "), current: false }], doc: "" } : null;
  }
}

function option(label, parameter) {
  return { label, kind: "string", detail: parameter.name, doc: parameter.doc };
}

function range(p) {
  return p.min === null || p.max === null ? "" : ` (${p.min} to ${p.max})`;
}

/** Those that begin with what was typed first, then those that contain it. */
function filter(words, typed) {
  const wanted = typed.toLowerCase();
  const seen = new Set();
  const rank = (w) => {
    const label = w.label.toLowerCase();
    return label.startsWith(wanted) ? 0 : wanted.length > 1 && label.includes(wanted) ? 1 : 2;
  };
  const fresh = words.filter((w) => !seen.has(w.label) && seen.add(w.label) && rank(w) < 2);
  return fresh.sort((a, b) => rank(a) - rank(b) || a.label.length - b.label.length).slice(0, 60);
}
