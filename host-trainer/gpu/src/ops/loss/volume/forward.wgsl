@group(0) @binding(0) var<storage, read> gaussians: array<Gaussian>;
@group(0) @binding(1) var<storage, read_write> parts: array<f32>;

// Volume, and 1 where there is a Gaussian.
var<workgroup> sums: array<vec2<f32>, GROUP_THREADS>;

@compute @workgroup_size(256)
fn forward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let slot = item_of(group, thread);
    var own = vec2<f32>(0.0);
    if slot < parameters.n_slots && gaussians[slot].opacity > 0.0 {
        let scale = gaussians[slot].scale;
        own = vec2(scale[0] * scale[1] * scale[2], 1.0);
    }
    sums[thread] = own;
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u && slot < parameters.n_slots {
        let part = group_of(group);
        parts[2u * part] = sums[0].x;
        parts[2u * part + 1u] = sums[0].y;
    }
}
