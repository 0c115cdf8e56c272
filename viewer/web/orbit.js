// A camera that turns around a point, and what hands do to it.
import { list, positive, real, refuse, whole } from './check.js';

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, factor) => a.map((x) => x * factor);
const sum = (...vectors) => [0, 1, 2].map((i) => vectors.reduce((total, vector) => total + vector[i], 0));
const clamp = (x, least, most) => Math.min(most, Math.max(least, x));

/** No camera stands this far out, nor turns this far. */
const MOST_NUMBER = 1e5;
/** Never straight above or below, where up has no direction. */
const MOST_PITCH = (88 * Math.PI) / 180;

/** A camera with the lens of `preview`, around a point of its line of sight: at a distance, else the nearest to the origin. */
export class Orbit {
  constructor(preview, distance) {
    this.#begin(preview, distance);
    /** By so many quarters the picture was turned. */
    this.quarters = 0;
  }

  /** Turns the picture by a quarter, clockwise, and begins anew: for scenes whose photographs lie on their side. */
  quarter() {
    this.#begin(rolled(this.preview), this.home.distance);
    this.quarters = (this.quarters + 1) % 4;
  }

  #begin(preview, given) {
    this.preview = preview;
    const r = preview.rotation;
    const [right, down, forward] = [r.slice(0, 3), r.slice(3, 6), r.slice(6, 9)];
    const eye = centreOf(preview);
    // The coordinate axis nearest to the preview's up, as the device's orbit takes it.
    const sizes = down.map(Math.abs);
    const axis = sizes.indexOf(Math.max(...sizes));
    const unit = (i, sign = 1) => [0, 1, 2].map((j) => (i === j ? sign : 0));
    this.up = unit(axis, down[axis] > 0 ? -1 : 1);
    this.ahead = unit((axis + 1) % 3);
    this.aside = cross(this.up, this.ahead);
    const along = -dot(eye, forward);
    const distance = given > 0 ? given : along > 0.2 ? along : 3;
    const yaw = Math.atan2(dot(forward, this.aside), dot(forward, this.ahead));
    const pitch = Math.asin(clamp(-dot(forward, this.up), -1, 1));
    this.home = { yaw, pitch, distance, target: sum(eye, scaled(forward, distance)) };
    this.roll = 0;
    this.reset();
    const level = this.axes();
    this.roll = Math.atan2(dot(right, level.down), dot(right, level.right));
  }

  reset() {
    Object.assign(this, this.home, { target: [...this.home.target] });
  }

  /** Turns around the point at another distance from now on; the picture stays as it is. */
  refocus(distance) {
    if (!(distance > 0)) return;
    const further = distance - this.home.distance;
    for (const pose of [this.home, this]) {
      pose.target = sum(pose.target, scaled(this.axes(pose).forward, further));
      pose.distance += further;
    }
  }

  /** Where it stands, as text that an address can hold: yaw, pitch, distance, the point it turns around, and quarters where there are some. */
  get place() {
    const { yaw, pitch, distance, target, quarters } = this;
    const numbers = [yaw, pitch, distance, ...target].map((number) => Number(number.toPrecision(5)));
    return (quarters ? [...numbers, quarters] : numbers).join(',');
  }

  /** Goes to a place; what is none moves nothing. */
  set place(text) {
    const numbers = String(text).split(',').map((number) => (number.trim() === '' ? NaN : Number(number)));
    const [yaw, pitch, distance, x, y, z, quarters = 0] = numbers;
    const isPlace = (numbers.length === 6 || numbers.length === 7) && numbers.every((number) => Math.abs(number) < MOST_NUMBER);
    if (!isPlace || distance <= 0 || ![0, 1, 2, 3].includes(quarters)) {
      refuse('place', text, 'six numbers between commas: yaw, pitch, distance and a point, as `orbit.place` gives them');
    }
    while (this.quarters !== quarters) this.quarter();
    Object.assign(this, { yaw, pitch: clamp(pitch, -MOST_PITCH, MOST_PITCH), distance, target: [x, y, z] });
  }

  /** Directions of the camera: right, down and forward in the picture. */
  axes({ yaw, pitch } = this) {
    const { roll, ahead, aside, up } = this;
    const level = sum(scaled(ahead, Math.cos(yaw)), scaled(aside, Math.sin(yaw)));
    const forward = sum(scaled(level, Math.cos(pitch)), scaled(up, -Math.sin(pitch)));
    const right0 = cross(level, up);
    const down0 = cross(forward, right0);
    const right = sum(scaled(right0, Math.cos(roll)), scaled(down0, Math.sin(roll)));
    return { right, down: cross(forward, right), forward };
  }

  /** Turns by angles, radians. */
  turn(yaw, pitch) {
    real('yaw', yaw);
    real('pitch', pitch);
    this.yaw -= yaw;
    this.pitch = clamp(this.pitch + pitch, -MOST_PITCH, MOST_PITCH);
  }

  /** Moves the picture by parts of its shorter side. */
  pan(x, y) {
    real('x', x);
    real('y', y);
    const { right, down } = this.axes();
    const { focalPx, widthPx, heightPx } = this.preview;
    const reach = (this.distance * Math.min(widthPx, heightPx)) / focalPx[0];
    this.target = sum(this.target, scaled(right, -x * reach), scaled(down, -y * reach));
  }

  /** Goes nearer by a factor above 1. */
  zoom(factor) {
    positive('factor', factor);
    this.distance = clamp(this.distance / factor, this.home.distance / 20, this.home.distance * 4);
  }

  /** Stands as another orbit does, each by its own first view and distance. */
  follow(other) {
    const scale = this.home.distance / other.home.distance;
    this.yaw = this.home.yaw + other.yaw - other.home.yaw;
    this.pitch = clamp(this.home.pitch + other.pitch - other.home.pitch, -MOST_PITCH, MOST_PITCH);
    this.distance = other.distance * scale;
    const moved = sum(other.target, scaled(other.home.target, -1));
    const [from, to] = [other.axes(other.home), this.axes(this.home)];
    const parts = ['right', 'down', 'forward'].map((axis) => scaled(to[axis], dot(moved, from[axis]) * scale));
    this.target = sum(this.home.target, ...parts);
  }

  /** The camera of a frame of a size, which shows at least what the preview shows. */
  camera(widthPx, heightPx) {
    const { right, down, forward } = this.axes();
    const eye = sum(this.target, scaled(forward, -this.distance));
    const pose = { rotation: [...right, ...down, ...forward], translation: [right, down, forward].map((row) => -dot(row, eye)) };
    return { ...pose, ...lensOf(this.preview, widthPx, heightPx) };
  }
}

