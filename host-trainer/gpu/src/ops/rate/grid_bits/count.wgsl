@group(0) @binding(0) var<storage, read> rows: array<f32>;
// Whole numbers: their sum is the same in any order.
@group(0) @binding(1) var<storage, read_write> n_positive: atomic<u32>;

var<workgroup> counts: array<u32, GROUP_THREADS>;

@compute @workgroup_size(256)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    var own = 0u;
    if i < parameters.n_values {
        own = u32(rows[i] >= 0.0);
    }
    counts[thread] = own;
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            counts[thread] += counts[thread + width];
        }
    }
    if thread == 0u {
        atomicAdd(&n_positive, counts[0]);
    }
}
