@group(0) @binding(0) var<storage, read> high_frequencies: array<f32>;
@group(0) @binding(1) var<storage, read_write> parts: array<f32>;

var<workgroup> sums: array<f32, GROUP_THREADS>;

@compute @workgroup_size(256)
fn squares(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let i = item_of(group, thread);
    var own = 0.0;
    if i < n_values() {
        own = high_frequencies[i] * high_frequencies[i];
    }
    sums[thread] = own;
    for (var width = GROUP_THREADS / 2u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u && i < n_values() {
        parts[group_of(group)] = sums[0];
    }
}
