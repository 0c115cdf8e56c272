// One bundle on the page: its worker, its canvas, and what it was last asked for.

/** A worker that draws one bundle, as promises. */
export class Drawer {
  #worker;
  #waiting = new Map();
  #count = 0;

  constructor(source) {
    const address = URL.createObjectURL(new Blob([source], { type: 'text/javascript' }));
    this.#worker = new Worker(address);
    URL.revokeObjectURL(address);
    this.#worker.onmessage = ({ data: { id, answer, error } }) => {
      const { resolve, reject } = this.#waiting.get(id);
      this.#waiting.delete(id);
      if (error === undefined) resolve(answer);
      else reject(new Error(error));
    };
    this.#worker.onerror = (event) => {
      this.#waiting.forEach(({ reject }) => reject(new Error(event.message || 'the worker failed')));
      this.#waiting.clear();
    };
  }

  ask(question, argument = {}) {
    const id = this.#count++;
    this.#worker.postMessage({ id, question, ...argument });
    return new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
  }
}

/** A bundle in its place on the page. It draws the latest of what it is asked for and skips what came between. */
export class View {
  #drawer;
  #settings = '';
  #busy = false;
  #begun;

  constructor(name, place, drawer) {
    this.name = name;
    this.#drawer = drawer;
    /** Resolves when it has shown a picture, or why it cannot. */
    this.first = new Promise((resolve) => (this.#begun = resolve));
    this.figure = place.appendChild(document.createElement('figure'));
    this.canvas = this.figure.appendChild(document.createElement('canvas'));
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', name);
    this.caption = this.figure.appendChild(document.createElement('figcaption'));
    this.caption.textContent = `${name}: reading`;
    this.context = this.canvas.getContext('2d', { alpha: false });
  }

  async open(module, bundle) {
    Object.assign(this, await this.#drawer.ask('open', { module, bundle }));
    const { centreX, centreY, centreZ, scale, backgroundRed, backgroundGreen, backgroundBlue } = this.bundle;
    this.normalisation = { centre: [centreX, centreY, centreZ], scale };
    this.figure.style.setProperty('--behind', `rgb(${backgroundRed} ${backgroundGreen} ${backgroundBlue})`);
  }

  /** Plans within `settings` unless they are the last ones, then draws. Resolves when the canvas shows the frame. */
  async show(settings, camera) {
    const wanted = JSON.stringify({ ...settings, ramBytes: String(settings.ramBytes) });
    if (wanted !== this.#settings) {
      this.#settings = wanted;
      const { limits, plan, refused } = await this.#drawer.ask('bind', { settings });
      Object.assign(this, { limits, plan, refused });
    }
    if (this.refused) return undefined;
    this.frame = await this.#drawer.ask('render', { camera });
    const { pixels, widthPx, heightPx } = this.frame;
    if (this.canvas.width !== widthPx) this.canvas.width = widthPx;
    if (this.canvas.height !== heightPx) this.canvas.height = heightPx;
    this.context.putImageData(new ImageData(pixels, widthPx, heightPx), 0, 0);
    return this.frame;
  }

  /** The bundle's camera carried around the scene. */
  async orbited(angle) {
    return (await this.#drawer.ask('orbited', { angle })).camera;
  }

  /** Shows what `next` says until that does not change any more; `shown` is called after each frame. */
  async follow(next, shown) {
    if (this.#busy) return;
    this.#busy = true;
    let last;
    try {
      for (let wanted = next(this); wanted.key !== last; wanted = next(this)) {
        last = wanted.key;
        await this.show(wanted.settings, wanted.camera);
        shown(this);
        this.#begun();
        // The page's turn: a frame of its own between two of ours.
        await new Promise((resolve) => requestAnimationFrame(resolve));
      }
    } catch (error) {
      this.refused = error.message;
      shown(this);
      this.#begun();
    }
    this.#busy = false;
  }
}
