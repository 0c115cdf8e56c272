// How sharp a moving picture can be: for each view by what its own frames take.

/** The parts of its pixels on a side that a moving picture may get. */
const LEVELS = [1, 0.7, 0.5, 0.35, 0.25];
/** A level is taken for frames of this, given up for a coarser one above that, and for a sharper one that takes the last. */
const [WANTED_MS, SLOW_MS, FAST_MS] = [65, 90, 45];
/** The least weight of the newest frame in the mean, and how long a level is kept. */
const [NEWEST, KEPT_MS] = [0.15, 1000];

export class Sharpness {
  #level = 0;
  #since = 0;
  #wasMoving = false;
  /** Running mean, and the frames that it is of. */
  #msPerPx = 0;
  #frames = 0;

  /** Says how long a frame took. */
  took(milliseconds, pixels) {
    this.#frames++;
    this.#msPerPx += Math.max(NEWEST, 1 / this.#frames) * (milliseconds / pixels - this.#msPerPx);
  }

  /** The part of its `pixels` on a side that the next frame gets. At rest it gets all of them. */
  part(pixels, isMoving, now = performance.now()) {
    const begins = isMoving && !this.#wasMoving;
    this.#wasMoving = isMoving;
    if (!isMoving) return 1;
    if (!begins && now - this.#since < KEPT_MS) return LEVELS[this.#level];
    const cost = (level) => this.#msPerPx * pixels * LEVELS[level] ** 2;
    const within = (milliseconds) => {
      const level = LEVELS.findIndex((_, level) => cost(level) <= milliseconds);
      return level < 0 ? LEVELS.length - 1 : level;
    };
    let level = this.#level;
    if (begins) level = within(WANTED_MS);
    else if (cost(level) > SLOW_MS) level = Math.max(level, within(WANTED_MS));
    // Pixels of a small frame are dearer than those of a large one: what seems too slow may not be, but what seems fast is.
    else level = Math.min(level, within(FAST_MS));
    if (begins || level !== this.#level) this.#since = now;
    this.#level = level;
    return LEVELS[level];
  }
}
