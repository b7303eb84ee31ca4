// The texture room: blocks are edited by keys and pointer, a hand is pinned by dragging, play goes on and on.
import assert from "node:assert/strict";
import {execFile} from "node:child_process";
import {mkdtemp, readFile, rm, writeFile} from "node:fs/promises";
import {tmpdir} from "node:os";
import path from "node:path";
import {test} from "node:test";
import {promisify} from "node:util";
import {assertAccessible, downloaded, pixels, settled, withStudio} from "./browser.mjs";

const run = promisify(execFile);
const {LABAN_PROGRAM: laban, LABAN_TAKE: take} = process.env;

const blocks = async page => (await page.locator(".texton-line .snippet").allInnerTexts()).map(text => text.trim());

test("a path of textons is edited, pinned, and written as the verb writes it", async () => {
  const folder = await mkdtemp(path.join(tmpdir(), "laban-texture-"));
  try {
    const texture = path.join(folder, "take.texture");
    await run(laban, ["texture", "learn", take, "-o", texture, "--min-frames", "30", "--textons", "3"]);
    await withStudio(["--texture", texture], async (page, {folder: work}) => {
      await settled(page);
      const first = await blocks(page);
      assert.ok(first.length >= 3, `${first.length} blocks`);
      await page.screenshot({path: "texture.png"});

      // By keys: twice, away, to another place, back.
      await page.locator(".texton-line .snippet").first().focus();
      await page.keyboard.press("d");
      await settled(page);
      assert.deepEqual(await blocks(page), [first[0], ...first]);
      await page.keyboard.press("Delete");
      await settled(page);
      assert.deepEqual(await blocks(page), first);
      await page.locator(".texton-line .snippet").first().focus();
      await page.keyboard.press("Alt+ArrowRight");
      await settled(page);
      assert.deepEqual(await blocks(page), [first[1], first[0], ...first.slice(2)]);
      assert.ok(await page.locator(".join.never").count() > 0, "no warning of what the captures never do");
      await page.keyboard.press("Control+z");
      await settled(page);
      assert.deepEqual(await blocks(page), first);

      // By pointer: the first block is stretched.
      const told = () => page.locator(".texture-room .quality").innerText();
      const before = await told();
      const block = await page.locator(".texton-line .snippet").first().boundingBox();
      await page.mouse.move(block.x + block.width - 3, block.y + 10);
      await page.mouse.down();
      await page.mouse.move(block.x + block.width + 60, block.y + 10, {steps: 5});
      await page.mouse.up();
      await settled(page);
      assert.notEqual(await told(), before);

      // A hand is dragged.
      const scrub = page.getByLabel("Time, seconds");
      await scrub.focus();
      for (let n = 0; n < 30; ++n) await page.keyboard.press("ArrowRight");
      await settled(page);
      const pose = await pixels(page, ".screen canvas");
      const hand = await page.locator(".handle").first().boundingBox();
      await page.mouse.move(hand.x + 9, hand.y + 9);
      await page.mouse.down();
      await page.mouse.move(hand.x + 29, hand.y - 31, {steps: 8});
      await page.mouse.up();
      await settled(page);
      assert.match(await page.locator(".pins").innerText(), /block 1, frame 30, left hand/);
      assert.match(await page.locator(".cautions").innerText(), /deviations from what texton/);
      assert.notEqual(await pixels(page, ".screen canvas"), pose);
      await page.screenshot({path: "texture_pinned.png"});

      const state = await downloaded(page, () => page.getByRole("button", {name: "Save state"}).click());
      await writeFile(path.join(work, "room.json"), state.bytes);
      for (const format of ["BVH", "GLB"]) {
        const exported = await downloaded(page, () => page.getByRole("button", {name: `Export ${format}`}).click());
        await run(laban, ["texture", "synthesize", "--state", "room.json", "-o", exported.name], {cwd: work});
        assert.deepEqual(await readFile(path.join(work, exported.name)), exported.bytes);
      }
      await assertAccessible(page);
      await page.getByRole("button", {name: "Dark"}).click();
      await page.waitForTimeout(300);
      await assertAccessible(page);
    });
  } finally {
    await rm(folder, {recursive: true, force: true});
  }
});

