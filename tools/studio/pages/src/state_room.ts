// A room with a stage and a state: what all of these do alike.
import type {Stage} from "./stage";
import type {RoomState, StateTools} from "./state_tools";
import type {Room} from "./studio";

export abstract class StateRoom<State extends RoomState> implements Room {
  abstract readonly id: string;
  abstract readonly title: string;
  protected abstract readonly stage: Stage;
  protected abstract readonly tools: StateTools<State>;

  abstract enter(host: HTMLElement): Promise<void>;

  leave(): void {
    this.stage.player.pause();
  }

  key(event: KeyboardEvent): boolean {
    if (this.tools.key(event)) return true;
    return !event.ctrlKey && !event.metaKey && this.stage.key(event);
  }

  async open(state: unknown): Promise<boolean> {
    return this.tools.open(state);
  }
}
