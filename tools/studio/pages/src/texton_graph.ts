// The transitions of a texture about one texton: what comes before it, what after, how likely.
import {el, svg} from "./dom";

export type Transition = [from: number, to: number, probability: number];

const WIDTH = 400;
const HEIGHT = 210;
const MOST = 7;

export class TextonGraph {
  readonly root: HTMLElement;
  private readonly picture = svg("svg", {viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", "aria-label": "Transitions"});
  private readonly more = el("p", {class: "legend"});

  constructor(private readonly transitions: Transition[], private readonly choose: (texton: number) => void) {
    this.root = el("div", {class: "texton-graph"}, this.picture, this.more);
  }

  /** Of captures' goings on from one to the other; null: there was none. */
  likelihood(from: number, to: number): number | null {
    return this.transitions.find(([a, b]) => a === from && b === to)?.[2] ?? null;
  }

  show(texton: number): void {
    const others = (side: 0 | 1) => this.transitions.filter(one => one[1 - side] === texton && one[side] !== texton).sort((a, b) => b[2] - a[2]);
    const [before, after] = [others(0), others(1)];
    const middle: [number, number] = [WIDTH / 2, HEIGHT / 2];
    const column = (list: Transition[], side: 0 | 1) => list.slice(0, MOST).flatMap((one, n, shown) => {
      const y = HEIGHT * (n + 0.5) / shown.length, x = side === 0 ? 34 : WIDTH - 34;
      const edge = svg("line", {class: "edge", x1: x, y1: y, x2: middle[0], y2: middle[1], "stroke-width": (0.8 + 6 * one[2]).toFixed(1)});
      const label = svg("text", {class: "tick", x: 0.6 * x + 0.4 * middle[0], y: 0.6 * y + 0.4 * middle[1] - 3, "text-anchor": "middle"}, one[2].toFixed(2));
      return [edge, label, this.node(one[side], x, y, false)];
    });
    const self = this.likelihood(texton, texton);
    this.picture.replaceChildren(...column(before, 0), ...column(after, 1), this.node(texton, ...middle, true));
    const hidden = Math.max(0, before.length - MOST) + Math.max(0, after.length - MOST);
    this.more.textContent = `${before.length} come before texton ${texton}, ${after.length} after` +
      (self === null ? "" : `; it follows itself with ${self.toFixed(2)}`) + (hidden > 0 ? `; the ${hidden} least likely are not drawn` : "") + ".";
  }

  private node(texton: number, x: number, y: number, middle: boolean): SVGElement {
    const node = svg("g", {class: middle ? "node chosen" : "node", ...(middle ? {} : {role: "button", tabindex: 0, "aria-label": `Texton ${texton}`})},
                     svg("circle", {cx: x, cy: y, r: middle ? 20 : 13}), svg("text", {x, y: y + 4, "text-anchor": "middle"}, String(texton)));
    if (middle) return node;
    node.addEventListener("click", () => this.choose(texton));
    node.addEventListener("keydown", event => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      event.stopPropagation();
      this.choose(texton);
    });
    return node;
  }
}
