// Runs the script of an animated preview without a browser, and draws what it draws as SVG.
//
//   node animation_page.mjs PAGE.html PREFIX [SECONDS..]
//
// Writes PREFIX-N.svg for each time (default: the beginning, the middle, the end), all views side by
// side. Fails if the script does, if a key or control does not do what it says, or if a figure is
// drawn out of the picture or without any volume.
import assert from "node:assert";
import fs from "node:fs";
import vm from "node:vm";

const [page_path, prefix, ...times] = process.argv.slice(2);
const page = fs.readFileSync(page_path, "utf8");
const width = 640, height = 480;

class Gradient {
  stops = [];
  addColorStop(at, color) { this.stops.push([at, color]); }
}

/// As much of CanvasRenderingContext2D as the page uses, written down as SVG.
class Context {
  shapes = []; paths = []; transform = []; globalAlpha = 1; lineWidth = 1; fillStyle = "#000"; strokeStyle = "#000";
  lineCap = "butt";
  setTransform(...matrix) { this.transform = matrix; }
  clearRect() { this.shapes = []; }
  fillRect(x, y, w, h) {
    this.shapes.push(`<rect x="${x}" y="${y}" width="${w}" height="${h}" fill="${this.fillStyle}"/>`);
  }
  beginPath() { this.path = ""; }
  moveTo(x, y) { this.path += `M${x} ${y}`; }
  lineTo(x, y) { this.path += `L${x} ${y}`; }
  closePath() { this.path += "Z"; }
  arc(x, y, r, from, to) {
    assert(r >= 0 && Number.isFinite(x + y + r + from + to), "an arc that is none");
    const n = 24;
    for (let k = 0; k <= n; ++k) {
      const turn = from + (to - from) * k / n;
      this.path += `${this.path ? "L" : "M"}${x + r * Math.cos(turn)} ${y + r * Math.sin(turn)}`;
    }
  }
  paint(style) {
    if (!(style instanceof Gradient)) return style;
    for (const [at] of style.stops) assert(at >= 0 && at <= 1);
    return style.stops[1][1];
  }
  fill() {
    assert(!this.path.includes("NaN"));
    const style = this.fillStyle;
    let paint = this.paint(style);
    if (style instanceof Gradient) {
      const id = `g${Context.count++}`;
      Context.defs.push(style.tag.replace("ID", id) + style.stops.map(([at, color]) =>
        `<stop offset="${at}" stop-color="${color}"/>`).join("") + style.close);
      paint = `url(#${id})`;
    }
    this.shapes.push(`<path d="${this.path}" fill="${paint}" opacity="${this.globalAlpha}"/>`);
  }
  stroke() {
    assert(!this.path.includes("NaN"));
    this.shapes.push(`<path d="${this.path}" fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}" ` +
                     `stroke-linecap="${this.lineCap}" opacity="${this.globalAlpha}"/>`);
  }
  createLinearGradient(x1, y1, x2, y2) {
    return Object.assign(new Gradient(), {close: "</linearGradient>",
      tag: `<linearGradient id="ID" gradientUnits="userSpaceOnUse" x1="${x1}" y1="${y1}" x2="${x2}" y2="${y2}">`});
  }
  createRadialGradient(fx, fy, fr, x, y, r) {
    return Object.assign(new Gradient(), {close: "</radialGradient>",
      tag: `<radialGradient id="ID" gradientUnits="userSpaceOnUse" fx="${fx}" fy="${fy}" cx="${x}" cy="${y}" r="${r}">`});
  }
  static count = 0;
  static defs = [];
}

class Element {
  style = {}; listeners = {}; children = []; attributes = {}; value = ""; checked = true; selectedIndex = 1;
  constructor(tag, text = "") { this.tagName = tag.toUpperCase(); this.textContent = text; }
  append(...items) { this.children.push(...items); }
  setAttribute(name, value) { this.attributes[name] = value; }
  addEventListener(type, listener) { this.listeners[type] = listener; }
  setPointerCapture() {}
  getBoundingClientRect() { return {width, height}; }
  getContext() { return this.context ??= new Context(); }
}

