// Dark and light: the system's choice, or the one made here.

type Theme = "light" | "dark";

const listeners: (() => void)[] = [];
const system = matchMedia("(prefers-color-scheme: dark)");
let chosen: Theme | null = null;

export function theme(): Theme {
  return chosen ?? (system.matches ? "dark" : "light");
}

export function chooseTheme(next: Theme): void {
  chosen = next;
  tell();
}

export function onTheme(listener: () => void): void {
  listeners.push(listener);
}

/** A colour of the style sheet, such as "--left". */
export function ink(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function tell(): void {
  document.documentElement.dataset["theme"] = theme();
  for (const listener of listeners) listener();
}

system.addEventListener("change", tell);
tell();
