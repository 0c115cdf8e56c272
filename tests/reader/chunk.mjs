// The anchors of a chunk (FORMAT.md, section 9).

import { Ans } from "./ans.mjs";
import { crc32, hex, need, Refusal } from "./bytes.mjs";
import { ContextCoder } from "./context.mjs";
import { walkTrie } from "./lattice.mjs";
import { decodeMask } from "./masks.mjs";
import { decodeSymbol, tableValue } from "./tables.mjs";

/** Decodes the channels of anchors with static tables. */
class TableCoder {
  constructor({ tables, ofChannel }) {
    this.tables = Array.from(ofChannel, (table) => tables[table]);
  }

  decode(ans, _cell, has, symbols, values) {
    for (let c = 0; c < symbols.length; c++) {
      if (!has(c)) continue;
      symbols[c] = decodeSymbol(this.tables[c], ans);
      values[c] = tableValue(this.tables[c], symbols[c]);
    }
  }
}

/** Anchors in order: {cell, mask, symbols, values}. */
export function decodeChunk(bundle, index) {
  const { header, lattice, masks } = bundle;
  const { F, S, K, C, symbolBits } = header;
  const chunk = bundle.chunks[index];
  const place = `chunk ${index}`;
  const bytes = bundle.file.subarray(chunk.offset, chunk.offset + chunk.len);
  const crc = crc32(bytes);
  need(crc === chunk.crc, `${place}: crc`, hex(chunk.crc), hex(crc));
  const ans = new Ans(bytes, place);
  const coder = bundle.context ? new ContextCoder(bundle.context, header) : new TableCoder(bundle.tables);
  const all = K === 32 ? 0xffffffff : 2 ** K - 1;
  const anchors = [];
  walkTrie(lattice, ans, (cell) => {
    need(anchors.length < chunk.nAnchors, `${place}: leaves of its trie`, `more than ${anchors.length}`, `${chunk.nAnchors}`);
    const mask = masks ? decodeMask(masks, K, ans) : all;
    const symbols = new Int32Array(C);
    const values = new Float32Array(C);
    const has = (c) => c < F + S || ((mask >>> Math.floor((c - F - S) / 3)) & 1) === 1;
    coder.decode(ans, cell, has, symbols, values);
    for (let c = 0; c < C; c++) {
      const bits = symbolBits[c < F ? 0 : c < F + S ? 1 : 2];
      const half = 2 ** (bits - 1);
      if (symbols[c] < -half || symbols[c] >= half) {
        throw new Refusal(`${place}: symbol of channel ${c} of anchor ${anchors.length}`, symbols[c], `${bits} bits`);
      }
    }
    anchors.push({ cell, mask, symbols, values });
  });
  need(anchors.length === chunk.nAnchors, `${place}: leaves of its trie`, anchors.length, `${chunk.nAnchors}`);
  ans.end();
  return anchors;
}
