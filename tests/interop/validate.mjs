// node validate.mjs FILE... : the Khronos glTF validator's verdict on each file.
//
// Prints one line a file and one an issue; exits 1 if any file has an error or a warning, 2 if none
// was given or one could not be read. `npm install` in this folder brings the validator.

import { readFile } from "node:fs/promises";

import { validateBytes } from "gltf-validator";

const severityNames = ["error", "warning", "information", "hint"];

async function isClean(path) {
  const report = await validateBytes(new Uint8Array(await readFile(path)), {
    uri: path,
    maxIssues: 20,
  });
  const { numErrors, numWarnings, messages } = report.issues;
  console.log(`${path}: ${numErrors} errors, ${numWarnings} warnings`);
  for (const { severity, code, pointer, message } of messages) {
    console.log(`  ${severityNames[severity]} ${code} at ${pointer ?? "the file"}: ${message}`);
  }
  return numErrors === 0 && numWarnings === 0;
}

const paths = process.argv.slice(2);
if (paths.length === 0) {
  console.error("usage: node validate.mjs FILE...");
  process.exit(2);
}
try {
  const verdicts = await Promise.all(paths.map(isClean));
  process.exit(verdicts.every(Boolean) ? 0 : 1);
} catch (error) {
  console.error(`validate.mjs: ${error.message}`);
  process.exit(2);
}
