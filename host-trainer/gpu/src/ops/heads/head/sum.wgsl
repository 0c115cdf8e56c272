// Adds the parts of a layer's gradients one after the other.

@group(0) @binding(0) var<storage, read> parts: array<f32>;
@group(0) @binding(1) var<storage, read_write> d_weights: array<f32>;

@compute @workgroup_size(256)
fn sum(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    let n = parameters.n_rows * parameters.n_columns;
    if i >= n {
        return;
    }
    var total = 0.0;
    for (var part = 0u; part < parameters.n_parts; part++) {
        total += parts[part * n + i];
    }
    let row = i / parameters.n_columns;
    let column = i - row * parameters.n_columns;
    var at = parameters.first_weight + row * (parameters.n_columns - 1u) + column;
    if column + 1u == parameters.n_columns {
        at = parameters.first_bias + row;
    }
    d_weights[at] += total;
}
