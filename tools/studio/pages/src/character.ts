// A skinned character that plays the poses of a motion.
import * as THREE from "three";
import {GLTFLoader} from "three/addons/loaders/GLTFLoader.js";
import {Pose, type Motion} from "./motion";

interface Bound {
  bone: THREE.Bone;
  joint: number;
  /** Of the bone where the skin was bound, in model space, with the joint at the origin. */
  rest: THREE.Matrix4;
}

/** The similarity that takes three points to three others: from the skin's space to the model's. */
function similarity(from: THREE.Vector3[], to: THREE.Vector3[]): THREE.Matrix4 {
  const frame = (points: THREE.Vector3[]) => {
    const x = points[1].clone().sub(points[0]);
    const size = x.length();
    x.normalize();
    const z = x.clone().cross(points[2].clone().sub(points[0])).normalize();
    const y = z.clone().cross(x);
    return new THREE.Matrix4().makeBasis(x, y, z).scale(new THREE.Vector3(size, size, size)).setPosition(points[0]);
  };
  return frame(to).multiply(frame(from).invert());
}

/** Rest positions of all joints: every rest rotation is the identity. */
function restPositions(motion: Motion): THREE.Vector3[] {
  const rest: THREE.Vector3[] = [];
  for (const joint of motion.joints) {
    const offset = new THREE.Vector3(...joint.offset);
    rest.push(joint.parent < 0 ? offset : offset.add(rest[joint.parent]));
  }
  return rest;
}

export class Character {
  private readonly bound: Bound[] = [];
  private readonly matrix = new THREE.Matrix4();
  private readonly turn = new THREE.Quaternion();
  private readonly at = new THREE.Vector3();
  private static readonly one = new THREE.Vector3(1, 1, 1);

  /** @param nodeOf  which node of the file a bone is. */
  private constructor(readonly root: THREE.Object3D, motion: Motion, nodeOf: (bone: THREE.Object3D) => number | undefined) {
    const rest = restPositions(motion);
    const inverses = new Map<THREE.Bone, THREE.Matrix4>();
    root.traverse(node => {
      if (!(node instanceof THREE.SkinnedMesh)) return;
      node.frustumCulled = false;
      node.skeleton.bones.forEach((bone, n) => inverses.set(bone, node.skeleton.boneInverses[n]));
    });
    const found: {bone: THREE.Bone; joint: number; bind: THREE.Matrix4}[] = [];
    for (const [bone, inverse] of inverses) {
      // A node without a name is a joint named after its number.
      const unnamed = `node_${nodeOf(bone)}`;
      const joint = motion.joints.findIndex(candidate => candidate.name === unnamed ||
        (bone.name !== "" && THREE.PropertyBinding.sanitizeNodeName(candidate.name) === bone.name));
      if (joint >= 0) found.push({bone, joint, bind: inverse.clone().invert()});
    }
    const corners = farApart(found.map(one => rest[one.joint]));
    if (corners === null) return;
    const toModel = similarity(corners.map(n => new THREE.Vector3().setFromMatrixPosition(found[n].bind)),
                               corners.map(n => rest[found[n].joint]));
    for (const {bone, joint, bind} of found) {
      bone.matrixWorldAutoUpdate = false;
      const away = new THREE.Matrix4().makeTranslation(rest[joint].clone().negate());
      this.bound.push({bone, joint, rest: away.multiply(toModel).multiply(bind)});
    }
  }

  /** @throws if the bytes are no character that plays this motion. */
  static async load(bytes: ArrayBuffer, motion: Motion): Promise<Character> {
    const gltf = await new GLTFLoader().parseAsync(bytes, "");
    const character = new Character(gltf.scene, motion, bone => gltf.parser.associations.get(bone)?.nodes);
    if (character.bound.length === 0) throw new Error("the character's bones are not the motion's");
    return character;
  }

  show(pose: Pose): void {
    for (const {bone, joint, rest} of this.bound) {
      this.turn.fromArray(pose.rotations, 4 * joint);
      this.at.fromArray(pose.positions, 3 * joint);
      bone.matrixWorld.copy(this.matrix.compose(this.at, this.turn, Character.one).multiply(rest));
    }
  }
}

/** Three points that span a wide triangle; null if all lie on a line. */
function farApart(points: THREE.Vector3[]): [number, number, number] | null {
  if (points.length < 3) return null;
  const farthest = (distance: (p: THREE.Vector3) => number) =>
    points.reduce((best, p, n) => distance(p) > distance(points[best]) ? n : best, 0);
  const a = 0, b = farthest(p => p.distanceTo(points[a]));
  const line = new THREE.Line3(points[a], points[b]);
  const off = (p: THREE.Vector3) => line.closestPointToPoint(p, false, new THREE.Vector3()).distanceTo(p);
  const c = farthest(off);
  return off(points[c]) > 1e-3 ? [a, b, c] : null;
}
