// The grid of signs around an anchor, input of the network (FORMAT.md, section 7).

import { need, within } from "./bytes.mjs";

const AXES = [[0, 1, 2], [0, 1], [0, 2], [1, 2]];
const PRIMES = [1, 2654435761, 805459861];
const FEATURES = 4;

/** A level's shape, and its first row once the levels before are known. */
export function readLevel(from, i, firstRow) {
  const kind = within(`context: kind of level ${i}`, from.u8("kind"), 0, 3);
  from.zeros(1, `reserved byte of level ${i}`);
  const nodes = within(`context: n_nodes of level ${i}`, from.u16("n_nodes"), 2, 32768);
  const nRows = from.u32("n_rows");
  const axes = AXES[kind];
  const dense = nRows === nodes ** axes.length;
  const power = nRows > 0 && Number.isInteger(Math.log2(nRows));
  need(dense || power, `context: n_rows of level ${i}`, nRows, `${nodes ** axes.length} or a power of two`);
  return { axes, nodes, nRows, dense, firstRow };
}

export function readRows(from, nRows) {
  return from.take(Math.ceil(nRows / 2), "grid");
}

/** Where a cell lies in the grid, 0 to 65535 on each axis. */
function place(frame, cell, axis) {
  const far = Math.max(cell - frame.min[axis], 0);
  const scale = frame.scale[axis];
  // In two halves, as the whole product may need more than the 53 bits of a number.
  return Math.min(65535, far * Math.floor(scale / 65536) + Math.floor((far * (scale % 65536)) / 65536));
}

function rowOf(level, node) {
  const { nodes, nRows } = level;
  if (level.dense) return node.reduceRight((row, at) => row * nodes + at, 0);
  return (node.reduce((hash, at, axis) => hash ^ Math.imul(at, PRIMES[axis]), 0) >>> 0) % nRows;
}

/** The features of all levels around a lattice cell. */
export function gridFeatures(context, cell) {
  const out = new Int32Array(FEATURES * context.levels.length);
  const u = cell.map((at, axis) => place(context.frame, at, axis));
  context.levels.forEach((level, index) => {
    const d = level.axes.length;
    const t = level.axes.map((axis) => u[axis] * (level.nodes - 1));
    const sums = [0, 0, 0, 0];
    for (let corner = 0; corner < 1 << d; corner++) {
      let weight = d === 2 ? 256 : 1;
      const node = t.map((at, axis) => {
        const upper = (corner >> axis) & 1;
        const f = (at >>> 8) & 255;
        weight *= upper ? f : 256 - f;
        return (at >>> 16) + upper;
      });
      if (weight === 0) continue;
      const row = level.firstRow + rowOf(level, node);
      const bits = context.rows[row >>> 1] >> (row % 2 ? 4 : 0);
      for (let i = 0; i < FEATURES; i++) sums[i] += (bits >> i) & 1 ? weight : -weight;
    }
    for (let i = 0; i < FEATURES; i++) out[index * FEATURES + i] = (512 + sums[i]) >> 10;
  });
  return out;
}
