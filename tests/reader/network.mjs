// Integer networks of one hidden layer that predict an anchor's symbols (FORMAT.md, section 7).

const SHIFT = [(shift) => shift <= 31, "at most 31"];
const BIAS = [(bias) => Math.abs(bias) <= 2 ** 29, "a magnitude of at most 2^29"];

export function readNetwork(from, inputs, hidden, outputs) {
  const network = { inputs, hidden, outputs };
  network.shift1 = from.u8s(hidden, "shift1", SHIFT);
  network.shift2 = from.u8s(outputs, "shift2", SHIFT);
  network.b1 = from.i32s(hidden, "b1", BIAS);
  network.b2 = from.i32s(outputs, "b2", BIAS);
  network.w1 = from.i8s(hidden * inputs, "W1");
  network.w2 = from.i8s(outputs * hidden, "W2");
  return network;
}

function layer(weights, biases, shifts, inputs, low, outputs) {
  const n = inputs.length;
  for (let row = 0; row < outputs.length; row++) {
    let sum = biases[row];
    for (let i = 0, at = row * n; i < n; i++, at++) sum = (sum + Math.imul(weights[at], inputs[i])) | 0;
    outputs[row] = Math.min(32767, Math.max(low, sum >> shifts[row]));
  }
}

export function runNetwork(network, inputs) {
  const hidden = new Int32Array(network.hidden);
  const outputs = new Int32Array(network.outputs);
  layer(network.w1, network.b1, network.shift1, inputs, 0, hidden);
  layer(network.w2, network.b2, network.shift2, hidden, -32768, outputs);
  return outputs;
}
