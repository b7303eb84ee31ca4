// One view of the stage: bodies, their trails, what was and what comes, on a floor.
import * as THREE from "three";
import {Character} from "./character";
import {Figure, type SideColors} from "./figure";
import {Pose, type Motion} from "./motion";
import {ink} from "./theme";

/** Seconds between onion skins, and how many there are on either side. */
const SKIN_STEP = 0.15;
const SKINS = 3;

export interface PaneOptions {
  skins: boolean;
  contacts: boolean;
  character: boolean;
  /** Standard parts whose paths are drawn: "left_hand", .. */
  trails: string[];
}

/** A motion in a pane. */
export interface Actor {
  motion: Motion;
  label: string;
  character: Character | null;
  /** Drawn faint, as something to compare with. */
  ghost: boolean;
  /** The frame at a moment of the clock. */
  frameAt: (time: number) => number;
}

class Body {
  readonly root = new THREE.Group();
  private readonly figure: Figure;
  private readonly skins: {figure: Figure; away: number}[] = [];
  private readonly marks: {joint: number; foot: number; mesh: THREE.Mesh}[] = [];

  constructor(readonly actor: Actor, options: PaneOptions) {
    const {motion} = actor;
    const color = (name: string) => new THREE.Color(ink(name));
    const colors: SideColors = {left: color("--left"), right: color("--right"), trunk: color("--trunk")};
    this.figure = new Figure(motion, colors, actor.ghost ? {color: color("--trunk"), opacity: 0.35} : undefined);
    this.root.add(this.figure.root);
    if (options.character && actor.character) {
      this.figure.root.visible = false;
      this.root.add(actor.character.root);
    }
    for (let n = -SKINS; n <= SKINS && options.skins; ++n) {
      if (n === 0) continue;
      const tint = {color: color(n < 0 ? "--past" : "--future"), opacity: 0.3 - 0.07 * Math.abs(n)};
      const figure = new Figure(motion, colors, tint);
      this.skins.push({figure, away: n * SKIN_STEP * motion.rate});
      this.root.add(figure.root);
    }
    if (options.contacts && motion.contacts) this.addMarks(color("--contact"));
    for (const part of options.trails) this.addTrail(part, color);
  }

  show(time: number): Pose {
    const frame = this.actor.frameAt(time);
    const {motion} = this.actor;
    const pose = this.figure.show(frame);
    if (!this.figure.root.visible) this.actor.character?.show(pose);
    for (const {figure, away} of this.skins) {
      const at = frame + away;
      figure.root.visible = at >= 0 && at <= motion.frames - 1;
      if (figure.root.visible) figure.show(at);
    }
    for (const {joint, foot, mesh} of this.marks) {
      mesh.visible = motion.contacts![2 * Math.round(Math.min(frame, motion.frames - 1)) + foot] === 1;
      mesh.position.set(pose.positions[3 * joint], motion.floor - 0.02 * motion.leg, pose.positions[3 * joint + 2]);
    }
    return pose;
  }

  dispose(): void {
    this.figure.dispose();
    for (const {figure} of this.skins) figure.dispose();
    this.root.traverse(node => {
      if (node instanceof THREE.Line || this.marks.some(mark => mark.mesh === node)) {
        (node as THREE.Mesh).geometry.dispose();
        ((node as THREE.Mesh).material as THREE.Material).dispose();
      }
    });
  }

  private addMarks(color: THREE.Color): void {
    const {motion} = this.actor;
    for (const [foot, part] of ["left_foot", "right_foot"].entries()) {
      const joint = motion.joints.findIndex(one => one.part === part);
      if (joint < 0) continue;
      const disc = new THREE.CircleGeometry(0.13 * motion.leg, 20).rotateX(-Math.PI / 2);
      const mesh = new THREE.Mesh(disc, new THREE.MeshBasicMaterial({color, transparent: true, opacity: 0.7}));
      this.marks.push({joint, foot, mesh});
      this.root.add(mesh);
    }
  }

