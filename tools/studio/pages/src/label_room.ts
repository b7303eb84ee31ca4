// The labelling room: one motion after the other, beside a neutral one; every answer is kept before the
// next is shown, and can be mended later. All of it by keys: F, W, T, S choose a factor, arrows move it, N
// says that it was not observed, Enter keeps the answer, B goes back to the one before.
import {getJson, getMotion, postJson} from "./api";
import {button, checkbox, el, select, signed} from "./dom";
import {LIMIT, POLES} from "./factors";
import {History} from "./history";
import {Stage} from "./stage";
import type {Room, Studio} from "./studio";

/** What is said of a motion. */
interface Answer {
  /** Null: not observed; none: not said yet. */
  factors: Record<string, number | null>;
  confidence: number | null;
  comment: string;
}

const BLANK: Answer = {factors: {}, confidence: 1, comment: ""};

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

  /** @param said  called with every value, also while it is being moved; null: not observed. */
  constructor(readonly factor: string, private readonly said: (value: number | null, done: boolean) => void) {
    const {title, low, high} = POLES[factor];
    this.slider = el("input", {type: "range", min: -LIMIT, max: LIMIT, step: 0.5, value: 0, id: `rate-${factor}`,
                               "aria-label": `${title}, from ${low} to ${high}`});
    const unseen = checkbox("not observed", false, on => this.said(on ? null : Number(this.slider.value), true));
    this.unseen = unseen.input;
    this.unseen.setAttribute("aria-label", `${title} was not observed`);
    this.slider.addEventListener("input", () => this.say(false));
    // A click or a key at the middle or an end is an answer too, though the value stays.
    for (const kind of ["change", "click", "keyup", "pointercancel"]) this.slider.addEventListener(kind, event => {
      if (!(event instanceof KeyboardEvent) || event.key.startsWith("Arrow")) this.say(true);
    });
    this.root = el("fieldset", {class: "factor"}, el("legend", {}, `${title} (${title[0]})`), this.shown, unseen.root,
      el("div", {class: "track"}, this.slider),
      el("div", {class: "poles", "aria-hidden": "true"}, el("span", {}, low), el("span", {}, high)));
  }

  /** @param value  none: not said yet. */
  show(value: number | null | undefined): void {
    this.unseen.checked = value === null;
    if (typeof value === "number") this.slider.value = String(value);
    else if (value === undefined) this.slider.value = "0";
    const text = value === null ? "not observed" : value === undefined ? "?" : signed(value, 1);
    this.slider.classList.toggle("unset", typeof value !== "number");
    this.slider.setAttribute("aria-valuetext", value === undefined ? "not said yet" : text);
    this.shown.value = text;
  }
  toggleUnseen(): void {
    this.unseen.click();
  }
  private say(done: boolean): void {
    this.said(Number(this.slider.value), done);
  }
}

export class LabelRoom implements Room {
  readonly id = "label";
  readonly title = "Labelling";
  private readonly stage = new Stage();
  private ratings: Rating[] = [];
  private readonly progress = el("p", {class: "progress", "aria-live": "polite"});
  private readonly comment = el("textarea", {rows: 2, "aria-label": "Comment", maxlength: 500});
  private readonly confidence = select("Confidence", [["1", "sure"], ["0.75", "rather sure"], ["0.5", "half sure"], ["0.25", "guessed"],
    ["0", "not at all sure"]].map(([value, label]) => ({value, label})), "1", value => this.change(answer => answer.confidence = Number(value)));
  private readonly keep = button("Keep and go on (Enter)", "Keep this answer and show the next", () => void this.answer());
  private readonly back = button("Back (B)", "Back to the answer before this one, to mend it", () => this.goBack());
  private readonly undo = button("Undo", "Undo (Ctrl+Z)", () => this.history.undo());
  private readonly redo = button("Redo", "Redo (Ctrl+Shift+Z)", () => this.history.redo());
  private readonly report = el("section", {class: "agreement", "aria-label": "Agreement"});
  private next: Next | null = null;
  /** What is shown; null: nothing is left. */
  private place: number | null = null;
  /** The answer that is in the table for what is shown; null: none. */
  private kept: Answer | null = null;
  private history = this.newHistory(BLANK);
  /** By place: what is set there is there again when it is shown again. */
  private readonly histories = new Map<number, History<Answer>>();
  private replays = 0;
  private begun = 0;
  private busy = false;

  constructor(private readonly studio: Studio) {
    this.stage.player.onLoop(() => ++this.replays);
    this.comment.addEventListener("input", () => this.change(answer => answer.comment = this.comment.value, "comment"));
  }

  async enter(host: HTMLElement): Promise<void> {
    const next = await getJson<Next>("/api/label/next");
    this.ratings = next.factors.map(factor => new Rating(factor, (value, done) => {
      if (done) this.change(answer => answer.factors[factor] = value, value === null ? "" : factor);
      else this.ratings.find(rating => rating.factor === factor)!.show(value);
    }));
    host.append(el("div", {class: "room effort-room"},
      el("div", {class: "left"}, this.stage.root),
      el("aside", {class: "right"}, this.progress,
         el("div", {class: "bar tools", role: "toolbar", "aria-label": "Steps"}, this.undo, this.redo, this.back),
         el("section", {class: "target", "aria-label": "Rating"}, ...this.ratings.map(rating => rating.root)),
         this.confidence.root, el("label", {class: "comment"}, "Comment", this.comment), this.keep,
         el("p", {class: "hint"}, `Space plays; ${next.factors.map(factor => factor[0].toUpperCase()).join(", ")} choose a factor, ` +
           "arrows move it, N: not observed, Enter: keep, B: back."),
         button("Agreement", "How far raters agree so far", () => void this.studio.attempt(() => this.showAgreement())), this.report)));
    await this.goOn(next);
  }

