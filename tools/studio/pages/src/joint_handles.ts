// Handles on joints of who is on the stage: dragged in the plane of the picture, they tell where to.
import * as THREE from "three";
import {el} from "./dom";
import {follow} from "./drag";
import type {Pane} from "./pane";

export interface JointHandlesUse {
  /** Standard parts that have a handle: "left_hand", .. */
  parts: string[];
  /** Where a joint is dragged to, metres; `done` with the last of it. */
  dragged: (part: string, place: [number, number, number], done: boolean) => void;
  /** A drag was given up. */
  givenUp: () => void;
}

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
      const handle = el("div", {class: "handle", title: `Drag to pin the ${part.replace("_", " ")} at this frame`});
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
    const joint = pane?.joint(part);
    if (!pane || !joint) return;
    event.preventDefault();
    event.stopPropagation();
    const depth = joint.project(pane.camera).z;
    const box = this.root.getBoundingClientRect();
    const placeOf = (at: PointerEvent): [number, number, number] => {
      const [x, y] = [at.clientX - box.left, at.clientY - box.top];
      this.moveTo(handle, x, y);
      const world = new THREE.Vector3(2 * (x - this.left) / this.width - 1, 1 - 2 * y / this.height, depth).unproject(pane.camera);
      return [world.x, world.y, world.z];
    };
    this.held = part;
    follow(handle, event, {
      moved: next => this.use.dragged(part, placeOf(next), false),
      dropped: last => {
        this.held = null;
        this.use.dragged(part, placeOf(last), true);
      },
      givenUp: () => {
        this.held = null;
        this.use.givenUp();
      },
    });
  }
}
