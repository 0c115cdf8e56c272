// Cameras (DRAWING.md, section 4).

import { need } from "./bytes.mjs";
import { clamp, dot } from "./maths.mjs";

const f = Math.fround;
const END = f(1e15);
const MARGIN = f(0.15);

/** What the translation and the principal point hold to, and focal lengths: a test and its words. */
export const CAMERA_NUMBER = [(number) => Math.abs(number) < END, "of a magnitude below 1e15"];
export const FOCAL_LENGTH = [(number) => number > 0 && number < END, "positive and below 1e15"];

function check(numbers, what, [holds, words]) {
  for (const [i, number] of numbers.entries()) need(holds(number), `camera: ${what}[${i}]`, number, words);
}

/** A camera of f32 numbers, with what a frame needs of it. */
export class Camera {
  constructor({ rotation, translation, focal, principal, size }) {
    this.R = [0, 3, 6].map((row) => Float32Array.from(rotation.slice(row, row + 3)));
    this.t = Float32Array.from(translation);
    const [[fx, fy], [cx, cy]] = [focal.map(f), principal.map(f)];
    check(Array.from(this.t), "translation", CAMERA_NUMBER);
    check([fx, fy], "focal length", FOCAL_LENGTH);
    check([cx, cy], "principal point", CAMERA_NUMBER);
    [this.width, this.height] = size;
    Object.assign(this, { fx, fy, cx, cy });
    const { R, t } = this;
    this.eye = [0, 1, 2].map((c) => -f(f(f(R[0][c] * t[0]) + f(R[1][c] * t[1])) + f(R[2][c] * t[2])));
    const marginX = f(f(MARGIN * this.width) / fx);
    const marginY = f(f(MARGIN * this.height) / fy);
    this.slopeMin = [-f(f(cx / fx) + marginX), -f(f(cy / fy) + marginY)];
    this.slopeMax = [f(f(f(this.width - cx) / fx) + marginX), f(f(f(this.height - cy) / fy) + marginY)];
  }

  /** The camera that a bundle holds. */
  static preview(header) {
    const { rotation, translation, focal, principal, size } = header.preview;
    return new Camera({ rotation, translation, focal: Array.from(focal), principal: Array.from(principal), size });
  }

  /** The camera of a JSON object, as the conformance pack and `inspect --json` write it. */
  static of(json) {
    return new Camera({
      rotation: json.rotation.flat(),
      translation: json.translation,
      focal: json.focal_px,
      principal: json.principal_px,
      size: [json.width_px, json.height_px],
    });
  }

  toCamera(p) {
    return [0, 1, 2].map((row) => f(dot(this.R[row], p) + this.t[row]));
  }

  toImage(x, y, z) {
    return [f(f(f(this.fx * x) / z) + this.cx), f(f(f(this.fy * y) / z) + this.cy)];
  }

  slopes(x, y, z) {
    return [clamp(f(x / z), this.slopeMin[0], this.slopeMax[0]), clamp(f(y / z), this.slopeMin[1], this.slopeMax[1])];
  }

  /** The rows of the Jacobian times the rotation. */
  jacobian(x, y, z) {
    const [jx, jy] = [f(this.fx / z), f(this.fy / z)];
    const [sx, sy] = this.slopes(x, y, z);
    const [R0, R1, R2] = this.R;
    const row = (j, s, from) => [0, 1, 2].map((c) => f(j * f(from[c] - f(s * R2[c]))));
    return [row(jx, sx, R0), row(jy, sy, R1)];
  }
}
