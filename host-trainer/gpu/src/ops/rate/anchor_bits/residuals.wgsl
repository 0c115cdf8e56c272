@group(0) @binding(0) var<storage, read> outputs: array<f32>;
@group(0) @binding(1) var<storage, read> rows: array<u32>;
@group(0) @binding(2) var<storage, read> features: array<f32>;
@group(0) @binding(3) var<storage, read> log_scales: array<f32>;
@group(0) @binding(4) var<storage, read> offsets: array<f32>;
@group(0) @binding(5) var<storage, read_write> residuals: array<f32>;

@compute @workgroup_size(256)
fn residuals_of_means(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let c = channel_of(i);
    if c.sample >= parameters.n_sampled {
        return;
    }
    let at = rows[c.sample] * parameters.widths[c.group] + c.of_group;
    var value: f32;
    if c.group == 0u {
        value = features[at];
    } else if c.group == 1u {
        value = log_scales[at];
    } else {
        value = offsets[at];
    }
    let first = first_output(c.sample);
    let scale = per_base(clamped_exponent(outputs[first + 2u * n_channels() + c.group]));
    residuals[i] = value * (scale / parameters.base_steps[c.group]) - outputs[first + c.index] * scale;
}
