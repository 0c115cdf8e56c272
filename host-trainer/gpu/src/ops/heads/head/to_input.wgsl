// d_hidden·W1, added to the first columns of d_input.

@group(0) @binding(2) var<storage, read_write> d_input: array<f32>;

@compute @workgroup_size(256)
fn to_input(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let tile = tile_of(group_of(group), thread);
    let sums = product(tile, thread, 0u, parameters.depth);
    for (var i = 0u; i < 4u; i++) {
        let row = tile.first_row + 16u * i;
        if row < parameters.n_rows && tile.column < parameters.n_columns {
            d_input[row * parameters.input_stride + tile.column] += sums[i];
        }
    }
}
