// The page: one camera, one set of limits, as many bundles as there are.
import { Orbit, carried, handle } from './orbit.js';
import { Motion } from './motion.js';
import { Sharpness } from './sharpness.js';
import { View } from './view.js';
import { bytes, caption, count, percent, showFrames, showInstructions, showPlans } from './figures.js';

const DISPLAYS = [[96, 64], [128, 128], [160, 120], [160, 128], [240, 240], [320, 240], [480, 320], [640, 480]];
const NO_LIMIT = 200;
const FIGURES_MS = 200;
/** How long the camera rests before the address has it. */
const PLACE_MS = 400;
/** Width and height of the first picture, as a share of the full ones: the browser still compiles while it is drawn. */
const FIRST_PART = 0.5;
/** How long a picture stands still before it sways. */
const LOOK_MS = 1000;

const $ = (id) => document.getElementById(id);
const stage = $('stage');
const state = { device: false, ramBytes: Infinity, ramStep: NO_LIMIT, pruning: 0, quality: 'exact', slabs: false, size: undefined };
const views = [];
const figures = { shownAt: 0, timer: undefined };
let orbit;
let motion;

function decoded(text) {
  const binary = atob(text.trim());
  const array = new Uint8Array(binary.length);
  for (let i = 0; i < array.length; i++) array[i] = binary.charCodeAt(i);
  return array;
}

// --- What is to be drawn ---------------------------------------------------------------------------------------------

/** The frame's size: the display's, or what the window has. */
const frameSize = () => (state.device ? state.size : views[0].sizeFor(views[0].figure));

function settingsOf(view, [widthPx, heightPx]) {
  const nTiers = view.tiers.length;
  const tiers = Math.max(1, nTiers - Math.min(state.pruning, nTiers - 1));
  // A device has a limit, however large: what only a browser has room for is not counted as its memory.
  const ramBytes = state.device ? Math.min(state.ramBytes, Number.MAX_SAFE_INTEGER) : state.ramBytes;
  return { widthPx, heightPx, ramBytes, tiers, slabs: state.slabs, quality: state.quality };
}

/** One camera for all: in the world's frame where the bundles are of one capture, else around each scene by itself. */
function cameraOf(view, widthPx, heightPx) {
  if (view.orbit) {
    view.orbit.follow(orbit);
    return view.orbit.camera(widthPx, heightPx);
  }
  const camera = orbit.camera(widthPx, heightPx);
  const [from, to] = [views[0].normalisation, view.normalisation];
  return JSON.stringify(from) === JSON.stringify(to) ? camera : carried(camera, from, to);
}

/** Frames of about the same place and size are of one capture, however it was split. */
function isSameCapture({ centre: a, scale }, { centre: b, scale: other }) {
  const apart = Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) * scale;
  return apart < 1 && scale / other < 1.2 && other / scale < 1.2;
}

function next(view) {
  const size = frameSize();
  const settings = settingsOf(view, size);
  const sharpness = state.device ? 1 : view.frame ? view.sharpness.part(size[0] * size[1], motion.isMoving) : FIRST_PART;
  const camera = cameraOf(view, ...size.map((side) => Math.max(16, Math.round(side * sharpness))));
  return { settings, camera, key: JSON.stringify([settings, state.ramStep, camera]) };
}

// --- What was drawn --------------------------------------------------------------------------------------------------

function shown(view) {
  const now = performance.now();
  const between = now - (view.shownAt ?? 0);
  view.shownAt = now;
  const { frame } = view;
  // Only frames that follow each other say something about speed: not one for each tap of a key.
  const follows = motion.isMoving && frame && between < 100 + 2 * frame.milliseconds;
  view.between = follows ? 0.8 * (view.between ?? between) + 0.2 * between : undefined;
  if (frame && !view.refused && !state.device) view.sharpness.took(frame.milliseconds, frame.widthPx * frame.heightPx);
  layOut(view);
  view.canvas.style.opacity = view.refused ? 0.15 : 1;
  // Numbers that change with every frame cannot be read, and cost as much as a small frame.
  figures.timer ??= setTimeout(showFigures, Math.max(0, figures.shownAt + FIGURES_MS - now));
  if (!performance.getEntriesByName('first-picture').length) performance.mark('first-picture');
}

function showFigures() {
  clearTimeout(figures.timer);
  Object.assign(figures, { timer: undefined, shownAt: performance.now() });
  for (const view of views) {
    if (!view.frame && !view.refused) continue;
    view.caption.textContent = caption(view, state.ramBytes, motion.isMoving && view.between && 1000 / view.between);
    view.caption.classList.toggle('bad', Boolean(view.refused));
    view.caption.setAttribute('aria-live', view.refused ? 'assertive' : 'off');
  }
  showPlans($('plan'), views);
  showFrames($('frame'), views);
  showInstructions($('stages'), views, $('target').selectedOptions[0], state.device);
  showRam();
}

