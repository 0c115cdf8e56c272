// The second reader of bundles: written from FORMAT.md, DRAWING.md and MANIFEST.md alone.

import { readFileSync, writeFileSync } from "node:fs";
import { openBundle } from "./bundle.mjs";
import { Refusal } from "./bytes.mjs";
import { Camera } from "./camera.mjs";
import { checkPack, decodeAll } from "./check.mjs";
import { drawFrame } from "./frame.mjs";
import { checkGolden } from "./golden.mjs";
import { levelOf } from "./levels.mjs";

const USAGE = `usage: node tests/reader/main.mjs symbols FILE.psb
       node tests/reader/main.mjs frame FILE.psb OUT.ppm [--tiers N] [--camera CAMERA.json]
       node tests/reader/main.mjs levels FILE.psb
       node tests/reader/main.mjs check PACK
       node tests/reader/main.mjs golden FOLDER`;

/** Prints every anchor of the tiers that the file holds, one a line. */
function symbols(path) {
  for (const anchor of decodeAll(openBundle(readFileSync(path)))) console.log(JSON.stringify(anchor));
}

function frame(path, out, ...options) {
  const bundle = openBundle(readFileSync(path));
  let camera = Camera.preview(bundle.header);
  let tiers = bundle.nTiers;
  while (options.length) {
    const [name, value] = options.splice(0, 2);
    if (name === "--tiers" && value >= 1 && value <= bundle.nTiers) tiers = Number(value);
    else if (name === "--tiers") throw new Error(`--tiers is ${value}, needed: 1 to ${bundle.nTiers}`);
    else if (name === "--camera" && value) camera = Camera.of(JSON.parse(readFileSync(value, "utf8")));
    else throw new Error(USAGE);
  }
  const bytes = drawFrame(bundle, camera, tiers);
  writeFileSync(out, Buffer.concat([Buffer.from(`P6\n${camera.width} ${camera.height}\n255\n`), bytes]));
}

/** Prints the profile, and of each tier in the file the level that it declares and the one that it keeps. */
function levels(path) {
  const bundle = openBundle(readFileSync(path));
  console.log(`profile ${bundle.header.features.context ? "Full" : "Device"}`);
  for (let tier = 0; tier < bundle.nTiers; tier++) {
    console.log(`tier ${tier}: level ${bundle.manifest[tier].level} declared, ${levelOf(bundle, tier)} kept`);
  }
}

try {
  const [command, ...rest] = process.argv.slice(2);
  if (command === "symbols" && rest.length === 1) symbols(...rest);
  else if (command === "frame" && rest.length >= 2) frame(...rest);
  else if (command === "levels" && rest.length === 1) levels(...rest);
  else if (command === "check" && rest.length === 1) process.exitCode = checkPack(rest[0]) ? 1 : 0;
  else if (command === "golden" && rest.length === 1) process.exitCode = checkGolden(rest[0]) ? 1 : 0;
  else throw new Error(USAGE);
} catch (error) {
  console.error(error instanceof Refusal ? `refused: ${error.message}` : error.stack);
  process.exitCode = 1;
}
