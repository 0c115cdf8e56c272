// Runs in the page about a run: says on the console what it makes of two answers and of none.
const say = (text) => console.log(`pocketsplat: ${text}`);
const check = (holds, what) => say(`${holds ? 'passed' : 'FAILED'} ${what}`);
const until = async (holds, what) => {
  for (let i = 0; i < 600 && !holds(); i++) await new Promise((resolve) => setTimeout(resolve, 100));
  check(holds(), what);
};
addEventListener('unhandledrejection', (event) => say(`FAILED ${event.reason}`));

check(document.querySelector('svg') && document.querySelector('.facts progress'), 'what was known is there at once');
await until(() => document.querySelector('.newest'), 'what is new is shown');
check(document.querySelectorAll('svg').length === 0, 'in the place of what was');
check(document.title.endsWith('training'), 'it goes on');
await until(() => document.querySelector('.last') || document.getElementById('ended').textContent, 'until the end');
check(document.title.endsWith('ended'), 'which is in the title');
const asked = answers.length;
await new Promise((resolve) => setTimeout(resolve, 4000));
check(answers.length === asked, 'nobody is asked any more');
const ended = document.getElementById('ended').textContent;
check(asked === 1 ? ended === '' : /does not answer.*watch.a\.run;/s.test(ended), `the folder is named where nobody answers: ${ended}`);
say('done');
