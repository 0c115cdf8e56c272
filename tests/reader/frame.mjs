// One exact frame of a bundle (DRAWING.md).

import { bake } from "./bake.mjs";
import { Canvas } from "./blend.mjs";
import { decodeChunk } from "./chunk.mjs";
import { evaluate, passesPrefilter, placeAnchor } from "./evaluate.mjs";
import { dilation, project } from "./project.mjs";

/** Splats of the first tiers, in the order of the file. */
function* splats(bundle, camera, nTiers) {
  const blur = dilation(bundle.header, camera);
  for (let i = 0; i < bundle.tiers[nTiers - 1].nChunks; i++) {
    for (const anchor of decodeChunk(bundle, i)) {
      const place = placeAnchor(bundle, anchor);
      if (bundle.gaussians === null && !passesPrefilter(camera, place, blur)) continue;
      for (const gaussian of evaluate(bundle, anchor, place, camera.eye)) {
        const splat = project(camera, bundle.gaussians ? bake(gaussian) : gaussian, blur);
        if (splat !== null) yield splat;
      }
    }
  }
}

/** RGB bytes, row by row. */
export function drawFrame(bundle, camera, nTiers = bundle.nTiers) {
  const canvas = new Canvas(camera.width, camera.height);
  const sorted = [...splats(bundle, camera, nTiers)].sort((a, b) => a.z - b.z);
  for (const splat of sorted) canvas.draw(splat);
  return canvas.bytes(bundle.header.features.background ? bundle.header.background : null);
}
