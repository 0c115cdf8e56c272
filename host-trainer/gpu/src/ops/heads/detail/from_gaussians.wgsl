@group(0) @binding(0) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(1) var<storage, read> d_gaussians: array<Gaussian>;
@group(0) @binding(2) var<storage, read_write> d_residuals: array<f32>;

@compute @workgroup_size(256)
fn from_gaussians(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_items {
        return;
    }
    let is_drawn = gaussians[slot].opacity > 0.0;
    for (var i = 0u; i < 3u; i++) {
        d_residuals[3u * slot + i] = select(0.0, d_gaussians[slot].colour[i], is_drawn);
    }
}
