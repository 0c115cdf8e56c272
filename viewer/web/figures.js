// Numbers as people read them.

const STAGES = [
  ['decode', '#0072b2'],
  ['context', '#56b4e9'],
  ['heads', '#009e73'],
  ['project', '#f0e442'],
  ['sort', '#999999'],
  ['blend', '#e69f00'],
  ['output', '#cc79a7'],
];

export const count = (n) => Math.round(n).toLocaleString('en');
/** As the report of a run writes them. */
export const bytes = (n) => {
  const short = (n) => n.toFixed(n < 100 ? 2 : 0);
  if (n >= 2 ** 30) return `${short(n / 2 ** 30)} GiB`;
  if (n >= 2 ** 20) return `${short(n / 2 ** 20)} MiB`;
  return n >= 10 * 1024 ? `${(n / 1024).toFixed(0)} KiB` : `${count(n)} B`;
};
export const percent = (part) => `${(100 * part).toFixed(part > 0 && part < 0.1 ? 1 : 0)} %`;
const instructions = (n) => (n >= 1e9 ? `${(n / 1e9).toFixed(2)} billion` : `${(n / 1e6).toFixed(1)} million`);
const duration = (milliseconds) => `${milliseconds.toFixed(milliseconds < 10 ? 1 : 0)} ms`;

/** Rows of a table: a title, and a cell for each view. What says the same as before stays, so that nothing is read aloud again. */
function fill(table, views, rows) {
  const texts = rows.map(([title, cell]) => [title, views.map((view) => cell(view) ?? '–')]);
  const said = JSON.stringify([views.map((view) => view.name), texts]);
  if (table.said === said) return;
  table.said = said;
  const line = (title, cells, tag = 'td') => {
    const row = document.createElement('tr');
    // The corner above the titles is nobody's head.
    const head = row.appendChild(document.createElement(title ? 'th' : 'td'));
    if (title) head.scope = 'row';
    head.textContent = title;
    for (const cell of cells) {
      const place = row.appendChild(document.createElement(tag));
      if (tag === 'th') place.scope = 'col';
      place.textContent = cell;
    }
    return row;
  };
  const lines = texts.map(([title, cells]) => line(title, cells));
  if (views.length > 1) lines.unshift(line('', views.map((view) => view.name), 'th'));
  table.replaceChildren(...lines);
}

function anchorsAre({ isBaked, keepsSums, isResident }) {
  if (isBaked) return 'baked';
  return keepsSums ? 'in memory, with sums' : isResident ? 'in memory' : 'streamed';
}

export function showPlans(table, views) {
  const of = (cell) => (view) => (view.plan && !view.refused ? cell(view.plan, view) : undefined);
  const rows = [
    ...(views.length > 1 ? [['Bundle', (view) => bytes(view.bundle.bytes)]] : []),
    ['Scratch memory', of((plan) => `${bytes(plan.scratchBytes)}`)],
    ['Anchors drawn', of((plan) => count(plan.nAnchors))],
    ['Pruning rate', of((plan) => percent(plan.pruningRate))],
    ['PSNR, measured', of((plan) => (Number.isFinite(plan.psnrDb) ? `${plan.psnrDb.toFixed(2)} dB` : undefined))],
    ['Anchors are', of(anchorsAre)],
    ['Strips', of((plan) => count(plan.nStrips))],
    ['Slabs, at most', of((plan) => count(plan.nSlabs))],
    ['Room for splats', of((plan) => count(plan.maxSplats))],
    ['Network weights', of((plan) => (plan.isBaked ? undefined : plan.halfWeights ? '16 bits' : '32 bits'))],
  ];
  fill(table, views, rows);
}

export function showFrames(table, views) {
  const of = (cell) => (view) => (view.frame && !view.refused ? cell(view.frame) : undefined);
  const rows = [
    ['Size', of((frame) => `${frame.widthPx}×${frame.heightPx}`)],
    ['Drawn here in', of((frame) => duration(frame.milliseconds))],
    ['Splats', of((frame) => count(frame.splats))],
    ['Splats left out', of((frame) => count(frame.splatsDropped))],
    ['Anchors evaluated', of((frame) => count(frame.anchorsVisible))],
    ['Memory used', of((frame) => bytes(frame.scratchUsed))],
  ];
  fill(table, views, rows);
}

/** Predicted instructions by stage, of a board's own display its seconds too: a bar for each view, one legend. */
export function showInstructions(place, views, { value: target, dataset: { hertz, cycles } }, isDevice) {
  const parts = [];
  for (const view of views) {
    if (!view.frame || view.refused) continue;
    const stages = view.frame.instructions[target];
    const all = Object.values(stages).reduce((sum, n) => sum + n, 0);
    const total = document.createElement('div');
    total.className = 'total';
    const seconds = hertz && isDevice ? `, ${((all * cycles) / hertz).toFixed(2)} s` : '';
    const textContent = instructions(all) + seconds;
    total.append(views.length > 1 ? view.name : 'Predicted', Object.assign(document.createElement('b'), { textContent }));
    const bar = document.createElement('div');
    bar.className = 'bar';
    bar.setAttribute('role', 'img');
    bar.setAttribute('aria-label', STAGES.map(([stage]) => `${stage} ${percent(stages[stage] / all)}`).join(', '));
    for (const [stage, colour] of STAGES) {
      const part = bar.appendChild(document.createElement('i'));
      part.style.cssText = `flex:${stages[stage] / all} 0 0; background:${colour}`;
      part.title = `${stage}: ${instructions(stages[stage])}`;
    }
    parts.push(total, bar);
  }
  const legend = document.createElement('ul');
  legend.className = 'legend';
  for (const [stage, colour] of STAGES) {
    const item = legend.appendChild(document.createElement('li'));
    item.appendChild(document.createElement('i')).style.background = colour;
    item.append(stage);
  }
  place.replaceChildren(...parts, legend);
}

/** Why there is no picture, and what to do. */
function refusal({ refused, limits }, ramBytes) {
  if (!(ramBytes < limits?.leastBytes)) return refused;
  return `needs ${bytes(Math.ceil(limits.leastBytes / 1024) * 1024)}: move Memory to the right`;
}

/** What stands below a picture. */
export function caption(view, ramBytes, framesPerSecond) {
  if (view.refused) return `${view.name}: ${refusal(view, ramBytes)}`;
  const { splatsDropped, milliseconds, widthPx, heightPx } = view.frame;
  const speed = framesPerSecond ? `at ${framesPerSecond.toFixed(0)} frames/s` : `in ${duration(milliseconds)}`;
  const lost = splatsDropped ? `, ${count(splatsDropped)} splats left out` : '';
  return `${view.name} · ${bytes(view.bundle.bytes)} · ${widthPx}×${heightPx} ${speed}${lost}`;
}
