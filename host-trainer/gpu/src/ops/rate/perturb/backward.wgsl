@group(0) @binding(0) var<storage, read> d_values: array<f32>;
@group(0) @binding(1) var<storage, read> residuals: array<f32>;
@group(0) @binding(2) var<storage, read_write> d_steps: array<f32>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let row = item_of(group, thread);
    if row >= parameters.n_rows {
        return;
    }
    var sum = 0.0;
    for (var i = row * parameters.width; i < (row + 1u) * parameters.width; i++) {
        sum += d_values[i] * residuals[i];
    }
    d_steps[3u * row + parameters.group] = sum;
}