/** In the device view each of the display's pixels is a whole number of the screen's, as far as there is room. */
function layOut({ canvas, figure }) {
  if (!state.device) {
    canvas.style.width = canvas.style.height = '';
    return;
  }
  const [width, height] = state.size;
  const free = [Math.max(figure.clientWidth - 40, 8) / width, Math.max(figure.clientHeight - 90, 8) / height];
  const room = Math.min(...free) * devicePixelRatio;
  const scale = (room >= 1 ? Math.floor(room) : room) / devicePixelRatio;
  canvas.style.width = `${width * scale}px`;
  canvas.style.height = `${height * scale}px`;
}

function draw() {
  for (const view of views) if (view.bundle) view.follow(next, shown);
}

function moved() {
  stopSpinning();
  motion.touch();
}

/** Puts the camera into the address, so that a copy of it shows the same; pages inside other pages have none of their own. */
function keep(place) {
  try {
    history.replaceState(null, '', `#${place}`);
  } catch {
    // Not allowed here.
  }
}

// --- Settings --------------------------------------------------------------------------------------------------------

/** Limits of memory that are of use to any of the bundles. */
function ramRange() {
  const known = views.filter((view) => view.limits).map((view) => view.limits);
  return [Math.min(...known.map((limits) => limits.leastBytes)), Math.max(...known.map((limits) => limits.mostBytes))];
}

function ramOf(step) {
  if (step >= NO_LIMIT) return Infinity;
  const [least, most] = ramRange();
  const bytes = least * (most / least) ** (step / (NO_LIMIT - 1));
  // Whole KiB, and always enough for something.
  return Math.ceil(bytes / 1024) * 1024;
}

function showRam() {
  const text = state.ramBytes === Infinity ? 'no limit' : bytes(state.ramBytes);
  $('ram-text').textContent = text;
  $('ram').setAttribute('aria-valuetext', text);
}

function showPruning() {
  const tiers = views[0].tiers;
  const text = percent(tiers[Math.max(0, tiers.length - 1 - state.pruning)].pruningRate);
  $('pruning-text').textContent = text;
  $('pruning').setAttribute('aria-valuetext', text);
}

function setDevice(device) {
  state.device = device;
  stage.className = device ? 'device' : 'scene';
  document.querySelector(`input[name="view"][value="${device ? 'device' : 'scene'}"]`).checked = true;
  $('size').disabled = !device;
  motion.touch();
}

/** Takes the display and the memory of a board. */
function takeBoard({ size, ram }) {
  state.isBoard = true;
  if (![...$('size').options].some((option) => option.value === size)) $('size').add(new Option(size.replace(',', '×'), size));
  $('size').value = size;
  state.size = size.split(',').map(Number);
  state.ramBytes = Number(ram);
  const [least, most] = ramRange();
  const step = most > least ? Math.round((NO_LIMIT - 1) * (Math.log(ram / least) / Math.log(most / least))) : 0;
  state.ramStep = $('ram').value = Math.min(Math.max(step, 0), NO_LIMIT - 1);
  setDevice(true);
}

/** Another processor has no memory of its own. */
function leaveBoard() {
  state.isBoard = false;
  state.ramBytes = Infinity;
  state.ramStep = $('ram').value = NO_LIMIT;
  showFigures();
  motion.touch();
}

function stopSpinning() {
  motion.stop();
  $('spin').setAttribute('aria-pressed', 'false');
  clearTimeout(figures.placed);
  figures.placed = setTimeout(() => keep(orbit.place), PLACE_MS);
}

function spin() {
  if ($('spin').getAttribute('aria-pressed') === 'true') return stopSpinning();
  $('spin').setAttribute('aria-pressed', 'true');
  return motion.spin();
}

/** The scene alone on the screen, or the page again; who may not keeps what there is. */
function fillScreen() {
  const done = document.fullscreenElement ? document.exitFullscreen() : stage.requestFullscreen();
  done.catch(() => {});
}

function offer() {
  const { bundle } = views[0];
  const trained = [bundle.widthPx, bundle.heightPx];
  const sizes = [trained, ...DISPLAYS.filter((size) => String(size) !== String(trained))];
  $('size').replaceChildren(
    ...sizes.map(([width, height], i) => new Option(`${width}×${height}${i ? '' : ', as trained'}`, `${width},${height}`)),
  );
  state.size = trained;
  $('pruning').max = Math.max(...views.map((view) => view.tiers.length)) - 1;
  const facts = `${count(bundle.nAnchors)} anchors, ${bytes(bundle.bytes)}, trained at ${trained.join('×')}`;
  $('facts').textContent = views.length > 1 ? `${views.length} bundles, one camera` : facts;
  showPruning();
}

