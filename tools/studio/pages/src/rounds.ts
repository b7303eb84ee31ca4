// A loop played round after round, for the eye: each round goes on where the one before has ended.
import type {Motion} from "./motion";

/** What one round does to every point of a body: a turn about the vertical, then a shift over the ground. */
export interface RoundMotion {
  /** Radians. */
  yaw: number;
  /** Metres, x and z. */
  shift: [number, number];
}

/** Frames of a preview, at most: what a stage holds easily. */
const MOST_FRAMES = 20000;

/** The rounds, and the frame that would begin the next one, so that nothing is missing where it begins again. */
export function playedAgain(motion: Motion, rounds: number, round: RoundMotion): Motion {
  const count = Math.max(1, Math.min(rounds, Math.floor(MOST_FRAMES / motion.frames)));
  const frames = count * motion.frames + 1;
  const again = <A extends Float32Array | Uint8Array>(values: A, made: A): A => {
    const width = values.length / motion.frames;
    for (let n = 0; n < count; ++n) made.set(values, n * values.length);
    made.set(values.subarray(0, width), count * values.length);
    return made;
  };
  const floats = (values: Float32Array) => again(values, new Float32Array(values.length / motion.frames * frames));
  const played: Motion = {
    ...motion, frames,
    root: floats(motion.root),
    rotations: floats(motion.rotations),
    translations: motion.translations && floats(motion.translations),
    contacts: motion.contacts && again(motion.contacts, new Uint8Array(motion.contacts.length / motion.frames * frames)),
    sourceFrames: motion.sourceFrames && floats(motion.sourceFrames),
  };
  for (let f = motion.frames; f < frames; ++f) moveOn(played, f, f - motion.frames, round);
  return played;
}

/** Places the root of a frame where `before`, a round earlier, is moved to. */
function moveOn(motion: Motion, frame: number, before: number, {yaw, shift}: RoundMotion): void {
  const {root, rotations} = motion, width = 4 * motion.joints.length;
  const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
  const [x, z] = [root[3 * before], root[3 * before + 2]];
  root[3 * frame] = cos * x + sin * z + shift[0];
  root[3 * frame + 2] = cos * z - sin * x + shift[1];
  const [s, c] = [Math.sin(yaw / 2), Math.cos(yaw / 2)];
  const [qx, qy, qz, qw] = rotations.subarray(width * before, width * before + 4);
  rotations.set([c * qx + s * qz, c * qy + s * qw, c * qz - s * qx, c * qw - s * qy], width * frame);
}
