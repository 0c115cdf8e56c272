// What moves by itself, and how sharp a moving picture can be.

/** Above this a moving picture gets fewer pixels, below that more again. */
const [SLOW_MS, FAST_MS] = [70, 30];
const SHARPNESS = [1, 0.7, 0.5, 0.35, 0.25];
const TURN_MS = 24000;
const SWAY_MS = 7000;
const SWAY_ANGLE = 0.35;
/** After so long without a move a picture is at rest. */
const REST_MS = 250;

export class Motion {
  #orbit;
  #changed;
  #level = 0;
  #moved = 0;
  #rest;
  /** What moves now, if anything does. */
  #run;

  /** `changed` is called when there is something new to draw. */
  constructor(orbit, changed) {
    this.#orbit = orbit;
    this.#changed = changed;
  }

  get isMoving() {
    return this.#run !== undefined || performance.now() - this.#moved < REST_MS;
  }

  /** The part of its pixels on a side that a picture gets now. */
  get sharpness() {
    return this.isMoving ? SHARPNESS[this.#level] : 1;
  }

  /** Says how long a frame took. */
  took(milliseconds) {
    if (milliseconds > SLOW_MS) this.#level = Math.min(this.#level + 1, SHARPNESS.length - 1);
    else if (milliseconds < FAST_MS) this.#level = Math.max(this.#level - 1, 0);
  }

  /** Draws now, and sharply once nothing has moved for a moment. */
  touch() {
    this.#moved = performance.now();
    clearTimeout(this.#rest);
    this.#rest = setTimeout(this.#changed, REST_MS + 50);
    this.#changed();
  }

  stop() {
    this.#run = undefined;
  }

  /** Turns the scene until told otherwise. */
  spin() {
    this.#animate((milliseconds) => (milliseconds * 2 * Math.PI) / TURN_MS);
  }

  /** Sways once from side to side, so that a picture is seen to be a scene; no further, for not every scene has a back. */
  sway() {
    this.#animate((milliseconds) => SWAY_ANGLE * Math.sin((2 * Math.PI * milliseconds) / SWAY_MS), SWAY_MS);
  }

  /** Turns the scene to the angle of each moment, for so long. */
  #animate(angleAt, duration = Infinity) {
    const run = {};
    this.#run = run;
    let [before, passed] = [performance.now(), 0];
    const step = (now) => {
      if (this.#run !== run) return;
      // A frame that took long is a slow moment, not a leap.
      const after = Math.min(passed + Math.min(Math.max(now - before, 0), 200), duration);
      this.#orbit.turn(angleAt(passed) - angleAt(after), 0);
      [before, passed] = [now, after];
      if (passed >= duration) this.stop();
      this.touch();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
