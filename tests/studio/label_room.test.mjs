// The labelling room: rated by keys alone, killed in between, nothing lost.
import assert from "node:assert/strict";
import {execFile} from "node:child_process";
import {copyFile, mkdtemp, readFile, rm} from "node:fs/promises";
import {tmpdir} from "node:os";
import path from "node:path";
import {test} from "node:test";
import {promisify} from "node:util";
import {assertAccessible, settled, withStudio} from "./browser.mjs";

const run = promisify(execFile);
const {LABAN_PROGRAM: laban, LABAN_TAKE: take} = process.env;

async function blankSheet() {
  const folder = await mkdtemp(path.join(tmpdir(), "laban-sheet-"));
  for (const content of ["walk", "kick"]) {
    for (const performer of ["p01", "p02", "p03"]) {
      const name = `phrase_${content}_${performer}.bvh`;
      await copyFile(path.join(path.dirname(take), "phrase", name), path.join(folder, name));
    }
  }
  await run(laban, ["corpus", "--clips", ".", "--pattern", "phrase_{content}_{performer}", "--blends", "2",
                    "--label", "none", "-o", "sheet.csv"], {cwd: folder});
  return {folder, sheet: path.join(folder, "sheet.csv")};
}

const ratedBy = async (sheet, who) => (await readFile(sheet, "utf8")).split("\n").filter(line => line.includes(`,${who},expert,`));

async function rate(page, presses) {
  for (const key of ["f", "w", "t"]) {
    await page.keyboard.press(key);
    for (let n = 0; n < presses; ++n) await page.keyboard.press("ArrowRight");
  }
  await page.keyboard.press("Enter");
  await settled(page);
}

test("fragments are rated by keys, and a studio that is killed has lost nothing", async () => {
  const {folder, sheet} = await blankSheet();
  try {
    await withStudio(["--label", sheet, "--observer", "ann"], async (page, {pid, errors}) => {
      await settled(page);
      assert.match(await page.locator(".progress").innerText(), /^1 of 9, rated by ann/);
      assert.ok(!(await page.locator("main").innerText()).includes("phrase"), "a name is shown");
      assert.ok(await page.getByRole("button", {name: /Keep/}).isDisabled());
      await page.screenshot({path: "label.png"});
      await rate(page, 3);
      assert.match(await page.locator(".progress").innerText(), /^2 of 9/);
      const [first] = await ratedBy(sheet, "ann");
      assert.match(first, /,1\.5,1\.5,1\.5,,ann,expert,1,/);

      // Undo: move by move; and back to the answer before, which is mended in its place.
      const flow = page.getByRole("slider", {name: /^Flow/}), shown = page.locator("fieldset:has-text('Flow') output");
      await page.keyboard.press("f");
      await page.keyboard.press("ArrowLeft");
      await page.keyboard.press("n");
      assert.equal(await shown.innerText(), "not observed");
      await page.waitForTimeout(1100);
      await page.keyboard.press("n");
      assert.equal(await shown.innerText(), "\u22120.5");
      await page.keyboard.press("Control+z");
      assert.equal(await shown.innerText(), "not observed");
      await page.keyboard.press("Control+Shift+z");
      assert.equal(await shown.innerText(), "\u22120.5");
      await page.keyboard.press("b");
      await settled(page);
      assert.match(await page.locator(".progress").innerText(), /^1 of 9, as kept by ann/);
      assert.equal(await flow.inputValue(), "1.5");
      await page.screenshot({path: "label_again.png"});
      await page.keyboard.press("f");
      await page.keyboard.press("ArrowRight");
      await page.keyboard.press("Enter");
      await settled(page);
      assert.match(await page.locator(".progress").innerText(), /^2 of 9, rated/);
      assert.match((await ratedBy(sheet, "ann")).join("\n"), /^[^\n]*,2,1\.5,1\.5,,ann,expert,1,[^\n]*$/);
      // What was set before stands there still.
      assert.equal(await shown.innerText(), "\u22120.5");

      // Not observed, and a comment that has commas and quotes.
      await page.keyboard.press("f");
      await page.keyboard.press("n");
      for (const key of ["w", "t"]) {
        await page.keyboard.press(key);
        await page.keyboard.press("ArrowLeft");
      }
      await page.getByLabel("Comment").fill('quick, "light" f w t n');
      await page.getByRole("button", {name: /Keep/}).click();
      await settled(page);
      assert.equal((await ratedBy(sheet, "ann")).length, 2);
      assert.ok((await ratedBy(sheet, "ann")).some(line => /,,-0\.5,-0\.5,,ann/.test(line) && line.includes('"quick, ""light"" f w t n"')));
      await assertAccessible(page);
      await rate(page, 1);
      process.kill(pid, "SIGKILL");
      await rate(page, 1);
      assert.match(await page.locator("#trouble").innerText(), /does not answer/);
      errors.length = 0;
    });
    assert.equal((await ratedBy(sheet, "ann")).length, 3);
    await withStudio(["--label", sheet, "--observer", "ann"], async page => {
      await settled(page);
      assert.match(await page.locator(".progress").innerText(), /^4 of 9/);
      for (let n = 3; n < 9; ++n) await rate(page, n);
      assert.match(await page.locator(".progress").innerText(), /^All 9 are rated/);
      await page.getByRole("button", {name: "Agreement"}).click();
      await settled(page);
      assert.match(await page.locator(".agreement").innerText(), /own repeats/);
      await page.screenshot({path: "label_agreement.png"});
    });
    // What was rated is what the other verbs read.
    await run(laban, ["agree", "--labels", sheet], {cwd: folder});
  } finally {
    await rm(folder, {recursive: true, force: true});
  }
});

