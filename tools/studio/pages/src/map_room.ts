// The map room: poses under the pointer, motion along a path that is drawn, walks over primitives.
import {getJson, getMotion, postJson, postMotion, type ClipInfo} from "./api";
import {button, el} from "./dom";
import {Fields, onlyIf, type Field} from "./fields";
import {messageOf} from "./files";
import {Latest} from "./latest";
import type {Motion} from "./motion";
import {named, PointList, type MapPoint} from "./point_list";
import {PoseMap, type MapInfo, type Point} from "./pose_map";
import {Stage, type StagedClip} from "./stage";
import {staged} from "./staged";
import {StateRoom} from "./state_room";
import {StateTools} from "./state_tools";
import type {Studio} from "./studio";
import {onTheme} from "./theme";

/** What the map room is set to; `laban manifold synthesize --state` takes it as a file. */
interface MapState {
  schema: string;
  manifold: string;
  way: "path" | "walk";
  points: MapPoint[];
  frames: number | null;
  seconds: number;
  perturb: number;
  seed: number;
  travel: "contacts" | "primitives" | "none";
  foot_fix: boolean;
}

const point = ([column, row]: Point, key: string | null = null): MapPoint => ({column, row, key});

export class MapRoom extends StateRoom<MapState> {
  readonly id = "map";
  readonly title = "Map";
  protected readonly stage = new Stage();
  protected readonly tools: StateTools<MapState>;
  private readonly fields: Field<MapState>[];
  private readonly told = el("p", {class: "quality", "aria-live": "polite"});
  private readonly placed = el("p", {class: "legend placed", "aria-live": "polite"});
  private readonly pin = button("Pin this frame", "Puts the clip's present frame on the map, as the path's next point", () => void this.pinFrame());
  private readonly making = new Latest<MapState>(state => this.studio.attempt(() => this.make(state)));
  private readonly posing = new Latest<Point>(at => this.pose(at));
  private map: PoseMap | null = null;
  private list: PointList | null = null;
  private clip: ClipInfo | null = null;
  private input: StagedClip | null = null;
  private output: Motion | null = null;
  /** The moment that was shown before a pose under the pointer took the motion's place; null: none did. */
  private rest: number | null = null;
  /** What was drawn is played as soon as it is made. */
  private playsNext = false;

  constructor(private readonly studio: Studio) {
    super();
    this.tools = new StateTools<MapState>(studio, {
      schema: "laban.map-room/1",
      verb: "laban manifold synthesize",
      changed: state => this.changed(state),
      checked: "/api/map/state",
      exported: {path: "/api/map/export", body: state => ({state})},
      // The map is the one that is open here, whatever its path was where the state was saved.
      adopted: (saved, {manifold}) => ({...saved, manifold}),
    });
    const fields = new Fields<MapState>((edit, kind) => this.tools.change(edit, kind));
    const [goes, walks] = (["path", "walk"] as const).map(way => (state: MapState) => state.way === way);
    this.fields = [
      fields.choice("Make", [["path", "a motion through the points"], ["walk", "a walk from the first point"]], state => state.way,
                    (state, value) => this.goBy(state, value as MapState["way"])),
      onlyIf(goes, fields.number<number | null>("Frames", [1, 100000, 1], state => state.frames, (state, value) => state.frames = value, null)),
      onlyIf(walks, fields.number("Seconds of walk", [0.5, 600, 0.5], state => state.seconds, (state, value) => state.seconds = value)),
      onlyIf(walks, fields.number("Perturb", [0, 10, 0.05], state => state.perturb, (state, value) => state.perturb = value)),
      onlyIf(walks, fields.number("Seed", [0, 1000000, 1], state => state.seed, (state, value) => state.seed = value)),
      fields.choice("Travel", [["contacts", "from feet that stand"], ["primitives", "as captured"], ["none", "none"]], state => state.travel,
                    (state, value) => state.travel = value as MapState["travel"]),
      fields.flag("Hold feet", state => state.foot_fix, (state, on) => state.foot_fix = on),
    ];
    this.stage.player.onTick(time => this.showRunner(time));
    onTheme(() => this.map?.drawGround());
  }

  async enter(host: HTMLElement): Promise<void> {
    if (this.map === null) await this.openMap();
    await this.openClip(this.studio.clip);
    if (!host.isConnected) return;
    host.append(el("div", {class: "room map-room"},
      el("div", {class: "left"}, this.stage.root),
      el("aside", {class: "right"}, this.tools.root, this.map!.root,
         el("p", {class: "hint"}, "Move over the map for poses; drag to draw a path, or click for its next point; drag numbers to move them."),
         el("p", {class: "legend"}, "Lines: captures, a colour and dash a primitive; grey dashes: the clip; thick: the motion."),
         this.map!.key,
         this.told, this.placed,
         el("section", {class: "options", "aria-label": "Motion"}, ...this.fields.map(field => field.root), this.pin,
            button("Add a point", "Puts the path's next point in the middle of the map; its numbers move it", () => this.addPoint()),
            button("Clear", "Keeps the first point alone", () => this.tools.change(state => state.points.length = 1))),
         this.list!.root)));
    this.stage.draw();
  }

  override key(event: KeyboardEvent): boolean {
    if (event.key === " ") this.showMotion();
    return super.key(event);
  }

