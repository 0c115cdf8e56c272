// A whole file, checked (FORMAT.md, section 1).

import { need } from "./bytes.mjs";
import { readContext } from "./context.mjs";
import { readDirectory, readGaussians, readManifest } from "./directory.mjs";
import { readHeader } from "./header.mjs";
import { readHeads } from "./heads.mjs";
import { readLattice } from "./lattice.mjs";
import { readMasks } from "./masks.mjs";
import { checkPadding, KIND, locateSections } from "./sections.mjs";
import { readTables } from "./tables.mjs";

/** How many tiers the file holds: it ends where one ends, at `file_len` or before. */
function tiersFound(file, header, ends) {
  const listed = ends.join(", ");
  need(ends.includes(header.fileLen), "header: file_len", header.fileLen, `the end of a tier: ${listed}`);
  const end = Math.min(header.fileLen, file.length);
  need(ends.includes(end), "the file's length", file.length, `at least ${header.fileLen}, or the end of a tier: ${listed}`);
  return ends.lastIndexOf(end) + 1;
}

/** Everything of a file but its chunks. Throws a Refusal. */
export function openBundle(file) {
  const header = readHeader(file);
  const sections = locateSections(file, header);
  const row = sections.get(KIND.chunks);
  const bundle = { file, header, chunksOffset: row.offset };
  bundle.heads = readHeads(sections.get(KIND.heads), header);
  bundle.lattice = readLattice(sections.get(KIND.lattice));
  if (header.features.masks) bundle.masks = readMasks(sections.get(KIND.masks), header.K);
  if (header.features.context) bundle.context = readContext(sections.get(KIND.context), header);
  else bundle.tables = readTables(sections.get(KIND.tables), header.C);
  bundle.manifest = readManifest(sections.get(KIND.manifest), header.nTiers);
  Object.assign(bundle, readDirectory(sections.get(KIND.directory), header, row));
  bundle.gaussians = readGaussians(sections.get(KIND.gaussians), header, bundle.tiers);
  bundle.nTiers = tiersFound(file, header, bundle.tiers.map((tier) => row.offset + tier.end));
  const { nChunks } = bundle.tiers[bundle.nTiers - 1];
  bundle.chunks.slice(0, nChunks).forEach(({ offset, len }, i) => checkPadding(file, offset + len, `chunk ${i}`));
  return bundle;
}
