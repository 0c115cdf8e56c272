// Which offsets of an anchor are drawn (FORMAT.md, section 5).

import { Cursor } from "./bytes.mjs";

const CONTEXTS = 4;

export function readMasks(bytes, offsets) {
  const from = new Cursor(bytes, "masks");
  const frequencies = from.u16s(offsets * CONTEXTS, "frequencies", [(f) => f >= 1 && f <= 4095, "1 to 4095"]);
  from.end();
  return frequencies;
}

/** The next anchor's mask: bit k is set if offset k is drawn. */
export function decodeMask(frequencies, offsets, ans) {
  let [mask, drawn] = [0, 0];
  for (let k = 0; k < offsets; k++) {
    const f = frequencies[k * CONTEXTS + Math.min(CONTEXTS - 1, drawn)];
    if (ans.slot < f) {
      ans.advance(0, f);
      mask |= 1 << k;
      drawn++;
    } else ans.advance(f, 4096 - f);
  }
  return mask >>> 0;
}
