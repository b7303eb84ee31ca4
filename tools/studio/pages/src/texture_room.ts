// The texture room: a path of textons on a timeline, what follows what, poses pinned by dragging, play without end.
import {getJson, postJson, postMotion} from "./api";
import {button, el} from "./dom";
import {Fields, type Field} from "./fields";
import {jointName, type HeldJoint, type Place} from "./joint_handles";
import {Latest} from "./latest";
import {joined, Pose, type Motion} from "./motion";
import {Stage} from "./stage";
import {StateRoom} from "./state_room";
import {StateTools} from "./state_tools";
import type {Studio} from "./studio";
import {TextonGraph, type Transition} from "./texton_graph";
import {TextonLine} from "./texton_line";
import {TextonMatrix} from "./texton_matrix";
import {TextonTable, type TextonTotals} from "./texton_table";

interface Pin {
  frame: number;
  joint: string;
  /** Metres, from the hips and in their axes; of the hips, from where they would be. */
  place: Place;
}

interface Block {
  texton: number;
  /** null: as long as captured. */
  frames: number | null;
  pins: Pin[];
}

/** What the texture room is set to; `laban texture synthesize --state` takes it as a file. */
interface TextureState {
  schema: string;
  texture: string;
  textons: Block[];
  noise: number;
  variation: number;
  seed: number;
  foot_fix: boolean;
}

interface OpenedTexture {
  name: string;
  frame_rate_hz: number;
  textons: TextonTotals[];
  transitions: Transition[];
  state: TextureState;
}

interface Part {
  texton: number;
  begin_frame: number;
  end_frame: number;
  jump: boolean;
}

interface FoundPath {
  path: number[] | null;
  cost_nats: number | null;
}

/** What can be pinned. */
const JOINTS = ["hips", "head", ...["left", "right"].flatMap(side => ["forearm", "hand", "shin", "foot"].map(part => `${side}_${part}`))];
/** Frames where two textons meet, which stay as they are. */
const MEETING = 2;
/** Beyond this many of its deviations a texton is spoilt. */
const SPOILT = 3;

const block = (texton: number): Block => ({texton, frames: null, pins: []});

/** The first and the last frame at which a block of so many frames can be pinned. */
const pinnable = (n: number, blocks: number, frames: number): [number, number] =>
  [n === 0 ? 0 : MEETING, frames - 1 - (n + 1 === blocks ? 0 : MEETING)];

/** Moves pins from where blocks meet to the nearest frame that can be pinned; drops those beyond their block. */
function keepPinnable(blocks: Block[]): void {
  blocks.forEach((one, n) => {
    const {frames} = one;
    if (frames === null) return;
    const [first, last] = pinnable(n, blocks.length, frames), pins = new Map<string, Pin>();
    for (const pin of one.pins.filter(({frame}) => frame < frames && first <= last)) {
      const frame = Math.max(first, Math.min(pin.frame, last));
      pins.set(`${frame} ${pin.joint}`, {...pin, frame});
    }
    one.pins = [...pins.values()];
  });
}

export class TextureRoom extends StateRoom<TextureState> {
  readonly id = "texture";
  readonly title = "Texture";
  protected readonly stage = new Stage({parts: JOINTS, hold: part => this.hold(part)});
  protected readonly tools: StateTools<TextureState>;
  private readonly line: TextonLine;
  private readonly fields: Field<TextureState>[];
  private readonly told = el("p", {class: "quality", "aria-live": "polite"});
  private readonly cautions = el("ul", {class: "cautions", "aria-live": "polite"});
  private readonly pins = el("ul", {class: "pins", "aria-label": "Pins"});
  private readonly found = el("div", {class: "bar found"});
  private readonly chosenField = el("input", {type: "number", min: 0, step: 1, value: 0, "aria-label": "Texton that is looked at"});
  private readonly pathFrom = el("input", {type: "number", min: 0, step: 1, value: 0, "aria-label": "Path from texton"});
  private readonly pathTo = el("input", {type: "number", min: 0, step: 1, value: 0, "aria-label": "Path to texton"});
  private readonly pathLength = el("input", {type: "number", min: 1, max: 1000, step: 1, placeholder: "any", "aria-label": "Textons of the path"});
  private readonly endless = button("Play on and on", "A random walk with this noise and seed, without end", () => void this.toggleWalk());
  private readonly making = new Latest<{state: TextureState; draft: boolean}>(asked => this.studio.attempt(() => this.make(asked)));
  private graph: TextonGraph | null = null;
  private readonly all = el("div", {class: "all-textons"});
  private opened: OpenedTexture | null = null;
  private made: Motion | null = null;
  private parts: Part[] = [];
  private selected: number | null = null;
  private texton = 0;
  /** A walk or a single texton is on the stage, not the path. */
  private away = false;
  private walk: {pieces: Motion[]; next: number; asking: boolean} | null = null;

