// Symbols coded as differences from a predicted normal distribution (FORMAT.md, sections 7 and 8).

import { readFileSync } from "node:fs";
import { slotEntries } from "./ans.mjs";
import { crc32, hex, need } from "./bytes.mjs";

/** round(4096·2^(−i/8)) */
export const PARTS = [4096, 3756, 3444, 3158, 2896, 2656, 2435, 2233];
const MEANS = 5;
const TABLES = new URL("../../decoder-format/src/bundle/normal_tables.bin", import.meta.url);
const TABLES_CRC = 0xa3de3992;

/** For each scale and mean, the mean fastest: D, and where the slots of each difference begin; 4096 ends a table. */
function readNormalTables() {
  const bytes = readFileSync(TABLES);
  need(crc32(bytes) === TABLES_CRC, "normal_tables.bin: CRC", hex(crc32(bytes)), hex(TABLES_CRC));
  const numbers = new Uint16Array(bytes.length / 2);
  for (let i = 0; i < numbers.length; i++) numbers[i] = bytes[2 * i] | (bytes[2 * i + 1] << 8);
  const tables = [];
  for (let at = 0; at < numbers.length; ) {
    const bounds = numbers.subarray(at, numbers.indexOf(4096, at) + 1);
    tables.push({ reach: (bounds.length - 3) / 2, bounds, entries: slotEntries(bounds) });
    at += bounds.length;
  }
  return tables;
}

let normalTables = null;

/** The difference that a scale and the magnitude of a mean predict; after an escape the symbol itself. */
export function decodeResidual(ans, scale, mean8) {
  normalTables ??= readNormalTables();
  const centre = (mean8 + 4) >> 3;
  const offCentre = mean8 - 8 * centre;
  const table = normalTables[scale * MEANS + Math.abs(offCentre)];
  const entry = ans.entry(table.bounds, table.entries);
  let d = entry - table.reach;
  if (entry > 2 * table.reach) {
    const byte = ans.raw();
    if (byte >= 254) return ans.rawSymbol();
    d = (table.reach + 1 + (byte >> 1)) * (byte % 2 ? -1 : 1);
  }
  return offCentre < 0 ? centre - d : centre + d;
}
