@group(0) @binding(0) var<storage, read> order: array<u32>;
@group(0) @binding(1) var<storage, read> n_tiles: array<u32>;
@group(0) @binding(2) var<storage, read_write> n_tiles_by_depth: array<u32>;

@compute @workgroup_size(256)
fn gather(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < parameters.n_items {
        n_tiles_by_depth[i] = n_tiles[order[i]];
    }
}