  private async openMap(): Promise<void> {
    const told = await getJson<MapInfo & {state: MapState}>("/api/map");
    this.map = new PoseMap(told, {
      hovered: at => this.hover(at),
      drawn: points => this.draw(points),
      moved: (n, to) => {
        this.rest = null;
        this.tools.change(state => state.points[n] = point(to));
      },
    });
    this.list = new PointList(this.map.most, {
      set: (n, axis, value) => this.tools.change(state => state.points[n] = {...state.points[n], [axis]: value, key: null}, `${axis} ${n}`),
      removed: n => this.tools.change(state => state.points.splice(n, 1)),
    });
    this.tools.begin(told.state);
  }

  private async openClip(clip: ClipInfo | null): Promise<void> {
    this.pin.disabled = clip === null;
    if (clip === null || clip.id === this.clip?.id) return;
    const input = await staged(`clip: ${clip.name}`, clip, await getMotion(`/api/clips/motion?clip=${clip.id}`));
    const {points} = await postJson<{points: Point[]}>("/api/map/clip", {clip: clip.id});
    if (clip !== this.studio.clip) return;
    [this.clip, this.input] = [clip, input];
    this.map!.showClip(points);
    this.showClips(this.output, "motion");
  }

  private changed(state: MapState): void {
    for (const field of this.fields) field.show(state);
    this.map!.showWaypoints(state.points.map(({column, row}) => [column, row]));
    this.list!.show(state.points);
    this.making.ask(state);
  }

  /** A walk is as long as its seconds, whatever frames a path was stretched to. */
  private goBy(state: MapState, way: MapState["way"]): void {
    state.way = way;
    if (way === "walk") state.frames = null;
  }

  /** A line is a path of its own; a click adds to the one that is there. */
  private draw(points: Point[]): void {
    this.stage.player.pause();
    this.rest = null;
    this.playsNext = points.length > 1;
    this.tools.change(state => {
      const walked = state.way === "walk";
      if (points.length > 1 || !walked) state.way = "path";
      if (points.length > 1) state.points = points.map(at => point(at));
      else if (walked) state.points = [point(points[0])];
      else state.points.push(point(points[0]));
    });
  }

  private addPoint(): void {
    const {column, row} = this.map!.most;
    this.tools.change(state => {
      this.goBy(state, "path");
      state.points.push(point([column / 2, row / 2]));
    });
  }

  private async pinFrame(): Promise<void> {
    await this.studio.attempt(async () => {
      const {motion} = this.input!;
      const frame = Math.min(Math.round(this.stage.player.time * motion.rate), motion.frames - 1);
      const placed = await postJson<{point: Point; away_cm: number; key: string}>("/api/map/place", {clip: this.clip!.id, frame});
      this.tools.change(state => {
        if (state.way === "walk") state.points = [];
        state.way = "path";
        state.points.push(point(placed.point, placed.key));
      });
      this.placed.textContent = `${named(placed.key)} lies at ${placed.point.map(value => value.toFixed(1)).join(", ")}; ` +
        `the pose there is ${placed.away_cm.toFixed(1)} cm a joint away.`;
    });
  }

  private async make(state: MapState): Promise<void> {
    const made = await postMotion("/api/map/make", {state});
    this.output = made;
    const {header} = made, path = header["path"] as Point[], primitives = header["primitives"] as number[];
    this.map!.showMotion(path, header["cuts"] as number[]);
    if (this.rest === null) this.showClips(made, "motion");
    const jumps = header["jumps"] as number;
    this.told.textContent = `${made.frames} frame${made.frames === 1 ? "" : "s"}, ${(made.frames / made.rate).toFixed(1)} s.` +
      (primitives.length === 0 ? ` Points are passed at frames ${(header["passed"] as number[]).join(", ")}.`
                               : ` Primitives ${primitives.slice(0, 30).join(" ")}${primitives.length > 30 ? " .." : ""}.`) +
      (jumps === 0 ? "" : ` ${jumps} times nothing was known to follow.`);
    this.showRunner(this.stage.player.time);
    if (!this.playsNext) return;
    this.playsNext = false;
    this.stage.player.seek(0);
    this.stage.player.play();
  }

  private showClips(motion: Motion | null, label: string): void {
    const made = motion === null ? [] : [{label, motion, repeats: true}];
    this.stage.setClips(this.input === null ? made : [this.input, ...made]);
  }

  private hover(at: Point | null): void {
    if (at === null) return this.showMotion();
    if (this.stage.player.playing) return;
    this.rest ??= this.stage.player.time;
    this.posing.ask(at);
  }

  /** The motion again, if a pose under the pointer stands in its place. */
  private showMotion(): void {
    if (this.rest === null) return;
    const time = this.rest;
    this.rest = null;
    this.showClips(this.output, "motion");
    this.stage.player.seek(time);
  }

  private async pose(at: Point): Promise<void> {
    try {
      const pose = await postMotion("/api/map/pose", {point: at});
      if (this.rest !== null) this.showClips(pose, `pose at ${at.map(value => value.toFixed(1)).join(", ")}, primitive ${String(pose.header["primitive"])}`);
    } catch (error) {
      this.studio.tell(messageOf(error));
    }
  }

  private showRunner(time: number): void {
    const path = this.output?.header["path"] as Point[] | undefined;
    this.map?.showRunner(path ? path[Math.round(time * this.output!.rate) % path.length] : null);
  }
}
