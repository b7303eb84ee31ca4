// The labelling room: one motion after the other, beside a neutral one; every answer is kept before the
// next is shown. All of it by keys: F, W, T, S choose a factor, arrows move it, N says that it was not
// observed, Enter keeps the answer. Undo goes back move by move, then to the answer before.
import {getJson, getMotion, postJson} from "./api";
import {button, checkbox, el, select, signed} from "./dom";
import {LIMIT, POLES} from "./factors";
import {History} from "./history";
import {Stage} from "./stage";
import type {Room, Studio} from "./studio";

interface Next {
  observer: string;
  factors: string[];
  place: number | null;
  done: number;
  all: number;
}

/** What is said of a motion: a number, null where it was not observed, nothing yet. */
interface Answer {
  factors: Record<string, number | null | undefined>;
  confidence: number | null;
  comment: string;
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

  constructor(readonly factor: string, changed: (value: number | null | undefined) => void) {
    const {title, low, high} = POLES[factor];
    this.slider = el("input", {type: "range", min: -LIMIT, max: LIMIT, step: 0.5, value: 0, id: `rate-${factor}`,
                               "aria-label": `${title}, from ${low} to ${high}`});
    const unseen = checkbox("not observed", false, on => changed(on ? null : undefined));
    this.unseen = unseen.input;
    this.unseen.setAttribute("aria-label", `${title} was not observed`);
    // A click on the middle is an answer too, though the value stays.
    for (const kind of ["input", "click", "keydown"]) this.slider.addEventListener(kind, event => {
      if (event instanceof KeyboardEvent && !event.key.startsWith("Arrow")) return;
      changed(Number(this.slider.value));
    });
    this.root = el("fieldset", {class: "factor"}, el("legend", {}, `${title} (${title[0]})`), this.shown, unseen.root,
      el("div", {class: "track"}, this.slider),
      el("div", {class: "poles", "aria-hidden": "true"}, el("span", {}, low), el("span", {}, high)));
    this.show(undefined);
  }

