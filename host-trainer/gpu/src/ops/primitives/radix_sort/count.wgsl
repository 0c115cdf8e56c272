@group(0) @binding(0) var<storage, read> keys: array<u32>;
// [digits, blocks].
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;

// Whole numbers: the order of the additions shows nowhere.
var<workgroup> n_of_digit: array<atomic<u32>, N_DIGITS>;

@compute @workgroup_size(256)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let block = group_of(group);
    if thread < N_DIGITS {
        atomicStore(&n_of_digit[thread], 0u);
    }
    workgroupBarrier();
    let first = item_of(group, thread) * PER_THREAD;
    for (var i = first; i < min(first + PER_THREAD, parameters.n_pairs); i++) {
        atomicAdd(&n_of_digit[digit_of(keys[i])], 1u);
    }
    workgroupBarrier();
    if thread < N_DIGITS && block < parameters.n_blocks {
        counts[thread * parameters.n_blocks + block] = atomicLoad(&n_of_digit[thread]);
    }
}
