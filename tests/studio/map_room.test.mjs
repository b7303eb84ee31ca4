// The map room: poses under the pointer, a path that is drawn, and the files that the verb writes too.
import assert from "node:assert/strict";
import {execFile} from "node:child_process";
import {mkdtemp, readFile, rm, writeFile} from "node:fs/promises";
import {tmpdir} from "node:os";
import path from "node:path";
import {test} from "node:test";
import {promisify} from "node:util";
import {assertAccessible, downloaded, drop, pixels, playbackRate, settled, withStudio} from "./browser.mjs";

const run = promisify(execFile);
const {LABAN_PROGRAM: laban, LABAN_TAKE: take} = process.env;

test("poses follow the pointer, a path is drawn and played, a walk is asked for", async () => {
  const folder = await mkdtemp(path.join(tmpdir(), "laban-map-"));
  try {
    const map = path.join(folder, "take.manifold");
    await run(laban, ["manifold", "learn", take, "-o", map, "--size", "30", "--epochs", "10"]);
    await withStudio([take, "--manifold", map], async (page, {folder: work, errors}) => {
      await settled(page);
      assert.match(await page.locator(".map-room .quality").innerText(), /Primitives/);
      await page.screenshot({path: "map.png"});
      const canvas = ".screen canvas", walk = await pixels(page, canvas);
      const box = await page.locator(".pose-map svg").boundingBox();
      const at = (x, y) => [box.x + x * box.width, box.y + y * box.height];
      await page.mouse.move(...at(0.4, 0.4));
      await page.waitForSelector(".captions :text('pose at')");
      await settled(page);
      const pose = await pixels(page, canvas);
      assert.notEqual(pose, walk);
      await page.mouse.move(...at(0.6, 0.7));
      await settled(page);
      assert.notEqual(await pixels(page, canvas), pose);

      // Play with the pointer over the map: the motion, from the moment at which it stood.
      await page.keyboard.press(" ");
      await page.waitForSelector(".captions :text('motion')");
      await page.mouse.move(...at(0.61, 0.7));
      await page.waitForTimeout(200);
      assert.match(await page.locator(".captions").innerText(), /motion/);
      await page.keyboard.press(" ");
      await page.mouse.move(...at(0.6, 0.7));
      await page.waitForSelector(".captions :text('pose at')");
      await page.mouse.move(5, 400);
      await page.waitForSelector(".captions :text('motion')");

      // A line that is given up leaves nothing.
      await page.mouse.move(...at(0.2, 0.2));
      await page.mouse.down();
      await page.mouse.move(...at(0.5, 0.5), {steps: 4});
      assert.notEqual(await page.locator(".sketch").getAttribute("d"), "");
      await page.keyboard.press("Escape");
      await page.mouse.up();
      await settled(page);
      assert.equal(await page.locator(".sketch").getAttribute("d"), "");
      assert.match(await page.locator(".map-room .quality").innerText(), /Primitives/);
      assert.ok(await page.getByLabel("Frames", {exact: true}).isDisabled());

      await page.mouse.move(...at(0.3, 0.3));
      await page.mouse.down();
      for (let n = 1; n <= 20; ++n) await page.mouse.move(...at(0.3 + 0.02 * n, 0.3 + 0.15 * Math.sin(n / 5)));
      await page.mouse.up();
      await page.mouse.move(5, 400);
      await settled(page);
      const middle = await page.locator(".waypoint circle").first().evaluate(circle => {
        const {x, y, width, height} = circle.getBoundingClientRect();
        return [x + width / 2, y + height / 2];
      });
      const off = Math.hypot(middle[0] - at(0.3, 0.3)[0], middle[1] - at(0.3, 0.3)[1]);
      assert.ok(off < 2, `the path begins ${off} pixels from where it was drawn`);
      const runner = () => page.locator(".runner").evaluate(marker => marker.style.transform);
      const before = await runner();
      await page.waitForTimeout(300);
      assert.notEqual(await runner(), before, "what was drawn is not played");
      await page.getByRole("button", {name: "Pause", exact: true}).click();
      const points = await page.locator(".map-room li").count();
      assert.ok(await page.getByLabel("Frames", {exact: true}).isEnabled());
      assert.ok(points >= 3 && points <= 12, `${points} points`);
      assert.match(await page.locator(".map-room .quality").innerText(), /Points are passed at frames 0, /);
      await page.getByRole("button", {name: "Pin this frame"}).click();
      await settled(page);
      assert.equal(await page.locator(".map-room li").count(), points + 1);
      assert.match(await page.locator(".placed").innerText(), /take\.bvh:\d+ lies at .* cm a joint away/);
      await page.locator(".waypoint").last().click();
      await settled(page);
      assert.match(await page.locator(".map-room li").last().innerText(), /take\.bvh:\d+/);
      await page.screenshot({path: "map_path.png"});

      // A waypoint takes its number along, and goes back where the pointer is lost.
      const waypoint = page.locator(".waypoint").nth(1), number = waypoint.locator("text");
      const stood = await number.boundingBox(), column = page.getByLabel("column of point 2"), value = await column.inputValue();
      await page.mouse.move(stood.x + stood.width / 2, stood.y + stood.height / 2);
      await page.mouse.down();
      await page.mouse.move(stood.x + 40, stood.y + 30, {steps: 3});
      assert.ok((await number.boundingBox()).x > stood.x + 20);
      await page.locator(".pose-map svg").evaluate(picture => picture.dispatchEvent(new PointerEvent("pointercancel", {pointerId: 1, bubbles: true})));
      assert.equal((await number.boundingBox()).x, stood.x);
      await page.mouse.up();
      await settled(page);
      assert.equal(await column.inputValue(), value);

      // Undo in the middle of a drag gives the drag up, and takes nothing else back.
      await page.mouse.move(stood.x + stood.width / 2, stood.y + stood.height / 2);
      await page.mouse.down();
      await page.mouse.move(stood.x + 40, stood.y + 30, {steps: 3});
      await page.keyboard.press("Control+z");
      await page.mouse.up();
      await settled(page);
      assert.equal(await column.inputValue(), value);
      assert.equal(await page.locator(".map-room li").count(), points + 1);

      // Keys alone: arrows and tab in the numbers, points added and removed; the focus stays at hand.
      const focused = () => page.evaluate(() => document.activeElement.getAttribute("aria-label") ?? document.activeElement.textContent);
      await column.focus();
      await page.keyboard.press("ArrowUp");
      await page.keyboard.press("ArrowUp");
      assert.equal(Number(await column.inputValue()), 0.5 * Math.floor(2 * Number(value)) + 1);
      await page.waitForTimeout(1100);  // a step of the history of its own
      await page.keyboard.press("Control+a");
      await page.keyboard.type("99");
      await page.keyboard.press("Tab");
      assert.equal(await focused(), "row of point 2");
      assert.equal(await column.inputValue(), "29");
      await page.getByRole("button", {name: "Add a point"}).focus();
      await page.keyboard.press("Enter");
      assert.equal(await page.locator(".map-room li").count(), points + 2);
      await page.getByRole("button", {name: "Remove"}).last().focus();
      await page.keyboard.press("Enter");
      assert.equal(await page.locator(".map-room li").count(), points + 1);
      assert.equal(await focused(), "Remove");
      for (let n = 0; n < 4; ++n) await page.getByRole("button", {name: "Undo"}).click();
      await settled(page);
      assert.equal(await column.inputValue(), value);
      assert.match(await page.locator(".map-room li").last().innerText(), /take\.bvh:\d+/);

      const rate = await playbackRate(page);
      console.log(`clip and motion play beside the map at ${rate.toFixed(0)} frames a second`);
      assert.ok(rate > 8);
      await page.getByRole("button", {name: "Pause", exact: true}).click();

      const state = await downloaded(page, () => page.getByRole("button", {name: "Save state"}).click());
      // A state that is wrong leaves the room as it was.
      for (const [wrong, word] of [[{points: []}, "'points' is no list"], [{way: "walk", frames: 9}, "'frames' is of a path"], [{seed: undefined}, "has no 'seed'"]]) {
        await drop(page, "wrong.json", JSON.stringify({...JSON.parse(state.bytes), ...wrong}));
        assert.ok((await page.locator("#trouble").innerText()).includes(word));
        assert.equal(await page.locator(".map-room li").count(), points + 1);
        assert.ok(await page.getByRole("button", {name: "Redo"}).isEnabled(), "it is no step of the history");
      }
      assert.ok(errors.every(error => /4\d\d/.test(error)), errors.join("; "));
      errors.length = 0;

      await writeFile(path.join(work, "room.json"), state.bytes);
      for (const format of ["BVH", "GLB"]) {
        const exported = await downloaded(page, () => page.getByRole("button", {name: `Export ${format}`}).click());
        await run(laban, ["manifold", "synthesize", "--state", "room.json", "-o", exported.name], {cwd: work});
        assert.deepEqual(await readFile(path.join(work, exported.name)), exported.bytes);
      }
      await page.getByRole("button", {name: "Undo"}).click();
      await page.getByRole("button", {name: "Undo"}).click();
      await settled(page);
      assert.equal(await page.locator(".map-room li").count(), 1);
      await assertAccessible(page);
      await page.getByRole("button", {name: "Dark"}).click();
      await page.waitForTimeout(300);
      await assertAccessible(page);
    });
  } finally {
    await rm(folder, {recursive: true, force: true});
  }
});
