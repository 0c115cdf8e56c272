// Runs in Node.js, in a folder with the package and what else of the page needs no browser. Says what fails and ends with 1.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { pathToFileURL } from 'node:url';

const at = (name) => new URL(name, pathToFileURL(`${process.argv[2]}/`));
const { Scene } = await import(at('pocketsplat.js'));
const { Orbit, lensOf } = await import(at('orbit.js'));
const { Motion } = await import(at('motion.js'));
const { Sharpness } = await import(at('sharpness.js'));

const [module, bundle] = [await readFile(at('pocketsplat.wasm')), await readFile(at('scene.psb'))];
const scene = await Scene.open(module, bundle);
const sound = { widthPx: 64, heightPx: 48 };
const camera = { ...scene.preview, ...lensOf(scene.preview, 64, 48) };

/** `work` throws, and says what was given and all that is needed. */
function refuses(work, ...parts) {
  assert.throws(work, (error) => {
    assert.ok(error instanceof Error);
    for (const part of parts) assert.ok(error.message.includes(part), `${error.message}: lacks ${part}`);
    return true;
  });
}

// --- Numbers and words that no decoder takes -------------------------------------------------------------------------

refuses(() => scene.render(camera), 'bind({ widthPx, heightPx })');
const sides = [65536 + 64, 64.5, -65536 + 64, 1e9, 0, NaN, Infinity, 4081, '64', 64n, null, undefined];
const texts = ['65600', '64.5', '-65472', '1000000000', '0', 'NaN', 'Infinity', '4081', '"64"', '64n', 'null', 'missing'];
for (const method of ['bind', 'plan', 'limits']) {
  for (const [i, side] of sides.entries()) {
    refuses(() => scene[method]({ ...sound, widthPx: side }), 'widthPx', texts[i], 'from 1 to 4080');
    refuses(() => scene[method]({ ...sound, heightPx: side }), 'heightPx', texts[i], 'from 1 to 4080');
  }
  for (const [key, values, needed] of [
    ['ramBytes', [NaN, -1, 1024.5, -Infinity, 1e300, '4096', null], 'whole number from 0 to'],
    ['tiers', [0, 256, 257, -1, 1.5, NaN, '1', null], 'whole number from 1 to 255'],
    ['slabs', [1, 'no', null], 'true or false'],
    ['quality', ['fast', 'constructor', 'EXACT', 3, null, ['exact']], ''],
  ]) {
    for (const value of values) refuses(() => scene[method]({ ...sound, [key]: value }), key, Array.isArray(value) ? '' : String(value), needed);
  }
  refuses(() => scene[method]({ ...sound, quality: 'fast' }), '"fast"', '"exact"', '"balanced"', '"draft"');
  const quality = { alphaCut: 1, detail: true };
  for (const [key, values, needed] of [
    ['alphaCut', [0, 65, 257, 1.5, undefined], 'from 1 to 64'],
    ['detail', [0, undefined], 'true or false'],
  ]) {
    for (const value of values) refuses(() => scene[method]({ ...sound, quality: { ...quality, [key]: value } }), `quality.${key}`, needed);
  }
  refuses(() => scene[method](), 'widthPx is missing');
}
refuses(() => scene.render(camera), 'bind(');
const plan = scene.bind({ ...sound, ramBytes: 1e15, tiers: 255, slabs: true, quality: 'draft' });
assert.ok(plan.scratchBytes > 0);
assert.equal(scene.render(camera).pixels.length, 4 * 64 * 48);
for (const [key, value, ...parts] of [
  ['widthPx', 65, '65', 'from 1 to 64'],
  ['widthPx', 65600, '65600'],
  ['heightPx', 48.5, '48.5', 'from 1 to 48'],
  ['focalPx', [100, 0], 'focalPx[1] is 0', 'above 0'],
  ['focalPx', [100, 1e-60], 'focalPx[1] is 1e-60'],
  ['focalPx', 100, 'focalPx is 100', '2 numbers'],
  ['principalPx', [NaN, 1], 'principalPx[0] is NaN', 'finite'],
  ['translation', [0, 0, 1e39], 'translation[2] is 1e+39', '3.4e38'],
  ['translation', [0, 0], 'translation is 2 numbers', '3 numbers'],
  ['translation', [0, , 0], 'translation[1] is missing'],
  ['rotation', ['1', 0, 0, 0, 1, 0, 0, 0, 1], 'rotation[0] is "1"'],
  ['rotation', undefined, 'rotation is missing', '9 numbers'],
]) {
  refuses(() => scene.render({ ...camera, [key]: value }), ...parts);
}
assert.equal(scene.render({ ...camera, rotation: new Float64Array(camera.rotation) }).widthPx, 64, 'typed arrays are arrays');
refuses(() => scene.render(), 'rotation is missing');
for (const angle of [NaN, Infinity, 1e39, 1e6, '1', undefined]) refuses(() => scene.orbited(angle), 'angle');
for (const wrong of [5, 'scene.psb', null, [1, 2]]) await assert.rejects(Scene.open(module, wrong), /bundle is .*needs the bytes/);
const part = new Uint8Array(bundle.length + 16);
part.set(bundle, 16);
assert.equal((await Scene.open(module, part.subarray(16))).bundle.bytes, bundle.length, 'a part of a buffer is that part');

