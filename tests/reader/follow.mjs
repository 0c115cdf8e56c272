// Anchors that follow anchors: which one predicts the next of a chunk, and how (FORMAT.md, section 7).

import { PARTS } from "./residual.mjs";

/** The low 16 bits, signed. */
const i16 = (number) => (number << 16) >> 16;
const limit = (number, low, high) => Math.min(high, Math.max(low, number));

/** What of the chunk so far predicts its next anchors. */
export class Ancestry {
  constructor(context, header) {
    this.edges = context.edges;
    this.min = context.frame.min;
    this.shape = header;
    // The last anchor of level 2, and the last of level 1 or 2.
    this.coarse = null;
    this.fine = null;
  }

  /** The next anchor's level, and the inputs of its network. */
  next(cell) {
    const same = (anchor, edge) => anchor !== null && cell.every((at, axis) => at >> edge === anchor.cell[axis] >> edge);
    this.level = !same(this.coarse, this.edges[1]) ? 2 : !same(this.fine, this.edges[0]) ? 1 : 0;
    const parent = [this.fine, this.coarse, null][this.level];
    const edge = this.edges[this.level];
    const from = parent === null ? this.min : parent.cell;
    const place = cell.map((at, axis) => i16(((at - from[axis]) >> Math.max(edge - 14, 0)) << Math.max(14 - edge, 0)));
    return { level: this.level, inputs: Int32Array.from(parent === null ? place : [...place, ...parent.inputs]) };
  }

  /** Takes in the anchor that `next` announced, once it is decoded. */
  add(cell, symbols, exponents) {
    if (this.level === 0) return;
    const { F, S } = this.shape;
    const inputs = [];
    for (let c = 0; c < F + S; c++) {
      const q = exponents[c < F ? 0 : 1];
      const shift = (c < F ? 2 : 4) + (-q >> 3);
      inputs.push(limit((Math.imul(symbols[c], PARTS[-q & 7]) + (1 << (shift - 1))) >> shift, -(2 ** 14), 2 ** 14));
    }
    this.fine = { cell: [...cell], inputs };
    if (this.level === 2) this.coarse = this.fine;
  }
}
