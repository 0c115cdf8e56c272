// The entropy coder (FORMAT.md, section 9): a stream of symbols in 16-bit words.

import { need } from "./bytes.mjs";

const SLOTS = 4096;

export class Ans {
  constructor(bytes, place) {
    need(bytes.length % 2 === 0, `${place}: length`, bytes.length, "an even number");
    this.place = place;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
    this.state = 0;
    need(bytes.length === 0 || this.view.getUint16(0, true) !== 0, `${place}: first word`, 0, "another number");
    this.#refill();
    this.#refill();
  }

  #refill() {
    if (this.state < 65536 && this.at < this.view.byteLength) {
      this.state = this.state * 65536 + this.view.getUint16(this.at, true);
      this.at += 2;
    }
  }

  /** The slot that tells the next symbol. */
  get slot() {
    return this.state % SLOTS;
  }

  /** Goes on behind the symbol that owns the slots from `start` on. */
  advance(start, frequency) {
    this.state = ((this.state - (this.state % SLOTS)) / SLOTS) * frequency + (this.state % SLOTS) - start;
    this.#refill();
  }

  /** The entry of ascending `bounds` (the first 0, the last 4096) that owns the slot; `entries` has one for each slot. */
  entry(bounds, entries) {
    const i = entries[this.slot];
    this.advance(bounds[i], bounds[i + 1] - bounds[i]);
    return i;
  }

  raw() {
    const byte = Math.floor(this.slot / 16);
    this.advance(byte * 16, 16);
    return byte;
  }

  /** Two raw bytes, high then low, as an i16. */
  rawSymbol() {
    const high = this.raw();
    return ((high << 24) >> 16) | this.raw();
  }

  end() {
    const words = (this.view.byteLength - this.at) / 2;
    need(this.state === 0 && words === 0, `${this.place}: end of its stream`, `state ${this.state}, ${words} words left`, "state 0, 0 words left");
  }
}

/** For each slot the entry of `bounds` that owns it. */
export function slotEntries(bounds) {
  const entries = new Uint16Array(SLOTS);
  for (let i = 0; i + 1 < bounds.length; i++) entries.fill(i, bounds[i], bounds[i + 1]);
  return entries;
}
