// A control for each parameter, made from its declaration.

const byte = (x) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
const linear = (b) => (b / 255 <= 0.04045 ? b / 255 / 12.92 : ((b / 255 + 0.055) / 1.055) ** 2.4);
const clamp = (x, lo, hi) => Math.min(hi, Math.max(lo, x));
const hex = (rgb) => "#" + rgb.map((x) => byte(clamp(x, 0, 1)).toString(16).padStart(2, "0")).join("");
const short = (x) => String(+x.toPrecision(4));
const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

export class Parameters {
  /** `changed(values)`: those that are not at their defaults. */
  constructor(root, changed) {
    Object.assign(this, { root, changed });
    this.declared = [];
    this.values = {};
    this.shape = "";
  }

  /** Takes over what the script declares; keeps the values that still fit. */
  declare(parameters, values) {
    const shape = JSON.stringify(parameters);
    const same = shape === this.shape && values === this.values;
    this.declared = parameters;
    this.values = values;
    this.shape = shape;
    if (same) return;
    const shown = parameters.filter((p) => p.kind !== "none");
    this.root.replaceChildren(...(shown.length ? this.pages(shown) : [element("p", { className: "empty", textContent: "The script declares none." })]));
  }

  pages(parameters) {
    const pages = new Map();
    for (const p of parameters) pages.set(p.page ?? "", [...(pages.get(p.page ?? "") ?? []), p]);
    return [...pages].flatMap(([page, list]) => [...(page ? [element("h3", { textContent: page })] : []), ...list.map((p) => this.row(p))]);
  }

  reset() {
    for (const name of Object.keys(this.values)) delete this.values[name];
    this.shape = "";
    this.declare(this.declared, this.values);
    this.changed();
  }

  set(p, value) {
    if (JSON.stringify(value) === JSON.stringify(p.default)) delete this.values[p.name];
    else this.values[p.name] = value;
    this.root.querySelector(`[data-name="${p.name}"]`)?.classList.toggle("moved", p.name in this.values);
    this.changed();
  }

  row(p) {
    const id = `parameter-${p.name}`;
    const value = this.values[p.name] ?? p.default ?? (p.kind === "color" || p.kind === "triple" ? [0, 0, 0] : p.kind === "text" ? "" : 0);
    const name = element("label", { htmlFor: id, textContent: p.label ?? p.name, title: [p.label, p.name, p.help].filter(Boolean).join(": ") });
    const control = this[p.kind](p, id, value);
    const row = element("div", { className: `row ${p.kind}` }, name, ...control);
    row.dataset.name = p.name;
    row.classList.toggle("moved", p.name in this.values);
    name.addEventListener("dblclick", () => {
      delete this.values[p.name];
      row.replaceWith(this.row(p));
      this.changed();
    });
    return row;
  }

  range(p, value) {
    const most = Math.max(...[value, p.default].flat().filter(Number.isFinite), 0);
    return [p.min ?? Math.min(0, ...[value].flat()), p.max ?? (most > 1 ? 2 * most : 1)];
  }

  float(p, id, value) {
    const [min, max] = this.range(p, value);
    const whole = p.kind === "int";
    const step = whole ? 1 : (max - min) / 500;
    const slider = element("input", { type: "range", id, min, max, step, value });
    const number = element("input", { type: "number", min: p.min ?? "", max: p.max ?? "", step: whole ? 1 : "any", value: short(value), ariaLabel: `${p.name}, number` });
    slider.addEventListener("input", () => {
      number.value = short(slider.valueAsNumber);
      this.set(p, whole ? Math.round(slider.valueAsNumber) : +short(slider.valueAsNumber));
    });
    number.addEventListener("input", () => {
      if (!Number.isFinite(number.valueAsNumber)) return;
      slider.value = number.value;
      this.set(p, whole ? Math.round(number.valueAsNumber) : number.valueAsNumber);
    });
    return [slider, number];
  }

  int(p, id, value) {
    return this.float(p, id, value);
  }

  color(p, id, value) {
    let now = [...value];
    const swatch = element("input", { type: "color", id, value: hex(now), title: "Linear values are beside it" });
    const numbers = this.three(p, now, (next) => {
      now = next;
      swatch.value = hex(now);
    });
    swatch.addEventListener("input", () => {
      now = [1, 3, 5].map((at) => +linear(parseInt(swatch.value.slice(at, at + 2), 16)).toFixed(4));
      [...numbers.children].forEach((field, k) => (field.value = short(now[k])));
      this.set(p, now);
    });
    return [swatch, numbers];
  }

  triple(p, id, value) {
    const numbers = this.three(p, [...value], () => {});
    numbers.firstChild.id = id;
    return [numbers];
  }

  three(p, value, moved) {
    const now = [...value];
    const field = (k) => {
      const step = p.kind === "color" ? 0.01 : 0.1;
      const made = element("input", { type: "number", step, value: short(now[k]), ariaLabel: `${p.name}, ${p.kind === "color" ? ["red", "green", "blue"][k] : "xyz"[k]}` });
      made.addEventListener("input", () => {
        const next = [...made.parentElement.children].map((f) => f.valueAsNumber);
        if (!next.every(Number.isFinite)) return;
        moved(next);
        this.set(p, next);
      });
      return made;
    };
    return element("span", { className: "three" }, field(0), field(1), field(2));
  }

  choice(p, id, value) {
    const list = element("select", { id }, ...p.options.map((o) => element("option", { value: o, textContent: o })));
    list.value = value;
    list.addEventListener("change", () => this.set(p, list.value));
    return [list];
  }

  text(p, id, value) {
    const field = element("input", { type: "text", id, value, spellcheck: false });
    field.addEventListener("change", () => this.set(p, field.value));
    return [field];
  }

  switch(p, id, value) {
    const box = element("input", { type: "checkbox", id, checked: value !== 0 });
    box.addEventListener("change", () => this.set(p, box.checked ? 1 : 0));
    return [box];
  }
}