  constructor(private readonly studio: Studio) {
    super();
    this.tools = new StateTools<TextureState>(studio, {
      schema: "laban.texture-room/1",
      verb: "laban texture synthesize",
      changed: state => this.changed(state),
      checked: "/api/texture/state",
      exported: {path: "/api/texture/export", body: state => ({state})},
      // The texture is the one that is open here, whatever its path was where the state was saved.
      adopted: (saved, {texture}) => ({...saved, texture}),
    });
    this.line = new TextonLine({
      choose: n => this.choose(n),
      move: (n, to) => this.edit(blocks => blocks.splice(to, 0, ...blocks.splice(n, 1)), to),
      stretch: (n, frames) => this.edit(blocks => {
        blocks[n].frames = Math.max(5, frames);
      }, n, `stretch ${n}`),
      repeat: n => this.edit(blocks => blocks.splice(n + 1, 0, structuredClone(blocks[n])), n + 1),
      remove: n => this.edit(blocks => {
        if (blocks.length > 1) blocks.splice(n, 1);
      }, Math.max(0, n - 1)),
      bridge: n => void this.bridge(n),
    });
    const fields = new Fields<TextureState>((edit, kind) => this.tools.change(edit, kind), edit => this.draft(edit));
    const seed = fields.number("Seed", [0, 1000000, 1], state => state.seed, (state, value) => state.seed = value);
    const again = el("span", {class: "bar"}, seed.root, button("Draw again", "The next seed", () => this.tools.change(state => state.seed = (state.seed + 1) % 1000001)));
    this.fields = [
      fields.range("Noise", [0, 2, 0.05], state => state.noise, (state, value) => state.noise = value),
      fields.range("Variation", [0, 1, 0.05], state => state.variation, (state, value) => state.variation = value),
      {root: again, show: seed.show},
      fields.flag("Hold feet", state => state.foot_fix, (state, on) => state.foot_fix = on),
    ];
    this.stage.player.onTick(time => this.tick(time));
    this.chosenField.addEventListener("change", () => this.look(Number(this.chosenField.value)));
  }

  async enter(host: HTMLElement): Promise<void> {
    if (this.opened === null) await this.openTexture();
    if (!host.isConnected) return;
    host.append(el("div", {class: "room effort-room texture-room"},
      el("div", {class: "left"}, this.stage.root, this.line.root,
         el("div", {class: "bar below"}, this.blockButtons(), this.endless),
         el("p", {class: "hint"}, "Drag blocks to move them, their right edge to stretch. Keys: Alt+arrows move, + and \u2212 stretch, D repeats, Delete removes. " +
            "While paused, drag a joint to pin it at this frame; Escape lets it go.")),
      el("aside", {class: "right"}, this.tools.root,
         el("section", {class: "options", "aria-label": "Motion"}, ...this.fields.map(field => field.root)),
         this.told, this.cautions, this.pins,
         el("section", {class: "look", "aria-label": "Transitions"},
            el("div", {class: "bar"}, el("label", {class: "field"}, "Texton", this.chosenField),
               button("Insert", "Insert it after the chosen block", () => this.insert([this.texton])),
               button("Preview", "Play it once, as captured", () => void this.preview())),
            this.graph!.root,
            el("div", {class: "bar"}, el("span", {}, "Cheapest path"), this.pathFrom, "to", this.pathTo, "of", this.pathLength, "textons",
               button("Find", "Find the cheapest path of transitions", () => void this.findPath())),
            this.found, this.all))));
    this.stage.draw();
  }

