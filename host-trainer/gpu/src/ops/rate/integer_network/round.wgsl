// A thread has a row of weights with its bias, or a tap; the scales are those of integer_model.rs.

@group(0) @binding(0) var<storage, read> weights: array<f32>;
@group(0) @binding(1) var<storage, read_write> rounded: array<f32>;
@group(0) @binding(2) var<storage, read_write> integers: array<i32>;
// [n_hidden + n_out].
@group(0) @binding(3) var<storage, read_write> shifts: array<i32>;

const MIN_WEIGHT_BITS: i32 = -4;
const MAX_WEIGHT_BITS: i32 = 13;
// Half of the format's largest bias: there is room for the half that rounds the shift.
const MAX_BIAS: f32 = 268435456.0;
const TAP_PARTS: f32 = 128.0;

fn power_of_two(exponent: i32) -> f32 {
    return bitcast<f32>(u32(exponent + 127) << 23u);
}

// To the nearest integer, ties away from zero.
fn nearest(x: f32) -> f32 {
    let below = floor(abs(x));
    let magnitude = select(below, below + 1.0, abs(x) - below >= 0.5);
    return select(magnitude, -magnitude, x < 0.0);
}

@compute @workgroup_size(256)
fn round_row(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let row = item_of(group, thread);
    if row >= parameters.n_items {
        return;
    }
    let starts = starts();
    let n_rows = parameters.n_hidden + parameters.n_out;
    if row >= n_rows {
        let tap = starts.w + row - n_rows;
        rounded[tap] = clamp(nearest(weights[tap] * TAP_PARTS), -TAP_PARTS, TAP_PARTS - 1.0) * (1.0 / TAP_PARTS);
        return;
    }
    var first = row * parameters.n_in;
    var n = parameters.n_in;
    var bias_at = starts.x + row;
    var bits_in = INPUT_BITS;
    var bits_out = HIDDEN_BITS;
    if row >= parameters.n_hidden {
        let output = row - parameters.n_hidden;
        first = starts.y + output * parameters.n_hidden;
        n = parameters.n_hidden;
        bias_at = starts.z + output;
        bits_in = HIDDEN_BITS;
        bits_out = output_bits(output);
    }
    var largest = 0.0;
    for (var i = first; i < first + n; i++) {
        largest = max(largest, abs(weights[i]));
    }
    let bias = weights[bias_at];
    var bits = MAX_WEIGHT_BITS;
    while bits > MIN_WEIGHT_BITS
        && (largest * power_of_two(bits) > 127.0 || abs(bias) * power_of_two(bits + bits_in) > MAX_BIAS) {
        bits--;
    }
    for (var i = first; i < first + n; i++) {
        let integer = clamp(nearest(weights[i] * power_of_two(bits)), -128.0, 127.0);
        integers[i] = i32(integer);
        rounded[i] = integer * power_of_two(-bits);
    }
    let shift = bits + bits_in - bits_out;
    let half = select(0, 1 << u32(max(shift - 1, 0)), shift > 0);
    integers[bias_at] = i32(nearest(bias * power_of_two(bits + bits_in))) + half;
    rounded[bias_at] = bias;
    shifts[row] = shift;
}
