@group(0) @binding(0) var<storage, read> tile_keys: array<u32>;
@group(0) @binding(1) var<storage, read_write> starts: array<u32>;

// Item i writes the starts of the tiles after that of pair i - 1, up to that of pair i.
@compute @workgroup_size(256)
fn range(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i > parameters.n_items {
        return;
    }
    var first = 0u;
    if i > 0u {
        first = tile_keys[i - 1u] + 1u;
    }
    var last = parameters.grid[0] * parameters.grid[1];
    if i < parameters.n_items {
        last = tile_keys[i];
    }
    for (var tile = first; tile <= last; tile++) {
        starts[tile] = i;
    }
}
