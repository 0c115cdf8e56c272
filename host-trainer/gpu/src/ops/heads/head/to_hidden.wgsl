// d_output·W2 where the hidden unit is on.

@group(0) @binding(2) var<storage, read> hidden: array<f32>;
@group(0) @binding(3) var<storage, read_write> d_hidden: array<f32>;

@compute @workgroup_size(256)
fn to_hidden(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let tile = tile_of(group_of(group), thread);
    let sums = product(tile, thread, 0u, parameters.depth);
    for (var i = 0u; i < 4u; i++) {
        let row = tile.first_row + 16u * i;
        if row < parameters.n_rows && tile.column < parameters.n_columns {
            let at = row * parameters.n_columns + tile.column;
            d_hidden[at] = select(0.0, sums[i], hidden[at] > 0.0);
        }
    }
}
