// Blending of splats into pixels (DRAWING.md, sections 9 and 10).

import { exp, f32Of, sqrtAbove, trunc } from "./maths.mjs";
import { LN_255, TILE } from "./project.mjs";

const f = Math.fround;
const MOST_ALPHA = f32Of(0x3f7d70a4);
const LEAST_TRANSMITTANCE = f32Of(0x38d1b717);
const WIDER = f32Of(0x3a83126f);
const FIRST = f32Of(0x3f7fbe77);

export class Canvas {
  constructor(width, height) {
    this.width = width;
    this.height = height;
    this.colour = new Float32Array(width * height * 3);
    this.left = new Float32Array(width * height).fill(1);
    this.finished = new Uint8Array(width * height);
  }

  draw(splat) {
    for (let j = splat.down[0]; j <= splat.down[1]; j++) {
      for (let i = splat.across[0]; i <= splat.across[1]; i++) this.#drawInTile(splat, i * TILE, j * TILE);
    }
  }

  #drawInTile({ u, v, shear, rho, kappa, lo, colour }, x, y) {
    const width = Math.min(TILE, this.width - x);
    const height = Math.min(TILE, this.height - y);
    const x0 = f(f(u - x) - 0.5);
    const y0 = f(f(v - y) - 0.5);
    const reach = f(2 * f(lo + LN_255));
    if (reach < 0) return;
    const variance = f(1 / rho);
    const step = exp(-rho);
    const rows = span(y0, f(sqrtAbove(f(reach / kappa)) + WIDER), height);
    if (rows === null) return;
    let dy = f(rows[0] - y0);
    for (let row = rows[0]; row <= rows[1]; row++, dy = f(dy + 1)) {
      const across = f(f(dy * dy) * kappa);
      const centre = f(x0 + f(shear * dy));
      const left = f(reach - across);
      if (!(left > 0)) continue;
      const pixels = span(centre, f(sqrtAbove(f(left * variance)) + WIDER), width);
      if (pixels === null) continue;
      const dx = f(pixels[0] - centre);
      let beta = exp(f(lo - f(0.5 * f(across + f(f(dx * dx) * rho)))));
      let factor = exp(f(-rho * f(dx + 0.5)));
      const at = (y + row) * this.width + x;
      for (let pixel = pixels[0]; pixel <= pixels[1]; pixel++) {
        this.#blend(at + pixel, beta, colour);
        beta = f(beta * factor);
        factor = f(factor * step);
      }
    }
  }

  #blend(at, beta, colour) {
    if (this.finished[at]) return;
    const alpha = beta > MOST_ALPHA ? MOST_ALPHA : beta;
    const before = this.left[at];
    const share = f(alpha * before);
    const after = f(before - share);
    if (!(after >= LEAST_TRANSMITTANCE)) {
      this.finished[at] = 1;
      return;
    }
    for (let c = 0; c < 3; c++) this.colour[3 * at + c] = f(this.colour[3 * at + c] + f(share * colour[c]));
    this.left[at] = after;
  }

  /** RGB, row by row; `background` is null without one. */
  bytes(background) {
    const bytes = new Uint8Array(this.colour.length);
    for (let i = 0; i < bytes.length; i++) {
      let colour = this.colour[i];
      if (background) colour = f(colour + f(this.left[Math.floor(i / 3)] * f(background[i % 3] / 255)));
      bytes[i] = trunc(f(f(colour * 255) + 0.5), 255);
    }
    return bytes;
  }
}

/** First and last of n pixels or rows of a tile around a centre, or null. */
function span(centre, half, n) {
  const low = f(centre - half);
  const high = f(centre + half);
  if (high < 0) return null;
  const first = trunc(f(low + FIRST), 65535);
  const last = Math.min(trunc(high, 65535), n - 1);
  return first > last ? null : [first, last];
}
