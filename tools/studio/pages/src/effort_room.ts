// The Effort room: sliders on one side, input and output on the stage, the snippets below.
import {postJson, postMotion, type ClipInfo, type EffortState, type Lock, type Numbers,
        type OpenedEffort, type OverTime, type SnippetChoices, type StyleReport} from "./api";
import type {Character} from "./character";
import {el} from "./dom";
import {EffortGraph} from "./effort_graph";
import {FactorSlider} from "./factor_slider";
import {LIMIT, POLES} from "./factors";
import {Fields, type Field} from "./fields";
import {Latest} from "./latest";
import {LineChart} from "./line_chart";
import {duration, type Motion} from "./motion";
import {SnippetPanel} from "./snippet_panel";
import {Stage, type StagedClip} from "./stage";
import {noClip, stagedInput} from "./staged";
import {StateRoom} from "./state_room";
import {StateTools} from "./state_tools";
import type {Studio} from "./studio";
import {Timeline, type TimedSnippet} from "./timeline";

/** Rest after which a draft is worked out in full, milliseconds. */
const SETTLES_MS = 250;

interface Task {
  state: EffortState;
  draft: boolean;
}

/** The mean over snippets, by their length; null where none has the figure. */
function mean(report: StyleReport, of: (n: number) => number | null | undefined): number | null {
  let sum = 0, weight = 0;
  report.snippets.forEach((snippet, n) => {
    const value = of(n);
    if (value === null || value === undefined) return;
    const length = snippet.output_end_frame - snippet.output_begin_frame;
    sum += length * value;
    weight += length;
  });
  return weight > 0 ? sum / weight : null;
}

