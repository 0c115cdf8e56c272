@group(0) @binding(0) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(1) var<storage, read> totals: array<f32>;
@group(0) @binding(2) var<storage, read_write> d_gaussians: array<Gaussian>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_slots || gaussians[slot].opacity <= 0.0 {
        return;
    }
    let scale = gaussians[slot].scale;
    let share = parameters.weight / max(totals[parameters.first_total + 1u], 1.0);
    d_gaussians[slot].scale[0] += share * scale[1] * scale[2];
    d_gaussians[slot].scale[1] += share * scale[0] * scale[2];
    d_gaussians[slot].scale[2] += share * scale[0] * scale[1];
}
