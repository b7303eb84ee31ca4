// What one snippet plays, and what else it could: runners-up, Effort over alpha, by hand.
import type {Lock, SnippetChoices, StyledSnippet} from "./api";
import {button, checkbox, el, signed} from "./dom";
import {LIMIT, POLES} from "./factors";
import {LineChart} from "./line_chart";

const ALPHA: [number, number] = [-0.25, 1.25];

export interface SnippetActs {
  /** Sets the snippet's blend by hand; `done` is false while it is being moved. */
  lock(lock: Lock, done: boolean): void;
  unlock(snippet: number): void;
  /** What was moved last is given up. */
  giveUp(): void;
}

export class SnippetPanel {
  readonly root = el("section", {class: "snippet-panel", "aria-label": "Snippet"});
  private readonly chart: LineChart;
  private readonly alpha = el("input", {type: "number", min: ALPHA[0], max: ALPHA[1], step: 0.01, "aria-label": "Blend weight alpha"});
  private snippet = 0;
  private pair: [string, string] | null = null;

  constructor(private readonly factors: string[], private readonly acts: SnippetActs) {
    this.chart = new LineChart((x, done) => this.setAlpha(x, done));
    this.chart.givenUp = () => this.acts.giveUp();
    this.alpha.addEventListener("change", () => this.setAlpha(Number(this.alpha.value), true));
    this.clear();
  }

  clear(): void {
    this.root.replaceChildren(el("h2", {}, "Snippet"),
                              el("p", {class: "hint"}, "Choose a snippet below the stage to see what it plays and to set it by hand."));
  }

  /** The chosen weight, while the rest of the panel is on its way. */
  showAlpha(alpha: number): void {
    this.chart.markAt(alpha);
    if (document.activeElement !== this.alpha) this.alpha.value = alpha.toFixed(3);
  }

  show(n: number, choices: SnippetChoices, locked: boolean): void {
    this.snippet = n;
    const {played} = choices;
    const i = played.fragment_i, j = played.fragment_j;
    this.pair = i && j && i !== j ? [i, j] : null;
    const lock = checkbox("locked", locked, on => {
      if (on && i && j) this.acts.lock({snippet: n, fragments: [i, j], alpha: played.alpha ?? 0}, true);
      else this.acts.unlock(n);
    });
    lock.input.disabled = !i && !locked;
    this.root.replaceChildren(
      el("h2", {}, `Snippet ${n + 1}: ${played.content ?? "kept as captured"}`),
      el("p", {class: "pair"}, this.playedText(played)), lock.root,
      ...(choices.curves ? [this.drawn(choices.curves), el("label", {class: "field"}, "alpha", this.alpha)] : []),
      ...(choices.runners_up.length > 0 ? [this.others(choices)] : []));
    if (played.alpha !== undefined) this.showAlpha(played.alpha);
  }

  private playedText(played: StyledSnippet): string {
    if (!played.fragments) return "Nothing is asked of it, or it matches no content that the model knows.";
    return played.fragments.map(part => `${part.weight.toFixed(2)} ${part.fragment}`).join(" + ");
  }

  private drawn(curves: NonNullable<SnippetChoices["curves"]>): HTMLElement {
    this.chart.show({
      label: `Effort over the blend weight between ${curves.fragments[0]} and ${curves.fragments[1]}`,
      x: ALPHA, y: [-LIMIT, LIMIT], xTicks: [0, 0.5, 1], yTicks: [-3, 0, 3], xTitle: "alpha",
    }, this.factors.map(factor => ({
      name: POLES[factor].title, kind: factor, x: curves.alphas, y: curves.predicted[factor],
      error: curves.error?.[factor] ?? null,
    })));
    return this.chart.root;
  }

  private others(choices: SnippetChoices): HTMLElement {
    const head = el("tr", {}, el("th", {scope: "col"}, "Pair"), el("th", {scope: "col"}, "alpha"),
                    ...this.factors.map(factor => el("th", {scope: "col"}, POLES[factor].title)));
    const rows = choices.runners_up.map(other => {
      const [a, b] = other.fragments;
      const plays = this.pair !== null && a === this.pair[0] && b === this.pair[1];
      const take = button(`${a} + ${b}`, "Play this pair", () =>
        this.acts.lock({snippet: this.snippet, fragments: other.fragments, alpha: other.alpha}, true));
      return el("tr", {class: plays ? "plays" : null}, el("td", {}, take), el("td", {}, signed(other.alpha)),
                ...this.factors.map(factor => el("td", {}, signed(other.predicted[factor]))));
    });
    return el("div", {class: "others", tabindex: 0, role: "region", "aria-label": "Runners-up"},
              el("table", {}, el("caption", {}, "Runners-up"), el("thead", {}, head), el("tbody", {}, ...rows)));
  }

  private setAlpha(alpha: number, done: boolean): void {
    if (this.pair === null || !Number.isFinite(alpha)) return;
    const within = Math.max(ALPHA[0], Math.min(alpha, ALPHA[1]));
    this.showAlpha(within);
    this.acts.lock({snippet: this.snippet, fragments: this.pair, alpha: Math.round(1000 * within) / 1000}, done);
  }
}
