'use strict';

/** Mean difference of the channels that is drawn brightest, in steps of 8 bit. */
const BRIGHTEST = 64;
/** From no error to that: black, purple, orange, pale yellow. */
const COLOURS = [[0, 0, 4], [87, 16, 110], [188, 55, 84], [249, 142, 9], [252, 255, 164]];

function colour(error) {
  const at = Math.min(error / BRIGHTEST, 1) * (COLOURS.length - 1);
  const i = Math.min(Math.floor(at), COLOURS.length - 2);
  return COLOURS[i].map((low, channel) => low + (at - i) * (COLOURS[i + 1][channel] - low));
}

/** The pixels of an image, red, green, blue and opacity. */
function pixels(image) {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, canvas.width, canvas.height);
}

/** Draws where two images differ, and returns the mean difference of a channel. */
function drawError(canvas, photograph, picture) {
  const [one, other] = [pixels(photograph), pixels(picture)];
  [canvas.width, canvas.height] = [one.width, one.height];
  let sum = 0;
  for (let i = 0; i < one.data.length; i += 4) {
    let error = 0;
    for (let channel = 0; channel < 3; channel++) error += Math.abs(one.data[i + channel] - other.data[i + channel]) / 3;
    sum += error;
    colour(error).forEach((value, channel) => { one.data[i + channel] = value; });
    one.data[i + 3] = 255;
  }
  canvas.getContext('2d').putImageData(one, 0, 0);
  return sum / (one.data.length / 4);
}

async function prepare(pair) {
  const [photograph, picture] = pair.querySelectorAll('img');
  const slider = pair.querySelector('input');
  const place = () => picture.style.setProperty('--at', `${slider.value / 10}%`);
  slider.addEventListener('input', place);
  place();
  await Promise.all([photograph.decode(), picture.decode()]);
  const canvas = pair.querySelector('canvas');
  const mean = drawError(canvas, photograph, picture);
  canvas.nextElementSibling.textContent = `error: ${mean.toFixed(2)} of 255 on average; black is 0, pale yellow ${BRIGHTEST} and more`;
}

for (const pair of document.querySelectorAll('.pair')) prepare(pair);
for (const choice of document.querySelectorAll('input[name="pair"]')) {
  choice.addEventListener('change', () => {
    for (const pair of document.querySelectorAll('.pair')) pair.hidden = pair.dataset.pair !== choice.value;
  });
}