/** The camera after its picture was turned by a quarter, clockwise: what was left is up. */
function rolled({ rotation, translation: [x, y, z], focalPx: [fx, fy], principalPx: [cx, cy], widthPx, heightPx }) {
  const [right, down, forward] = [rotation.slice(0, 3), rotation.slice(3, 6), rotation.slice(6, 9)];
  return {
    rotation: [...scaled(down, -1), ...right, ...forward],
    translation: [-y, x, z],
    focalPx: [fy, fx],
    principalPx: [heightPx - cy, cx],
    widthPx: heightPx,
    heightPx: widthPx,
  };
}

/** The lens of a camera for frames of another size: nothing of its picture is cut, and nothing is stretched. */
export function lensOf({ focalPx, principalPx, widthPx, heightPx }, width, height) {
  list('focalPx', focalPx, 2, positive);
  list('principalPx', principalPx, 2, real);
  for (const [name, px] of Object.entries({ widthPx, heightPx, width, height })) whole(name, px, 1, 65535);
  const scale = Math.min(width / widthPx, height / heightPx);
  const centre = [width / 2 + (principalPx[0] - widthPx / 2) * scale, height / 2 + (principalPx[1] - heightPx / 2) * scale];
  return { focalPx: focalPx.map((focal) => focal * scale), principalPx: centre, widthPx: width, heightPx: height };
}

/** Where a camera stands. */
export function centreOf({ rotation: r, translation: t }) {
  return [0, 1, 2].map((i) => -(r[i] * t[0] + r[3 + i] * t[1] + r[6 + i] * t[2]));
}

/** The same camera in the frame of another bundle; `from` and `to` are the bundles' normalisations. */
export function carried(camera, from, to) {
  const eye = centreOf(camera);
  const centre = [0, 1, 2].map((i) => (eye[i] / from.scale + from.centre[i] - to.centre[i]) * to.scale);
  const row = (i) => camera.rotation.slice(3 * i, 3 * i + 3);
  return { ...camera, translation: [0, 1, 2].map((i) => -dot(row(i), centre)) };
}

/**
 * Lets mouse, touch and keyboard move an orbit. `changed` is called after each move; `quarter` is what the key R does.
 * One finger or the left button turns; two fingers, another button or Shift pan; pinch and wheel zoom.
 */
export function handle(element, orbit, changed, quarter = () => orbit.quarter()) {
  const pointers = new Map();
  const side = () => Math.min(element.clientWidth, element.clientHeight);
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
  };
  element.addEventListener('pointerdown', (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button > 0 || event.shiftKey });
  });
  element.addEventListener('pointermove', (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const before = pointers.size === 2 ? spread() : pointer;
    const [x, y, apart] = [before.x, before.y, before.apart];
    Object.assign(pointer, { x: event.clientX, y: event.clientY });
    const after = pointers.size === 2 ? spread() : pointer;
    const [right, down] = [(after.x - x) / side(), (after.y - y) / side()];
    if (pointers.size === 2) {
      orbit.pan(right, down);
      if (apart > 0 && after.apart > 0) orbit.zoom(after.apart / apart);
    } else if (pointers.size > 2) {
      return;
    } else if (pointer.pans) {
      orbit.pan(right, down);
    } else {
      orbit.turn(right * Math.PI, down * Math.PI);
    }
    changed();
  });
  for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    element.addEventListener(end, (event) => pointers.delete(event.pointerId));
  }
  element.addEventListener('contextmenu', (event) => event.preventDefault());
  element.addEventListener(
    'wheel',
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 0 ? event.deltaY : event.deltaY * 30;
      orbit.zoom(Math.exp(-lines * (event.ctrlKey ? 0.01 : 0.0015)));
      changed();
    },
    { passive: false },
  );
  element.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = event.shiftKey ? (x, y) => orbit.pan(x / 2, y / 2) : (x, y) => orbit.turn(x, y);
    const moves = {
      ArrowLeft: () => step(0.1, 0),
      ArrowRight: () => step(-0.1, 0),
      ArrowUp: () => step(0, 0.1),
      ArrowDown: () => step(0, -0.1),
      '+': () => orbit.zoom(1.1),
      '=': () => orbit.zoom(1.1),
      '-': () => orbit.zoom(1 / 1.1),
      _: () => orbit.zoom(1 / 1.1),
      0: () => orbit.reset(),
      r: quarter,
      R: quarter,
      Home: () => orbit.reset(),
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    move();
    changed();
  });
}
