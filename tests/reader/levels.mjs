// The level that each tier keeps, as a writer declares it (MANIFEST.md, sections 4 and 5; DRAWING.md, section 13).

const LEVELS = [
  { pixels: 128 * 96, scratch: 54272, flash: 32768, anchors: 4000, splats: 2000, macs: 1e6, instructions: 40e6 },
  { pixels: 128 * 128, scratch: 119808, flash: 65536, anchors: 8000, splats: 4000, macs: 2e6, instructions: 70e6 },
  { pixels: 160 * 120, scratch: 250880, flash: 98304, anchors: 16000, splats: 8000, macs: 10e6, instructions: 100e6 },
  { pixels: 320 * 240, scratch: 1037312, flash: 1048576, anchors: 60000, splats: 32000, macs: 50e6, instructions: 320e6 },
  { pixels: 640 * 480, scratch: 8388608, flash: 4194304, anchors: 200000, splats: 200000, macs: 500e6, instructions: 4e9 },
];
const STRIPS = [1, 2, 4, 8];
const up8 = (n) => Math.ceil(n / 8) * 8;

/** Words that the heads take, with their weights in f32. */
function headWords({ header, heads }) {
  const { F, K, C, features, hiddenColour: colour, hiddenDetail: detail } = header;
  const [geometryInputs, colourInputs] = [heads.opacity.inputs, heads.colour.inputs];
  const perOffset = features.anisotropy ? 7 : 1;
  const detailWords = detail === 0 ? 0 : up8(detail) * (F + 4) + 3 * (detail + 1);
  const narrow = (F === 1 ? (1 + perOffset) * K : 0) + (colour === 1 ? 3 * K : 0);
  const first = 2 * up8(F) * (geometryInputs + 1) + up8(colour) * (colourInputs + 1);
  const second = (1 + perOffset) * K * (F + 1) + 3 * K * (colour + 1);
  const working = C + Math.max(geometryInputs, colourInputs) + up8(Math.max(F, colour, detail)) + up8(detail) + 11 * K;
  return detailWords + first + second + narrow + working;
}

/** The context's inputs, hidden units and what it keeps; null with tables. */
function contextShape({ header, context }) {
  if (!context) return null;
  const { F, S, C } = header;
  const network = context.levels ? context.network : context.networks[0];
  const weights = context.levels ? context.tapWeights.reduce((sum, taps) => sum + taps.length, 0) : 0;
  return {
    inputs: network.inputs,
    hidden: network.hidden,
    kept: context.levels ? (context.taps > 0 ? F : 0) : 2 * (F + S),
    corners: context.levels ? context.levels.reduce((sum, level) => sum + 2 ** level.axes.length, 0) : 0,
    products: network.hidden * (network.inputs + 2 * C + 3) + weights,
  };
}

/** Scratch bytes of a streamed plan for frames of the training size in strips of at most `most` splats. */
function scratchBytes(bundle, tier, most) {
  const shape = contextShape(bundle);
  const models = shape ? Math.ceil((shape.inputs + shape.hidden + shape.kept) / 2) : 36 * bundle.tables.tables.length;
  const enough = bundle.gaussians ? bundle.gaussians[tier] : bundle.tiers[tier].nAnchors * bundle.header.K;
  const places = Math.min(Math.max(most + Math.ceil(most / 16), 2), enough);
  const tiles = 1024 + 192 + 256;
  return 4 * (headWords(bundle) + models + tiles + 10 * places) + 3;
}

/** Model instructions of frames of the training size in n strips. */
function modelInstructions(bundle, tier, n) {
  const { header, manifest } = bundle;
  const record = manifest[tier];
  const cut = STRIPS.indexOf(n);
  const shape = contextShape(bundle);
  const [width, height] = header.trainingSize;
  const outputs = 2 * header.C + 3;
  const coding = shape
    ? 45 * header.C + 83 * shape.corners + 44 * (outputs + shape.hidden) + 4 * shape.products
    : 8 * header.C;
  const rows = Math.ceil(Math.ceil(height / 16) / n);
  const evaluated = record.decodedAnchors * (3330 + coding) + record.visibleAnchors * 580 + 1024 * record.headKiloMacs * 3 + record.splats * 1560;
  const sorted = record.stripSplats[cut] * (125 + 17 * rows);
  return n * (evaluated + sorted) + record.stripPairs[0] * 1511 + 1024 * record.kiloPixels * 34 + width * height * 93;
}

/** The least level whose every bound the tier keeps; 0 for none, or where it is not measured. */
export function levelOf(bundle, tier) {
  const { header, manifest, tiers, chunksOffset } = bundle;
  const record = manifest[tier];
  if (record.cameras === 0) return 0;
  const keeps = (bound) => {
    if (header.trainingSize[0] * header.trainingSize[1] > bound.pixels || chunksOffset + tiers[tier].end > bound.flash) return false;
    if (tiers[tier].nAnchors > bound.anchors || record.splats > bound.splats || 1024 * record.headKiloMacs > bound.macs) return false;
    const n = STRIPS.find((_, cut) => scratchBytes(bundle, tier, record.stripSplats[cut]) <= bound.scratch);
    return n !== undefined && modelInstructions(bundle, tier, n) <= bound.instructions;
  };
  return LEVELS.findIndex(keeps) + 1;
}
