// The Effort room: what is asked is played, and what is exported is what the verb writes.
import assert from "node:assert/strict";
import {execFile} from "node:child_process";
import {readFile, writeFile} from "node:fs/promises";
import path from "node:path";
import {test} from "node:test";
import {promisify} from "node:util";
import {assertAccessible, downloaded, drop, median, pixels, playbackRate, settled, withStudio} from "./browser.mjs";

const run = promisify(execFile);
const {LABAN_PROGRAM: laban, LABAN_TAKE: take} = process.env;

async function ask(page, factor, value) {
  await page.locator(`#slider-${factor}`).evaluate((slider, to) => {
    slider.value = String(to);
    slider.dispatchEvent(new Event("input", {bubbles: true}));
    slider.dispatchEvent(new Event("change", {bubbles: true}));
  }, value);
  await settled(page);
}

const measured = async page => (await page.locator(".factor .measured").allInnerTexts()).map(
  text => Number(text.replace("\u2212", "-").replace("\u00a0", "")));

async function savedState(page) {
  const {bytes} = await downloaded(page, () => page.getByRole("button", {name: "Save state"}).click());
  return JSON.parse(bytes);
}

test("a slider that moves changes the figures and the pose, and back", async () => {
  await withStudio([take], async page => {
    await settled(page);
    const before = {figures: await measured(page), pose: await pixels(page, ".screen canvas")};
    // By keys, as who has no mouse does it.
    await page.locator("#slider-time").focus();
    for (let n = 0; n < 40; ++n) await page.keyboard.press("ArrowRight");
    await settled(page);
    const after = {figures: await measured(page), pose: await pixels(page, ".screen canvas")};
    assert.ok(after.figures[2] > before.figures[2] + 0.5, `Time went from ${before.figures[2]} to ${after.figures[2]}`);
    assert.notEqual(after.pose, before.pose);
    await page.screenshot({path: "effort_sudden.png"});

    await page.locator(".screen canvas").focus();
    while (await page.getByRole("button", {name: "Undo"}).isEnabled()) await page.keyboard.press("Control+z");
    await settled(page);
    assert.deepEqual(await measured(page), before.figures);
    await page.keyboard.press("Control+Shift+z");
    await settled(page);
    assert.notDeepEqual(await measured(page), before.figures);
  });
});

test("a pair is swapped, its alpha set by hand, and all of it is what the verb makes of the state", async () => {
  await withStudio([take], async (page, {folder}) => {
    await settled(page);
    await ask(page, "weight", 2.5);
    await ask(page, "time", -2.5);  // slow and strong: hardly to be had together
    const equal = await measured(page);
    await page.getByLabel("Importance of Time").fill("8");
    await page.keyboard.press("Enter");
    await settled(page);
    const weighed = await measured(page);
    assert.ok(Math.abs(weighed[2] + 2.5) < Math.abs(equal[2] + 2.5), `Time counts more, and goes from ${equal[2]} to ${weighed[2]}`);
    await page.getByLabel("Hold feet").uncheck();
    await settled(page);
    await page.screenshot({path: "effort_weighed.png"});
    await page.locator(".snippet").nth(1).click();
    await page.locator(".others td button").nth(4).click();
    await settled(page);
    assert.equal(await page.locator(".snippet.locked").count(), 1);
    const alpha = page.getByLabel("Blend weight alpha");
    await alpha.fill("0.4");
    await alpha.press("Enter");
    await settled(page);
    await page.screenshot({path: "effort_by_hand.png"});
    const state = await savedState(page);
    assert.equal(state.asked.weight, 2.5);
    assert.deepEqual(state.weights, [1, 1, 8]);
    assert.equal(state.foot_fix, false);
    assert.equal(state.locks.length, 1);
    assert.equal(state.locks[0].snippet, 1);
    assert.equal(state.locks[0].alpha, 0.4);
    await writeFile(path.join(folder, "room.json"), JSON.stringify(state));
    for (const format of ["bvh", "glb"]) {
      const exported = await downloaded(page, () => page.getByRole("button", {name: `Export ${format.toUpperCase()}`}).click());
      assert.equal(exported.name, `take_styled.${format}`);
      await run(laban, ["apply", "--state", "room.json", "-o", exported.name], {cwd: folder});
      assert.ok(exported.bytes.equals(await readFile(path.join(folder, exported.name))), `${format} differs from the verb's`);
    }

    // Dragged on the curves: another alpha, one step of the history.
    await page.locator(".snippet-panel .chart").scrollIntoViewIfNeeded();
    const chart = await page.locator(".snippet-panel .chart").boundingBox();
    await page.mouse.move(chart.x + 0.3 * chart.width, chart.y + 0.5 * chart.height);
    await page.mouse.down();
    await page.mouse.move(chart.x + 0.8 * chart.width, chart.y + 0.5 * chart.height, {steps: 5});
    await page.mouse.up();
    await settled(page);
    assert.ok((await savedState(page)).locks[0].alpha > 0.7);
    await page.getByRole("button", {name: "Undo"}).click();
    await settled(page);
    assert.equal((await savedState(page)).locks[0].alpha, 0.4);
    await page.getByLabel("locked").uncheck();
    await settled(page);
    assert.equal((await savedState(page)).locks.length, 0);
  });
});

