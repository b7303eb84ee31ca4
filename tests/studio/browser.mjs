// A studio, and a browser that looks at it.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {createRequire} from "node:module";
import {mkdtemp, readFile, rm} from "node:fs/promises";
import {tmpdir} from "node:os";
import path from "node:path";
import {chromium} from "playwright-core";

const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Opens the studio on files, runs `visit(page, studio)`, and closes all. Errors on the page fail it. */
export async function withStudio(files, visit, {viewport = {width: 1280, height: 720}} = {}) {
  const folder = await mkdtemp(path.join(tmpdir(), "laban-studio-test-"));
  const server = spawn(process.env.LABAN_PROGRAM, ["studio", ...files, "--no-browser"], {cwd: folder});
  let complaints = "";
  server.stderr.on("data", data => complaints += data);
  const url = await new Promise((found, failed) => {
    server.stdout.once("data", data => found(String(data).trim()));
    server.once("exit", () => failed(new Error(`the studio ended: ${complaints}`)));
  });
  // Software WebGL: what a machine without a graphics card has.
  const browser = await chromium.launch({
    executablePath: process.env.LABAN_CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
  });
  const errors = [];
  try {
    const context = await browser.newContext({viewport, acceptDownloads: true, colorScheme: "light"});
    const page = await context.newPage();
    page.on("pageerror", error => errors.push(error.message));
    page.on("console", message => {
      if (message.type() === "error") errors.push(message.text());
    });
    await page.goto(url);
    await visit(page, {url, folder, pid: server.pid, errors});
    assert.deepEqual(errors, []);
  } finally {
    await browser.close();
    server.removeAllListeners("exit");
    server.kill();
    await rm(folder, {recursive: true, force: true});
  }
}

/** Waits until what was asked for is there: nothing under way, and nothing that waits for a rest. */
export async function settled(page) {
  for (let n = 0; n < 2; ++n) {
    await page.waitForTimeout(300);
    await page.waitForSelector("main[aria-busy=false]");
  }
}

/** No serious finding by axe-core. */
export async function assertAccessible(page) {
  await page.evaluate(axe);
  const found = await page.evaluate(async () => (await globalThis.axe.run()).violations);
  const serious = found.filter(one => ["serious", "critical"].includes(one.impact));
  assert.deepEqual(serious.map(one => `${one.id}: ${one.nodes.map(node => node.target.join(" ")).join(", ")}`), []);
}

/** A picture of what the element shows, to be compared. */
export async function pixels(page, selector) {
  return (await page.locator(selector).screenshot()).toString("base64");
}

/** What a click saves, as bytes. */
export async function downloaded(page, act) {
  const [download] = await Promise.all([page.waitForEvent("download"), act()]);
  return {name: download.suggestedFilename(), bytes: await readFile(await download.path())};
}

export function median(numbers) {
  return [...numbers].sort((a, b) => a - b)[Math.floor(numbers.length / 2)];
}

/** Drops a file on the page. */
export async function drop(page, name, bytes) {
  const dataTransfer = await page.evaluateHandle(([called, base64]) => {
    const dropped = new DataTransfer();
    dropped.items.add(new File([Uint8Array.from(atob(base64), letter => letter.charCodeAt(0))], called));
    return dropped;
  }, [name, Buffer.from(bytes).toString("base64")]);
  await page.dispatchEvent("body", "drop", {dataTransfer});
  await settled(page);
}

/** Presses Play. @returns frames a second, over three seconds. */
export async function playbackRate(page) {
  await page.getByRole("button", {name: "Play", exact: true}).click();
  return page.evaluate(async () => {
    const begin = performance.now();
    let frames = 0;
    while (performance.now() - begin < 3000) {
      await new Promise(requestAnimationFrame);
      ++frames;
    }
    return frames / 3;
  });
}
