// The points of a path, a row each: numbers that can be set, and what it was pinned by.
import {button, el, refill} from "./dom";

export interface MapPoint {
  column: number;
  row: number;
  /** The pose that it was pinned by, CLIP:FRAME. */
  key: string | null;
}

type Axis = "column" | "row";

export interface PointActs {
  set: (point: number, axis: Axis, value: number) => void;
  removed: (point: number) => void;
}

interface Row {
  root: HTMLElement;
  show: (point: MapPoint, only: boolean) => void;
}

/** CLIP:FRAME without the folders. */
export const named = (key: string) => key.replace(/.*\//, "");

export class PointList {
  readonly root = el("ol", {class: "points", "aria-label": "Points of the path"});
  private points: MapPoint[] = [];
  private rows: Row[] = [];

  /** @param most  the farthest point of the map. */
  constructor(private readonly most: Record<Axis, number>, private readonly acts: PointActs) {}

  show(points: MapPoint[]): void {
    this.points = points;
    // Rows that stay keep the focus, and let it go on to the next field.
    const kept = this.rows.slice(0, points.length);
    this.rows = [...kept, ...points.slice(kept.length).map((_, n) => this.row(kept.length + n))];
    this.rows.forEach((row, n) => row.show(points[n], points.length === 1));
    if (this.root.childElementCount !== this.rows.length) refill(this.root, ...this.rows.map(row => row.root));
  }

  private row(n: number): Row {
    const [column, row] = [this.number(n, "column"), this.number(n, "row")];
    const remove = button("Remove", `Remove point ${n + 1}`, () => this.acts.removed(n));
    const key = el("span", {class: "legend"});
    return {root: el("li", {}, column, row, remove, key), show: (point, only) => {
      column.value = shown(point.column);
      row.value = shown(point.row);
      remove.disabled = only;
      key.textContent = point.key === null ? "" : named(point.key);
      key.title = point.key ?? "";
    }};
  }

  private number(n: number, axis: Axis): HTMLInputElement {
    const most = this.most[axis];
    const input = el("input", {type: "number", step: 0.5, min: 0, max: most, "aria-label": `${axis} of point ${n + 1}`});
    input.addEventListener("change", () => {
      const value = Number(input.value);
      if (input.value !== "" && Number.isFinite(value)) this.acts.set(n, axis, Math.max(0, Math.min(value, most)));
      // What was typed is not what stands if it is no number, or beyond the map.
      this.show(this.points);
    });
    return input;
  }
}

function shown(value: number): string {
  return String(Math.round(100 * value) / 100);
}