function listen() {
  const quarter = () => {
    for (const each of [orbit, ...views.map((view) => view.orbit)]) each?.quarter();
    // What was aside is above now.
    for (const view of views) view.spread = undefined;
    know();
  };
  handle(stage, orbit, moved, quarter);
  stage.addEventListener('pointerdown', stopSpinning);
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.target.closest('select, button, summary, input') && event.key === ' ') return;
    if (event.target.closest('select')) return;
    if (event.key === ' ') spin();
    else if (event.key === 'd' || event.key === 'D') setDevice(!state.device);
    else if ((event.key === 'f' || event.key === 'F') && document.fullscreenEnabled) fillScreen();
    else return;
    event.preventDefault();
  });
  $('spin').addEventListener('click', spin);
  $('quarter').addEventListener('click', () => (quarter(), moved()));
  $('reset').addEventListener('click', () => (orbit.reset(), moved()));
  $('full').hidden = !document.fullscreenEnabled;
  $('full').addEventListener('click', fillScreen);
  $('save').addEventListener('click', save);
  $('target').addEventListener('change', () => {
    const [{ dataset }] = $('target').selectedOptions;
    if (dataset.size) takeBoard(dataset);
    else if (state.isBoard) leaveBoard();
    else showFigures();
  });
  $('size').addEventListener('change', (event) => ((state.size = event.target.value.split(',').map(Number)), motion.touch()));
  $('slabs').addEventListener('change', (event) => ((state.slabs = event.target.checked), motion.touch()));
  $('ram').addEventListener('input', (event) => {
    state.ramStep = Number(event.target.value);
    state.ramBytes = ramOf(state.ramStep);
    showRam();
    motion.touch();
  });
  $('pruning').addEventListener('input', (event) => ((state.pruning = Number(event.target.value)), showPruning(), motion.touch()));
  for (const input of document.querySelectorAll('input[name="view"]')) {
    input.addEventListener('change', () => setDevice(input.value === 'device'));
  }
  for (const input of document.querySelectorAll('input[name="quality"]')) {
    input.addEventListener('change', () => ((state.quality = input.value), motion.touch()));
  }
  new ResizeObserver(() => {
    views.forEach(layOut);
    motion.touch();
  }).observe(stage);
}

function save() {
  for (const view of views) {
    view.canvas.toBlob((blob) => {
      const link = Object.assign(document.createElement('a'), { href: URL.createObjectURL(blob), download: `${view.name}.png` });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }
}

// --- Start -----------------------------------------------------------------------------------------------------------

async function start() {
  stage.className = 'scene';
  const module = decoded($('module').textContent);
  const address = URL.createObjectURL(new Blob([$('worker').textContent], { type: 'text/javascript' }));
  const sources = [...document.querySelectorAll('script[data-bundle]')];
  stage.style.setProperty('--columns', sources.length > 3 ? Math.ceil(Math.sqrt(sources.length)) : sources.length);
  for (const { dataset } of sources) {
    const spread = dataset.spread?.split(' ').map(Number);
    views.push(Object.assign(new View(dataset.bundle, stage), { spread, sharpness: new Sharpness() }));
  }
  const bundles = sources.map((element) => decoded(element.textContent));
  const open = () => Promise.all(views.map((view, i) => view.open(new Worker(address), module, bundles[i])));
  await open();
  const [first, ...others] = views;
  orbit = new Orbit(first.preview);
  motion = new Motion(orbit, draw);
  for (const view of others) {
    if (!isSameCapture(first.normalisation, view.normalisation)) view.orbit = new Orbit(view.preview);
  }
  know();
  offer();
  listen();
  setDevice(false);
  await Promise.all(views.map((view) => view.first));
  // What takes a moment comes after the first picture.
  orbit.refocus(await first.focus());
  for (const view of others) view.orbit?.refocus(await view.focus());
  const placed = place();
  addEventListener('hashchange', place);
  // A second worker for each where cores are idle; the page draws without it, where there is no memory for another.
  if (navigator.hardwareConcurrency >= 4 * views.length) await open().catch(() => {});
  know();
  if (!placed && !matchMedia('(prefers-reduced-motion: reduce)').matches) motion.swayAfter(LOOK_MS);
}

/** Stands where the address says; whether it says so. */
function place() {
  if (location.hash.length < 2) return false;
  const { quarters } = orbit;
  try {
    orbit.place = decodeURIComponent(location.hash.slice(1));
  } catch {
    // Another program's.
    return false;
  }
  if (orbit.quarters !== quarters) {
    for (const view of views) {
      while (view.orbit && view.orbit.quarters !== orbit.quarters) view.orbit.quarter();
      view.spread = undefined;
    }
    know();
  }
  stopSpinning();
  motion.touch();
  return true;
}

/** Tells the motion where the cameras stood. */
function know() {
  motion.seen = views.map((view) => ({ spread: view.spread, home: (view.orbit ?? orbit).home }));
}

/** For scripts: what is on the page, and when it is. */
globalThis.pocketsplat = { views, state, orbit: () => orbit, stopSpinning };
globalThis.pocketsplat.started = start().catch((error) => {
  $('facts').textContent = `This page cannot draw: ${error.message}`;
  $('facts').className = 'bad';
  throw error;
});
