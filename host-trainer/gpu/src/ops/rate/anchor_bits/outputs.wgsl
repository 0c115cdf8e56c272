@group(0) @binding(0) var<storage, read> outputs: array<f32>;
@group(0) @binding(1) var<storage, read> weights: array<f32>;
@group(0) @binding(2) var<storage, read> d_direct: array<f32>;
@group(0) @binding(3) var<storage, read> d_log2_scales: array<f32>;
@group(0) @binding(4) var<storage, read_write> d_values: array<f32>;
@group(0) @binding(5) var<storage, read_write> d_outputs: array<f32>;

@compute @workgroup_size(256)
fn to_outputs(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let c = channel_of(i);
    if c.sample >= parameters.n_sampled {
        return;
    }
    var d_value = d_direct[i];
    if c.group == 0u {
        // The features whose means this one moves.
        let last = min(c.index + parameters.n_taps, parameters.widths[0] - 1u);
        for (var feature = c.index + 1u; feature <= last; feature++) {
            let tap = c.index + min(feature, parameters.n_taps) - feature;
            let weight = weights[parameters.first_tap + first_tap_of(feature) + tap];
            d_value -= d_direct[i + feature - c.index] * weight;
        }
    }
    d_values[i] = d_value;
    let first = first_output(c.sample);
    let exponent = clamped_exponent(outputs[first + 2u * n_channels() + c.group]);
    let unclamped = outputs[first + n_channels() + c.index] - exponent;
    d_outputs[first + c.index] = -d_value * per_base(exponent);
    d_outputs[first + n_channels() + c.index] = clamp_backward(unclamped, parameters.log2_scales, d_log2_scales[i]);
}
