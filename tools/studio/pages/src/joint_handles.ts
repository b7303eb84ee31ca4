// Handles on joints of who is on the stage: dragged in the plane of the picture, they tell where to.
import * as THREE from "three";
import {el} from "./dom";
import {follow} from "./drag";
import type {Pane} from "./pane";

export type Place = [number, number, number];

/** A joint in the hand: where it is dragged to, metres. */
export interface HeldJoint {
  moved: (place: Place) => void;
  dropped: (place: Place) => void;
  /** It is to be where it was. */
  givenUp: () => void;
}

export interface JointHandlesUse {
  /** Standard parts that have a handle: "left_hand", .. */
  parts: string[];
  /** Called when a joint is taken; null: it cannot be. */
  hold: (part: string) => HeldJoint | null;
}

/** What a joint is called: "left elbow". */
export function jointName(part: string): string {
  return part.replace("forearm", "elbow").replace("shin", "knee").replace("_", " ");
}

/** A drag shorter than this moves nothing, pixels. */
const CLICK = 3;

export class JointHandles {
  readonly root = el("div", {class: "handles"});
  private readonly handles = new Map<string, HTMLElement>();
  private pane: Pane | null = null;
  private left = 0;
  private width = 1;
  private height = 1;
  private held: string | null = null;

  constructor(private readonly use: JointHandlesUse) {
    for (const part of use.parts) {
      const handle = el("div", {class: "handle", title: `Drag to pin the ${jointName(part)} at this frame`, "data-part": part});
      handle.addEventListener("pointerdown", event => this.hold(event, part));
      this.handles.set(part, handle);
      this.root.append(handle);
    }
  }

  /** Puts the handles over the last body of a pane, which is drawn from `left` on; away while it plays. */
  place(pane: Pane | undefined, left: number, width: number, height: number, playing: boolean): void {
    this.pane = pane ?? null;
    [this.left, this.width, this.height] = [left, width, height];
    this.root.hidden = pane === undefined || playing;
    if (this.root.hidden) return;
    for (const [part, handle] of this.handles) {
      const joint = pane!.joint(part);
      handle.hidden = joint === null;
      if (joint === null || this.held === part) continue;
      const {x, y} = joint.project(pane!.camera);
      this.moveTo(handle, left + 0.5 * width * (1 + x), 0.5 * height * (1 - y));
    }
  }

  private moveTo(handle: HTMLElement, x: number, y: number): void {
    handle.style.transform = `translate(${x}px, ${y}px)`;
  }

  private hold(event: PointerEvent, part: string): void {
    const {pane} = this, handle = this.handles.get(part)!;
    const joint = pane?.joint(part), held = joint ? this.use.hold(part) : null;
    if (!pane || !joint || held === null) return;
    event.preventDefault();
    event.stopPropagation();
    const depth = joint.project(pane.camera).z;
    const box = this.root.getBoundingClientRect();
    const placeOf = (at: PointerEvent): Place => {
      const [x, y] = [at.clientX - box.left, at.clientY - box.top];
      this.moveTo(handle, x, y);
      const world = new THREE.Vector3(2 * (x - this.left) / this.width - 1, 1 - 2 * y / this.height, depth).unproject(pane.camera);
      return [world.x, world.y, world.z];
    };
    this.held = part;
    let far = false;
    const release = () => this.held = null;
    follow(handle, event, {
      moved: next => {
        far ||= Math.hypot(next.clientX - event.clientX, next.clientY - event.clientY) >= CLICK;
        if (far) held.moved(placeOf(next));
      },
      dropped: last => {
        release();
        if (far) held.dropped(placeOf(last));
      },
      givenUp: () => {
        release();
        held.givenUp();
      },
    });
  }
}
