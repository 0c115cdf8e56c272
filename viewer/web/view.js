// One bundle on the page: its workers, its canvas, and what it was last asked for.

/** Frames that take less wait for the screen, which shows no more of them. */
const QUICK_MS = 14;

/** A worker that draws one bundle, as promises. */
class Drawer {
  /** The settings it is bound to, and what it answered. */
  settings = '';
  answer = {};
  isBusy = false;
  #worker;
  #waiting = new Map();
  #count = 0;

  constructor(worker) {
    this.#worker = worker;
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

  close() {
    this.#worker.terminate();
  }

  /** Plans within `settings` unless they are the last ones; then draws, unless the plan was refused. */
  async draw(settings, camera) {
    const wanted = JSON.stringify({ ...settings, ramBytes: String(settings.ramBytes) });
    if (wanted !== this.settings) {
      // Bound to none until it has answered: a refusal is asked for again.
      this.settings = '';
      const { limits, plan, refused } = await this.ask('bind', { settings });
      this.answer = { limits, plan, refused };
      this.settings = wanted;
    }
    return this.answer.refused ? this.answer : { ...this.answer, frame: await this.ask('render', { camera }) };
  }
}

/** A bundle in its place on the page. It draws the latest of what it is asked for and skips what came between. */
export class View {
  #drawers = [];
  /** Those that read the bundle. */
  #opening = new Set();
  /** What was asked for last. */
  #asked;
  /** Frames asked for, and the number of the one on the canvas. */
  #count = 0;
  #shown = 0;
  #begun;
  /** Frames that were on the canvas. */
  nShown = 0;

  constructor(name, place) {
    this.name = name;
    /** Resolves when it has shown a picture, or why it cannot. */
    this.first = new Promise((resolve) => (this.#begun = resolve));
    this.figure = place.appendChild(document.createElement('figure'));
    this.canvas = this.figure.appendChild(document.createElement('canvas'));
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', name);
    // It is black before anything is drawn.
    this.canvas.style.visibility = 'hidden';
    this.caption = this.figure.appendChild(document.createElement('figcaption'));
    this.caption.textContent = `${name}: reading`;
    this.context = this.canvas.getContext('2d', { alpha: false });
  }

  /** Adds a worker; with two of them, one draws the next frame while the other finishes this one. */
  async open(worker, module, bundle) {
    const drawer = new Drawer(worker);
    this.#opening.add(drawer);
    try {
      Object.assign(this, await drawer.ask('open', { module, bundle }));
    } catch (error) {
      drawer.close();
      throw error;
    } finally {
      this.#opening.delete(drawer);
    }
    const { centreX, centreY, centreZ, scale, backgroundRed, backgroundGreen, backgroundBlue } = this.bundle;
    this.normalisation = { centre: [centreX, centreY, centreZ], scale };
    this.figure.style.setProperty('--behind', `rgb(${backgroundRed} ${backgroundGreen} ${backgroundBlue})`);
    this.#drawers.push(drawer);
  }

  /** Ends its workers. */
  close() {
    for (const drawer of [...this.#drawers, ...this.#opening]) drawer.close();
    this.#drawers = [];
  }

  /** The size of a frame that fills a place of a page, as far as the scene has detail for it. */
  sizeFor({ clientWidth, clientHeight }) {
    const { widthPx, heightPx } = this.bundle;
    const longest = Math.max(clientWidth, clientHeight, 1);
    const most = Math.min(1024, Math.max(256, 2 * Math.max(widthPx, heightPx)), longest * devicePixelRatio);
    return [clientWidth, clientHeight].map((side) => Math.max(16, Math.round((side * most) / longest)));
  }

  /** Whether it is drawing. */
  get isBusy() {
    return this.#drawers.some((drawer) => drawer.isBusy);
  }

  /** The bundle's camera carried around the scene. */
  async orbited(angle) {
    return (await this.#drawers[0].ask('orbited', { angle })).camera;
  }

  /** How far from the preview what it shows is. */
  async focus() {
    return (await this.#drawers[0].ask('focus')).distance;
  }

  /** Draws what a script asks for. Resolves when the canvas shows it. */
  async show(settings, camera) {
    this.#asked = undefined;
    await this.#draw(this.#drawers[0], settings, camera);
    return this.frame;
  }

  /** Shows what `next` says until that does not change any more; `shown` is called after each frame. */
  follow(next, shown) {
    for (const drawer of this.#drawers) if (!drawer.isBusy) this.#run(drawer, next, shown);
  }

  async #run(drawer, next, shown) {
    drawer.isBusy = true;
    try {
      for (let wanted = next(this); wanted.key !== this.#asked; wanted = next(this)) {
        this.#asked = wanted.key;
        const isNew = await this.#draw(drawer, wanted.settings, wanted.camera);
        if (isNew) shown(this);
        this.#begun();
        // The page's turn: a frame of its own between two of ours.
        if (this.frame?.milliseconds < QUICK_MS) await new Promise((resolve) => requestAnimationFrame(resolve));
      }
    } catch (error) {
      this.refused = error.message;
      shown(this);
      this.#begun();
    }
    drawer.isBusy = false;
  }

  /** Draws, and shows it unless a later frame was faster. */
  async #draw(drawer, settings, camera) {
    const number = ++this.#count;
    const answer = await drawer.draw(settings, camera);
    if (number < this.#shown) return false;
    this.#shown = number;
    const { limits, plan, refused, frame = this.frame } = answer;
    Object.assign(this, { limits, plan, refused, frame });
    if (refused) return true;
    const { pixels, widthPx, heightPx } = frame;
    if (this.canvas.width !== widthPx) this.canvas.width = widthPx;
    if (this.canvas.height !== heightPx) this.canvas.height = heightPx;
    this.context.putImageData(new ImageData(pixels, widthPx, heightPx), 0, 0);
    this.canvas.style.visibility = '';
    this.nShown++;
    return true;
  }
}
