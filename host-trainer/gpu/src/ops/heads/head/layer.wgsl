// x·Wᵀ + b.

@group(0) @binding(0) var<storage, read> layer_input: array<f32>;
@group(0) @binding(1) var<storage, read> weights: array<f32>;
@group(0) @binding(2) var<storage, read_write> layer_output: array<f32>;

fn left_of(row: u32, depth: u32) -> f32 {
    return layer_input[row * parameters.input_stride + depth];
}

fn right_of(depth: u32, column: u32) -> f32 {
    return weights[parameters.first_weight + column * parameters.depth + depth];
}

@compute @workgroup_size(256)
fn layer(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let tile = tile_of(group_of(group), thread);
    let sums = product(tile, thread, 0u, parameters.depth);
    if tile.column >= parameters.n_columns {
        return;
    }
    let bias = weights[parameters.first_bias + tile.column];
    for (var i = 0u; i < 4u; i++) {
        let row = tile.first_row + 16u * i;
        if row < parameters.n_rows {
            var value = sums[i] + bias;
            if parameters.is_rectified != 0u {
                value = max(value, 0.0);
            }
            layer_output[row * parameters.n_columns + tile.column] = value;
        }
    }
}