  private async openTexture(): Promise<void> {
    const opened = this.opened = await getJson<OpenedTexture>("/api/texture");
    this.graph = new TextonGraph(opened.transitions, texton => this.look(texton));
    const folded = (label: string, ...inside: HTMLElement[]) => el("details", {}, el("summary", {}, label), ...inside);
    this.all.append(
      folded(`All ${opened.textons.length} textons`, new TextonTable(opened.textons, texton => {
        this.look(texton);
        void this.preview();
      }).root),
      folded("All transitions", new TextonMatrix(opened.textons.length, opened.transitions, (from, to) => {
        this.look(to);
        this.pathFrom.value = String(from);
      }).root));
    for (const input of [this.chosenField, this.pathFrom, this.pathTo]) input.max = String(opened.textons.length - 1);
    this.look(opened.state.textons[0].texton);
    this.tools.begin(opened.state);
  }

  private draft(edit: (state: TextureState) => void): void {
    const {state} = this.tools;
    edit(state);
    this.making.ask({state, draft: true});
  }

  private blockButtons(): HTMLElement {
    const of = (label: string, title: string, act: (n: number) => void) => button(label, title, () => act(this.selected ?? 0));
    return el("span", {class: "bar", role: "group", "aria-label": "The chosen block"},
      of("Repeat", "The chosen block once more (D)", n => this.edit(blocks => blocks.splice(n + 1, 0, structuredClone(blocks[n])), n + 1)),
      of("Delete", "Remove the chosen block (Delete)", n => this.edit(blocks => {
        if (blocks.length > 1) blocks.splice(n, 1);
      }, Math.max(0, n - 1))),
      of("As captured", "As long as it was captured; its pins go", n => this.edit(blocks => blocks[n] = block(blocks[n].texton), n)),
      of("Bridge", "Put the cheapest path between the chosen block and the next", n => void this.bridge(n)));
  }

  private edit(change: (blocks: Block[]) => void, selected: number, kind = ""): void {
    this.selected = selected;
    this.tools.change(state => {
      change(state.textons);
      keepPinnable(state.textons);
    }, kind);
  }

  private changed(state: TextureState): void {
    for (const field of this.fields) field.show(state);
    this.stopWalk();
    this.making.ask({state, draft: false});
  }

  private async make(asked: {state: TextureState; draft: boolean}): Promise<void> {
    const {state} = asked, made = await postMotion("/api/texture/make", asked);
    this.made = made;
    this.parts = made.header["parts"] as Part[];
    if (this.walk === null) this.stagePath(made);
    this.showLine(state);
    this.showPins(state);
    this.showTold(made);
    this.tick(this.stage.player.time);
  }

  private stagePath(made: Motion): void {
    this.away = false;
    this.stage.setClips([{label: this.opened!.name, motion: made}]);
  }

  /** The path on the stage again. */
  private backToPath(): void {
    this.stopWalk();
    if (this.away) this.stagePath(this.made!);
  }

  private showLine(state: TextureState): void {
    this.selected = this.selected === null ? null : Math.min(this.selected, state.textons.length - 1);
    this.line.show(this.parts.map((part, n) => ({
      texton: part.texton,
      frames: part.end_frame - part.begin_frame,
      next: n + 1 === this.parts.length ? undefined : this.graph!.likelihood(part.texton, this.parts[n + 1].texton),
      pins: state.textons[n]?.pins.length ?? 0,
    })), this.selected);
  }

