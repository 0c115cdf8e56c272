// From an anchor to its Gaussians (DRAWING.md, section 5).

import { dot, exp, f32Of, max, sigmoid, sqrt, tanh } from "./maths.mjs";

const f = Math.fround;
export const NEAR = f32Of(0x3e4ccccd);
const FAINTEST = f32Of(0x3b808081);
const SMALLEST_NORM = f32Of(0x2b8cbccc);
const LEAST_SPREAD = f(0.1);

/** W·x + b of rows from `first` on: bias first, then inputs ascending. */
function layer(weights, biases, inputs, first, outputs) {
  const n = inputs.length;
  for (let row = 0, at = first * n; row < outputs.length; row++) {
    let sum = biases[first + row];
    for (let i = 0; i < n; i++) sum = f(sum + f(weights[at++] * inputs[i]));
    outputs[row] = sum;
  }
  return outputs;
}

function hiddenUnits(head, inputs) {
  const units = layer(head.w1, head.b1, inputs, 0, new Float32Array(head.hidden));
  for (let i = 0; i < units.length; i++) units[i] = units[i] > 0 ? units[i] : 0;
  return units;
}

const outputs = (head, units, first, count) => layer(head.w2, head.b2, units, first, new Float32Array(count));

/** What the prefilter and the Gaussians need of an anchor. */
export function placeAnchor({ header }, anchor) {
  const { F, S, voxelSize } = header;
  const scales = Array.from(anchor.values.subarray(F, F + S), exp);
  return {
    position: anchor.cell.map((at) => f(at * voxelSize)),
    extent: scales.slice(0, 3),
    base: S === 6 ? scales.slice(3) : [scales[3], scales[3], scales[3]],
  };
}

export function passesPrefilter(camera, { position, extent }, { added }) {
  const [x, y, z] = camera.toCamera(position);
  if (!(z > NEAR)) return false;
  const [p, q] = camera.jacobian(x, y, z).map((row) => row.map((j, axis) => f(j * extent[axis])));
  const [xx, xy, yy] = [f(dot(p, p) + added), dot(p, q), f(dot(q, q) + added)];
  const halfDifference = f(0.5 * f(xx - yy));
  const spread = max(f(f(halfDifference * halfDifference) + f(xy * xy)), LEAST_SPREAD);
  const radius = Math.ceil(f(3 * sqrt(f(f(0.5 * f(xx + yy)) + sqrt(spread)))));
  const [u, v] = camera.toImage(x, y, z);
  return f(u + radius) > 0 && f(u - radius) < camera.width && f(v + radius) > 0 && f(v - radius) < camera.height;
}

/** A Gaussian's rotation, of the four numbers that the covariance head gives. */
function unit(h) {
  const squares = f(f(f(f(h[0] * h[0]) + f(h[1] * h[1])) + f(h[2] * h[2])) + f(h[3] * h[3]));
  const norm = max(sqrt(squares), SMALLEST_NORM);
  return h.map((x) => f(x / norm));
}

/** The Gaussians of an anchor: {centre, opacity, colour, scales, rotation}, rotation null without anisotropy. */
export function evaluate({ header, heads }, anchor, place, eye) {
  const { F, S, K, features } = header;
  const { position, extent, base } = place;
  const away = position.map((at, axis) => f(at - eye[axis]));
  const distance = sqrt(dot(away, away));
  const direction = away.map((d) => (distance > 0 ? f(d / distance) : 0));
  const channels = anchor.values.subarray(0, F);
  const seen = (directed) => Float32Array.from([...channels, ...(features.viewDistance ? [distance] : []), ...(directed ? direction : [])]);
  const geometry = seen(features.viewGeometry);
  const opacities = outputs(heads.opacity, hiddenUnits(heads.opacity, geometry), 0, K);
  let shapeUnits = null;
  let colourUnits = null;
  const gaussians = [];
  for (let k = 0; k < K; k++) {
    if (((anchor.mask >>> k) & 1) === 0 || !(opacities[k] > 0)) continue;
    const opacity = tanh(opacities[k]);
    if (!(opacity >= FAINTEST)) continue;
    shapeUnits ??= hiddenUnits(heads.covariance, geometry);
    colourUnits ??= hiddenUnits(heads.colour, seen(features.viewColour));
    const offset = anchor.values.subarray(F + S + 3 * k, F + S + 3 * k + 3);
    const centre = position.map((at, axis) => f(at + f(offset[axis] * extent[axis])));
    let colour = Array.from(outputs(heads.colour, colourUnits, 3 * k, 3), sigmoid);
    if (features.detail) {
      const units = hiddenUnits(heads.detail, Float32Array.from([...channels, ...colour]));
      const residual = outputs(heads.detail, units, 0, 3);
      colour = colour.map((c, channel) => f(c + residual[channel]));
    }
    const rows = features.anisotropy ? 7 : 1;
    const h = Array.from(outputs(heads.covariance, shapeUnits, rows * k, rows));
    const scales = base.map((size, axis) => f(size * sigmoid(h[rows === 7 ? axis : 0])));
    gaussians.push({ centre, opacity, colour, scales, rotation: rows === 7 ? unit(h.slice(3)) : null });
  }
  return gaussians;
}
