/** A pinhole camera in the bundle's frame: x right, y down, z forward (OpenCV). */
export interface Camera {
  /** World to camera, row by row: 9 numbers. */
  rotation: number[];
  /** World to camera, normalised units: 3 numbers. */
  translation: number[];
  /** Focal lengths x and y, pixels. */
  focalPx: number[];
  /** Principal point x and y, pixels from the outer corner of the first pixel. */
  principalPx: number[];
  widthPx: number;
  heightPx: number;
}

/** What a bundle is. */
export interface BundleFacts {
  bytes: number;
  nAnchors: number;
  nTiers: number;
  /** Size of the images it was trained on, pixels. */
  widthPx: number;
  heightPx: number;
  /** Whether symbols are coded with a context, or with tables. */
  usesContext: boolean;
  /** What lies behind the scene, 0 to 255. */
  backgroundRed: number;
  backgroundGreen: number;
  backgroundBlue: number;
  /** The normalisation: `normalised = (world − centre) · scale`. */
  centreX: number;
  centreY: number;
  centreZ: number;
  scale: number;
}

/** The scene of the first tiers together. */
export interface Tier {
  nAnchors: number;
  /** The share of the anchors that is not drawn, 0 to 1. */
  pruningRate: number;
  /** Mean PSNR over held-out views, dB; NaN where it was not measured. */
  psnrDb: number;
}

/** Accuracy that a frame may give up. `exact` is as trained. */
export type Quality =
  | 'exact'
  | 'balanced'
  | 'draft'
  | {
      /** Splats leave pixels alone below this alpha, in 255ths, 1 to 64. */
      alphaCut: number;
      /** Whether the detail head runs. */
      detail: boolean;
    };

/** The limits of a device. */
export interface Settings {
  /** The largest frame, whole pixels, 1 to 4080 a side. */
  widthPx: number;
  heightPx: number;
  /** Scratch memory, whole bytes; `Infinity`, no limit, by default. */
  ramBytes?: number;
  /** Tiers to draw at most, 1 to 255; all by default. */
  tiers?: number;
  /** Whether strips with too many splats are drawn in slabs of depth, instead of leaving splats out. */
  slabs?: boolean;
  quality?: Quality;
}

/** What a decoder does within limits. */
export interface Plan extends Tier {
  /** Bytes of scratch memory, exactly so many. */
  scratchBytes: number;
  nTiers: number;
  nStrips: number;
  nSlabs: number;
  /** Splats that there is memory for at once. */
  maxSplats: number;
  /** Whether anchors are decoded once, not in every frame. */
  isResident: boolean;
  /** Whether the sums over anchors' features are kept too, which they may be where `ramBytes` is Infinity. */
  keepsSums: boolean;
  /** Whether Gaussians are evaluated once. */
  isBaked: boolean;
  /** Whether the networks' weights are kept in 16 bits. */
  halfWeights: boolean;
}

/** Instructions by stage. */
export interface Stages {
  decode: number;
  context: number;
  heads: number;
  project: number;
  sort: number;
  blend: number;
  output: number;
}

/** A picture, and what it consisted of. */
export interface Frame {
  /** RGBA, row by row, opaque: what `ImageData` takes. */
  pixels: Uint8ClampedArray<ArrayBuffer>;
  widthPx: number;
  heightPx: number;
  splats: number;
  /** Splats that there was no memory for. */
  splatsDropped: number;
  /** Splats of the fullest strip. */
  maxSplats: number;
  anchorsVisible: number;
  anchorsDecoded: number;
  gaussians: number;
  slabs: number;
  /** Bytes of the planned memory that this frame needed. */
  scratchUsed: number;
  /** What families of microcontrollers would take for it, predicted; those without an FPU draw with `WithoutFpu`. */
  instructions: { cortexM: Stages; cortexM0Plus: Stages; riscv32: Stages; riscv32Fpu: Stages };
}

/**
 * A bundle, a plan for it, and its frames. Methods throw a `RangeError` for an argument out of its range, which names it, what was given and
 * what is needed; and an `Error` with the decoder's message.
 */
export class Scene {
  /** `module` is `pocketsplat.wasm`, compiled or as bytes; `bundle` is the bytes of a `.psb` file. */
  static open(module: WebAssembly.Module | BufferSource, bundle: ArrayBuffer | Uint8Array): Promise<Scene>;
  readonly bundle: BundleFacts;
  /** From the smallest scene to the whole one. */
  readonly tiers: Tier[];
  /** One of the training cameras. */
  readonly preview: Camera;
  /** The preview carried around the scene by `angle`, radians, at most 100 000 in size: the same numbers as a device computes. */
  orbited(angle: number): Camera;
  /**
   * How far from the preview what it shows in its middle is, normalised units: the median depth of the anchors there. NaN where
   * there are none. Decodes up to 16,384 anchors.
   */
  focus(): number;
  /** The least memory with which a device draws anything within the other limits, and the most that is of use to it. */
  limits(settings: Settings): { leastBytes: number; mostBytes: number };
  /** What a decoder would do. */
  plan(settings: Settings): Plan;
  /** The same, and makes the decoder that the next frames are drawn by. */
  bind(settings: Settings): Plan;
  /** Draws a frame of at most the size that was bound; `bind` comes first. */
  render(camera: Camera): Frame;
}
