// Tiers and chunks (FORMAT.md, section 9; the manifest, of which nothing decides about pixels: MANIFEST.md).

import { Cursor, FINITE, fround, need, within } from "./bytes.mjs";
import { aligned } from "./sections.mjs";

const NOT_MEASURED = 0x7fc00000;

export function readManifest(bytes, nTiers) {
  const from = new Cursor(bytes, "manifest");
  const records = [];
  for (let tier = 0; tier < nTiers; tier++) {
    const bits = new DataView(bytes.buffer, bytes.byteOffset + from.at).getUint32(0, true);
    const psnr = from.f32("PSNR");
    need(Number.isFinite(psnr) || bits === NOT_MEASURED, `manifest: PSNR of tier ${tier}`, `0x${bits.toString(16)}`, "finite or 0x7fc00000");
    const record = { psnr, views: from.u16("n_views"), cameras: from.u16("n_cameras") };
    record.visibleAnchors = from.u32("max_visible_anchors");
    record.splats = from.u32("max_splats");
    record.stripSplats = from.u32s(4, "max_strip_splats");
    record.stripPairs = from.u32s(4, "max_strip_pairs");
    record.headKiloMacs = from.u32("max_head_kilo_macs");
    record.kiloPixels = from.u32("max_kilo_pixels");
    record.decodedAnchors = from.u32("max_decoded_anchors");
    record.level = within(`manifest: level of tier ${tier}`, from.u8("level"), 0, 5);
    from.zeros(3, "reserved");
    records.push(record);
  }
  from.end();
  return records;
}

/** Tiers, the frame of the ink boxes, and the chunks with their places in the file. */
export function readDirectory(bytes, header, chunksRow) {
  const from = new Cursor(bytes, "directory");
  const tiers = [];
  for (let i = 0; i < header.nTiers; i++) {
    tiers.push({ nChunks: from.u32("n_chunks"), nAnchors: from.u32("n_anchors"), end: from.u32("end") });
  }
  const inkMin = from.f32s(3, "ink min", FINITE);
  const inkStep = from.f32s(3, "ink step", [(step) => step >= 0, "not negative"]);
  inkMin.forEach((min, axis) => {
    const high = fround(min + fround(65535 * inkStep[axis]));
    need(Number.isFinite(high), `directory: ink min + 65535·step of axis ${axis}`, high, "finite");
  });
  const chunks = [];
  const sums = [{ nAnchors: 0, end: 0 }];
  let end = 0;
  for (let i = 0; i < header.nChunks; i++) {
    const place = `directory: chunk ${i}`;
    const chunk = { offset: chunksRow.offset + end, len: from.u32("len"), crc: from.u32("crc") };
    need(chunk.len % 2 === 0, `${place}: len`, chunk.len, "an even number");
    chunk.nAnchors = within(`${place}: n_anchors`, from.u16("n_anchors"), 1, header.maxChunkAnchors);
    from.zeros(2, `reserved of chunk ${i}`);
    chunk.low = from.u16s(3, "ink box");
    chunk.high = from.u16s(3, "ink box");
    chunk.low.forEach((low, axis) => within(`${place}: lowest corner, axis ${axis}`, low, 0, chunk.high[axis]));
    end += aligned(chunk.len);
    need(end <= chunksRow.len, `${place}: end`, end, `at most ${chunksRow.len}, the section's length`);
    chunks.push(chunk);
    sums.push({ nAnchors: sums[i].nAnchors + chunk.nAnchors, end });
  }
  from.end();
  need(end === chunksRow.len, "section chunks: len", chunksRow.len, `${end}, the chunks' lengths`);
  tiers.forEach((tier, i) => {
    const place = `directory: tier ${i}`;
    const before = i ? tiers[i - 1].nChunks : 0;
    within(`${place}: n_chunks`, tier.nChunks, before, header.nChunks);
    need(tier.nAnchors === sums[tier.nChunks].nAnchors, `${place}: n_anchors`, tier.nAnchors, `${sums[tier.nChunks].nAnchors}, those of its chunks`);
    need(tier.end === sums[tier.nChunks].end, `${place}: end`, tier.end, `${sums[tier.nChunks].end}, where its chunks end`);
  });
  const last = tiers[tiers.length - 1];
  need(last.nChunks === header.nChunks, "directory: n_chunks of the last tier", last.nChunks, `${header.nChunks}`);
  need(last.nAnchors === header.nAnchors, "directory: n_anchors of the last tier", last.nAnchors, `${header.nAnchors}`);
  return { tiers, chunks, inkMin, inkStep };
}

/** Gaussians up to each tier, if there is such a section and the scene looks the same from everywhere; else null. */
export function readGaussians(bytes, header, tiers) {
  if (bytes === undefined) return null;
  const from = new Cursor(bytes, "gaussians");
  const counts = from.u32s(tiers.length, "Gaussians up to a tier");
  from.end();
  counts.forEach((count, i) => within(`gaussians: tier ${i}`, count, i ? counts[i - 1] : 0, tiers[i].nAnchors * header.K));
  const { viewColour, viewDistance, viewGeometry } = header.features;
  return viewColour || viewDistance || viewGeometry ? null : counts;
}
