// A path of textons as blocks along its time: chosen, moved, stretched, removed and repeated, by pointer or keys.
import {button, el} from "./dom";
import {follow} from "./drag";

export interface TextonBlock {
  texton: number;
  frames: number;
  /** Likelihood of what comes after it; null: the captures never go there; undefined: nothing comes. */
  next: number | null | undefined;
  pins: number;
}

export interface TextonLineActs {
  choose: (block: number) => void;
  move: (block: number, to: number) => void;
  stretch: (block: number, frames: number) => void;
  repeat: (block: number) => void;
  remove: (block: number) => void;
  /** Asked for where the captures never go from a block to the next. */
  bridge: (block: number) => void;
}

/** A drag shorter than this is a click, pixels; and so near to a block's end it is one of its edge. */
const CLICK = 5;
const GRIP = 9;
/** A block of a smaller share of the line has no room for a word between itself and the next. */
const NARROW = 0.07;

export class TextonLine {
  readonly root = el("div", {class: "texton-line"});
  private readonly row = el("div", {class: "timeline", role: "listbox", "aria-label": "Textons", "aria-orientation": "horizontal"});
  private readonly joins = el("div", {class: "joins"});
  private readonly cursor = el("div", {class: "cursor", "aria-hidden": "true"});
  private blocks: TextonBlock[] = [];
  private total = 1;
  /** Of the block that the cursor is in. */
  private present = -1;

  constructor(private readonly acts: TextonLineActs) {
    this.root.append(this.row, this.joins);
    this.row.addEventListener("keydown", event => {
      const n = this.boxes().indexOf(document.activeElement as HTMLElement);
      if (n < 0 || event.ctrlKey || event.metaKey) return;
      if (!this.key(event, n)) return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  show(blocks: TextonBlock[], selected: number | null): void {
    const focused = this.boxes().indexOf(document.activeElement as HTMLElement);
    this.blocks = blocks;
    const total = this.total = Math.max(1, blocks.reduce((sum, block) => sum + block.frames, 0));
    this.present = -1;
    let begin = 0;
    const joins: HTMLElement[] = [];
    this.row.replaceChildren(...blocks.map((block, n) => {
      const never = block.next === null;
      const box = el("button", {
        type: "button", role: "option", class: "snippet" + (block.pins > 0 ? " locked" : ""), "aria-selected": String(n === selected),
        title: `Texton ${block.texton}, ${block.frames} frames` + (never ? "; the captures never go on to the next" : ""),
      }, String(block.texton) + (block.pins > 0 ? " \u25C6" : ""));
      box.style.left = `${100 * begin / total}%`;
      box.style.width = `${100 * block.frames / total}%`;
      box.addEventListener("pointerdown", event => this.grab(event, n, box));
      begin += block.frames;
      if (block.next !== undefined) {
        const room = Math.min(block.frames, blocks[n + 1].frames) / total, told = `never from texton ${block.texton} to ${blocks[n + 1].texton}`;
        const join = never ? button(room < NARROW ? "\u26A0" : "\u26A0 never", `The captures go ${told}: bridge them by the cheapest path`,
                                    () => this.acts.bridge(n))
                           : el("span", {"aria-hidden": "true"}, block.next!.toFixed(2));
        if (never) join.setAttribute("aria-label", `Bridge: ${told}`);
        join.className = never ? "join never" : "join";
        join.style.left = `${100 * begin / total}%`;
        join.style.maxWidth = `${100 * room}%`;
        joins.push(join);
      }
      return box;
    }), this.cursor);
    this.joins.replaceChildren(...joins);
    if (focused >= 0) this.boxes()[Math.min(focused, blocks.length - 1)]?.focus();
  }

  /** @param frame  of the whole path: which one is shown. */
  at(frame: number): void {
    this.cursor.style.transform = `translateX(${100 * Math.min(frame / this.total, 1)}%)`;
    let end = 0;
    const present = this.blocks.findIndex(block => frame < (end += block.frames));
    if (present === this.present) return;
    const boxes = this.boxes();
    boxes[this.present]?.removeAttribute("aria-current");
    boxes[present]?.setAttribute("aria-current", "true");
    this.present = present;
  }

  private key(event: KeyboardEvent, n: number): boolean {
    const {acts} = this, by = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (by !== 0) {
      const to = Math.max(0, Math.min(n + by, this.blocks.length - 1));
      this.boxes()[to].focus();
      if (event.altKey) acts.move(n, to);
    } else if (event.key === "Delete" || event.key === "Backspace") {
      acts.remove(n);
    } else if (event.key.toLowerCase() === "d") {
      acts.repeat(n);
    } else if (event.key === "+" || event.key === "-") {
      acts.stretch(n, this.blocks[n].frames + (event.key === "+" ? 5 : -5));
    } else if (event.key === "Enter" || event.key === " ") {
      acts.choose(n);
    } else {
      return false;
    }
    return true;
  }

  private grab(event: PointerEvent, n: number, box: HTMLElement): void {
    const from = event.clientX, bounds = box.getBoundingClientRect();
    const stretches = bounds.right - from < GRIP;
    const line = this.row.getBoundingClientRect();
    const width = box.style.width;
    const putBack = () => {
      box.style.transform = "";
      box.style.width = width;
    };
    follow(box, event, {
      moved: next => {
        const by = next.clientX - from;
        if (stretches) box.style.width = `${100 * Math.max(8, bounds.width + by) / line.width}%`;
        else box.style.transform = `translateX(${by}px)`;
      },
      dropped: last => {
        putBack();
        const by = last.clientX - from;
        if (Math.abs(by) < CLICK) return this.acts.choose(n);
        if (stretches) return this.acts.stretch(n, Math.round(this.blocks[n].frames * (bounds.width + by) / bounds.width));
        this.acts.move(n, this.placeOf((last.clientX - line.left) / line.width, n));
      },
      givenUp: putBack,
    });
  }

  /** Where in the order a block lies that is dropped at a share of the line. */
  private placeOf(share: number, moved: number): number {
    const total = this.blocks.reduce((sum, block) => sum + block.frames, 0);
    let begin = 0, place = 0;
    this.blocks.forEach((block, n) => {
      if (n !== moved && begin + block.frames / 2 < share * total) ++place;
      begin += block.frames;
    });
    return place;
  }

  private boxes(): HTMLElement[] {
    return [...this.row.querySelectorAll<HTMLElement>("button")];
  }
}
