// Undo and redo over a state that is plain data.

export class History<State> {
  private readonly states: string[];
  private at = 0;
  private lastKind = "";
  private lastTime = -Infinity;

  constructor(state: State, private readonly changed: (state: State) => void) {
    this.states = [JSON.stringify(state)];
  }

  get state(): State {
    return JSON.parse(this.states[this.at]) as State;
  }
  get canUndo(): boolean {
    return this.at > 0;
  }
  get canRedo(): boolean {
    return this.at + 1 < this.states.length;
  }

  /**
   * Takes a new state; what was undone is gone. A state like the present one is no step, and changes
   * of one kind that follow each other within a second, as while a key is held, are one.
   */
  push(state: State, kind = ""): void {
    const text = JSON.stringify(state);
    if (text === this.states[this.at]) return;
    const now = performance.now();
    const goesOn = kind !== "" && kind === this.lastKind && now - this.lastTime < 1000 && this.at > 0 && !this.canRedo;
    [this.lastKind, this.lastTime] = [kind, now];
    this.states.splice(this.at + (goesOn ? 0 : 1), Infinity, text);
    // Enough for any sitting; states are a kilobyte each.
    if (this.states.length > 1000) this.states.shift();
    this.at = this.states.length - 1;
    this.changed(this.state);
  }
  undo(): void {
    if (this.canUndo) this.go(this.at - 1);
  }
  redo(): void {
    if (this.canRedo) this.go(this.at + 1);
  }

  private go(at: number): void {
    this.at = at;
    this.lastKind = "";
    this.changed(this.state);
  }
}
