// A thread is a group of a sampled anchor.

@group(0) @binding(0) var<storage, read> outputs: array<f32>;
@group(0) @binding(1) var<storage, read> residuals: array<f32>;
@group(0) @binding(2) var<storage, read> d_values: array<f32>;
@group(0) @binding(3) var<storage, read> d_log2_scales: array<f32>;
@group(0) @binding(4) var<storage, read_write> d_outputs: array<f32>;

@compute @workgroup_size(256)
fn to_exponents(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let item = item_of(group, thread);
    let sample = item / 3u;
    if sample >= parameters.n_sampled {
        return;
    }
    let of_group = item - 3u * sample;
    var first = 0u;
    for (var before = 0u; before < of_group; before++) {
        first += parameters.widths[before];
    }
    let first_out = first_output(sample);
    let at = first_out + 2u * n_channels() + of_group;
    let exponent = clamped_exponent(outputs[at]);
    var d_exponent = 0.0;
    for (var index = first; index < first + parameters.widths[of_group]; index++) {
        let i = sample * n_channels() + index;
        d_exponent -= LN_2 * d_values[i] * residuals[i];
        // A scale at the end of its range stays there whatever the step.
        let unclamped = outputs[first_out + n_channels() + index] - exponent;
        if unclamped >= parameters.log2_scales[0] && unclamped <= parameters.log2_scales[1] {
            d_exponent -= d_log2_scales[i];
        }
    }
    d_outputs[at] = clamp_backward(outputs[at], parameters.exponents, d_exponent);
}
