// The loop room: where a clip can turn back, where its end can flow into its beginning, and the loop itself.
import {postJson, postMotion, type ClipInfo} from "./api";
import type {Character} from "./character";
import {button, el, refill} from "./dom";
import {Fields, onlyIf, type Field} from "./fields";
import {Latest} from "./latest";
import {LineChart} from "./line_chart";
import type {Motion} from "./motion";
import {playedAgain} from "./rounds";
import {SeamPicture, type Seam} from "./seam_picture";
import {Stage, type StagedClip} from "./stage";
import {noClip, stagedInput} from "./staged";
import {StateRoom} from "./state_room";
import {StateTools} from "./state_tools";
import type {Studio} from "./studio";

/** What the loop room is set to; `laban loop synthesize --state` takes it as a file. */
interface LoopState {
  schema: string;
  input: string;
  kind: "seamless" | "endless";
  seconds: number;
  in_place: boolean;
  turns: boolean;
  seams: boolean;
  foot_fix: boolean;
  seed: number;
  seam: {overlap: number; blend_frames: number; seam_metric: string; poisson: boolean};
  turning: {distance: string; threshold: number; window_s: number};
}

interface Turns {
  frame_rate_hz: number;
  symmetry: (number | null)[];
  points: {frame: number; symmetry: number}[];
}

interface LoopReport {
  kind: "seamless" | "endless";
  frames: number;
  frame_rate_hz: number;
  source_frames: number;
  frames_used_share: number;
  quality: Record<"input" | "output", {foot_skate_cm: number; jerk_m_s3: number}>;
  seams: Seam[];
  closed?: boolean;
  travel_m?: number;
  turn_deg?: number;
  round_yaw_deg?: number;
  round_shift_m?: [number, number];
  seam_begin_frame?: number;
  parts?: {step: string; begin_frame: number; end_frame: number; seam: number | null}[];
}

/** Rounds of a seamless loop that play before the first one comes again. */
const ROUNDS = 4;

export class LoopRoom extends StateRoom<LoopState> {
  readonly id = "loop";
  readonly title = "Loop";
  protected readonly stage = new Stage();
  private readonly symmetry = new LineChart(seconds => this.seekSource(seconds), 1100);
  private readonly points = el("div", {class: "bar points", role: "group", "aria-label": "Turning points"});
  private readonly seams = el("div", {class: "bar", role: "group", "aria-label": "Seams"});
  private readonly picture = new SeamPicture(frame => this.seekSeam(frame));
  private readonly told = el("p", {class: "quality", "aria-live": "polite"});
  protected readonly tools: StateTools<LoopState>;
  private readonly fields: Field<LoopState>[];
  private readonly making = new Latest<LoopState>(state => this.studio.attempt(() => this.make(state)));
  private readonly turning = new Latest<LoopState>(state => this.studio.attempt(() => this.findTurns(state)));
  private clip: ClipInfo | null = null;
  private input: StagedClip | null = null;
  private outputCharacter: Character | null = null;
  private output: Motion | null = null;
  private report: LoopReport | null = null;
  private turnsOf = "";
  private chosen = 0;

  constructor(private readonly studio: Studio) {
    super();
    this.tools = new StateTools<LoopState>(studio, {
      schema: "laban.loop-room/1",
      verb: "laban loop synthesize",
      changed: state => this.changed(state),
      checked: "/api/loop/state",
      exported: {path: "/api/loop/export", body: state => ({clip: this.clip!.id, state})},
      // The clip is the one that is open here, whatever its path was where the state was saved.
      adopted: (saved, {input}) => ({...saved, input}),
    });
    this.fields = this.makeFields();
    this.stage.player.onTick(time => this.symmetry.markAt(this.sourceSeconds(time)));
  }

  async enter(host: HTMLElement): Promise<void> {
    const {clip} = this.studio;
    if (clip === null) {
      host.append(noClip());
      return;
    }
    host.append(el("div", {class: "room effort-room loop-room"},
      el("div", {class: "left"}, this.stage.root,
         el("div", {class: "over-time"},
            el("p", {class: "legend"}, "Symmetry in time: near 1 the clip can turn back. Click to go there."), this.symmetry.root, this.points)),
      el("aside", {class: "right"}, this.tools.root,
         el("section", {class: "options", "aria-label": "Loop"}, ...this.fields.map(field => field.root)),
         this.told, this.seams, this.picture.root)));
    if (clip.id !== this.clip?.id) await this.openClip(clip);
    this.stage.draw();
  }

