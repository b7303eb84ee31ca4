// The snippets of a clip along its time, with the joins between them; one of them can be chosen.
import {el} from "./dom";

export interface TimedSnippet {
  begin: number;
  end: number;
  label: string;
  /** "kept": as captured; "locked": set by hand. */
  kind: "found" | "kept" | "locked";
  hint: string;
}

export class Timeline {
  readonly root = el("div", {class: "timeline", role: "listbox", "aria-label": "Snippets", "aria-orientation": "horizontal"});
  private readonly cursor = el("div", {class: "cursor", "aria-hidden": "true"});
  private duration = 1;

  constructor(private readonly chosen: (snippet: number) => void) {
    this.root.addEventListener("keydown", event => {
      const boxes = this.boxes();
      const at = boxes.indexOf(document.activeElement as HTMLElement);
      const away = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
      if (away === 0 || at < 0) return;
      boxes[Math.max(0, Math.min(at + away, boxes.length - 1))].focus();
      event.preventDefault();
    });
  }

  show(snippets: TimedSnippet[], duration: number, selected: number | null): void {
    this.duration = Math.max(duration, 1e-6);
    const focused = this.boxes().indexOf(document.activeElement as HTMLElement);
    this.root.replaceChildren(...snippets.map((snippet, n) => {
      const box = el("button", {
        type: "button", role: "option", class: `snippet ${snippet.kind}`, title: snippet.hint,
        "aria-selected": String(n === selected),
      }, snippet.label);
      box.style.left = `${100 * snippet.begin / this.duration}%`;
      box.style.width = `${100 * (snippet.end - snippet.begin) / this.duration}%`;
      box.addEventListener("click", () => this.chosen(n));
      return box;
    }), this.cursor);
    if (focused >= 0) this.boxes()[focused]?.focus();
  }

  at(time: number): void {
    this.cursor.style.transform = `translateX(${100 * Math.min(time / this.duration, 1)}%)`;
  }

  private boxes(): HTMLElement[] {
    return [...this.root.querySelectorAll<HTMLElement>("button")];
  }
}
