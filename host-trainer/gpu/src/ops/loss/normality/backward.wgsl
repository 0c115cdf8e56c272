@group(0) @binding(0) var<storage, read> values: array<f32>;
@group(0) @binding(1) var<storage, read> sums: array<f32>;
@group(0) @binding(2) var<storage, read_write> d_values: array<f32>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_rows * parameters.width {
        return;
    }
    let column = i % parameters.width;
    let share = 1.0 / f32(parameters.n_rows);
    let mean = sums[column] * share;
    // Below the floor both functions go on as their tangents.
    let variance = sums[parameters.width + column] * share;
    let floored = max(variance, parameters.variance_floor);
    let root = sqrt(floored);
    let by_deviation = 1.0 / (2.0 * root);
    let deviation = root + (variance - floored) * by_deviation;
    let by_spread = 2.0 * parameters.spread * (deviation - 1.0) * by_deviation;
    let by_variance = parameters.divergence * 0.5 * (1.0 - 1.0 / floored) + by_spread;
    d_values[i] += share * parameters.divergence * mean + share * 2.0 * by_variance * (values[i] - mean);
}