  private async openClip(clip: ClipInfo): Promise<void> {
    const {state} = await postJson<{state: LoopState}>("/api/loop/open", {clip: clip.id});
    const {input, outputCharacter} = await stagedInput(clip);
    if (clip !== this.studio.clip) return;
    [this.clip, this.input, this.outputCharacter] = [clip, input, outputCharacter];
    this.output = this.report = null;
    this.turnsOf = "";
    this.chosen = 0;
    this.stage.setClips([input]);
    this.tools.begin(state, clip.id);
  }

  private changed(state: LoopState): void {
    for (const field of this.fields) field.show(state);
    this.making.ask(state);
    const turning = JSON.stringify(state.turning);
    if (turning !== this.turnsOf) this.turning.ask(state);
    this.turnsOf = turning;
  }

  private async make(state: LoopState): Promise<void> {
    const {clip} = this;
    const made = await postMotion("/api/loop/make", {clip: clip!.id, state});
    if (clip !== this.clip) return;
    const report = this.report = made.header["report"] as LoopReport;
    const [x, z] = report.round_shift_m ?? [0, 0];
    this.output = report.kind === "endless" ? made
      : playedAgain(made, ROUNDS, {yaw: (report.round_yaw_deg ?? 0) * Math.PI / 180, shift: [x, z]});
    this.stage.setClips([this.input!, {label: "loop", motion: this.output, character: this.outputCharacter}]);
    this.chosen = Math.min(this.chosen, Math.max(0, report.seams.length - 1));
    this.showReport(report);
    this.showSeams(report);
  }

  private showReport(report: LoopReport): void {
    const {input, output} = report.quality;
    const steps = (step: string) => report.parts!.filter(part => part.step === step).length;
    const how = report.kind === "endless" ? `${steps("backwards")} times back, ${steps("seam")} seams played`
      : report.closed ? "the last frame flows into the first"
      : `the last frame flows into the first, ${report.travel_m!.toFixed(2)} m and ${report.turn_deg!.toFixed(1)} degrees on`;
    this.told.textContent = `${(report.frames / report.frame_rate_hz).toFixed(1)} s of ${report.source_frames} captured frames ` +
      `(${(100 * report.frames_used_share).toFixed(0)} % used): ${how}. Foot skate ${output.foot_skate_cm.toFixed(2)} cm a frame ` +
      `(captured ${input.foot_skate_cm.toFixed(2)}).`;
  }

  private showSeams(report: LoopReport): void {
    this.picture.root.hidden = report.seams.length === 0;
    refill(this.seams, ...report.seams.length < 2 ? [] : report.seams.map((_, n) => {
      const choose = button(`Seam ${n + 1}`, `Show seam ${n + 1}`, () => {
        this.chosen = n;
        this.showSeams(report);
        this.seekSeam(0);
      });
      choose.setAttribute("aria-pressed", String(n === this.chosen));
      return choose;
    }));
    const seam = report.seams[this.chosen];
    if (seam) this.picture.show(seam, this.output!.joints);
  }

  private async findTurns(state: LoopState): Promise<void> {
    const turns = await postJson<Turns>("/api/loop/turns", {clip: this.clip!.id, state});
    const rate = turns.frame_rate_hz, last = (turns.symmetry.length - 1) / rate;
    const x = turns.symmetry.map((_, frame) => frame / rate);
    this.symmetry.show({
      label: `Symmetry in time of each frame; ${turns.points.length} turning points`,
      x: [0, last], y: [0, 1], yTicks: [0, 0.5, 1], xTitle: "seconds",
      xTicks: Array.from({length: Math.floor(last) + 1}, (_, n) => n).filter(n => n % Math.ceil(last / 12) === 0),
    }, [
      {name: "threshold", kind: "limit", x: [0, last], y: [state.turning.threshold, state.turning.threshold]},
      {name: "symmetry", kind: "flow", x, y: turns.symmetry},
      {name: "turning points", kind: "turns", x: turns.points.map(point => point.frame / rate), y: turns.points.map(point => point.symmetry),
       markers: true},
    ]);
    this.symmetry.markAt(this.sourceSeconds(this.stage.player.time));
    this.points.replaceChildren(el("span", {class: "legend"}, turns.points.length === 0 ? "No turning point above the threshold." : "Turning points:"),
      ...turns.points.map(point => button(`${(point.frame / rate).toFixed(2)} s`, `Symmetry ${point.symmetry.toFixed(3)}; show this frame`,
                                          () => this.seekSource(point.frame / rate))));
  }

