// A clip on the stage, as captured; no model is needed.
import {getMotion, getBytes, type ClipInfo} from "./api";
import {Character} from "./character";
import {el} from "./dom";
import type {Motion} from "./motion";
import {Stage, type StagedClip} from "./stage";
import type {Room, Studio} from "./studio";

/** A motion of a clip for the stage, with the clip's character if it has one that can be shown. */
export async function staged(label: string, clip: ClipInfo, motion: Motion): Promise<StagedClip> {
  if (!clip.has_mesh) return {label, motion};
  try {
    return {label, motion, character: await Character.load(await getBytes(`/api/clips/mesh?clip=${clip.id}`), motion)};
  } catch (error) {
    return {label: `${label} (no character: ${error instanceof Error ? error.message : String(error)})`, motion};
  }
}

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
