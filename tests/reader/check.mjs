// Goes over the conformance pack (its README.md): what this reader finds against what is expected.

import { readdirSync, readFileSync } from "node:fs";
import { basename, join } from "node:path";
import { openBundle } from "./bundle.mjs";
import { crc32, Refusal } from "./bytes.mjs";
import { Camera } from "./camera.mjs";
import { decodeChunk } from "./chunk.mjs";
import { drawFrame } from "./frame.mjs";
import { levelOf } from "./levels.mjs";
import { readPng } from "./png.mjs";

const json = (path) => JSON.parse(readFileSync(path, "utf8"));
const crcText = (bytes) => crc32(bytes).toString(16).padStart(8, "0");

/** An anchor as the pack writes it. */
export function describe(anchor, offsets) {
  const drawn = Array.from({ length: offsets }, (_, k) => (anchor.mask >>> k) & 1).join("");
  return { cell: anchor.cell, drawn, symbols: Array.from(anchor.symbols) };
}

/** The anchors of all tiers that the file holds. */
export function decodeAll(bundle) {
  const chunks = Array.from({ length: bundle.tiers[bundle.nTiers - 1].nChunks }, (_, i) => decodeChunk(bundle, i));
  return chunks.flat().map((anchor) => describe(anchor, bundle.header.K));
}

/** What differs between a file's shape and the expected one. */
function compareShape(bundle, expected) {
  const found = {
    file_len: bundle.header.fileLen,
    n_tiers: bundle.nTiers,
    tiers: bundle.tiers.slice(0, bundle.nTiers).map((tier) => ({ n_chunks: tier.nChunks, n_anchors: tier.nAnchors })),
  };
  return Object.keys(found)
    .filter((key) => JSON.stringify(found[key]) !== JSON.stringify(expected[key]))
    .map((key) => `${key} is ${JSON.stringify(found[key])}, expected ${JSON.stringify(expected[key])}`);
}

/** The level that each tier declares against the one that it keeps. */
function compareLevels(bundle) {
  return bundle.manifest.flatMap(({ level }, tier) => {
    const kept = levelOf(bundle, tier);
    return level === kept ? [] : [`tier ${tier} declares level ${level} and keeps ${kept}`];
  });
}

function compareAnchors(found, expected) {
  if (found.length !== expected.length) return [`${found.length} anchors, expected ${expected.length}`];
  for (let i = 0; i < found.length; i++) {
    const [is, should] = [found[i], expected[i]];
    if (is.cell.join() !== should.cell.join()) return [`cell of anchor ${i} is ${is.cell}, expected ${should.cell}`];
    if (is.drawn !== should.drawn) return [`drawn of anchor ${i} is ${is.drawn}, expected ${should.drawn}`];
    const at = should.symbols.findIndex((symbol, c) => symbol !== is.symbols[c]);
    if (at >= 0 || is.symbols.length !== should.symbols.length) {
      const counts = `${is.symbols.length} symbols, expected ${should.symbols.length}`;
      return [`symbol ${at} of anchor ${i} is ${is.symbols[at]}, expected ${should.symbols[at]}; ${counts}`];
    }
  }
  return [];
}

function compareFrame(pack, bundle, expected, i) {
  const camera = Camera.of(expected.camera);
  const pixels = drawFrame(bundle, camera, expected.tiers);
  const png = readPng(readFileSync(join(pack, expected.png)));
  const [is, should] = [png, camera].map(({ width, height }) => `${width}×${height}`);
  if (is !== should) return [`frame ${i}: ${expected.png} has ${is} pixels, its camera ${should}`];
  const wrong = pixels.reduce((count, byte, at) => count + (byte !== png.pixels[at] ? 1 : 0), 0);
  if (wrong > 0) return [`frame ${i}: ${wrong} of ${pixels.length} bytes differ from ${expected.png}`];
  return crcText(pixels) === expected.crc32 ? [] : [`frame ${i}: CRC ${crcText(pixels)}, expected ${expected.crc32}`];
}

function checkBundle(pack, path) {
  const expected = json(path);
  const bundle = openBundle(readFileSync(join(pack, expected.file)));
  const anchors = decodeAll(bundle);
  const problems = [
    ...compareShape(bundle, expected),
    ...compareLevels(bundle),
    ...compareAnchors(anchors, expected.anchors),
    ...expected.frames.flatMap((frame, i) => compareFrame(pack, bundle, frame, i)),
  ];
  return { found: `${anchors.length} anchors, ${expected.frames.length} frames`, problems };
}

/** A file to be refused: when it is opened, or at the latest when the chunk that the pack names is decoded. */
function checkRefused(pack, entry) {
  const file = readFileSync(join(pack, entry.file));
  const refusal = (action) => {
    try {
      action();
      return null;
    } catch (error) {
      if (error instanceof Refusal) return error.message;
      throw error;
    }
  };
  const opened = refusal(() => openBundle(file));
  if (entry.when === "opened") return { found: opened, problems: opened ? [] : [`opened, though: ${entry.reason}`] };
  if (opened) return { found: opened, problems: ["refused when it is opened, not when it is decoded"] };
  const decoded = refusal(() => decodeChunk(openBundle(file), entry.chunk));
  return { found: decoded, problems: decoded ? [] : [`chunk ${entry.chunk} decoded, though: ${entry.reason}`] };
}

/** Checks everything, prints a line each, and returns how many have a problem. */
export function checkPack(pack) {
  let failed = 0;
  const run = (name, check) => {
    const start = performance.now();
    let result;
    try {
      result = check();
    } catch (error) {
      result = { found: "", problems: [error instanceof Refusal ? `refused: ${error.message}` : error.stack] };
    }
    const seconds = ((performance.now() - start) / 1000).toFixed(2);
    console.log(`${result.problems.length ? "FAILED" : "ok    "} ${seconds.padStart(6)} s  ${name}: ${result.found}`);
    for (const problem of result.problems) console.log(`       ${problem}`);
    failed += result.problems.length ? 1 : 0;
  };
  const expected = readdirSync(join(pack, "bundles")).filter((name) => name.endsWith(".json")).sort();
  for (const name of expected) run(`bundles/${basename(name, ".json")}`, () => checkBundle(pack, join(pack, "bundles", name)));
  const refused = json(join(pack, "refused.json"));
  for (const entry of refused) run(entry.file, () => checkRefused(pack, entry));
  const unlisted = readdirSync(join(pack, "refused")).filter((name) => !refused.some((entry) => basename(entry.file) === name));
  for (const name of unlisted) run(`refused/${name}`, () => ({ found: "", problems: ["not in refused.json"] }));
  console.log(`${expected.length} bundles, ${refused.length} files to be refused: ${failed ? `${failed} FAILED` : "all as expected"}`);
  return expected.length && refused.length ? failed : failed + 1;
}
