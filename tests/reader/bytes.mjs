// Reading of little-endian numbers, and the refusal that names what was wrong.

/** A file is not what the format says: where, the number found, the number needed. */
export class Refusal extends Error {
  constructor(place, found, needed) {
    super(`${place} is ${found}, needed: ${needed}`);
    this.name = "Refusal";
  }
}

/** Throws a Refusal unless the condition holds. */
export function need(condition, place, found, needed) {
  if (!condition) throw new Refusal(place, found, needed);
}

const crcTable = Uint32Array.from({ length: 256 }, (_, byte) => {
  for (let bit = 0; bit < 8; bit++) byte = byte & 1 ? (byte >>> 1) ^ 0xedb88320 : byte >>> 1;
  return byte;
});

/** CRC-32 as in PNG and zip. */
export function crc32(bytes) {
  let crc = 0xffffffff;
  for (let i = 0; i < bytes.length; i++) crc = (crc >>> 8) ^ crcTable[(crc ^ bytes[i]) & 255];
  return ~crc >>> 0;
}

export const hex = (number) => `0x${number.toString(16)}`;

/** The f32 that a half stands for. */
export function f16(bits) {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return exponent === 0 ? sign * fraction * 2 ** -24 : sign * (1024 + fraction) * 2 ** (exponent - 25);
}

/** Numbers one after another from a range of bytes. */
export class Cursor {
  constructor(bytes, place) {
    this.place = place;
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }

  get left() {
    return this.bytes.length - this.at;
  }

  /** The position before a field of `length` bytes, which must be there. */
  #skip(length, what) {
    need(length <= this.left, `${this.place}: bytes left for ${what}`, this.left, `${length}`);
    this.at += length;
    return this.at - length;
  }

  u8 = (what) => this.view.getUint8(this.#skip(1, what));
  u16 = (what) => this.view.getUint16(this.#skip(2, what), true);
  u32 = (what) => this.view.getUint32(this.#skip(4, what), true);
  i16 = (what) => this.view.getInt16(this.#skip(2, what), true);
  i32 = (what) => this.view.getInt32(this.#skip(4, what), true);
  f32 = (what) => this.view.getFloat32(this.#skip(4, what), true);
  f64 = (what) => this.view.getFloat64(this.#skip(8, what), true);
  take = (length, what) => this.bytes.subarray(this.#skip(length, what), this.at);

  /** An array of `length` numbers, each read by `read` and held to `rule` (a test and its words). */
  array(Type, length, size, read, what, rule) {
    need(length * size <= this.left, `${this.place}: bytes left for ${what}`, this.left, `${length * size}`);
    const numbers = new Type(length);
    for (let i = 0; i < length; i++) {
      numbers[i] = read(what);
      if (rule) need(rule[0](numbers[i]), `${this.place}: ${what}[${i}]`, numbers[i], rule[1]);
    }
    return numbers;
  }
  u8s = (length, what, rule) => this.array(Uint8Array, length, 1, this.u8, what, rule);
  i8s = (length, what) => this.array(Int8Array, length, 1, (name) => (this.u8(name) << 24) >> 24, what);
  u16s = (length, what, rule) => this.array(Uint16Array, length, 2, this.u16, what, rule);
  u32s = (length, what, rule) => this.array(Uint32Array, length, 4, this.u32, what, rule);
  i32s = (length, what, rule) => this.array(Int32Array, length, 4, this.i32, what, rule);
  f32s = (length, what, rule) => this.array(Float32Array, length, 4, this.f32, what, rule);
  f64s = (length, what, rule) => this.array(Float64Array, length, 8, this.f64, what, rule);
  f16s = (length, what, rule) => this.array(Float32Array, length, 2, (name) => f16(this.u16(name)), what, rule);

  /** Reserved bytes. */
  zeros(length, what) {
    const found = this.take(length, what).find((byte) => byte !== 0);
    need(found === undefined, `${this.place}: ${what}`, found, "0");
  }

  end() {
    need(this.left === 0, `${this.place}: bytes behind its last field`, this.left, "0");
  }
}

/** Holds a number to a range, both ends included. */
export function within(place, found, low, high) {
  need(found >= low && found <= high, place, found, low === high ? `${low}` : `${low} to ${high}`);
  return found;
}

export const FINITE = [Number.isFinite, "a finite number"];
export const fround = Math.fround;
