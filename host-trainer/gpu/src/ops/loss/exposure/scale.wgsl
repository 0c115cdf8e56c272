// [3, height, width].
@group(0) @binding(0) var<storage, read_write> d_planes: array<f32>;

@compute @workgroup_size(256)
fn scale(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < 3u * parameters.n_pixels {
        d_planes[i] *= gain_of(i);
    }
}