  /** The moment of the capture that the stage shows. */
  private sourceSeconds(time: number): number | null {
    const {output, input} = this;
    if (!input) return null;
    const frames = output?.sourceFrames;
    if (!frames) return time;
    return frames[Math.max(0, Math.min(Math.round(time * output.rate), frames.length - 1))] / input.motion.rate;
  }

  /** Goes to the first moment of the loop that shows a moment of the capture, or the one nearest to it. */
  private seekSource(seconds: number): void {
    const {output, input} = this;
    if (!output?.sourceFrames || !input) return this.stage.player.seek(seconds);
    const wanted = seconds * input.motion.rate;
    let best = 0;
    output.sourceFrames.forEach((frame, n) => {
      if (Math.abs(frame - wanted) < Math.abs(output.sourceFrames![best] - wanted) - 1e-3) best = n;
    });
    this.stage.player.pause();
    this.stage.player.seek(best / output.rate);
  }

  private seekSeam(frame: number): void {
    const {report} = this;
    if (!report) return;
    const seam = report.seams[this.chosen];
    const begin = report.seam_begin_frame ?? report.parts?.find(part => part.seam === this.chosen)?.begin_frame;
    if (begin === undefined) return this.studio.tell("this seam is not played in so short a time; make it longer, or draw again");
    this.stage.player.pause();
    this.stage.player.seek((begin + frame * seam.played_frames / seam.frames) / report.frame_rate_hz);
  }

  private makeFields(): Field<LoopState>[] {
    const fields = new Fields<LoopState>((edit, kind) => this.tools.change(edit, kind));
    const endless = (field: Field<LoopState>) => onlyIf(state => state.kind === "endless", field);
    const seed = fields.number("Seed", [0, 1000000, 1], state => state.seed, (state, value) => state.seed = value);
    const again = button("Draw again", "The next seed", () => this.tools.change(state => state.seed = (state.seed + 1) % 1000001));
    return [
      fields.choice("Make", [["seamless", "one seamless loop"], ["endless", "endless motion"]], state => state.kind,
             (state, value) => state.kind = value as LoopState["kind"]),
      endless(fields.number("Seconds", [0.5, 600, 0.5], state => state.seconds, (state, value) => state.seconds = value)),
      fields.flag("In place", state => state.in_place, (state, on) => state.in_place = on),
      endless(fields.flag("Turn back at turning points", state => state.turns, (state, on) => state.turns = on)),
      endless(fields.flag("Leap through seams", state => state.seams, (state, on) => state.seams = on)),
      fields.flag("Hold feet", state => state.foot_fix, (state, on) => state.foot_fix = on),
      endless({root: el("span", {class: "bar"}, seed.root, again), show: seed.show}),
      fields.number("Overlap, frames", [4, 100, 1], state => state.seam.overlap, (state, value) => {
        state.seam.overlap = value;
        state.seam.blend_frames = Math.min(state.seam.blend_frames, state.seam.overlap);
      }),
      fields.number("Blend, frames", [1, 100, 1], state => state.seam.blend_frames,
             (state, value) => state.seam.blend_frames = Math.min(value, state.seam.overlap)),
      fields.choice("A cut costs", [["difference", "difference"], ["gradient", "difference over gradient"]], state => state.seam.seam_metric,
             (state, value) => state.seam.seam_metric = value),
      fields.flag("Poisson blending", state => state.seam.poisson, (state, on) => state.seam.poisson = on),
      fields.choice("Distance", [["mahalanobis", "Mahalanobis"], ["l2", "L2"]], state => state.turning.distance,
             (state, value) => state.turning.distance = value),
      fields.number("Threshold", [0, 1, 0.01], state => state.turning.threshold, (state, value) => state.turning.threshold = value),
      fields.number("Window, seconds", [0.05, 10, 0.05], state => state.turning.window_s, (state, value) => state.turning.window_s = value),
    ];
  }
}
