@group(0) @binding(0) var<storage, read> truth: array<u32>;
// [3, height, width].
@group(0) @binding(1) var<storage, read_write> planes: array<f32>;

var<immediate> n_pixels: u32;

@compute @workgroup_size(256)
fn clear_masked(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < 3u * n_pixels && truth[i % n_pixels] >> 24u == 0u {
        planes[i] = 0.0;
    }
}
