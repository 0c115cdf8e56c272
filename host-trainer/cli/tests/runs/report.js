// Runs in the page of a report: says on the console what works.
const say = (text) => console.log(`pocketsplat: ${text}`);
const check = (holds, what) => say(`${holds ? 'passed' : 'FAILED'} ${what}`);
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
const until = async (holds, what) => {
  for (let i = 0; i < 1200 && !holds(); i++) await sleep(100);
  check(holds(), what);
};
addEventListener('unhandledrejection', (event) => say(`FAILED ${event.reason}`));

const shown = () => [...document.querySelectorAll('.pair')].filter((pair) => !pair.hidden);
check(shown().length === 1, 'one view is shown');
const [pair] = shown();
const picture = pair.querySelector('.over');
const clip = () => getComputedStyle(picture).clipPath;
const slider = pair.querySelector('input');
const before = clip();
slider.value = 900;
slider.dispatchEvent(new Event('input'));
check(clip() !== before && clip().includes('90%'), 'the slider moves the border');
await until(() => /\d of 255/.test(pair.querySelector('canvas + figcaption').textContent), 'the error has a figure');
const canvas = pair.querySelector('canvas');
check(canvas.width === picture.naturalWidth && canvas.height === picture.naturalHeight, 'the error has the picture’s pixels');
const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
check(data.some((value, i) => i % 4 !== 3 && value > 4), 'there is an error to see');
const choices = document.querySelectorAll('input[name="pair"]');
check(choices.length > 1, 'there is more than one view');
choices[choices.length - 1].click();
check(shown().length === 1 && shown()[0] !== pair, 'another view is shown');
check(document.querySelectorAll('.figure svg').length === 1, 'there are learning curves');
check(document.querySelectorAll('section table').length >= 3, 'there are tables');
const ids = [...document.querySelectorAll('[aria-labelledby]')].map((element) => element.getAttribute('aria-labelledby'));
check(ids.every((id) => document.getElementById(id)), 'every section has its title');

const frame = document.querySelector('iframe');
frame.scrollIntoView();
const caption = () => frame.contentWindow?.document.querySelector('figcaption')?.textContent ?? '';
await until(() => /\d (ms|frames)/.test(caption()), 'the viewer draws');
await until(() => frame.contentWindow.document.querySelectorAll('#plan td').length > 3, 'the viewer shows its plan');
check(performance.getEntriesByType('resource').every(({ name }) => name.startsWith('data:') || name.startsWith('about:')), 'nothing was fetched');
say('done');
