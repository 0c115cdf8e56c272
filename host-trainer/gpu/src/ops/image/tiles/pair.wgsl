@group(0) @binding(0) var<storage, read> splats: array<Splat>;
@group(0) @binding(1) var<storage, read> footprints: array<Footprint>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read> offsets: array<u32>;
@group(0) @binding(4) var<storage, read_write> tile_keys: array<u32>;
@group(0) @binding(5) var<storage, read_write> pairs: array<u32>;
@group(0) @binding(6) var<storage, read_write> slot_of_pair: array<u32>;
@group(0) @binding(7) var<storage, read_write> first_pair: array<u32>;

@compute @workgroup_size(256)
fn pair(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i >= parameters.n_items {
        return;
    }
    let slot = order[i];
    var at = offsets[i];
    first_pair[slot] = at;
    let footprint = footprints[slot];
    if footprint.depth <= 0.0 {
        return;
    }
    let mean = splats[slot].mean_px;
    let x = tiles_along(mean[0], footprint.half_extent_px[0], parameters.size_px[0]);
    let y = tiles_along(mean[1], footprint.half_extent_px[1], parameters.size_px[1]);
    for (var ty = y.first; ty < y.end; ty++) {
        for (var tx = x.first; tx < x.end; tx++) {
            tile_keys[at] = ty * parameters.grid[0] + tx;
            pairs[at] = at;
            slot_of_pair[at] = slot;
            at++;
        }
    }
}