  show(value: number | null | undefined): void {
    this.unseen.checked = value === null;
    this.slider.value = String(value ?? 0);
    this.slider.classList.toggle("unset", typeof value !== "number");
    this.shown.value = value === null ? "not observed" : value === undefined ? "?" : signed(value, 1);
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
    ([value, label]) => ({value, label})), "1", value => this.change(answer => answer.confidence = Number(value)));
  private readonly undo = button("Undo", "Undo, or back to the answer before (Ctrl+Z)", () => void this.goBack());
  private readonly redo = button("Redo", "Redo (Ctrl+Shift+Z)", () => this.history?.redo());
  private readonly keep = button("Keep and go on (Enter)", "Keep this answer and show the next", () => void this.answer());
  private readonly report = el("section", {class: "agreement", "aria-label": "Agreement"});
  private history: History<Answer> | null = null;
  private all = 0;
  private place: number | null = null;
  /** It was answered before, and is answered anew. */
  private again = false;
  private replays = 0;
  private begun = 0;
  private busy = false;

  constructor(private readonly studio: Studio) {
    this.stage.player.onLoop(() => ++this.replays);
    this.comment.addEventListener("input", () => this.change(answer => answer.comment = this.comment.value, "comment"));
  }

  async enter(host: HTMLElement): Promise<void> {
    const next = await getJson<Next>("/api/label/next");
    this.ratings = next.factors.map(factor => new Rating(factor, value => this.change(answer => answer.factors[factor] = value, factor)));
    this.all = next.all;
    host.append(el("div", {class: "room effort-room"},
      el("div", {class: "left"}, this.stage.root),
      el("aside", {class: "right"}, el("div", {class: "bar tools", role: "toolbar", "aria-label": "Steps"}, this.undo, this.redo), this.progress,
         el("section", {class: "target", "aria-label": "Rating"}, ...this.ratings.map(rating => rating.root)),
         this.confidence.root, el("label", {class: "comment"}, "Comment", this.comment), this.keep,
         el("p", {class: "hint"}, `Space plays; ${next.factors.map(factor => factor[0].toUpperCase()).join(", ")} choose a factor, arrows move it, N: not observed, Enter: keep, Ctrl+Z: back.`),
         button("Agreement", "How far raters agree so far", () => void this.studio.attempt(() => this.showAgreement())), this.report)));
    await this.show(next);
  }

  leave(): void {
    this.stage.player.pause();
  }

  key(event: KeyboardEvent): boolean {
    const key = event.key.toLowerCase();
    if ((event.ctrlKey || event.metaKey) && key === "z") {
      if (event.shiftKey) this.history?.redo();
      else void this.goBack();
      return true;
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    const chosen = this.ratings.find(rating => rating.factor[0] === key);
    if (chosen) {
      chosen.slider.focus();
      return true;
    }
    if (key === "n") {
      const seen = this.ratings.find(rating => rating.slider === document.activeElement);
      if (seen) this.change(answer => answer.factors[seen.factor] = answer.factors[seen.factor] === null ? undefined : null);
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
    this.progress.textContent = next.place === null
      ? `All ${next.all} are rated by ${next.observer}. Thank you.`
      : `${next.done + 1} of ${next.all}, rated by ${next.observer}`;
    await this.ask(next.place, {factors: {}, confidence: 1, comment: ""}, false);
  }

  /** Shows what is at a place, with what was said of it. */
  private async ask(place: number | null, answer: Answer, again: boolean): Promise<void> {
    this.place = place;
    this.again = again;
    this.history = new History(answer, now => this.showAnswer(now));
    this.showAnswer(answer);
    this.replays = 0;
    this.begun = performance.now();
    this.stage.player.pause();
    if (place === null) return this.stage.setClips([]);
    const motion = (which: string) => getMotion(`/api/label/motion?place=${place}&which=${which}`);
    const [neutral, variant] = [await motion("neutral"), await motion("variant")];
    this.stage.setClips([{label: "neutral", motion: neutral}, {label: "to be rated", motion: variant}]);
    this.stage.player.seek(0);
    this.stage.player.play();
    this.ratings[0].slider.focus();
  }

  private change(edit: (answer: Answer) => void, kind = ""): void {
    const answer = this.history!.state;
    edit(answer);
    this.history!.push(answer, kind);
  }

  private showAnswer(answer: Answer): void {
    for (const rating of this.ratings) rating.show(answer.factors[rating.factor]);
    if (this.comment.value !== answer.comment) this.comment.value = answer.comment;
    this.confidence.input.value = String(answer.confidence ?? 1);
    this.keep.disabled = this.place === null || this.ratings.some(({factor}) => answer.factors[factor] === undefined);
    this.undo.disabled = !this.history!.canUndo && this.place === 0;
    this.redo.disabled = !this.history!.canRedo;
  }

  /** The step before; before the first, the answer before, to be given anew. */
  private async goBack(): Promise<void> {
    if (this.history?.canUndo) return this.history.undo();
    const before = (this.place ?? this.all) - 1;
    if (before < 0 || this.busy) return;
    await this.working(async () => {
      const answer = await getJson<Answer>(`/api/label/answer?place=${before}`);
      this.progress.textContent = `${before + 1} of ${this.all} once more; its answer takes the place of the one before`;
      // A confidence of 0 stands for nothing observed.
      await this.ask(before, {...answer, confidence: answer.confidence || 1}, true);
    });
  }

  private async working(work: () => Promise<void>): Promise<void> {
    this.busy = true;
    await this.studio.attempt(work);
    this.busy = false;
  }

  private async answer(): Promise<void> {
    if (this.keep.disabled || this.busy) return;
    await this.working(async () => {
      await this.show(await postJson<Next>("/api/label/answer", {
        place: this.place,
        ...this.history!.state,
        again: this.again,
        replays: this.replays,
        seconds: (performance.now() - this.begun) / 1000,
      }));
    });
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
