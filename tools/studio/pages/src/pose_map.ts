// The map of poses: how far its nodes are apart, where captures and a clip lie, and a path that is drawn on it.
import {el, svg} from "./dom";
import {follow} from "./drag";
import {theme} from "./theme";

export type Point = [number, number];

export interface MapInfo {
  name: string;
  kind: "som" | "pca";
  columns: number;
  rows: number;
  node_distances_m: number[] | null;
  takes: {points: Point[]; primitives: number[]}[];
  primitives: {center: Point; stay_s: number | null}[];
}

export interface MapActs {
  /** The pointer is over a point, or over none. */
  hovered: (point: Point | null) => void;
  /** A path was drawn, or a point set. */
  drawn: (points: Point[]) => void;
  /** A waypoint was dragged to a point. */
  moved: (waypoint: number, point: Point) => void;
}

const SIZE = 600;
/** Primitives are told apart by hue, then by dashes, and each by the number at its centre. */
const HUES = 4;
const DASHES = 4;
const EDGE = 12;
/** A drawn line is kept to this share of the map. */
const KEEPS_TO = 0.012;

export class PoseMap {
  readonly root: HTMLElement;
  /** What the shades say. */
  readonly key = el("p", {class: "legend"});
  /** The farthest point of the map. */
  readonly most: {column: number; row: number};
  private readonly picture: SVGSVGElement;
  private readonly ground = svg("g");
  private readonly clip = svg("path", {class: "clip-path"});
  private readonly motion = svg("path", {class: "motion-path"});
  private readonly sketch = svg("path", {class: "sketch"});
  private readonly waypoints = svg("g", {class: "waypoints"});
  // Apart from the picture, which need not be painted again as it runs.
  private readonly marker = el("div", {class: "runner away", "aria-hidden": "true"});
  /** From the picture's units to pixels of the root. */
  private pixels = {scale: 1, left: 0, top: 0};
  private runner: Point | null = null;
  private readonly scale: number;
  private readonly height: number;

  constructor(private readonly map: MapInfo, private readonly acts: MapActs) {
    const across = Math.max(1, map.columns - 1), up = Math.max(1, map.rows - 1);
    this.most = {column: map.columns - 1, row: map.rows - 1};
    this.scale = (SIZE - 2 * EDGE) / Math.max(across, up);
    const width = 2 * EDGE + this.scale * across;
    this.height = 2 * EDGE + this.scale * up;
    this.picture = svg("svg", {
      viewBox: `0 0 ${width} ${this.height}`, role: "img",
      "aria-label": `Map of poses, ${map.columns} by ${map.rows}, ${map.primitives.length} primitives. The points of the path are listed beside it.`,
    }, this.ground, this.clip, this.motion, this.sketch, this.waypoints);
    this.root = el("div", {class: "pose-map"}, this.picture, this.marker);
    new ResizeObserver(() => this.measure()).observe(this.picture);
    this.drawGround();
    this.listen();
  }

  /** Shades and lines again, in the colours of the theme. */
  drawGround(): void {
    const {map} = this;
    const shade = map.node_distances_m === null ? [] : [this.shade(map.node_distances_m)];
    const takes = map.primitives.map((_, n) => svg("path", {class: `take hue-${n % HUES} dash-${Math.floor(n / HUES) % DASHES}`, d: this.captured(n)}));
    const centers = map.primitives.map(({center, stay_s}, n) => {
      const [x, y] = this.at(center);
      return svg("g", {class: "primitive"}, svg("title", {}, `Primitive ${n}` + (stay_s === null ? "" : `, ${stay_s.toFixed(2)} s at a time`)),
                 svg("circle", {cx: x, cy: y, r: 9}), svg("text", {x, y: y + 3.5, "text-anchor": "middle"}, String(n)));
    });
    this.ground.replaceChildren(...shade, ...takes, ...centers);
  }

  showClip(points: Point[]): void {
    this.clip.setAttribute("d", this.path(points));
  }
  /** @param cuts  frames at which the path goes on elsewhere. */
  showMotion(points: Point[], cuts: number[]): void {
    this.motion.setAttribute("d", this.path(points, new Set(cuts)));
  }
  showWaypoints(points: Point[]): void {
    this.waypoints.replaceChildren(...points.map((point, n) => {
      const [x, y] = this.at(point);
      const mark = svg("g", {class: "waypoint"}, svg("circle", {cx: x, cy: y, r: 8}),
                       svg("text", {x, y: y + 3.5, "text-anchor": "middle"}, String(n + 1)));
      mark.addEventListener("pointerdown", event => this.drag(event, n));
      return mark;
    }));
  }
  showRunner(point: Point | null): void {
    this.runner = point;
    this.marker.classList.toggle("away", point === null);
    if (point === null) return;
    const [x, y] = this.at(point), {scale, left, top} = this.pixels;
    this.marker.style.transform = `translate(${left + scale * x}px, ${top + scale * y}px)`;
  }

  /** The picture is centred in an element that may be wider. */
  private measure(): void {
    const matrix = this.picture.getScreenCTM();
    if (matrix === null) return;
    const {left, top} = this.root.getBoundingClientRect();
    this.pixels = {scale: matrix.a, left: matrix.e - left, top: matrix.f - top};
    this.showRunner(this.runner);
  }