// The page's own colours, light scheme.
const colors = Object.fromEntries([...page.matchAll(/--(\w+): (#\w+)/g)].reverse().map(([, name, color]) => [name, color]));
const elements = new Map();
for (const [, tag, id] of page.matchAll(/<(\w+)[^>]*? id="(\w+)"/g)) elements.set(id, new Element(tag));
elements.get("data").textContent = page.match(/id="data">(.*?)<\/script>/s)[1];
elements.get("trails").value = "1";
let next_frame = null;
const document = new Element("document");
Object.assign(document, {documentElement: {}, createElement: tag => new Element(tag), getElementById: id => {
  assert(elements.has(id), `no element ${id}`);
  return elements.get(id);
}});
const window = new Element("window");
window.devicePixelRatio = 1;
vm.runInNewContext(page.match(/<script>(.*?)<\/script>/s)[1], {
  document, window, atob, console,
  getComputedStyle: () => ({getPropertyValue: name => colors[name.slice(2)]}),
  matchMedia: () => ({matches: false, addEventListener() {}}),
  requestAnimationFrame: callback => { next_frame = callback; }});
const preview = window.preview;
const canvases = elements.get("views").children.map(figure => figure.children[0]);
assert.strictEqual(canvases.length, preview.clips.length);

// It plays by itself, at the speed of the clock, and stops at the space bar.
assert(preview.state.playing);
next_frame(1000);
next_frame(1100);
assert(Math.abs(preview.state.time - 0.1) < 1e-9, `0.1 s on: ${preview.state.time}`);
const press = (key, more = {}) =>
  document.listeners.keydown({key, target: document, preventDefault() {}, ...more});
press(" ");
assert(!preview.state.playing);
press("Home");
press(".");
const last = preview.clips.at(-1);
assert(Math.abs(preview.state.time - 1 / last.rate) < 1e-9);
press(",");
assert.strictEqual(preview.state.time, 0);
press("End");
assert.strictEqual(preview.state.time, preview.end());
press("l");
assert(!preview.state.loop && !elements.get("loop").checked);
press("ArrowLeft", {shiftKey: true});
assert.notStrictEqual(preview.state.yaw, 0);
const turned = preview.state.yaw;
canvases[0].listeners.pointerdown({pointerId: 1, clientX: 10, clientY: 10});
canvases[0].listeners.pointermove({pointerId: 1, clientX: 40, clientY: 10});
assert(preview.state.yaw < turned);
press("0");
assert.strictEqual(preview.state.yaw, 0);
elements.get("scrub").oninput({target: {value: "0.5"}});
assert.strictEqual(preview.state.time, Math.min(0.5, preview.end()));
if (preview.data.moments) {
  // Paired, the first clip shows the moment that the last has reached.
  const middle = Math.floor(preview.data.moments.length / 2);
  const frame = preview.frameAt(preview.clips[0], middle / last.rate);
  assert(Math.abs(frame / preview.clips[0].rate - preview.data.moments[middle]) < 1e-4);
}

// Every figure stands within its view, seen from all around, and is drawn with volume.
for (let time = 0; time <= preview.end(); time += preview.end() / 20 || 1) {
  for (const yaw of [0, 2, 4]) {
    preview.state.yaw = yaw;
    preview.seek(time);
    for (const clip of preview.clips) {
      const frame = preview.frameAt(clip, time), p = preview.nodesAt(clip, frame);
      const c = preview.cameraOf(clip, frame, width, height);
      for (const limb of clip.limbs) {
        for (const [node] of limb.bones) {
          const [x, y, scale] = preview.project(c, p[3 * node], p[3 * node + 1], p[3 * node + 2]);
          assert(scale > 0 && x > 0 && x < width && y > 0 && y < height, `${clip.title} at ${time} s: ${x}, ${y}`);
        }
      }
    }
  }
}
preview.state.yaw = 0;

times.push(...(times.length ? [] : [0, preview.end() / 2, preview.end()]));
times.forEach((time, n) => {
  Context.defs = [];
  for (const canvas of canvases) canvas.context = new Context();
  preview.seek(Number(time));
  const views = canvases.map((canvas, v) => {
    const gradients = canvas.context.shapes.filter(shape => shape.includes("url(#")).length;
    assert(gradients > 5, "no volume");
    return `<svg x="${v * (width + 4)}" width="${width}" height="${height}">${canvas.context.shapes.join("\n")}</svg>`;
  });
  fs.writeFileSync(`${prefix}-${n}.svg`, `<svg xmlns="http://www.w3.org/2000/svg" width="${canvases.length * (width + 4)}" ` +
    `height="${height + 40}"><defs>${Context.defs.join("\n")}</defs>${views.join("\n")}` +
    `<svg y="${height + 8}">${elements.get("rows").context.shapes.join("\n")}</svg></svg>\n`);
});
console.log(`ok: ${preview.clips.length} clips, ${times.length} pictures`);
