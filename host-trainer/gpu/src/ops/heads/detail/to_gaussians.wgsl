@group(0) @binding(0) var<storage, read> d_input: array<f32>;
@group(0) @binding(1) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(2) var<storage, read_write> d_gaussians: array<Gaussian>;

@compute @workgroup_size(256)
fn to_gaussians(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    if slot >= parameters.n_items || gaussians[slot].opacity <= 0.0 {
        return;
    }
    for (var i = 0u; i < 3u; i++) {
        d_gaussians[slot].colour[i] += d_input[(slot + 1u) * parameters.n_inputs - 3u + i];
    }
}