  leave(): void {
    this.stage.player.pause();
  }

  key(event: KeyboardEvent): boolean {
    const key = event.key.toLowerCase();
    if ((event.ctrlKey || event.metaKey) && key === "z") {
      if (event.shiftKey) this.history.redo();
      else this.history.undo();
      return true;
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    const chosen = this.ratings.find(rating => rating.factor[0] === key);
    if (chosen) {
      chosen.slider.focus();
      return true;
    }
    if (key === "n") {
      this.ratings.find(rating => rating.slider === document.activeElement)?.toggleUnseen();
      return true;
    }
    if (key === "b") {
      this.goBack();
      return true;
    }
    if (key === "enter") {
      if (document.activeElement instanceof HTMLButtonElement) return false;
      void this.answer();
      return true;
    }
    return this.stage.key(event);
  }

  private newHistory(answer: Answer): History<Answer> {
    return new History(answer, now => this.showAnswer(now));
  }

  private change(edit: (answer: Answer) => void, kind = ""): void {
    if (this.place === null || this.busy) return;
    const answer = this.history.state;
    edit(answer);
    this.history.push(answer, kind);
  }

  private showAnswer(answer: Answer): void {
    for (const rating of this.ratings) rating.show(answer.factors[rating.factor]);
    this.confidence.input.value = String(answer.confidence ?? 1);
    // To set a text moves the caret in it.
    if (this.comment.value !== answer.comment) this.comment.value = answer.comment;
    const said = this.ratings.every(rating => answer.factors[rating.factor] !== undefined);
    this.keep.disabled = this.place === null || !said;
    this.undo.disabled = !this.history.canUndo;
    this.redo.disabled = !this.history.canRedo;
    this.back.disabled = this.before() === null;
  }

  /** The place before the one that is shown: all of them up to the next are answered. */
  private before(): number | null {
    if (this.next === null) return null;
    const at = this.place ?? this.next.all;
    return at > 0 ? at - 1 : null;
  }

  private goBack(): void {
    const place = this.before();
    if (place === null || this.busy) return;
    void this.once(async () => {
      const kept = await getJson<Answer>(`/api/label/answer?place=${place}`);
      await this.show(place, kept);
    });
  }

  private async goOn(next: Next): Promise<void> {
    this.next = next;
    await this.show(next.place, null);
  }

  private async show(place: number | null, kept: Answer | null): Promise<void> {
    const {all, done, observer} = this.next!;
    this.stage.player.pause();
    if (place === null) {
      this.stage.setClips([]);
    } else {
      const motion = (which: string) => getMotion(`/api/label/motion?place=${place}&which=${which}`);
      const [neutral, variant] = [await motion("neutral"), await motion("variant")];
      this.stage.setClips([{label: "neutral", motion: neutral}, {label: "to be rated", motion: variant}]);
    }
    this.place = place;
    this.kept = kept;
    this.progress.textContent = place === null ? `All ${all} are rated by ${observer}. Thank you.`
      : kept ? `${place + 1} of ${all}, as kept by ${observer}: what is changed is mended`
             : `${done + 1} of ${all}, rated by ${observer}`;
    this.keep.textContent = kept ? "Mend and go on (Enter)" : "Keep and go on (Enter)";
    this.history = this.historyOf(place, kept);
    this.showAnswer(this.history.state);
    this.replays = 0;
    this.begun = performance.now();
    if (place === null) return;
    this.stage.player.seek(0);
    this.stage.player.play();
    this.ratings[0].slider.focus();
  }

  private historyOf(place: number | null, kept: Answer | null): History<Answer> {
    const begun = place === null ? undefined : this.histories.get(place);
    const history = begun ?? this.newHistory(kept ?? BLANK);
    if (place !== null) this.histories.set(place, history);
    if (kept !== null && !this.same(history.state, kept)) history.push(kept);
    return history;
  }

  private same(a: Answer, b: Answer): boolean {
    return a.comment === b.comment && a.confidence === b.confidence &&
      this.ratings.every(({factor}) => a.factors[factor] === b.factors[factor]);
  }

  /** Nothing else is begun until it is done. */
  private async once(work: () => Promise<void>): Promise<void> {
    this.busy = true;
    await this.studio.attempt(work);
    this.busy = false;
  }

  private async answer(): Promise<void> {
    if (this.keep.disabled || this.busy) return;
    const {place, kept} = this, answer = this.history.state;
    await this.once(async () => {
      if (kept !== null && this.same(kept, answer)) return this.goOn(this.next!);
      try {
        const next = await postJson<Next>("/api/label/answer", {
          place, ...answer, mend: kept !== null, replays: this.replays, seconds: (performance.now() - this.begun) / 1000,
        });
        await this.goOn(next);
      } catch (error) {
        await this.catchUp(place);
        throw error;
      }
    });
  }

  /** Goes on where another page of this observer has answered what is shown here. */
  private async catchUp(place: number | null): Promise<void> {
    const next = await getJson<Next>("/api/label/next");
    if (this.kept !== null || next.place === place || this.place !== place) return;
    this.histories.delete(place!);
    await this.goOn(next);
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
