// A workgroup adds up a column.

struct Parameters {
    n_rows: u32,
    n_columns: u32,
    first_total: u32,
}

@group(0) @binding(0) var<storage, read> parts: array<f32>;
@group(0) @binding(1) var<storage, read_write> totals: array<f32>;

var<immediate> parameters: Parameters;
var<workgroup> sums: array<f32, 256>;

@compute @workgroup_size(256)
fn columns(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    var sum = 0.0;
    for (var row = thread; row < parameters.n_rows; row += 256u) {
        sum += parts[row * parameters.n_columns + group.x];
    }
    sums[thread] = sum;
    for (var width = 128u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if thread < width {
            sums[thread] += sums[thread + width];
        }
    }
    if thread == 0u {
        totals[parameters.first_total + group.x] = sums[0];
    }
}
