// Elements by a line each. Styles go through classes and CSSOM: the page's policy lets no others pass.

type Child = Node | string | null | undefined;
type Attributes = Record<string, string | number | boolean | null | undefined>;

function fill(element: Element, attributes: Attributes, children: Child[]): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child !== null && child !== undefined) element.append(child);
}

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  fill(element, attributes, children);
  return element;
}

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: Child[]): SVGElementTagNameMap[K] {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  fill(element, attributes, children);
  return element;
}

export function button(label: string, title: string, act: () => void): HTMLButtonElement {
  const made = el("button", {type: "button", title}, label);
  made.addEventListener("click", act);
  return made;
}

export interface Choice {
  value: string;
  label: string;
}

export function select(label: string, choices: Choice[], value: string,
                       act: (value: string) => void): {root: HTMLLabelElement; input: HTMLSelectElement} {
  const input = el("select", {}, ...choices.map(choice => el("option", {value: choice.value}, choice.label)));
  input.value = value;
  input.addEventListener("change", () => act(input.value));
  return {root: el("label", {class: "field"}, label, input), input};
}

export function checkbox(label: string, checked: boolean,
                         act: (checked: boolean) => void): {root: HTMLLabelElement; input: HTMLInputElement} {
  const input = el("input", {type: "checkbox"});
  input.checked = checked;
  input.addEventListener("change", () => act(input.checked));
  return {root: el("label", {class: "check"}, input, label), input};
}

/** Puts other children in; the focus stays at its place among what can have it, or goes to the last. */
export function refill(root: HTMLElement, ...children: Child[]): void {
  const reachable = () => [...root.querySelectorAll<HTMLElement>("button:enabled, input:enabled, select:enabled")];
  const at = reachable().indexOf(document.activeElement as HTMLElement);
  root.replaceChildren(...children.filter(child => child !== null && child !== undefined));
  if (at >= 0) reachable().slice(0, at + 1).at(-1)?.focus();
}

/** Saves bytes as a file of that name. */
export function download(name: string, content: Blob): void {
  const url = URL.createObjectURL(content);
  const link = el("a", {href: url, download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** "+1.25", "-0.30", a minus sign as wide as the plus. */
export function signed(value: number, digits = 2): string {
  const text = Math.abs(value).toFixed(digits);
  return (Number(text) === 0 ? "\u00a0" : value < 0 ? "\u2212" : "+") + text;
}
