// All transitions of a texture as one picture: a row for each texton gone from, a column for each gone to.
import {el} from "./dom";
import type {Transition} from "./texton_graph";
import {ink, onTheme} from "./theme";

/** CSS pixels that a cell has at least. */
const CELL = 3;

const channels = (color: string) => [1, 3, 5].map(at => parseInt(color.slice(at, at + 2), 16));

export class TextonMatrix {
  readonly root: HTMLElement;
  private readonly canvas: HTMLCanvasElement;
  private readonly mark = el("div", {class: "mark-cell", "aria-hidden": "true"});
  private readonly told = el("p", {class: "legend", "aria-live": "polite"});
  private cell: [from: number, to: number] = [0, 0];

  /** @param choose  called with the pair that is clicked. */
  constructor(private readonly count: number, private readonly transitions: Transition[], private readonly choose: (from: number, to: number) => void) {
    this.canvas = el("canvas", {
      tabindex: 0, role: "img", width: count, height: count,
      "aria-label": `Transitions among ${count} textons: rows from, columns to. Arrows go from cell to cell, Enter takes the pair for a path.`,
    });
    this.canvas.style.minWidth = `${CELL * count}px`;
    this.canvas.addEventListener("pointermove", event => this.tell(...this.at(event)));
    this.canvas.addEventListener("click", event => {
      this.tell(...this.at(event));
      this.choose(...this.cell);
    });
    this.canvas.addEventListener("keydown", event => this.key(event));
    this.root = el("div", {class: "texton-matrix"},
      el("div", {class: "cells"}, el("div", {class: "picture"}, this.canvas, this.mark)), this.told);
    onTheme(() => this.draw());
    this.draw();
    this.tell(...this.cell);
  }

  /** The more likely, the farther from the background: by its root, so that what is rare is seen. */
  private draw(): void {
    const {count} = this, context = this.canvas.getContext("2d")!, image = context.createImageData(count, count);
    const [never, sure] = [channels(ink("--panel")), channels(ink("--ink"))];
    const set = (cell: number, share: number) => image.data.set([...never.map((value, k) => value + share * (sure[k] - value)), 255], 4 * cell);
    for (let cell = 0; cell < count * count; ++cell) set(cell, 0);
    for (const [from, to, likelihood] of this.transitions) set(from * count + to, 0.15 + 0.85 * Math.sqrt(likelihood));
    context.putImageData(image, 0, 0);
  }

  private at(event: MouseEvent): [number, number] {
    const box = this.canvas.getBoundingClientRect();
    const index = (share: number) => Math.max(0, Math.min(Math.floor(share * this.count), this.count - 1));
    return [index((event.clientY - box.top) / box.height), index((event.clientX - box.left) / box.width)];
  }

  private tell(from: number, to: number): void {
    this.cell = [from, to];
    const found = this.transitions.find(([a, b]) => a === from && b === to);
    this.told.textContent = `From ${from} to ${to}: ${found ? found[2].toFixed(2) : "never"}`;
    const part = 100 / this.count, {style} = this.mark;
    [style.left, style.top, style.width, style.height] = [to, from, 1, 1].map(cells => `${part * cells}%`);
  }

  private key(event: KeyboardEvent): void {
    const by: Record<string, [number, number]> = {ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1], Enter: [0, 0]};
    const step = by[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === "Enter") return this.choose(...this.cell);
    const [from, to] = this.cell.map((value, k) => Math.max(0, Math.min(value + step[k], this.count - 1)));
    this.tell(from, to);
    this.mark.scrollIntoView({block: "nearest", inline: "nearest"});
  }
}
