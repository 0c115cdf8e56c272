@group(0) @binding(0) var<storage, read> image: array<f32>;
@group(0) @binding(1) var<storage, read> truth: array<u32>;
@group(0) @binding(2) var<storage, read_write> d_image: array<f32>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < 3u * parameters.n_pixels {
        let d = difference(image[i], truth_of(truth[i % parameters.n_pixels], i / parameters.n_pixels));
        d_image[i] = parameters.step * sign(d);
    }
}
