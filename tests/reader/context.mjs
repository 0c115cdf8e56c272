// The context that predicts the channels of anchors (FORMAT.md, section 7).

import { Cursor, within } from "./bytes.mjs";
import { Ancestry } from "./follow.mjs";
import { gridFeatures, readLevel, readRows } from "./grid.mjs";
import { f32Of } from "./maths.mjs";
import { readNetwork, runNetwork } from "./network.mjs";
import { decodeResidual, PARTS } from "./residual.mjs";

const STEP = [(step) => step > Math.fround(1e-12) && step < Math.fround(1e12), "above 1e-12, below 1e12"];

export function readContext(bytes, header) {
  const { F, S, C } = header;
  const from = new Cursor(bytes, "context");
  const context = { frame: { min: from.i32s(3, "frame min"), scale: from.u32s(3, "frame scale") } };
  context.baseSteps = from.f32s(3, "base steps", STEP);
  const nLevels = within("context: n_levels", from.u8("n_levels"), 0, 32);
  context.taps = within("context: n_taps", from.u8("n_taps"), 0, nLevels ? 64 : 0);
  const hidden = within("context: n_hidden", from.u16("n_hidden"), 1, 256);
  const outputs = 2 * C + 3;
  if (nLevels === 0) {
    context.edges = from.u8s(3, "edges");
    within("context: e1", context.edges[0], 0, context.edges[1]);
    within("context: e2", context.edges[1], 0, 15);
    within("context: e3", context.edges[2], 0, 25);
    from.zeros(1, "reserved");
    const inputs = [3, 3 + F + S, 3 + F + S];
    context.networks = inputs.map((n) => readNetwork(from, n, hidden, outputs)).reverse();
  } else {
    context.levels = [];
    let rows = 0;
    for (let i = 0; i < nLevels; i++) {
      context.levels.push(readLevel(from, i, rows));
      rows += context.levels[i].nRows;
    }
    context.network = readNetwork(from, 4 * nLevels, hidden, outputs);
    context.tapWeights = Array.from({ length: F }, (_, c) => from.i8s(Math.min(c, context.taps), "taps"));
    context.rows = readRows(from, rows);
  }
  from.end();
  return context;
}

const limit = (number, low, high) => Math.min(high, Math.max(low, number));

/** The f32 nearest to 2^(i/8). */
const STEP_PARTS = [0x3f800000, 0x3f8b95c2, 0x3f9837f0, 0x3fa5fed7, 0x3fb504f3, 0x3fc5672a, 0x3fd744fd, 0x3feac0c7].map(f32Of);

/** A group's step: base step times a power of two in eighths. */
function groupStep(base, q) {
  return Math.fround(Math.fround(base * STEP_PARTS[q & 7]) * 2 ** (q >> 3));
}

/** Decodes the channels of one chunk's anchors, one anchor after another. */
export class ContextCoder {
  constructor(context, header) {
    this.context = context;
    this.header = header;
    this.ancestry = context.levels ? null : new Ancestry(context, header);
  }

  /** Fills `symbols` and `values` for an anchor; channels that `has` denies stay 0. */
  decode(ans, cell, has, symbols, values) {
    const { context } = this;
    const { F, S, C } = this.header;
    let o;
    if (this.ancestry === null) o = runNetwork(context.network, gridFeatures(context, cell));
    else {
      const { level, inputs } = this.ancestry.next(cell);
      o = runNetwork(context.networks[level], inputs);
    }
    const exponents = [0, 1, 2].map((group) => limit(o[2 * C + group], -24, 7));
    const steps = exponents.map((q, group) => groupStep(context.baseSteps[group], q));
    const residuals = new Int32Array(F);
    for (let c = 0; c < C; c++) {
      if (!has(c)) continue;
      const group = c < F ? 0 : c < F + S ? 1 : 2;
      const q = exponents[group];
      const own8 = (o[c] * (PARTS[q & 7] * 2 ** -(q >> 3)) + 16384) >> 15;
      let mean8 = own8;
      if (c < F && context.taps > 0) {
        const weights = context.tapWeights[c];
        let sum = 64;
        for (let i = 0; i < weights.length; i++) sum += weights[i] * residuals[c - weights.length + i];
        mean8 = limit(own8 + 4 + (sum >> 7), -32768, 32767) - 4;
      }
      const scale = limit(o[C + c] - q + 32, 0, 63);
      const symbol = decodeResidual(ans, scale, mean8);
      if (c < F) residuals[c] = limit(8 * symbol - own8, -32768, 32767);
      symbols[c] = symbol;
      values[c] = Math.fround(symbol * steps[group]);
    }
    this.ancestry?.add(cell, symbols, exponents);
  }
}
