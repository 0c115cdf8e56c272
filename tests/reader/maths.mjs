// Arithmetic and functions of DRAWING.md, sections 2 and 3, in f32: each operation is rounded by Math.fround.

const f = Math.fround;
const number = new Float32Array(1);
const word = new Uint32Array(number.buffer);

/** The 32 bits of an f32, and the f32 of 32 bits. */
export function bitsOf(x) {
  number[0] = x;
  return word[0];
}
export function f32Of(bits) {
  word[0] = bits;
  return number[0];
}

export const max = (a, b) => (a > b ? a : b);
export const min = (a, b) => (a < b ? a : b);
export const sqrt = (x) => f(Math.sqrt(x));
export const dot = (a, b) => f(f(f(a[0] * b[0]) + f(a[1] * b[1])) + f(a[2] * b[2]));

export function clamp(x, low, high) {
  const above = x < low ? low : x;
  return above > high ? high : above;
}

/** The integer part; 0 of negative numbers and NaN, and at most `most`. */
export const trunc = (x, most) => (x > 0 ? Math.min(Math.floor(x), most) : 0);

const [LOG2_E, MAGIC, LN2_HIGH, LN2_LOW] = [0x3fb8aa3b, 0x4b400000, 0x3f318000, 0xb95e8083].map(f32Of);
const [E0, E1, E2, E3] = [0x3ab68b03, 0x3c090836, 0x3d2aaa8b, 0x3e2aaa6c].map(f32Of);

export function exp(x) {
  x = x < -87 ? -87 : x;
  x = x > 88 ? 88 : x;
  const s = f(f(x * LOG2_E) + MAGIC);
  const n = f(s - MAGIC);
  const r = f(f(x - f(n * LN2_HIGH)) - f(n * LN2_LOW));
  const q = f(f(f(f(f(f(f(f(E0 * r) + E1) * r) + E2) * r) + E3) * r) + 0.5);
  const e = f(1 + f(r + f(f(r * r) * q)));
  return f(e * f32Of((bitsOf(s) << 23) + 0x3f800000));
}

export const sigmoid = (x) => f(1 / f(1 + exp(-x)));

const [T0, T1, T2, T3] = [0x3c935d22, 0xbd5aac71, 0x3e08810b, 0xbeaaaaa3].map(f32Of);

/** Of x above 0. */
export function tanh(x) {
  if (x < 0.5) {
    const q = f(x * x);
    const p = f(f(f(f(f(f(T0 * q) + T1) * q) + T2) * q) + T3);
    return f(x + f(f(x * q) * p));
  }
  return f(1 - f(2 / f(exp(f(2 * x)) + 1)));
}

const [L0, L1, L2, L3, LN2_REST, LN2_MOST] = [0x3eccce13, 0x3e789e26, 0x3f2aaaaa, 0x3e91e9ee, 0x3717f7d1, 0x3f317180].map(f32Of);
const BELOW_ALL = -88;

/** Of numbers below 2^-126 something below -87. */
export function ln(x) {
  if (x === 1) return 0;
  if (x === Infinity) return x;
  if (x < 2 ** -126) return BELOW_ALL;
  const i = (bitsOf(x) + 0x004afb0d) >>> 0;
  const k = (i >>> 23) - 127;
  const g = f(f32Of((i & 0x007fffff) + 0x3f3504f3) - 1);
  const s = f(g / f(2 + g));
  const z = f(s * s);
  const w = f(z * z);
  const t1 = f(w * f(L0 + f(w * L1)));
  const t2 = f(z * f(L2 + f(w * L3)));
  const r = f(t2 + t1);
  const h = f(f(0.5 * g) * g);
  return f(f(f(f(f(s * f(h + r)) + f(k * LN2_REST)) - h) + g) + f(k * LN2_MOST));
}

/** The nearest half, ties to even, at most 65504 in magnitude. */
export function half(x) {
  const size = Math.abs(x);
  if (!(size > 0)) return x;
  const unit = 2 ** (Math.max((bitsOf(size) >>> 23) - 127, -14) - 10);
  const scaled = size / unit;
  const below = Math.floor(scaled);
  const rest = scaled - below;
  const rounded = rest > 0.5 || (rest === 0.5 && below % 2 === 1) ? below + 1 : below;
  const magnitude = Math.min(rounded * unit, 65504);
  return x < 0 ? -magnitude : magnitude;
}

/** The root that blending takes, of x from 0. */
export function sqrtAbove(x) {
  const y = f32Of((bitsOf(x) >>> 1) + 0x1fbd1df5);
  return f(0.5 * f(y + f(x / y)));
}
