// d_outputᵀ·[input, 1] over the rows of a part: the gradients of a layer's weights, and in the last column those of its biases.

@group(0) @binding(0) var<storage, read> d_output: array<f32>;
@group(0) @binding(1) var<storage, read> layer_input: array<f32>;
@group(0) @binding(2) var<storage, read_write> parts: array<f32>;

fn left_of(row: u32, depth: u32) -> f32 {
    return d_output[depth * parameters.n_rows + row];
}

fn right_of(depth: u32, column: u32) -> f32 {
    if column + 1u == parameters.n_columns {
        return 1.0;
    }
    return layer_input[depth * parameters.input_stride + column];
}

@compute @workgroup_size(256)
fn weights(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let tile = tile_of(group_of(group), thread);
    let begin = tile.part * parameters.part_rows;
    let end = min(begin + parameters.part_rows, parameters.depth);
    let sums = product(tile, thread, begin, end);
    for (var i = 0u; i < 4u; i++) {
        let row = tile.first_row + 16u * i;
        if tile.part < parameters.n_parts && row < parameters.n_rows && tile.column < parameters.n_columns {
            parts[(tile.part * parameters.n_rows + row) * parameters.n_columns + tile.column] = sums[i];
        }
    }
}
