@group(0) @binding(0) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(1) var<storage, read> totals: array<f32>;
@group(0) @binding(2) var<storage, read_write> d_gaussians: array<Gaussian>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot < parameters.n_slots && gaussians[slot].opacity > 0.0 {
        let beyond = totals[parameters.first_total] - parameters.target_sum;
        d_gaussians[slot].opacity += parameters.slope * beyond;
    }
}