test("a path is found and played, and a walk goes on beyond its first pieces", async () => {
  const folder = await mkdtemp(path.join(tmpdir(), "laban-texture-"));
  try {
    const texture = path.join(folder, "take.texture");
    await run(laban, ["texture", "learn", take, "-o", texture, "--min-frames", "30", "--textons", "3"]);
    await withStudio(["--texture", texture], async page => {
      await settled(page);
      const [from, , to] = await blocks(page);
      await page.getByLabel("Path from texton").fill(from);
      await page.getByLabel("Path to texton").fill(to);
      await page.getByRole("button", {name: "Find"}).click();
      await settled(page);
      assert.match(await page.locator(".path-told").innerText(), new RegExp(`^${from}.*${to}, [0-9.]+ nats`));
      await page.getByRole("button", {name: "Play it"}).click();
      await settled(page);
      const path_ = await blocks(page);
      assert.equal(path_[0], from);
      assert.equal(path_[path_.length - 1], to);

      await page.getByRole("button", {name: "Play on and on"}).click();
      await page.waitForSelector(".captions :text('without end')");
      await page.getByLabel("Speed").selectOption("2");
      let asked = 0;
      page.on("request", request => asked += request.url().includes("/api/texture/walk") ? 1 : 0);
      await page.waitForTimeout(6000);
      assert.ok(asked >= 1, "no further piece was asked for");
      assert.equal(await page.getByRole("button", {name: "Pause"}).count(), 1);
      await page.getByRole("button", {name: "Back to the path"}).click();
      await settled(page);
      assert.equal(await page.locator(".captions").innerText(), "take.texture");

      // A block is shown where it stands, whatever was on the stage.
      const last = page.locator(".texton-line .snippet").last();
      for (const [name, caption] of [["Play on and on", "without end"], ["Preview", /^texton \d+$/]]) {
        await page.getByRole("button", {name}).click();
        await page.locator(".captions").getByText(caption).waitFor();
        await last.click();
        await settled(page);
        assert.equal(await page.locator(".captions").innerText(), "take.texture");
        assert.equal(await last.getAttribute("aria-current"), "true");
        assert.equal(await page.locator(".texton-line [aria-current]").count(), 1);
      }
    });
  } finally {
    await rm(folder, {recursive: true, force: true});
  }
});

test("a pin stays where its block can be pinned, and joins do not run into each other", async () => {
  const folder = await mkdtemp(path.join(tmpdir(), "laban-texture-"));
  try {
    const texture = path.join(folder, "take.texture");
    await run(laban, ["texture", "learn", take, "-o", texture, "--min-frames", "30", "--textons", "3"]);
    await withStudio(["--texture", texture], async page => {
      await settled(page);
      const hand = await page.locator(".handle").first().boundingBox();
      await page.mouse.move(hand.x + 9, hand.y + 9);
      await page.mouse.down();
      await page.mouse.move(hand.x + 14, hand.y - 1, {steps: 4});
      await page.mouse.up();
      await settled(page);
      assert.match(await page.locator(".pins").innerText(), /block 1, frame 0, left hand/);
      const frames = async () => Number((await page.locator(".texture-room .quality").innerText()).match(/(\d+) frames/)[1]);
      const before = await frames(), first = page.locator(".texton-line .snippet").first();
      await first.focus();
      await page.keyboard.press("d");
      await settled(page);
      assert.match(await page.locator(".pins").innerText(), /block 1, frame 0[^]*block 2, frame 2, left hand/);
      assert.ok(await frames() > before, "the path was not made");

      for (let n = 0; n < 12; ++n) await page.keyboard.press("d");
      await settled(page);
      await page.screenshot({path: "texture_many.png"});
      const joins = await page.locator(".join").evaluateAll(all => all.map(one => one.getBoundingClientRect()).map(({left, right}) => [left, right]));
      for (let n = 1; n < joins.length; ++n) assert.ok(joins[n][0] >= joins[n - 1][1] - 1, `join ${n} begins within the one before`);
    });
  } finally {
    await rm(folder, {recursive: true, force: true});
  }
});
