// The sum of one value of each thread of a workgroup, and the sum of those before.

const PER_THREAD: u32 = 8u;

var<immediate> n_values: u32;
var<workgroup> partial: array<u32, GROUP_THREADS>;

struct Sums {
    before: u32,
    all: u32,
}

fn scan_group(thread: u32, value: u32) -> Sums {
    partial[thread] = value;
    for (var step = 1u; step < GROUP_THREADS; step *= 2u) {
        workgroupBarrier();
        var left = 0u;
        if thread >= step {
            left = partial[thread - step];
        }
        workgroupBarrier();
        partial[thread] += left;
    }
    workgroupBarrier();
    let sums = Sums(partial[thread] - value, partial[GROUP_THREADS - 1u]);
    workgroupBarrier();
    return sums;
}
