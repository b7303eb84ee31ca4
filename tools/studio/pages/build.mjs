// Bundles the pages into one self-contained file: node build.mjs OUT_DIR
//
// Scripts and styles stand inside it under a nonce that the server fills in, so the page loads nothing.
import {mkdir, readFile, writeFile} from "node:fs/promises";
import path from "node:path";
import {fileURLToPath} from "node:url";
import {build} from "esbuild";

const source = path.join(path.dirname(fileURLToPath(import.meta.url)), "src");
const out = process.argv[2];
if (!out) throw new Error("usage: node build.mjs OUT_DIR");

async function bundle(name) {
  const result = await build({
    entryPoints: [path.join(source, name)],
    bundle: true,
    minify: true,
    write: false,
    format: "esm",
    target: "es2022",
    legalComments: "eof",
    charset: "utf8",
    logLevel: "warning",
  });
  // Nothing in the bundle may end the element that it stands in.
  return result.outputFiles[0].text.replaceAll("</script", "<\\/script").replaceAll("</style", "<\\/style");
}

const page = await readFile(path.join(source, "index.html"), "utf8");
const [script, style] = await Promise.all([bundle("main.ts"), bundle("style.css")]);
await mkdir(out, {recursive: true});
await writeFile(path.join(out, "index.html"),
                page.replace("{{style}}", () => style).replace("{{script}}", () => script));
