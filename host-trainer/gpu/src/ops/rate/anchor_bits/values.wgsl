@group(0) @binding(0) var<storage, read> outputs: array<f32>;
@group(0) @binding(1) var<storage, read> rows: array<u32>;
@group(0) @binding(2) var<storage, read> d_values: array<f32>;
@group(0) @binding(3) var<storage, read_write> d_features: array<f32>;
@group(0) @binding(4) var<storage, read_write> d_log_scales: array<f32>;
@group(0) @binding(5) var<storage, read_write> d_offsets: array<f32>;

@compute @workgroup_size(256)
fn to_values(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let c = channel_of(i);
    if c.sample >= parameters.n_sampled {
        return;
    }
    let exponent = clamped_exponent(outputs[first_output(c.sample) + 2u * n_channels() + c.group]);
    let d = d_values[i] * (per_base(exponent) / parameters.base_steps[c.group]);
    let at = rows[c.sample] * parameters.widths[c.group] + c.of_group;
    if c.group == 0u {
        d_features[at] += d;
    } else if c.group == 1u {
        d_log_scales[at] += d;
    } else {
        d_offsets[at] += d;
    }
}
