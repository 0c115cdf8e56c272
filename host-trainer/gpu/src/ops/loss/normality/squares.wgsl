@group(0) @binding(0) var<storage, read> values: array<f32>;
@group(0) @binding(1) var<storage, read> sums: array<f32>;
@group(0) @binding(2) var<storage, read_write> squared: array<f32>;

@compute @workgroup_size(256)
fn squares(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < parameters.n_rows * parameters.width {
        let beyond = values[i] - sums[i % parameters.width] * (1.0 / f32(parameters.n_rows));
        squared[i] = beyond * beyond;
    }
}
