// The golden frames of the repository: view 0 of each is that of the bundle's own camera.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { openBundle } from "./bundle.mjs";
import { crc32 } from "./bytes.mjs";
import { Camera } from "./camera.mjs";
import { drawFrame } from "./frame.mjs";

/** Draws them, prints a line each, and returns how many differ. */
export function checkGolden(folder) {
  const rows = readFileSync(join(folder, "frames.csv"), "utf8").trim().split("\n").slice(1);
  const own = rows.map((row) => row.split(",")).filter(([, , view]) => view === "0");
  const wrong = own.filter(([name, tiers, , expected]) => {
    const bundle = openBundle(readFileSync(join(folder, `${name}.psb`)));
    const crc = crc32(drawFrame(bundle, Camera.preview(bundle.header), Number(tiers))).toString(16).padStart(8, "0");
    console.log(`${crc === expected ? "ok    " : "FAILED"} ${name}.psb, ${tiers} tiers: CRC ${crc}, expected ${expected}`);
    return crc !== expected;
  });
  return own.length ? wrong.length : 1;
}
