// The module as JavaScript sees it. No dependency, no global state; works in pages, in workers and in Node.

const QUALITIES = {
  exact: { alphaCut: 1, transmittanceStop: 1, detail: true },
  balanced: { alphaCut: 2, transmittanceStop: 10, detail: true },
  draft: { alphaCut: 8, transmittanceStop: 100, detail: false },
};

/** A bundle, a plan for it, and its frames. */
export class Scene {
  #wasm;

  /** Compiles nothing itself: `module` is a `WebAssembly.Module`, or the bytes of one. `bundle` is the bytes of a .psb file. */
  static async open(module, bundle) {
    const compiled = module instanceof WebAssembly.Module ? module : await WebAssembly.compile(module);
    const instance = await WebAssembly.instantiate(compiled, {});
    return new Scene(instance.exports, new Uint8Array(bundle));
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
    const [, ...others] = this.#settings(settings);
    return this.#answer(this.#wasm.limits(...others));
  }

  /** What a decoder would do within these settings; throws where they cannot be kept. */
  plan(settings) {
    return planOf(this.#answer(this.#wasm.plan(...this.#settings(settings))));
  }

  /** Plans, and makes the decoder that the next frames are drawn by. */
  bind(settings) {
    return planOf(this.#answer(this.#wasm.bind(...this.#settings(settings))));
  }

  /** Draws a frame of at most the size that was bound. `pixels` are a copy: RGBA, row by row. */
  render(camera) {
    const { rotation, translation, focalPx, principalPx, widthPx, heightPx } = camera;
    this.#camera().set([...rotation, ...translation, ...focalPx, ...principalPx, widthPx, heightPx]);
    const report = this.#answer(this.#wasm.render());
    const { cortexM, riscv32, ...counts } = byStage(report);
    const pixels = new Uint8ClampedArray(this.#wasm.memory.buffer, this.#wasm.pixels(), 4 * widthPx * heightPx).slice();
    return { ...counts, instructions: { cortexM, riscv32 }, widthPx, heightPx, pixels };
  }

  #settings({ widthPx, heightPx, ramBytes = Infinity, tiers = 255, slabs = false, quality = 'exact' }) {
    const { alphaCut, transmittanceStop, detail } = typeof quality === 'string' ? QUALITIES[quality] : quality;
    return [ramBytes, widthPx, heightPx, tiers, slabs, alphaCut, transmittanceStop, detail];
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

function planOf({ isResident, isBaked, halfWeights, ...plan }) {
  return { ...plan, isResident: isResident === 1, isBaked: isBaked === 1, halfWeights: halfWeights === 1 };
}

/** Gathers `cortexMBlend` and its like as `cortexM.blend`. */
function byStage(report) {
  const targets = { cortexM: {}, riscv32: {} };
  const counts = {};
  for (const [name, number] of Object.entries(report)) {
    const target = Object.keys(targets).find((target) => name.startsWith(target));
    if (!target) counts[name] = number;
    else targets[target][name[target.length].toLowerCase() + name.slice(target.length + 1)] = number;
  }
  return { ...counts, ...targets };
}
