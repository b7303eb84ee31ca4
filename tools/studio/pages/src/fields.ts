// Fields of a room's state: each shows one value of it and changes it.
import {checkbox, el, select} from "./dom";

export interface Field<State> {
  root: HTMLElement;
  show: (state: State) => void;
}

/** A field that can be set only where it means something. */
export function onlyIf<State>(means: (state: State) => boolean, field: Field<State>): Field<State> {
  const inputs = field.root.querySelectorAll<HTMLInputElement | HTMLSelectElement | HTMLButtonElement>("input, select, button");
  return {root: field.root, show: state => {
    field.show(state);
    for (const input of inputs) input.disabled = !means(state);
  }};
}

/**
 * Makes the fields of a state; what they change goes through `change` with a name that joins fast changes of one kind,
 * and while a slider is moved through `tried`.
 */
export class Fields<State> {
  constructor(private readonly change: (edit: (state: State) => void, kind: string) => void,
              private readonly tried: (edit: (state: State) => void) => void = () => undefined) {}

  choice(label: string, choices: [string, string][], get: (state: State) => string, set: (state: State, value: string) => void): Field<State> {
    const made = select(label, choices.map(([value, text]) => ({value, label: text})), choices[0][0],
                        value => this.change(state => set(state, value), ""));
    return {root: made.root, show: state => made.input.value = get(state)};
  }

  flag(label: string, get: (state: State) => boolean, set: (state: State, on: boolean) => void): Field<State> {
    const made = checkbox(label, false, on => this.change(state => set(state, on), ""));
    return {root: made.root, show: state => made.input.checked = get(state)};
  }

  /** A number on a slider. */
  range(label: string, [min, max, step]: [number, number, number], get: (state: State) => number,
        set: (state: State, value: number) => void): Field<State> {
    const input = el("input", {type: "range", min, max, step}), shown = el("output", {class: "asked"});
    input.addEventListener("input", () => {
      shown.value = Number(input.value).toFixed(2);
      this.tried(state => set(state, Number(input.value)));
    });
    input.addEventListener("change", () => this.change(state => set(state, Number(input.value)), label));
    return {root: el("label", {class: "field"}, label, input, shown), show: state => {
      input.value = String(get(state));
      shown.value = get(state).toFixed(2);
    }};
  }

  /** A number within limits; null, where it may be left out, is an empty field. */
  number<Value extends number | null>(label: string, [min, max, step]: [number, number, number], get: (state: State) => Value,
                                      set: (state: State, value: Value) => void, none: Value | undefined = undefined): Field<State> {
    const input = el("input", {type: "number", min, max, step, placeholder: none === null ? "auto" : undefined});
    const text = (value: Value) => value === null ? "" : String(value);
    let shown = "";
    const show = (state: State) => input.value = shown = text(get(state));
    input.addEventListener("change", () => {
      const value = Number(input.value), whole = Number.isInteger(step);
      if (input.value === "" && none !== undefined) return this.change(state => set(state, none), label);
      if (input.value === "" || !Number.isFinite(value)) return void (input.value = shown);
      const within = Math.max(min, Math.min(whole ? Math.round(value) : value, max));
      input.value = shown = String(within);
      this.change(state => set(state, within as Value), label);
    });
    return {root: el("label", {class: "field"}, label, input), show};
  }
}
