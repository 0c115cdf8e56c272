// Where the sections of a file lie (FORMAT.md, sections 1 and 2).

import { crc32, hex, need } from "./bytes.mjs";

export const ALIGNMENT = 4;
export const aligned = (length) => Math.ceil(length / ALIGNMENT) * ALIGNMENT;
export const KIND = { heads: 1, lattice: 2, masks: 3, tables: 4, context: 5, manifest: 6, directory: 7, chunks: 8, gaussians: 128 };
const FIRST_OPTIONAL = 128;

/** The kinds below 128 that a scene of these features has, in order. */
function mandatory(features) {
  return [
    KIND.heads, KIND.lattice, ...(features.masks ? [KIND.masks] : []), features.context ? KIND.context : KIND.tables,
    KIND.manifest, KIND.directory, KIND.chunks,
  ];
}

/** The bytes up to the next multiple of 4 behind a section or a chunk are 0. */
export function checkPadding(file, end, place) {
  for (let at = end; at < Math.min(aligned(end), file.length); at++) need(file[at] === 0, `${place}: byte ${at} behind it`, file[at], "0");
}

/** The bytes of each known section by its kind; of the chunks the row of the table. */
export function locateSections(file, header) {
  const kinds = mandatory(header.features);
  const found = new Map();
  let end = header.headerLen;
  let next = 0;
  header.sections.forEach((row, i) => {
    const place = `section ${i} of kind ${row.kind}`;
    need(next < kinds.length, `${place}: its place`, "behind the chunks", "before them");
    if (row.kind < FIRST_OPTIONAL) {
      need(row.kind === kinds[next], `${place}: kind`, row.kind, `${kinds[next]} next, or 128 and more`);
      next++;
    }
    need(row.offset === aligned(end), `${place}: offset`, row.offset, `${aligned(end)}, where the section before ends`);
    end = row.offset + row.len;
    if (row.kind === KIND.chunks) {
      need(row.crc === 0, `${place}: crc`, hex(row.crc), "0");
      found.set(row.kind, row);
      return;
    }
    need(aligned(end) <= file.length, `${place}: end`, end, `at most ${file.length}, the file's length`);
    checkPadding(file, end, place);
    const bytes = file.subarray(row.offset, end);
    const crc = crc32(bytes);
    need(crc === row.crc, `${place}: crc`, hex(row.crc), hex(crc));
    if (row.kind >= FIRST_OPTIONAL && !Object.values(KIND).includes(row.kind)) return;
    need(!found.has(row.kind), `${place}: sections of this kind`, 2, "1");
    found.set(row.kind, bytes);
  });
  need(next === kinds.length, "header: section kinds", header.sections.map((row) => row.kind).join(" "), kinds.join(" "));
  return found;
}
