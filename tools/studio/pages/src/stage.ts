// The stage: motions side by side or one over the other, and how they are looked at and played.
import * as THREE from "three";
import {type Character} from "./character";
import {button, checkbox, el, select} from "./dom";
import {follow} from "./drag";
import {duration, type Motion} from "./motion";
import {Pane, type Actor, type PaneOptions, type View} from "./pane";
import {JointHandles, type JointHandlesUse} from "./joint_handles";
import {Player} from "./player";
import {ink, onTheme} from "./theme";

export interface StagedClip {
  label: string;
  motion: Motion;
  character?: Character | null;
  /** Begins again while a longer clip beside it plays on; otherwise its end stays. */
  repeats?: boolean;
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

/** Pixels drawn for each of the page's: fewer while playing would fall below 30 frames a second. */
class Fineness {
  private share = 1;
  private last = 0;
  private slow = 0;

  constructor(private readonly full: number) {}

  next(playing: boolean): number {
    const now = performance.now();
    const took = now - this.last;
    this.last = now;
    if (!playing) return this.full;
    // Eight frames that are late in a row, not a single one that something else held up.
    this.slow = took > 31 && took < 500 ? this.slow + 1 : 0;
    if (this.slow >= 8 && this.share > 0.5) {
      this.share = Math.max(0.5, 0.8 * this.share);
      this.slow = 0;
    }
    return this.full * this.share;
  }
}

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
  private readonly fineness = new Fineness(software ? 1 : Math.min(devicePixelRatio, 2));
  private overlaid = false;
  private sameMoment = true;
  private drawing = false;
  private readonly scrub = el("input", {type: "range", min: 0, max: 1, step: "any", value: 0, "aria-label": "Time, seconds", class: "scrub"});
  private readonly clock = el("span", {class: "clock", role: "timer"});
  private told = 0;
  private readonly playButton = button("Play", "Play or pause (space)", () => this.player.toggle());

  private readonly handles: JointHandles | null;

  /** @param handles  joints that can be dragged while nothing plays. */
  constructor(handles?: JointHandlesUse) {
    this.handles = handles ? new JointHandles(handles) : null;
    // Smooth edges and fine pixels are for graphics cards; in software they cost most of the frames. So
    // does a canvas that may be seen through.
    const context = this.canvas.getContext("webgl2", {alpha: false, antialias: !software, powerPreference: "high-performance"});
    if (context === null) throw new Error("this browser has no WebGL 2, which the stage is drawn with");
    this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, context});
    this.renderer.setScissorTest(true);
    this.root = el("section", {class: "stage", "aria-label": "Stage"},
                   el("div", {class: "screen"}, this.canvas, this.captions, this.handles?.root ?? ""), this.controls());
    this.player.onTick(() => {
      this.draw();
      // Text that changes is laid out and painted: ten times a second are enough to be read.
      const now = performance.now();
      if (this.player.playing && now - this.told < 100) return;
      this.told = now;
      this.showTime();
    });
    this.player.onPlay(playing => {
      this.draw();
      this.playButton.textContent = playing ? "Pause" : "Play";
      this.showTime();
    });
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

  /** Calls back once, in the frame after the one in which what is shown now has been drawn. */
  afterDrawing(act: () => void): void {
    this.canvas.addEventListener("drawn", () => requestAnimationFrame(act), {once: true});
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

  private showTime(): void {
    const {time, duration: end} = this.player;
    this.scrub.value = String(time);
    this.clock.textContent = `${time.toFixed(2)} / ${end.toFixed(2)} s`;
  }

  /** True if the input shows the moment that the output has reached. */
  private pairs(): boolean {
    return this.sameMoment && this.clips.length === 2 && this.clips[1].motion.sourceFrames !== null;
  }

  private actor(clip: StagedClip, ghost: boolean): Actor {
    const {motion} = clip;
    const last = this.clips[this.clips.length - 1].motion;
    const own = (time: number) => clip.repeats ? time * motion.rate % motion.frames : Math.min(time * motion.rate, motion.frames - 1);
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
    const fineness = this.fineness.next(this.player.playing);
    const size = this.renderer.getSize(new THREE.Vector2());
    // To set a size empties the canvas, even if it stays the same.
    if (size.x !== width || size.y !== height || this.renderer.getPixelRatio() !== fineness) {
      this.renderer.setPixelRatio(fineness);
      this.renderer.setSize(width, height, false);
    }
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
    this.handles?.place(this.panes[this.panes.length - 1], (this.panes.length - 1) * each, each, height, this.player.playing);
    // What shows a moment's figures may wait for its pose.
    this.canvas.dispatchEvent(new Event("drawn"));
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
    this.canvas.addEventListener("pointerdown", event => {
      const {yaw, pitch} = this.view;
      let last = event;
      follow(this.canvas, event, {
        moved: next => {
          this.turn(-0.008 * (next.clientX - last.clientX), 0.008 * (next.clientY - last.clientY));
          last = next;
        },
        dropped: () => undefined,
        givenUp: () => this.turn(yaw - this.view.yaw, pitch - this.view.pitch),
      });
    });
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