export class EffortRoom extends StateRoom<EffortState> {
  readonly id = "effort";
  readonly title = "Effort";
  protected readonly stage = new Stage();
  private readonly graph = new EffortGraph();
  private readonly timeline = new Timeline(n => this.choose(n));
  private readonly overTime = new LineChart(x => this.stage.player.seek(x), 1100);
  private readonly cautions = el("ul", {class: "cautions", "aria-live": "polite"});
  private readonly quality = el("p", {class: "quality"});
  protected readonly tools: StateTools<EffortState>;
  private readonly styling = new Latest<Task>(task => this.style(task));
  private readonly measuring = new Latest<EffortState>(state => this.studio.attempt(() => this.drawOverTime(state)));
  private readonly choosing = new Latest<EffortState>(state => this.showSnippet(state));
  private clip: ClipInfo | null = null;
  private opened: OpenedEffort | null = null;
  private sliders = new Map<string, FactorSlider>();
  private panel: SnippetPanel | null = null;
  private options: Field<EffortState>[] = [];
  private input: StagedClip | null = null;
  private outputCharacter: Character | null = null;
  private output: Motion | null = null;
  private report: StyleReport | null = null;
  private inputOverTime: OverTime | null = null;
  private selected: number | null = null;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly studio: Studio) {
    super();
    this.tools = new StateTools<EffortState>(studio, {
      schema: "laban.effort-room/1",
      verb: "laban apply",
      changed: state => this.changed(state),
      checked: "/api/effort/state",
      exported: {path: "/api/effort/export", body: state => ({clip: this.clip!.id, state})},
      // The clip is the one that is open here, whatever its path was where the state was saved.
      adopted: (saved, {input}) => ({...saved, input}),
    });
    this.stage.player.onTick(time => {
      this.timeline.at(time);
      this.overTime.markAt(time);
    });
  }

  async enter(host: HTMLElement): Promise<void> {
    const {clip} = this.studio;
    if (clip === null) {
      host.append(noClip());
      return;
    }
    if (clip.id !== this.clip?.id) await this.openClip(clip);
    if (!host.isConnected) return;
    host.append(el("div", {class: "room effort-room"},
      el("div", {class: "left"}, this.stage.root, this.timeline.root,
         el("div", {class: "over-time"}, this.legend(), this.overTime.root)),
      el("aside", {class: "right"}, this.tools.root,
         el("section", {"aria-label": "Target Effort", class: "target"}, ...[...this.sliders.values()].map(slider => slider.root)),
         el("div", {class: "beside"}, this.graph.root, el("div", {class: "options"}, ...this.options.map(option => option.root))), this.cautions, this.quality, this.panel!.root)));
    this.stage.draw();
  }

  private async openClip(clip: ClipInfo): Promise<void> {
    const opened = await postJson<OpenedEffort>("/api/effort/open", {clip: clip.id});
    const {input, outputCharacter} = await stagedInput(clip);
    if (clip !== this.studio.clip) return;
    [this.clip, this.opened, this.input, this.outputCharacter] = [clip, opened, input, outputCharacter];
    this.output = this.report = this.selected = this.inputOverTime = null;
    this.sliders = new Map(opened.factors.map((factor, n) => [factor, new FactorSlider(factor, {
      moved: value => this.draft(state => state.asked[factor] = value),
      settled: value => this.change(state => state.asked[factor] = value, factor),
      weighed: weight => this.change(state => state.weights = opened.factors.map((_, m) => m === n ? weight : state.weights[m] ?? 1), `weight of ${factor}`),
    })]));
    this.panel = new SnippetPanel(opened.factors, {
      lock: (lock, done) => done ? this.change(state => setLock(state, lock)) : this.draft(state => setLock(state, lock)),
      unlock: snippet => this.change(state => state.locks = state.locks.filter(lock => lock.snippet !== snippet)),
      giveUp: () => this.changed(this.tools.state),
    });
    this.options = this.makeOptions();
    this.stage.setClips([input]);
    this.tools.begin(opened.state, clip.id);
  }

  /** A state for good: a step of the history. */
  private change(edit: (state: EffortState) => void, kind = ""): void {
    // A draft may stand on the stage although nothing was changed in the end.
    if (!this.tools.change(edit, kind)) this.changed(this.tools.state);
  }
  /** A state on the way to one. */
  private draft(edit: (state: EffortState) => void): void {
    const {state} = this.tools;
    edit(state);
    this.styling.ask({state, draft: true});
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.styling.ask({state, draft: false}), SETTLES_MS);
  }

  private changed(state: EffortState): void {
    clearTimeout(this.timer);
    this.opened!.factors.forEach((factor, n) => this.sliders.get(factor)!.show(state.asked[factor] ?? null, state.weights[n] ?? 1));
    for (const option of this.options) option.show(state);
    this.styling.ask({state, draft: false});
    this.measuring.ask(state);
    if (this.selected !== null) this.choosing.ask(state);
  }

  private async style({state, draft}: Task): Promise<void> {
    await this.studio.attempt(async () => {
      const clip = this.clip!;
      const output = await postMotion("/api/effort/style", {clip: clip.id, state, draft});
      if (clip !== this.clip) return;
      this.output = output;
      this.report = output.header["report"] as StyleReport;
      this.stage.setClips([this.input!, {label: "output", motion: output, character: this.outputCharacter}]);
      // What lies far apart on the page is painted as one area: the pose comes first, figures in the
      // frame after, and the rest when the slider rests.
      if (draft) {
        return this.stage.afterDrawing(() => {
          if (this.output !== output) return;
          this.showReport(state);
          this.showAlpha();
        });
      }
      this.showReport(state);
      // A draft may have been drawn after the snippet's panel was.
      this.showAlpha();
      this.showQuality();
      this.showTimeline(state);
      this.cautions.replaceChildren(...(output.header["cautions"] as string[]).map(line => el("li", {}, line)));
    });
  }

  private showAlpha(): void {
    const alpha = this.selected === null ? undefined : this.report!.snippets[this.selected].alpha;
    if (alpha !== undefined) this.panel!.showAlpha(alpha);
  }

  private showReport(state: EffortState): void {
    const report = this.report!, {factors} = this.opened!;
    const measured: Numbers = {};
    for (const factor of factors) {
      const of = (n: number) => report.snippets[n];
      const ranges = report.snippets.flatMap(snippet => snippet.reachable ? [snippet.reachable[factor]] : []);
      const now = mean(report, n => of(n).measured[factor]);
      if (now !== null) measured[factor] = now;
      this.sliders.get(factor)!.tell({
        predicted: mean(report, n => of(n).predicted?.[factor]),
        error: mean(report, n => of(n).predicted_standard_error?.[factor]),
        measured: now,
        reachable: ranges.length === 0 ? null : [Math.min(...ranges.map(range => range[0])), Math.max(...ranges.map(range => range[1]))],
      });
    }
    this.graph.show(factors, state.relative ? {} : state.asked, measured);
  }

  private showQuality(): void {
    const quality = this.report!.quality;
    if (!quality) return;
    const figure = (key: string, digits: number) => quality[key]?.toFixed(digits) ?? "\u2013";
    this.quality.textContent = `Foot skate ${figure("foot_skate_cm_per_frame", 2)} cm a frame; jerk ${figure("jerk_rms_m_s3", 0)} m/s\u00b3.`;
  }

  private showTimeline(state: EffortState): void {
    const motion = this.output!, rate = this.opened!.model.frame_rate_hz;
    const boxes = this.report!.snippets.map((snippet, n): TimedSnippet => ({
      begin: snippet.output_begin_frame / rate,
      end: snippet.output_end_frame / rate,
      label: snippet.content ?? this.opened!.snippets[n]?.content ?? "?",
      kind: state.locks.some(lock => lock.snippet === n) ? "locked" : snippet.kept_as_captured ? "kept" : "found",
      hint: snippet.fragments?.map(part => `${part.weight.toFixed(2)} ${part.fragment}`).join(" + ") ?? "kept as captured",
    }));
    this.timeline.show(boxes, duration(motion), this.selected);
    this.timeline.at(this.stage.player.time);
  }

  private choose(n: number): void {
    this.selected = n;
    const rate = this.opened!.model.frame_rate_hz;
    this.stage.player.seek(this.report!.snippets[n].output_begin_frame / rate);
    this.showTimeline(this.tools.state);
    this.choosing.ask(this.tools.state);
  }

  private async showSnippet(state: EffortState): Promise<void> {
    await this.studio.attempt(async () => {
      const n = this.selected;
      if (n === null) return;
      const clip = this.clip!;
      const choices = await postJson<SnippetChoices>(
        "/api/effort/snippet", {clip: clip.id, state, snippet: n});
      if (n !== this.selected || clip !== this.clip) return;
      this.panel!.show(n, choices, state.locks.some(lock => lock.snippet === n));
      this.panel!.root.scrollIntoView({block: "nearest"});
    });
  }

  private async drawOverTime(state: EffortState): Promise<void> {
    const clip = this.clip!;
    const ask = (of: EffortState | null) => postJson<OverTime>("/api/effort/over-time", {clip: clip.id, state: of});
    const before = this.inputOverTime ?? await ask(null);
    const after = await ask(state);
    if (clip !== this.clip) return;
    this.inputOverTime = before;
    const last = Math.max(before.seconds[before.seconds.length - 1], after.seconds[after.seconds.length - 1]);
    const factors = Object.keys(after.effort);
    const curves = (told: OverTime, faint: string) => factors.map(factor => ({
      name: POLES[factor].title, kind: factor + faint, x: told.seconds, y: told.effort[factor],
    }));
    this.overTime.show({
      label: "Effort over time, as measured: input faint, output full",
      x: [0, last], y: [-LIMIT, LIMIT], yTicks: [-3, 0, 3], xTitle: "seconds",
      xTicks: Array.from({length: Math.floor(last) + 1}, (_, n) => n).filter(n => n % Math.ceil(last / 12) === 0),
    }, [...curves(before, " faint"), ...curves(after, "")]);
    this.overTime.markAt(this.stage.player.time);
  }

  private legend(): HTMLElement {
    return el("p", {class: "legend"}, "Measured over time: ",
              ...["flow", "weight", "time"].map(factor => el("span", {class: `key ${factor}`}, POLES[factor].title)), " input faint");
  }

  private makeOptions(): Field<EffortState>[] {
    const fields = new Fields<EffortState>((edit, kind) => this.change(edit, kind), edit => this.draft(edit));
    return [
      fields.range("Strength", [0, 1, 0.05], state => state.strength, (state, value) => state.strength = value),
      fields.range("Others stay", [0, 1, 0.05], state => state.stay, (state, value) => state.stay = value),
      fields.range("Caution", [0, 3, 0.1], state => state.caution, (state, value) => state.caution = value),
      fields.choice("Keep", [["replace", "nothing"], ["residual", "posture and manner"]], state => state.detail,
                    (state, value) => state.detail = value as EffortState["detail"]),
      fields.choice("Blend", ["2", "3", "4"].map(n => [n, `${n} fragments`]), state => String(state.way), (state, value) => state.way = Number(value)),
      fields.flag("Keep timing", state => state.keep_timing, (state, on) => state.keep_timing = on),
      fields.flag("Hold feet", state => state.foot_fix, (state, on) => state.foot_fix = on),
      fields.flag("Relative to the input", state => state.relative, (state, on) => state.relative = on),
    ];
  }
}

function setLock(state: EffortState, lock: Lock): void {
  state.locks = [...state.locks.filter(other => other.snippet !== lock.snippet), lock].sort((a, b) => a.snippet - b.snippet);
}
