struct Parameters {
    n_values: u32,
    step: f32,
    // Where the biases of both layers start, and the second matrix.
    first_bias: u32,
    second_matrix: u32,
    second_bias: u32,
}

@group(0) @binding(0) var<storage, read> weights: array<f32>;
@group(0) @binding(1) var<storage, read_write> written: array<f32>;

var<immediate> parameters: Parameters;

@compute @workgroup_size(256)
fn write(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_values {
        return;
    }
    let is_bias = (i >= parameters.first_bias && i < parameters.second_matrix) || i >= parameters.second_bias;
    // Ties to even, as symbols.
    written[i] = select(round(weights[i] / parameters.step) * parameters.step, weights[i], is_bias);
}
