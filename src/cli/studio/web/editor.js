// A plain text field with colours and underlines painted behind it: the browser's own caret, selection and undo.

const MAX_PAINTED = 200_000;

export class Editor {
  constructor(root, language, changed) {
    const find = (selector) => root.querySelector(selector);
    Object.assign(this, { root, language, changed });
    this.area = find("textarea");
    this.paint = find(".paint");
    this.gutter = find(".gutter");
    this.active = find(".line");
    this.list = find(".completions");
    this.tip = find(".tip");
    this.hint = document.getElementById("hint");
    this.marks = [];
    this.parameters = [];
    this.popup = null;
    this.leaving = false;
    this.measure();
    this.listen();
  }

  get text() {
    return this.area.value;
  }

  /** Another document: its text and where its caret was. */
  show(text, caret = 0) {
    this.area.value = text;
    this.area.setSelectionRange(caret, caret);
    this.area.scrollTop = 0;
    this.area.scrollLeft = 0;
    this.marks = [];
    this.close();
    this.draw();
  }

  /** Replaces a range so that undo takes it back. */
  replace(start, end, text) {
    this.area.focus();
    this.area.setSelectionRange(start, end);
    if (!document.execCommand("insertText", false, text)) {
      this.area.setRangeText(text, start, end, "end");
      this.area.dispatchEvent(new Event("input"));
    }
  }

  /** Underlines: `[{start, end, severity, message}]`. */
  mark(marks) {
    this.marks = marks.filter((m) => m.here !== false && m.start < this.text.length + 2);
    this.draw();
  }

  reveal(start, end = start) {
    this.area.focus();
    this.area.setSelectionRange(start, end);
    const { line, column } = this.place(start);
    const { height, width } = this.cell;
    if (line * height < this.area.scrollTop || (line + 2) * height > this.area.scrollTop + this.area.clientHeight) {
      this.area.scrollTop = Math.max(0, line * height - this.area.clientHeight / 3);
    }
    if (column * width > this.area.scrollLeft + this.area.clientWidth - 40) this.area.scrollLeft = Math.max(0, column * width - this.area.clientWidth / 2);
    this.scroll();
  }

