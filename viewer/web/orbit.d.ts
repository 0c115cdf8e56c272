import type { Camera } from './pocketsplat.js';

/** A camera that turns around a point. Methods throw a `RangeError` for a number that is none, and move nothing then. */
export class Orbit {
  /** Around the point of the line of sight at `distance`, such as `scene.focus()`; else around the nearest to the origin. */
  constructor(preview: Camera, distance?: number);
  /** Angles, radians, and the distance, normalised units. */
  yaw: number;
  pitch: number;
  distance: number;
  /** The point it turns around, normalised units. */
  target: number[];
  /** Where it stands, as text that an address can hold; setting what is none throws a `RangeError` and moves nothing. */
  place: string;
  reset(): void;
  /** Turns around the point at another distance from now on; the picture stays as it is. */
  refocus(distance: number): void;
  /** Turns the picture by a quarter, clockwise, and begins anew: for scenes whose photographs lie on their side. */
  quarter(): void;
  /** Turns by angles, radians. */
  turn(yaw: number, pitch: number): void;
  /** Moves the picture by parts of its shorter side. */
  pan(x: number, y: number): void;
  /** Goes nearer by a factor above 1. */
  zoom(factor: number): void;
  /** Stands as another orbit does, each by its own first view and distance. */
  follow(other: Orbit): void;
  /** The camera of a frame of this size, whole pixels. */
  camera(widthPx: number, heightPx: number): Camera;
}

/**
 * Lets mouse, touch and keyboard move an orbit; `changed` is called after each move, `quarter` is what the key R does.
 * Give the element `touch-action: none`.
 */
export function handle(element: HTMLElement, orbit: Orbit, changed: () => void, quarter?: () => void): void;

/** The lens of a camera for frames of another size. */
export function lensOf(
  camera: Camera,
  width: number,
  height: number,
): Pick<Camera, 'focalPx' | 'principalPx' | 'widthPx' | 'heightPx'>;

/** Where a camera stands, normalised units. */
export function centreOf(camera: Camera): number[];

/** A bundle's normalisation. */
export interface Normalisation {
  centre: number[];
  scale: number;
}

/** The same camera in the frame of another bundle of the same capture. */
export function carried(camera: Camera, from: Normalisation, to: Normalisation): Camera;
