// Runs in the page of `browser.rs`: says on the console what the page draws and does.
const say = (text) => console.log(`pocketsplat: ${text}`);
const check = (holds, what) => say(`${holds ? 'passed' : 'FAILED'} ${what}`);
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** CRC-32 (IEEE 802.3) of red, green and blue of a canvas. */
function checksum(canvas) {
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
  let crc = 0xffffffff;
  for (let i = 0; i < data.length; i++) {
    if (i % 4 === 3) continue;
    crc ^= data[i];
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ((crc ^ 0xffffffff) >>> 0).toString(16).padStart(8, '0');
}

/** As `golden.rs` computes it: in f32. */
const quarter = (n) => Math.fround(Math.fround(2 * Math.PI) * n) / 4;

/** Until no view has drawn for a while, however slow the machine is. */
async function settled() {
  for (let last = -1; ; ) {
    await sleep(400);
    const shown = pocketsplat.views.map((view) => (view.isBusy ? NaN : view.shownAt)).join();
    if (shown === last && !shown.includes('NaN')) return;
    last = shown;
  }
}

async function digests(withLessMemory) {
  for (const view of pocketsplat.views) {
    for (let tiers = 1; tiers <= view.tiers.length; tiers++) {
      for (let n = 0; n < 4; n++) {
        const camera = await view.orbited(quarter(n));
        const { widthPx, heightPx } = camera;
        const settings = { widthPx, heightPx, tiers, slabs: true, quality: 'exact', ramBytes: Infinity };
        await view.show(settings, camera);
        const whole = checksum(view.canvas);
        say(`frame ${view.name},${tiers},${n},${whole}`);
        if (!withLessMemory) continue;
        const { leastBytes, mostBytes } = view.limits;
        for (const ramBytes of [leastBytes, Math.floor(0.6 * mostBytes), Math.floor(0.8 * mostBytes)]) {
          await view.show({ ...settings, ramBytes }, camera);
          const { scratchBytes, nTiers, halfWeights } = view.plan;
          check(scratchBytes <= ramBytes, `${view.name}: the plan keeps its memory`);
          // Fewer tiers and weights of 16 bits change pixels, and are named by the plan.
          if (nTiers === tiers && !halfWeights) check(checksum(view.canvas) === whole, `${view.name}: less memory, same pixels`);
        }
        await view.show({ ...settings, ramBytes: leastBytes - 1 }, camera);
        check(/budget of \d+ bytes/.test(view.refused), `${view.name}: a byte less is refused`);
      }
    }
  }
}

/** Frames a second of the device view while the scene spins. */
async function speed(widthPx, heightPx, seconds) {
  const [view] = pocketsplat.views;
  pocketsplat.state.size = [widthPx, heightPx];
  document.querySelector('input[value="device"]').click();
  await settled();
  document.getElementById('spin').click();
  await sleep(1000);
  const [start, before] = [performance.now(), view.nShown];
  const times = [];
  while (performance.now() - start < 1000 * seconds) {
    times.push(view.frame.milliseconds);
    await sleep(20);
  }
  const perSecond = (1000 * (view.nShown - before)) / (performance.now() - start);
  document.getElementById('spin').click();
  check(view.canvas.width === widthPx && view.canvas.height === heightPx, 'all of its pixels are drawn');
  times.sort((a, b) => a - b);
  const [least, median] = [times[0], times[times.length >> 1]].map((time) => time.toFixed(1));
  say(`speed ${perSecond.toFixed(1)} frames/s at ${widthPx}x${heightPx}; a frame takes ${median} ms, ${least} at least`);
}

async function hands() {
  const { state, views } = pocketsplat;
  const [stage, orbit, view] = [document.getElementById('stage'), pocketsplat.orbit(), views[0]];
  const press = (key, more = {}) => stage.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true, ...more }));
  const { yaw, distance } = orbit;
  press('ArrowLeft');
  check(orbit.yaw < yaw, 'an arrow key turns');
  press('+');
  check(orbit.distance < distance, 'plus zooms in');
  press('ArrowUp', { shiftKey: true });
  check(String(orbit.target) !== String(orbit.home.target), 'Shift and an arrow key pan');
  press('0');
  check(orbit.yaw === orbit.home.yaw && orbit.distance === orbit.home.distance, '0 resets');
  await sleep(600);
  check(location.hash.slice(1) === orbit.place, 'the address has the camera once it rests');
  location.hash = '#0.5,0.25,3,0.1,0.2,0.3';
  await sleep(200);
  check(orbit.place === '0.5,0.25,3,0.1,0.2,0.3', 'an address moves the camera');
  location.hash = '#section-2';
  await sleep(200);
  check(orbit.place === '0.5,0.25,3,0.1,0.2,0.3', 'what is no camera moves nothing');
  press('0');
  const eye = (camera) => camera.rotation.concat(camera.translation).map((x) => x.toFixed(6)).join();
  const [seen, far] = [eye(orbit.camera(64, 64)), orbit.distance];
  orbit.refocus(far + 1);
  check(eye(orbit.camera(64, 64)) === seen && orbit.distance === far + 1, 'another focus, the same picture');
  orbit.refocus(far);
  const upright = JSON.stringify(orbit.camera(64, 64).rotation.map((x) => x.toFixed(6)));
  press('r');
  const lying = JSON.stringify(orbit.camera(64, 64).rotation.map((x) => x.toFixed(6)));
  for (let i = 0; i < 3; i++) press('r');
  check(lying !== upright && upright === JSON.stringify(orbit.camera(64, 64).rotation.map((x) => x.toFixed(6))), 'four quarters are a whole');
  const at = (type, x, y, more = {}) => {
    stage.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: x, clientY: y, bubbles: true, button: 0, ...more }));
  };
  stage.setPointerCapture = () => {};
  at('pointerdown', 100, 100);
  at('pointermove', 160, 100);
  at('pointerup', 160, 100);
  check(orbit.yaw < orbit.home.yaw, 'dragging turns');
  const [near, target] = [orbit.distance, String(orbit.target)];
  at('pointerdown', 100, 100);
  at('pointerdown', 200, 100, { pointerId: 2 });
  at('pointermove', 260, 120, { pointerId: 2 });
  at('pointerup', 100, 100);
  at('pointerup', 260, 120, { pointerId: 2 });
  check(orbit.distance < near && String(orbit.target) !== target, 'two fingers pan and zoom');
  stage.dispatchEvent(new WheelEvent('wheel', { deltaY: 300, cancelable: true }));
  check(orbit.distance > near / 1.6, 'the wheel zooms out');
  press('d');
  await settled();
  check(state.device && view.canvas.width === view.bundle.widthPx, 'the device view has the device’s pixels');
  check(getComputedStyle(view.canvas).imageRendering === 'pixelated', 'and shows each');
  const widthShown = () => view.canvas.getBoundingClientRect().width;
  const roomy = widthShown();
  stage.style.height = '240px';
  await sleep(300);
  check(widthShown() < roomy, `a smaller window lays the display out anew: ${widthShown()} px wide, before ${roomy}`);
  stage.style.height = '';
  await sleep(300);
  check(widthShown() === roomy, 'and a larger one');
  const slide = (id, value) => {
    const input = document.getElementById(id);
    input.value = value;
    input.dispatchEvent(new Event('input', { bubbles: true }));
  };
  const before = { ...view.plan };
  slide('ram', 120);
  await settled();
  check(view.plan.scratchBytes < before.scratchBytes && !view.refused, 'the slider of memory plans anew');
  check(document.getElementById('plan').textContent.includes('Scratch memory'), 'the plan is shown');
  slide('ram', 0);
  await settled();
  await sleep(400);
  const captions = views.filter((view) => view.refused).map((view) => view.caption.textContent);
  check(captions.length > 0 && captions.every((text) => /: needs [\d,.]+ (B|KiB|MiB): move Memory to the right$/.test(text)), `too little is said ${captions}`);
  slide('ram', 200);
  slide('pruning', 1);
  await settled();
  check(view.plan.nAnchors < before.nAnchors, 'the slider of pruning plans anew');
  document.querySelector('input[value="draft"]').click();
  await settled();
  check(state.quality === 'draft' && view.frame.splats > 0, 'quality plans anew');
  const boards = document.getElementById('target');
  const pico = [...boards.options].find((option) => option.textContent.startsWith('Pico 2'));
  pico.selected = true;
  boards.dispatchEvent(new Event('change'));
  await settled();
  check(state.device && view.canvas.width === 240 && view.plan.scratchBytes <= state.ramBytes, 'a board sets display and memory');
  check(state.ramBytes === 494 * 1024 && / s$/.test(document.querySelector('#stages b').textContent), 'a board has seconds');
  const turned = orbit.yaw;
  press(' ');
  for (let i = 0; i < 50 && orbit.yaw === turned; i++) await sleep(100);
  check(orbit.yaw !== turned, 'Space spins');
  press(' ');
  const unnamed = [...document.querySelectorAll('input, select, button')].filter(
    (element) => !element.labels?.length && !element.textContent && !element.getAttribute('aria-label'),
  );
  check(unnamed.length === 0, `every control has a name ${unnamed.map((element) => element.id)}`);
  check(document.querySelectorAll('main').length === 1 && !document.querySelector('main[role]'), 'one main landmark');
  const scrolls = [...document.querySelectorAll('body *')].filter((element) => /auto|scroll/.test(getComputedStyle(element).overflowX));
  const mute = scrolls.filter((element) => element.tabIndex < 0 && !element.querySelector('button, input, select'));
  check(scrolls.length > 1 && mute.length === 0, `what scrolls takes the keyboard ${mute.map((element) => element.className)}`);
}

