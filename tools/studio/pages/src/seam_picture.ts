// A seam joint by joint: where in the overlap each joint leaves the end of the clip for its beginning.
import {el, svg} from "./dom";
import type {Joint} from "./motion";

export interface Seam {
  out_begin: number;
  in_begin: number;
  frames: number;
  played_frames: number;
  distance_m: number;
  /** For each joint of the rig the first frame of the overlap that is of the beginning. */
  switch_frames: number[];
  speed_ratio: number;
  acceleration_ratio: number;
}

const NAMES = 96;
const WIDTH = 380;
const ROW = 13;

export class SeamPicture {
  readonly root: HTMLElement;
  private readonly picture = svg("svg", {role: "img"});
  private readonly told = el("p", {class: "quality"});
  private seam: Seam | null = null;

  /** @param picked  called with the frame of the overlap that is clicked. */
  constructor(picked: (frame: number) => void) {
    this.picture.addEventListener("click", event => {
      if (!this.seam) return;
      const box = this.picture.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width * WIDTH;
      if (x >= NAMES) picked(Math.floor((x - NAMES) / (WIDTH - NAMES) * this.seam.frames));
    });
    this.root = el("div", {class: "seam-picture"}, this.picture, this.told);
  }

  show(seam: Seam, joints: Joint[]): void {
    this.seam = seam;
    const rows = joints.map((joint, n) => ({part: joint.part, at: seam.switch_frames[n]}))
      .filter((row): row is {part: string; at: number} => row.part !== null && row.at >= 0);
    const height = ROW * (rows.length + 2);
    const x = (frame: number) => NAMES + (WIDTH - NAMES) * frame / seam.frames;
    this.picture.setAttribute("viewBox", `0 0 ${WIDTH} ${height}`);
    this.picture.setAttribute("aria-label", `Seam of ${seam.frames} frames: ` +
      rows.map(row => `${spoken(row.part)} switches at ${row.at}`).join(", "));
    this.picture.replaceChildren(
      svg("defs", {}, svg("pattern", {id: "incoming", width: 5, height: 5, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)"},
        svg("rect", {width: 5, height: 5, class: "coming"}), svg("line", {x1: 0, x2: 0, y1: 0, y2: 5, class: "hatch"}))),
      svg("text", {class: "tick", x: NAMES, y: ROW - 4}, "end of the clip"),
      svg("text", {class: "tick", x: WIDTH, y: ROW - 4, "text-anchor": "end"}, "its beginning"),
      ...rows.flatMap(({part, at}, n) => [
        svg("text", {class: "tick", x: NAMES - 4, y: ROW * (n + 2) - 4, "text-anchor": "end"}, spoken(part)),
        svg("rect", {class: "going", x: NAMES, y: ROW * (n + 1), width: x(at) - NAMES, height: ROW - 2}),
        svg("rect", {fill: "url(#incoming)", x: x(at), y: ROW * (n + 1), width: WIDTH - x(at), height: ROW - 2}),
      ]),
      svg("text", {class: "tick", x: NAMES, y: height - 3}, `frame ${seam.out_begin}`),
      svg("text", {class: "tick", x: WIDTH, y: height - 3, "text-anchor": "end"}, `frame ${seam.in_begin + seam.frames}`));
    this.told.textContent = `Frames ${seam.out_begin} to ${seam.out_begin + seam.frames} into ${seam.in_begin} to ` +
      `${seam.in_begin + seam.frames}, ${(100 * seam.distance_m).toFixed(1)} cm apart` +
      (seam.played_frames === seam.frames ? "" : `, played in ${seam.played_frames} frames`) +
      `; speed ${seam.speed_ratio.toFixed(2)}, acceleration ${seam.acceleration_ratio.toFixed(2)} of the captured 99th percentile.`;
  }
}

function spoken(part: string): string {
  return part.replaceAll("_", " ");
}
