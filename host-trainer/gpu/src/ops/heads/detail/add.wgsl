@group(0) @binding(0) var<storage, read> residuals: array<f32>;
@group(0) @binding(1) var<storage, read_write> gaussians: array<Gaussian>;

@compute @workgroup_size(256)
fn add(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_items || gaussians[slot].opacity <= 0.0 {
        return;
    }
    for (var i = 0u; i < 3u; i++) {
        gaussians[slot].colour[i] += residuals[3u * slot + i];
    }
}
