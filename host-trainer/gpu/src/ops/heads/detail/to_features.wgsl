// A thread is a feature of an anchor, so that its offsets are added up in their order.

@group(0) @binding(0) var<storage, read> d_input: array<f32>;
@group(0) @binding(1) var<storage, read_write> d_features: array<f32>;

@compute @workgroup_size(256)
fn to_features(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let feature_dim = parameters.n_inputs - 3u;
    let row = i / feature_dim;
    let column = i - row * feature_dim;
    var sum = 0.0;
    for (var k = 0u; k < parameters.n_offsets; k++) {
        sum += d_input[(row * parameters.n_offsets + k) * parameters.n_inputs + column];
    }
    d_features[i] += sum;
}
