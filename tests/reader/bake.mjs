// The rounding of the Gaussians of a scene that looks the same from everywhere (DRAWING.md, section 5).

import { f32Of, half, max, sqrt, trunc } from "./maths.mjs";

const f = Math.fround;
const OPACITY_STEP = f32Of(0x37800080);
const ROOT_HALF = f32Of(0x3f3504f3);
const ROTATION_STEP = f32Of(0x35b504fe);
const ROTATION_LEVELS = 2 ** 20 - 1;

const level = (x, n) => trunc(f(f(x * n) + 0.5), n);
const roundOpacity = (opacity) => f(level(opacity, 65535) * OPACITY_STEP);
const roundColour = (c) => f(f(trunc(f(f(f(c + 0.5) * 2048) + 0.5), 4095) * (1 / 2048)) - 0.5);
const roundScale = (scale) => (scale < 2 ** 25 ? half(scale) : Infinity);

function roundRotation(q) {
  let taken = 0;
  for (let i = 1; i < 4; i++) if (Math.abs(q[i]) > Math.abs(q[taken])) taken = i;
  const sign = q[taken] < 0 ? -1 : 1;
  let of = q;
  if (Math.abs(q[taken]) < 0.25) [of, taken] = [[1, 0, 0, 0], 0];
  const others = of.filter((_, i) => i !== taken).map((x) => {
    const at = f(0.5 + f(f(f(0.5 * sign) * x) / ROOT_HALF));
    return f(f(ROTATION_STEP * level(at, ROTATION_LEVELS)) - ROOT_HALF);
  });
  const squares = f(f(f(others[0] * others[0]) + f(others[1] * others[1])) + f(others[2] * others[2]));
  others.splice(taken, 0, sqrt(max(f(1 - squares), 0)));
  return others;
}

export function bake({ centre, opacity, colour, scales, rotation }) {
  return {
    centre,
    opacity: roundOpacity(opacity),
    colour: colour.map(roundColour),
    scales: scales.map(roundScale),
    rotation: rotation && roundRotation(rotation),
  };
}
