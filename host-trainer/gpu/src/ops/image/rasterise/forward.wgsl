@group(0) @binding(0) var<storage, read> splats: array<Splat>;
// [tiles + 1].
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> entries: array<u32>;
@group(0) @binding(3) var<storage, read> slot_of_pair: array<u32>;
// [3, height, width].
@group(0) @binding(4) var<storage, read_write> image: array<f32>;
// [height, width].
@group(0) @binding(5) var<storage, read_write> transmittance: array<f32>;

var<workgroup> n_live: atomic<u32>;
var<workgroup> n_live_read: u32;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let tile = group_of(group);
    if tile >= parameters.n_tiles {
        return;
    }
    let width = parameters.size_px[0];
    let height = parameters.size_px[1];
    let across = (width + TILE_PX - 1u) / TILE_PX;
    let x = tile % across * TILE_PX + thread % TILE_PX;
    let y = tile / across * TILE_PX + thread / TILE_PX;
    let is_inside = x < width && y < height;
    let centre = vec2(f32(x) + 0.5, f32(y) + 0.5);
    var live = is_inside;
    var t = 1.0;
    var colour = vec3(0.0);
    let end = starts[tile + 1u];
    for (var first = starts[tile]; first < end; first += BATCH) {
        if thread == 0u {
            atomicStore(&n_live, 0u);
        }
        workgroupBarrier();
        if live {
            atomicAdd(&n_live, 1u);
        }
        let n = min(BATCH, end - first);
        if thread < n {
            batch[thread] = splats[slot_of_pair[entries[first + thread]]];
        }
        workgroupBarrier();
        if thread == 0u {
            n_live_read = atomicLoad(&n_live);
        }
        if workgroupUniformLoad(&n_live_read) == 0u {
            break;
        }
        if live {
            for (var i = 0u; i < n; i++) {
                let alpha = blend(batch[i], centre).alpha;
                let after = t * (1.0 - alpha);
                if after < TRANSMITTANCE_MIN {
                    live = false;
                    break;
                }
                let weight = alpha * t;
                colour += weight * vec3(batch[i].colour[0], batch[i].colour[1], batch[i].colour[2]);
                t = after;
            }
        }
        workgroupBarrier();
    }
    if is_inside {
        let at = y * width + x;
        let n_pixels = width * height;
        for (var channel = 0u; channel < 3u; channel++) {
            image[channel * n_pixels + at] = colour[channel] + t * parameters.background[channel];
        }
        transmittance[at] = t;
    }
}