  listen() {
    const area = this.area;
    area.addEventListener("input", () => {
      // What is typed moves the marks behind it until the next check.
      this.close();
      this.changed();
      this.draw();
      if (/[\w"]$/.test(this.text.slice(0, area.selectionStart))) this.suggest(false);
    });
    area.addEventListener("scroll", () => this.scroll());
    area.addEventListener("keydown", (event) => this.key(event));
    area.addEventListener("blur", () => setTimeout(() => this.close(), 150));
    area.addEventListener("mousedown", () => this.close());
    document.addEventListener("selectionchange", () => {
      if (document.activeElement === area) this.moved();
    });
    area.addEventListener("mousemove", (event) => this.hover(event));
    area.addEventListener("mouseleave", () => (this.tip.hidden = true));
    new ResizeObserver(() => this.measure()).observe(this.root);
    document.fonts?.ready.then(() => this.measure());
  }

  measure() {
    const probe = document.createElement("span");
    probe.textContent = "0".repeat(100);
    probe.className = "probe";
    this.paint.parentElement.append(probe);
    const box = probe.getBoundingClientRect();
    probe.remove();
    this.cell = { width: box.width / 100, height: parseFloat(getComputedStyle(this.area).lineHeight) };
    this.scroll();
  }

  scroll() {
    const { scrollTop, scrollLeft } = this.area;
    this.paint.style.transform = `translate(${-scrollLeft}px, ${-scrollTop}px)`;
    this.gutter.firstChild && (this.gutter.firstChild.style.transform = `translateY(${-scrollTop}px)`);
    this.moved();
  }

  moved() {
    const at = this.area.selectionStart;
    const { line } = this.place(at);
    this.active.style.transform = `translateY(${line * this.cell.height - this.area.scrollTop}px)`;
    for (const number of this.gutter.querySelectorAll(".on")) number.classList.remove("on");
    this.gutter.firstChild?.children[line]?.classList.add("on");
    this.sign(at);
  }

  place(at) {
    const before = this.text.slice(0, at);
    const start = before.lastIndexOf("\n") + 1;
    // A tab goes on to the next multiple of four.
    let column = 0;
    for (const c of before.slice(start)) column += c === "\t" ? 4 - (column % 4) : 1;
    return { line: before.split("\n").length - 1, column };
  }

  draw() {
    const text = this.text;
    this.paint.replaceChildren(text.length > MAX_PAINTED ? text : this.coloured(text), "\n ");
    const worst = new Map();
    for (const mark of this.marks) {
      const line = this.place(mark.start).line;
      if (worst.get(line) !== "error") worst.set(line, mark.severity);
    }
    const numbers = document.createElement("div");
    const count = text.split("\n").length;
    for (let line = 0; line < count; line += 1) {
      const number = document.createElement("span");
      number.textContent = line + 1;
      if (worst.has(line)) number.classList.add(worst.get(line));
      numbers.append(number);
    }
    this.gutter.replaceChildren(numbers);
    this.scroll();
  }

  coloured(text) {
    const fragment = document.createDocumentFragment();
    const tokens = this.language.tokens(text);
    const edges = new Set([0, text.length]);
    for (const [start, end] of tokens) edges.add(start).add(end);
    for (const { start, end } of this.marks) edges.add(Math.min(start, text.length)).add(Math.min(end, text.length));
    const cuts = [...edges].sort((a, b) => a - b);
    let token = 0;
    for (let i = 0; i + 1 < cuts.length; i += 1) {
      const [start, end] = [cuts[i], cuts[i + 1]];
      while (token < tokens.length && tokens[token][1] <= start) token += 1;
      const kind = tokens[token]?.[0] <= start ? tokens[token][2] : "";
      const marks = this.marks.filter((m) => m.start <= start && end <= m.end);
      if (!kind && !marks.length) {
        fragment.append(text.slice(start, end));
        continue;
      }
      const span = document.createElement("span");
      span.className = kind;
      span.textContent = text.slice(start, end);
      if (marks.length) {
        const severity = ["error", "gain", "warning", "part"].find((s) => marks.some((m) => m.severity === s));
        span.classList.add("mark", `mark-${severity}`);
        span.marks = marks;
      }
      fragment.append(span);
    }
    // Something to underline where a message points behind the last character.
    const beyond = this.marks.filter((m) => m.start >= text.length);
    if (beyond.length) {
      const span = Object.assign(document.createElement("span"), { className: `mark mark-${beyond[0].severity}`, textContent: " ", marks: beyond });
      fragment.append(span);
    }
    return fragment;
  }

  hover(event) {
    for (const span of this.paint.querySelectorAll(".mark")) {
      for (const box of span.getClientRects()) {
        const within = event.clientX >= box.left && event.clientX <= box.right && event.clientY >= box.top && event.clientY <= box.bottom;
        if (!within) continue;
        const frame = this.paint.parentElement.getBoundingClientRect();
        this.tip.replaceChildren(...span.marks.filter((m, i, all) => all.findIndex((o) => o.message === m.message) === i).map(describe));
        this.tip.hidden = false;
        const below = box.bottom - frame.top + 4;
        this.tip.style.left = `${Math.max(4, Math.min(box.left - frame.left, frame.width - 300))}px`;
        this.tip.style.top = `${below}px`;
        if (below + this.tip.offsetHeight > frame.height) this.tip.style.top = `${box.top - frame.top - this.tip.offsetHeight - 4}px`;
        return;
      }
    }
    this.tip.hidden = true;
  }

  key(event) {
    const { key, shiftKey } = event;
    const command = event.ctrlKey || event.metaKey;
    if (this.popup && this.popupKey(event)) return;
    if (command && key === " ") {
      event.preventDefault();
      this.suggest(true);
    } else if (command && key === "/") {
      event.preventDefault();
      this.lines((line) => line, true);
    } else if (key === "Escape") {
      this.leaving = true;
      this.tip.hidden = true;
      return;
    } else if (key === "Tab" && !command && !event.altKey) {
      if (this.leaving) return;
      event.preventDefault();
      this.indent(shiftKey);
    } else if (key === "Enter" && !command) {
      event.preventDefault();
      this.newline();
    } else if (key === "}" && /^[ \t]+$/.test(this.lineBefore())) {
      event.preventDefault();
      const at = this.area.selectionStart;
      this.replace(at - Math.min(4, this.lineBefore().length), this.area.selectionEnd, "}");
    }
    this.leaving = false;
  }

  lineBefore() {
    const at = this.area.selectionStart;
    return this.text.slice(this.text.lastIndexOf("\n", at - 1) + 1, at);
  }

  newline() {
    const line = this.lineBefore();
    const indent = /^[ \t]*/.exec(line)[0] + (/[{(]\s*$/.test(line) ? "    " : "");
    this.replace(this.area.selectionStart, this.area.selectionEnd, "\n" + indent);
  }

  indent(back) {
    const { selectionStart: start, selectionEnd: end } = this.area;
    if (start === end && !back) {
      const column = this.lineBefore().length;
      this.replace(start, end, " ".repeat(4 - (column % 4)));
      return;
    }
    this.lines((line) => (back ? line.replace(/^( {1,4}|\t)/, "") : line && "    " + line));
  }

  /** Rewrites the selected lines, or puts them in and out of comments. */
  lines(rewrite, comment = false) {
    const { selectionStart, selectionEnd } = this.area;
    const start = this.text.lastIndexOf("\n", selectionStart - 1) + 1;
    let end = this.text.indexOf("\n", Math.max(selectionEnd - 1, start));
    if (end < 0) end = this.text.length;
    const before = this.text.slice(start, end).split("\n");
    const out = comment && before.every((l) => !l.trim() || /^\s*\/\//.test(l));
    const toggle = (line) => (out ? line.replace(/^(\s*)\/\/ ?/, "$1") : line.trim() ? line.replace(/^(\s*)/, "$1// ") : line);
    const after = before.map(comment ? toggle : rewrite).join("\n");
    this.replace(start, end, after);
    this.area.setSelectionRange(before.length > 1 ? start : start + after.length, start + after.length);
  }

  suggest(asked) {
    const at = this.area.selectionStart;
    if (at !== this.area.selectionEnd) return;
    const found = this.language.complete(this.text, at, this.parameters, asked);
    if (!found) return this.close();
    this.popup = { ...found, chosen: 0 };
    this.list.replaceChildren(...found.found.map((word, index) => {
      const item = document.createElement("li");
      item.setAttribute("role", "option");
      item.id = `completion-${index}`;
      const name = Object.assign(document.createElement("b"), { textContent: word.label, className: word.kind });
      item.append(name, Object.assign(document.createElement("span"), { textContent: word.detail ?? "" }));
      item.addEventListener("mousedown", (event) => {
        event.preventDefault();
        this.take(index);
      });
      return item;
    }));
    const { line, column } = this.place(found.start);
    const { width, height } = this.cell;
    const frame = this.list.parentElement.getBoundingClientRect();
    this.list.hidden = false;
    const top = (line + 1) * height - this.area.scrollTop + 10;
    const fits = top + this.list.offsetHeight < frame.height || top < this.list.offsetHeight;
    this.list.style.top = `${fits ? top : top - this.list.offsetHeight - height - 6}px`;
    this.list.style.left = `${Math.max(0, Math.min(column * width - this.area.scrollLeft + 8, frame.width - this.list.offsetWidth - 8))}px`;
    this.choose(0);
  }

  choose(index) {
    const items = this.list.children;
    this.popup.chosen = (index + items.length) % items.length;
    for (const [i, item] of [...items].entries()) item.setAttribute("aria-selected", i === this.popup.chosen);
    items[this.popup.chosen].scrollIntoView({ block: "nearest" });
    this.area.setAttribute("aria-activedescendant", items[this.popup.chosen].id);
    const { label, doc } = this.popup.found[this.popup.chosen];
    this.say({ name: label, parts: [], doc: doc ?? "" });
  }

  popupKey(event) {
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 8, PageUp: -8 }[event.key];
    if (step) this.choose(Math.max(-1, Math.min(this.popup.found.length, this.popup.chosen + step)));
    else if (event.key === "Enter" || event.key === "Tab") this.take(this.popup.chosen);
    else if (event.key === "Escape") this.close();
    else return false;
    event.preventDefault();
    event.stopPropagation();
    return true;
  }

  take(index) {
    const { start, found } = this.popup;
    const word = found[index];
    const follows = this.text[this.area.selectionStart] === "(";
    this.close();
    this.replace(start, this.area.selectionStart, word.label + (word.call && !follows ? "()" : ""));
    if (word.call && !follows) {
      const at = this.area.selectionStart - 1;
      this.area.setSelectionRange(at, at);
    }
    this.close();
  }

  close() {
    this.popup = null;
    this.list.hidden = true;
    this.area.removeAttribute("aria-activedescendant");
  }

  sign(at) {
    if (!this.popup) this.say(this.language.signature(this.text, at));
  }

  say(signature) {
    if (!signature) return this.hint.replaceChildren();
    const { name, parts, doc } = signature;
    const line = document.createElement("div");
    line.append(Object.assign(document.createElement("b"), { textContent: name }));
    if (parts.length && name) line.append("(");
    parts.forEach((part, index) => {
      if (index) line.append(", ");
      line.append(Object.assign(document.createElement(part.current ? "mark" : "span"), { textContent: part.text }));
    });
    if (parts.length && name) line.append(")");
    this.hint.replaceChildren(line, Object.assign(document.createElement("p"), { textContent: doc }));
  }
}

/** Text in which what stands between backticks is code. */
export function prose(text) {
  return text.split("`").map((piece, index) => (index % 2 ? Object.assign(document.createElement("code"), { textContent: piece }) : piece));
}

/** A message with what goes with it. */
export function describe(mark) {
  const box = document.createElement("div");
  box.className = `message ${mark.severity}`;
  const paragraph = (text, className = "") => {
    const made = Object.assign(document.createElement("p"), { className });
    made.append(...prose(text));
    return made;
  };
  box.append(paragraph(mark.message + (mark.note ? `: ${mark.note}` : "")));
  for (const help of mark.help ?? []) box.append(paragraph(help, "advice"));
  return box;
}
