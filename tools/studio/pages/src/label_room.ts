// The labelling room: one motion after the other, beside a neutral one; every answer is kept before the
// next is shown. All of it by keys: F, W, T, S choose a factor, arrows move it, N says that it was not
// observed, Enter keeps the answer.
import {getJson, getMotion, postJson} from "./api";
import {button, checkbox, el, select, signed} from "./dom";
import {LIMIT, POLES} from "./factors";
import {Stage} from "./stage";
import type {Room, Studio} from "./studio";

interface Next {
  observer: string;
  factors: string[];
  place: number | null;
  done: number;
  all: number;
}

interface Agreement {
  raters: string[];
  fragments: number;
  factors: {factor: string; alpha: number | null; interval: [number, number] | null; icc: number | null}[];
  repeats: {rater: string; factor: string; units: number; mean_absolute_difference: number}[];
}

/** One factor, in half steps; it has to be moved or said not to be observed. */
class Rating {
  readonly root: HTMLElement;
  readonly slider: HTMLInputElement;
  private readonly unseen: HTMLInputElement;
  private readonly shown = el("output", {class: "asked"});
  private touched = false;

  constructor(readonly factor: string, private readonly changed: () => void) {
    const {title, low, high} = POLES[factor];
    this.slider = el("input", {type: "range", min: -LIMIT, max: LIMIT, step: 0.5, value: 0, id: `rate-${factor}`,
                               "aria-label": `${title}, from ${low} to ${high}`});
    const unseen = checkbox("not observed", false, () => this.tell());
    this.unseen = unseen.input;
    this.unseen.setAttribute("aria-label", `${title} was not observed`);
    // A click on the middle is an answer too, though the value stays.
    for (const kind of ["input", "click", "keydown"]) this.slider.addEventListener(kind, event => {
      if (event instanceof KeyboardEvent && !event.key.startsWith("Arrow")) return;
      this.touched = true;
      this.unseen.checked = false;
      this.tell();
    });
    this.root = el("fieldset", {class: "factor"}, el("legend", {}, `${title} (${title[0]})`), this.shown, unseen.root,
      el("div", {class: "track"}, this.slider),
      el("div", {class: "poles", "aria-hidden": "true"}, el("span", {}, low), el("span", {}, high)));
    this.clear();
  }

  get answered(): boolean {
    return this.touched || this.unseen.checked;
  }
  get value(): number | null {
    return this.unseen.checked ? null : Number(this.slider.value);
  }
  clear(): void {
    this.touched = this.unseen.checked = false;
    this.slider.value = "0";
    this.tell();
  }
  toggleUnseen(): void {
    this.unseen.checked = !this.unseen.checked;
    this.tell();
  }
  private tell(): void {
    this.slider.classList.toggle("unset", !this.touched || this.unseen.checked);
    this.shown.value = this.unseen.checked ? "not observed" : this.touched ? signed(Number(this.slider.value), 1) : "?";
    this.changed();
  }
}

export class LabelRoom implements Room {
  readonly id = "label";
  readonly title = "Labelling";
  private readonly stage = new Stage();
  private ratings: Rating[] = [];
  private readonly progress = el("p", {class: "progress", "aria-live": "polite"});
  private readonly comment = el("textarea", {rows: 2, "aria-label": "Comment", maxlength: 500});
  private readonly confidence = select("Confidence", [["1", "sure"], ["0.75", "rather sure"], ["0.5", "half sure"], ["0.25", "guessed"]].map(
    ([value, label]) => ({value, label})), "1", () => undefined);
  private readonly keep = button("Keep and go on (Enter)", "Keep this answer and show the next", () => void this.answer());
  private readonly report = el("section", {class: "agreement", "aria-label": "Agreement"});
  private place: number | null = null;
  private replays = 0;
  private begun = 0;
  private busy = false;

  constructor(private readonly studio: Studio) {
    this.stage.player.onLoop(() => ++this.replays);
  }

