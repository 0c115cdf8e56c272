// Runs in the page about a run: says on the console what it makes of two answers.
const say = (text) => console.log(`pocketsplat: ${text}`);
const check = (holds, what) => say(`${holds ? 'passed' : 'FAILED'} ${what}`);
const until = async (holds, what) => {
  for (let i = 0; i < 600 && !holds(); i++) await new Promise((resolve) => setTimeout(resolve, 100));
  check(holds(), what);
};
addEventListener('unhandledrejection', (event) => say(`FAILED ${event.reason}`));

const [facts, ended] = [() => document.querySelector('.facts').textContent, document.getElementById('ended')];
await until(() => facts().includes('2 minleft'), 'the time left is shown where it is said');
check(document.querySelector('#newest-of-all'), 'what is new takes the place of what was');
check(document.querySelectorAll('svg').length === 0, 'and what is not there any more has gone');
await until(() => ended.textContent, 'the end is said');
check(ended.textContent === 'The run is finished after 5,000 iterations. Its report: /a/<b>/report.html', ended.textContent);
check(ended.querySelector('code') && facts().includes('137 KiBbundle'), 'with the size of the bundle');
check(document.title.endsWith('ended'), 'and in the title');
const asked = answers.length;
await new Promise((resolve) => setTimeout(resolve, 4000));
check(answers.length === asked, 'nobody is asked any more');
say('done');
