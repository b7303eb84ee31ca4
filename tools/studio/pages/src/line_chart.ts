// Curves over a line, as SVG: Effort over alpha, Effort over time.
import {el, svg} from "./dom";
import {follow} from "./drag";

export interface Curve {
  name: string;
  /** Class that gives the colour and dash: "flow", "weight faint". */
  kind: string;
  x: number[];
  y: (number | null)[];
  /** Its points alone, each a disc. */
  markers?: boolean;
  /** Half the width of a band about it. */
  error?: number[] | null;
}

export interface ChartArea {
  label: string;
  x: [number, number];
  y: [number, number];
  /** What stands below the line, and at which values. */
  xTicks: number[];
  yTicks: number[];
  xTitle: string;
}

const WIDTH = 320;
const HEIGHT = 150;
const LEFT = 24;
const FOOT = 24;
const HEAD = 8;

export class LineChart {
  readonly root: HTMLElement;
  private readonly picture: SVGSVGElement;
  private area: ChartArea = {label: "", x: [0, 1], y: [0, 1], xTicks: [], yTicks: [], xTitle: ""};
  // Apart from the picture: it moves with every frame, and the curves need not be drawn again for it.
  private readonly mark = el("div", {class: "mark away", "aria-hidden": "true"});

  /** Called when a drag is given up: what was picked in it does not count. */
  givenUp: () => void = () => undefined;

  /** @param picked  called with x where the chart is clicked or dragged; none: it takes no pointer. */
  constructor(private readonly picked?: (x: number, done: boolean) => void, private readonly width = WIDTH) {
    this.picture = svg("svg", {viewBox: `0 0 ${width} ${HEIGHT}`, role: "img"});
    this.root = el("div", {class: "chart"}, this.picture, el("div", {class: "marks"}, this.mark));
    if (picked) this.listen();
  }

  show(area: ChartArea, curves: Curve[]): void {
    this.area = area;
    this.picture.setAttribute("aria-label", area.label);
    const grid = [
      ...area.yTicks.flatMap(y => [
        svg("line", {class: "grid", x1: LEFT, x2: this.width - 4, y1: this.py(y), y2: this.py(y)}),
        svg("text", {class: "tick", x: LEFT - 4, y: this.py(y) + 3, "text-anchor": "end"}, String(y).replace("-", "\u2212")),
      ]),
      ...area.xTicks.map(x => svg("text", {class: "tick", x: this.px(x), y: HEIGHT - FOOT + 11, "text-anchor": "middle"},
                                  String(x).replace("-", "\u2212"))),
      svg("text", {class: "tick", x: this.width - 4, y: HEIGHT - 2, "text-anchor": "end"}, area.xTitle),
    ];
    this.picture.replaceChildren(...grid, ...curves.flatMap(curve => this.drawn(curve)));
  }

  /** Where the upright line stands; null: nowhere. */
  markAt(x: number | null): void {
    this.mark.classList.toggle("away", x === null);
    if (x === null) return;
    this.mark.style.transform = `translateX(${100 * this.px(x) / this.width}%)`;
  }

  private px(x: number): number {
    const [low, high] = this.area.x;
    return LEFT + (this.width - LEFT - 4) * (x - low) / Math.max(1e-9, high - low);
  }
  private py(y: number): number {
    const [low, high] = this.area.y;
    return HEIGHT - FOOT - (HEIGHT - FOOT - HEAD) * (Math.max(low, Math.min(y, high)) - low) / (high - low);
  }

  private drawn(curve: Curve): SVGElement[] {
    const parts: SVGElement[] = [];
    const {error} = curve;
    if (error) {
      const side = (sign: number) => curve.x.map((x, n) => `${this.px(x)},${this.py((curve.y[n] ?? 0) + sign * error[n])}`);
      parts.push(svg("polygon", {class: `band ${curve.kind}`, points: [...side(1), ...side(-1).reverse()].join(" ")}));
    }
    if (curve.markers) {
      return curve.x.map((x, n) => svg("circle", {class: `marker ${curve.kind}`, cx: this.px(x), cy: this.py(curve.y[n] ?? 0), r: 4}));
    }
    let path = "";
    curve.y.forEach((y, n) => {
      if (y === null) return;
      path += `${n === 0 || curve.y[n - 1] === null ? "M" : "L"}${this.px(curve.x[n]).toFixed(1)} ${this.py(y).toFixed(1)}`;
    });
    parts.push(svg("path", {class: `curve ${curve.kind}`, d: path}));
    return parts;
  }

  private listen(): void {
    const at = (event: PointerEvent) => {
      const box = this.root.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width * this.width;
      const [low, high] = this.area.x;
      return Math.max(low, Math.min(low + (x - LEFT) / (this.width - LEFT - 4) * (high - low), high));
    };
    this.root.classList.add("takes-pointer");
    this.root.addEventListener("pointerdown", event => {
      this.picked?.(at(event), false);
      follow(this.root, event, {
        moved: next => this.picked?.(at(next), false),
        dropped: last => this.picked?.(at(last), true),
        givenUp: () => this.givenUp(),
      });
    });
  }
}
