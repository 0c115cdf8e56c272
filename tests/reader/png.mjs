// PNG files of 8-bit RGB, for expected frames.

import { inflateSync } from "node:zlib";

const SIGNATURE_LEN = 8;
const RGB = 3;

/** {width, height, pixels}, RGB row by row. */
export function readPng(bytes) {
  const parts = [];
  let width, height;
  for (let at = SIGNATURE_LEN; at < bytes.length; ) {
    const length = bytes.readUInt32BE(at);
    const type = bytes.toString("latin1", at + 4, at + 8);
    const data = bytes.subarray(at + 8, at + 8 + length);
    if (type === "IHDR") {
      [width, height] = [data.readUInt32BE(0), data.readUInt32BE(4)];
      const [depth, colour, , , interlaced] = data.subarray(8);
      const form = `depth ${depth}, colour type ${colour}, interlacing ${interlaced}`;
      if (form !== "depth 8, colour type 2, interlacing 0") throw new Error(`PNG of ${form}, needed: 8, 2, 0`);
    } else if (type === "IDAT") parts.push(data);
    at += length + 12;
  }
  return { width, height, pixels: unfilter(inflateSync(Buffer.concat(parts)), width * RGB, height) };
}

function unfilter(rows, stride, height) {
  const pixels = new Uint8Array(stride * height);
  for (let row = 0; row < height; row++) {
    const filter = rows[row * (stride + 1)];
    for (let i = 0; i < stride; i++) {
      const at = row * stride + i;
      const left = i < RGB ? 0 : pixels[at - RGB];
      const up = row === 0 ? 0 : pixels[at - stride];
      const corner = i < RGB || row === 0 ? 0 : pixels[at - stride - RGB];
      const predicted = [0, left, up, (left + up) >> 1, nearest(left, up, corner)][filter];
      pixels[at] = rows[row * (stride + 1) + 1 + i] + predicted;
    }
  }
  return pixels;
}

function nearest(left, up, corner) {
  const at = left + up - corner;
  const [a, b, c] = [left, up, corner].map((value) => Math.abs(at - value));
  return a <= b && a <= c ? left : b <= c ? up : corner;
}
