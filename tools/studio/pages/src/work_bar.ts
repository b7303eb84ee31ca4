// Work that takes long: how far it has come, and a way to stop it.
import {stopWork, workTold} from "./api";
import {button, el} from "./dom";

/** Work shorter than this is not told of, milliseconds. */
const PATIENCE_MS = 700;
const STEP_MS = 300;

export class WorkBar {
  private readonly progress = el("progress", {max: 1, "aria-label": "Work done"});
  private readonly seconds = el("span", {class: "worked"});
  private underWay = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly root: HTMLElement) {
    root.append(this.progress, this.seconds, button("Stop", "Stop what is worked on", () => void stopWork()));
  }

  begin(): void {
    if (++this.underWay === 1) this.timer = setTimeout(() => void this.tell(), PATIENCE_MS);
  }
  end(): void {
    if (--this.underWay > 0) return;
    clearTimeout(this.timer);
    this.root.hidden = true;
  }

  private async tell(): Promise<void> {
    const told = await workTold().catch(() => null);
    if (this.underWay === 0) return;
    if (told?.busy) {
      this.root.hidden = false;
      this.seconds.textContent = `${told.seconds.toFixed(0)} s`;
      if (told.fraction === null) this.progress.removeAttribute("value");
      else this.progress.value = told.fraction;
    }
    this.timer = setTimeout(() => void this.tell(), STEP_MS);
  }
}