test("a state that was saved is opened again, and one that is none is told", async () => {
  await withStudio([take], async (page, {folder}) => {
    await settled(page);
    await ask(page, "flow", -1.25);
    const state = await savedState(page);
    const figures = await measured(page);
    await writeFile(path.join(folder, "room.json"), JSON.stringify(state));
    await page.reload();
    await settled(page);
    await page.locator("input[type=file]").setInputFiles(path.join(folder, "room.json"));
    await settled(page);
    assert.deepEqual(await measured(page), figures);
    await writeFile(path.join(folder, "none.json"), "{}");
    await page.locator("input[type=file]").setInputFiles(path.join(folder, "none.json"));
    await page.waitForSelector("#trouble:not([hidden])");
    assert.match(await page.locator("#trouble").innerText(), /none\.json/);
  });
});

test("a drag that is given up leaves nothing behind, and what matters more is found rather", async () => {
  await withStudio([take], async (page, {folder}) => {
    await settled(page);
    for (const factor of ["flow", "weight", "time"]) await ask(page, factor, factor === "time" ? 2 : -2);
    await page.locator(".snippet").nth(1).click();
    await settled(page);
    await page.getByLabel("locked").check();
    await settled(page);
    const before = await savedState(page);
    const chart = page.locator(".snippet-panel .chart");
    await chart.scrollIntoViewIfNeeded();
    const {x, y, width} = await chart.boundingBox();
    await page.mouse.move(x + 0.3 * width, y + 50);
    await page.mouse.down();
    await page.mouse.move(x + 0.9 * width, y + 50, {steps: 4});
    await chart.evaluate(one => one.dispatchEvent(new PointerEvent("pointercancel", {pointerId: 1, bubbles: true})));
    await page.mouse.move(x + 0.5 * width, y + 50, {steps: 2});
    await page.mouse.up();
    await settled(page);
    assert.deepEqual(await savedState(page), before);
    assert.ok(Math.abs(await page.getByLabel("Blend weight alpha").inputValue() - before.locks[0].alpha) < 0.001);

    const even = await measured(page);
    await page.getByLabel("Importance of Time").fill("20");
    await page.getByLabel("Importance of Time").press("Enter");
    await settled(page);
    const state = await savedState(page);
    assert.deepEqual(state.weights, [1, 1, 20]);
    assert.notDeepEqual(await measured(page), even);
    await writeFile(path.join(folder, "room.json"), JSON.stringify(state));
    const exported = await downloaded(page, () => page.getByRole("button", {name: "Export BVH"}).click());
    await run(laban, ["apply", "--state", "room.json", "-o", exported.name], {cwd: folder});
    assert.ok(exported.bytes.equals(await readFile(path.join(folder, exported.name))));
    await page.getByRole("button", {name: "Undo"}).click();
    await settled(page);
    assert.equal(await page.getByLabel("Importance of Time").inputValue(), "1");
  });
});

