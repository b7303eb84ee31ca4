// node three_positions.mjs OUT_DIR FILE[@RATE]... : where three.js puts the joints of BVH and GLB files.
//
// Frames are the keys of the first track; with @RATE, where tracks have left keys out, they are so
// many a second.
//
// Writes OUT_DIR/NAME.three.csv for each FILE with the columns frame,time_s,joint,x,y,z (metres; a
// BVH is in centimetres). Exits 1 if three.js warns, or if a track is bound to no node.

import { readFile, writeFile } from "node:fs/promises";
import { basename } from "node:path";

import * as three from "three";
import { BVHLoader } from "three/addons/loaders/BVHLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const sampleCount = 25; // forward_kinematics.py picks the same frames
const metresPerUnit = { bvh: 0.01, glb: 1 };

function sampleFrames(frameCount) {
  const frames = new Set();
  for (let i = 0; i < sampleCount; ++i) {
    frames.add(Math.floor((i * (frameCount - 1)) / (sampleCount - 1)));
  }
  return [...frames];
}

function loadBvh(bytes) {
  const { skeleton, clip } = new BVHLoader().parse(new TextDecoder().decode(bytes));
  const scene = new three.Group();
  scene.add(skeleton.bones[0]);
  return { scene, clip, joints: skeleton.bones.filter((bone) => bone.name !== "ENDSITE") };
}

async function loadGlb(bytes) {
  const gltf = await new GLTFLoader().parseAsync(bytes, "");
  if (gltf.animations.length !== 1) throw new Error(`${gltf.animations.length} animations, not 1`);
  const joints = [];
  gltf.scene.traverse((node) => node.isSkinnedMesh && joints.push(...node.skeleton.bones));
  return { scene: gltf.scene, clip: gltf.animations[0], joints };
}

function checkTracks({ scene, clip, joints }) {
  for (const track of clip.tracks) {
    const { nodeName, propertyName } = three.PropertyBinding.parseTrackName(track.name);
    const node = three.PropertyBinding.findNode(scene, nodeName);
    if (node?.[propertyName] === undefined) throw new Error(`track ${track.name} is not bound`);
  }
  const turning = clip.tracks.filter((track) => track.name.endsWith(".quaternion")).length;
  if (turning !== joints.length) throw new Error(`${turning} of ${joints.length} joints turn`);
}

function frameTimes(clip, rate) {
  if (!rate) return clip.tracks[0].times;
  const frameCount = Math.round(clip.duration * rate) + 1;
  return Array.from({ length: frameCount }, (_, frame) => frame / rate);
}

function positionRows({ scene, clip, joints }, times, scale) {
  const mixer = new three.AnimationMixer(scene);
  const action = mixer.clipAction(clip).setLoop(three.LoopOnce, 1).play();
  action.clampWhenFinished = true; // else the last frame would be the first again
  const rows = ["frame,time_s,joint,x,y,z"];
  for (const frame of sampleFrames(times.length)) {
    action.reset();
    mixer.setTime(times[frame]);
    scene.updateMatrixWorld(true);
    for (const joint of joints) {
      const position = joint.getWorldPosition(new three.Vector3()).multiplyScalar(scale);
      const name = joint.userData.name ?? joint.name; // GLTFLoader keeps a name it had to change
      const numbers = position.toArray().map((value) => value.toFixed(9));
      rows.push([frame, times[frame].toFixed(9), name, ...numbers].join());
    }
  }
  return rows;
}

function refuseWarnings(...words) {
  throw new Error(`three.js warns: ${words.join(" ")}`);
}
console.warn = refuseWarnings;
const printError = console.error;
console.error = refuseWarnings;

const [outDir, ...files] = process.argv.slice(2);
for (const file of files) {
  const [path, rate] = file.split("@");
  try {
    const kind = path.slice(-3);
    const bytes = new Uint8Array(await readFile(path)).buffer;
    const loaded = kind === "glb" ? await loadGlb(bytes) : loadBvh(bytes);
    checkTracks(loaded);
    const rows = positionRows(loaded, frameTimes(loaded.clip, Number(rate)), metresPerUnit[kind]);
    await writeFile(`${outDir}/${basename(path)}.three.csv`, rows.join("\n") + "\n");
  } catch (error) {
    printError(`${path}: ${error.message}`);
    process.exitCode = 1;
  }
}
