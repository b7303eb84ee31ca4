// Time: one clock for all that plays.

export type Tick = (time: number) => void;

export class Player {
  time = 0;
  speed = 1;
  loop = true;
  private end = 0;
  private step = 1 / 60;
  private last: number | null = null;
  private readonly listeners: Tick[] = [];
  private readonly rounds: (() => void)[] = [];
  private readonly states: ((playing: boolean) => void)[] = [];

  get playing(): boolean {
    return this.last !== null;
  }
  get duration(): number {
    return this.end;
  }
  onTick(listener: Tick): void {
    this.listeners.push(listener);
  }
  /** Each time that it begins again, or is begun from its start. */
  onLoop(listener: () => void): void {
    this.rounds.push(listener);
  }
  onPlay(listener: (playing: boolean) => void): void {
    this.states.push(listener);
  }

  /** How long what plays is, and how long a frame of it. */
  setExtent(duration: number, step: number): void {
    this.end = duration;
    this.step = step;
    this.seek(Math.min(this.time, duration));
  }
  seek(time: number): void {
    this.time = Math.max(0, Math.min(time, this.end));
    for (const listener of this.listeners) listener(this.time);
  }
  frameStep(frames: number): void {
    this.pause();
    this.seek((Math.round(this.time / this.step) + frames) * this.step);
  }
  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }
  play(): void {
    if (this.playing || this.end <= 0) return;
    if (!this.loop && this.time >= this.end) this.time = 0;
    this.last = performance.now();
    this.tellState();
    if (this.time === 0) this.tellRound();
    requestAnimationFrame(now => this.advance(now));
  }
  pause(): void {
    this.last = null;
    this.tellState();
  }

  private advance(now: number): void {
    if (this.last === null) return;
    let next = this.time + this.speed * Math.max(0, now - this.last) / 1000;
    this.last = now;
    if (next > this.end) {
      if (this.loop) {
        next %= this.end;
        this.tellRound();
      } else {
        this.pause();
      }
    }
    this.seek(next);
    if (this.playing) requestAnimationFrame(later => this.advance(later));
  }
  private tellRound(): void {
    for (const listener of this.rounds) listener();
  }
  private tellState(): void {
    for (const listener of this.states) listener(this.playing);
  }
}