  private at([column, row]: Point): Point {
    return [EDGE + this.scale * column, this.height - EDGE - this.scale * row];
  }
  private path(points: Point[], cuts = new Set<number>()): string {
    return points.map((point, n) => this.step(n === 0 || cuts.has(n) ? "M" : "L", point)).join("");
  }
  private step(to: "M" | "L", point: Point): string {
    const [x, y] = this.at(point);
    return `${to}${x.toFixed(1)} ${y.toFixed(1)}`;
  }

  /** What captures do within a primitive, up to the frame after. */
  private captured(primitive: number): string {
    const runs = this.map.takes.flatMap(({points, primitives}) => points.slice(0, -1).map((point, n) => {
      if (primitives[n] !== primitive) return "";
      const goesOn = n > 0 && primitives[n - 1] === primitive;
      return (goesOn ? "" : this.step("M", point)) + this.step("L", points[n + 1]);
    }));
    return runs.join("");
  }

  /** The U-matrix: what is like the page lies among poses like it, what stands out apart. */
  private shade(distances: number[]): SVGElement {
    const {columns, rows} = this.map;
    const canvas = el("canvas", {width: columns, height: rows});
    const context = canvas.getContext("2d")!;
    const image = context.createImageData(columns, rows);
    const sorted = [...distances].sort((a, b) => a - b);
    const [low, high] = [sorted[0], Math.max(sorted[Math.floor(0.98 * (sorted.length - 1))], sorted[0] + 1e-9)];
    const dark = theme() === "dark";
    const grey = (far: number) => dark ? 38 + 110 * far : 250 - 130 * far;
    const shades = el("span", {class: "shades", "aria-hidden": "true"}), shade = (far: number) => `rgb(${grey(far)} ${grey(far)} ${grey(far)})`;
    shades.style.background = `linear-gradient(to right, ${shade(0)}, ${shade(1)})`;
    this.key.replaceChildren("Shades: poses beside each other are ", shades, ` ${(100 * low).toFixed(1)} to ${(100 * high).toFixed(1)} cm a joint apart.`);
    distances.forEach((distance, n) => {
      const far = Math.max(0, Math.min((distance - low) / (high - low), 1));
      const cell = 4 * ((rows - 1 - Math.floor(n / columns)) * columns + n % columns);
      image.data.set([grey(far), grey(far), grey(far), 255], cell);
    });
    context.putImageData(image, 0, 0);
    const [left, top] = this.at([-0.5, rows - 0.5]);
    return svg("image", {href: canvas.toDataURL(), x: left, y: top, width: this.scale * columns, height: this.scale * rows,
                         preserveAspectRatio: "none"});
  }

  private pointOf(event: PointerEvent): Point {
    const {x, y} = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.picture.getScreenCTM()!.inverse());
    const column = (x - EDGE) / this.scale, row = (this.height - EDGE - y) / this.scale;
    const within = (value: number, most: number) => Math.round(100 * Math.max(0, Math.min(value, most))) / 100;
    return [within(column, this.map.columns - 1), within(row, this.map.rows - 1)];
  }

  private listen(): void {
    this.picture.addEventListener("pointerdown", event => {
      if (!event.defaultPrevented && event.button === 0) this.draw(event);
    });
    this.picture.addEventListener("pointermove", event => this.acts.hovered(this.pointOf(event)));
    this.picture.addEventListener("pointerleave", () => this.acts.hovered(null));
  }

  private draw(event: PointerEvent): void {
    const drawn = [this.pointOf(event)];
    const clear = () => this.sketch.setAttribute("d", "");
    follow(this.picture, event, {
      moved: next => {
        drawn.push(this.pointOf(next));
        this.sketch.setAttribute("d", this.path(drawn));
      },
      dropped: () => {
        clear();
        this.acts.drawn(simplified(drawn, KEEPS_TO * Math.max(this.map.columns, this.map.rows)));
      },
      givenUp: clear,
    });
  }

  private drag(event: PointerEvent, waypoint: number): void {
    event.preventDefault();
    const mark = this.waypoints.children[waypoint];
    const [fromX, fromY] = this.at(this.pointOf(event));
    let moved = false;
    follow(this.picture, event, {
      moved: next => {
        moved = true;
        const [x, y] = this.at(this.pointOf(next));
        mark.setAttribute("transform", `translate(${x - fromX} ${y - fromY})`);
      },
      dropped: last => {
        mark.removeAttribute("transform");
        if (moved) this.acts.moved(waypoint, this.pointOf(last));
      },
      givenUp: () => mark.removeAttribute("transform"),
    });
  }
}

/** The fewest points of a line from which it is nowhere farther than `away` [DouglasPeucker73]. */
export function simplified(points: Point[], away: number): Point[] {
  if (points.length < 3) return points.length === 2 && distance(points[0], points[1]) < away ? [points[1]] : points;
  const [first, last] = [points[0], points[points.length - 1]];
  let farthest = 0, most = -1;
  points.forEach((point, n) => {
    const far = distanceToLine(point, first, last);
    if (far > most) [farthest, most] = [n, far];
  });
  if (most <= away) return distance(first, last) < away ? [last] : [first, last];
  return [...simplified(points.slice(0, farthest + 1), away).slice(0, -1), points[farthest],
          ...simplified(points.slice(farthest), away).slice(1)];
}

function distance(a: Point, b: Point): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1]);
}

function distanceToLine(point: Point, from: Point, to: Point): number {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = dx * dx + dy * dy;
  if (length === 0) return distance(point, from);
  const share = Math.max(0, Math.min(((point[0] - from[0]) * dx + (point[1] - from[1]) * dy) / length, 1));
  return distance(point, [from[0] + share * dx, from[1] + share * dy]);
}
