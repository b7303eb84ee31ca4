// The stage: motions side by side or one over the other, and how they are looked at and played.
import * as THREE from "three";
import {button, checkbox, el, select} from "./dom";
import {type Character} from "./character";
import {duration, type Motion} from "./motion";
import {Pane, type Actor, type PaneOptions, type View} from "./pane";
import {Player} from "./player";
import {ink, onTheme} from "./theme";

export interface StagedClip {
  label: string;
  motion: Motion;
  character?: Character | null;
}

const TRAILS: Record<string, string[]> = {
  none: [],
  hands: ["left_hand", "right_hand"],
  feet: ["left_foot", "right_foot"],
  hips: ["hips"],
  all: ["left_hand", "right_hand", "left_foot", "right_foot", "hips"],
};

const VIEWS: Record<string, [number, number]> = {front: [0, 0.12], side: [Math.PI / 2, 0.12], top: [0, Math.PI / 2]};

/** True if the browser draws without a graphics card. */
const software = (() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? String(gl!.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
})();

export class Stage {
  readonly root: HTMLElement;
  readonly player = new Player();
  private readonly canvas = el("canvas", {
    tabindex: 0, role: "img", "aria-label": "The motion. Drag or arrows turn, wheel or plus and minus zoom, space plays.",
  });
  private readonly captions = el("div", {class: "captions"});
  private readonly renderer: THREE.WebGLRenderer;
  private readonly view: View = {yaw: 0.5, pitch: 0.15, zoom: 1, follow: true};
  private readonly options: PaneOptions = {skins: false, contacts: true, character: true, trails: []};
  private clips: StagedClip[] = [];
  private panes: Pane[] = [];
  /** Kept until their successors are drawn: these need the same shaders, which then stay compiled. */
  private retired: Pane[] = [];
  private overlaid = false;
  private sameMoment = true;
  private drawing = false;
  private readonly scrub = el("input", {type: "range", min: 0, max: 1, step: "any", value: 0, "aria-label": "Time, seconds", class: "scrub"});
  private readonly clock = el("output", {class: "clock", for: ""});
  private readonly playButton = button("Play", "Play or pause (space)", () => this.player.toggle());

