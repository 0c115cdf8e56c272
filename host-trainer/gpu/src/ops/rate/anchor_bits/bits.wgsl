@group(0) @binding(0) var<storage, read> outputs: array<f32>;
@group(0) @binding(1) var<storage, read> rows: array<u32>;
@group(0) @binding(2) var<storage, read> mask_logits: array<f32>;
@group(0) @binding(3) var<storage, read> weights: array<f32>;
@group(0) @binding(4) var<storage, read> residuals: array<f32>;
@group(0) @binding(5) var<storage, read_write> bits: array<f32>;
@group(0) @binding(6) var<storage, read_write> d_direct: array<f32>;
@group(0) @binding(7) var<storage, read_write> d_log2_scales: array<f32>;

@compute @workgroup_size(256)
fn bits_of_values(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let c = channel_of(i);
    if c.sample >= parameters.n_sampled {
        return;
    }
    var found = Bits(0.0, 0.0, 0.0);
    let n_offsets = parameters.widths[2] / 3u;
    if c.group < 2u || mask_logits[rows[c.sample] * n_offsets + c.of_group / 3u] > parameters.mask_threshold {
        var moved = 0.0;
        if c.group == 0u {
            let n = min(c.index, parameters.n_taps);
            let first = parameters.first_tap + first_tap_of(c.index);
            for (var tap = 0u; tap < n; tap++) {
                moved += weights[first + tap] * residuals[i - n + tap];
            }
        }
        let first = first_output(c.sample);
        let exponent = clamped_exponent(outputs[first + 2u * n_channels() + c.group]);
        let log2_scale = outputs[first + n_channels() + c.index] - exponent;
        found = bits_of(residuals[i] - moved, clamp(log2_scale, parameters.log2_scales[0], parameters.log2_scales[1]));
    }
    bits[i] = found.bits;
    d_direct[i] = parameters.bit_weight * found.d_value;
    d_log2_scales[i] = parameters.bit_weight * found.d_log2_scale;
}
