@group(0) @binding(0) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(1) var<storage, read_write> parts: array<f32>;

var<workgroup> sums: array<f32, GROUP_THREADS>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    var own = 0.0;
    if slot < parameters.n_slots {
        own = gaussians[slot].opacity;
    }
    sums[thread] = own;
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u && slot < parameters.n_slots {
        parts[group_of(group)] = sums[0];
    }
}
