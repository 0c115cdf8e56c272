// The module as JavaScript sees it. No dependency, no global state; works in pages, in workers and in Node.
import { list, positive, real, refuse, whole } from './check.js';

/** The decoder's own limits. */
const MAX_FRAME_PX = 4080;
const MAX_ALPHA_CUT = 64;
const MAX_TIERS = 255;
/** Beyond this the decoder's sine and cosine are not exact. */
const MAX_ANGLE = 8192;
const QUALITIES = {
  exact: { alphaCut: 1, detail: true },
  balanced: { alphaCut: 2, detail: true },
  draft: { alphaCut: 8, detail: false },
};

/** A bundle, a plan for it, and its frames. */
export class Scene {
  #wasm;
  /** The settings of the decoder that there is. */
  #bound;

  /** Compiles nothing itself: `module` is a `WebAssembly.Module`, or the bytes of one. `bundle` is the bytes of a .psb file. */
  static async open(module, bundle) {
    const compiled = module instanceof WebAssembly.Module ? module : await WebAssembly.compile(module);
    const instance = await WebAssembly.instantiate(compiled, {});
    return new Scene(instance.exports, bytesOf(bundle));
  }

  /** Use `Scene.open`. */
  constructor(wasm, bundle) {
    this.#wasm = wasm;
    // The address first: taking memory moves the buffer.
    const address = wasm.input(bundle.length);
    new Uint8Array(wasm.memory.buffer, address, bundle.length).set(bundle);
    this.bundle = this.#answer(wasm.open());
    this.bundle.bytes = bundle.length;
    this.bundle.usesContext = this.bundle.usesContext === 1;
    this.tiers = [];
    for (let n = 1; n <= this.bundle.nTiers; n++) this.tiers.push(this.#answer(wasm.tier(n)));
    this.#answer(wasm.preview());
    this.preview = this.#cameraSet();
  }

  /** The bundle's camera carried around the scene by `angle`, radians: the same numbers as a device computes. */
  orbited(angle) {
    if (!(Math.abs(real('angle', angle)) <= MAX_ANGLE)) refuse('angle', angle, `radians, at most ${MAX_ANGLE} in size`);
    this.#answer(this.#wasm.orbit(angle));
    return this.#cameraSet();
  }

  #cameraSet() {
    const [width, height] = this.#camera().subarray(16);
    const numbers = Array.from(this.#camera());
    return {
      rotation: numbers.slice(0, 9),
      translation: numbers.slice(9, 12),
      focalPx: numbers.slice(12, 14),
      principalPx: numbers.slice(14, 16),
      widthPx: width,
      heightPx: height,
    };
  }

  /** How far from the preview what it shows in its middle is: the median depth of the anchors there. Decodes up to 16,384 anchors. */
  focus() {
    return this.#answer(this.#wasm.focus()).distance;
  }

  /** The least memory that draws anything, and the most that is of use. */
  limits(settings) {
    const [, ...others] = settingsOf(settings);
    return this.#answer(this.#wasm.limits(...others));
  }

  /** What a decoder would do within these settings; throws where they cannot be kept. */
  plan(settings) {
    return planOf(this.#answer(this.#wasm.plan(...settingsOf(settings))));
  }

  /** Plans, and makes the decoder that the next frames are drawn by. */
  bind(settings) {
    const checked = settingsOf(settings);
    // The one before has gone, even where there is no room for this one.
    this.#bound = undefined;
    const plan = planOf(this.#answer(this.#wasm.bind(...checked)));
    this.#bound = { widthPx: settings.widthPx, heightPx: settings.heightPx };
    return plan;
  }

  /** Draws a frame of at most the size that was bound. `pixels` are a copy: RGBA, row by row. */
  render(camera) {
    if (!this.#bound) throw new Error('no decoder is bound; call bind({ widthPx, heightPx }) before render');
    this.#camera().set(numbersOf(camera, this.#bound));
    const { widthPx, heightPx } = camera;
    const report = byStage(this.#answer(this.#wasm.render()));
    const pixels = new Uint8ClampedArray(this.#wasm.memory.buffer, this.#wasm.pixels(), 4 * widthPx * heightPx).slice();
    return { ...report, widthPx, heightPx, pixels };
  }

  #camera() {
    return new Float32Array(this.#wasm.memory.buffer, this.#wasm.camera(), 18);
  }

  /** The figures of the last call by name; throws its message where it failed. */
  #answer(succeeded) {
    const wasm = this.#wasm;
    const text = new TextDecoder().decode(new Uint8Array(wasm.memory.buffer, wasm.text(), wasm.text_len()));
    if (succeeded !== 1) throw new Error(text);
    if (text === '') return {};
    const names = text.split(',');
    const numbers = new Float64Array(wasm.memory.buffer, wasm.numbers(), names.length);
    return Object.fromEntries(names.map((name, i) => [name, numbers[i]]));
  }
}

/** The bytes of a file; a number or a text would become bytes too, but others. */
function bytesOf(file) {
  if (ArrayBuffer.isView(file)) return new Uint8Array(file.buffer, file.byteOffset, file.byteLength);
  // Of whatever page or context it comes from.
  if (/ (Shared)?ArrayBuffer]$/.test(Object.prototype.toString.call(file))) return new Uint8Array(file);
  return refuse('bundle', file, 'the bytes of a .psb file, as an ArrayBuffer or a Uint8Array');
}

/** The arguments of `plan` and `bind`. */
function settingsOf(settings) {
  const { widthPx, heightPx, ramBytes = Infinity, tiers = MAX_TIERS, slabs = false, quality = 'exact' } = settings ?? {};
  whole('widthPx', widthPx, 1, MAX_FRAME_PX);
  whole('heightPx', heightPx, 1, MAX_FRAME_PX);
  if (ramBytes !== Infinity) whole('ramBytes (Infinity for no limit)', ramBytes, 0, Number.MAX_SAFE_INTEGER);
  whole('tiers', tiers, 1, MAX_TIERS);
  if (typeof slabs !== 'boolean') refuse('slabs', slabs, 'true or false');
  const { alphaCut, detail } = qualityOf(quality);
  return [ramBytes, widthPx, heightPx, tiers, slabs, alphaCut, detail];
}

function qualityOf(quality) {
  if (typeof quality === 'string' && Object.hasOwn(QUALITIES, quality)) return QUALITIES[quality];
  const names = Object.keys(QUALITIES).map((name) => `"${name}"`);
  if (typeof quality !== 'object' || !quality) refuse('quality', quality, `${names.join(', ')} or { alphaCut, detail }`);
  whole('quality.alphaCut', quality.alphaCut, 1, MAX_ALPHA_CUT);
  if (typeof quality.detail !== 'boolean') refuse('quality.detail', quality.detail, 'true or false');
  return quality;
}

/** A camera as the module takes it, for frames of at most the size that is bound. */
function numbersOf(camera, bound) {
  const { rotation, translation, focalPx, principalPx, widthPx, heightPx } = camera ?? {};
  list('rotation', rotation, 9, real);
  list('translation', translation, 3, real);
  list('focalPx', focalPx, 2, positive);
  list('principalPx', principalPx, 2, real);
  whole('widthPx', widthPx, 1, bound.widthPx);
  whole('heightPx', heightPx, 1, bound.heightPx);
  return [...rotation, ...translation, ...focalPx, ...principalPx, widthPx, heightPx];
}

function planOf({ isResident, keepsSums, isBaked, halfWeights, ...plan }) {
  const flags = { isResident, keepsSums, isBaked, halfWeights };
  return { ...plan, ...Object.fromEntries(Object.entries(flags).map(([name, flag]) => [name, flag === 1])) };
}

/** Gathers `cortexM.blend` and its like in `instructions`. */
function byStage(report) {
  const instructions = {};
  const counts = {};
  for (const [name, number] of Object.entries(report)) {
    const [target, stage] = name.split('.');
    if (stage === undefined) counts[name] = number;
    else (instructions[target] ??= {})[stage] = number;
  }
  return { ...counts, instructions };
}