const orbit = new Orbit(scene.preview, scene.focus());
const before = JSON.stringify(orbit);
refuses(() => orbit.turn(NaN, 0), 'yaw is NaN');
refuses(() => orbit.turn(0), 'pitch is missing');
refuses(() => orbit.pan(0, Infinity), 'y is Infinity');
for (const factor of [0, -1, NaN, 'x']) refuses(() => orbit.zoom(factor), 'factor', String(factor));
for (const side of [0, 320.5, -1, 65536, NaN]) refuses(() => orbit.camera(side, 240), 'width', String(side), 'from 1 to 65535');
refuses(() => lensOf({ ...camera, focalPx: [0, 1] }, 10, 10), 'focalPx[0]');
for (const place of ['', '1,2,3', '1,2,3,4,5,6,4', '1,2,3,4,5,6,0.5', '1,2,3,4,5,6,0,0', '1,2,0,0,0,0', '1,2,3,4,5,', 'a,b,c,d,e,f', '1e9,0,1,0,0,0', 5]) refuses(() => (orbit.place = place), 'place', 'six numbers');
assert.equal(JSON.stringify(orbit), before, 'what is refused moves nothing');
const other = new Orbit(scene.preview, scene.focus());
other.turn(0.3, 0.1);
other.pan(0.1, 0.2);
orbit.place = other.place;
assert.equal(orbit.place, other.place);
other.quarter();
other.turn(0.2, 0);
orbit.place = other.place;
assert.equal(orbit.quarters, 1, 'a turned picture is turned there too');
const [here, there] = [orbit, other].map((each) => each.camera(64, 48).translation);
assert.ok(here.every((x, i) => Math.abs(x - there[i]) < 1e-3), `a place is the camera: ${here} and ${there}`);

// --- Sharpness while it moves ----------------------------------------------------------------------------------------