test("each clip keeps what was set for it, and a file that cannot be used is told", async () => {
  await withStudio([take], async (page, {errors}) => {
    await settled(page);
    await ask(page, "weight", 1.5);
    const lines = (await readFile(take, "utf8")).split("\n");
    const first = lines.findIndex(line => line.startsWith("Frames:"));
    const frames = count => [...lines.slice(0, first), `Frames: ${count}`, ...lines.slice(first + 1, first + 2 + count), ""].join("\n");
    await drop(page, "one.bvh", frames(1));
    assert.match(await page.locator("#trouble").innerText(), /one\.bvh: the input has 1 frames/);
    await drop(page, "none.json", "{");
    assert.match(await page.locator("#trouble").innerText(), /^none\.json: /);
    await drop(page, "walk.amc", ":DEGREES\n");
    assert.match(await page.locator("#trouble").innerText(), /drop its \.asf with it/);
    await drop(page, "some.bvh", frames(120));
    assert.ok(await page.locator("#trouble").isHidden());
    assert.equal((await savedState(page)).asked.weight, null);
    await ask(page, "weight", -1);

    const clips = page.getByLabel("Clip");
    await clips.selectOption("c0");
    await settled(page);
    assert.equal((await savedState(page)).asked.weight, 1.5);
    await page.getByRole("button", {name: "Undo"}).click();
    await settled(page);
    assert.equal((await savedState(page)).asked.weight, null);
    // Two are chosen before the first is there: the last is shown, and its room is.
    await page.evaluate(() => {
      for (const id of ["c2", "c0", "c2"]) {
        const choice = document.querySelector("header select");
        choice.value = id;
        choice.dispatchEvent(new Event("change"));
      }
    });
    await settled(page);
    await settled(page);
    assert.match(await page.locator(".captions").innerText(), /input: some\.bvh/);
    assert.equal((await savedState(page)).asked.weight, -1);
    errors.length = 0;  // what was refused
  });
});

test("a slider's move is on screen soon, and playing keeps up", async () => {
  await withStudio([take], async page => {
    await settled(page);
    await page.getByLabel("Time is free").uncheck();
    await settled(page);
    const moves = await page.evaluate(async () => {
      const slider = document.getElementById("slider-time");
      const frame = () => new Promise(requestAnimationFrame);
      // When the frame after the one that draws the pose begins, that one has been shown.
      const canvas = document.querySelector(".screen canvas");
      const shown = () => new Promise(done => canvas.addEventListener("drawn", () => void frame().then(done), {once: true}));
      const times = [];
      for (let n = 0; n < 50; ++n) {
        const begin = performance.now();
        const seen = shown();
        slider.value = String(-2.5 + 5 * ((n * 7) % 50) / 50);
        slider.dispatchEvent(new Event("input", {bubbles: true}));
        await seen;
        times.push(performance.now() - begin);
        await new Promise(done => setTimeout(done, 600));
      }
      return times;
    });
    console.log(`slider to pose: median ${median(moves).toFixed(0)} ms of ${moves.length} moves`);
    assert.ok(median(moves) < 1000);

    const rate = await playbackRate(page);
    console.log(`two clips play at ${rate.toFixed(0)} frames a second`);
    assert.ok(rate > 5);
  }, {viewport: {width: 1280, height: 720}});
});

test("no serious finding by axe, light or dark", async () => {
  await withStudio([take], async page => {
    await settled(page);
    await ask(page, "time", 1);
    await page.locator(".snippet").nth(2).click();
    await page.waitForSelector(".others");
    await assertAccessible(page);
    await page.getByRole("button", {name: "Dark"}).click();
    await page.waitForTimeout(300);
    await assertAccessible(page);
    await page.screenshot({path: "effort_dark.png"});
  });
});
