// Work of which only the newest asked for counts: one is under way, the newest waits, others are dropped.

export class Latest<Task> {
  private busy = false;
  private waiting: Task | null = null;

  constructor(private readonly work: (task: Task) => Promise<void>) {}

  ask(task: Task): void {
    this.waiting = task;
    if (!this.busy) void this.run();
  }

  private async run(): Promise<void> {
    this.busy = true;
    while (this.waiting !== null) {
      const task = this.waiting;
      this.waiting = null;
      await this.work(task);
    }
    this.busy = false;
  }
}
