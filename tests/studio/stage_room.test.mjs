// The stage: clips are opened by dropping them, looked at from all sides, and stepped through.
import assert from "node:assert/strict";
import {readFile} from "node:fs/promises";
import {test} from "node:test";
import {assertAccessible, pixels, settled, withStudio} from "./browser.mjs";

const {LABAN_TAKE: take} = process.env;
const canvas = ".screen canvas";

async function toStage(page) {
  await page.getByRole("button", {name: "Stage"}).click();
  await page.waitForSelector(".stage-room");
  await settled(page);
}

async function drop(page, name, bytes) {
  await page.evaluate(({name, text}) => {
    const files = new DataTransfer();
    files.items.add(new File([text], name));
    document.dispatchEvent(new DragEvent("drop", {dataTransfer: files, bubbles: true, cancelable: true}));
  }, {name, text: bytes});
  await settled(page);
}

test("a room that is left while it opens is not seen any more", async () => {
  await withStudio([take], async page => {
    await page.route("**/api/effort/open", async route => {
      await new Promise(done => setTimeout(done, 1500));
      await route.continue();
    });
    await page.reload();
    await page.getByRole("button", {name: "Stage"}).click();
    await page.waitForSelector(".stage-room");
    await page.waitForTimeout(1500);
    await settled(page);
    assert.equal(await page.locator(".room").count(), 1);
  });
});

test("time, views and skins change what is seen", async () => {
  await withStudio([take], async page => {
    await toStage(page);
    const seen = new Set([await pixels(page, canvas)]);
    const differs = async what => {
      await page.waitForTimeout(150);
      const picture = await pixels(page, canvas);
      assert.ok(!seen.has(picture), `${what} changed nothing`);
      seen.add(picture);
    };
    for (const view of ["Front", "Side", "Top"]) {
      await page.getByRole("button", {name: view, exact: true}).click();
      await differs(view);
    }
    await page.getByRole("button", {name: "Side", exact: true}).click();
    await page.locator(canvas).focus();
    for (let n = 0; n < 20; ++n) await page.keyboard.press(".");
    assert.match(await page.locator(".clock").innerText(), /^0\.33 /);
    await differs("frame steps");
    await page.keyboard.press("ArrowLeft");
    await differs("turning");
    await page.keyboard.press("+");
    await differs("zooming");
    await page.getByLabel("Onion skins").check();
    await differs("skins");
    await page.getByLabel("Trails").selectOption("all");
    await differs("trails");
    await page.screenshot({path: "stage.png"});
    await page.locator(canvas).focus();
    await page.keyboard.press(" ");
    await page.waitForTimeout(600);
    await page.keyboard.press(" ");
    await differs("playing");
    await assertAccessible(page);
  });
});

test("a clip that is dropped is shown, and a broken one is told by name", async () => {
  await withStudio([], async (page, {errors}) => {
    await settled(page);
    assert.match(await page.locator("main").innerText(), /Drop a clip/);
    const text = await readFile(take, "utf8");
    await drop(page, "my take.bvh", text);
    await toStage(page);
    assert.equal(await page.getByLabel("Clip").evaluate(list => list.selectedOptions[0].textContent), "my take.bvh");
    await drop(page, "half.bvh", text.slice(0, 3000));
    await page.waitForSelector("#trouble:not([hidden])");
    assert.match(await page.locator("#trouble").innerText(), /^half\.bvh:/);
    // The browser tells of the answer 422 itself; nothing else may go wrong.
    assert.ok(errors.every(error => error.includes("422")), errors.join("; "));
    errors.length = 0;
  });
});
