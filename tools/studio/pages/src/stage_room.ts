// A clip on the stage, as captured; no model is needed.
import {getMotion} from "./api";
import {el} from "./dom";
import {Stage} from "./stage";
import {staged} from "./staged";
import type {Room, Studio} from "./studio";

export class StageRoom implements Room {
  readonly id = "stage";
  readonly title = "Stage";
  private stage: Stage | null = null;

  constructor(private readonly studio: Studio) {}

  async enter(host: HTMLElement): Promise<void> {
    const {clip} = this.studio;
    this.stage ??= new Stage();
    host.append(el("div", {class: "room stage-room"}, this.stage.root));
    if (clip === null) return this.stage.setClips([]);
    const motion = await getMotion(`/api/clips/motion?clip=${clip.id}`);
    const shown = await staged(clip.name, clip, motion);
    if (host.isConnected) this.stage.setClips([shown]);
  }
  leave(): void {
    this.stage?.player.pause();
  }
  key(event: KeyboardEvent): boolean {
    return this.stage?.key(event) ?? false;
  }
}
