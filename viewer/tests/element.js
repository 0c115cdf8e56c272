// Runs in the package's example: says on the console what the element does.
const say = (text) => console.log(`pocketsplat: ${text}`);
const check = (holds, what) => say(`${holds ? 'passed' : 'FAILED'} ${what}`);
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
addEventListener('unhandledrejection', (event) => say(`FAILED ${event.reason}`));

const { Scene } = await import('./pocketsplat.js');
const view = document.querySelector('pocketsplat-view');
const canvas = () => view.shadowRoot.querySelector('canvas');
const message = () => view.shadowRoot.querySelector('p');

/** What the element says next of `load` and `error`. */
const next = () => new Promise((resolve) => ['load', 'error'].forEach((name) => view.addEventListener(name, resolve, { once: true })));
const isDrawn = () => canvas()?.style.visibility === '' && message().hidden;

function pixelsOf(canvas) {
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  return copy.getImageData(0, 0, canvas.width, canvas.height).data;
}

/** The same camera by hand. */
async function expected(address, settings = {}) {
  const scene = await Scene.open(await (await fetch('pocketsplat.wasm')).arrayBuffer(), await (await fetch(address)).arrayBuffer());
  const { width: widthPx, height: heightPx } = canvas();
  scene.bind({ widthPx, heightPx, ...settings });
  return scene.render(view.orbit.camera(widthPx, heightPx)).pixels;
}

/** Once it has been at rest for a while. */
async function isSame(address, settings) {
  await sleep(1500);
  const [found, wanted] = [pixelsOf(canvas()), await expected(address, settings)];
  return found.length === wanted.length && found.every((x, i) => x === wanted[i]);
}

for (let i = 0; i < 600 && !isDrawn(); i++) await sleep(100);
check(isDrawn(), 'a first picture');
const nRead = performance.getEntriesByType('resource').filter(({ name }) => name.endsWith('/scene.psb')).length;
check(nRead === 1, `the bundle is read once: ${nRead}`);
check(view.bundle.nAnchors === 310, 'it says what the bundle is');
check(await isSame('scene.psb'), 'the pixels are the decoder’s');
const { widthPx } = view.bundle;
check(canvas().width >= widthPx, `as sharp as it was trained: ${canvas().width}`);

const before = view.orbit.place;
view.focus();
check(view.shadowRoot.activeElement === canvas().parentElement, 'it takes the keyboard');
canvas().parentElement.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft', bubbles: true, cancelable: true }));
check(view.orbit.place !== before, 'an arrow key turns');
check(await isSame('scene.psb'), 'and draws');
view.orbit.place = before;
view.draw();
check(await isSame('scene.psb'), 'a script moves it');

view.setAttribute('tiers', '1');
check(await isSame('scene.psb', { tiers: 1 }), 'fewer tiers');
view.removeAttribute('tiers');
view.setAttribute('quality', 'draft');
check(await isSame('scene.psb', { quality: 'draft' }), 'another quality');
view.setAttribute('quality', 'fast');
await sleep(500);
check(!message().hidden && message().textContent.includes('"fast"'), `what is refused is said: ${message().textContent}`);
check(getComputedStyle(message()).color === 'rgb(255, 255, 255)', 'and can be read');
view.orbit.turn(0.1, 0);
view.draw();
await sleep(1000);
check(!message().hidden, 'of the next picture too');
view.orbit.place = before;
view.removeAttribute('quality');
check((await isSame('scene.psb')) && message().hidden, 'and forgotten');

let said = next();
view.src = 'other.psb';
check((await said).type === 'load' && (await isSame('other.psb')), 'another bundle');
check(view.shadowRoot.querySelectorAll('canvas').length === 1, 'in place of the first');

for (const [address, words] of [['damaged.psb', 'not a bundle'], ['nothing.psb', '404']]) {
  said = next();
  view.src = address;
  const event = await said;
  check(event.type === 'error' && event.message.includes(words) && message().textContent.includes(address), `${address}: ${event.message}`);
}
said = next();
view.src = 'scene.psb';
check((await said).type === 'load' && message().hidden, 'it recovers');

view.toggleAttribute('spin');
const still = view.orbit.place;
await sleep(1000);
check(view.orbit.place !== still, 'it spins');
view.toggleAttribute('spin');
const stopped = view.orbit.place;
await sleep(500);
check(view.orbit.place === stopped, 'and stops');
view.setAttribute('alt', 'A cup');
const named = [canvas(), canvas().parentElement].map((part) => part.getAttribute('aria-label'));
check(named.every((name) => name === 'A cup'), `it has a name: ${named}`);

const main = document.querySelector('main');
view.remove();
check(!view.shadowRoot.querySelector('canvas'), 'taken out it keeps nothing');
said = next();
main.append(view);
check((await said).type === 'load', 'put back it draws');
say('done');
