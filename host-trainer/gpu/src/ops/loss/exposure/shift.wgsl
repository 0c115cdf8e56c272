// [3, height, width], as the next.
@group(0) @binding(0) var<storage, read> image: array<f32>;
@group(0) @binding(1) var<storage, read_write> shown: array<f32>;

@compute @workgroup_size(256)
fn shift(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < 3u * parameters.n_pixels {
        shown[i] = gain_of(i) * (image[i] + parameters.foot) - parameters.foot;
    }
}
