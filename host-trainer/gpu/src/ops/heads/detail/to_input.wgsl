@group(0) @binding(0) var<storage, read> features: array<f32>;
@group(0) @binding(1) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(2) var<storage, read_write> head_input: array<f32>;

@compute @workgroup_size(256)
fn to_input(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let slot = i / parameters.n_inputs;
    let column = i - slot * parameters.n_inputs;
    let feature_dim = parameters.n_inputs - 3u;
    if column < feature_dim {
        head_input[i] = features[slot / parameters.n_offsets * feature_dim + column];
    } else {
        head_input[i] = gaussians[slot].colour[column - feature_dim];
    }
}
