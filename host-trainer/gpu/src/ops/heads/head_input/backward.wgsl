@group(0) @binding(0) var<storage, read> d_input: array<f32>;
@group(0) @binding(1) var<storage, read_write> d_features: array<f32>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let row = i / parameters.feature_dim;
    if row < parameters.n_rows {
        d_features[i] += d_input[row * parameters.n_inputs + (i - row * parameters.feature_dim)];
    }
}
