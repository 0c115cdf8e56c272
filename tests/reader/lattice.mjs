// The trie of the cells of a chunk's anchors (FORMAT.md, section 4).

import { Cursor, need, within } from "./bytes.mjs";

const CONTEXTS = 3;

export function readLattice(bytes) {
  const from = new Cursor(bytes, "lattice");
  const min = from.i32s(3, "min", [(n) => Math.abs(n) <= 2 ** 23, "a magnitude of at most 2^23"]);
  const bits = within("lattice: bits of a coordinate", from.u8("bits"), 0, 21);
  from.zeros(3, "reserved");
  const ends = from.u16s(3 * bits * CONTEXTS * 2, "frequencies", [(n) => n <= 4096, "at most 4096"]);
  for (let i = 0; i < ends.length; i += 2) {
    need(ends[i] <= ends[i + 1], `lattice: end_both[${i / 2}]`, ends[i], `at most end_zero, ${ends[i + 1]}`);
  }
  from.end();
  return { min, bits, ends };
}

const ANCESTORS = 7;
const BRANCHINGS = [0, 1, 1, 2, 1, 2, 2, 2];

/** Walks the trie of a chunk; calls `leaf(cell)` at each of its anchors, in order, and goes on when that returns. */
export function walkTrie(lattice, ans, leaf) {
  const { min, bits, ends } = lattice;
  const levels = 3 * bits;
  const cell = [0, 0, 0];
  // Nodes whose child 1 comes later: level, the path so far, ancestors.
  const pending = [];
  let level = 0;
  let ancestors = 0;
  for (;;) {
    while (level < levels) {
      const at = (level * CONTEXTS + BRANCHINGS[ancestors]) * 2;
      const [both, zero] = [ends[at], ends[at + 1]];
      const slot = ans.slot;
      if (slot < both) {
        ans.advance(0, both);
        pending.push({ level, ancestors, path: [...cell] });
        ancestors = ((ancestors << 1) | 1) & ANCESTORS;
      } else {
        if (slot < zero) ans.advance(both, zero - both);
        else {
          ans.advance(zero, 4096 - zero);
          setBit(cell, level, bits);
        }
        ancestors = (ancestors << 1) & ANCESTORS;
      }
      level++;
    }
    leaf([min[0] + cell[0], min[1] + cell[1], min[2] + cell[2]]);
    const node = pending.pop();
    if (node === undefined) return;
    cell.splice(0, 3, ...node.path);
    setBit(cell, node.level, bits);
    ancestors = ((node.ancestors << 1) | 1) & ANCESTORS;
    level = node.level + 1;
  }
}

/** Levels go from the top bit down, z before y before x. */
function setBit(cell, level, bits) {
  cell[2 - (level % 3)] += 2 ** (bits - 1 - Math.floor(level / 3));
}
