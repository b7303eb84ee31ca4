// A body drawn as bones with volume, from the poses of a motion.
import * as THREE from "three";
import {Pose, type Joint, type Motion} from "./motion";

interface Bone {
  from: number;
  /** A joint, or an end in the space of `from`. */
  to: number | [number, number, number];
  side: Joint["side"];
  radius: number;
}

export interface SideColors {
  left: THREE.Color;
  right: THREE.Color;
  trunk: THREE.Color;
}

/** One bone of unit length along +Y, thickest near its joint. */
const BONE = (() => {
  const profile = [[0, 0], [0.55, 0.03], [1, 0.18], [0.75, 0.6], [0.45, 0.95], [0, 1]];
  return new THREE.LatheGeometry(profile.map(([r, y]) => new THREE.Vector2(r, y)), 8);
})();

const UP = new THREE.Vector3(0, 1, 0);

function bonesOf(motion: Motion): Bone[] {
  const bones: Bone[] = [];
  const has = new Set(motion.joints.map(joint => joint.parent));
  const thick = (length: number) => Math.min(0.05 * motion.leg, 0.012 * motion.leg + 0.13 * length);
  motion.joints.forEach((joint, j) => {
    const length = Math.hypot(...joint.offset);
    if (joint.parent >= 0 && length > 0.01 * motion.leg)
      bones.push({from: joint.parent, to: j, side: joint.side, radius: thick(length)});
    if (joint.end !== null && !has.has(j) && Math.hypot(...joint.end) > 0.01 * motion.leg)
      bones.push({from: j, to: joint.end, side: joint.side, radius: thick(Math.hypot(...joint.end))});
  });
  return bones;
}

export class Figure {
  readonly root = new THREE.Group();
  private readonly pose: Pose;
  private readonly bones: Bone[];
  private readonly mesh: THREE.InstancedMesh;
  private readonly matrix = new THREE.Matrix4();
  private readonly turn = new THREE.Quaternion();
  private readonly a = new THREE.Vector3();
  private readonly b = new THREE.Vector3();
  private readonly size = new THREE.Vector3();

  /** @param tint  one colour for all of it and how solid it is, for what was and what comes. */
  constructor(readonly motion: Motion, colors: SideColors, tint?: {color: THREE.Color; opacity: number}) {
    this.pose = new Pose(motion);
    this.bones = bonesOf(motion);
    const material = new THREE.MeshLambertMaterial({
      transparent: tint !== undefined, opacity: tint?.opacity ?? 1, depthWrite: tint === undefined,
    });
    this.mesh = new THREE.InstancedMesh(BONE, material, this.bones.length);
    this.mesh.frustumCulled = false;
    this.bones.forEach((bone, n) => this.mesh.setColorAt(n, tint?.color ?? colors[bone.side]));
    this.root.add(this.mesh);
  }

  /** Puts the body where it is at a frame, whole or not. */
  show(frame: number): Pose {
    this.pose.set(frame);
    const at = this.pose.positions;
    this.bones.forEach((bone, n) => {
      this.a.fromArray(at, 3 * bone.from);
      if (typeof bone.to === "number") this.b.fromArray(at, 3 * bone.to);
      else this.b.fromArray(this.pose.point(bone.from, bone.to));
      this.b.sub(this.a);
      const length = Math.max(this.b.length(), 1e-6);
      this.turn.setFromUnitVectors(UP, this.b.divideScalar(length));
      this.size.set(bone.radius, length, bone.radius);
      this.mesh.setMatrixAt(n, this.matrix.compose(this.a, this.turn, this.size));
    });
    this.mesh.instanceMatrix.needsUpdate = true;
    return this.pose;
  }

  dispose(): void {
    this.mesh.dispose();
    (this.mesh.material as THREE.Material).dispose();
  }
}
