// The loop room: turning points, the seam, the loop; what is exported is what the verb writes.
import assert from "node:assert/strict";
import {execFile} from "node:child_process";
import {readFile, writeFile} from "node:fs/promises";
import path from "node:path";
import {test} from "node:test";
import {promisify} from "node:util";
import {assertAccessible, downloaded, drop, pixels, settled, withStudio} from "./browser.mjs";

const run = promisify(execFile);
const {LABAN_PROGRAM: laban, LABAN_TAKE: take} = process.env;

async function enter(page) {
  await settled(page);
  await page.getByRole("button", {name: "Loop", exact: true}).click();
  await settled(page);
}

test("a loop is seen, changed, undone, and written as the verb writes it", async () => {
  await withStudio([take], async (page, {folder, errors}) => {
    await enter(page);
    assert.match(await page.locator(".loop-room .quality").first().innerText(), /flows into the first/);
    assert.match(await page.locator(".seam-picture svg").getAttribute("aria-label"), /left hand switches at \d+/);
    await page.screenshot({path: "loop.png"});

    // A turning point, then the seam: the stage goes there.
    const clock = page.locator(".stage .clock");
    await page.locator(".points button").nth(3).click();
    const [turn, picture] = [await clock.innerText(), await pixels(page, ".screen canvas")];
    await page.locator(".seam-picture svg").click({position: {x: 200, y: 60}});
    assert.notEqual(await clock.innerText(), turn);
    await page.waitForTimeout(300);
    assert.notEqual(await pixels(page, ".screen canvas"), picture);

    await page.getByLabel("In place").check();
    await settled(page);
    const report = await page.locator(".loop-room .quality").first().innerText();
    assert.doesNotMatch(report, / m and /);
    await page.keyboard.press("Control+z");
    await settled(page);
    assert.ok(!await page.getByLabel("In place").isChecked());
    await page.keyboard.press("Control+Shift+z");
    await settled(page);
    assert.equal(await page.locator(".loop-room .quality").first().innerText(), report);

    const state = await downloaded(page, () => page.getByRole("button", {name: "Save state"}).click());
    await writeFile(path.join(folder, "room.json"), state.bytes);
    for (const format of ["BVH", "GLB"]) {
      const exported = await downloaded(page, () => page.getByRole("button", {name: `Export ${format}`}).click());
      await run(laban, ["loop", "synthesize", "--state", "room.json", "-o", exported.name], {cwd: folder});
      assert.deepEqual(await readFile(path.join(folder, exported.name)), exported.bytes);
    }
    const {seam: _, ...spoilt} = JSON.parse(state.bytes);
    await drop(page, "spoilt.json", JSON.stringify(spoilt));
    assert.equal(await page.locator("#trouble").innerText(), "the state has no 'seam'");
    assert.deepEqual((await downloaded(page, () => page.getByRole("button", {name: "Save state"}).click())).bytes, state.bytes);
    assert.ok(errors.every(error => /4\d\d/.test(error)), errors.join("; "));
    errors.length = 0;
  });
});

test("endless motion is as long as asked, and no finding by axe is serious", async () => {
  await withStudio([take], async page => {
    await enter(page);
    assert.ok(await page.getByLabel("Seconds", {exact: true}).isDisabled(), "a seamless loop is as long as its clip");
    await page.getByLabel("Make").selectOption("endless");
    await page.getByLabel("Seconds", {exact: true}).fill("8");
    await page.keyboard.press("Enter");
    await settled(page);
    assert.match(await page.locator(".stage .clock").innerText(), /\/ (7\.9|8\.0)\d s/);
    assert.ok(await page.getByRole("group", {name: "Seams"}).getByRole("button").count() >= 2, "8 s of a clip of 12 s");
    const seam = page.getByRole("button", {name: "Seam 2", exact: true});
    await seam.focus();
    await page.keyboard.press("Enter");
    assert.equal(await seam.getAttribute("aria-pressed"), "true");
    assert.ok(await seam.evaluate(button => button === document.activeElement), "the focus is lost");
    await page.getByRole("button", {name: "Draw again"}).click();
    await settled(page);
    assert.equal(await page.getByLabel("Seed", {exact: true}).inputValue(), "2");
    await assertAccessible(page);
    await page.getByRole("button", {name: "Dark"}).click();
    await page.waitForTimeout(300);
    await assertAccessible(page);
    await page.screenshot({path: "loop_dark.png"});
  });
});
