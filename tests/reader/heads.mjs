// The heads' weights, plain or coded (FORMAT.md, section 3).

import { Ans } from "./ans.mjs";
import { Cursor, FINITE, fround, need } from "./bytes.mjs";
import { decodeSymbol, readTable } from "./tables.mjs";

/** Names and sizes of a scene's heads. */
function shapes({ F, K, hiddenColour, hiddenDetail, features: f }) {
  const seen = F + (f.viewDistance ? 1 : 0);
  const geometry = seen + (f.viewGeometry ? 3 : 0);
  const heads = [
    { name: "opacity", inputs: geometry, hidden: F, outputs: K },
    { name: "covariance", inputs: geometry, hidden: F, outputs: f.anisotropy ? 7 * K : K },
    { name: "colour", inputs: seen + (f.viewColour ? 3 : 0), hidden: hiddenColour, outputs: 3 * K },
  ];
  if (f.detail) heads.push({ name: "detail", inputs: F + 3, hidden: hiddenDetail, outputs: 3 });
  return heads;
}

function readStep(from, name) {
  const table = readTable(from, name);
  need(table.origin === 0, `heads: origin of the ${name}`, table.origin, "0");
  const exponent = Math.log2(table.step);
  need(Number.isInteger(exponent) && exponent >= -24 && exponent <= 0, `heads: step of the ${name}`, table.step, "a power of two from 2^-24 to 1");
  return table;
}

/** Heads by name: {inputs, hidden, outputs, w1, b1, w2, b2}. */
export function readHeads(bytes, header) {
  const from = new Cursor(bytes, "heads");
  const heads = shapes(header);
  if (header.features.codedHeads) {
    const first = readStep(from, "table of all W1");
    const second = readStep(from, "table of all W2");
    for (const head of heads) {
      head.b1 = from.f16s(head.hidden, `b1 of ${head.name}`, FINITE);
      head.b2 = from.f16s(head.outputs, `b2 of ${head.name}`, FINITE);
    }
    const ans = new Ans(from.take(from.left, "words"), "heads");
    const weights = (table, length) => Float32Array.from({ length }, () => fround(decodeSymbol(table, ans) * table.step));
    for (const head of heads) {
      head.w1 = weights(first, head.hidden * head.inputs);
      head.w2 = weights(second, head.outputs * head.hidden);
    }
    ans.end();
  } else {
    for (const head of heads) {
      head.w1 = from.f16s(head.hidden * head.inputs, `W1 of ${head.name}`, FINITE);
      head.b1 = from.f16s(head.hidden, `b1 of ${head.name}`, FINITE);
      head.w2 = from.f16s(head.outputs * head.hidden, `W2 of ${head.name}`, FINITE);
      head.b2 = from.f16s(head.outputs, `b2 of ${head.name}`, FINITE);
    }
  }
  from.end();
  return Object.fromEntries(heads.map((head) => [head.name, head]));
}
