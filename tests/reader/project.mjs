// From a Gaussian to its splat on the image (DRAWING.md, sections 6 and 7).

import { NEAR } from "./evaluate.mjs";
import { bitsOf, dot, f32Of, half, ln, min, sqrt, trunc } from "./maths.mjs";

const f = Math.fround;
const BLUR = f(0.3);
const SIXTH = f32Of(0x3e2aaaab);
const [LEAST_SIZE, MOST_SIZE] = [1 / 4096, 4096];
const SLACK = f32Of(0x3c23d70a);
export const LN_255 = f32Of(0x40b15208);
export const TILE = 16;

/** The columns of a rotation's matrix. */
function columns([w, x, y, z]) {
  const diagonal = (a, b) => f(1 - f(2 * f(f(a * a) + f(b * b))));
  const plus = (a, b, c, d) => f(2 * f(f(a * b) + f(c * d)));
  const minus = (a, b, c, d) => f(2 * f(f(a * b) - f(c * d)));
  return [
    [diagonal(y, z), plus(x, y, w, z), minus(x, z, w, y)],
    [minus(x, y, w, z), diagonal(x, z), plus(y, z, w, x)],
    [plus(x, z, w, y), minus(y, z, w, x), diagonal(x, y)],
  ];
}

/** J·R·Σ·Rᵀ·Jᵀ with three scales: {pp, xy, qq, bare}, bare being its determinant. */
function anisotropic(camera, x, y, z, { scales, rotation }) {
  const M = columns(rotation);
  const [p, q] = camera.jacobian(x, y, z).map((row) => M.map((column, axis) => f(dot(row, column) * scales[axis])));
  const minor = (a, b) => f(f(p[a] * q[b]) - f(p[b] * q[a]));
  const cross = [minor(1, 2), minor(2, 0), minor(0, 1)];
  return { pp: dot(p, p), qq: dot(q, q), xy: dot(p, q), bare: dot(cross, cross) };
}

/** The same with one scale. */
function isotropic(camera, x, y, z, { scales }) {
  const [sx, sy] = camera.slopes(x, y, z);
  const du = f(f(camera.fx / z) * scales[0]);
  const dv = f(f(camera.fy / z) * scales[0]);
  const duv = f(du * dv);
  const [sxx, syy] = [f(sx * sx), f(sy * sy)];
  return {
    pp: f(f(du * du) * f(1 + sxx)),
    qq: f(f(dv * dv) * f(1 + syy)),
    xy: f(duv * f(sx * sy)),
    bare: f(f(duv * duv) * f(f(1 + sxx) + syy)),
  };
}

/** First and last tile that a splat may touch along an axis, or null. */
function tiles(centre, reach, size) {
  const low = f(f(f(centre - reach) - 0.5) - SLACK);
  const high = f(f(f(centre + reach) - 0.5) + SLACK);
  if (!(high >= 0 && low <= size - 1)) return null;
  return [Math.floor(trunc(low, size - 1) / TILE), Math.floor(trunc(min(high, size - 1), size - 1) / TILE)];
}

/** A precision as it is kept, in eleven significant bits. */
function precision(x) {
  const n = Math.floor((Math.max(bitsOf(x) - 0x21000000, 0) + 0x1000) / 8192);
  return f32Of(Math.min(n, 65535) * 8192 + 0x21000000);
}

/** What a frame adds to variances, and what of it opacities were trained with: {added, trained, fades}. */
export function dilation(header, camera) {
  const { width, height } = camera;
  const asTrained = ([w, h]) => (w === width && h === height) || (w === height && h === width);
  const compensated = header.features.compensation;
  if (asTrained(header.trainingSize)) return { added: BLUR, trained: compensated ? 0 : BLUR, fades: compensated };
  const { focal: [fx, fy], size } = header.preview;
  const toTraining = f(f(size[0] * size[1]) / f(header.trainingSize[0] * header.trainingSize[1]));
  const ratio = f(f(f(camera.fx / fx) * f(camera.fy / fy)) * toTraining);
  const s2 = ratio > LEAST_SIZE ? Math.min(ratio, MOST_SIZE) : LEAST_SIZE;
  const trained = f(BLUR * s2);
  const added = s2 < 1 ? f(trained + f(f(1 - s2) * SIXTH)) : trained;
  return { added, trained: compensated ? 0 : trained, fades: compensated || s2 < 1 };
}

/** The splat of a Gaussian as blending sees it, or null if nothing of it is drawn. */
export function project(camera, gaussian, { added, trained, fades }) {
  const [x, y, z] = camera.toCamera(gaussian.centre);
  if (!(z > NEAR)) return null;
  const { pp, qq, xy, bare } = (gaussian.rotation ? anisotropic : isotropic)(camera, x, y, z, gaussian);
  const [xx, yy] = [f(pp + added), f(qq + added)];
  const detWith = (blur) => f(f(bare + f(blur * f(pp + qq))) + f(blur * blur));
  const det = detWith(added);
  const opacity = fades ? f(gaussian.opacity * sqrt(f(detWith(trained) / det))) : gaussian.opacity;
  const lo = ln(opacity);
  const reach = f(2 * f(lo + LN_255));
  if (!(reach >= 0 && Number.isFinite(det))) return null;
  const [u, v] = camera.toImage(x, y, z);
  const across = tiles(u, sqrt(f(reach * xx)), camera.width);
  const down = tiles(v, sqrt(f(reach * yy)), camera.height);
  if (across === null || down === null) return null;
  return {
    u, v, z, across, down,
    shear: f(xy / yy),
    rho: precision(f(yy / det)),
    kappa: precision(f(1 / yy)),
    lo: half(lo),
    colour: gaussian.colour.map(half),
  };
}
