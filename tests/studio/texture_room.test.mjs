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

/** A studio of a small texture. */
async function withTexture(visit) {
  const folder = await mkdtemp(path.join(tmpdir(), "laban-texture-"));
  try {
    const texture = path.join(folder, "take.texture");
    await run(laban, ["texture", "learn", take, "-o", texture, "--min-frames", "30", "--textons", "3"]);
    await withStudio(["--texture", texture], visit);
  } finally {
    await rm(folder, {recursive: true, force: true});
  }
}

test("a path of textons is edited, pinned, and written as the verb writes it", async () => {
  await withTexture(async (page, {folder: work}) => {
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
    const hand = await page.locator("[data-part=left_hand]").boundingBox();
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
});

test("a path is found and played, and a walk goes on beyond its first pieces", async () => {
  await withTexture(async page => {
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
});

test("a pin stays where its block can be pinned, and joins do not run into each other", async () => {
  await withTexture(async page => {
    await settled(page);
    const hand = await page.locator("[data-part=left_hand]").boundingBox();
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
});

/** A joint's handle is taken and moved; the pointer stays down. */
async function takeJoint(page, part, [x, y]) {
  const box = await page.locator(`[data-part=${part}]`).boundingBox();
  const [left, top] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(left, top);
  await page.mouse.down();
  await page.mouse.move(left + x, top + y, {steps: 6});
}

test("any main joint is pinned, Escape puts back what was, and all textons and transitions are seen", async () => {
  await withTexture(async page => {
    await settled(page);
    const scrub = page.getByLabel("Time, seconds");
    await scrub.focus();
    for (let n = 0; n < 30; ++n) await page.keyboard.press("ArrowRight");
    await settled(page);
    const pose = await pixels(page, ".screen canvas");
    const pins = () => page.locator(".pins li").allInnerTexts();

    await takeJoint(page, "left_hand", [30, -40]);
    await settled(page);
    assert.notEqual(await pixels(page, ".screen canvas"), pose, "nothing moved under the pointer");
    await page.keyboard.press("Escape");
    await settled(page);
    await page.mouse.up();
    await settled(page);
    assert.deepEqual(await pins(), []);
    await page.mouse.move(5, 5);
    assert.equal(await pixels(page, ".screen canvas"), pose, "Escape did not put it back");

    const line = () => page.locator(".texton-line .snippet").evaluateAll(all => all.map(one => one.getAttribute("style")));
    const laid = await line(), first = await page.locator(".texton-line .snippet").first().boundingBox();
    for (const grip of [10, first.width - 3]) {
      await page.mouse.move(first.x + grip, first.y + 10);
      await page.mouse.down();
      await page.mouse.move(first.x + grip + 150, first.y + 10, {steps: 5});
      assert.notDeepEqual(await line(), laid);
      await page.keyboard.press("Escape");
      await page.mouse.up();
      await settled(page);
      assert.deepEqual((await line()).map(style => style.replace(/ ?transform:[^;]*;/, "")), laid);
    }

    for (const [part, name, by] of [["hips", "hips", [0, 12]], ["head", "head", [14, 6]], ["left_forearm", "left elbow", [25, -10]], ["right_shin", "right knee", [-15, 0]]]) {
      const before = await pixels(page, ".screen canvas");
      await takeJoint(page, part, by);
      await page.mouse.up();
      await settled(page);
      assert.ok((await pins()).some(pin => pin.includes(`block 1, frame 30, ${name}`)), `${await pins()}`);
      assert.notEqual(await pixels(page, ".screen canvas"), before, name);
    }
    await page.screenshot({path: "texture_joints.png"});

    // What the captures never do is bridged where it is told.
    for (let n = 0; n < 4; ++n) await page.keyboard.press("Control+z");
    await settled(page);
    await page.locator(".texton-line .snippet").first().focus();
    await page.keyboard.press("Alt+ArrowRight");
    await settled(page);
    const [never, count] = [await page.locator(".join.never").count(), (await blocks(page)).length];
    assert.ok(never > 0);
    await page.locator(".join.never").first().click();
    await settled(page);
    assert.equal(await page.locator(".join.never").count(), never - 1);
    assert.ok((await blocks(page)).length > count);

    await page.getByText("All transitions").click();
    const cells = page.locator(".texton-matrix canvas"), box = await cells.boundingBox();
    const textons = await page.locator(".texton-table tbody tr").count();
    await cells.hover({position: {x: box.width * 1.5 / textons, y: box.height * 0.5 / textons}});
    assert.match(await page.locator(".texton-matrix .legend").innerText(), /^From 0 to 1: ([01]\.\d\d|never)$/);
    await cells.click({position: {x: box.width * 1.5 / textons, y: box.height * 0.5 / textons}});
    assert.equal(await page.getByLabel("Path from texton").inputValue(), "0");
    assert.equal(await page.getByLabel("Path to texton").inputValue(), "1");
    await cells.press("ArrowDown");
    assert.match(await page.locator(".texton-matrix .legend").innerText(), /^From 1 to 1/);

    await page.getByText(/^All \d+ textons$/).click();
    await page.getByRole("button", {name: "Captured", exact: true}).click();
    await page.screenshot({path: "texture_all.png"});
    await page.getByTitle("Play texton 1").click();
    await page.locator(".captions").getByText("texton 1").waitFor();
    await assertAccessible(page);
    await page.getByRole("button", {name: "Dark"}).click();
    await page.waitForTimeout(300);
    await assertAccessible(page);
    await page.screenshot({path: "texture_all_dark.png"});
  });
});