  async enter(host: HTMLElement): Promise<void> {
    const next = await getJson<Next>("/api/label/next");
    this.ratings = next.factors.map(factor => new Rating(factor, () => this.showKeep()));
    host.append(el("div", {class: "room effort-room"},
      el("div", {class: "left"}, this.stage.root),
      el("aside", {class: "right"}, this.progress,
         el("section", {class: "target", "aria-label": "Rating"}, ...this.ratings.map(rating => rating.root)),
         this.confidence.root, el("label", {class: "comment"}, "Comment", this.comment), this.keep,
         el("p", {class: "hint"}, `Space plays; ${next.factors.map(factor => factor[0].toUpperCase()).join(", ")} choose a factor, arrows move it, N: not observed, Enter: keep.`),
         button("Agreement", "How far raters agree so far", () => void this.studio.attempt(() => this.showAgreement())), this.report)));
    await this.show(next);
  }

  leave(): void {
    this.stage.player.pause();
  }

  key(event: KeyboardEvent): boolean {
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    const key = event.key.toLowerCase();
    const chosen = this.ratings.find(rating => rating.factor[0] === key);
    if (chosen) {
      chosen.slider.focus();
      return true;
    }
    if (key === "n") {
      this.ratings.find(rating => rating.slider === document.activeElement)?.toggleUnseen();
      return true;
    }
    if (key === "enter") {
      if (document.activeElement instanceof HTMLButtonElement) return false;
      void this.answer();
      return true;
    }
    return this.stage.key(event);
  }

  private async show(next: Next): Promise<void> {
    this.place = next.place;
    this.progress.textContent = next.place === null
      ? `All ${next.all} are rated by ${next.observer}. Thank you.`
      : `${next.done + 1} of ${next.all}, rated by ${next.observer}`;
    for (const rating of this.ratings) rating.clear();
    this.comment.value = "";
    this.confidence.input.value = "1";
    this.replays = 0;
    this.begun = performance.now();
    this.stage.player.pause();
    if (next.place === null) return this.stage.setClips([]);
    const motion = (which: string) => getMotion(`/api/label/motion?place=${next.place}&which=${which}`);
    const [neutral, variant] = [await motion("neutral"), await motion("variant")];
    this.stage.setClips([{label: "neutral", motion: neutral}, {label: "to be rated", motion: variant}]);
    this.stage.player.seek(0);
    this.stage.player.play();
    this.ratings[0].slider.focus();
  }

  private showKeep(): void {
    this.keep.disabled = this.place === null || !this.ratings.every(rating => rating.answered);
  }

  private async answer(): Promise<void> {
    this.showKeep();
    if (this.keep.disabled || this.busy) return;
    this.busy = true;
    await this.studio.attempt(async () => {
      await this.show(await postJson<Next>("/api/label/answer", {
        place: this.place,
        factors: Object.fromEntries(this.ratings.map(rating => [rating.factor, rating.value])),
        confidence: Number(this.confidence.input.value),
        comment: this.comment.value,
        replays: this.replays,
        seconds: (performance.now() - this.begun) / 1000,
      }));
    });
    this.busy = false;
  }

  private async showAgreement(): Promise<void> {
    const told = await getJson<Agreement>("/api/label/agreement");
    const number = (value: number | null) => value === null ? "\u2013" : signed(value);
    const row = (...cells: string[]) => el("tr", {}, ...cells.map(cell => el("td", {}, cell)));
    const head = (...cells: string[]) => el("tr", {}, ...cells.map(cell => el("th", {scope: "col"}, cell)));
    this.report.replaceChildren(
      el("p", {}, `${told.raters.join(", ")}: ${told.fragments} rated`),
      ...(told.factors.length === 0 ? [] : [el("table", {}, el("caption", {}, "Between raters"),
        el("tbody", {}, head("Factor", "alpha", "95 %", "ICC"), ...told.factors.map(one => row(POLES[one.factor].title, number(one.alpha),
          one.interval === null ? "\u2013" : one.interval.map(value => number(value)).join(" to "), number(one.icc)))))]),
      ...(told.repeats.length === 0 ? [] : [el("table", {}, el("caption", {}, "Of one rater with the own repeats"),
        el("tbody", {}, head("Rater", "Factor", "units", "mean difference"), ...told.repeats.map(one =>
          row(one.rater, POLES[one.factor].title, String(one.units), one.mean_absolute_difference.toFixed(2)))))]));
  }
}
