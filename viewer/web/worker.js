// Draws for the page, so that the page stays live. One bundle each; answers in the order of the questions.
import { Scene } from './pocketsplat.js';

let scene;

const answers = {
  async open({ module, bundle }) {
    scene = await Scene.open(module, bundle);
    return { bundle: scene.bundle, tiers: scene.tiers, preview: scene.preview };
  },
  bind({ settings }) {
    const limits = scene.limits(settings);
    try {
      return { limits, plan: scene.bind(settings) };
    } catch (error) {
      return { limits, refused: error.message };
    }
  },
  focus() {
    return { distance: scene.focus() };
  },
  orbited({ angle }) {
    return { camera: scene.orbited(angle) };
  },
  render({ camera }) {
    const start = performance.now();
    const frame = scene.render(camera);
    return { ...frame, milliseconds: performance.now() - start };
  },
};

onmessage = async ({ data: { id, question, ...argument } }) => {
  try {
    const answer = await answers[question](argument);
    postMessage({ id, answer }, answer.pixels ? [answer.pixels.buffer] : []);
  } catch (error) {
    postMessage({ id, error: error.message });
  }
};
