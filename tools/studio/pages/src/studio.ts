// What rooms share: the stage's clips, where trouble is told, what files mean.
import type {ClipInfo} from "./api";

export interface Studio {
  readonly clips: ClipInfo[];
  /** The clip that is worked on; null: none is open. */
  readonly clip: ClipInfo | null;
  /** Tells an error, in the server's words; "" takes the last one away. */
  tell(trouble: string): void;
  /** Runs work; what goes wrong is told. */
  attempt(work: () => Promise<void>): Promise<void>;
}

export interface Room {
  readonly id: string;
  readonly title: string;
  /** Shows the room; called once for each time that it is entered. @param host  gone from the page if it is left meanwhile. */
  enter(host: HTMLElement): Promise<void>;
  /** Stops what runs. */
  leave(): void;
  /** True if the key meant something here. */
  key(event: KeyboardEvent): boolean;
  /** Takes a state that was saved; true if it is one of this room's. */
  open?(state: unknown): Promise<boolean>;
}