/** Eight seconds of frames that take `fixed` milliseconds and `perMegapixel`, give or take a share, and `factor` as much after half: levels, in order. */
function moved(fixed, perMegapixel, share, factor = 1) {
  const [sharpness, pixels, levels] = [new Sharpness(), 557_000, []];
  let seed = 1;
  const noise = () => (seed = (seed * 16807) % 2147483647) / 2147483647 - 0.5;
  const took = (part) => (fixed + 1e-6 * perMegapixel * pixels * part ** 2) * Math.exp(2 * share * (noise() + noise() + noise()));
  sharpness.took(took(1), pixels);
  assert.equal(sharpness.part(pixels, false, 0), 1, 'at rest it is sharp');
  for (let now = 300; now < 8300; ) {
    const part = sharpness.part(pixels, true, now);
    if (levels.at(-1) !== part) levels.push(part);
    const milliseconds = took(part) * (now > 4000 ? factor : 1);
    now += milliseconds;
    sharpness.took(milliseconds, pixels * part ** 2);
  }
  return levels;
}
for (const fixed of [0, 10, 30]) {
  for (const perMegapixel of [20, 50, 100, 150, 270, 600, 2000]) {
    for (const share of [0, 0.2, 0.5]) {
      const levels = moved(fixed, perMegapixel, share);
      assert.ok(levels.length <= 3, `${fixed} ms and ${perMegapixel} ms a megapixel, noise ${share}: ${levels}`);
    }
  }
}
assert.deepEqual([moved(0, 150, 0, 4), moved(0, 400, 0, 0.2)], [[0.7, 0.5], [0.5, 0.7, 1]], 'and anew where that changes');
assert.deepEqual([moved(0, 50, 0), moved(0, 2000, 0)], [[1], [0.25]], 'as sharp as there is time for');

// --- How far it moves by itself --------------------------------------------------------------------------------------

// A page's clock: frames of 20 ms, as fast as they can be drawn.
let now = 0;
let frames = [];
Object.assign(globalThis, { requestAnimationFrame: (frame) => frames.push(frame) });
// Defined, for Node 18 has it read-only.
const clockOf = (value) => Object.defineProperty(performance, 'now', { value, configurable: true });
const clock = performance.now;
clockOf(() => now);
globalThis.setTimeout = (work, after) => (after >= 1000 ? work() : 0);
globalThis.clearTimeout = () => {};

/** The least and the most degrees that it turned by within a minute. */
function turned(begin, spread) {
  const orbit = new Orbit(scene.preview, 4);
  const motion = new Motion(orbit, () => {});
  motion.seen = [{ spread, home: orbit.home }];
  frames = [];
  begin(motion);
  let [least, most] = [0, 0];
  for (let i = 0; i < 3000 && frames.length; i++) {
    now += 20;
    const due = frames;
    frames = [];
    for (const frame of due) frame(now);
    const degrees = ((orbit.yaw - orbit.home.yaw) * 180) / Math.PI;
    [least, most] = [Math.min(least, degrees), Math.max(most, degrees)];
  }
  return { least, most, end: Math.abs(orbit.yaw - orbit.home.yaw) };
}
const sway = (motion) => motion.swayAfter(1000);
const spin = (motion) => motion.spin();
const radius = 4 * Math.cos(new Orbit(scene.preview, 4).home.pitch);
const degreesOf = (aside) => (Math.asin(Math.min(1, aside / radius)) * 180) / Math.PI;
const near = (found, expected) => assert.ok(Math.abs(found - expected) < 0.3, `${found}, not ${expected}`);

const unknown = turned(sway);
near(unknown.most, 4);
near(unknown.least, -4);
assert.ok(unknown.end < 1e-6, 'it ends where it began');
const row = turned(sway, [0, 0.5, 0]);
near(row.least, 0);
near(row.most, degreesOf(0.5));
const ring = turned(sway, [4, 4, 8]);
near(ring.most, 20);
near(ring.least, -20);
const still = turned(sway, [0, 0, 0]);
assert.deepEqual([still.least, still.most], [0, 0], 'one place is one picture');
assert.ok(turned(spin, [4, 4, 8]).most > 360, 'cameras on all sides: it turns');
const swung = turned(spin, [1, 0.5, 0.2]);
near(swung.least, -degreesOf(1));
near(swung.most, degreesOf(0.5));
assert.ok(turned(spin).most > 360, 'who does not know lets people look');
clockOf(clock);
console.log('all as it should be');
