// All textons of a texture as a table that can be sorted; a click on one plays it.
import {button, el} from "./dom";

export interface TextonTotals {
  segments: number;
  /** Of all its segments. */
  frames: number;
}

type Column = [label: string, title: string, value: (texton: number) => number];

export class TextonTable {
  readonly root: HTMLElement;
  private readonly body = el("tbody");
  private readonly heads: HTMLTableCellElement[];
  private readonly rows: HTMLTableRowElement[];

  constructor(textons: TextonTotals[], play: (texton: number) => void) {
    const mean = (texton: number) => textons[texton].frames / Math.max(1, textons[texton].segments);
    const columns: Column[] = [
      ["Texton", "By number", texton => texton],
      ["Frames", "By mean length", mean],
      ["Captured", "By how often it was captured", texton => textons[texton].segments],
    ];
    this.rows = textons.map(({segments}, texton) => el("tr", {},
      el("td", {}, button(String(texton), `Play texton ${texton}`, () => play(texton))),
      el("td", {}, mean(texton).toFixed(0)), el("td", {}, `${segments}\u00d7`)));
    this.heads = columns.map(([label, title, value], n) => el("th", {scope: "col"}, button(label, title, () => this.sort(n, value))));
    this.body.append(...this.rows);
    this.root = el("div", {class: "texton-table", tabindex: 0, role: "region", "aria-label": "All textons"},
      el("table", {}, el("thead", {}, el("tr", {}, ...this.heads)), this.body));
    this.heads[0].setAttribute("aria-sort", "ascending");
  }

  /** Upwards, or downwards if it was upwards. */
  private sort(column: number, value: (texton: number) => number): void {
    const down = this.heads[column].getAttribute("aria-sort") === "ascending";
    const order = this.rows.map((_, texton) => texton).sort((a, b) => (down ? -1 : 1) * (value(a) - value(b)) || a - b);
    this.body.append(...order.map(texton => this.rows[texton]));
    this.heads.forEach((head, n) => n === column ? head.setAttribute("aria-sort", down ? "descending" : "ascending") : head.removeAttribute("aria-sort"));
  }
}
