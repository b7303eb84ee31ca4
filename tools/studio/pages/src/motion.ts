// A motion as the server sends it, and where its joints are at any moment.

export interface Joint {
  name: string;
  parent: number;
  offset: [number, number, number];
  end: [number, number, number] | null;
  side: "left" | "right" | "trunk";
  part: string | null;
}

interface ArrayPlace {
  offset: number;
  type: "float32" | "uint8";
  shape: number[];
}

export interface Motion {
  frames: number;
  rate: number;
  floor: number;
  leg: number;
  joints: Joint[];
  root: Float32Array;
  rotations: Float32Array;
  translations: Float32Array | null;
  contacts: Uint8Array | null;
  sourceFrames: Float32Array | null;
  /** All that the header says, for what only one room reads. */
  header: Record<string, unknown>;
}

export function decodeMotion(buffer: ArrayBuffer): Motion {
  const size = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size))) as
      Record<string, unknown> & {arrays: Record<string, ArrayPlace>};
  const places = header.arrays;
  const count = (place: ArrayPlace) => place.shape.reduce((product, n) => product * n, 1);
  const floats = (name: string) => {
    const place = places[name];
    return place ? new Float32Array(buffer, 4 + size + place.offset, count(place)) : null;
  };
  const touching = places["contacts"];
  return {
    frames: header["frames"] as number,
    rate: header["rate_hz"] as number,
    floor: (header["floor_m"] as number | null) ?? 0,
    leg: header["leg_length_m"] as number,
    joints: header["joints"] as Joint[],
    root: floats("root")!,
    rotations: floats("rotations")!,
    translations: floats("translations"),
    contacts: touching ? new Uint8Array(buffer, 4 + size + touching.offset, count(touching)) : null,
    sourceFrames: floats("source_frames"),
    header,
  };
}

export function duration(motion: Motion): number {
  return (motion.frames - 1) / motion.rate;
}

/** Two motions of one body, one after the other. */
export function joined(a: Motion, b: Motion): Motion {
  const floats = (x: Float32Array, y: Float32Array) => {
    const both = new Float32Array(x.length + y.length);
    both.set(x);
    both.set(y, x.length);
    return both;
  };
  const contacts = a.contacts && b.contacts ? new Uint8Array([...a.contacts, ...b.contacts]) : null;
  return {
    ...a, frames: a.frames + b.frames, root: floats(a.root, b.root), rotations: floats(a.rotations, b.rotations),
    translations: a.translations && b.translations && floats(a.translations, b.translations), contacts, sourceFrames: null,
  };
}

/** Positions and model-space rotations of all joints at one moment. */
export class Pose {
  readonly positions: Float32Array;
  readonly rotations: Float32Array;

  constructor(readonly motion: Motion) {
    this.positions = new Float32Array(3 * motion.joints.length);
    this.rotations = new Float32Array(4 * motion.joints.length);
  }

  /** @param frame of the motion; fractions lie between frames. */
  set(frame: number): this {
    const {motion} = this;
    const count = motion.joints.length;
    const a = Math.max(0, Math.min(Math.floor(frame), motion.frames - 1));
    const b = Math.min(a + 1, motion.frames - 1);
    const share = Math.max(0, Math.min(frame - a, 1));
    const q = [0, 0, 0, 1];
    const offset = [0, 0, 0];
    for (let j = 0; j < count; ++j) {
      const {parent} = motion.joints[j];
      localRotation(motion.rotations, 4 * (a * count + j), 4 * (b * count + j), share, q);
      for (let k = 0; k < 3; ++k) {
        if (motion.translations && parent >= 0) {
          offset[k] = mix(motion.translations[3 * (a * count + j) + k], motion.translations[3 * (b * count + j) + k], share);
        } else if (parent < 0) {
          offset[k] = mix(motion.root[3 * a + k], motion.root[3 * b + k], share);
        } else {
          offset[k] = motion.joints[j].offset[k];
        }
      }
      this.place(j, parent, q, offset);
    }
    return this;
  }

  /** Where a place of the model is in a joint's space. */
  local(joint: number, place: readonly number[]): [number, number, number] {
    const [x, y, z, w] = this.rotations.subarray(4 * joint, 4 * joint + 4);
    return rotate(new Float32Array([-x, -y, -z, w]), 0, place.map((value, k) => value - this.positions[3 * joint + k]));
  }

  /** Where a point of a joint's space is. */
  point(joint: number, local: readonly number[]): [number, number, number] {
    const turned = rotate(this.rotations, 4 * joint, local);
    return [0, 1, 2].map(k => this.positions[3 * joint + k] + turned[k]) as [number, number, number];
  }

  private place(j: number, parent: number, q: number[], offset: number[]): void {
    if (parent < 0) {
      this.positions.set(offset, 3 * j);
      this.rotations.set(q, 4 * j);
      return;
    }
    const turned = rotate(this.rotations, 4 * parent, offset);
    for (let k = 0; k < 3; ++k) this.positions[3 * j + k] = this.positions[3 * parent + k] + turned[k];
    const r = this.rotations, p = 4 * parent;
    const [x, y, z, w] = q;
    const [px, py, pz, pw] = [r[p], r[p + 1], r[p + 2], r[p + 3]];
    r[4 * j] = pw * x + px * w + py * z - pz * y;
    r[4 * j + 1] = pw * y - px * z + py * w + pz * x;
    r[4 * j + 2] = pw * z + px * y - py * x + pz * w;
    r[4 * j + 3] = pw * w - px * x - py * y - pz * z;
  }
}

function mix(a: number, b: number, share: number): number {
  return a + share * (b - a);
}

function localRotation(q: Float32Array, a: number, b: number, share: number, out: number[]): void {
  let dot = 0, length = 0;
  for (let k = 0; k < 4; ++k) dot += q[a + k] * q[b + k];
  const sign = dot < 0 ? -1 : 1;
  for (let k = 0; k < 4; ++k) {
    out[k] = (1 - share) * q[a + k] + sign * share * q[b + k];
    length += out[k] * out[k];
  }
  length = Math.sqrt(length);
  for (let k = 0; k < 4; ++k) out[k] /= length;
}

function rotate(q: Float32Array, at: number, v: readonly number[]): [number, number, number] {
  const x = q[at], y = q[at + 1], z = q[at + 2], w = q[at + 3];
  const tx = 2 * (y * v[2] - z * v[1]), ty = 2 * (z * v[0] - x * v[2]), tz = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
}
