@group(0) @binding(0) var<storage, read_write> values: array<u32>;
@group(0) @binding(1) var<storage, read> sums: array<u32>;

@compute @workgroup_size(256)
fn scan_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let first = item_of(group, thread) * PER_THREAD;
    let end = min(first + PER_THREAD, n_values);
    var sum = 0u;
    for (var i = first; i < end; i++) {
        sum += values[i];
    }
    let found = scan_group(thread, sum);
    if first >= n_values {
        return;
    }
    var before = sums[group_of(group)] + found.before;
    for (var i = first; i < end; i++) {
        let value = values[i];
        values[i] = before;
        before += value;
    }
}
