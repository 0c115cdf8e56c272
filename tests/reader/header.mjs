// The header (FORMAT.md, section 2).

import { crc32, Cursor, FINITE, fround, hex, need, within } from "./bytes.mjs";
import { CAMERA_NUMBER, FOCAL_LENGTH } from "./camera.mjs";

export const VERSION = 4;
const MAGIC = [0x89, 0x50, 0x53, 0x42, 0x0d, 0x0a, 0x1a, 0x0a];
const FIRST_FIELDS = 12;
const BEFORE_SECTIONS = 160;
const SECTION_ROW = 16;

const FEATURES = [
  "viewColour", "viewDistance", "compensation", "masks", "context", "codedHeads", "detail", "anisotropy", "background", null,
  "viewGeometry",
];

/** Features by name; a bit that has no name is refused. */
function features(bits) {
  const named = {};
  for (let bit = 0; bit < 32; bit++) {
    const set = ((bits >>> bit) & 1) === 1;
    need(!set || FEATURES[bit], "header: required features", hex(bits), `bit ${bit} clear`);
    if (FEATURES[bit]) named[FEATURES[bit]] = set;
  }
  return named;
}

/** Rows a, b, c of a rotation, nearly. */
function checkRotation(rotation) {
  const [a, b, c] = [0, 3, 6].map((row) => rotation.subarray(row, row + 3));
  const sum = (...terms) => terms.reduce((total, term) => fround(total + term));
  const dot = (v, w) => [0, 1, 2].map((i) => fround(v[i] * w[i]));
  const minor = (i, j, k) => Math.abs(sum(fround(a[i] * b[j]), -fround(a[j] * b[i]), -c[k]));
  const lengths = fround(Math.abs(sum(...dot(a, a), -1)) + Math.abs(sum(...dot(b, b), -1)));
  const angle = Math.abs(sum(...dot(a, b)));
  const product = sum(minor(1, 2, 0), minor(2, 0, 1), minor(0, 1, 2));
  const off = fround(sum(lengths, angle, product) * 10000);
  need(off < 301, "header: preview rotation, how far off in 1/10000", off, "at most 300");
}

const POSITIVE = [(number) => Number.isFinite(number) && number > 0, "finite and positive"];
const VOXEL_SIZE = [(number) => number > 0 && number < 1e9, "positive and below 1e9"];

/** The header of a file, with the rows of its section table. */
export function readHeader(file) {
  const first = new Cursor(file.subarray(0, FIRST_FIELDS), "header");
  const magic = first.take(8, "magic");
  need(MAGIC.every((byte, i) => magic[i] === byte), "header: magic", Buffer.from(magic).toString("hex"), Buffer.from(MAGIC).toString("hex"));
  const version = first.u16("version");
  need(version === VERSION, "header: version", version, `${VERSION}`);
  const headerLen = first.u16("header_len");
  need(headerLen >= BEFORE_SECTIONS + 4, "header: header_len", headerLen, `at least ${BEFORE_SECTIONS + 4}`);
  need(headerLen <= file.length, "the file's length", file.length, `at least header_len, ${headerLen}`);
  const found = new DataView(file.buffer, file.byteOffset).getUint32(headerLen - 4, true);
  const crc = crc32(file.subarray(0, headerLen - 4));
  need(crc === found, "header: CRC", hex(found), hex(crc));

  const from = new Cursor(file.subarray(FIRST_FIELDS, headerLen - 4), "header");
  const h = { headerLen, fileLen: from.u32("file_len") };
  h.required = from.u32("required features");
  h.features = features(h.required);
  h.optional = from.u32("optional features");
  h.F = within("header: F", from.u16("F"), 1, 256);
  h.K = within("header: K", from.u16("K"), 1, 32);
  h.nAnchors = within("header: n_anchors", from.u32("n_anchors"), 0, 2 ** 24);
  h.nChunks = within("header: n_chunks", from.u32("n_chunks"), 0, h.nAnchors);
  h.maxChunkAnchors = within("header: max_chunk_anchors", from.u16("max_chunk_anchors"), 1, 1024);
  within("header: camera convention", from.u8("camera convention"), 0, 0);
  const nSections = within("header: n_sections", from.u8("n_sections"), 6, 255);
  need(headerLen === BEFORE_SECTIONS + SECTION_ROW * nSections + 4, "header: header_len", headerLen, `164 + 16·${nSections} sections`);
  h.trainingSize = from.u16s(2, "training size", [(n) => n >= 1, "at least 1"]);
  h.background = from.u8s(3, "background", h.features.background ? undefined : [(n) => n === 0, "0 without feature 8"]);
  h.nTiers = within("header: n_tiers", from.u8("n_tiers"), 1, 8);
  h.voxelSize = from.f32s(1, "voxel_size", VOXEL_SIZE)[0];
  h.hiddenColour = within("header: H_c", from.u16("H_c"), 1, 256);
  h.hiddenDetail = within("header: H_d", from.u16("H_d"), ...(h.features.detail ? [1, 256] : [0, 0]));
  h.centre = from.f64s(3, "normalisation centre", FINITE);
  h.scale = from.f64s(1, "normalisation scale", POSITIVE)[0];
  h.preview = {
    rotation: from.f32s(9, "preview rotation", FINITE),
    translation: from.f32s(3, "preview translation", CAMERA_NUMBER),
    focal: from.f32s(2, "preview focal lengths", FOCAL_LENGTH),
    principal: from.f32s(2, "preview principal point", CAMERA_NUMBER),
    size: from.u16s(2, "preview size", [(n) => n >= 1, "at least 1"]),
  };
  checkRotation(h.preview.rotation);
  h.symbolBits = from.u8s(3, "symbol bits", [(n) => n >= 1 && n <= 16, "1 to 16"]);
  from.zeros(1, "reserved");
  h.sections = [];
  for (let i = 0; i < nSections; i++) {
    const kind = from.u8("a section's kind");
    from.zeros(3, `zeros of section ${i}`);
    h.sections.push({ kind, offset: from.u32("a section's offset"), len: from.u32("a section's len"), crc: from.u32("a section's crc") });
  }
  from.end();
  h.S = h.features.anisotropy ? 6 : 4;
  h.C = h.F + h.S + 3 * h.K;
  return h;
}
