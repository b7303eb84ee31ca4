// What every room has above its controls: undo and redo, and its state and what it makes as files.
import {postForFile, postJson} from "./api";
import {button, download, el} from "./dom";
import {parsedFile} from "./files";
import {History} from "./history";
import type {Studio} from "./studio";

/** What a room is set to: plain data, which the matching verb takes as a file. */
export interface RoomState {
  schema: string;
}

export interface StateUse<State> {
  schema: string;
  /** The verb that takes it: "laban apply". */
  verb: string;
  /** Called with every state that stands for good. */
  changed: (state: State) => void;
  /** Where the server reads a state that was saved, and refuses what the verb would. */
  checked: string;
  /** What is asked of `path` + "?format=bvh" for a file of what the room makes. */
  exported: {path: string; body: (state: State) => unknown};
  /** A saved state as one of what is open here; the state itself if left out. */
  adopted?: (saved: State, present: State) => State;
}

export class StateTools<State extends RoomState> {
  readonly root: HTMLElement;
  private history: History<State> | null = null;
  private readonly histories = new Map<string, History<State>>();
  private readonly undo = button("Undo", "Undo (Ctrl+Z)", () => this.history?.undo());
  private readonly redo = button("Redo", "Redo (Ctrl+Shift+Z)", () => this.history?.redo());

  constructor(studio: Studio, private readonly use: StateUse<State>) {
    const file = el("input", {type: "file", accept: ".json,application/json", hidden: true, "aria-label": "State to open", tabindex: -1});
    file.addEventListener("change", () => void studio.attempt(async () => {
      const [chosen] = file.files ?? [];
      file.value = "";
      if (!chosen) return;
      if (!await this.open(await parsedFile(chosen))) throw new Error(`${chosen.name}: no state of this room`);
    }));
    this.root = el("div", {class: "bar tools", role: "toolbar", "aria-label": "State and files"},
      this.undo, this.redo,
      button("Save state", `Save what is set here; ${use.verb} --state takes it`, () =>
        download("room.json", new Blob([JSON.stringify(this.state, null, 2)], {type: "application/json"}))),
      button("Open state", "Open what was saved", () => file.click()), file,
      ...["bvh", "glb"].map(format => button(`Export ${format.toUpperCase()}`, `The output as a ${format.toUpperCase()} file`,
                                             () => void studio.attempt(() => this.export(format)))));
    this.showHistory();
  }

  get begun(): boolean {
    return this.history !== null;
  }
  get state(): State {
    return this.history!.state;
  }

  /**
   * A history of its own, from this state on.
   * @param of  whose it is: one that was begun of the same goes on instead.
   */
  begin(state: State, of?: string): void {
    const begun = of === undefined ? undefined : this.histories.get(of);
    this.history = begun ?? new History(state, now => this.tell(now));
    if (of !== undefined) this.histories.set(of, this.history);
    this.tell(this.state);
  }

  /** A step of the history; changes of one kind that follow each other fast are one. True if it was one. */
  change(edit: (state: State) => void, kind = ""): boolean {
    const before = this.state, state = this.state;
    edit(state);
    this.history!.push(state, kind);
    return JSON.stringify(before) !== JSON.stringify(state);
  }

  /** Takes a state that was saved; true if it is one of this room's. @throws the server's word on one that is wrong. */
  async open(saved: unknown): Promise<boolean> {
    const state = saved as State, {history} = this;
    if (state?.schema !== this.use.schema || history === null) return false;
    const adopted = this.use.adopted?.(state, this.state) ?? state;
    await postJson(this.use.checked, {state: adopted});
    if (history === this.history) history.push(adopted);
    return true;
  }

  /** True for the keys of undo and redo. */
  key(event: KeyboardEvent): boolean {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return false;
    if (event.shiftKey) this.history?.redo();
    else this.history?.undo();
    return true;
  }

  private tell(state: State): void {
    this.showHistory();
    this.use.changed(state);
  }

  private showHistory(): void {
    this.undo.disabled = !this.history?.canUndo;
    this.redo.disabled = !this.history?.canRedo;
  }

  private async export(format: string): Promise<void> {
    const {path, body} = this.use.exported;
    const {name, content} = await postForFile(`${path}?format=${format}`, body(this.state));
    download(name, content);
  }
}
