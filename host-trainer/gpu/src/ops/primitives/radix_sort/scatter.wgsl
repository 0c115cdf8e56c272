@group(0) @binding(0) var<storage, read> keys: array<u32>;
@group(0) @binding(1) var<storage, read> values: array<u32>;
// [digits, blocks]: pairs that stand before the first of the block with the digit.
@group(0) @binding(2) var<storage, read> starts: array<u32>;
@group(0) @binding(3) var<storage, read_write> sorted_keys: array<u32>;
@group(0) @binding(4) var<storage, read_write> sorted_values: array<u32>;

const HALF: u32 = N_DIGITS / 2u;

// [half of the digits, threads]: how many of its pairs a thread has of digit d in the low 16 bits and of digit d + 8 in the high ones;
// then how many of the block stand before those.
var<workgroup> before: array<u32, HALF * GROUP_THREADS>;
var<workgroup> partial: array<u32, GROUP_THREADS>;

@compute @workgroup_size(256)
fn scatter(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let block = group_of(group);
    let first = item_of(group, thread) * PER_THREAD;
    let end = min(first + PER_THREAD, parameters.n_pairs);
    for (var d = 0u; d < HALF; d++) {
        before[d * GROUP_THREADS + thread] = 0u;
    }
    for (var i = first; i < end; i++) {
        let digit = digit_of(keys[i]);
        before[(digit % HALF) * GROUP_THREADS + thread] += 1u << (16u * (digit / HALF));
    }
    workgroupBarrier();

    // Each digit on its own: thread t adds up the counts of 8 threads of digit t / 32.
    let run = thread * HALF;
    var sum = 0u;
    for (var i = run; i < run + HALF; i++) {
        sum += before[i];
    }
    partial[thread] = sum;
    // 32 sums belong to one digit.
    for (var step = 1u; step < 32u; step *= 2u) {
        workgroupBarrier();
        var left = 0u;
        if thread % 32u >= step {
            left = partial[thread - step];
        }
        workgroupBarrier();
        partial[thread] += left;
    }
    var sum_before = partial[thread] - sum;
    for (var i = run; i < run + HALF; i++) {
        let n = before[i];
        before[i] = sum_before;
        sum_before += n;
    }
    workgroupBarrier();

    for (var i = first; i < end; i++) {
        let key = keys[i];
        let digit = digit_of(key);
        let at = (digit % HALF) * GROUP_THREADS + thread;
        let shift = 16u * (digit / HALF);
        let place = starts[digit * parameters.n_blocks + block] + ((before[at] >> shift) & 0xffffu);
        before[at] += 1u << shift;
        sorted_keys[place] = key;
        sorted_values[place] = values[i];
    }
}
