@group(0) @binding(0) var<storage, read> splats: array<Splat>;
@group(0) @binding(1) var<storage, read> footprints: array<Footprint>;
@group(0) @binding(2) var<storage, read_write> depth_keys: array<u32>;
@group(0) @binding(3) var<storage, read_write> slots: array<u32>;
@group(0) @binding(4) var<storage, read_write> n_tiles: array<u32>;

@compute @workgroup_size(256)
fn measure(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_items {
        return;
    }
    slots[slot] = slot;
    let footprint = footprints[slot];
    if footprint.depth <= 0.0 {
        depth_keys[slot] = 0xffffffffu;
        n_tiles[slot] = 0u;
        return;
    }
    let mean = splats[slot].mean_px;
    let x = tiles_along(mean[0], footprint.half_extent_px[0], parameters.size_px[0]);
    let y = tiles_along(mean[1], footprint.half_extent_px[1], parameters.size_px[1]);
    // Depths are positive, so their bits order as they do.
    depth_keys[slot] = bitcast<u32>(footprint.depth);
    n_tiles[slot] = (x.end - x.first) * (y.end - y.first);
}
