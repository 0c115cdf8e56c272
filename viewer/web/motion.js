// What moves by itself, and how far: within what the cameras of the capture saw.

const TURN_MS = 24000;
const SWAY_MS = 7000;
/** Radians to either side: at most, and where nobody knows where the cameras stood. */
const [SWAY_ANGLE, SAFE_ANGLE] = [0.35, 0.07];
/** Swinging from side to side instead of turning goes no further than this. */
const SWING_ANGLE = Math.PI / 3;
/** Cameras that stand beyond the point that the scene turns around, by this much of its distance, stand all around it. */
const AROUND = 1.2;
/** Less than this is no move. */
const LEAST_ANGLE = 0.005;
/** After so long without a move a picture is at rest. */
const REST_MS = 250;

/** How far the camera may turn to the left and to the right of its first place, radians, and still be where cameras stood. */
function reach({ spread, home }, most) {
  if (!spread) return [SAFE_ANGLE, SAFE_ANGLE];
  // A turn by an angle moves it so far aside.
  const radius = home.distance * Math.cos(home.pitch);
  return spread.slice(0, 2).map((aside) => Math.min(most, Math.asin(Math.min(1, aside / radius))));
}

/** Whether the cameras stood on all sides; who does not know lets people look. */
const isAround = ({ spread, home }) => !spread || spread[2] > AROUND * home.distance;

export class Motion {
  /**
   * For each view, the `home` of its orbit and, where it is known, its `spread`: how far the cameras stood to the left of the first one, to
   * the right of it and ahead of it.
   */
  seen = [];
  #orbit;
  #changed;
  #moved = 0;
  #rest;
  #later;
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

  /** Draws now, and sharply once nothing has moved for a moment. */
  touch() {
    this.#moved = performance.now();
    clearTimeout(this.#rest);
    this.#rest = setTimeout(this.#changed, REST_MS + 50);
    this.#changed();
  }

  stop() {
    clearTimeout(this.#later);
    this.#run = undefined;
  }

  /** Turns the scene until told otherwise; swings where it has no back. */
  spin() {
    this.stop();
    if (this.seen.every(isAround)) this.#animate((milliseconds) => (milliseconds * 2 * Math.PI) / TURN_MS);
    else this.#swing(SWING_ANGLE, TURN_MS / 2, Infinity);
  }

  /** Sways once from side to side after a while, so that a picture is seen sharply first and then to be a scene. */
  swayAfter(milliseconds) {
    this.stop();
    this.#later = setTimeout(() => this.#swing(SWAY_ANGLE, SWAY_MS, SWAY_MS), milliseconds);
  }

  #swing(most, period, duration) {
    const reaches = this.seen.map((view) => reach(view, most));
    const [left, right] = [0, 1].map((side) => Math.min(...reaches.map((angles) => angles[side])));
    const [middle, half] = [(right - left) / 2, (right + left) / 2];
    if (!(half > LEAST_ANGLE)) return;
    // From where it is now.
    const part = (this.#orbit.yaw - this.#orbit.home.yaw - middle) / half;
    const begin = Math.asin(Math.min(1, Math.max(-1, part)));
    this.#animate((milliseconds) => middle + half * Math.sin(begin + (2 * Math.PI * milliseconds) / period), duration);
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
