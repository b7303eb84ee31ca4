// One factor of what is asked for: its value, or free; what is in reach; what came of it.
import {checkbox, el, signed} from "./dom";
import {LIMIT, POLES} from "./factors";
import {Fields, type Field} from "./fields";

export interface Figures {
  predicted: number | null;
  error: number | null;
  measured: number | null;
  reachable: [number, number] | null;
}

export interface FactorActs {
  /** While the value is being moved. */
  moved: (value: number | null) => void;
  /** When it stays; null: the factor is free. */
  settled: (value: number | null) => void;
  /** How much the factor counts, beside the others. */
  weighed: (weight: number) => void;
}

/** Weights that a factor may have. */
const WEIGHTS: [number, number, number] = [0.1, 100, 0.1];

export class FactorSlider {
  readonly root: HTMLElement;
  private readonly slider: HTMLInputElement;
  private readonly free: HTMLInputElement;
  private readonly reach = el("div", {class: "reach"});
  private readonly asked = el("output", {class: "asked"});
  private readonly told = el("p", {class: "told"});

  private readonly weight: Field<{weight: number}>;

  constructor(factor: string, acts: FactorActs) {
    const poles = POLES[factor];
    this.slider = el("input", {
      type: "range", min: -LIMIT, max: LIMIT, step: 0.05, value: 0, id: `slider-${factor}`,
      "aria-label": `${poles.title}, from ${poles.low} to ${poles.high}`,
    });
    const free = checkbox("free", true, on => {
      this.showValue(on ? null : Number(this.slider.value));
      acts.settled(this.value);
    });
    this.free = free.input;
    this.free.setAttribute("aria-label", `${poles.title} is free`);
    this.slider.addEventListener("input", () => {
      this.showValue(Number(this.slider.value));
      acts.moved(this.value);
    });
    // A drag that the system takes over stops where it is; not every browser then tells of a change.
    for (const kind of ["change", "pointercancel"]) this.slider.addEventListener(kind, () => acts.settled(this.value));
    this.weight = new Fields<{weight: number}>(edit => {
      const weighed = {weight: 1};
      edit(weighed);
      acts.weighed(weighed.weight);
    }).number("importance", WEIGHTS, state => state.weight, (state, value) => state.weight = value);
    this.weight.root.title = `How much ${poles.title} counts where not all can be reached`;
    this.weight.root.querySelector("input")!.setAttribute("aria-label", `Importance of ${poles.title}`);
    this.root = el("fieldset", {class: "factor"},
      el("legend", {}, poles.title), this.asked, this.weight.root, free.root,
      el("div", {class: "track"}, this.reach, this.slider),
      el("div", {class: "poles", "aria-hidden": "true"}, el("span", {}, poles.low), el("span", {}, poles.high)),
      this.told);
    this.show(null, 1);
  }

  get value(): number | null {
    return this.free.checked ? null : Number(this.slider.value);
  }

  show(value: number | null, weight: number): void {
    this.showValue(value);
    this.weight.show({weight});
  }

  private showValue(value: number | null): void {
    this.free.checked = value === null;
    if (value !== null) this.slider.value = String(value);
    this.slider.classList.toggle("unset", value === null);
    this.slider.setAttribute("aria-valuetext", value === null ? "free" : value.toFixed(2));
    this.asked.value = value === null ? "free" : signed(value);
  }

  tell(figures: Figures): void {
    const {predicted, error, measured, reachable} = figures;
    this.told.replaceChildren(
      el("span", {}, "predicted ", el("b", {}, predicted === null ? "\u2013" : signed(predicted)),
         error === null ? "" : ` \u00b1 ${error.toFixed(2)}`),
      el("span", {}, "measured ", el("b", {class: "measured"}, measured === null ? "\u2013" : signed(measured))));
    this.reach.hidden = reachable === null;
    if (reachable === null) return;
    const share = (value: number) => 100 * (Math.max(-LIMIT, Math.min(value, LIMIT)) + LIMIT) / (2 * LIMIT);
    this.reach.style.left = `${share(reachable[0])}%`;
    this.reach.style.right = `${100 - share(reachable[1])}%`;
    this.reach.title = `in reach: ${signed(reachable[0])} to ${signed(reachable[1])}`;
  }
}
