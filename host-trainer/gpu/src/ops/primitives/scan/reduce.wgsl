@group(0) @binding(0) var<storage, read> values: array<u32>;
@group(0) @binding(1) var<storage, read_write> sums: array<u32>;

@compute @workgroup_size(256)
fn reduce(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let first = item_of(group, thread) * PER_THREAD;
    var sum = 0u;
    for (var i = first; i < min(first + PER_THREAD, n_values); i++) {
        sum += values[i];
    }
    let sums_of_group = scan_group(thread, sum);
    if thread == 0u && first < n_values {
        sums[group_of(group)] = sums_of_group.all;
    }
}
