@group(0) @binding(0) var<storage, read> image: array<f32>;
@group(0) @binding(1) var<storage, read> truth: array<u32>;
@group(0) @binding(2) var<storage, read_write> difference: array<f32>;

@compute @workgroup_size(256)
fn subtract(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    if i < n_values() {
        let n_pixels = parameters.size_px[0] * parameters.size_px[1];
        let channel = i / n_pixels;
        difference[i] = image[i] - f32((truth[i - channel * n_pixels] >> (8u * channel)) & 255u) / 255.0;
    }
}
