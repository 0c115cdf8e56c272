@group(0) @binding(0) var<storage, read> steps: array<f32>;
@group(0) @binding(1) var<storage, read_write> values: array<f32>;
@group(0) @binding(2) var<storage, read_write> residuals: array<f32>;

@compute @workgroup_size(256)
fn rounded(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let row = i / parameters.width;
    if row >= parameters.n_rows {
        return;
    }
    let step = steps[3u * row + parameters.group];
    let quotient = values[i] / step;
    // Ties to even; the range of the coder.
    let symbol = clamp(round(quotient), -32767.0, 32767.0);
    residuals[i] = symbol - quotient;
    values[i] = symbol * step;
}
