// The Effort graph, after Laban and Lawrence: about a short diagonal, the sign of action, stand Weight
// upright (Light up, Strong down), Flow across (Free to the left, Bound to the right), Time at the foot
// (Sustained to the left, Sudden to the right) and Space at the head (Indirect left, Direct right). How
// far a stroke goes says how much; strokes to the condensing pole are doubled, as analysts draw what is
// stressed. What is asked for is drawn faint and broken behind what is measured.
import {signed, svg} from "./dom";
import {LIMIT, POLES} from "./factors";

const SIZE = 200;
const MIDDLE = SIZE / 2;
const UNIT = 26;

interface Axis {
  /** Where its zero is. */
  at: [number, number];
  /** Towards the condensing pole. */
  along: [number, number];
}

const AXES: Record<string, Axis> = {
  flow: {at: [MIDDLE, MIDDLE], along: [1, 0]},
  weight: {at: [MIDDLE, MIDDLE], along: [0, 1]},
  time: {at: [MIDDLE, SIZE - 14], along: [1, 0]},
  space: {at: [MIDDLE, 14], along: [1, 0]},
};

type Values = Record<string, number | null>;

function stroke(axis: Axis, value: number, kind: string): SVGGElement {
  const length = UNIT * Math.max(-LIMIT, Math.min(value, LIMIT));
  const lines = value > 0 && kind === "measured" ? [-2, 2] : [0];
  return svg("g", {class: `stroke ${kind}`}, ...lines.map(away => svg("line", {
    x1: axis.at[0] + away * axis.along[1], y1: axis.at[1] + away * axis.along[0],
    x2: axis.at[0] + length * axis.along[0] + away * axis.along[1],
    y2: axis.at[1] + length * axis.along[1] + away * axis.along[0],
  })));
}

function spoken(values: Values): string {
  return Object.entries(values).filter(([, value]) => value !== null).map(([factor, value]) => {
    const poles = POLES[factor];
    return `${poles.title} ${signed(value!)} (${value! < 0 ? poles.low : poles.high})`;
  }).join(", ");
}

export class EffortGraph {
  readonly root = svg("svg", {viewBox: `0 0 ${SIZE} ${SIZE}`, class: "effort-graph", role: "img"});

  show(factors: string[], asked: Values, measured: Values): void {
    const known = factors.filter(factor => factor in AXES);
    const axes = known.map(factor => {
      const {at, along} = AXES[factor];
      const reach = LIMIT * UNIT;
      return svg("line", {class: "axis", x1: at[0] - reach * along[0], y1: at[1] - reach * along[1],
                          x2: at[0] + reach * along[0], y2: at[1] + reach * along[1]});
    });
    const strokes = (values: Values, kind: string) => known.flatMap(factor => {
      const value = values[factor];
      return value === null || value === undefined ? [] : [stroke(AXES[factor], value, kind)];
    });
    const letters = known.map(factor => {
      const {at, along} = AXES[factor];
      return svg("text", {class: "letter", x: at[0] + (LIMIT * UNIT + 9) * along[0], y: at[1] + (LIMIT * UNIT + 9) * along[1] + 3},
                 POLES[factor].title[0]);
    });
    this.root.replaceChildren(
      ...axes, ...strokes(asked, "wanted"),
      svg("line", {class: "action", x1: MIDDLE - 9, y1: MIDDLE + 9, x2: MIDDLE + 9, y2: MIDDLE - 9}),
      ...strokes(measured, "measured"), ...letters);
    this.root.setAttribute("aria-label", `Effort graph. Measured: ${spoken(measured) || "nothing"}. Asked: ${spoken(asked) || "nothing"}.`);
  }
}
