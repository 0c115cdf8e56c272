import type { Orbit } from './orbit.js';
import type { BundleFacts } from './pocketsplat.js';

/**
 * `<pocketsplat-view src="scene.psb">`: draws a bundle, which mouse, touch and keys turn. Importing this module defines the element.
 *
 * Attributes: `src`, the address of the bundle; `spin`, it turns by itself; `alt`, what is to be seen; `tiers` and `quality` as in `Settings`.
 * Events: `load` when the first picture is there; `error`, an `ErrorEvent`, when there will be none. It is 4:3 and as wide as its place unless
 * styles say otherwise.
 */
export class PocketsplatView extends HTMLElement {
  src: string;
  /** The camera, from `load` on. Call `draw` after it was moved. */
  readonly orbit: Orbit | undefined;
  /** What the bundle is, from `load` on. */
  readonly bundle: BundleFacts | undefined;
  draw(): void;
}

declare global {
  interface HTMLElementTagNameMap {
    'pocketsplat-view': PocketsplatView;
  }
}
