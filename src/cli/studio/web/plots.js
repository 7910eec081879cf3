// Curves as SVG, drawn from numbers; colours come from the style sheet.

const NS = "http://www.w3.org/2000/svg";

function node(tag, attributes = {}, ...children) {
  const made = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

const path = (points) => points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");

function frame(root) {
  const [width, height] = [Math.max(root.clientWidth, 120), Math.max(root.clientHeight, 90)];
  return { width, height, svg: node("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img" }) };
}

/** Albedo over the angle from both sides against the line 1. `rows`: `[degrees, [r, g, b]]`. */
export function albedo(root, data) {
  const { width, height, svg } = frame(root);
  const [left, right, top, bottom] = [26, 8, 8, 18];
  const rows = [...(data?.view ?? []), ...(data?.light ?? [])];
  const highest = Math.max(1.1, ...rows.flatMap(([, rgb]) => rgb));
  const most = highest > 1.1 ? highest * 1.05 : 1.1;
  const x = (degrees) => left + (degrees / 90) * (width - left - right);
  const y = (value) => height - bottom - (Math.min(value, most) / most) * (height - top - bottom);
  for (const degrees of [0, 30, 60, 90]) {
    svg.append(node("line", { class: "grid", x1: x(degrees), x2: x(degrees), y1: top, y2: height - bottom }));
    svg.append(node("text", { class: "label", x: x(degrees), y: height - 5, "text-anchor": degrees === 90 ? "end" : degrees ? "middle" : "start" }, `${degrees}°`));
  }
  const step = most > 4 ? Math.ceil(most / 4) : most > 2 ? 1 : 0.5;
  for (let value = 0; value <= most; value += step) {
    svg.append(node("text", { class: "label", x: left - 4, y: y(value) + 3, "text-anchor": "end" }, String(value)));
    if (value !== 1) svg.append(node("line", { class: "grid", x1: left, x2: width - right, y1: y(value), y2: y(value) }));
  }
  if (most > 1.11) svg.append(node("rect", { class: "over", x: left, y: top, width: width - left - right, height: y(1) - top }));
  svg.append(node("line", { class: "one", x1: left, x2: width - right, y1: y(1), y2: y(1) }));
  const gray = rows.every(([, [r, g, b]]) => Math.max(r, g, b) - Math.min(r, g, b) < 2e-3);
  for (const side of ["light", "view"]) {
    const points = data?.[side] ?? [];
    for (const c of gray ? [0] : [0, 1, 2]) {
      svg.append(node("path", { class: `curve ${side} ${gray ? "all" : "rgb"[c]}`, d: path(points.map(([a, rgb]) => [x(a), y(rgb[c])])) }));
    }
  }
  const worst = rows.reduce((w, [a, rgb]) => (Math.max(...rgb) > w[1] ? [a, Math.max(...rgb)] : w), [0, 0]);
  svg.append(node("title", {}, rows.length ? `Albedo by angle; largest ${worst[1].toFixed(4)} at ${worst[0]}°` : "Albedo by angle"));
  if (worst[1] > 1.0001) {
    svg.append(node("circle", { class: "worst", cx: x(worst[0]), cy: y(worst[1]), r: 3.5 }));
    const end = worst[0] > 45;
    svg.append(node("text", { class: "label worst", x: x(worst[0]) + (end ? -7 : 7), y: y(worst[1]) + 14, "text-anchor": end ? "end" : "start" }, worst[1].toFixed(3)));
  }
  root.replaceChildren(svg);
}

/** f·|cos| around the plane of incidence, the lobes within the total; ωo comes from the left. */
export function polar(root, data, colour) {
  const { width, height, svg } = frame(root);
  const through = data && [data.total, ...data.lobes.map((l) => l.points)].some((p) => p.some(([a, v]) => Math.abs(a) > 91 && v > 1e-4));
  const below = through || data?.deltas.some((d) => Math.abs(d.angle) > 90) ? 0.5 : 0.12;
  const room = { x: width / 2 - 10, up: (height - 14) * (1 - below), down: (height - 14) * below };
  const radius = Math.min(room.x, below > 0.3 ? Math.min(room.up, room.down) : room.up);
  const centre = { x: width / 2, y: 8 + room.up };
  const at = (degrees, r) => {
    const angle = (degrees * Math.PI) / 180;
    return [centre.x + Math.sin(angle) * r, centre.y - Math.cos(angle) * r];
  };
  svg.append(node("title", {}, data ? `Scattering of ${data.shader} seen from ${data.theta.toFixed(0)}°` : "Scattering"));
  for (const r of [0.25, 0.5, 0.75, 1]) {
    const arc = [];
    for (let a = below > 0.3 ? -180 : -90; a <= (below > 0.3 ? 180 : 90); a += 5) arc.push(at(a, radius * r));
    svg.append(node("path", { class: "grid", d: path(arc), fill: "none" }));
  }
  for (const a of [-60, -30, 0, 30, 60]) svg.append(node("path", { class: "grid", d: path([at(a, 0), at(a, radius)]) }));
  svg.append(node("line", { class: "surface", x1: centre.x - room.x, x2: centre.x + room.x, y1: centre.y, y2: centre.y }));
  if (!data) return root.replaceChildren(svg);
  const largest = Math.max(...data.total.map(([, v]) => v), 1e-6);
  // Peaks a thousand times as high as the rest would leave nothing else to see.
  const root3 = largest > 8;
  const scale = (v) => radius * 0.98 * (root3 ? Math.cbrt(Math.max(v, 0) / largest) : Math.max(v, 0) / largest);
  const outline = (points) => path(points.map(([a, v]) => at(a, scale(v)))) + "Z";
  svg.append(node("path", { class: "total", d: outline(data.total) }));
  data.lobes.forEach((lobe) => {
    const shape = node("path", { class: "lobe", d: outline(lobe.points) }, node("title", {}, lobe.lobe));
    shape.style.stroke = colour(lobe.lobe);
    shape.style.fill = colour(lobe.lobe);
    svg.append(shape);
  });
  for (const { angle, weight } of data.deltas) {
    const [x2, y2] = at(angle, radius * Math.min(1, Math.max(weight, 0.08)));
    svg.append(node("line", { class: "delta", x1: centre.x, y1: centre.y, x2, y2 }, node("title", {}, `mirror-like: ${weight.toFixed(3)}`)));
  }
  const [ox, oy] = at(-data.theta, radius);
  svg.append(node("line", { class: "eye", x1: centre.x, y1: centre.y, x2: ox, y2: oy }));
  svg.append(node("text", { class: "label eye", x: Math.max(ox - 4, 14), y: Math.max(oy + 2, 12), "text-anchor": "end" }, "ωo"));
  svg.append(node("text", { class: "label", x: width - 4, y: height - 4, "text-anchor": "end" }, `${root3 ? "∛ " : ""}max ${+largest.toPrecision(3)}`));
  root.replaceChildren(svg);
}