  private showTold(made: Motion): void {
    const quality = made.header["quality"] as {foot_skate_cm: number} | null;
    this.told.textContent = `${this.parts.length} textons, ${made.frames} frames, ${(made.frames / made.rate).toFixed(1)} s.` +
      (quality === null ? "" : ` Foot skate ${quality.foot_skate_cm.toFixed(2)} cm a frame.`);
    const never = this.parts.filter(part => part.jump).length;
    const pinned = made.header["pinned"] as {part: number; state_deviations: number; residual_deviations: number}[];
    const lines = never === 0 ? [] : [`${never} ${never === 1 ? "time" : "times"} the captures never go from a texton to the next; bridge them, or expect a turn that nobody danced.`];
    for (const one of pinned) {
      const most = Math.max(one.state_deviations, one.residual_deviations);
      lines.push(`Block ${one.part + 1}: its pins lie ${most.toFixed(1)} deviations from what texton ${this.parts[one.part].texton} does` +
                 (most > SPOILT ? "; beyond 3 it is spoilt." : "."));
    }
    this.cautions.replaceChildren(...lines.map(line => el("li", {}, line)));
  }

  private showPins(state: TextureState): void {
    this.pins.replaceChildren(...state.textons.flatMap((one, n) => one.pins.map((pin, p) => {
      const name = `block ${n + 1}, frame ${pin.frame}, ${jointName(pin.joint)}`;
      return el("li", {}, `Pin: ${name} `,
        button("Go", `Show ${name}`, () => {
          this.backToPath();
          this.stage.player.pause();
          this.stage.player.seek((this.parts[n].begin_frame + pin.frame) / this.made!.rate);
        }),
        button("Remove", `Remove the pin of ${name}`, () => this.tools.change(now => now.textons[n].pins.splice(p, 1))));
    })));
  }

  private choose(n: number): void {
    this.selected = n;
    this.look(this.parts[n].texton);
    this.backToPath();
    this.showLine(this.tools.state);
    this.stage.player.seek(this.parts[n].begin_frame / this.made!.rate);
  }

  /** Shows what comes before and after a texton. */
  private look(texton: number): void {
    this.texton = Math.max(0, Math.min(Math.round(texton) || 0, this.opened!.textons.length - 1));
    this.chosenField.value = String(this.texton);
    if (this.selected !== null && this.parts[this.selected]) this.pathFrom.value = String(this.parts[this.selected].texton);
    this.pathTo.value = String(this.texton);
    this.graph!.show(this.texton);
  }

  private insert(textons: number[]): void {
    const at = this.selected === null ? this.tools.state.textons.length : this.selected + 1;
    this.edit(blocks => blocks.splice(at, 0, ...textons.map(block)), at + textons.length - 1);
  }

  private async preview(): Promise<void> {
    await this.studio.attempt(async () => {
      const motion = await postMotion("/api/texture/make", {state: {...this.tools.state, textons: [block(this.texton)], noise: 1, variation: 0}});
      this.stopWalk();
      this.away = true;
      this.stage.setClips([{label: `texton ${this.texton}`, motion}]);
      this.stage.player.seek(0);
      this.stage.player.play();
    });
  }

  private path(asked: {from: number; to: number; length?: number | null; bridge?: boolean}): Promise<FoundPath> {
    return postJson<FoundPath>("/api/texture/path", asked);
  }

  private async findPath(): Promise<void> {
    await this.studio.attempt(async () => {
      const length = this.pathLength.value === "" ? null : Number(this.pathLength.value);
      const {path, cost_nats} = await this.path({from: Number(this.pathFrom.value), to: Number(this.pathTo.value), length});
      this.found.replaceChildren(...path === null
        ? [el("span", {class: "path-told"}, "No path: the captures do not lead there.")]
        : [el("span", {class: "path-told"}, `${path.join(" \u2192 ")}, ${(cost_nats ?? 0).toFixed(2)} nats`),
           button("Play it", "The path instead of all that is there", () => this.edit(blocks => blocks.splice(0, blocks.length, ...path.map(block)), 0)),
           button("Insert it", "After the chosen block", () => this.insert(path))]);
    });
  }

