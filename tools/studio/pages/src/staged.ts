// Clips as they are put on the stage, with their characters.
import {getBytes, getMotion, type ClipInfo} from "./api";
import {Character} from "./character";
import {el} from "./dom";
import {messageOf} from "./files";
import type {Motion} from "./motion";
import type {StagedClip} from "./stage";

/** A motion of a clip for the stage, with the clip's character if it has one that can be shown. */
export async function staged(label: string, clip: ClipInfo, motion: Motion): Promise<StagedClip> {
  if (!clip.has_mesh) return {label, motion};
  try {
    return {label, motion, character: await Character.load(await getBytes(`/api/clips/mesh?clip=${clip.id}`), motion)};
  } catch (error) {
    return {label: `${label} (no character: ${messageOf(error)})`, motion};
  }
}

/** A clip as a room's input; and its character once more, for the output: one is in one pane at a time. */
export async function stagedInput(clip: ClipInfo): Promise<{input: StagedClip; outputCharacter: Character | null}> {
  const motion = await getMotion(`/api/clips/motion?clip=${clip.id}`);
  const input = await staged(`input: ${clip.name}`, clip, motion);
  return {input, outputCharacter: (await staged("", clip, motion)).character ?? null};
}

/** What a room that needs a clip says while none is open. */
export const noClip = (): HTMLElement => el("p", {class: "hint"}, "Drop a clip (.bvh, .glb, .amc with its .asf) anywhere on the page.");