  constructor() {
    // Smooth edges and fine pixels are for graphics cards; in software they cost most of the frames.
    this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, antialias: !software, powerPreference: "high-performance"});
    this.renderer.setPixelRatio(software ? 1 : Math.min(devicePixelRatio, 2));
    this.renderer.setScissorTest(true);
    this.root = el("section", {class: "stage", "aria-label": "Stage"},
                   el("div", {class: "screen"}, this.canvas, this.captions), this.controls());
    this.player.onTick(time => {
      this.scrub.value = String(time);
      this.clock.value = `${time.toFixed(2)} / ${this.player.duration.toFixed(2)} s`;
      this.draw();
    });
    this.player.onPlay(playing => this.playButton.textContent = playing ? "Pause" : "Play");
    this.scrub.addEventListener("input", () => this.player.seek(Number(this.scrub.value)));
    this.listenForTurning();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    onTheme(() => this.rebuild());
  }

  /** What is shown: an input, and its output if there is one. The moment that is shown stays. */
  setClips(clips: StagedClip[]): void {
    this.clips = clips;
    this.rebuild();
    const last = clips[clips.length - 1]?.motion;
    if (!last) return;
    const longest = this.pairs() ? duration(last) : Math.max(...clips.map(clip => duration(clip.motion)));
    this.scrub.max = String(longest);
    this.scrub.step = String(1 / last.rate);
    this.player.setExtent(longest, 1 / last.rate);
  }

  /** Keys that work wherever the focus is, but in fields that take them. */
  key(event: KeyboardEvent): boolean {
    const acts: Record<string, () => void> = {
      " ": () => this.player.toggle(),
      ",": () => this.player.frameStep(-1),
      ".": () => this.player.frameStep(1),
    };
    acts[event.key]?.();
    return event.key in acts;
  }

  /** Draws at the next chance, once however often it is asked for. */
  draw(): void {
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      this.render();
    });
  }

  /** True if the input shows the moment that the output has reached. */
  private pairs(): boolean {
    return this.sameMoment && this.clips.length === 2 && this.clips[1].motion.sourceFrames !== null;
  }

  private actor(clip: StagedClip, ghost: boolean): Actor {
    const {motion} = clip;
    const last = this.clips[this.clips.length - 1].motion;
    const own = (time: number) => Math.min(time * motion.rate, motion.frames - 1);
    const paired = (time: number) => {
      const frames = last.sourceFrames!;
      const at = Math.min(time * last.rate, frames.length - 1), a = Math.floor(at), b = Math.min(a + 1, frames.length - 1);
      return frames[a] + (at - a) * (frames[b] - frames[a]);
    };
    const follows = this.pairs() && clip === this.clips[0];
    return {motion, label: clip.label, character: clip.character ?? null, ghost, frameAt: follows ? paired : own};
  }

  private rebuild(): void {
    this.retired.push(...this.panes);
    this.renderer.setClearColor(ink("--panel"));
    const actors = this.clips.map((clip, n) => this.actor(clip, this.overlaid && n + 1 < this.clips.length));
    this.panes = actors.length === 0 ? [] : this.overlaid ? [new Pane(actors, this.options)]
                                                          : actors.map(actor => new Pane([actor], this.options));
    this.captions.replaceChildren(...this.panes.map(
      pane => el("span", {}, pane.actors.map(actor => actor.label).join("  over  "))));
    this.draw();
  }

  private render(): void {
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (width === 0 || height === 0) return;
    const size = this.renderer.getSize(new THREE.Vector2());
    // To set a size empties the canvas, even if it stays the same.
    if (size.x !== width || size.y !== height) this.renderer.setSize(width, height, false);
    const each = width / Math.max(1, this.panes.length);
    this.renderer.setScissor(0, 0, width, height);
    this.renderer.clear();
    this.panes.forEach((pane, n) => {
      pane.show(this.player.time, this.view, each / height);
      this.renderer.setViewport(n * each, 0, each, height);
      this.renderer.setScissor(n * each, 0, each, height);
      this.renderer.render(pane.scene, pane.camera);
    });
    for (const pane of this.retired.splice(0)) pane.dispose();
  }

  private controls(): HTMLElement {
    const look = (name: string) => button(name[0].toUpperCase() + name.slice(1), `Look from the ${name}`, () => {
      [this.view.yaw, this.view.pitch] = VIEWS[name];
      this.draw();
    });
    const option = (label: string, checked: boolean, act: (checked: boolean) => void) => checkbox(label, checked, on => {
      act(on);
      this.setClips(this.clips);
    }).root;
    return el("div", {class: "controls"},
      this.scrub,
      el("div", {class: "bar"},
        this.playButton,
        button("\u25C2", "One frame back (,)", () => this.player.frameStep(-1)),
        button("\u25B8", "One frame on (.)", () => this.player.frameStep(1)),
        this.clock,
        select("Speed", ["0.1", "0.25", "0.5", "1", "2"].map(value => ({value, label: value})), "1",
               value => this.player.speed = Number(value)).root,
        checkbox("Loop", true, on => this.player.loop = on).root,
        checkbox("Follow", true, on => {
          this.view.follow = on;
          this.draw();
        }).root,
        look("front"), look("side"), look("top")),
      el("div", {class: "bar"},
        option("Overlaid", false, on => this.overlaid = on),
        option("Same moment", true, on => this.sameMoment = on),
        option("Onion skins", false, on => this.options.skins = on),
        option("Contacts", true, on => this.options.contacts = on),
        option("Character", true, on => this.options.character = on),
        select("Trails", Object.keys(TRAILS).map(value => ({value, label: value})), "none", value => {
          this.options.trails = TRAILS[value];
          this.rebuild();
        }).root));
  }

  private turn(yaw: number, pitch: number): void {
    this.view.yaw += yaw;
    this.view.pitch = Math.max(-0.3, Math.min(this.view.pitch + pitch, Math.PI / 2));
    this.draw();
  }
  private zoomBy(factor: number): void {
    this.view.zoom = Math.max(0.2, Math.min(this.view.zoom * factor, 8));
    this.draw();
  }

  private listenForTurning(): void {
    let held: {x: number; y: number} | null = null;
    this.canvas.addEventListener("pointerdown", event => {
      held = {x: event.clientX, y: event.clientY};
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", event => {
      if (!held) return;
      this.turn(-0.008 * (event.clientX - held.x), 0.008 * (event.clientY - held.y));
      held = {x: event.clientX, y: event.clientY};
    });
    this.canvas.addEventListener("pointerup", () => held = null);
    this.canvas.addEventListener("pointercancel", () => held = null);
    this.canvas.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoomBy(Math.exp(-0.001 * event.deltaY));
    }, {passive: false});
    this.canvas.addEventListener("keydown", event => {
      const acts: Record<string, () => void> = {
        ArrowLeft: () => this.turn(-0.1, 0), ArrowRight: () => this.turn(0.1, 0),
        ArrowUp: () => this.turn(0, 0.1), ArrowDown: () => this.turn(0, -0.1),
        "+": () => this.zoomBy(1.1), "-": () => this.zoomBy(1 / 1.1),
      };
      if (!(event.key in acts)) return;
      acts[event.key]();
      event.preventDefault();
    });
  }
}