  private async bridge(n: number): Promise<void> {
    await this.studio.attempt(async () => {
      const {textons} = this.tools.state;
      if (n + 1 >= textons.length) throw new Error("the last block has nothing after it to be bridged to");
      const {path} = await this.path({from: textons[n].texton, to: textons[n + 1].texton, bridge: true});
      if (path === null) throw new Error(`the captures lead from texton ${textons[n].texton} to ${textons[n + 1].texton} by no way`);
      this.edit(blocks => blocks.splice(n + 1, 0, ...path.slice(1, -1).map(block)), n);
    });
  }

  /** A joint that is dragged is pinned at the frame that is shown. */
  private hold(part: string): HeldJoint | null {
    const motion = this.made;
    if (this.away || motion === null) return null;
    const frame = Math.min(Math.round(this.stage.player.time * motion.rate), motion.frames - 1);
    const n = this.parts.findIndex(one => frame >= one.begin_frame && frame < one.end_frame);
    const {begin_frame, end_frame} = this.parts[n], frames = end_frame - begin_frame;
    const [first, last] = pinnable(n, this.parts.length, frames);
    const at = Math.max(first, Math.min(frame - begin_frame, last));
    const pose = new Pose(motion).set(frame);
    const hips = motion.joints.findIndex(joint => joint.part === "hips");
    // Hips that are pinned already are shown where their pin has moved them.
    const before = part === "hips" ? this.tools.state.textons[n].pins.find(pin => pin.frame === at && pin.joint === part)?.place : undefined;
    const pinned = (place: Place) => (state: TextureState) => {
      const local = pose.local(hips, place).map((value, k) => Math.round(1e4 * (value + (before?.[k] ?? 0))) / 1e4) as Place;
      const one = state.textons[n];
      // A pin is at a frame of a block, which then keeps its length whatever is drawn.
      one.frames ??= frames;
      one.pins = [...one.pins.filter(pin => pin.frame !== at || pin.joint !== part), {frame: at, joint: part, place: local}]
                     .sort((a, b) => a.frame - b.frame);
    };
    return {
      moved: place => this.draft(pinned(place)),
      dropped: place => void this.tools.change(pinned(place)),
      givenUp: () => this.making.ask({state: this.tools.state, draft: false}),
    };
  }

  private tick(time: number): void {
    if (this.walk !== null) return void this.goOn(time);
    if (this.made !== null && !this.away) this.line.at(Math.round(time * this.made.rate));
  }

  private async toggleWalk(): Promise<void> {
    if (this.walk !== null) return this.backToPath();
    await this.studio.attempt(async () => {
      const walk = {pieces: [] as Motion[], next: 0, asking: false};
      for (let n = 0; n < 2; ++n) walk.pieces.push(await this.piece(walk.next++));
      this.walk = walk;
      this.away = true;
      this.endless.textContent = "Back to the path";
      this.showWalk(0);
      this.stage.player.loop = false;
      this.stage.player.play();
    });
  }

  private stopWalk(): void {
    if (this.walk === null) return;
    this.walk = null;
    this.endless.textContent = "Play on and on";
    this.stage.player.loop = true;
    this.stage.player.pause();
  }

  private piece(n: number): Promise<Motion> {
    return postMotion("/api/texture/walk", {state: this.tools.state, piece: n});
  }

  private showWalk(time: number): void {
    const [a, b] = this.walk!.pieces;
    this.stage.setClips([{label: "without end", motion: joined(a, b)}]);
    this.stage.player.seek(time);
  }

  /** Drops the piece that has passed, and asks for the one after the next. */
  private async goOn(time: number): Promise<void> {
    const walk = this.walk!, [a] = walk.pieces, end = a.frames / a.rate;
    if (time < end || walk.asking) return;
    walk.asking = true;
    await this.studio.attempt(async () => {
      const next = await this.piece(walk.next++);
      if (this.walk !== walk) return;
      walk.pieces = [walk.pieces[1], next];
      const playing = this.stage.player.playing;
      this.showWalk(Math.max(0, this.stage.player.time - end));
      if (playing) this.stage.player.play();
    });
    walk.asking = false;
  }
}
