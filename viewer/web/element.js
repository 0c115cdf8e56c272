// A scene as an element of a page: <pocketsplat-view src="scene.psb"></pocketsplat-view>.
import { Motion } from './motion.js';
import { Orbit, handle } from './orbit.js';
import { Sharpness } from './sharpness.js';
import { View } from './view.js';

const STYLE = `
  :host { display: block; position: relative; aspect-ratio: 4 / 3; overflow: hidden; }
  :host([hidden]) { display: none; }
  figure { margin: 0; width: 100%; height: 100%; background: var(--behind, #000); touch-action: none; cursor: grab; }
  figure:focus-visible { outline: 3px solid Highlight; outline-offset: -3px; }
  canvas { display: block; width: 100%; height: 100%; }
  figcaption { display: none; }
  p { position: absolute; inset: 0; margin: auto; height: fit-content; padding: 1em; text-align: center; font: 1em system-ui; color: #fff; background: #000b; pointer-events: none; }
`;

/** The decoder, compiled once for all elements of a page. */
let compiled;

function decoder() {
  const address = new URL('./pocketsplat.wasm', import.meta.url);
  // A host may serve it as another type than application/wasm, which streaming refuses.
  compiled ??= WebAssembly.compileStreaming(fetch(address))
    .catch(async () => WebAssembly.compile(await bytesAt(address)))
    .catch((error) => {
      // The next element tries again.
      compiled = undefined;
      throw error;
    });
  return compiled;
}

async function bytesAt(address, signal) {
  const response = await fetch(address, { signal });
  if (!response.ok) throw new Error(`${address}: the server answers ${response.status} ${response.statusText}`.trim());
  return response.arrayBuffer();
}

/** Draws a bundle, which hands turn. Says `load` when its first picture is there, `error` when there will be none. */
export class PocketsplatView extends HTMLElement {
  static observedAttributes = ['src', 'spin', 'alt', 'tiers', 'quality'];
  /** What belongs to the bundle that is shown now: the view, its orbit and its motion. */
  #shown;
  #message;
  #place;
  /** Between its callbacks; what is written in a page is connected before, and then its attributes change first. */
  #isPlaced = false;
  #size = new ResizeObserver(() => this.draw());

  constructor() {
    super();
    const style = document.createElement('style');
    style.textContent = STYLE;
    this.#place = document.createElement('div');
    this.#place.style.height = '100%';
    this.#message = document.createElement('p');
    this.#message.setAttribute('role', 'status');
    this.attachShadow({ mode: 'open', delegatesFocus: true }).append(style, this.#place, this.#message);
  }

  /** The address of the bundle. */
  get src() {
    return this.getAttribute('src') ?? '';
  }

  set src(address) {
    this.setAttribute('src', address);
  }

  /** The camera, from the first picture on. Call `draw` after it was moved. */
  get orbit() {
    return this.#shown?.orbit;
  }

  /** What the bundle is, from the first picture on. */
  get bundle() {
    return this.#shown?.view.bundle;
  }

  /** Draws anew. */
  draw() {
    this.#shown?.motion?.touch();
  }

  connectedCallback() {
    this.#isPlaced = true;
    this.#size.observe(this);
    this.#open();
  }

  disconnectedCallback() {
    this.#isPlaced = false;
    this.#size.disconnect();
    this.#close();
  }

  attributeChangedCallback(name, before, after) {
    if (!this.#isPlaced || before === after) return;
    const { view, motion } = this.#shown ?? {};
    if (name === 'src') this.#open();
    else if (name === 'alt') [view?.figure, view?.canvas].forEach((part) => part?.setAttribute('aria-label', this.#name()));
    else if (name === 'spin' && motion) this.#spin();
    else motion?.touch();
  }

  #name() {
    return this.getAttribute('alt') ?? 'A scene';
  }

  #close() {
    this.#shown?.motion?.stop();
    this.#shown?.view.close();
    this.#shown?.reading.abort();
    this.#shown = undefined;
    this.#place.replaceChildren();
  }

  async #open() {
    this.#close();
    if (!this.src) return this.#say('');
    const shown = { view: new View(this.#name(), this.#place), sharpness: new Sharpness(), reading: new AbortController() };
    this.#shown = shown;
    const { figure } = shown.view;
    figure.tabIndex = 0;
    // Not `group`, with which screen readers keep the arrow keys.
    figure.setAttribute('role', 'application');
    figure.setAttribute('aria-label', this.#name());
    figure.setAttribute('aria-description', 'Drag to turn, or use the arrow keys');
    this.#say('Loading');
    try {
      const [module, bundle] = await Promise.all([decoder(), bytesAt(new URL(this.src, document.baseURI), shown.reading.signal)]);
      // Another one may have been asked for meanwhile.
      if (this.#shown !== shown) return;
      const worker = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
      await shown.view.open(worker(), module, bundle);
      if (this.#shown !== shown) return;
      shown.orbit = new Orbit(shown.view.preview, await shown.view.focus());
      if (this.#shown !== shown) return;
      shown.motion = new Motion(shown.orbit, () => this.#follow(shown));
      shown.motion.seen = [{ home: shown.orbit.home }];
      handle(shown.view.figure, shown.orbit, () => {
        shown.motion.stop();
        shown.motion.touch();
      });
      shown.motion.touch();
      this.#spin();
    } catch (error) {
      if (this.#shown === shown) this.#fail(error.message);
    }
  }

  #fail(message) {
    this.#say(`Cannot draw ${this.src}: ${message}`);
    this.dispatchEvent(new ErrorEvent('error', { message }));
  }

  #say(text) {
    this.#message.textContent = text;
    this.#message.hidden = text === '';
  }

  #spin() {
    const { motion } = this.#shown;
    const isStill = matchMedia('(prefers-reduced-motion: reduce)').matches;
    if (this.hasAttribute('spin') && !isStill) motion.spin();
    else motion.stop();
  }

  #follow(shown) {
    const { view, orbit, motion, sharpness } = shown;
    const next = () => {
      const [widthPx, heightPx] = view.sizeFor(this);
      const tiers = this.hasAttribute('tiers') ? Number(this.getAttribute('tiers')) : undefined;
      const settings = { widthPx, heightPx, tiers, quality: this.getAttribute('quality') ?? undefined };
      const part = sharpness.part(widthPx * heightPx, motion.isMoving);
      const camera = orbit.camera(...[widthPx, heightPx].map((side) => Math.max(16, Math.round(side * part))));
      return { settings, camera, key: JSON.stringify([settings, camera]) };
    };
    view.follow(next, () => {
      const { frame, refused } = view;
      if (this.#shown !== shown) return;
      if (refused) return this.#fail(refused);
      this.#say('');
      sharpness.took(frame.milliseconds, frame.widthPx * frame.heightPx);
      if (!shown.isLoaded) this.dispatchEvent(new Event('load'));
      shown.isLoaded = true;
    });
  }
}

if (!customElements.get('pocketsplat-view')) customElements.define('pocketsplat-view', PocketsplatView);
