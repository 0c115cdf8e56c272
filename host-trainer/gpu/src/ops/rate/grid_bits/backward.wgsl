@group(0) @binding(0) var<storage, read> rows: array<f32>;
@group(0) @binding(1) var<storage, read> n_positive: array<u32>;
@group(0) @binding(2) var<storage, read_write> d_rows: array<f32>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_values || !(abs(rows[i]) <= 1.0) {
        return;
    }
    // The rarer sign keeps its digits.
    let n = f32(parameters.n_values);
    let most = 1.0 - parameters.margin;
    let positive = clamp(f32(n_positive[0]) / n, parameters.margin, most);
    let negative = clamp(f32(parameters.n_values - n_positive[0]) / n, parameters.margin, most);
    d_rows[i] += 0.5 * parameters.weight * log2_of(negative / positive);
}