  private addTrail(part: string, color: (name: string) => THREE.Color): void {
    const {motion} = this.actor;
    const joint = motion.joints.findIndex(one => one.part === part);
    if (joint < 0) return;
    const pose = new Pose(motion);
    const path = new Float32Array(3 * motion.frames);
    for (let f = 0; f < motion.frames; ++f) path.set(pose.set(f).positions.subarray(3 * joint, 3 * joint + 3), 3 * f);
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(path, 3));
    const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({
      color: color("--" + motion.joints[joint].side), transparent: true, opacity: 0.6,
    }));
    line.frustumCulled = false;
    this.root.add(line);
  }
}

/** Where the camera looks from, shared by all panes. */
export interface View {
  yaw: number;
  pitch: number;
  zoom: number;
  follow: boolean;
}

export class Pane {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(35, 1, 0.05, 200);
  private readonly bodies: Body[];
  private readonly grid: THREE.GridHelper;
  private readonly middle = new THREE.Vector3();
  private readonly target = new THREE.Vector3();
  private readonly leg: number;
  private readonly height: number;
  private readonly reach: number;
  /** Of the last body, as drawn last. */
  private pose: Pose | null = null;

  constructor(readonly actors: Actor[], options: PaneOptions) {
    const last = actors[actors.length - 1].motion;
    this.leg = last.leg;
    // Of who stands as at the first frame; a head reaches above its joint.
    const {positions} = new Pose(last).set(0);
    this.height = 1.12 * Math.max(2 * last.leg, ...positions.filter((_, n) => n % 3 === 1).map(y => y - last.floor));
    this.bodies = actors.map(actor => new Body(actor, {...options, skins: options.skins && !actor.ghost}));
    for (const body of this.bodies) this.scene.add(body.root);
    this.grid = new THREE.GridHelper(40, 80, ink("--line"), ink("--line"));
    (this.grid.material as THREE.Material).transparent = true;
    (this.grid.material as THREE.Material).opacity = 0.45;
    this.scene.add(this.grid);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(2, 5, 3);
    this.scene.add(sun);
    const box = new THREE.Box3().setFromArray(last.root as unknown as number[]);
    box.getCenter(this.middle);
    this.reach = Math.max(box.max.x - box.min.x, box.max.z - box.min.z);
  }

  show(time: number, view: View, aspect: number): void {
    let pose: Pose | null = null;
    for (const body of this.bodies) pose = body.show(time);
    this.pose = pose;
    const floor = this.actors[this.actors.length - 1].motion.floor;
    const root = pose!.positions;
    this.target.set(view.follow ? root[0] : this.middle.x, floor + 0.48 * this.height, view.follow ? root[2] : this.middle.z);
    const away = (2 * this.height + (view.follow ? 0 : 1.4 * this.reach)) / view.zoom * Math.max(1, 0.8 / aspect);
    this.camera.position.set(
      this.target.x + away * Math.sin(view.yaw) * Math.cos(view.pitch),
      this.target.y + away * Math.sin(view.pitch),
      this.target.z + away * Math.cos(view.yaw) * Math.cos(view.pitch));
    this.camera.up.set(0, 1, 0);
    // Straight from above there is no up; what lies ahead is up then.
    if (Math.abs(view.pitch) > 1.55) this.camera.up.set(-Math.sin(view.yaw), 0, -Math.cos(view.yaw));
    this.camera.lookAt(this.target);
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    this.grid.position.set(Math.round(2 * this.target.x) / 2, floor - 0.025 * this.leg, Math.round(2 * this.target.z) / 2);
  }

  /** Where the joint of a standard part of the last body is; null: it has none. */
  joint(part: string): THREE.Vector3 | null {
    const joint = this.pose?.motion.joints.findIndex(one => one.part === part) ?? -1;
    return joint < 0 ? null : new THREE.Vector3().fromArray(this.pose!.positions, 3 * joint);
  }

  dispose(): void {
    for (const body of this.bodies) body.dispose();
    this.grid.geometry.dispose();
    (this.grid.material as THREE.Material).dispose();
  }
}
