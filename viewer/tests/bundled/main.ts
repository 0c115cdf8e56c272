// What a user of the package writes, checked by TypeScript and bundled by Vite.
import 'pocketsplat/element';
import { Orbit, lensOf } from 'pocketsplat/orbit';
import { Scene, type Frame, type Plan } from 'pocketsplat';
import wasm from 'pocketsplat/pocketsplat.wasm?url';

const view = document.querySelector('pocketsplat-view')!;
view.addEventListener('load', () => {
  const anchors: number = view.bundle?.nAnchors ?? 0;
  console.log(`${anchors} anchors at ${view.orbit?.place}`);
});

export async function frame(bundle: ArrayBuffer): Promise<[Plan, Frame]> {
  const scene = await Scene.open(await WebAssembly.compileStreaming(fetch(wasm)), bundle);
  const plan = scene.bind({ widthPx: 320, heightPx: 240, ramBytes: 512 * 1024, quality: 'balanced' });
  const orbit = new Orbit(scene.preview, scene.focus());
  orbit.turn(0.1, 0);
  const still = scene.render({ ...scene.preview, ...lensOf(scene.preview, 320, 240) });
  return [plan, still.splats > 0 ? still : scene.render(orbit.camera(320, 240))];
}

// @ts-expect-error a size is a number
export const wrong = (scene: Scene) => scene.bind({ widthPx: '320', heightPx: 240 });
