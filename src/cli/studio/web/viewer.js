// The picture: one or two panes that refine, turned by mouse or keyboard, and a point that is looked at.

import { Latest } from "./server.js";

/** Pixels of a side of the picture at most: what two cores refine while one looks. */
const MOST = 720;
const SAMPLES = 256;

class Pane {
  constructor(viewer, canvas, slot) {
    Object.assign(this, { viewer, canvas, slot });
    this.frames = 0;
    this.latest = new Latest("/api/render", (message, bytes) => this.take(message, bytes), (error) => viewer.on.failed(error), () => {});
  }

  take(message, bytes) {
    if (message.kind === "compiled") return !message.ok;
    if (message.kind === "failed") {
      this.viewer.on.failed(new Error(message.message));
      return true;
    }
    const picture = new ImageData(new Uint8ClampedArray(bytes.buffer, bytes.byteOffset, bytes.length), message.width, message.height);
    const small = Object.assign(document.createElement("canvas"), { width: message.width, height: message.height });
    small.getContext("2d").putImageData(picture, 0, 0);
    const context = this.canvas.getContext("2d");
    const { width, height } = this.viewer.size;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    context.imageSmoothingQuality = "high";
    // A sample a pixel, drawn large: softly, so that shapes are seen before grain.
    context.filter = message.samples ? "none" : "blur(2px)";
    context.drawImage(small, 0, 0, width, height);
    this.frames += 1;
    this.canvas.dataset.frames = this.frames;
    this.viewer.framed(message, this.slot);
    return true;
  }
}

export class Viewer {
  /** `on`: failed, framed, pointed, pinned. `state()`: the question without view and size, for a slot. */
  constructor(root, state, on) {
    Object.assign(this, { root, state, on });
    this.client = crypto.getRandomValues(new Uint32Array(2)).join("-");
    this.panes = { a: new Pane(this, root.querySelector("#canvas-a"), "a"), b: new Pane(this, root.querySelector("#canvas-b"), "b") };
    this.split = root.querySelector("#split");
    this.pin = root.querySelector("#pin");
    this.progress = root.querySelector("#progress");
    this.view = { turn: 0, rise: 0, distance: 1 };
    this.comparing = false;
    this.at = null;
    this.share = 0.5;
    this.size = { width: 320, height: 320 };
    this.listen();
    new ResizeObserver(() => this.resized()).observe(root);
    this.resized();
  }

  resized() {
    const { clientWidth, clientHeight } = this.root;
    if (!clientWidth || !clientHeight) return;
    const scale = Math.min(1.5, devicePixelRatio, MOST / Math.max(clientWidth, clientHeight));
    const size = { width: Math.round(clientWidth * scale), height: Math.round(clientHeight * scale) };
    if (size.width === this.size.width && size.height === this.size.height) return;
    this.size = size;
    this.render();
  }

  scenery() {
    return { ...this.view, ...this.size };
  }

  render() {
    const question = (slot) => ({ ...this.state(slot), ...this.scenery(), samples: SAMPLES, slot: `${this.client} ${slot}` });
    this.panes.a.latest.ask(question("a"));
    if (this.comparing) this.panes.b.latest.ask(question("b"));
  }

  clear() {
    for (const pane of Object.values(this.panes)) {
      pane.latest.stop();
      pane.canvas.getContext("2d").clearRect(0, 0, pane.canvas.width, pane.canvas.height);
    }
    this.progress.textContent = "";
  }

  compare(on) {
    this.comparing = on;
    this.panes.b.canvas.hidden = !on;
    this.split.hidden = !on;
    if (!on) this.panes.b.latest.stop();
    this.place();
    this.render();
  }

  framed(message, slot) {
    if (slot === "a") {
      this.progress.textContent = `${message.samples}/${message.of}`;
      this.progress.title = "samples per pixel";
      this.progress.dataset.milliseconds = Math.round(message.milliseconds);
    }
    this.on.framed(message, slot);
  }

  /** Puts the split and the pin where they belong. */
  place() {
    this.panes.b.canvas.style.clipPath = `inset(0 0 0 ${this.share * 100}%)`;
    this.split.style.left = `${this.share * 100}%`;
    this.split.setAttribute("aria-valuenow", Math.round(this.share * 100));
    this.pin.hidden = !this.at;
    if (this.at) {
      this.pin.style.left = `${this.at[0] * 100}%`;
      this.pin.style.top = `${this.at[1] * 100}%`;
    }
  }

  turn(turn, rise) {
    this.view.turn += turn;
    this.view.rise = Math.max(-1.5, Math.min(1.5, this.view.rise + rise));
    this.unpin();
    this.render();
  }

  zoom(factor) {
    this.view.distance = Math.max(0.3, Math.min(3, this.view.distance * factor));
    this.unpin();
    this.render();
  }

  home() {
    this.view = { turn: 0, rise: 0, distance: 1 };
    this.unpin();
    this.render();
  }

  unpin() {
    if (!this.at) return;
    this.at = null;
    this.place();
    this.on.pinned(null);
  }

  fix(at) {
    this.at = at;
    this.place();
    this.on.pinned(at);
  }

  spot(event) {
    const box = this.root.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  listen() {
    let drag = null;
    this.root.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      drag = { x: event.clientX, y: event.clientY, moved: 0, split: event.target.closest("#split") };
      this.root.setPointerCapture(event.pointerId);
    });
    this.root.addEventListener("pointermove", (event) => {
      if (!drag) {
        this.on.pointed(this.spot(event));
        return;
      }
      const [x, y] = [event.clientX - drag.x, event.clientY - drag.y];
      drag.moved += Math.abs(x) + Math.abs(y);
      Object.assign(drag, { x: event.clientX, y: event.clientY });
      if (drag.split) this.divide(this.spot(event)[0]);
      else if (drag.moved > 3) this.turn(-x * 0.008, y * 0.008);
    });
    this.root.addEventListener("pointerup", (event) => {
      if (drag && drag.moved <= 3 && !drag.split) this.fix(this.spot(event));
      drag = null;
    });
    this.root.addEventListener("pointerleave", () => this.on.pointed(null));
    this.root.addEventListener("dblclick", () => this.home());
    this.root.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.sign(event.deltaY) * 0.08));
    }, { passive: false });
    this.root.addEventListener("keydown", (event) => this.key(event));
  }

  divide(share) {
    this.share = Math.max(0.02, Math.min(0.98, share));
    this.place();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (step && event.target === this.split) this.divide(this.share + 0.02 * (step[0] + step[1]));
    else if (step) this.turn(0.1 * step[0], 0.1 * step[1]);
    else if (event.key === "+" || event.key === "=") this.zoom(0.9);
    else if (event.key === "-") this.zoom(1.1);
    else if (event.key === "Home") this.home();
    else if (event.key === "Enter") this.fix([0.5, 0.5]);
    else if (event.key === "Escape") this.unpin();
    else return;
    event.preventDefault();
  }
}