test("what is set is undone, what is kept is mended, and a second page goes on where the first is", async () => {
  const {folder, sheet} = await blankSheet();
  const log = async () => (await readFile(`${sheet}.log`, "utf8")).trim().split("\n").map(line => JSON.parse(line));
  const value = (page, factor) => page.locator(`#rate-${factor}`).getAttribute("aria-valuetext");
  try {
    await withStudio(["--label", sheet, "--observer", "ann"], async (page, {url, errors}) => {
      await settled(page);
      await page.keyboard.press("w");
      await page.keyboard.press("ArrowRight");
      await page.keyboard.press("n");
      assert.equal(await value(page, "weight"), "not observed");
      await page.keyboard.press("Control+z");
      assert.equal(await value(page, "weight"), "+0.5");
      await page.keyboard.press("Control+z");
      assert.equal(await value(page, "weight"), "not said yet");
      assert.ok(await page.getByRole("button", {name: "Undo"}).isDisabled());
      await page.keyboard.press("Control+Shift+z");
      assert.equal(await value(page, "weight"), "+0.5");
      await page.getByLabel("Comment").fill("first");
      await page.getByLabel("Confidence").selectOption("0.5");
      await page.keyboard.press("Tab");
      await rate(page, 2);
      const [kept] = await ratedBy(sheet, "ann");
      assert.match(kept, /,1,1\.5,1,,ann,expert,0\.5,.*first/);

      // Something is set for the second; back, mended, and the second is as it was left.
      await page.keyboard.press("t");
      await page.keyboard.press("ArrowLeft");
      await page.keyboard.press("b");
      await settled(page);
      assert.match(await page.locator(".progress").innerText(), /^1 of 9, as kept by ann/);
      assert.deepEqual(await Promise.all(["flow", "weight", "time"].map(factor => value(page, factor))), ["+1.0", "+1.5", "+1.0"]);
      assert.equal(await page.getByLabel("Comment").inputValue(), "first");
      await page.screenshot({path: "label_mend.png"});
      await page.keyboard.press("Enter");
      await settled(page);
      assert.equal((await log()).length, 1, "nothing was changed");
      await page.keyboard.press("b");
      await settled(page);
      await page.keyboard.press("f");
      for (let n = 0; n < 20; ++n) await page.keyboard.press("ArrowLeft");
      await page.keyboard.press("Enter");
      await settled(page);
      const mended = await ratedBy(sheet, "ann");
      assert.equal(mended.length, 1);
      assert.match(mended[0], /,-3,1\.5,1,,ann,expert,0\.5,.*first/);
      assert.equal((await log())[1].before.factors.flow, 1);
      assert.match(await page.locator(".progress").innerText(), /^2 of 9, rated/);
      assert.equal(await value(page, "time"), "\u22120.5");

      const second = await page.context().newPage();
      await second.goto(url);
      await settled(second);
      assert.match(await second.locator(".progress").innerText(), /^2 of 9/);
      await rate(page, 1);
      await rate(second, 5);
      assert.match(await second.locator("#trouble").innerText(), /answered before/);
      assert.match(await second.locator(".progress").innerText(), /^3 of 9/);
      await rate(second, 5);
      assert.equal((await ratedBy(sheet, "ann")).length, 3);
      await page.reload();
      await settled(page);
      assert.match(await page.locator(".progress").innerText(), /^4 of 9/);
      await page.keyboard.press("b");
      await settled(page);
      assert.equal(await value(page, "flow"), "+2.5");
      await assertAccessible(page);
      errors.length = 0;  // what was refused
    });
  } finally {
    await rm(folder, {recursive: true, force: true});
  }
});
