// One workgroup, which goes over all sums.

@group(0) @binding(0) var<storage, read_write> sums: array<u32>;
@group(0) @binding(1) var<storage, read_write> total: array<u32>;

@compute @workgroup_size(256)
fn scan_sums(@builtin(local_invocation_index) thread: u32) {
    var before = 0u;
    for (var start = 0u; start < n_values; start += GROUP_THREADS) {
        let i = start + thread;
        var value = 0u;
        if i < n_values {
            value = sums[i];
        }
        let found = scan_group(thread, value);
        if i < n_values {
            sums[i] = before + found.before;
        }
        before += found.all;
    }
    if thread == 0u {
        total[0] = before;
    }
}