addEventListener('unhandledrejection', (event) => say(`FAILED ${event.reason}`));
/** Sharp first, then a sway within what the cameras saw, at one sharpness or two. */
async function sway() {
  const [{ canvas }, orbit] = [pocketsplat.views[0], pocketsplat.orbit()];
  const sizes = [];
  const angles = [];
  const start = performance.now();
  while (performance.now() - start < 9000) {
    const size = `${canvas.width}x${canvas.height}`;
    if (sizes.at(-1) !== size) sizes.push(size);
    angles.push(((orbit.yaw - orbit.home.yaw) * 180) / Math.PI);
    await sleep(50);
  }
  check(angles.slice(0, 10).every((angle) => angle === 0), 'it stands still at first');
  const [least, most] = [Math.min(...angles), Math.max(...angles)].map((angle) => angle.toFixed(1));
  say(`sways from ${least} to ${most} degrees, ${sizes.length - 1} changes of size: ${sizes.join(' ')}`);
  check(sizes.length <= 5, 'its sharpness does not pump');
  check(Math.abs(least) < 4.1 && most < 4.1 && most > 1, 'it sways a little where nobody knows what the cameras saw');
}

pocketsplat.started.then(async () => {
  const [mark] = performance.getEntriesByName('first-picture');
  say(`first picture after ${mark.startTime.toFixed(0)} ms`);
  if (pocketsplat.views.length === 1) await sway();
  pocketsplat.stopSpinning();
  await settled();
  if (pocketsplat.views.length > 1) {
    await hands();
    await settled();
  }
  await digests(pocketsplat.views.length > 1);
  if (pocketsplat.views.length === 1) await speed(320, 240, 5);
  check(performance.getEntriesByType('resource').length === 0, 'nothing was fetched');
  say('done');
});
